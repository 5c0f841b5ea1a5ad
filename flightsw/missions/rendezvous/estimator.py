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
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous.params import (
    RendezvousNavParams,
    eight_vector,
    new_window,
    nominal_velocity,
    three_vector,
)


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


class RangeEstimator:
    """One receiver seen by ranges; `estimator` of the parameters chooses how. Never raises on data; see `out.valid`."""

    def __init__(self, p: RendezvousNavParams, wind_x: float = 0.0, wind_y: float = 0.0) -> None:
        """Wind [m/s] in R sets the receiver's nominal ground velocity; change it later with `set_wind`."""
        self.p = p
        self.three = p.estimator == "ekf3"
        M = p.components if p.estimator == "bank" else 1
        self.m, self.P, self.lw = np.zeros((M, 8)), np.zeros((M, 8, 8)), np.zeros(M)
        self.s3 = np.zeros(k3.S3_N)
        self.window = new_window(p)
        self.e3, self.e8 = three_vector(p, 0.0), eight_vector(p, 0.0)
        self._wk, self._k, self._nu, self._D = np.zeros((M, 9)), np.zeros(8), np.zeros(2), np.zeros(8)
        self._mean8, self._C8 = np.zeros(8), np.zeros((8, 8))
        self._ahead, self._Ca, self._s3a = np.zeros(8), np.zeros((8, 8)), np.zeros(k3.S3_N)
        self._four, self._P4 = np.zeros(4), np.zeros((4, 4))
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
            k3.ekf3_start(self.s3, range_m, own_x, own_y, y_hat, sigma_y, self.e3)
        else:
            shift = 1.0 if self.p.mean_shift else 0.0
            kb.bank_start(
                self.m, self.P, self.lw, range_m, own_x, own_y, y_hat, sigma_y, self.p.grid_sigma, shift, self.e8
            )
        self.window[:] = new_window(self.p)
        self.lag = 0.0
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
        than the time since the last update counts as that time (ranges out of order are fused at the filter's own time).
        """
        if not self.out.valid:
            return False
        step = max(self.lag - max(age_s, 0.0), 0.0)
        if step > 0.0:
            if self.three:
                k3.ekf3_predict(self.s3, step, self.e3)
            else:
                kb.bank_predict(self.m, self.P, self.lw, step, self.e8, self._D)
            self.lag -= step
        used = False
        if range_m is not None and math.isfinite(range_m):
            used = self._range(range_m, own_x, own_y)
        if bearing_rad is not None and math.isfinite(bearing_rad):
            R = math.radians(self.p.bearing_sigma_deg) ** 2
            if self.three:
                k3.ekf3_bearing(self.s3, bearing_rad, own_x, own_y, R)
            else:
                kb.bank_bearing(self.m, self.P, self.lw, bearing_rad, own_x, own_y, R, 0.0, self._wk, self._k, self._nu)
        if datalink is not None:
            R = self.p.datalink_sigma_m**2
            if self.three:
                k3.ekf3_position(self.s3, datalink[0], datalink[1], R)
            else:
                kb.bank_position(self.m, self.P, self.lw, *datalink, R, self._wk, self._k, self._nu)
        self.out.age_s = self.lag
        self._matched()
        return used

    def _range(self, z: float, x: float, y: float) -> bool:
        p, o = self.p, self.out
        if self.three:
            used = k3.ekf3_range(self.s3, z, x, y, p.gate_nis, self.e3)
            nu, S = self.s3[9], self.s3[10]
        else:
            hermite = p.estimator in ("ukf8", "bank")
            used = kb.bank_range(
                self.m, self.P, self.lw, z, x, y, hermite, p.gate_nis, self.e8, self._wk, self._k, self._nu
            )
            nu, S = self._nu
        k3.window_push(self.window, nu / math.sqrt(S))
        o.innovation_m, o.nis = float(nu), float(nu * nu / S)
        o.window_nis, o.window_drift = float(self.window[k3.W_SQUARE]), float(self.window[k3.W_DRIFT])
        o.alarm = bool(self.window[k3.W_ALARM] > 0.0)
        o.updates += 1 if used else 0
        o.refused += 0 if used else 1
        return bool(used)

    def _matched(self) -> None:
        if not self.three:
            kb.bank_match(self.m, self.P, self.lw, self._mean8, self._C8)
        self._carry()

    def _carry(self) -> None:
        """Mean and covariance at the present, from those at the last update."""
        m4, P4 = self._four, self._P4
        if self.three:
            a = self._s3a
            a[:] = self.s3
            k3.ekf3_predict(a, self.lag, self.e3)
            m4[:] = a[0], self.e3[k3.E3_U] + a[1], a[2], 0.0
            P4[:3, :3] = (a[3], a[4], a[5]), (a[4], a[6], a[7]), (a[5], a[7], a[8])
        else:
            self._ahead[:] = self._mean8
            self._Ca[:] = self._C8
            k8.discretise(self.lag, self.e8, self._D)
            k8.eight_predict(self._ahead, self._Ca, self.lag, self.e8[k8.E8_U], self._D)
            kb.reduce_four(self._ahead, self._Ca, self.e8[k8.E8_U], m4, P4)
        o = self.out
        o.mean = (float(m4[0]), float(m4[1]), float(m4[2]), float(m4[3]))
        o.sigma = tuple(math.sqrt(max(float(P4[i, i]), 0.0)) for i in range(4))  # type: ignore[assignment]

    @property
    def mean(self) -> tuple[float, float, float, float]:
        """(x, v_x, y, v_y) over ground at the present [m, m/s]."""
        return self.out.mean

    @property
    def covariance(self) -> np.ndarray:
        """Covariance [4,4] of `mean`; the three-state filter knows no v_y (row of zeros)."""
        return self._P4.copy()

    def components(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Weights [M] (sum 1), positions [M,2] and covariances [M,2,2] of (x, y) at the last update: the banana."""
        if self.three:
            s = self.s3
            return np.ones(1), np.array([[s[0], s[2]]]), np.array([[[s[3], s[5]], [s[5], s[8]]]])
        w = np.array([math.exp(v) for v in self.lw.tolist()])
        ix = [k8.X, k8.Y]
        return w / w.sum(), self.m[:, ix].copy(), self.P[:, ix][:, :, ix].copy()

    def get_state(self) -> dict[str, np.ndarray]:
        """Copy of everything that changes."""
        o = self.out
        head = np.array([self.lag, o.valid, o.innovation_m, o.nis, o.alarm, o.updates, o.refused], dtype=np.float64)
        return {k: v.copy() for k, v in (("m", self.m), ("P", self.P), ("lw", self.lw), ("s3", self.s3))} | {
            "window": self.window.copy(),
            "e3": self.e3.copy(),
            "e8": self.e8.copy(),
            "head": head,
        }

    def set_state(self, s: dict[str, np.ndarray]) -> None:
        """Restore a copy made by `get_state`."""
        for name in ("m", "P", "lw", "s3", "window", "e3", "e8"):
            getattr(self, name)[:] = s[name]
        h = s["head"]
        self.lag = float(h[0])
        self.out = RendezvousEstimate(
            valid=bool(h[1]),
            reason="" if h[1] else "no range yet",
            age_s=self.lag,
            innovation_m=float(h[2]),
            nis=float(h[3]),
            window_nis=float(self.window[k3.W_SQUARE]),
            window_drift=float(self.window[k3.W_DRIFT]),
            alarm=bool(h[4]),
            updates=int(h[5]),
            refused=int(h[6]),
        )
        if self.out.valid:
            self._matched()
