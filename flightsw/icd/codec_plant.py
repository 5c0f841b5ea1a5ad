"""Plant side of the link to one flightsw: sensor datagrams out, replies in, truth for the log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic

from flightsw.aircraft import Airframe
from flightsw.icd.codec_receive import BARO_BITS, IMU_BITS, MAG_BITS, finite
from flightsw.icd.geo import DEFAULT_ORIGIN, Origin, WireMap
from flightsw.icd.port import WIRE, D, Port
from flightsw.icd.radalt import distance
from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT, FUEL_KG_PER_ML, GROUND_SYSID, PROBES, ControlScale
from flightsw.icd.stamps import boot_ms
from flightsw.icd.texts import Joiner
from flightsw.icd.wire import BY_NAME, Counters, Sender, table
from flightsw.types import (
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_BEARING,
    UPD_BOOM,
    UPD_FUEL,
    UPD_GNSS,
    UPD_IMU,
    UPD_MAG,
    UPD_POSITION,
    UPD_RADALT,
    UPD_RADAR,
    UPD_REL,
    UPD_TACAN,
    Ack,
    ActuatorCmd,
    SensorFrame,
)

ACCEPT = table((
    "HIL_ACTUATOR_CONTROLS", "FOLLOW_TARGET", "WIND_COV", "RAW_FIX", "COMMAND_ACK", "STATUSTEXT", "COMMAND_LONG",
))  # fmt: skip
_ACTUATORS = BY_NAME["HIL_ACTUATOR_CONTROLS"]
_ACK = BY_NAME["COMMAND_ACK"]
_ACK_FIELDS = _ACK.pick("command", "result", "target_system", "target_component", "result_param2")
_TEXT = BY_NAME["STATUSTEXT"]
_ORDER = BY_NAME["COMMAND_LONG"]
_FIX = BY_NAME["RAW_FIX"]
_SENSOR = BY_NAME["HIL_SENSOR"]
_GPS = BY_NAME["HIL_GPS"]
_ATT = BY_NAME["ATTITUDE_QUATERNION"]
_AIR = BY_NAME["AIR_DATA"]
_REL = BY_NAME["REL_NAV"]
_BOOM = BY_NAME["BOOM_STATE"]
_FUEL = BY_NAME["FUEL_STATUS"]
_TACAN = BY_NAME["TACAN"]
_RADAR = BY_NAME["CREW_RADAR"]
_RADALT = BY_NAME["DISTANCE_SENSOR"]
_TRUTH = BY_NAME["TRUTH"]
_IN_HIL_SENSOR = UPD_IMU | UPD_MAG | UPD_BARO  # groups without a packet of their own
# of each combination of them what HIL_SENSOR says is new
_FIELDS = {
    up: (IMU_BITS if up & UPD_IMU else 0) | (MAG_BITS if up & UPD_MAG else 0) | (BARO_BITS if up & UPD_BARO else 0)
    for up in range(_IN_HIL_SENSOR + 1)
}
_U16 = 0xFFFF
_CMD_SHUTDOWN = 246  # MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN


@dataclass(slots=True)
class Reply(Generic[D]):
    """A decoded reply. `link`: raw FOLLOW_TARGET and WIND_COV packets for the radio; `fixes`: raw RAW_FIX, sent on their own;
    `orders`: raw COMMAND_LONG handed on to the plant; `cmd` None: nothing usable."""

    cmd: ActuatorCmd | None = None
    link: Sequence[D] = ()
    fixes: Sequence[D] = ()
    acks: Sequence[Ack] = ()
    orders: Sequence[D] = ()


def _cm16(v: float) -> int:
    """Velocity [m/s] as int16 [cm/s], held at the type's limits."""
    x = round(v * 100.0)
    return x if -32768 <= x <= 32767 else max(-32768, min(32767, x))


