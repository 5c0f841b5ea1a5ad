"""Colour removed from the readings of a linear system, Lee (2011) (3.20)-(3.29), and the filter with noise states beside it.

What is differenced holds the process noise of its own step: v_N = C G w + G_v W (3.22). `Removal` takes that correlation out
as printed, through M, A_N and Q_N, or leaves it in as the nonlinear form does ((4.13), and flightsw.filters.coloured). The
reading in u_N (3.26b) is the one at the end of the step: it tells of the w that drives this step, not the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flightsw.filters.coloured import scaled_sigma

Array = np.ndarray
# correlated: M, A_N, Q_N; uncorrelated: R_N whole, M left out; chapter4: neither M nor the share of w in R_N, as (4.13)
FORMS = ("correlated", "uncorrelated", "chapter4")


@dataclass(frozen=True)
class Linear:
    """(3.21): x_k = x_{k-1} + T (A x_k + B u_k + G w_k), y_k = C x_k + v_k, v_k = v_{k-1} + T (A_v v_k + G_v W_k).

    A [n,n], G [n,q], C [m,n]; Q [q,q] covariance of one w_k; s [m] 1-sigma and tau [m] time constant [s] of the readings'
    noise; T [s].
    """

    A: Array
    G: Array
    C: Array
    Q: Array
    s: Array
    tau: Array
    T: float

    @property
    def A_v(self) -> Array:
        """[m,m] of (2.62)."""
        return np.diag(-1.0 / self.tau)

    @property
    def R_v(self) -> Array:
        """G_v Phi G_v^T [m,m], Phi of (2.61): (1 + e) / (1 - e) (s / tau)^2."""
        r = [scaled_sigma(float(s), self.T, float(tau)) / float(tau) for s, tau in zip(self.s, self.tau, strict=True)]
        return np.diag(np.square(r))


def backward(A: Array, T: float) -> Array:
    """(I - T A)^-1 [n,n] of the backward rule (3.21)."""
    return np.asarray(np.linalg.inv(np.eye(len(A)) - T * A))


def corrected(P: Array, H: Array, R: Array) -> tuple[Array, Array]:
    """Gain [n,m] and covariance [n,n] (Joseph's form) after readings H x + v of covariance R, P [n,n] before."""
    L = np.linalg.solve(H @ P @ H.T + R, H @ P).T
    J = np.eye(len(P)) - L @ H
    P = J @ P @ J.T + L @ R @ L.T
    return L, 0.5 * (P + P.T)


class Removal:
    """Filter of (3.28) in one of FORMS; x [n], P [n,n] as the filter has them, `true` [n,n] the covariance of its error."""

    def __init__(self, sys: Linear, x: Array, P: Array, form: str = "correlated") -> None:
        """x, P: the state once the first reading is in. Raises ValueError for an unknown form."""
        if form not in FORMS:
            raise ValueError(f"form = {form!r}; allowed: {', '.join(FORMS)}")
        self.sys, self.x, self.P, self.true = sys, np.array(x), np.array(P), np.array(P)
        CG = sys.C @ sys.G
        self.C_N = sys.C @ sys.A - sys.A_v @ sys.C
        self.R_N = sys.R_v + (0.0 if form == "chapter4" else CG @ sys.Q @ CG.T)  # (3.23b)
        self.M = sys.Q @ CG.T if form == "correlated" else np.zeros(CG.T.shape)  # (3.24b)
        self.K = np.linalg.solve(self.R_N, (sys.G @ self.M).T).T  # G M R_N^-1
        self.A_N = sys.A - self.K @ self.C_N  # (3.26a)
        self.Q_N = sys.G @ sys.Q @ sys.G.T - self.K @ self.M.T @ sys.G.T  # (3.27b)
        self.F = backward(self.A_N, sys.T)
        self.L = np.zeros(self.K.shape)

    def measurement(self, y: Array, last: Array, Bu: Array) -> Array:
        """y_N [m] of readings y, last [m] and B u [n]: (3.22a)."""
        return np.asarray((y - last) / self.sys.T - self.sys.A_v @ y - self.sys.C @ Bu)

    def advance(self) -> None:
        """Covariances and gain over one step."""
        s = self.sys
        self.P = self.F @ (self.P + s.T**2 * self.Q_N) @ self.F.T
        self.L, self.P = corrected(self.P, self.C_N, self.R_N)
        # the error itself: w and W enter by the prediction, through y_N in u_N, and by the reading
        J = np.eye(len(self.P)) - self.L @ self.C_N
        JF = J @ self.F
        of_v = -s.T * JF @ self.K - self.L
        of_w = s.T * JF @ s.G + of_v @ s.C @ s.G
        self.true = JF @ self.true @ JF.T + of_w @ s.Q @ of_w.T + of_v @ s.R_v @ of_v.T

    def step(self, y_N: Array, Bu: Array, told: Array | None = None) -> Array:
        """x [n] at the end of a step with its reading y_N [m] and B u [n]; told [m]: what stands in u_N in its place."""
        self.advance()
        u_N = Bu + self.K @ (y_N if told is None else told)  # (3.26b)
        x = self.F @ (self.x + self.sys.T * u_N)
        self.x = x + self.L @ (y_N - self.C_N @ x)
        return self.x


class Augmented:
    """The first approach of section 3.5: noise as states, readings without white noise. x [n+m], P [n+m,n+m]."""

    def __init__(self, sys: Linear, x: Array, P: Array) -> None:
        """x [n], P [n,n]: the state before the first reading."""
        n, m = len(x), len(sys.s)
        self.sys, self.n = sys, n
        F, Fv = backward(sys.A, sys.T), backward(sys.A_v, sys.T)
        self.F = np.block([[F, np.zeros((n, m))], [np.zeros((m, n)), Fv]])
        Q = np.block([[sys.G @ sys.Q @ sys.G.T, np.zeros((n, m))], [np.zeros((m, n)), sys.R_v]])
        self.Q = sys.T**2 * self.F @ Q @ self.F.T
        self.H = np.hstack((sys.C, np.eye(m)))
        self.x = np.concatenate((x, np.zeros(m)))
        self.P = np.block([[np.array(P), np.zeros((n, m))], [np.zeros((m, n)), np.diag(np.square(sys.s))]])

    def correct(self, y: Array) -> None:
        """Readings y [m] into x and P."""
        L, self.P = corrected(self.P, self.H, np.zeros((len(y), len(y))))
        self.x = self.x + L @ (y - self.H @ self.x)

    def step(self, y: Array, Bu: Array) -> Array:
        """x [n] at the end of a step with its readings y [m] and B u [n]."""
        push = np.concatenate((Bu, np.zeros(len(y))))
        self.x = self.F @ (self.x + self.sys.T * push)
        self.P = self.F @ self.P @ self.F.T + self.Q
        self.correct(y)
        return np.asarray(self.x[: self.n])
