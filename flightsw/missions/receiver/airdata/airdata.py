"""Air data of the receiver behind its tanker: where in the wake it is, which reading lies, and readings made good.

Every 20 Hz step: prediction of the wake position, expected readings, fault detection against them, correction by the channels
that are left, and a frame whose excluded readings are replaced by what the others say. F: the tanker's air-path axes.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.linalg import gram
from flightsw.kernels.rotations import vec3
from flightsw.kernels.sampled import multiply
from flightsw.missions.base import Reports
from flightsw.missions.receiver.aids import VelocityAid
from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata.air_path import ALPHA, AirPath, across, cross, rate_slopes
from flightsw.missions.receiver.airdata.airdata_params import AirDataParams
from flightsw.missions.receiver.airdata.contour.choice import make_contours
from flightsw.missions.receiver.airdata.fdi.monitor import Fdi
from flightsw.missions.receiver.airdata.icing import Icing, mean_of
from flightsw.missions.receiver.airdata.own_air import WHITE, OwnAir, spread
from flightsw.missions.receiver.airdata.repair import repaired
from flightsw.missions.receiver.airdata.reports import FdiStatus, WakeFix
from flightsw.missions.receiver.airdata.state import SLOW, TURB, X_Y, X_Z
from flightsw.missions.receiver.airdata.told import Told
from flightsw.missions.receiver.airdata.wake_filter import IDLE, TRACKING, WakePosition
from flightsw.missions.receiver.airdata.wake_kernel import WK_WING_LIFT, WK_WING_X, WK_WING_Z
from flightsw.missions.receiver.airdata.witness import WakeRows, WakeWitness
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.missions.receiver.relative_state import REL_MAX_S
from flightsw.sixdof.estimator_core import failed_bits
from flightsw.types import UPD_AIR, UPD_GNSS, UPD_IMU, UPD_REL, Health, NavState, SensorFrame, Text

ALL, ALL_V = 0x1FF, 0x7
STRAYED = 40  # samples in a row
PATIENCE = 20  # samples in a row: positions by contours come and go
GRACE_S = 0.5  # [s] without the relative sensor in which learning goes on
CRUISE_MPS = 195.0  # [m/s] airspeed at which gusts are taken to pass the probes
SILENT_US = 500_000  # [us] without air data
LATE_US = 300_000  # [us] age of readings beyond which the motion since is not known well enough for a witness


class AirData:
    """Wake position and air-data monitor of a receiver; feeds its relative estimator."""

    def __init__(self, ac: Aircraft, p: AirDataParams) -> None:
        self.p = p
        # One filter knows the relative sensor and learns circulations and offsets, the other finds the position by air data alone
        # with what was learnt, and how well. Learning without a known position fails: slopes are taken at an estimate that the
        # same noise has moved, and the tail's circulation is regressed towards zero while the position drifts to make up for it.
        self.learn = WakePosition(ac, p.position, p.wake)
        self.wake = WakePosition(ac, replace(p.position, scales=False, height=False), p.wake)
        self.wake.consider(True)
        self.fdi = Fdi(p.fdi)
        self.texts: list[Text] = []
        self.frame = AirPath()
        self._weight = p.wake.mass_kg * G0
        self.velocity = VelocityAid(p.aid)
        self._swing = np.zeros(3)  # [m/s, F] w_T x xi, of the last step
        self._tk, self._a = np.zeros(18), np.zeros(3)
        self._by_rate = p.rate_sigma * rate_slopes(self.wake.probes)
        self._y, self._zero = np.zeros(9), np.zeros(9)
        self._common = (0.0, 0.0, 0.0)
        self._s_common = (p.common_V, p.common_flow, p.common_flow)
        self._air_us = 0
        self.fix: WakeFix | None = None  # of the last readings
        self.status: FdiStatus | None = None
        self._seen = self._wake_known = False
        self._astray = 0  # samples in a row
        q = p.position
        noise = q.sigma_V, q.sigma_beta, q.sigma_alpha
        self.gusts: OwnAir | None = None
        if p.gusts_s > 0.0:
            self.gusts = OwnAir(self.wake.probes, q.gust_L_m, CRUISE_MPS, noise, q.gust_sigma, p.gusts_s)
        self._own_window = spread(self.wake.probes, CRUISE_MPS, q.gust_L_m, p.fdi.window)
        self._own_white = WHITE * spread(self.wake.probes, CRUISE_MPS, q.gust_L_m, WHITE)
        self.icing = Icing(ac)
        self.contour = make_contours(ac, q)  # instead of the filter's position
        self._told = Told(0 if self.contour is None else PATIENCE)
        self.witness = WakeWitness(self.wake.probes, q)
        self.rows: WakeRows | None = None  # of the last readings
        self._alone_s = 0.0  # [s] since the relative sensor was seen

    def step(
        self, f: SensorFrame, rel: RelativeNav, health: Health, updated: int, confirmed: bool = True
    ) -> SensorFrame:
        """Judge the new readings of frame `f` and hand the wake position to `rel`; returns the frame with bad readings made good,
        `f` itself where there are none. confirmed: the relative reading is borne out, and nobody disputes it: only then is
        anything learnt from it, or begun anew where it says."""
        nav = rel.out
        rel.fix = rel.rate_fix = self.rows = None
        if not updated & ~failed_bits(health) & UPD_AIR or rel.started_us < 0 or len(f.air_V) != 3:
            if f.t_us - self._air_us > SILENT_US:
                self._forget()
            return f
        dt = (f.air_t_us - self._air_us) * 1e-6 if self._air_us else 0.0
        if not 0.0 <= dt < 1.0:
            dt = 0.0
        self._air_us = f.air_t_us
        fr, w, learn = self.frame, self.wake, self.learn
        fr.update(f, rel, dt, bool(updated & UPD_IMU) and f.gyro_count > 0)
        self._shape()
        peer = rel.peer
        fresh = confirmed and bool(updated & UPD_REL) and f.rel_valid and rel.fits(f)
        self._seen = confirmed and nav.rel_valid and nav.rel_age_s < 0.5
        # a tanker carried on without data link has a wake where it is thought to be only while the relative sensor steers it
        self._wake_known = not peer.coasting or (peer.level and nav.rel_age_s < REL_MAX_S)
        if not self._wake_known or rel.rejoined or self._strayed(fr.x):
            w.mode = learn.mode = IDLE
        self._predict(nav, dt)
        seen = fresh and self._seen
        self._teachable(seen, dt)
        if peer.coasting and seen:
            w.aid(across(fr.to_f(f.rel_vel_t)), (self.p.aid.r_velocity_mps,) * 2, velocity=True)
        if seen:
            learn.aid(across(fr.to_f(f.rel_pos_t)), (self.p.rel_sigma_m, self.p.rel_sigma_m))
        if self.p.aid.velocity and updated & UPD_GNSS and not peer.coasting:
            self._aid_velocity(f, rel, seen)
        if learn.mode == TRACKING:
            w.learn_from(learn)
        y = self._y
        y[kp.OF_V], y[kp.OF_BETA], y[kp.OF_ALPHA] = f.air_V, f.air_beta, f.air_alpha
        given = (f.air_mask & 7) * 0b1001001
        e, S = self._expect()
        common = self._s_common
        if self.gusts is not None and S is not None:
            S += self.gusts.own**2 * self._own_window
            rough = self.gusts.sigma / self.p.position.gust_sigma
            common = vec3(rough * np.array(common))
        # a reading refused by its range or because it is stuck is shown to the monitor as an impossible one: it excludes it
        for c in range(9):
            if f.air_bad >> c & 1:
                y[c] = math.nan
        st = self.fdi.step(y, given, e, S, self._common if e is not None else None, common, f.air_t_us)
        use = self.fdi.usable(given) & ~f.air_bad & ~self.fdi.unresolved
        self._learn_gusts(y, e, use)
        V = None
        if e is not None and self._iced(f, nav, y, e, use, dt):
            use, V = use & ~ALL_V, self.icing.V
            st.excluded |= ALL_V
        if e is not None and self._wake_known and not peer.coasting and f.t_us - f.air_t_us < LATE_US:
            R_nf = multiply(fr.R_tf.reshape(3, 3).T, fr.C_nt.reshape(3, 3))
            own = self.wake.own_air
            self.rows = self.witness.step(f.air_t_us, y, use, self.wake.g, self.wake.wk, fr.x, own, R_nf)
        if use != ALL:
            f = repaired(f, y, use, self._zero if e is None else e, V)
        fix = self._found(y, use)
        self.fix, self.status = fix, st
        if self.p.fuse:
            rel.fix, rel.x_f = fix, float(fr.x[kp.AX_X])
            rel.R_ft[:] = fr.R_tf
        self.texts += self._told.changes(st.excluded, fix.valid, fix.reason)
        return f

    def _found(self, y: np.ndarray, use: int) -> WakeFix:
        """The position by the readings y [9] of the mask `use`."""
        if not self._wake_known:
            return replace(self._lost(self.wake.fix, self._air_us, "tanker not known"), nis_dof=0)
        self.learn.update(y, use)
        fix, fr = self.wake.update(y, use), self.frame
        return fix if self.contour is None else self.contour.step(self._air_us, y, use, fr.x, fr.xd)

    def _lost(self, fix: WakeFix, t_us: int, why: str) -> WakeFix:
        """What was `fix` and is none any longer at t_us [us], and why; of a mean of readings nothing is left."""
        if self.contour is None:
            return replace(fix, t_us=t_us, valid=False, reason=why)
        self.contour.reset()
        return self.contour.without(t_us, self.frame.x, self.frame.xd, why)

    def _iced(self, f: SensorFrame, nav: NavState, y: np.ndarray, e: np.ndarray, use: int, dt: float) -> bool:
        """Whether every airspeed lies, by readings y [9] of the mask `use` and the expected ones e [9]."""
        means = [mean_of(y, use, v) for v in (kp.R_V, kp.R_ALPHA)]
        if None in means:
            return self.icing.bad
        V, alpha = means
        assert V is not None and alpha is not None
        x = self.wake.x
        peer = float(
            e[kp.OF_V].mean() + x[TURB][kp.AX_X] + x[SLOW][kp.AX_X]
        )  # without a wind of its own along the path
        rough = self.gusts.sigma if self.gusts is not None else self.p.position.gust_sigma
        self.icing.step(V, peer, nav.wind_n, alpha, f, float(self.wake.g[kp.G_RHO]), rough, dt)
        return self.icing.bad

    def _forget(self) -> None:
        """Without air data nothing is being checked and no position found, whatever the last readings said."""
        st, fix = self.status, self.fix
        if st is not None and (st.valid or st.alarm):
            self.status = replace(st, valid=False, alarm=0, isolated=0, negative=0)
        if fix is not None and fix.valid:
            self.fix = self._lost(fix, fix.t_us, "no air data")
            self.texts += self._told.changes(self._told.excluded, False, self.fix.reason, at_once=True)

    @property
    def reports(self) -> Reports:
        """What was found, once there was air data."""
        found = (self.fix, self.status)
        return {type(r): r for r in found if r is not None}

    def _predict(self, nav: NavState, dt: float) -> None:
        """Carry both filters to the readings; one that has no position starts at the relative estimate."""
        fr, x, xd = self.frame, self.frame.x, self.frame.xd
        (along, _, _), (_, _, down) = nav.scatter, nav.pos_n
        s_x, rho = max(self.p.sigma_x_m, along), density(-down)
        att = vec3(fr.att)
        # in turning axes all probes share w_T x xi besides the rates of y and z: its changes go where the filter keeps a wind
        change, self._swing = fr.swing - self._swing, fr.swing
        for k in (self.wake, self.learn):
            if k.mode == TRACKING:
                k.x[SLOW] -= change
            k.predict(self._air_us, att, fr.omega, fr.acc, float(x[kp.AX_X]), s_x, fr.V_T, rho, dt, float(xd[kp.AX_X]))
            if k.mode != TRACKING and self._seen and self._wake_known:
                (y, z), (vy, vz) = across(x), across(xd)
                k.seed(y, z, self.p.seed_sigma_m, vy, vz)

    def _learn_gusts(self, y: np.ndarray, e: np.ndarray | None, use: int) -> None:
        """Turbulence by readings y [9] of the mask `use` against the expected ones e [9]; both filters go by it."""
        if self.gusts is None:
            return
        if e is None:
            self.gusts.forget()
            return
        self.gusts.hear(y - e, use, self.wake.x[TURB])
        for k in (self.wake, self.learn):
            k.rough(self.gusts.sigma, self.gusts.own**2 * self._own_white)

    def _teachable(self, seen: bool, dt: float) -> None:
        """What readings have in common with a move is learnt only where the position is known; elsewhere it grows less certain by
        the drift that nobody would see."""
        if seen:
            self._alone_s = 0.0
        alone = self._alone_s > GRACE_S
        self.learn.consider(alone)
        if alone and self.learn.mode == TRACKING:
            self.learn.drift(self.p.drift_V, self.p.drift_flow, self._alone_s - GRACE_S, dt)
        self._alone_s += dt

    def _strayed(self, x: np.ndarray) -> bool:
        """Whether the wake position has long been far from where the relative sensor, when it is there, sees the aircraft."""
        w = self.wake
        far = self.p.stray_m + 4.0 * math.sqrt(max(w.radial_var, 0.0))
        off = w.mode == TRACKING and self._seen and math.hypot(w.x[X_Y] - x[kp.AX_Y], w.x[X_Z] - x[kp.AX_Z]) > far
        self._astray = self._astray + 1 if off else 0
        return self._astray >= STRAYED

    def exercise(self) -> None:
        """Run start-up search, filters, second opinion and monitor on made-up readings; leaves this object of no further use."""
        if self.contour is not None:
            self.contour.exercise()
        att, zero, dt = (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), 0.05
        self.learn.seed(0.0, 9.0, 1.0)
        self.learn.predict(0, att, zero, zero, -35.0, 0.3, 195.0, 0.59, dt)
        e, S = self._e_of(self.learn)
        self.learn.restart()
        for k in range(400):  # 1 s of mean, the search, and a second opinion after 5 s more
            self.learn.predict(0, att, zero, zero, -35.0, 0.3, 195.0, 0.59, dt)
            self.learn.update(e, ALL)
            fault = np.zeros(9)
            if 100 < k < 200:
                fault[kp.OF_V] = 5.0, 5.0, 0.0  # two in one variable
                fault[kp.R_BETA + 1] = math.nan if k > 150 else 0.1
            self.fdi.step(e + fault, ALL, e, S, self._common, self._s_common, k)

    @staticmethod
    def _e_of(w: WakePosition) -> tuple[np.ndarray, np.ndarray]:
        prior = w.prior()
        assert prior is not None
        e, S = prior
        return e.copy(), S.copy()

    def _expect(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Expected readings e [9] and their covariance S [9,9]: position, what is learnt of the wake, and body rates."""
        w = self.wake
        prior = w.prior()
        if prior is None:
            return None, None
        J = self._by_rate.copy()
        J[kp.R_BETA :] /= self.frame.V_T
        S = np.zeros((len(J), len(J)))
        gram(np.ascontiguousarray(J), S)
        e, of_e = prior
        return e, of_e + S

    def _shape(self) -> None:
        """The wake of the moment: its wing carries the tanker's load factor, from the transmitted acceleration (gusts of 0.39
        m/s change it by 3 %), and the tail's download; wing and tail move in F with the tanker's angle of attack."""
        p = self.p.wake
        a = self.frame.flow[ALPHA] - self.p.wake_alpha
        c, s = math.cos(a), math.sin(a)
        for k in (self.wake, self.learn):
            k.wk[WK_WING_LIFT] = (self.frame.load + p.tail_download_frac) * self._weight
            for at, (x, _, z) in ((kp.WING, p.wing_m), (kp.TAIL, p.tail_m)):
                k.wk[at + WK_WING_X], k.wk[at + WK_WING_Z] = c * x + s * z, c * z - s * x

    def _aid_velocity(self, f: SensorFrame, rel: RelativeNav, seen: bool) -> None:
        """Rows of relative velocity from the calibrated difference of inertial velocities."""
        rel.peer.stage(f.gnss_t_us, self._tk)
        if self.velocity.step(f, self._tk, seen, self._a):
            v = self._a - cross(self.frame.w_t, np.array(rel.out.rel_pos_t))
            rel.rate_fix = vec3(v)
            v, s = across(self.frame.to_f(v)), self.p.aid.r_velocity_mps
            for k in (self.wake, self.learn):
                k.aid(v, (s, s), velocity=True)
