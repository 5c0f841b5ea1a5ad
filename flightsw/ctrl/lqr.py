"""Discrete linear-quadratic regulator design with servo, engine-lag, integral and input-delay states (start-up only)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from flightsw.aircraft import Aircraft


class DesignError(RuntimeError):
    """The Riccati equation has no stabilising solution; the text names the condition."""


@dataclass(frozen=True)
class Design:
    """State feedback u = u0 - K (z - z0): K [4,nz], z0 [nz], u0 [4]; `radius` = spectral radius of the closed loop."""

    K: np.ndarray
    z0: np.ndarray
    u0: np.ndarray
    radius: float


def augment(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, ac: Aircraft) -> tuple[np.ndarray, np.ndarray]:
    """Append three second-order servos, the engine lag and the output integrals to a rigid model.

    A [n,n], B [n,4] (aileron, elevator, rudder, thrust), integrated outputs C x + D u, C [ny,n], D [ny,4].
    Returns A_a, B_a of the state [x (n), surface position (3), surface rate (3), thrust (1), integrals (ny)].
    """
    n, ny = A.shape[0], C.shape[0]
    wn, zeta, tau = ac.controls.servo_wn_radps, ac.controls.servo_zeta, ac.engine.tau_s
    nz = n + 7 + ny
    Aa, Ba = np.zeros((nz, nz)), np.zeros((nz, 4))
    Aa[:n, :n] = A
    Aa[:n, n : n + 3] = B[:, :3]
    Aa[:n, n + 6] = B[:, 3]
    Aa[n : n + 3, n + 3 : n + 6] = np.eye(3)
    Aa[n + 3 : n + 6, n : n + 3] = -wn * wn * np.eye(3)
    Aa[n + 3 : n + 6, n + 3 : n + 6] = -2.0 * zeta * wn * np.eye(3)
    Ba[n + 3 : n + 6, :3] = wn * wn * np.eye(3)
    Aa[n + 6, n + 6] = -1.0 / tau
    Ba[n + 6, 3] = 1.0 / tau
    Aa[n + 7 :, :n] = C
    Aa[n + 7 :, n : n + 3] = D[:, :3]
    Aa[n + 7 :, n + 6] = D[:, 3]
    return Aa, Ba


def discretise(A: np.ndarray, B: np.ndarray, T: float, delay: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Zero-order hold over T [s] with the input arriving `delay` [s] late, 0 <= delay <= T: Phi, Gamma_new, Gamma_old.

    x+ = Phi x + Gamma_new u_k + Gamma_old u_{k-1} (Astrom and Wittenmark, Computer-Controlled Systems, section 3.2).
    Raises ValueError for a delay outside one period.
    """
    if not 0.0 <= delay <= T:
        raise ValueError(f"delay = {delay:g} s: allowed 0 to one control period {T:g} s")
    n, m = A.shape[0], B.shape[1]

    def phi_gamma(t: float) -> tuple[np.ndarray, np.ndarray]:
        M = np.zeros((n + m, n + m))
        M[:n, :n], M[:n, n:] = A, B
        E = expm(M * t)
        return E[:n, :n], E[:n, n:]

    phi, _ = phi_gamma(T)
    phi_new, g_new = phi_gamma(T - delay)
    _, g_old = phi_gamma(delay)
    return phi, g_new, phi_new @ g_old


def design(
    A: np.ndarray, B: np.ndarray, T: float, delay: float, q: np.ndarray, r: np.ndarray, z0: np.ndarray, u0: np.ndarray,
    what: str,
) -> Design:  # fmt: skip
    """LQR of the delayed sampled model. A [nz,nz], B [nz,4] continuous; q [nz], r [4] diagonal weights; z0 [nz], u0 [4].

    The returned gain acts on [z, u_{k-1}, u_{k-2}, ...] with one old command per started period of delay. Raises
    DesignError naming `what`.
    """
    nz = A.shape[0]
    whole = max(0, math.ceil(delay / T - 1e-9) - 1)
    phi, gn, go = discretise(A, B, T, delay - whole * T)
    n_old = whole + 1
    size = nz + 4 * n_old
    Ad, Bd = np.zeros((size, size)), np.zeros((size, 4))
    Ad[:nz, :nz] = phi
    Ad[:nz, size - 4 :] = go
    if whole:
        Ad[:nz, size - 8 : size - 4] = gn
    else:
        Bd[:nz] = gn
    Bd[nz : nz + 4] = np.eye(4)
    for k in range(1, n_old):
        Ad[nz + 4 * k : nz + 4 * k + 4, nz + 4 * (k - 1) : nz + 4 * k] = np.eye(4)
    Q = np.diag(np.concatenate((q, np.full(4 * n_old, 1e-9))))
    R = np.diag(r)
    try:
        P = solve_discrete_are(Ad, Bd, Q, R)
    except (np.linalg.LinAlgError, ValueError) as e:
        raise DesignError(f"{what}: no stabilising Riccati solution ({e})") from None
    K = _repeatable(np.linalg.solve(R + Bd.T @ P @ Bd, Bd.T @ P @ Ad), q, r, n_old)
    radius = float(np.abs(np.linalg.eigvals(Ad - Bd @ K)).max())
    if not radius < 1.0:
        raise DesignError(f"{what}: closed loop has spectral radius {radius:.6f}, allowed < 1")
    z0, u0 = np.round(z0, 9), np.round(u0, 9)
    return Design(K, np.concatenate((z0, np.tile(u0, n_old))), u0, radius)


def _repeatable(K: np.ndarray, q: np.ndarray, r: np.ndarray, n_old: int) -> np.ndarray:
    """K [4,nz+4 n_old] to five decimals in Bryson units: the same bits in every process.

    The last digits of a Riccati solution depend on how the linear algebra library found its arrays aligned in memory; a
    flight and its replay must not.
    """
    size = 1.0 / np.sqrt(q)
    size = np.where(size >= 1e6, 1e4, np.where(size >= 1e3, 0.1, size))  # unweighted: thrust [N], servos [rad]
    u = 1.0 / np.sqrt(r)
    unit = np.concatenate((size, np.tile(u, n_old))) / u[:, None]
    return np.asarray(np.round(K * unit, 5) / unit)
