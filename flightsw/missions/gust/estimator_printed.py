"""The source's own estimator: a continuous Kalman-Bucy filter with a constant gain, integrated between samples.

Baseline and regression reference. A reading held over the step makes the filter lag by more than a sample at 2 Hz; joined by
straight lines, the readings give back nearly all of it (the continuous filter itself lags 6.7 degrees there). Ground speed
and accelerometer have no place in it.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.linalg import matvec
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.model import LinearModel, linear_model
from flightsw.missions.gust.printed import H_PRINTED

Array = np.ndarray
OUTPUTS = 5


class ConstantGainGust:
    """x [9] of dx/dt = A x + B u + K (y - C x); `step` has the arguments of GustNav.step and returns x."""

    def __init__(
        self, K: Array = H_PRINTED, model: LinearModel | None = None, V0_mps: float = 20.0, H0_m: float = 100.0,
        *, join: bool = False,
    ) -> None:  # fmt: skip
        """K [9,5] gain, positive sign; V0 [m/s], H0 [m] trim; join: readings are joined by straight lines instead of held until
        the next one. Raises ValueError for another shape of K."""
        self._join = join
        if np.shape(K) != (k.NX, OUTPUTS):
            raise ValueError(f"gain of shape {np.shape(K)}; allowed {(k.NX, OUTPUTS)}")
        m = model or linear_model()
        self._A, self._B, self._C = m.A, m.B, np.ascontiguousarray(m.C[:OUTPUTS])
        self._K = np.ascontiguousarray(K, dtype=float)
        self._trim = np.array([0.0, 0.0, V0_mps, 0.0, H0_m])
        self._W = np.zeros((5, k.NX))
        self.x = np.zeros(k.NX)
        self._y, self._new = np.zeros(OUTPUTS), np.zeros(OUTPUTS)
        self.started = False

    def start(self, x: Array) -> None:
        """Begin from x [9], as if the last reading had been what x predicts."""
        self.x[:] = x
        matvec(self._C, self.x, self._y)
        self.started = True

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        return {"x": self.x.copy(), "y": self._y.copy(), "head": np.array([self.started], float)}

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state`."""
        self.x[:], self._y[:], self.started = s["x"], s["y"], bool(s["head"].item())

    def step(self, y: Array, ok: int, u: Array, dt: float, u_now: Array | None = None) -> Array:
        """Integrate to this sample; returns x [9] (reused).

        A reading that is not usable is replaced by the filter's own prediction. u_now is not used.
        """
        if not self.started:
            self.start(self.x)
        for c in range(OUTPUTS):
            if ok >> c & 1 and math.isfinite(y[c]):
                self._new[c] = y[c] - self._trim[c]
            else:
                self._new[c] = float(np.sum(self._C[c] * self.x))
        if dt > 0.0 and np.isfinite(u).all():
            u = np.ascontiguousarray(u, dtype=float)
            end = self._new if self._join else self._y
            k.constant_gain_step(self.x, self._y, end, u, self._A, self._B, self._C, self._K, dt, self._W)
        self._y[:] = self._new
        return self.x
