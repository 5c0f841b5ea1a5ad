"""Onboard receiver of the plant link: sensor datagrams into a SensorFrame.

Only the messages named in ACCEPT exist for this codec; whatever else arrives is counted and dropped, and nothing that
arrives can raise. A group with a NaN or infinity in it is dropped whole. A group whose stamp is not newer than its last
one, ahead of the tick or long past is dropped (stamps.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Generic

from flightsw.icd.codec_orders import COMMANDS_MAX, OrdersIn
from flightsw.icd.geo import Origin, WireMap, to_local
from flightsw.icd.port import WIRE, D, Port
from flightsw.icd.radalt import height
from flightsw.icd.scaling import FUEL_KG_PER_ML, PROBES
from flightsw.icd.stamps import Samples, from_boot_ms
from flightsw.icd.wire import BY_NAME, Counters, Packet, table
from flightsw.types import (
    NO_GAIN,
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_BEARING,
    UPD_BOOM,
    UPD_FIX,
    UPD_FUEL,
    UPD_GNSS,
    UPD_IMU,
    UPD_MAG,
    UPD_PEER,
    UPD_POSITION,
    UPD_RADALT,
    UPD_RADAR,
    UPD_REL,
    UPD_TACAN,
    Gain,
    SensorFrame,
)

ACCEPT = table((
    "HIL_SENSOR", "HIL_GPS", "ATTITUDE_QUATERNION", "AIR_DATA", "REL_NAV", "BOOM_STATE", "FUEL_STATUS", "TACAN", "CREW_RADAR",
    "DISTANCE_SENSOR", "FOLLOW_TARGET", "WIND_COV", "RAW_FIX", "COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK", "STATUSTEXT",
))  # fmt: skip
HIL_SENSOR = BY_NAME["HIL_SENSOR"]
_FOLLOW = BY_NAME["FOLLOW_TARGET"]
_WIND = BY_NAME["WIND_COV"]
_FIX = BY_NAME["RAW_FIX"]

# HIL_SENSOR_UPDATED bits of each group
IMU_BITS = 0x3F  # gyroscopes and accelerometers
MAG_BITS = 0x1C0  # magnetometer
BARO_BITS = 0xA00  # abs_pressure and pressure_alt
_AIR_LEN = slice(1, 1 + 3 * PROBES)
PEER_ALL = 15  # FOLLOW_TARGET.est_capabilities: position, velocity, acceleration, attitude and rates
_GPS = BY_NAME["HIL_GPS"].pick("time_usec", "fix_type", "lat", "lon", "alt", "vn", "ve", "vd")
_GPS_NO_FIX_BELOW = 3
_ATT = BY_NAME["ATTITUDE_QUATERNION"].pick("time_boot_ms", "q1", "q2", "q3", "q4")
_FUEL = BY_NAME["FUEL_STATUS"].pick("remaining_fuel", "flow_rate")
_PEER_COV, _PEER_FLAGS = _FOLLOW.pick("position_cov"), _FOLLOW.pick("custom_state")
_PEER = _FOLLOW.pick("timestamp", "lat", "lon", "alt", "vel", "acc", "attitude_q", "rates", "est_capabilities")
_FIX_STATE = _FIX.pick("time_usec", "lat", "lon", "alt", "vel")
_FIX_SIGMAS = _FIX.pick("pos_sigma", "vel_sigma")
_FIX_GAIN = _FIX.pick("gain_usec", "gain_s", "gain")
_PEER_WIND = _WIND.pick("time_usec", "wind_x", "wind_y", "wind_z")


GAIN_MOST_S, GAIN_APART_US = 1.0, 1_000_000  # longest time of a gain, and how far from its fix it may end


def finite(values: tuple[float, ...]) -> bool:
    """True if every value is a finite number (sums of wire floats cannot overflow a double)."""
    s = sum(values)
    return s - s == 0.0


class FlightReceiver(Generic[D]):
    """Decoder of one aircraft's plant link, whose datagrams come by `port`.

    `sysid` is the own system id, `origin` fixes the local frame. `peer_sysid`: accept data-link messages of that
    aircraft only (0 = of any other). `count` holds what was dropped. `offset_us` [us] is added to every stamp: onboard time
    less the plant's (stamps.Frames).
    """

    def __init__(self, sysid: int, origin: Origin, peer_sysid: int, port: Port[D] = WIRE) -> None:  # type: ignore[assignment]
        self.port = port
        self.sysid = sysid
        self.peer_sysid = peer_sysid
        self.count = Counters()
        self.origin = origin
        self.map = WireMap(origin)
        self.offset_us = 0
        self.orders = OrdersIn(sysid, self.count)
        self._timely = Samples(self.count).take  # of message id, onboard time [us], time of the tick [us]
        self._now_us = 0
        self._handlers = {
            HIL_SENSOR.id: self._sensor,
            BY_NAME["HIL_GPS"].id: self._gps,
            BY_NAME["ATTITUDE_QUATERNION"].id: self._attitude,
            BY_NAME["AIR_DATA"].id: self._air,
            BY_NAME["REL_NAV"].id: self._relative,
            BY_NAME["BOOM_STATE"].id: self._boom,
            BY_NAME["FUEL_STATUS"].id: self._fuel,
            BY_NAME["TACAN"].id: self._tacan,
            BY_NAME["CREW_RADAR"].id: self._radar,
            BY_NAME["DISTANCE_SENSOR"].id: self._radalt,
            _FOLLOW.id: self._peer_state,
            _WIND.id: self._peer_wind,
            _FIX.id: self._peer_fix,
            BY_NAME["COMMAND_LONG"].id: self.orders.command,
            BY_NAME["COMMAND_INT"].id: self.orders.command,
            BY_NAME["COMMAND_ACK"].id: self.orders.answer,
            BY_NAME["STATUSTEXT"].id: self.orders.text,
        }

    def parse(self, datagram: D) -> tuple[Sequence[Packet], int]:
        """Sound packets of a datagram, the rest being counted, and the stamp [us] of its last HIL_SENSOR, -1 if there is none."""
        packets = self.port.packets(datagram, ACCEPT, self.count)
        for p in reversed(packets):
            if p[0] is HIL_SENSOR:
                return packets, p[1][0]
        return packets, -1

    def apply(self, packets: Sequence[Packet], frame: SensorFrame, now_us: int) -> None:
        """Put parsed packets into `frame`: sets the bits of `updated`, appends commands. Never raises.

        now_us [us]: onboard time of the tick they came with; samples far from it are refused.
        """
        self._now_us = now_us
        handlers = self._handlers
        for p in packets:
            handlers[p[0].id](p, frame)

    def decode(self, datagram: D, frame: SensorFrame) -> None:
        """`parse` and `apply` of one datagram; `updated` and `commands` start empty."""
        frame.updated = 0
        frame.commands.clear()
        self.orders.left = COMMANDS_MAX
        packets, t = self.parse(datagram)
        self.apply(packets, frame, t + self.offset_us if t >= 0 else frame.t_us)

    def _sensor(self, p: Packet, f: SensorFrame) -> None:
        t, ax, ay, az, gx, gy, gz, mx, my, mz, pressure, _, alt, _, fields, _ = p[1]
        t += self.offset_us
        f.t_us = t
        if f.fuel_t_us < 0:
            f.fuel_t_us = t
        if fields & IMU_BITS == IMU_BITS:
            s = ax + ay + az + gx + gy + gz
            if s - s == 0.0:
                f.acc_b = (ax, ay, az)
                f.gyro_b = (gx, gy, gz)
                f.updated |= UPD_IMU
            else:
                self.count.non_finite += 1
        if fields & MAG_BITS == MAG_BITS:
            s = mx + my + mz
            if s - s == 0.0:
                f.mag_b = (mx, my, mz)
                f.updated |= UPD_MAG
            else:
                self.count.non_finite += 1
        if fields & BARO_BITS == BARO_BITS:
            s = pressure + alt
            if s - s == 0.0:
                f.pressure_pa = pressure * 100.0
                f.baro_alt_m = alt
                f.updated |= UPD_BARO
            else:
                self.count.non_finite += 1

    def _gps(self, p: Packet, f: SensorFrame) -> None:
        t, fix, lat, lon, alt, vn, ve, vd = _GPS(p[1])
        t += self.offset_us
        if not self._timely(p[0].id, t, self._now_us) or fix < _GPS_NO_FIX_BELOW:
            return
        f.gnss_t_us = t
        f.gnss_pos_n = self.map.decode(lat, lon, alt * 1e-3)
        f.gnss_vel_n = (vn * 1e-2, ve * 1e-2, vd * 1e-2)
        f.updated |= UPD_GNSS

    def _attitude(self, p: Packet, f: SensorFrame) -> None:
        ms, w, x, y, z = _ATT(p[1])
        norm2 = w * w + x * x + y * y + z * z
        if norm2 - norm2 != 0.0 or not 0.25 < norm2 < 4.0:  # a rotation, give or take the wire's rounding
            self.count.non_finite += 1
            return
        t = from_boot_ms(ms, self._now_us - self.offset_us) + self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        k = 1.0 / math.sqrt(norm2)
        f.att_t_us = t
        f.att_q_nb = (w * k, x * k, y * k, z * k)
        f.updated |= UPD_ATT

    def _air(self, p: Packet, f: SensorFrame) -> None:
        v = p[1]
        t, n, mask = v[0], min(v[-2], PROBES), v[-1]
        data = v[_AIR_LEN]
        t += self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        speed, alpha, beta = data[:n], data[PROBES : PROBES + n], data[2 * PROBES : 2 * PROBES + n]
        mask &= (1 << n) - 1
        s = sum(data)
        if (
            s - s != 0.0
        ):  # look which reading it is: it stays NaN, which health refuses by its range, and no other is lost
            for i in range(n):
                if mask >> i & 1:
                    self.count.non_finite += sum(not math.isfinite(x) for x in (speed[i], alpha[i], beta[i]))
        f.air_t_us, f.air_mask = t, mask
        f.air_V, f.air_alpha, f.air_beta = speed, alpha, beta
        f.updated |= UPD_AIR

    def _relative(self, p: Packet, f: SensorFrame) -> None:
        t, x, y, z, vx, vy, vz, valid = p[1]
        s = x + y + z + vx + vy + vz
        if valid and s - s != 0.0:
            self.count.non_finite += 1
            return
        t += self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        f.rel_t_us = t
        f.rel_valid = bool(valid)
        if valid:
            f.rel_pos_t = (x, y, z)
            f.rel_vel_t = (vx, vy, vz)
        f.updated |= UPD_REL

    def _boom(self, p: Packet, f: SensorFrame) -> None:
        t, elevation, azimuth, extension, contact, inside = p[1]
        s = elevation + azimuth + extension
        if s - s != 0.0:
            self.count.non_finite += 1
            return
        t += self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        f.boom_t_us = t
        f.boom_elevation, f.boom_azimuth, f.boom_extension_m = elevation, azimuth, extension
        f.boom_contact, f.boom_inside = bool(contact), bool(inside)
        f.updated |= UPD_BOOM

    def _fuel(self, p: Packet, f: SensorFrame) -> None:
        remaining, flow = _FUEL(p[1])
        s = remaining + flow
        if s - s != 0.0:
            self.count.non_finite += 1
            return
        # the message has no stamp of its own: the HIL_SENSOR that follows gives it the tick's time
        f.fuel_t_us = -1
        f.fuel_kg = remaining * FUEL_KG_PER_ML
        f.fuel_flow_kgps = flow * FUEL_KG_PER_ML
        f.updated |= UPD_FUEL

    def _tacan(self, p: Packet, f: SensorFrame) -> None:
        t, distance, bearing, north, east, flags = p[1]
        s = distance + bearing + north + east
        if s - s != 0.0 or distance < 0.0:
            self.count.non_finite += 1
            return
        alone = flags & 7 if not flags & 1 else 0
        # what comes by itself is a kind of its own: it may be older than a range, and is in order all the same
        t += self.offset_us
        if not self._timely(p[0].id + (alone << 24), t, self._now_us):
            return
        if alone:
            if alone & 2:
                f.bearing_t_us, f.bearing = t, bearing
                f.updated |= UPD_BEARING
            if alone & 4:
                f.position_t_us, f.position = t, (north, east)
                f.updated |= UPD_POSITION
            return
        f.tacan_t_us = t
        f.tacan_range_m = distance if flags & 1 else None
        f.tacan_bearing = bearing if flags & 2 else None
        f.tacan_link = (north, east) if flags & 4 else None
        f.updated |= UPD_TACAN

    def _radar(self, p: Packet, f: SensorFrame) -> None:
        t, lateral, sigma = p[1]
        s = lateral + sigma
        if s - s != 0.0 or sigma <= 0.0:
            self.count.non_finite += 1
            return
        t += self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        f.radar_t_us = t
        f.radar_y_m, f.radar_sigma_m = lateral, sigma
        f.updated |= UPD_RADAR

    def _radalt(self, p: Packet, f: SensorFrame) -> None:
        h = height(p[1])
        if h is None:
            self.count.unknown += 1
            return
        t = from_boot_ms(p[1][0], self._now_us - self.offset_us) + self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        f.radalt_t_us, f.radalt_m = t, h
        f.updated |= UPD_RADALT

    def _is_peer(self, sysid: int) -> bool:
        return sysid == self.peer_sysid if self.peer_sysid else sysid != self.sysid

    def _peer_state(self, p: Packet, f: SensorFrame) -> None:
        if not self._is_peer(p[2]):
            self.count.unknown += 1
            return
        v = _PEER(p[1])
        if v[-1] & PEER_ALL != PEER_ALL:  # the sender has no solution
            return
        if not finite(v[3:-1]):
            self.count.non_finite += 1
            return
        t = v[0] * 1000 + self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        peer = f.peer
        peer.t_us = t
        peer.pos_n = self.map.decode(v[1], v[2], v[3])
        peer.vel_n, peer.acc_n, peer.q_nb, peer.w_b = v[4:7], v[7:10], v[10:14], v[14:17]
        a, b, c = [math.sqrt(s) if 0.0 <= s < math.inf else 0.0 for s in _PEER_COV(p[1])]
        peer.pos_sigma = (a, b, c)
        peer.flags = _PEER_FLAGS(p[1])
        peer.wind_valid = False  # until the WIND_COV that belongs to it
        f.updated |= UPD_PEER

    def _peer_wind(self, p: Packet, f: SensorFrame) -> None:
        if not self._is_peer(p[2]):
            self.count.unknown += 1
            return
        t, x, y, z = _PEER_WIND(p[1])
        s = x + y + z
        if t + self.offset_us != f.peer.t_us or s - s != 0.0:  # NaN = the sender has no estimate, not an error
            return
        f.peer.wind_n = (x, y, z)
        f.peer.wind_valid = True

    def _peer_fix(self, p: Packet, f: SensorFrame) -> None:
        if not self._is_peer(p[2]):
            self.count.unknown += 1
            return
        v = _FIX_STATE(p[1])
        lat, lon, alt = v[1:4]
        if not finite(v[1:]) or abs(lat) > 90.0 or abs(lon) > 180.0:
            self.count.non_finite += 1
            return
        t = v[0] + self.offset_us
        if not self._timely(p[0].id, t, self._now_us):
            return
        fix = f.fix
        fix.t_us = t
        fix.pos_n, fix.vel_n = to_local(lat, lon, alt, self.origin), v[4:7]
        n, e, d, vn, ve, vd = [s if 0.0 <= s < math.inf else 0.0 for s in _FIX_SIGMAS(p[1])]
        fix.pos_sigma, fix.vel_sigma = (n, e, d), (vn, ve, vd)
        fix.gain = self._gain(_FIX_GAIN(p[1]), t)
        f.updated |= UPD_FIX

    def _gain(self, v: tuple[float, ...], fix_us: int) -> Gain:
        """A fix's gain; what cannot be one is counted and not taken, the fix is."""
        end_us, span_s, x, y, z = int(v[0]) + self.offset_us, v[1], v[2], v[3], v[4]
        if span_s == 0.0:
            return NO_GAIN
        if not (finite(v[1:]) and 0.0 < span_s <= GAIN_MOST_S and abs(end_us - fix_us) < GAIN_APART_US):
            self.count.non_finite += 1
            return NO_GAIN
        return Gain(end_us, span_s, (x, y, z))
