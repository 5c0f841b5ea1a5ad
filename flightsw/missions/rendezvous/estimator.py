"""Where the receiver is, from slant ranges alone: one interface over the estimators a parameter selects.

ekf3: the source's three-state filter with bias correction (Rivard 1982, section IV). ekf7, ekf8: its truth model without and
with the correlated range error as a state. ukf8: the same with the range fused by 5 x 5 Gauss-Hermite quadrature. bank: a
Gaussian sum of ukf8 over the lateral position, the one whose covariance can be believed.

Everything is in the rendezvous frame R (flightsw/missions/rendezvous/frame.py is the border): SI, x towards the initial point, y
90 deg counter-clockwise. Covariances change at updates and starts; between them `mean` and `covariance` are those of the
last update carried forward, so calling `predict` at 100 Hz or once gives the same estimate to rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous.frame import E_SIZE, E_VX, E_X, E_Y
from flightsw.missions.rendezvous.params import (
    RendezvousNavParams,
    eight_vector,
    fixes_vector,
    kept_bank,
    kept_fixes,
    new_window,
    nominal_velocity,
    plain_rules,
    rules_vector,
    states,
    three_vector,
)

CHANGING = (
    "m", "P", "lw", "x3", "P3", "window", "e3", "e8", "kept", "memory", "memoryP", "fixes", "heard", "before", "beforeP", "prior",
)  # fmt: skip
THREE = [E_Y, E_VX, E_X]  # where the states of the three-state filter stand in the estimate: k3.S3_Y, S3_V, S3_X


@dataclass(slots=True)
class RendezvousEstimate:
    """What guidance and telemetry read. Frame R, SI."""

    valid: bool = False
    reason: str = "no range yet"
    mean: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # x, v_x, y, v_y over ground
    sigma: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    age_s: float = 0.0  # since the time of validity of the last range used
    innovation_m: float = 0.0
    nis: float = 0.0
    window_nis: float = 0.0
    window_drift: float = 0.0
    alarm: bool = False  # the receiver does not fly as planned, or the set is faulty
    updates: int = 0
    refused: int = 0
    verdict: int = kr.USED  # what became of the last range
    left_plan: bool = False  # the estimate has been opened: the receiver flies a course of its own
    sided: bool = False  # the last update had a bearing or the receiver's own position


class RangeEstimator:
    """One receiver seen by ranges; `estimator` of the parameters chooses how. Never raises on data; see `out.valid`."""

    def __init__(self, p: RendezvousNavParams, wind_x: float = 0.0, wind_y: float = 0.0) -> None:
        """Wind [m/s] in R sets the receiver's nominal ground velocity; change it later with `set_wind`."""
        self.p = p
        self.three, self.hermite = p.estimator == "ekf3", p.estimator in ("ukf8", "bank")
        M = p.components if p.estimator == "bank" else 1
        n = states(p)
        self.m, self.P, self.lw = np.zeros((M, n)), np.zeros((M, n, n)), np.zeros(M)
        self.x3, self.P3 = np.zeros(k3.S3_N), np.zeros((k3.S3_N, k3.S3_N))
        self.window = new_window(p)
        self.rules, self.kept = rules_vector(p), np.zeros(kr.RS_N)
        self.memory, self.memoryP = kept_bank(p, M)
        self.plain, self.fp, self.fixes = plain_rules(self.rules), fixes_vector(p), np.zeros(kf.FS_N)
        self.heard, self.before, self.beforeP = kept_fixes(p, M)
        self.t = 0.0  # [s] since the start, of the filter's state
        self.prior = np.zeros(2)  # lateral position and sigma [m] of the start
        self.e3, self.e8 = three_vector(p, 0.0), eight_vector(p, 0.0)
        self._wk, self._k, self._nu, self._D = np.zeros((M, k8.H_SIZE)), np.zeros(n), np.zeros(2), np.zeros(k8.D_SIZE)
        self._mean8, self._C8, self._ahead, self._Ca = np.zeros(n), np.zeros((n, n)), np.zeros(n), np.zeros((n, n))
        self._x3a, self._P3a = self.x3.copy(), self.P3.copy()
        self._four, self._P4 = np.zeros(E_SIZE), np.zeros((E_SIZE, E_SIZE))
        self._last4 = np.zeros((E_SIZE, E_SIZE))
        self.lag = 0.0  # [s] the filter's state is this much behind the present
        self.out = RendezvousEstimate()
        self.set_wind(wind_x, wind_y)

    def set_wind(self, wind_x: float, wind_y: float) -> None:
        """New wind [m/s] in R: moves the nominal velocity, not the deviation estimated from it."""
        u, self.delta = nominal_velocity(self.p, wind_x, wind_y)
        self.e3[k3.E3_U] = self.e8[k8.E8_U] = u

    def start(self, range_m: float, own_x: float, own_y: float, y_hat: float, sigma_y: float) -> None:
        """First slant range [m] at own position, with the crew's lateral position and sigma [m] (nobody: 0 and 6.15 NM)."""
        if not (math.isfinite(range_m) and range_m > self.p.altitude_separation_m and sigma_y > 0.0):
            self.out.reason = f"first range {range_m:.0f} m refused"
            return
        if self.three:
            k3.ekf3_start(self.x3, self.P3, range_m, own_x, own_y, y_hat, sigma_y, self.e3)
        else:
            shift = 1.0 if self.p.mean_shift else 0.0
            kb.bank_start(
                self.m, self.P, self.lw, range_m, own_x, own_y, y_hat, sigma_y, self.p.grid_sigma, shift, self.e8
            )
        self.window[:] = new_window(self.p)
        kr.rules_reset(self.kept, range_m)
        kf.fixes_reset(self.fixes)
        self.prior[:] = y_hat, sigma_y
        self.lag = self.t = 0.0
        self.out = RendezvousEstimate(valid=True, reason="", updates=1)
        self._matched()

    def predict(self, dt: float) -> None:
        """Let dt [s] pass."""
        self.lag += dt
        self.out.age_s = self.lag
        if self.out.valid:
            self._carry()

    def update(
        self,
        range_m: float | None,
        own_x: float,
        own_y: float,
        age_s: float = 0.0,
        bearing_rad: float | None = None,
        datalink: tuple[float, float] | None = None,
    ) -> bool:
        """Fuse what was measured age_s [s] ago at own position (own_x, own_y) [m] of that moment; True: range used.

        bearing_rad: line of sight in R, counter-clockwise from +x. datalink: the receiver's own position [m]. An age greater
        than the time since the last update counts as that time (what is out of order is fused at the filter's own time, a
        position carried on to it with the velocity last estimated).
        """
        if not self.out.valid:
            return False
        step = max(self.lag - max(age_s, 0.0), 0.0)
        if step > 0.0:
            if self.three:
                k3.ekf3_predict(self.x3, self.P3, step, self.e3)
            else:
                kb.bank_predict(self.m, self.P, self.lw, step, self.e8, self._D)
            self.lag -= step
            self.t += step
        used, aids = False, self.p.aids.on
        bearing_rad = bearing_rad if bearing_rad is not None and math.isfinite(bearing_rad) else None
        if datalink is not None and age_s > self.lag:
            _, vx, _, vy = self.out.mean
            x, y = datalink
            datalink = x + vx * (age_s - self.lag), y + vy * (age_s - self.lag)
        if range_m is not None and math.isfinite(range_m):
            used = self._range(range_m, own_x, own_y)
        if aids and bearing_rad is not None:
            self._fix(kf.IS_BEARING, bearing_rad, 0.0, own_x, own_y)
        elif bearing_rad is not None:
            R = math.radians(self.p.bearing_sigma_deg) ** 2
            if self.three:
                k3.ekf3_bearing(self.x3, self.P3, bearing_rad, own_x, own_y, R, self._nu)
            else:
                kb.bank_bearing(self.m, self.P, self.lw, bearing_rad, own_x, own_y, R, 0.0, self._wk, self._k, self._nu)
        if datalink is not None and aids:
            self._fix(kf.IS_POSITION, *datalink, own_x, own_y)
        elif datalink is not None:
            R = self.p.datalink_sigma_m**2
            if self.three:
                k3.ekf3_position(self.x3, self.P3, *datalink, R, self._nu)
            else:
                kb.bank_position(self.m, self.P, self.lw, *datalink, R, self._wk, self._k, self._nu)
        self.out.age_s = self.lag
        told = bearing_rad is not None or datalink is not None
        self.out.sided = told or (aids and self.fixes[kf.FS_COUNT] > 0.0 and self.out.sided)
        self._matched()
        return used

    def _fix(self, kind: int, z: float, y: float, own_x: float, own_y: float) -> None:
        kf.heard_fix(
            self.fixes, self.fp, self.kept, self.rules, self.m, self.P, self.lw, self.window, self.before, self.beforeP,
            self.heard, self.t, kind, z, y, own_x, own_y, self.hermite, self.e8, self._wk, self._k, self._nu,
        )  # fmt: skip
        self._warned()

    def _range(self, z: float, x: float, y: float) -> bool:
        p, o = self.p, self.out
        if self.three:
            used = k3.ekf3_range(self.x3, self.P3, z, x, y, p.gate_nis, self.e3, self._nu)
            k3.window_push(self.window, self._nu[k3.NU] / math.sqrt(self._nu[k3.NU_VAR]))
            o.verdict = kr.USED if used else kr.REFUSED
        else:
            shift = 1.0 if p.mean_shift else 0.0
            tail = (
                self.t, z, x, y, *self.prior.tolist(), p.grid_sigma, shift, self.hermite, self.e8, self._wk, self._k, self._nu
            )  # fmt: skip
            bank = (self.m, self.P, self.lw, self.window)
            if self.fixes[kf.FS_COUNT] > 0.0:
                head = (self.fixes, self.fp, self.kept, self.rules, self.plain, *bank)
                o.verdict = int(kf.heard_range(*head, self.before, self.beforeP, self.heard, *tail))
            else:
                o.verdict = int(kr.judged_range(self.kept, self.rules, *bank, self.memory, self.memoryP, *tail))
            used = o.verdict not in (kr.REFUSED, kr.STUCK)
        nu, S = self._nu.tolist()
        o.innovation_m, o.nis = nu, nu * nu / S if S > 0.0 else 0.0
        self._warned()
        o.updates += 1 if used else 0
        o.refused += 0 if used else 1
        return used

    def _warned(self) -> None:
        """Whether it warns: by the window, and once opened until a full one fits again."""
        o, w = self.out, self.window
        o.window_nis, o.window_drift = float(w[k3.W_SQUARE]), float(w[k3.W_DRIFT])
        o.left_plan = bool(self.kept[kr.RS_OPENED] > 0.0)
        young = w[k3.W_COUNT] < w.shape[0] - k3.W_HEAD
        o.alarm = bool(w[k3.W_ALARM] > 0.0 or (o.left_plan and young))

    def _matched(self) -> None:
        if not self.three:
            kb.bank_match(self.m, self.P, self.lw, self._mean8, self._C8)
            kb.reduce_four(self._mean8, self._C8, self.e8[k8.E8_U], self._four, self._last4)
        self._carry()

    def _carry(self) -> None:
        """Mean and covariance at the present, from those at the last update."""
        m4, P4 = self._four, self._P4
        if self.three:
            x, P = self._x3a, self._P3a
            x[:], P[:] = self.x3, self.P3
            k3.ekf3_predict(x, P, self.lag, self.e3)
            m4[THREE] = x
            m4[E_VX] += self.e3[k3.E3_U]
            P4[np.ix_(THREE, THREE)] = P
        else:
            self._ahead[:] = self._mean8
            self._Ca[:] = self._C8
            k8.discretise(self.lag, self.e8, self._D)
            k8.eight_predict(self._ahead, self._Ca, self.lag, self.e8[k8.E8_U], self._D)
            kb.reduce_four(self._ahead, self._Ca, self.e8[k8.E8_U], m4, P4)
        o = self.out
        o.mean = tuple(m4.tolist())  # type: ignore[assignment]
        o.sigma = tuple(math.sqrt(max(v, 0.0)) for v in np.diag(P4).tolist())  # type: ignore[assignment]

    @property
    def mean(self) -> tuple[float, float, float, float]:
        """(x, v_x, y, v_y) over ground at the present [m, m/s]."""
        return self.out.mean

    @property
    def last_covariance(self) -> np.ndarray:
        """Covariance [4,4] of `mean` at the last update; zeros of the three-state filter, which does not know its own."""
        return self._last4

    @property
    def covariance(self) -> np.ndarray:
        """Covariance [4,4] of `mean`; the three-state filter knows no v_y (row of zeros)."""
        return self._P4.copy()

    def components(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Weights [M] (sum 1), positions [M,2] and covariances [M,2,2] of (x, y) at the last update: the banana."""
        if self.three:
            at = [k3.S3_X, k3.S3_Y]
            return np.ones(1), self.x3[None, at], self.P3[None][:, at][:, :, at]
        w = np.array([math.exp(v) for v in self.lw.tolist()])
        ix = [k8.X, k8.Y]
        return w / w.sum(), self.m[:, ix].copy(), self.P[:, ix][:, :, ix].copy()

    def get_state(self) -> dict[str, np.ndarray]:
        """Copy of everything that changes."""
        o = self.out
        head = np.array([self.lag, o.valid, o.innovation_m, o.nis, o.alarm, o.updates, o.refused, self.t, o.sided])
        return {name: getattr(self, name).copy() for name in CHANGING} | {"head": head}

    def set_state(self, s: dict[str, np.ndarray]) -> None:
        """Restore a copy made by `get_state`."""
        for name in CHANGING:
            getattr(self, name)[:] = s[name]
        lag, valid, innovation, nis, alarm, updates, refused, t, sided = s["head"].tolist()
        self.lag, self.t = lag, t
        self.out = RendezvousEstimate(
            valid=bool(valid),
            reason="" if valid else "no range yet",
            age_s=self.lag,
            innovation_m=innovation,
            nis=nis,
            window_nis=float(self.window[k3.W_SQUARE]),
            window_drift=float(self.window[k3.W_DRIFT]),
            alarm=bool(alarm),
            updates=int(updates),
            refused=int(refused),
            left_plan=bool(self.kept[kr.RS_OPENED] > 0.0),
            sided=bool(sided),
        )
        if self.out.valid:
            self._matched()