class PlantCodec(Generic[D]):
    """Codec of the plant for the aircraft `sysid`, by `port`. `count` holds what was dropped of its replies."""

    def __init__(
        self,
        aircraft: Airframe,
        sysid: int,
        origin: Origin = DEFAULT_ORIGIN,
        port: Port[D] = WIRE,  # type: ignore[assignment]
    ) -> None:
        self.port = port
        self.sysid = sysid
        self.count = Counters()
        self.send = port.sender(sysid, COMP_PLANT)
        self._truth = Sender(sysid, COMP_PLANT)  # its own sequence: truth travels to the log, not over the link
        self._station = port.sender(GROUND_SYSID, COMP_PLANT)
        self._map = WireMap(origin)
        self._scale = ControlScale(aircraft)
        self._capacity_kg = aircraft.fuel_capacity_kg

    def sensors(self, frame: SensorFrame, extra: Sequence[D] = ()) -> D:
        """One tick's datagram: the groups set in `frame.updated`, `extra` packets verbatim, HIL_SENSOR last and always.

        Units and frames as in SensorFrame; `frame.peer` is not encoded (the radio relays raw packets in `extra`).
        """
        up = frame.updated
        out = self._groups(frame, up) if up & ~_IN_HIL_SENSOR else []
        last = self.send.pack(
            _SENSOR, frame.t_us, *frame.acc_b, *frame.gyro_b, *frame.mag_b, frame.pressure_pa * 0.01, 0.0, frame.baro_alt_m,
            0.0, _FIELDS[up & _IN_HIL_SENSOR], 0,
        )  # fmt: skip
        return self.send.join((*out, *extra, last)) if out or extra else last

    def _groups(self, frame: SensorFrame, up: int) -> list[D]:
        """Packets of the groups `up` that have one of their own, in the order of the link."""
        out = []
        if up & UPD_ATT:
            out.append(
                self.send.pack(_ATT, boot_ms(frame.att_t_us), *frame.att_q_nb, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            )
        if up & UPD_GNSS:
            out.append(self._gps(frame))
        if up & UPD_AIR:
            out.append(self._air(frame))
        if up & UPD_REL:
            out.append(
                self.send.pack(_REL, frame.rel_t_us, *frame.rel_pos_t, *frame.rel_vel_t, 1 if frame.rel_valid else 0)
            )
        if up & UPD_BOOM:
            out.append(
                self.send.pack(
                    _BOOM,
                    frame.boom_t_us,
                    frame.boom_elevation,
                    frame.boom_azimuth,
                    frame.boom_extension_m,
                    1 if frame.boom_contact else 0,
                    1 if frame.boom_inside else 0,
                )
            )
        if up & UPD_FUEL:
            out.append(self._fuel(frame))
        if up & UPD_TACAN:
            d, b, at = frame.tacan_range_m, frame.tacan_bearing, frame.tacan_link
            flags = (1 if d is not None else 0) | (2 if b is not None else 0) | (4 if at is not None else 0)
            out.append(self.send.pack(_TACAN, frame.tacan_t_us, d or 0.0, b or 0.0, *(at or (0.0, 0.0)), flags))
        if up & UPD_BEARING:
            out.append(self.send.pack(_TACAN, frame.bearing_t_us, 0.0, frame.bearing, 0.0, 0.0, 2))
        if up & UPD_POSITION:
            out.append(self.send.pack(_TACAN, frame.position_t_us, 0.0, 0.0, *frame.position, 4))
        if up & UPD_RADAR:
            out.append(self.send.pack(_RADAR, frame.radar_t_us, frame.radar_y_m, frame.radar_sigma_m))
        if up & UPD_RADALT:
            out.append(self.send.pack(_RADALT, *distance(frame.radalt_t_us, frame.radalt_m)))
        return out

    def _gps(self, f: SensorFrame) -> D:
        lat, lon, alt = self._map.encode(f.gnss_pos_n)
        vn, ve, vd = f.gnss_vel_n
        ground = math.hypot(vn, ve)
        track = round(math.degrees(math.atan2(ve, vn)) * 100.0) % 36000
        return self.send.pack(
            _GPS,
            f.gnss_t_us,
            lat,
            lon,
            round(alt * 1000.0),
            _U16,
            _U16,
            min(_U16 - 1, round(ground * 100.0)),
            _cm16(vn),
            _cm16(ve),
            _cm16(vd),
            track,
            3,
            255,
            0,
            0,
        )

    def _air(self, f: SensorFrame) -> D:
        n = len(f.air_V)
        if n > PROBES:
            raise ValueError(f"{n} air data probes; AIR_DATA carries at most {PROBES}")
        pad = (0.0,) * (PROBES - n)
        return self.send.pack(_AIR, f.air_t_us, *f.air_V, *pad, *f.air_alpha, *pad, *f.air_beta, *pad, n, f.air_mask)

    def _fuel(self, f: SensorFrame) -> D:
        share = max(0, min(100, round(100.0 * f.fuel_kg / self._capacity_kg)))
        return self.send.named(
            "FUEL_STATUS",
            maximum_fuel=self._capacity_kg / FUEL_KG_PER_ML,
            consumed_fuel=math.nan,
            remaining_fuel=f.fuel_kg / FUEL_KG_PER_ML,
            percent_remaining=share,
            flow_rate=f.fuel_flow_kgps / FUEL_KG_PER_ML,
            temperature=math.nan,
            fuel_type=1,
        )

    def decode_reply(self, datagram: D) -> Reply[D]:
        """Actuator command (SI), data-link packets (raw) and acks with their reasons of one reply. Never raises; rubbish is
        counted.
        """
        packets = self.port.packets(datagram, ACCEPT, self.count)
        if len(packets) == 1 and packets[0][0] is _ACTUATORS:  # as in most ticks
            return Reply(self._command(packets[0][1]))
        cmd: ActuatorCmd | None = None
        link: list[D] = []
        fixes: list[D] = []
        acks: list[Ack] = []
        orders: list[D] = []
        texts: Joiner | None = None
        reasons: dict[int, str] = {}
        for p in packets:
            spec, v, sysid, compid, _, _ = p
            if spec is _ACTUATORS:
                cmd = self._command(v) or cmd
            elif spec is _ACK:
                command, result, system, component, ident = _ACK_FIELDS(v)
                acks.append(Ack(command, result, system, component, reasons.get(ident, "")))
            elif spec is _TEXT:
                f, texts = spec.to_dict(v), texts or Joiner()
                reasons[f["id"]] = texts.take(sysid, compid, f["text"], f["id"], f["chunk_seq"]) or ""
            elif spec is _FIX:
                fixes.append(self.port.part(datagram, p))
            elif spec is _ORDER:
                orders.append(self.port.part(datagram, p))
            else:
                link.append(self.port.part(datagram, p))
        return Reply(cmd, link, fixes, acks, orders)

    def _command(self, v: tuple[Any, ...]) -> ActuatorCmd | None:
        """Of the values of a HIL_ACTUATOR_CONTROLS: time, flags, 16 controls, mode; None for one that is no finite number."""
        if not finite(v[2:18]):
            self.count.non_finite += 1
            return None
        k = self._scale
        return ActuatorCmd(
            v[0], v[2] * k.aileron, v[3] * k.elevator, v[4] * k.rudder, v[5], v[10] > 0.5, bool(v[18] & 0x80),
            v[6] * k.flap,
        )  # fmt: skip

    def command(self, command: int, *params: float) -> D:
        """COMMAND_LONG to this aircraft as if from the ground (sysid 255): scripted events of a scenario."""
        named = {f"param{i + 1}": p for i, p in enumerate(params)}
        return self._station.named(
            "COMMAND_LONG", target_system=self.sysid, target_component=COMP_AUTOPILOT, command=command, **named
        )

    def shutdown(self) -> D:
        """The last datagram of a run: flightsw flushes and exits."""
        return self.send.named(
            "COMMAND_LONG", target_system=self.sysid, target_component=COMP_AUTOPILOT, command=_CMD_SHUTDOWN, param1=2.0
        )

    def truth(self, t_us: int, row: Sequence[float]) -> bytes:
        """TRUTH packet for truth.tlog; row: its values after the time, in wire order (SI, frames as in the ICD)."""
        return self._truth.pack(_TRUTH, t_us, *row)
