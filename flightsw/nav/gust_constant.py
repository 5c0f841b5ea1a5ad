"""The source's own estimator: a continuous Kalman-Bucy filter with a constant gain, integrated between samples.

Baseline and regression reference. The source integrates plant and filter together, so that its filter sees the readings move
between samples: straight lines between readings come closest. Holding a reading over the step costs half a sample more
lag. Ground speed and accelerometer have no place in it.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels import gust as k
from flightsw.models.gust import LinearModel, linear_model
from flightsw.models.gust_print import H_PRINTED

Array = np.ndarray
OUTPUTS = 5


class ConstantGainGust:
    """x [9] of dx/dt = A x + B u + K (y - C x); `step` has the arguments of GustNav.step and returns x."""

    def __init__(
        self, K: Array = H_PRINTED, model: LinearModel | None = None, V0_mps: float = 20.0, H0_m: float = 100.0,
        *, hold: bool = False,
    ) -> None:  # fmt: skip
        """K [9,5] gain, positive sign; V0 [m/s], H0 [m] trim; hold: readings are held until the next instead of joined by straight
        lines. Raises ValueError for another shape of K."""
        self._hold = hold
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
        self._y[:] = self._C @ self.x
        self.started = True

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
            end = self._y if self._hold else self._new
            k.constant_gain_step(self.x, self._y, end, u, self._A, self._B, self._C, self._K, dt, self._W)
        self._y[:] = self._new
        return self.x
