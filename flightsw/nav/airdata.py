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
from flightsw.fdi.monitor import Fdi, FdiParams
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    mul33,
    mul33_t,
    rotate_dcm,
    to_child,
    to_parent,
    vec3,
)
from flightsw.kernels.wake import WK_WING_LIFT
from flightsw.kernels.wake_state import X_KT, X_KW
from flightsw.models.wake import WakeParams
from flightsw.nav.common import failed_bits
from flightsw.nav.position_aid import AidParams
from flightsw.nav.relative import RelativeNav
from flightsw.nav.wake_params import WakePositionParams
from flightsw.nav.wake_position import TRACKING, WakePosition
from flightsw.strict import Range
from flightsw.types import UPD_AIR, UPD_IMU, UPD_REL, Health, NavState, SensorFrame, Text

Pos = Annotated[float, Range(1e-9)]
ALL = 0x1FF
ACC_TAU_S = 20.0  # [s] over which the tanker's modelled acceleration is corrected by its transmitted velocity
AIR_TAU_S = 0.5  # [s] smoothing of the tanker's transmitted flow angles


@dataclass(frozen=True)
class AirDataParams:
    """[airdata] of a receiver flight file."""

    on: bool = False
    fuse: bool = True  # the wake position corrects the relative estimator, and may hold a station
    seed_sigma_m: Pos = 3.0  # [m] of a start from the relative estimator
    rel_sigma_m: Pos = 0.5  # [m] of the relative sensor, from which the circulations are learnt
    sigma_x_m: Pos = 0.3  # [m] least 1-sigma of the given x
    common_V: Pos = 0.39  # [m/s] 1-sigma of the virtual sensor: what the wind estimate leaves unknown
    common_flow: Pos = 0.0026  # [rad] (0.15 deg)
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
        self.wake = WakePosition(ac, replace(p.position, scales=False), p.wake)
        self.fdi = Fdi(p.fdi)
        self.texts: list[Text] = []
        self._flow = np.zeros(2)  # tanker's alpha, beta, smoothed [rad]
        self._wind = np.zeros(3)
        self._w_t, self._v_t, self._acc_bias = np.zeros(3), np.zeros(3), np.zeros(3)
        self._have_flow = False
        self.V_T = 200.0
        self._load, self._lift = 1.0, float(self.wake.wk[WK_WING_LIFT])
        self._tk, self._R, self._R_tf, self._R_rf = np.zeros(18), np.zeros(9), np.zeros(9), np.zeros(9)
        self._q, self._v, self._a, self._e3 = np.zeros(4), np.zeros(3), np.zeros(3), np.zeros(3)
        self._y, self._zero = np.zeros(9), np.zeros(9)
        self._common = (0.0, 0.0, 0.0)
        self._s_common = (p.common_V, p.common_flow, p.common_flow)
        self._air_us = 0
        self._excluded = 0
        self._valid = self._seen = False
        self._omega = self._acc = (0.0, 0.0, 0.0)
        self._rel_acc = np.zeros(3)

    def step(self, f: SensorFrame, rel: RelativeNav, health: Health, updated: int) -> None:
        """Judge the new readings of frame `f` (made good in place), and hand the wake position to `rel`."""
        nav = rel.out
        rel.fix = None
        if not updated & ~failed_bits(health) & UPD_AIR or rel.started_us < 0 or len(f.air_V) != 3:
            return
        dt = (f.air_t_us - self._air_us) * 1e-6 if self._air_us else 0.0
        if not 0.0 <= dt < 1.0:
            dt = 0.0
        self._air_us = f.air_t_us
        self._frame(f, rel, nav, dt, bool(updated & UPD_IMU) and f.gyro_count > 0)
        x_f, xd_f = self._to_f(nav, f)
        w, learn = self.wake, self.learn
        self._predict(nav, x_f, xd_f, dt)
        if updated & UPD_REL and f.rel_valid and self._seen:
            to_parent(self._R_tf, np.array(f.rel_pos_t), self._v)
            learn.aid((float(self._v[1]), float(self._v[2])), (self.p.rel_sigma_m, self.p.rel_sigma_m))
        if learn.mode == TRACKING:
            w.x[X_KW : X_KT + 1] = learn.x[X_KW : X_KT + 1]
        y = self._y
        y[0:3], y[3:6], y[6:9] = f.air_V, f.air_beta, f.air_alpha
        given = (f.air_mask & 7) * 0b1001001
        prior = w.prior()
        e, S = prior if prior is not None else (None, None)
        # a reading refused by its range or because it is stuck is shown to the monitor as an impossible one: it excludes it
        for c in range(9):
            if f.air_bad >> c & 1:
                y[c] = math.nan
        st = self.fdi.step(y, given, e, S, self._common if e is not None else None, self._s_common, f.air_t_us)
        use = self.fdi.usable(given) & ~f.air_bad
        if use != ALL:
            self._repair(f, use, e)
        learn.update(y, use)
        fix = w.update(y, use)
        nav.wake, nav.fdi = fix, st
        if self.p.fuse:
            rel.fix, rel.x_f = fix, float(x_f[0])
            rel.R_ft[:] = self._R_tf
        self._report(st.excluded, fix.valid, fix.reason)

    def _predict(self, nav: NavState, x: np.ndarray, xd: np.ndarray, dt: float) -> None:
        """Carry both filters to the readings; one that has no position starts at the relative estimate x, rate xd [3, F]."""
        self._seen = nav.rel_valid and nav.rel_age_s < 0.5
        s_x, rho = max(self.p.sigma_x_m, nav.rel_sigma[0]), density(-nav.pos_n[2])
        att = vec3(self._e3)
        for k in (self.wake, self.learn):
            k.predict(
                self._air_us, att, self._omega, self._acc, float(x[0]), s_x, self.V_T, rho, dt, float(xd[0])
            )  # fmt: skip
            if k.mode != TRACKING and self._seen:
                k.seed(float(x[1]), float(x[2]), self.p.seed_sigma_m, float(xd[1]), float(xd[2]))

    def _frame(self, f: SensorFrame, rel: RelativeNav, nav: NavState, dt: float, gyro: bool) -> None:
        """Tanker's air-path axes, own attitude, rates and acceleration in them."""
        tk = self._tk
        rel.peer.stage(f.air_t_us, tk)
        if not rel.peer.coasting:
            self._wind[:] = rel.peer.wind
        if self._have_flow and 0.0 < dt < 0.2 and not rel.peer.coasting:
            gap = (tk[15:18] - self._v_t) / dt - rel.peer.acceleration - self._acc_bias
            self._acc_bias += dt / ACC_TAU_S * np.clip(gap, -5.0, 5.0)
        self._v_t[:] = tk[15:18]
        to_child(tk[:9], tk[15:18] - self._wind, self._v)
        u, v, w = self._v.tolist()
        s = math.sqrt(u * u + v * v + w * w)
        k = min(dt / AIR_TAU_S, 1.0) if self._have_flow else 1.0
        self._have_flow = True
        self._flow[0] += k * (math.atan2(w, u) - self._flow[0])
        self._flow[1] += k * (math.asin(max(-1.0, min(1.0, v / max(s, 1.0)))) - self._flow[1])
        self.V_T += k * (s - self.V_T)
        self._w_t += k * (tk[9:12] - self._w_t)
        # the wake's lift carries the tanker's load factor: 1 / cos(bank) in a level turn
        self._load += k * (1.0 / max(tk[8], 0.3) - self._load)
        self.wake.wk[WK_WING_LIFT] = self._lift * self._load
        # body = R2(alpha) R3(-beta) F
        dcm_from_euler(-self._flow[1], self._flow[0], 0.0, self._R_tf)
        self._q[:] = nav.q_nb
        dcm_from_quat(self._q, self._R)
        self._v[:] = f.gyro_mean_b if gyro else nav.w_b
        self._omega = vec3(self._v)
        rotate_dcm(self._R, self._v, (f.air_t_us - nav.t_us) * 1e-6, self._R_rf)
        self._R[:] = self._R_rf
        # own inertial acceleration less the tanker's, to tanker axes, to F
        to_parent(self._R, np.array(f.acc_mean_b if gyro else f.acc_b), self._v)
        self._v[2] += G0
        self._v -= rel.peer.acceleration + self._acc_bias
        to_child(tk[:9], self._v, self._a)
        to_parent(self._R_tf, self._a, self._v)
        self._rel_acc = self._v.copy()
        mul33_t(self._R, tk[:9], self._R_rf)  # tanker body to own body
        mul33(self._R_rf, self._R_tf, self._R)
        euler_from_dcm(self._R, self._e3)

    def _to_f(self, nav: NavState, f: SensorFrame) -> tuple[np.ndarray, np.ndarray]:
        """Own position and velocity in F from the relative estimate carried to the readings; acceleration in turning axes."""
        lead = (f.air_t_us - nav.t_us) * 1e-6
        x, xd, w = np.zeros(3), np.zeros(3), np.zeros(3)
        r = np.array(nav.rel_pos_t) + np.array(nav.rel_vel_t) * lead
        to_parent(self._R_tf, r, x)
        to_parent(self._R_tf, np.array(nav.rel_vel_t), xd)
        to_parent(self._R_tf, self._w_t, w)
        # d2(xi)/dt2 in axes turning at w: a - 2 w x v - w x (w x xi)
        c = _cross(w, 2.0 * xd + _cross(w, x))
        self._acc = vec3(self._rel_acc - c)
        return x, xd

    def _repair(self, f: SensorFrame, use: int, e: np.ndarray | None) -> None:
        """Replace unusable readings by the mean of the usable ones of their variable, moved to the probe's place in the wake."""
        y, exp = self._y, self._zero if e is None else e
        mask = 0
        for v in range(3):
            good = [3 * v + i for i in range(3) if use >> (3 * v + i) & 1]
            if not good:
                f.air_bad |= 7 << (3 * v)
                continue
            m = math.fsum(y[c] - exp[c] for c in good) / len(good)
            for i in range(3):
                if 3 * v + i not in good:
                    y[3 * v + i] = m + exp[3 * v + i]
            f.air_bad &= ~(7 << (3 * v))
            mask |= 1 << v
        f.air_V, f.air_beta, f.air_alpha = vec3(y[0:3]), vec3(y[3:6]), vec3(y[6:9])
        if mask == 7:
            f.air_mask |= 7

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


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
