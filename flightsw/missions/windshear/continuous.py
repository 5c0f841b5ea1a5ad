"""The source's own filter: the unscented one in continuous form, Jing et al. (2007) (39)-(43), one explicit step per sample.

Three readings of it, because (40), (41) and (43) do not fit together; E1 to E4 of docs/sources/jing.md are corrected in all. R is
the density of the readings' noise, their variance per sample times the sample.

    ukf_printed      to the letter: K = X W h' (h W h' + R), P' = ... - K (h W h' + R) K'
    ukf_43           the stray inverse of (43) taken off: K = X W h' (h W h' + R)^-1, P' as above. It flies, with wrong gains
    ukf_continuous   what is meant: K = X W h' R^-1, P' = ... - K R K'. It does not survive sensors this exact at 50 Hz

A covariance that is none any more starts the filter anew, as any estimate that is not finite does.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import TwinJet
from flightsw.filters.covariance import norm_by
from flightsw.filters.srukf import CENTRE, draw
from flightsw.kernels.linalg import cholesky, finite, matvec, solve, vecmat
from flightsw.kernels.sampled import multiply
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.estimator import (
    CONTINUOUS,
    WindshearEstimate,
    WindshearNav,
    WindshearParams,
)
from flightsw.missions.windshear.model import process_covariance

Array = np.ndarray
PRINTED, FORTY_THREE, MEANT = CONTINUOUS
LOST = "covariance is none any more: starts anew"


def sigma_weights(n: int, spread: float) -> tuple[float, Array, Array]:
    """c, mean weights [2n+1] and W [2n+1,2n+1] of the matrix form, E3 corrected; b = 2, kappa = 0."""
    c = spread * spread * n
    wm = np.full(2 * n + 1, 0.5 / c)
    wc = wm.copy()
    wm[CENTRE] = (c - n) / c
    wc[CENTRE] = wm[CENTRE] + 1.0 - spread * spread + 2.0
    centred = np.eye(2 * n + 1) - wm[:, None]
    return c, wm, multiply(centred * wc, centred.T)


class ContinuousNav(WindshearNav):
    """`WindshearNav` with the derivative of mean and covariance in place of prediction and correction."""

    def __init__(self, p: WindshearParams, ac: TwinJet | None = None) -> None:
        """p.filter: one of CONTINUOUS. Raises ValueError for parameters no filter can run."""
        super().__init__(p, ac)
        self._c, self._wm, self._weigh = sigma_weights(self.n, p.spread)
        self._F = np.zeros((2 * self.n + 1, self.n))
        self._drift = np.zeros(self.n)

    def _advance(self, m: int, u: Array, dt: float) -> WindshearEstimate:
        f, n = self.f, self.n
        L = f.P.copy()
        if not cholesky(L, n):
            return self._restart(LOST)
        draw(f.x, np.tril(L), math.sqrt(self._c), f.X)
        for row in range(2 * n + 1):
            k.rates(f.X[row], u, self._par, self._F[row])
        drift, growth = self._drift, multiply(f.X.T, multiply(self._weigh, self._F))
        vecmat(self._wm, self._F, drift)
        growth = growth + growth.T + process_covariance(self.p.noise, n, dt) / dt
        nis = math.nan
        if m > 0:
            k.measure(f.X, self._codes, m, u, self._par, f.Y)
            judged = self._judged(m)
            if judged is None:
                return self._restart(LOST)
            nis, kept = judged
            m = len(kept)
            if m > 0:
                K, taken = self._gain(kept, dt)
                correction = np.zeros(n)
                matvec(K, f.nu[kept], correction)
                drift, growth = drift + correction, growth - taken
        f.x += dt * drift
        P = f.P + dt * growth
        if not (finite(f.x) and finite(P.ravel()) and f.x[k.VA] > 10.0):
            return self._restart("estimate not finite: starts anew")
        f.set_cov(P)
        return self._estimate(nis, m)

    def _judged(self, m: int) -> tuple[float, Array] | None:
        """NIS of the sample and positions of the readings that may correct; the innovation is in f.nu. None: its covariance is
        none."""
        f = self.f
        Y, y0 = f.Y[:, :m].copy(), np.zeros(m)
        vecmat(self._wm, Y, y0)
        f.nu[:m] = self._y[:m] - y0
        own = multiply(Y.T, multiply(self._weigh, Y)) + np.diag(np.square(self._r[:m]))
        if not cholesky(own, m):
            return None
        f.Sy[:m, :m] = np.tril(own)
        nis = float(norm_by(f.Sy, m, f.nu[:m].copy()))
        keep = self.gate.kept(self._codes, f.nu, f.Sy, m)
        if keep is None or not nis <= self.p.gate * m:
            return nis, np.zeros(0, dtype=np.int64)
        return nis, keep.copy()

    def _gain(self, kept: Array, dt: float) -> tuple[Array, Array]:
        """K [n,m] and what the readings take off the covariance's derivative [n,n]."""
        f = self.f
        Y = f.Y[:, kept]
        WY = multiply(self._weigh, Y)
        cross, R = multiply(f.X.T, WY), np.diag(np.square(self._r[kept]) * dt)
        own = R if self.p.filter == MEANT else multiply(Y.T, WY) + R
        if self.p.filter == PRINTED:
            K = multiply(cross, own)
        else:
            Kt = cross.T.copy()
            if not solve(own.copy(), Kt):
                Kt[:] = math.nan  # the caller starts anew
            K = Kt.T.copy()
        return K, multiply(multiply(K, own), K.T)


def make_nav(p: WindshearParams, ac: TwinJet | None = None) -> WindshearNav:
    """The estimator p.filter names. Raises ValueError for parameters no filter can run."""
    return ContinuousNav(p, ac) if p.filter in CONTINUOUS else WindshearNav(p, ac)
