"""Gain schedule over six nominal conditions: turn rate (3 nodes) by airspeed (2 nodes), Lagrange weights (Lee 2.40-2.47)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import vecmat
from flightsw.sixdof.lqr import ENGINE, INTEGRALS, OLD, SERVO, SERVO_RATE, Design
from flightsw.terms import HELD, INTEGRAL


@jit
def weights(psi_dot: float, V: float, yd: np.ndarray, Vn: np.ndarray, w: np.ndarray) -> None:
    """w [6] <- l_i(psi_dot) m_j(V), order (yd1,V1),(yd1,V2),(yd2,V1)...; yd [3] rad/s, Vn [2] m/s.

    They sum to one and are cardinal at the nodes. Inputs are clamped to the node range: the quadratic extrapolates badly.
    """
    y = min(max(psi_dot, yd[0]), yd[2])
    v = min(max(V, Vn[0]), Vn[1])
    m2 = (v - Vn[0]) / (Vn[1] - Vn[0])
    for i in range(3):
        li = 1.0
        for k in range(3):
            if k != i:
                li *= (y - yd[k]) / (yd[i] - yd[k])
        w[2 * i] = li * (1.0 - m2)
        w[2 * i + 1] = li * m2


@jit
def scheduled(
    K: np.ndarray, z0: np.ndarray, u0: np.ndarray, w: np.ndarray, z: np.ndarray, off: np.ndarray, u: np.ndarray
) -> None:
    """u [4] <- sum_i w_i (u0_i - K_i (z - z0_i - off)); K [6,4,nz], z0 [6,nz], u0 [6,4], w [6], z, off [nz]."""
    for a in range(4):
        u[a] = 0.0
    for i in range(K.shape[0]):
        for a in range(4):
            s = u0[i, a]
            for j in range(K.shape[2]):
                s -= K[i, a, j] * (z[j] - z0[i, j] - off[j])
            u[a] += w[i] * s


@jit
def shares(
    K: np.ndarray, z0: np.ndarray, u0: np.ndarray, w: np.ndarray, z: np.ndarray, off: np.ndarray, first: int, last: int,
    out: np.ndarray,
) -> None:  # fmt: skip
    """out [3,4] <- what `scheduled` adds up: feedback of all states but first..last-1, of these (the integrals), sum w_i u0_i."""
    for a in range(4):
        out[0, a] = out[1, a] = out[2, a] = 0.0
        for i in range(K.shape[0]):
            s = c = 0.0
            for j in range(K.shape[2]):
                d = K[i, a, j] * (z[j] - z0[i, j] - off[j])
                if first <= j < last:
                    c -= d
                else:
                    s -= d
            out[0, a] += w[i] * s
            out[1, a] += w[i] * c
            out[2, a] += w[i] * u0[i, a]


@jit
def integrated(
    err: np.ndarray, dt: float, saturated: bool, most: np.ndarray, e: np.ndarray, limits: np.ndarray, known: np.ndarray
) -> None:
    """e [n] += err [n] dt, clamped to +-most [n], and held while the command sits at a limit and would wind up; limits [n] <-
    WKF_LIMIT, known [n] <- 1.0 where the error is a number: one bad estimate must not live on in the integral."""
    for i in range(e.shape[0]):
        step = err[i] * dt
        limits[i], known[i] = HELD, 0.0
        if not math.isfinite(step):
            continue
        known[i] = 1.0
        if saturated and step * e[i] > 0.0:
            continue
        v = e[i] + step
        limits[i] = 0.0
        if v < -most[i]:
            v, limits[i] = -most[i], INTEGRAL
        elif v > most[i]:
            v, limits[i] = most[i], INTEGRAL
        e[i] = v


@jit
def closed(
    psi_dot: float, V: float, yd: np.ndarray, Vn: np.ndarray, w: np.ndarray, K: np.ndarray, z0: np.ndarray, u0: np.ndarray,
    u: np.ndarray, parts: np.ndarray, z: np.ndarray, off: np.ndarray, n: int, pos: np.ndarray, rate: np.ndarray, thrust: float,
    old: np.ndarray, err: np.ndarray, dt: float, saturated: bool, most: np.ndarray, e: np.ndarray, limits: np.ndarray,
    known: np.ndarray,
) -> None:  # fmt: skip
    """A step of a scheduled law: u [4] and parts [3,4] as `scheduled` and `shares` at the condition of `weights`, for a design
    state z [nz] of which n entries are filled; the others are what follows those in lqr.py, in place.

    pos, rate [3] rad, rad/s and thrust [N] of the actuators; old [k,4] commands under way; the rest as `integrated`.
    """
    weights(psi_dot, V, yd, Vn, w)
    for i in range(3):
        z[n + SERVO + i] = pos[i]
        z[n + SERVO_RATE + i] = rate[i]
    z[n + ENGINE] = thrust
    integrated(err, dt, saturated, most, e, limits, known)
    for i in range(e.shape[0]):
        z[n + INTEGRALS + i] = e[i]
    for i in range(old.shape[0]):
        for j in range(4):
            z[n + OLD + 4 * i + j] = old[i, j]
    scheduled(K, z0, u0, w, z, off, u)
    shares(K, z0, u0, w, z, off, n + INTEGRALS, n + OLD, parts)


@jit
def blended(
    psi_dot: float, V: float, yd: np.ndarray, Vn: np.ndarray, w: np.ndarray, K: np.ndarray, z0: np.ndarray, u0: np.ndarray,
    own: np.ndarray, own_parts: np.ndarray, z: np.ndarray, off: np.ndarray, first: int, last: int, share: float, u: np.ndarray,
    parts: np.ndarray,
) -> None:  # fmt: skip
    """Command u [4] and parts [3,4] of one schedule <- by a share [-] those of another, whose tables come first, as `scheduled`
    and `shares` at the condition of `weights`."""
    weights(psi_dot, V, yd, Vn, w)
    scheduled(K, z0, u0, w, z, off, own)
    shares(K, z0, u0, w, z, off, first, last, own_parts)
    for a in range(4):
        u[a] += share * (own[a] - u[a])
        for i in range(3):
            parts[i, a] += share * (own_parts[i, a] - parts[i, a])


class GainSchedule:
    """Six designs stacked, evaluated with Lagrange weights."""

    def __init__(self, designs: list[Design], psi_dots: tuple[float, ...], speeds: tuple[float, ...]) -> None:
        self.K = np.ascontiguousarray([d.K for d in designs])
        self.z0 = np.ascontiguousarray([d.z0 for d in designs])
        self.u0 = np.ascontiguousarray([d.u0 for d in designs])
        self.yd, self.Vn = np.array(psi_dots), np.array(speeds)
        self.w = np.zeros(6)
        self.u = np.zeros(4)
        self.parts = np.zeros((3, 4))
        self.nz = self.K.shape[2]

    def set_condition(self, psi_dot: float, V: float) -> None:
        """Choose the operating point: turn rate [rad/s] and airspeed [m/s]."""
        weights(psi_dot, V, self.yd, self.Vn, self.w)

    def evaluate(self, z: np.ndarray, off: np.ndarray) -> np.ndarray:
        """Command u [4] for state z [nz] and reference offset `off` [nz] (returned array is reused)."""
        scheduled(self.K, self.z0, self.u0, self.w, z, off, self.u)
        return self.u

    def tables(self) -> tuple[np.ndarray, ...]:
        """What `closed` and `blended` begin with after the condition: nodes, weights, designs; command u [4], its parts [3,4]."""
        return self.yd, self.Vn, self.w, self.K, self.z0, self.u0, self.u, self.parts

    def trim_command(self) -> np.ndarray:
        """Feed-forward u [4] of the current condition without feedback."""
        u = np.zeros(4)
        vecmat(self.w, self.u0, u)
        return u
