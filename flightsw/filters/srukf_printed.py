"""Square-root UKF as printed: QR of the points, rank-1 up- and down-dates (Lee 2011 (3.15)-(3.18); van der Merwe 2001).

Kept beside the down-date-free `SquareRootUKF` to measure what the printed form costs. Corrected only where the print cannot
run: a negative centre weight takes a down-date with sqrt(|w0c|) (erratum E17), and (3.18j) is m rank-1 down-dates of the
lower factor, one per column of U = K Sy (E18). A down-date that would leave P indefinite is detected, not performed, and
counted in `failures` (lee.md trap 14).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.augmented import AugmentedPoints, add_process_noise, measured_points
from flightsw.filters.covariance import apply_innovation, chol_psd, gain
from flightsw.filters.srukf import CENTRE, _weighted_mean, row_norms
from flightsw.filters.ukf import weighted_cov
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import gram, tria

Array = np.ndarray


BAD_SY, BAD_S = 0, 1  # counts of refused down-dates: of the innovation's factor, of the state's


@jit
def chol_update(S: np.ndarray, n: int, v: np.ndarray) -> None:
    """S [n,n] lower <- factor of S S^T + v v^T by Givens rotations; v [n] is overwritten. Golub and Van Loan sec. 6.5.4."""
    for k in range(n):
        a = S[k, k]
        r = math.sqrt(a * a + v[k] * v[k])
        if r == 0.0:
            continue
        c = a / r
        s = v[k] / r
        S[k, k] = r
        for i in range(k + 1, n):
            t = c * S[i, k] + s * v[i]
            v[i] = c * v[i] - s * S[i, k]
            S[i, k] = t


@jit
def chol_downdate(S: np.ndarray, n: int, v: np.ndarray, w: np.ndarray) -> int:
    """S [n,n] lower <- factor of S S^T - v v^T; returns 0, or 1 with S unchanged when that is not positive definite.

    LINPACK dchdd: p = S^-1 v, fails for |p| >= 1, then rotations that carry (p, sqrt(1-|p|^2)) to a unit vector.
    v [n] and w [2n] are overwritten. A zero column of S is allowed where v has no component along it.
    """
    for i in range(n):
        s = v[i]
        for j in range(i):
            s -= S[i, j] * v[j]
        if S[i, i] != 0.0:
            v[i] = s / S[i, i]
        elif s == 0.0:
            v[i] = 0.0
        else:
            return 1
    q = 1.0
    for i in range(n):
        q -= v[i] * v[i]
    if not q > 0.0:
        return 1
    alpha = math.sqrt(q)
    for k in range(n - 1, -1, -1):
        h = math.sqrt(alpha * alpha + v[k] * v[k])
        w[k] = alpha / h
        w[n + k] = v[k] / h
        alpha = h
    for j in range(n):
        # the rotations mix row j of S with a zero row, last column first
        z = 0.0
        for k in range(j, -1, -1):
            t = w[k] * z + w[n + k] * S[j, k]
            S[j, k] = w[k] * S[j, k] - w[n + k] * z
            z = t
    for k in range(n):
        if S[k, k] < 0.0:
            for i in range(k, n):
                S[i, k] = -S[i, k]
    return 0


@jit
def _centre(Z: np.ndarray, z: np.ndarray, n: int, w0c: float, S: np.ndarray, v: np.ndarray, w: np.ndarray) -> int:
    """(3.17c), (3.18e): rank-1 update of S with the centre point, a down-date when its weight is negative."""
    q = math.sqrt(abs(w0c))
    for i in range(n):
        v[i] = q * (Z[CENTRE, i] - z[i])
    if w0c < 0.0:
        return chol_downdate(S, n, v, w)
    chol_update(S, n, v)
    return 0


@jit
def printed_recombine(
    X: np.ndarray, w0m: float, w0c: float, wi: float, SQ: np.ndarray, again: bool, g: float,
    x: np.ndarray, S: np.ndarray, A: np.ndarray, w: np.ndarray,
) -> int:  # fmt: skip
    """(3.17): x [n], S [n,n] <- moments of X [2L+1,n]; workspaces A [max(n,m), 2L+nq], w [3 max(n,m)]. Returns failures."""
    n = x.shape[0]
    p = X.shape[0]
    k1 = p - 1
    if not again:
        add_process_noise(X, SQ, g)
    _weighted_mean(X, n, w0m, wi, x)
    si = math.sqrt(wi)
    for i in range(n):
        for k in range(1, p):
            A[i, k - 1] = si * (X[k, i] - x[i])
        if again:
            for j in range(SQ.shape[1]):
                A[i, k1 + j] = SQ[i, j]
    tria(A, n, k1 + SQ.shape[1] if again else k1, S)
    return _centre(X, x, n, w0c, S, w[:n], w[n:])


@jit
def printed_correct(
    X: np.ndarray, Z: np.ndarray, y: np.ndarray, m: int, w0m: float, w0c: float, wi: float, x: np.ndarray,
    S: np.ndarray, nu: np.ndarray, K: np.ndarray, Sy: np.ndarray, A: np.ndarray, w: np.ndarray, bad: np.ndarray,
) -> float:  # fmt: skip
    """(3.18b-k) from points X [2L+1,n] and noisy images Z [2L+1,>=m]; returns NIS.

    bad [2] <- number of refused down-dates of Sy and of S. Workspaces as printed_recombine.
    """
    n = x.shape[0]
    p = X.shape[0]
    _weighted_mean(Z, m, w0m, wi, nu)
    si = math.sqrt(wi)
    for a in range(m):
        for k in range(1, p):
            A[a, k - 1] = si * (Z[k, a] - nu[a])
    tria(A, m, p - 1, Sy)
    bad[BAD_SY] = _centre(Z, nu, m, w0c, Sy, w[:m], w[m:])
    weighted_cov(X, x, n, Z, nu, m, w0c, wi, K)
    gain(K, n, Sy, m)
    bad[BAD_S] = 0
    for a in range(m):
        for i in range(n):
            s = 0.0
            for b in range(a, m):
                s += K[i, b] * Sy[b, a]
            w[i] = s
        bad[BAD_S] += chol_downdate(S, n, w[:n], w[n:])
    for a in range(m):
        nu[a] = y[a] - nu[a]
    return apply_innovation(K, nu, m, Sy, x, w)


class PrintedSquareRootUKF(AugmentedPoints):
    """Augmented, L = n + nq + m, with sequential down-dates. `kappa=None` is the recommended-in-print 3 - L."""

    def __init__(
        self, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float | None = 0.0, beta: float = 2.0,
        redraw: bool = False, strict: bool = False,
    ) -> None:  # fmt: skip
        """Arguments and errors as AugmentedPoints; strict=True raises FilterFailureError at the first refused down-date."""
        super().__init__(n, m, nq, alpha, kappa, beta, redraw, strict)
        big = max(n, m)
        self._A = np.zeros((big, 2 * self.L + nq))
        self._w = np.zeros(3 * big)
        self._bad = np.zeros(2, dtype=np.int64)

    @property
    def S(self) -> Array:
        """Lower-triangular factor [n,n], the filter's own array."""
        return self._C

    @property
    def P(self) -> Array:
        """Covariance [n,n]."""
        P = np.zeros((self.n, self.n))
        gram(self._C, P)
        return P

    def factor(self) -> Array:
        """The factor itself."""
        return self._C

    def recombine(self) -> None:
        """Time update from the propagated points and SQ; a refused centre down-date leaves the (larger) QR factor."""
        again = self._again
        if printed_recombine(
            self.X, self.w0m, self.w0c, self.wi, self.SQ, again, self.g, self.x, self._C, self._A, self._w
        ):
            self._failed("down-date of S with the centre point")
        self._keep(not again)

    def correct(self, y: Array, r: Array, m: int) -> float:
        """Measurement update from Y[:, :m]; y, r [>=m]; returns NIS. Refused down-dates leave S as it was (larger)."""
        self._kept = self._again = False
        measured_points(self.Y, r, m, self.n + self.nq, self.g, self._Z)
        nis = float(
            printed_correct(
                self.X, self._Z, y, m, self.w0m, self.w0c, self.wi, self.x,
                self._C, self.nu, self.K, self.Sy, self._A, self._w, self._bad,
            )
        )  # fmt: skip
        for k, name in ((0, "down-date of Sy with the centre point"), (1, "down-date of S with a column of K Sy")):
            for _ in range(self._bad[k]):
                self._failed(name)
        return nis

    def set_factor(self, S: Array) -> None:
        """S [n,n] <- lower-triangular factor of S S^T."""
        k = S.shape[1]
        A = np.zeros((self.n, max(k, self.n)))
        A[:, :k] = S
        tria(A, self.n, A.shape[1], self._C)

    def set_cov(self, P: Array) -> None:
        """S <- factor of the symmetric P [n,n]; zero variances allowed. Raises ValueError when P is indefinite."""
        if chol_psd(np.ascontiguousarray(0.5 * (P + P.T)), self.n, self._C):
            raise ValueError("covariance is indefinite; allowed: symmetric, positive semi-definite")

    def sigmas(self) -> list[float]:
        """1-sigma of every state [n]."""
        row_norms(self._C, self.sigma)
        return self.sigma.tolist()
