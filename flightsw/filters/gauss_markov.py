"""Exact discretisation of the wind and noise models an estimator may carry as states.

First-order Gauss-Markov, the exponentially correlated wind (ECWM) and Dryden turbulence, each as (Phi, SQ): x' = Phi x + SQ n
with n white of unit variance, exact for any step (Lee 2011, section 2.5 after errata E13, E14; MIL-F-8785C).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.covariance import chol_psd
from flightsw.kernels.discrete import discretise

Array = np.ndarray
# Dryden states: u [m/s]; the filters of v and w, two states each, driven by noise of unit intensity. Outputs u, v, w [m/s]
U, V_PAIR, W_PAIR = 0, slice(1, 3), slice(3, 5)
OUT_U, OUT_V, OUT_W = 0, 1, 2


def _positive(**values: float) -> None:
    for name, v in values.items():
        if not (math.isfinite(v) and v > 0.0):
            raise ValueError(f"{name} = {v}; allowed: finite, > 0")


def first_order(T: float, tau: float, sigma: float) -> tuple[float, float]:
    """phi [-] and q of v' = phi v + q n with stationary standard deviation sigma; step T [s], time constant tau [s].

    phi = exp(-T/tau), q = sigma sqrt(1 - phi^2). Raises ValueError for non-positive T or tau.
    """
    _positive(T=T, tau=tau)
    # 1 - phi^2 through expm1: no cancellation for T << tau
    return math.exp(-T / tau), sigma * math.sqrt(-math.expm1(-2.0 * T / tau))


def ecwm(T: float, tau: float, mean: float, spread: float) -> tuple[Array, Array]:
    """Phi [2,2], SQ [2,2] of the north and east components of the exponentially correlated wind.

    T step, tau correlation time [s]; mean, spread of the wind's magnitude [m/s]. a = 2 (mean^2 + spread^2), stationary variance
    a/2 per component (lee.md 3.5). Raises ValueError for non-positive T or tau.
    """
    phi, q = first_order(T, tau, math.hypot(mean, spread))
    return phi * np.eye(2), q * np.eye(2)


def critically_damped(T: float, w: float) -> tuple[Array, Array]:
    """Phi [2,2], Q [2,2] of xdot = [[0,1],[-w^2,-2w]] x + [0,1] n, n of unit intensity; step T [s], w [rad/s].

    Phi = e^{-wT} [[1+wT, T],[-w^2 T, 1-wT]]; Q = int_0^T c c^T ds, c = e^{-ws} [s, 1-ws].
    """
    wT = w * T
    Phi = math.exp(-wT) * np.array([[1.0 + wT, T], [-w * wT, 1.0 - wT]])
    A, Xi = np.array([[0.0, 1.0], [-w * w, -2.0 * w]]), np.diag([0.0, 1.0])
    F, G, Q = np.zeros((2, 2)), np.zeros((2, 0)), np.zeros((2, 2))
    # by series and doubling: the closed form of the integral loses half its digits for small wT
    discretise(A, np.zeros((2, 0)), Xi, T, F, G, Q, np.zeros((4, 2, 2)))
    return Phi, Q


def dryden(T: float, V: float, L: float | Array, sigma: float | Array) -> tuple[Array, Array, Array, Array]:
    """Dryden turbulence in states [u, v1, v2, w1, w2]: Phi [5,5], SQ [5,5], output C [3,5] (u, v, w in m/s), P0 [5,5].

    T step [s], V airspeed [m/s], L scale lengths [m] (scalar or [3]), sigma [m/s] (scalar or [3]); P0 is the stationary
    covariance. u: first order, omega = V/L; v, w: H(s) = sigma sqrt(3 omega) (s + omega/sqrt 3) / (s + omega)^2 driven by
    unit white noise (lee.md 3.5 with the intensity pi folded in, so no separate factor is needed). Raises ValueError
    for non-positive T, V or L, or a negative sigma.
    """
    (Lu, Lv, Lw), sg = np.broadcast_to(np.asarray(L, float), 3), np.broadcast_to(np.asarray(sigma, float), 3)
    _positive(T=T, V=V, L_u=Lu, L_v=Lv, L_w=Lw)
    if not (sg >= 0.0).all():
        raise ValueError(f"sigma = {sg.tolist()}; allowed >= 0")
    su, sv, sw = sg
    Phi, SQ, C, P0 = np.zeros((5, 5)), np.zeros((5, 5)), np.zeros((3, 5)), np.zeros((5, 5))
    Phi[U, U], SQ[U, U] = first_order(T, Lu / V, float(su))
    P0[U, U], C[OUT_U, U] = su**2, 1.0
    for axis, b, length, s in ((OUT_V, V_PAIR, Lv, sv), (OUT_W, W_PAIR, Lw, sw)):
        w = V / length
        Phi[b, b], Q = critically_damped(T, w)
        L = np.zeros((2, 2))
        chol_psd(Q, 2, L)
        SQ[b, b] = L
        C[axis, b] = s * w**1.5, s * math.sqrt(3.0 * w)
        P0[b, b] = np.diag([0.25 / w**3, 0.25 / w])
    return Phi, SQ, C, P0


def random_walk_intensity(V: float, L: float, sigma: float) -> float:
    """q [m/s/sqrt(s)] of the random walk that grows as fast as Dryden u does at first: sigma sqrt(2 V/L)."""
    _positive(V=V, L=L)
    return sigma * math.sqrt(2.0 * V / L)
