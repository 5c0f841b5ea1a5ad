"""Discrete linear-quadratic regulator design with servo, engine-lag, integral and input-delay states (start-up only)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.discrete import riccati, spectral_radius
from flightsw.kernels.linalg import solve
from flightsw.kernels.sampled import multiply, sampled

# what a design vector [nz] holds after the n rigid states; OLD: commands under way, 4 each
SERVO, SERVO_RATE, ENGINE, INTEGRALS, OLD = 0, 3, 6, 7, 10  # [rad], [rad/s], [N], [unit of the error times s]


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
    Aa[:n, n + SERVO : n + SERVO_RATE] = B[:, :3]
    Aa[:n, n + ENGINE] = B[:, 3]
    Aa[n + SERVO : n + SERVO_RATE, n + SERVO_RATE : n + ENGINE] = np.eye(3)
    Aa[n + SERVO_RATE : n + ENGINE, n + SERVO : n + SERVO_RATE] = -wn * wn * np.eye(3)
    Aa[n + SERVO_RATE : n + ENGINE, n + SERVO_RATE : n + ENGINE] = -2.0 * zeta * wn * np.eye(3)
    Ba[n + SERVO_RATE : n + ENGINE, :3] = wn * wn * np.eye(3)
    Aa[n + ENGINE, n + ENGINE] = -1.0 / tau
    Ba[n + ENGINE, 3] = 1.0 / tau
    Aa[n + INTEGRALS :, :n] = C
    Aa[n + INTEGRALS :, n + SERVO : n + SERVO_RATE] = D[:, :3]
    Aa[n + INTEGRALS :, n + ENGINE] = D[:, 3]
    return Aa, Ba


def discretise(A: np.ndarray, B: np.ndarray, T: float, delay: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Zero-order hold over T [s] with the input arriving `delay` [s] late, 0 <= delay <= T: Phi, Gamma_new, Gamma_old.

    x+ = Phi x + Gamma_new u_k + Gamma_old u_{k-1} (Astrom and Wittenmark, Computer-Controlled Systems, section 3.2).
    Raises ValueError for a delay outside one period.
    """
    if not 0.0 <= delay <= T:
        raise ValueError(f"delay = {delay:g} s: allowed 0 to one control period {T:g} s")
    phi = sampled(A, B, None, T)[0]
    phi_new, g_new, _ = sampled(A, B, None, T - delay)
    g_old = sampled(A, B, None, delay)[1]
    return phi, g_new, multiply(phi_new, g_old)


def regulator(
    A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, S: np.ndarray | None, what: str
) -> tuple[np.ndarray, float]:
    """Gain K [m,n] of u = -K x that minimises sum x'Qx + u'Ru + 2 x'Su over x+ = A x + B u, and the loop's spectral radius.

    A [n,n], B [n,m], Q [n,n], R [m,m], S [n,m] or None. Raises DesignError naming `what` without a stabilising solution.
    Astrom and Wittenmark, section 11.2. The same bits in every process: a flight, its replay and another processor agree.
    """
    n, m = B.shape
    # in units of the weights: thrust in newtons beside angles would cost six digits
    d = np.diag(Q)
    size = 1.0 / np.sqrt(np.where(d > 0.0, d, 1.0))
    A, B, Q = A * size / size[:, None], B / size[:, None], Q * np.outer(size, size)
    S = np.zeros((n, m)) if S is None else S * size[:, None]
    right = np.hstack((B.T, S.T))
    if not solve(R.copy(), right):
        raise DesignError(f"{what}: the weight of the input is singular")
    Ri_Bt, Ri_St = right[:, :n], right[:, n:]
    P = Q - multiply(S, Ri_St)
    left = riccati(A - multiply(B, Ri_St), multiply(B, Ri_Bt), P)
    BtP = multiply(B.T, P)
    K = multiply(BtP, A) + S.T
    if not (left < 1e-6 and solve(R + multiply(BtP, B), K)):
        raise DesignError(f"{what}: no stabilising Riccati solution")
    radius = float(spectral_radius(A - multiply(B, K)))
    if not radius < 1.0:
        raise DesignError(f"{what}: closed loop has spectral radius {radius:.6f}, allowed < 1")
    return K / size, radius


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
    # commands under way cost next to nothing; of a heavy aircraft's thrust 1e-9 per N^2 would be more than its own weight r
    under_way = np.minimum(1e-9, 0.5 * r)
    Q = np.diag(np.concatenate((q, np.tile(under_way, n_old))))
    R = np.diag(r)
    K, radius = regulator(Ad, Bd, Q, R, None, what)
    return Design(K, np.concatenate((z0, np.tile(u0, n_old))), u0, radius)
