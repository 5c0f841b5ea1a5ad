"""Air data of the receiver behind its tanker: where in the wake it is, which reading lies, and readings made good.

Every 20 Hz step: prediction of the wake position, expected readings, fault detection against them, correction by the channels
that are left, and a frame whose excluded readings are replaced by what the others say. F: the tanker's air-path axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.linalg import gram
from flightsw.kernels.rotations import vec3
from flightsw.missions.base import Reports
from flightsw.missions.receiver.aids import AidParams, VelocityAid
from flightsw.missions.receiver.airdata.air_path import ALPHA, AirPath, cross
from flightsw.missions.receiver.airdata.expected import (
    AX_X,
    AX_Y,
    AX_Z,
    OF_ALPHA,
    OF_BETA,
    OF_V,
    R_BETA,
    TAIL,
    WING,
)
from flightsw.missions.receiver.airdata.fdi.monitor import Fdi, FdiParams
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.reports import FdiStatus, WakeFix
from flightsw.missions.receiver.airdata.state import LEARNT, SLOW, X_KW, X_Y, X_Z
from flightsw.missions.receiver.airdata.wake_filter import IDLE, TRACKING, WakePosition
from flightsw.missions.receiver.airdata.wake_kernel import WK_WING_LIFT, WK_WING_X, WK_WING_Z
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.missions.receiver.estimator import REL_MAX_S, RelativeNav
from flightsw.sixdof.estimator_core import failed_bits
from flightsw.strict import Range
from flightsw.types import UPD_AIR, UPD_GNSS, UPD_IMU, UPD_REL, Health, NavState, SensorFrame, Text

Pos = Annotated[float, Range(1e-9)]
ALL = 0x1FF
STRAYED = 40  # samples in a row
SILENT_US = 500_000  # [us] without air data


@dataclass(frozen=True)
class AirDataParams:
    """[airdata] of a receiver flight file."""

    on: bool | None = None  # left out: off, and nothing else here may be set; false: off, whatever else is set
    fuse: bool = True  # the wake position corrects the relative estimator, and may hold a station
    seed_sigma_m: Pos = 3.0  # [m] of a start from the relative estimator
    rel_sigma_m: Pos = 0.5  # [m] of the relative sensor, from which the circulations are learnt
    stray_m: Pos = 3.0  # [m] beside 4 sigma: a wake position farther from the relative sensor's is begun anew
    sigma_x_m: Pos = 0.3  # [m] least 1-sigma of the given x
    common_V: Pos = 0.39  # [m/s] 1-sigma of the virtual sensor: what the wind estimate leaves unknown
    common_flow: Pos = 0.0026  # [rad] (0.15 deg)
    rate_sigma: Pos = 0.004  # [rad/s] of the body rates taken for a reading, over the monitor's window
    lift_sigma: Pos = 0.015  # [-] of the tanker's lift as known from its transmitted acceleration
    wake_alpha: Annotated[float, Range(-0.3, 0.3)] = (
        0.0  # [rad] the tanker's, at which the wing_m and tail_m of `wake` hold
    )
    wake: WakeParams = field(default_factory=WakeParams)
    position: WakePositionParams = field(default_factory=WakePositionParams)
    fdi: FdiParams = field(default_factory=FdiParams)
    aid: AidParams = field(default_factory=AidParams)


class AirData:
    """Wake position and air-data monitor of a receiver; feeds its relative estimator."""

    def __init__(self, ac: Aircraft, p: AirDataParams) -> None:
        self.p = p
        # One filter knows the relative sensor and learns the circulations, the other finds the position by air data alone with
        # what was learnt. Learning without a known position fails: slopes are taken at an estimate that the same noise has
        # moved, and the tail's circulation is regressed towards zero while the position drifts to make up for it.
        self.learn = WakePosition(ac, p.position, p.wake)
        self.wake = WakePosition(ac, replace(p.position, scales=False, height=False), p.wake)
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
        self._excluded = 0
        self._valid = self._seen = self._wake_known = False
        self._astray = 0  # samples in a row

    def step(self, f: SensorFrame, rel: RelativeNav, health: Health, updated: int) -> SensorFrame:
        """Judge the new readings of frame `f` and hand the wake position to `rel`; returns the frame with bad readings made good,
        `f` itself where there are none."""
        nav = rel.out
        rel.fix = rel.rate_fix = None
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
        fresh = bool(updated & UPD_REL) and f.rel_valid and rel.fits(f)
        self._seen = nav.rel_valid and nav.rel_age_s < 0.5
        # a tanker carried on without data link has a wake where it is thought to be only while the relative sensor steers it
        self._wake_known = not peer.coasting or (peer.level and nav.rel_age_s < REL_MAX_S)
        if not self._wake_known or rel.rejoined or self._strayed(fr.x):
            w.mode = learn.mode = IDLE
        self._predict(nav, dt)
        seen = fresh and self._seen
        if peer.coasting and seen:
            w.aid(across(fr.to_f(f.rel_vel_t)), (self.p.aid.r_velocity_mps,) * 2, velocity=True)
        if seen:
            learn.aid(across(fr.to_f(f.rel_pos_t)), (self.p.rel_sigma_m, self.p.rel_sigma_m))
        if self.p.aid.velocity and updated & UPD_GNSS and not peer.coasting:
            self._aid_velocity(f, rel, seen)
        if learn.mode == TRACKING:
            w.x[LEARNT] = learn.x[LEARNT]
        y = self._y
        y[OF_V], y[OF_BETA], y[OF_ALPHA] = f.air_V, f.air_beta, f.air_alpha
        given = (f.air_mask & 7) * 0b1001001
        e, S = self._expect()
        # a reading refused by its range or because it is stuck is shown to the monitor as an impossible one: it excludes it
        for c in range(9):
            if f.air_bad >> c & 1:
                y[c] = math.nan
        st = self.fdi.step(y, given, e, S, self._common if e is not None else None, self._s_common, f.air_t_us)
        use = self.fdi.usable(given) & ~f.air_bad
        if use != ALL:
            f = self._repaired(f, use, e)
        if self._wake_known:
            learn.update(y, use)
            fix = w.update(y, use)
        else:
            fix = replace(w.fix, t_us=f.air_t_us, valid=False, reason="tanker not known", nis_dof=0)
        self.fix, self.status = fix, st
        if self.p.fuse:
            rel.fix, rel.x_f = fix, float(fr.x[AX_X])
            rel.R_ft[:] = fr.R_tf
        self._report(st.excluded, fix.valid, fix.reason)
        return f

    def _forget(self) -> None:
        """Without air data nothing is being checked and no position found, whatever the last readings said."""
        st, fix = self.status, self.fix
        if st is not None and (st.valid or st.alarm):
            self.status = replace(st, valid=False, alarm=0, isolated=0, negative=0)
        if fix is not None and fix.valid:
            self.fix = replace(fix, valid=False, reason="no air data")
            self._report(self._excluded, False, self.fix.reason)

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
            k.predict(self._air_us, att, fr.omega, fr.acc, float(x[AX_X]), s_x, fr.V_T, rho, dt, float(xd[AX_X]))
            if k.mode != TRACKING and self._seen and self._wake_known:
                (y, z), (vy, vz) = across(x), across(xd)
                k.seed(y, z, self.p.seed_sigma_m, vy, vz)

    def _strayed(self, x: np.ndarray) -> bool:
        """Whether the wake position has long been far from where the relative sensor, when it is there, sees the aircraft."""
        w = self.wake
        far = self.p.stray_m + 4.0 * math.sqrt(max(w.radial_var, 0.0))
        off = w.mode == TRACKING and self._seen and math.hypot(w.x[X_Y] - x[AX_Y], w.x[X_Z] - x[AX_Z]) > far
        self._astray = self._astray + 1 if off else 0
        return self._astray >= STRAYED

    def exercise(self) -> None:
        """Run start-up search, filters, second opinion and monitor on made-up readings; leaves this object of no further use."""
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
                fault[OF_V] = 5.0, 5.0, 0.0  # two in one variable
                fault[R_BETA + 1] = math.nan if k > 150 else 0.1
            self.fdi.step(e + fault, ALL, e, S, self._common, self._s_common, k)

    @staticmethod
    def _e_of(w: WakePosition) -> tuple[np.ndarray, np.ndarray]:
        prior = w.prior()
        assert prior is not None
        e, S = prior
        return e.copy(), S.copy()

    def _expect(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Expected readings e [9] and their covariance S [9,9]: position, what is learnt of the wake, and body rates."""
        w, learn = self.wake, self.learn
        known = learn.mode == TRACKING
        if known:
            w.P[LEARNT, LEARNT] = learn.P[LEARNT, LEARNT]
        w.P[X_KW, X_KW] += self.p.lift_sigma**2
        prior = w.prior()
        w.P[LEARNT, LEARNT] = 0.0
        if prior is None:
            return None, None
        J = self._by_rate.copy()
        J[R_BETA:] /= self.frame.V_T
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
            for at, (x, _, z) in ((WING, p.wing_m), (TAIL, p.tail_m)):
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

    def _repaired(self, f: SensorFrame, use: int, e: np.ndarray | None) -> SensorFrame:
        """The frame, unusable readings replaced by the mean of the usable ones of their variable, moved to the probe's place."""
        y, exp = self._y, self._zero if e is None else e
        mask, bad = 0, f.air_bad
        for v in range(3):
            good = [3 * v + i for i in range(3) if use >> (3 * v + i) & 1]
            if not good:
                bad |= 7 << (3 * v)
                continue
            m = math.fsum(y[c] - exp[c] for c in good) / len(good)
            for i in range(3):
                if 3 * v + i not in good:
                    y[3 * v + i] = m + exp[3 * v + i]
            bad &= ~(7 << (3 * v))
            mask |= 1 << v
        return replace(
            f, air_V=vec3(y[OF_V]), air_beta=vec3(y[OF_BETA]), air_alpha=vec3(y[OF_ALPHA]), air_bad=bad,
            air_mask=f.air_mask | 7 if mask == 7 else f.air_mask,
        )  # fmt: skip

    def _report(self, excluded: int, valid: bool, reason: str) -> None:
        """Texts on what changed."""
        if excluded != self._excluded:
            for c in range(9):
                if (excluded ^ self._excluded) >> c & 1:
                    name = f"{('V', 'beta', 'alpha')[c // 3]} of probe {c % 3 + 1}"
                    out = bool(excluded >> c & 1)
                    self.texts.append(Text(4 if out else 5, f"air data: {name} {'excluded' if out else 'back'}"))
            self._excluded = excluded
        if valid != self._valid:
            self.texts.append(Text(6 if valid else 5, f"wake position {'valid' if valid else f'lost: {reason}'}"[:50]))
            self._valid = valid


def across(v: np.ndarray) -> tuple[float, float]:
    """y and z of a vector [3] in F."""
    _, y, z = v.tolist()
    return y, z


def rate_slopes(probes: np.ndarray) -> np.ndarray:
    """[9,3] change of the readings with own body rates: V [m/s], and V times the flow angles, per rad/s; probes [3,3] [m]."""
    x, y, z = probes.T
    o = np.zeros(3)
    rows = [np.stack([o, z, -y], 1), np.stack([-z, o, x], 1), np.stack([y, -x, o], 1)]
    return np.vstack(rows)
