"""Onboard side of the plant link: the receiver of codec_receive.py, and the actuator and data-link messages out."""

from __future__ import annotations

import math

from flightsw.aircraft import Airframe
from flightsw.icd.codec_receive import PEER_ALL, FlightReceiver
from flightsw.icd.geo import DEFAULT_ORIGIN, Origin, to_geodetic
from flightsw.icd.port import WIRE, D, Port
from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT, ControlScale
from flightsw.icd.texts import answer
from flightsw.icd.wire import BY_NAME
from flightsw.types import Ack, ActuatorCmd, Command, Gain, NavState, SensorFrame

_ACTUATORS = BY_NAME["HIL_ACTUATOR_CONTROLS"]
_FOLLOW = BY_NAME["FOLLOW_TARGET"]
_WIND = BY_NAME["WIND_COV"]
_FIX = BY_NAME["RAW_FIX"]
_NOT_STATED = (math.nan,) * 6  # HIL_GPS has no accuracies, only dilutions of precision


class FlightCodec(FlightReceiver[D]):
    """Codec of one aircraft's plant link, both directions.

    `aircraft` fixes the control scale; `lockstep` is told to the plant in every reply; the rest as in FlightReceiver.
    """

    def __init__(
        self,
        aircraft: Airframe,
        sysid: int,
        origin: Origin = DEFAULT_ORIGIN,
        *,
        peer_sysid: int = 0,
        lockstep: bool = True,
        port: Port[D] = WIRE,  # type: ignore[assignment]
    ) -> None:
        super().__init__(sysid, origin, peer_sysid, port)
        self.send = port.sender(sysid, COMP_AUTOPILOT)
        self._scale = ControlScale(aircraft)
        self._flags = 1 if lockstep else 0

    def actuators(self, cmd: ActuatorCmd) -> D:
        """HIL_ACTUATOR_CONTROLS of a command: deflections over largest travel, `cmd.t_us` echoed."""
        k = self._scale
        return self.send.pack(
            _ACTUATORS,
            cmd.t_us,
            self._flags,
            cmd.aileron / k.aileron,
            cmd.elevator / k.elevator,
            cmd.rudder / k.rudder,
            cmd.throttle,
            cmd.flap / k.flap,
            0.0,
            0.0,
            0.0,
            1.0 if cmd.latch else 0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0xA4 if cmd.armed else 0x24,  # HIL, automatic, and armed
        )

    def actuators_again(self, sent: D, t_us: int) -> D:
        """`actuators` of the command that was sent last, `sent`, for the tick at t_us [us]. Its mode is never 0."""
        return self.send.again(_ACTUATORS, sent, t_us)

    def peer(self, nav: NavState, flags: int = 0) -> D:
        """FOLLOW_TARGET and WIND_COV of a navigation state, in the plant's time, for the other aircraft; an invalid one says so.
        flags: HF_*, what is wrong on board.

        Not the sender's own time: the aircraft share the plant's.
        """
        lat, lon, alt = self.map.encode(nav.pos_n)
        v, a, s = nav.vel_n, nav.acc_n, nav.pos_sigma
        pack, t_us = self.send.pack, max(nav.t_us - self.offset_us, 0)
        state = pack(
            _FOLLOW,
            t_us // 1000,
            flags,
            lat,
            lon,
            alt,
            *v,
            *a,
            *nav.q_nb,
            *nav.w_b,
            s[0] * s[0],
            s[1] * s[1],
            s[2] * s[2],
            PEER_ALL if nav.valid else 0,
        )
        return self.send.join((state, pack(_WIND, t_us, *wind_fields(nav, alt))))

    def fix(self, f: SensorFrame, gained: Gain) -> D:
        """RAW_FIX of a frame's GNSS reading as it came and of the velocity gained, in the plant's time as in `peer`."""
        t_us, end_us = max(f.gnss_t_us - self.offset_us, 0), max(gained.t_us - self.offset_us, 0)
        place = to_geodetic(f.gnss_pos_n, self.origin)
        return self.send.pack(_FIX, t_us, *place, end_us, *f.gnss_vel_n, *_NOT_STATED, gained.span_s, *gained.vel_n)

    def order(self, c: Command) -> D:
        """COMMAND_LONG that hands a command on to the plant."""
        named = {f"param{i + 1}": p for i, p in enumerate(c.params)}
        return self.send.named(
            "COMMAND_LONG", target_system=self.sysid, target_component=COMP_PLANT, command=c.command,
            confirmation=c.confirmation, **named,
        )  # fmt: skip

    def answer(self, a: Ack) -> D:
        """COMMAND_ACK on the plant link, its reason before it."""
        return answer(self.send, a)


def wind_fields(nav: NavState, alt_m: float) -> tuple[float, ...]:
    """Values of WIND_COV after its time, in wire order (wind_x..z, var_horiz, var_vert, wind_alt, accuracies)."""
    nan = math.nan
    if not (nav.valid and nav.wind_valid):
        return (nan, nan, nan, nan, nan, nan, 0.0, 0.0)
    s = nav.wind_sigma
    return (*nav.wind_n, nan, nan, alt_m, max(s[0], s[1]), s[2])
