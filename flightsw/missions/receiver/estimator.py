"""Receiver estimator: SR-UKF of the aircraft relative to the tanker and of the wind on it (Lee 2011, chapter 6, re-formulated).

Measurements: air data, gyro, attitude (made relative with the tanker's attitude from the data link), relative position and
velocity, own GNSS velocity. The tanker enters as a known input: its transmitted estimate, time-stamped and carried forward.
Prediction, wind model, further states, noise colour and adaptation: parts (sixdof/parts.py, relative.py).
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from flightsw import refusal as rd
from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_euler, euler_from_dcm, mul33, quat4, quat_from_euler, to_parent, vec3
from flightsw.missions.receiver import relative_aids
from flightsw.missions.receiver.aids import AidParams, GnssWitness, PositionAid, StationHold, seen_velocity
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.missions.receiver.relative import (
    BehindTanker,
    RelativeSensors,
    RotationalWind,
    altitude,
    check,
    first_state,
    publish_relative_sigma,
    relative_sigma,
    rows,
    swing_floor,
)
from flightsw.missions.receiver.rotational import WIND_CODE
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.sixdof import aids
from flightsw.sixdof.calculated_wind import CalculatedWind
from flightsw.sixdof.estimator_core import GAP_US, NavParams, failed_bits, inertial_acceleration
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import AIR, EULER, M_OWN_VEL, NX, POS, RATE, ROT, TK, TK_DCM, TK_END, TK_START, WIND
from flightsw.sixdof.motion import air_velocity, relative_rates
from flightsw.sixdof.parts import Extras, Parts
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, UPD_REL, Health, NavState, SensorFrame, Vec3

REL_MAX_S = 2.0  # [s] age of the relative sensor beyond which the position is no longer its
PEER_COAST_S = 1.0  # [s] data-link age beyond which the tanker is continued straight ahead
NEEDED = (*rd.AIR, rd.GYRO, rd.ATT, rd.REL_POS)  # sensors without which no estimate becomes valid


class RelativeNav:
    """Receiver state relative to the tanker, and wind, from own sensors and the tanker's transmitted estimate."""

    def __init__(self, ac: Aircraft, params: NavParams, aid: AidParams | None = None) -> None:
        """aid: wake position, GNSS difference, a held station without the data link. Raises ConfigError for parameters that a
        receiver cannot obey."""
        check(params)
        p, probes = params, len(ac.probe)
        sigma = relative_sigma(p, probes)
        e = Extras.of(p, len(sigma), RotationalWind.STATES if p.rotational_wind else 0)
        self.core = c = TrustedCore(ac, p, rows(p, probes, aid is not None), e.total)
        self._tks = np.zeros((3, TK))  # the tanker at start, middle and end of the step
        self._R, self._Rn, self._fm, self._d = np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(NX)
        self._e, self._q = np.zeros(3), np.zeros(4)
        self.rot = RotationalWind(p) if p.rotational_wind else None
        self._nx = NX + e.own
        self.parts = Parts(
            c, e, BehindTanker(c, self._tks, self._nx), RelativeSensors(self._tks, self._nx, p.cmw or p.local_probes),
            sigma, self.rot, self._heading,
        )  # fmt: skip
        self.cmw = CalculatedWind(p, WIND_CODE) if p.cmw else None
        self.peer = PeerTracker()
        self.t_us = 0
        self.started_us = -1
        self.rel_us = -1
        self.rejoined = False
        self.aid = None if aid is None else PositionAid(aid)
        self.witness = GnssWitness(params.r_pos, params.bias_vel)
        self.fix: WakeFix | None = None  # wake position of this step, and
        self.R_ft = np.zeros(9)  # the tanker's air-path axes F to its body axes; filled by the owner
        self.x_f = 0.0  # [m] own x in F
        self.rate_fix: Vec3 | None = None  # [m/s] d(xi)/dt of this step from the calibrated difference of velocities
        self.hold = None if aid is None else StationHold(aid)
        self.out = NavState()

    @property
    def _tk(self) -> np.ndarray:
        """The tanker now. No view of the stages is kept: a copy of the estimator would lose it."""
        return self._tks[TK_END]

    def step(self, f: SensorFrame, u: np.ndarray, health: Health, updated: int) -> NavState:
        """One estimator step; arguments as AirframeNav.step. Never raises on bad data."""
        c, o = self.core, self.out
        was_coasting = self.peer.coasting
        self.peer.take(f.peer)
        # a station held over the gap by the relative sensor is not given up when the link comes back
        self.rejoined = was_coasting and not self.peer.coasting and not o.rel_held
        o.peer_age_s = (f.t_us - f.peer.t_us) * 1e-6 if f.peer.t_us > 0 else 1e9
        if self.started_us >= 0 and f.t_us - self.t_us > GAP_US:
            self.begin_again(f"no step for {(f.t_us - self.t_us) * 1e-6:.1f} s, restarting")
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
        for k, tk in enumerate(self._tks):  # start, middle, end
            self.peer.stage(self.t_us + k * dt_us // 2, tk)
        self.t_us = f.t_us
        c.begin(f.t_us)
        c.burn(f.fuel_kg)
        x, rho = c.ukf.x, density(altitude(f))
        if dt > 0.0:
            dcm_from_euler(*x[EULER], self._R)
            mul33(self._R, self._tks[TK_START, TK_DCM], self._Rn)
            c.noise_factor(self._Rn, dt)
            self.parts.predict(f, u, rho, dt)
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

    def begin_again(self, why: str) -> None:
        """Forget the estimate and start from the sensors as soon as they are there."""
        self.started_us = -1
        self.out.valid, self.out.rel_valid, self.out.reason = False, False, why

    def _heading(self) -> float:
        """Own heading [rad] of R_BI, during the prediction: at the start of the step."""
        return math.atan2(self._Rn[1], self._Rn[0])

    def _rates(self, u: np.ndarray, rho: float) -> None:
        """Rates of change `_d`, specific force `_fm` and R_BRBT `_R` of the present mean."""
        c = self.core
        relative_rates(c.ukf.x[: self._nx], u, rho, c.P, self._tk, self._R, self._fm, self._d)

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
        x, tk = c.ukf.x, self._tk
        self.peer.stage(f.t_us, tk)
        first_state(x, f, c.air, tk)
        c.start_factor()
        self.t_us = self.started_us = self.rel_us = f.t_us
        c.restart(f.t_us)
        self.witness.reset()
        o.valid = False
        self._rates(u, density(altitude(f)))
        self._publish(f, 0.0, 0)
        self.parts.start(f)
        if self.cmw is not None:
            self.cmw.reset()
        return o

    def _fuse(self, f: SensorFrame, u: np.ndarray, updated: int) -> tuple[float, int]:
        """Queue what is new, and correct; NIS and how many rows were used."""
        c, p, tk, gate = self.core, self.core.p, self._tk, self.core.refusals
        x, d = c.ukf.x.tolist(), self._d.tolist()  # plain floats are quicker
        c.m = 0
        mul33(self._R, self._tks[TK_END, TK_DCM], self._Rn)
        relative_aids.inertial_rates(c.ukf.x[RATE], self._R, tk, c.w_air)
        air = bool(updated & UPD_AIR) and c.take_air(f)
        if air:
            if p.local_probes:
                relative_aids.single_probes(c, f, d)
            else:
                aids.air_data(c, f, air, d)
        if updated & UPD_IMU and f.gyro_count:
            aids.gyro(c, f, d)
        if updated & UPD_GNSS and p.velocity:
            own = p.r_vel if self.peer.coasting else math.hypot(p.r_vel, p.r_own_vel)
            aids.gnss_velocity(c, f, M_OWN_VEL, inertial_acceleration(self._Rn, self._fm).tolist(), own)
        # a virtual tanker is not the one the relative sensor sees, unless it is steered by that sensor
        steered = self.aid is not None and self.peer.coasting and self.peer.level
        fresh = bool(updated & UPD_REL) and f.rel_valid and (steered or not self.peer.coasting)
        if fresh:
            if steered:
                seen_velocity(f, tk, self._e)
                self.peer.steer(np.array(f.gnss_vel_n) - self._e, (f.rel_t_us - self.rel_us) * 1e-6)
            relative_aids.relative_position(c, f, d)
            if p.velocity:
                relative_aids.relative_velocity(c, f, x)
        self._stand_in(f, fresh and not (gate is not None and gate.held(rd.REL_POS)), bool(updated & UPD_GNSS))
        if updated & UPD_ATT:
            relative_aids.attitude_behind(f, tk, self._Rn)
            euler_from_dcm(self._Rn, self._e)
            # the tanker's attitude is taken as exact: the gate has to know better
            aids.attitude(c, f, self._e.tolist(), x, d, p.peer_att)
        if c.m == 0:
            return 0.0, 0
        if self.cmw is not None and air:
            self.cmw.queue(c, relative_aids.calculated_wind(f, c.air, tk))
        if self.parts.colour.noise is not None:
            swing_floor(p, c.ukf.x, self.parts.colour.floor)
        nis = self.parts.correct(f, u)
        if fresh and (gate is None or gate.taken_now(rd.REL_POS)):
            self.rel_us = f.rel_t_us
        return nis, c.m

    def _stand_in(self, f: SensorFrame, trusted: bool, gnss: bool) -> None:
        """Wake position, and the GNSS difference while the relative sensor is silent or kept out (or to calibrate it)."""
        a, c = self.aid, self.core
        if a is None:
            return
        if self.fix is not None:
            a.wake(c, self.fix, self.R_ft, self.x_f)
        stale = not trusted and (f.t_us - self.rel_us) * 1e-6 > a.p.rel_stale_s
        if gnss and not self.peer.coasting and (trusted or stale):
            a.gnss(c, f, self._tks[TK_END, TK_DCM], self.peer.position(f.gnss_t_us), self._d[POS], trusted)
        if stale and self.rate_fix is not None:
            a.closure_rate(c, self.rate_fix)

    def _force(self, u: np.ndarray, rho: float, x: np.ndarray) -> np.ndarray:
        """Specific force [3] of the model at state x, body axes [m/s^2]."""
        fm = np.zeros(9)
        relative_rates(x[: self._nx], u, rho, self.core.P, self._tk, np.zeros(9), fm, np.zeros(NX))
        return fm[:3]

    def _hear(self, f: SensorFrame, u: np.ndarray, rho: float) -> None:
        """The witnesses on air data and relative position, after the correction."""
        c, tk, o = self.core, self._tk, self.out
        gate = c.refusals
        assert gate is not None
        V = None
        linked = not self.peer.coasting and o.peer_age_s < PEER_COAST_S
        if not gate.calm and linked and self.peer.wind_valid:
            V = math.dist(o.vel_n, self.peer.wind)
        c.hear(f, self._fm, partial(self._force, u, rho), V)
        if not linked or not f.rel_valid or f.gnss_t_us <= 0:
            return
        self.witness.hear(gate, f, tk, c.ukf.x[POS], self.peer.position(f.gnss_t_us))
        if rd.REL_POS in gate.opened:
            gate.opened.remove(rd.REL_POS)
            # in a step without a reading of it all channels of the group come, of which it fills three
            c.widen(POS, gate.gate.offsets(rd.REL_POS)[:3])

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

    @property
    def rate_change(self) -> np.ndarray:
        """Modelled d/dt [3] of the own body rates [rad/s^2], as of the last step."""
        return self._d[RATE]

    def _publish(self, f: SensorFrame, nis: float, m: int) -> NavState:
        c, o, tk = self.core, self.out, self._tk
        x = c.ukf.x
        o.t_us = f.t_us
        o.reason = c.earned(o, self.started_us, *NEEDED)
        o.valid = not o.reason
        o.V, o.beta, o.alpha = x[AIR].tolist()
        mul33(self._R, self._tks[TK_END, TK_DCM], self._Rn)
        relative_aids.inertial_rates(x[RATE], self._R, tk, c.w_air)
        o.w_b = vec3(c.w_air)
        euler_from_dcm(self._Rn, self._e)
        o.euler = vec3(self._e)
        quat_from_euler(*self._e, self._q)
        o.q_nb = quat4(self._q)
        to_parent(tk, x[POS], self._e)
        o.pos_n = vec3(self.peer.position(f.t_us) + self._e)
        # inertial velocity = air-relative velocity + wind
        to_parent(self._Rn, np.array(air_velocity(o.V, o.beta, o.alpha)), self._e)
        o.vel_n = vec3(self._e + x[WIND])
        o.acc_n = vec3(inertial_acceleration(self._Rn, self._fm))
        o.wind_n = vec3(x[WIND])
        if self.rot is not None:
            o.wind_rot, o.wind_rot_sigma = vec3(x[ROT]), vec3(np.array(c.ukf.sigmas()[ROT]))
        c.publish_sigma(o)
        publish_relative_sigma(c, o, self.peer.pos_sigma)
        c.publish_trust(o)
        o.nis, o.nis_dof = nis, m
        o.rel_age_s = (f.t_us - self.rel_us) * 1e-6
        link, seen = o.peer_age_s < PEER_COAST_S and not self.peer.coasting, o.rel_age_s < REL_MAX_S
        o.rel_held = self.hold is not None and self.hold.step(f.t_us, link, seen, self.peer.level, self.fix)
        o.rel_valid = o.valid and ((link and seen) or o.rel_held)
        o.rel_pos_t = vec3(x[POS])
        o.rel_vel_t = vec3(self._d[POS])
        o.rel_euler = vec3(x[EULER])
        o.rel_w_b = vec3(x[RATE])
        return o
