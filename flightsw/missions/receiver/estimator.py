"""Receiver estimator: SR-UKF of the aircraft relative to the tanker and of the wind on it (Lee 2011, chapter 6, re-formulated).

Measurements: air data, gyro, attitude (made relative with the tanker's attitude from the data link), relative position and
velocity, own GNSS velocity. The tanker enters as a known input: its transmitted estimate, time-stamped and carried forward.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    mul33,
    mul33_t,
    quat4,
    quat_from_euler,
    to_parent,
    vec3,
    wrap_pi,
)
from flightsw.missions.receiver.aids import AidParams, GnssWitness, PositionAid
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof.estimator_core import POS, NavParams, failed_bits
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.measure import measure_relative
from flightsw.sixdof.motion import propagate_relative, relative_rates
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, UPD_REL, Health, NavState, SensorFrame, Vec3

REL_MAX_S = 2.0  # [s] age of the relative sensor beyond which the position is no longer its
PEER_COAST_S = 1.0  # [s] data-link age beyond which the tanker is continued straight ahead
NEEDED = (*rd.AIR, rd.GYRO, rd.ATT, rd.REL_POS)  # sensors without which no estimate becomes valid


class RelativeNav:
    """Receiver state relative to the tanker, and wind, from own sensors and the tanker's transmitted estimate."""

    def __init__(
        self, ac: Aircraft, params: NavParams, extra: int = 0, m: int = 18, aid: AidParams | None = None
    ) -> None:  # fmt: skip
        """`extra`: states a variant carries beyond the 15; `m`: measurements at most; `aid`: see AidParams, None for none."""
        self.core = TrustedCore(
            ac, params, m + 2 + (0 if aid is None else 6), extra
        )  # wake; GNSS difference, closure rate
        self.peer = PeerTracker()
        self.t_us = 0
        self.started_us = -1
        self.rel_us = -1
        self.rejoined = False
        # wake position, GNSS difference, a held station without the data link
        self.aid = None if aid is None else PositionAid(aid)
        self.witness = GnssWitness(params.r_pos, params.bias_vel)
        self.fix: WakeFix | None = None  # wake position of this step, and
        self.R_ft = np.zeros(9)  # the tanker's air-path axes F to its body axes; filled by the owner
        self.x_f = 0.0  # [m] own x in F
        self.rate_fix: Vec3 | None = None  # [m/s] d(xi)/dt of this step from the calibrated difference of velocities
        self._held_us = -1
        self._tks = np.zeros((3, 18))
        self._R, self._Rn, self._fm, self._d = np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(15)
        self._e, self._q = np.zeros(3), np.zeros(4)
        self.out = NavState()

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """One estimator step; arguments as AirframeNav.step. Never raises on bad data."""
        c, o = self.core, self.out
        was_coasting = self.peer.coasting
        self.peer.take(f.peer)
        # a station held over the gap by the relative sensor is not given up when the link comes back
        self.rejoined = was_coasting and not self.peer.coasting and not o.rel_held
        o.peer_age_s = (f.t_us - f.peer.t_us) * 1e-6 if f.peer.t_us > 0 else 1e9
        if self.started_us < 0:
            return self._start(f, u, updated, health)
        if self.rejoined:
            # the reference frame has moved: begin again in it from the sensors, valid at once
            self.started_us = -1
            self._start(f, u, updated, health)
            if self.started_us >= 0:
                self.started_us -= round(c.p.settle_s * 1e6)
                o.valid, o.reason = True, ""
                c.publish_trust(o)
            return o
        if o.peer_age_s > PEER_COAST_S or self.peer.coasting:
            self.peer.coast(f.t_us)
        dt_us = f.t_us - self.t_us
        dt = dt_us * 1e-6
        for k in range(3):
            self.peer.stage(self.t_us + k * dt_us // 2, self._tks[k])
        self.t_us = f.t_us
        c.begin(f.t_us)
        c.burn(f.fuel_kg)
        ukf, x = c.ukf, c.ukf.x
        rho = density(self._altitude(f))
        if dt > 0.0:
            dcm_from_euler(x[6], x[7], x[8], self._R)
            mul33(self._R, self._tks[0, :9], self._Rn)
            c.noise_factor(self._Rn, dt)
            ukf.draw()
            self._propagate(f, u, rho, dt)
            ukf.recombine()
        self._rates(u, rho)
        nis, m = self._fuse(f, u, updated & ~failed_bits(health))
        if why := c.lost(o.valid):
            self.started_us = -1
            o.valid, o.rel_valid, o.reason = False, False, why
            return o
        self._rates(u, rho)
        if c.ears(o.valid, dt):
            self._hear(f, u, rho)
        return self._publish(f, nis, m)

    def _propagate(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """Carry the drawn points over dt [s]."""
        c = self.core
        propagate_relative(c.ukf.X, u, rho, c.P, self._tks, dt, c.work)

    def _rates(self, u: np.ndarray, rho: float) -> None:
        """Rates of change `_d`, specific force `_fm` and R_BRBT `_R` of the present mean."""
        c = self.core
        relative_rates(c.ukf.x[: c.work.shape[1]], u, rho, c.P, self._tks[2], self._R, self._fm, self._d)

    def _queue_air(self, f: SensorFrame, n: int) -> None:
        """Queue the air data of the n probes averaged into core.air."""
        d = self._d
        self.core.add_air(n, d[0], d[1], d[2], (f.t_us - f.air_t_us) * 1e-6)

    def _correct(self, f: SensorFrame, u: np.ndarray) -> float:
        """Measurement update with the queued measurements; returns NIS."""
        c = self.core
        c.ukf.draw()
        measure_relative(c.ukf.X, c.codes, c.m, self._tks[2], c.ukf.Y)
        return c.update()

    def _altitude(self, f: SensorFrame) -> float:
        return -f.gnss_pos_n[2] if f.gnss_t_us else f.baro_alt_m

    def _relative_euler(self, f: SensorFrame, tk: np.ndarray) -> None:
        """Own attitude made relative to the tanker's: e <- angles of R_BRI R_BTI^T."""
        self._q[:] = f.att_q_nb
        dcm_from_quat(self._q, self._R)
        mul33_t(self._R, tk[:9], self._Rn)
        euler_from_dcm(self._Rn, self._e)

    def _start(self, f: SensorFrame, u: np.ndarray, updated: int, health: Health) -> NavState:
        need = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU | UPD_REL
        have = updated & ~failed_bits(health)
        c, o = self.core, self.out
        o.t_us = f.t_us
        c.w_air[:] = f.gyro_b
        if self.peer.t_us < 0 or o.peer_age_s > PEER_COAST_S:
            o.valid, o.reason = False, "waiting for the tanker's data link"
            return o
        if have & need != need or not f.rel_valid or c.take_air(f) == 0:
            o.valid, o.reason = False, "waiting for air data, attitude, GNSS, gyro and relative navigation"
            return o
        x, p, tk = c.ukf.x, c.p, self._tks[2]
        self.peer.stage(f.t_us, tk)
        self._relative_euler(f, tk)
        x[0:3], x[6:9], x[9:12] = c.air, self._e, f.rel_pos_t
        w, Rn = tk[9:12], self._Rn
        for i in range(3):
            x[3 + i] = f.gyro_b[i] - (Rn[3 * i] * w[0] + Rn[3 * i + 1] * w[1] + Rn[3 * i + 2] * w[2])
        cb = math.cos(x[1])
        ua = x[0] * np.array([math.cos(x[2]) * cb, math.sin(x[1]), math.sin(x[2]) * cb])
        to_parent(self._R, ua, self._e)
        x[12:15] = np.array(f.gnss_vel_n) - self._e
        s = [p.r_V, p.r_beta, p.r_alpha, *[p.r_rate] * 3, *[p.r_euler] * 3, *[2 * p.r_pos] * 3, *[p.wind_sigma0] * 3]
        c.ukf.set_factor(np.diag([*s, *[1.0] * (len(x) - 15)]))
        self.t_us = self.started_us = self.rel_us = f.t_us
        c.restart(f.t_us)
        self.witness.reset()
        o.valid = False
        self._rates(u, density(self._altitude(f)))
        return self._publish(f, 0.0, 0)

    def _fuse(self, f: SensorFrame, u: np.ndarray, updated: int) -> tuple[float, int]:
        c, p, tk = self.core, self.core.p, self._tks[2]
        x, d = c.ukf.x.tolist(), self._d.tolist()  # plain floats are quicker
        c.m = 0
        mul33(self._R, tk[:9], self._Rn)
        self._own_rates(tk)
        if updated & UPD_AIR and (n := c.take_air(f)):
            self._queue_air(f, n)
        if updated & UPD_IMU and f.gyro_count:
            c.add_gyro(f, d[3:6])
        if updated & UPD_GNSS and p.velocity:
            age = (f.t_us - f.gnss_t_us) * 1e-6
            acc = self._acceleration().tolist()
            own = p.r_vel if self.peer.coasting else math.hypot(p.r_vel, p.r_own_vel)
            for i in range(3):
                c.add(15 + i, f.gnss_vel_n[i] + acc[i] * age, own, rd.GNSS_VEL)
        # a virtual tanker is not the one the relative sensor sees, unless it is steered by that sensor
        steered = self.aid is not None and self.peer.coasting and self.peer.level
        fresh = bool(updated & UPD_REL) and f.rel_valid and (steered or not self.peer.coasting)
        if fresh:
            age = (f.t_us - f.rel_t_us) * 1e-6
            if steered:
                self._steer(f, tk)
            lost = c.drift(rd.REL_POS, 2.0 * p.bias_vel)
            # the tanker's rates are taken as exact in w_T x xi: the gate has to know better
            swing = p.r_peer_rate * math.sqrt(x[9] * x[9] + x[10] * x[10] + x[11] * x[11])
            for i in range(3):
                c.add(9 + i, f.rel_pos_t[i] + d[9 + i] * age, p.r_pos, rd.REL_POS, lost)
            if p.velocity:
                for i in range(3):
                    c.add(12 + i, f.rel_vel_t[i], p.r_vel, rd.REL_VEL, swing)
        if self.aid is not None:
            trusted = fresh and not (c.refusals is not None and c.refusals.held(rd.REL_POS))
            self._aid(f, trusted, bool(updated & UPD_GNSS))
        if updated & UPD_ATT:
            age = (f.t_us - f.att_t_us) * 1e-6
            self._relative_euler(f, tk)
            e = self._e.tolist()
            # the tanker's attitude is taken as exact: the gate has to know better
            lost = math.hypot(c.drift(rd.ATT, p.bias_gyro), p.peer_att)
            for i in range(3):
                y = x[6 + i] + wrap_pi(e[i] + d[6 + i] * age - x[6 + i])
                c.add(6 + i, y, p.r_euler, rd.ATT, lost)
        if c.m == 0:
            return 0.0, 0
        nis = self._correct(f, u)
        if fresh and (c.refusals is None or c.refusals.taken_now(rd.REL_POS)):
            self.rel_us = f.rel_t_us
        return nis, c.m

    def _aid(self, f: SensorFrame, fresh: bool, gnss: bool) -> None:
        """Wake position, and the GNSS difference while the relative sensor is silent or kept out (or to calibrate it)."""
        a, c = self.aid, self.core
        assert a is not None
        if self.fix is not None:
            a.wake(c, self.fix, self.R_ft, self.x_f)
        stale = not fresh and (f.t_us - self.rel_us) * 1e-6 > a.p.rel_stale_s
        if gnss and not self.peer.coasting and (fresh or stale):
            a.gnss(c, f, self._tks[2, :9], self.peer.position(f.gnss_t_us), self._d[9:12], fresh)
        if stale and self.rate_fix is not None:
            for i in range(3):
                c.add(12 + i, self.rate_fix[i], a.p.r_velocity_mps, rd.REL_RATE)

    def _force(self, u: np.ndarray, rho: float, x: np.ndarray) -> np.ndarray:
        """Specific force [3] of the model at state x, body axes [m/s^2]."""
        fm = np.zeros(9)
        n = self.core.work.shape[1]
        relative_rates(x[:n], u, rho, self.core.P, self._tks[2], np.zeros(9), fm, np.zeros(15))
        return fm[:3]

    def _hear(self, f: SensorFrame, u: np.ndarray, rho: float) -> None:
        """The witnesses on air data and relative position, after the correction."""
        c, tk, o = self.core, self._tks[2], self.out
        gate = c.refusals
        assert gate is not None
        V = None
        linked = not self.peer.coasting and o.peer_age_s < PEER_COAST_S
        if not gate.calm and linked and self.peer.wind_valid:
            V = math.dist(o.vel_n, self.peer.wind)
        c.hear(f, self._fm, partial(self._force, u, rho), V)
        if not linked or not f.rel_valid or f.gnss_t_us <= 0:
            return
        x, w = c.ukf.x, self.witness
        to_parent(tk, np.array(f.rel_pos_t), self._e)
        seen = self._e.copy()
        to_parent(tk, x[POS], self._e)
        held = gate.held(rd.REL_POS)
        w.step(np.array(f.gnss_pos_n) - self.peer.position(f.gnss_t_us), seen, self._e, f.gnss_t_us, held)
        if held:
            gate.verdict[rd.REL_POS] = w.verdict()
        if rd.REL_POS in gate.opened:
            gate.opened.remove(rd.REL_POS)
            column = np.zeros((c.ukf.n, 1))
            column[POS, 0] = gate.gate.offsets(rd.REL_POS)
            c.ukf.set_factor(np.hstack([c.ukf.S, column]))

    def fits(self, f: SensorFrame) -> bool:
        """Whether a new reading of the relative sensor may be used elsewhere: what its gate would say of the position."""
        gate, o = self.core.refusals, self.out
        if gate is None or not o.rel_valid:
            return True
        dt = (f.rel_t_us - o.t_us) * 1e-6
        lost = self.core.drift(rd.REL_POS, 2.0 * self.core.p.bias_vel)
        limit = gate.gate.limit * math.hypot(self.core.p.r_pos, max(o.scatter), lost)
        off = (abs(f.rel_pos_t[i] - o.rel_pos_t[i] - o.rel_vel_t[i] * dt) for i in range(3))
        return not gate.held(rd.REL_POS) and max(off) <= limit

    def _steer(self, f: SensorFrame, tk: np.ndarray) -> None:
        """Velocity of a tanker whose data link is silent: own GNSS velocity less d(xi)/dt + w_T x xi of the relative sensor."""
        r, v, w = f.rel_pos_t, f.rel_vel_t, tk[9:12]
        d = np.array(
            [v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]]
        )
        to_parent(tk, d, self._e)
        self.peer.steer(np.array(f.gnss_vel_n) - self._e, (f.rel_t_us - self.rel_us) * 1e-6)

    def _hold(self, t_us: int) -> bool:
        """Whether the position is good although the relative sensor or the data link is silent, and for not too long."""
        a, o = self.aid, self.out
        link = o.peer_age_s < PEER_COAST_S and not self.peer.coasting
        seen = o.rel_age_s < REL_MAX_S
        if a is None or (link and seen) or not (link or seen):
            self._held_us = -1
            return False
        if self._held_us < 0:
            self._held_us = t_us
        held_s = (t_us - self._held_us) * 1e-6
        if link:
            return a.good(self.fix) and held_s < a.p.hold_max_s
        return self.peer.level and held_s < a.p.link_hold_max_s

    @property
    def rate_change(self) -> np.ndarray:
        """Modelled d/dt [3] of the own body rates [rad/s^2], as of the last step."""
        return self._d[3:6]

    def _own_rates(self, tk: np.ndarray) -> None:
        """Inertial body rates into core.w_air: w_rel + R w_T (self._R = R_BRBT)."""
        x, w = self.core.ukf.x[3:6].tolist(), self.core.w_air
        R, (p, q, r) = self._R.tolist(), tk[9:12].tolist()
        for i in range(3):
            w[i] = x[i] + R[3 * i] * p + R[3 * i + 1] * q + R[3 * i + 2] * r

    def _acceleration(self) -> np.ndarray:
        """Own inertial acceleration [3] NED [m/s^2]; self._Rn = own R_BI, self._fm from the last rate evaluation."""
        a = np.zeros(3)
        to_parent(self._Rn, self._fm, a)
        a[2] += G0
        return a

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        c, o, tk = self.core, self.out, self._tks[2]
        x = c.ukf.x
        o.t_us = f.t_us
        o.reason = c.earned(o, self.started_us, *NEEDED)
        o.valid = not o.reason
        o.V, o.beta, o.alpha = float(x[0]), float(x[1]), float(x[2])
        mul33(self._R, tk[:9], self._Rn)
        self._own_rates(tk)
        o.w_b = vec3(c.w_air)
        euler_from_dcm(self._Rn, self._e)
        o.euler = vec3(self._e)
        quat_from_euler(self._e[0], self._e[1], self._e[2], self._q)
        o.q_nb = quat4(self._q)
        to_parent(tk, x[9:12], self._e)
        o.pos_n = vec3(self.peer.position(f.t_us) + self._e)
        # inertial velocity = air-relative velocity + wind
        cb = math.cos(o.beta)
        ua = np.array([o.V * math.cos(o.alpha) * cb, o.V * math.sin(o.beta), o.V * math.sin(o.alpha) * cb])
        to_parent(self._Rn, ua, self._e)
        o.vel_n = vec3(self._e + x[12:15])
        o.acc_n = vec3(self._acceleration())
        o.wind_n = vec3(x[12:15])
        c.publish_sigma(o)
        self._publish_relative_sigma(o)
        c.publish_trust(o)
        o.nis, o.nis_dof = nis, m
        o.rel_age_s = (f.t_us - self.rel_us) * 1e-6
        own = o.rel_age_s < REL_MAX_S and o.peer_age_s < PEER_COAST_S and not self.peer.coasting
        o.rel_held = self._hold(f.t_us)
        o.rel_valid = o.valid and (own or o.rel_held)
        o.rel_pos_t = vec3(x[9:12])
        o.rel_vel_t = vec3(self._d[9:12])
        o.rel_euler = vec3(x[6:9])
        o.rel_w_b = vec3(x[3:6])
        return o

    def _publish_relative_sigma(self, o: NavState) -> None:
        """1-sigma of position and attitude relative to the tanker, and of the own position, which is the tanker's and that."""
        c, p = self.core, self.core.p
        lasting, arm = c.lasting(rd.REL_POS, p.bias_rel), p.peer_att * math.hypot(*o.rel_pos_t)
        s, a, t = o.scatter, o.att_sigma, self.peer.pos_sigma
        o.rel_sigma = (math.hypot(s[0], lasting), math.hypot(s[1], lasting), math.hypot(s[2], lasting))
        most = max(o.rel_sigma)  # whatever way the tanker's axes point
        o.pos_sigma = (math.hypot(t[0], most, arm), math.hypot(t[1], most, arm), math.hypot(t[2], most, arm))
        o.rel_att_sigma = (math.hypot(a[0], p.peer_att), math.hypot(a[1], p.peer_att), math.hypot(a[2], p.peer_att))
