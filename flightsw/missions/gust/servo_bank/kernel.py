"""A sample of many extended filters at once, each on the surfaces of its own servo model, in compiled loops.

F filters of states.py: Z [F,11], P [F,11,11] (both triangles); `of` [F] is the servo model a filter believes. Servo models [C]:
two surfaces of second order behind a command that is so many samples old. Updates take the readings one after the other (R is
diagonal), all linearised at the prediction: the same numbers as the batch update, with NIS and determinant for nothing.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import matvec
from flightsw.kernels.products import add_symmetric, block_product
from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.servo_bank import states as st
from flightsw.missions.gust.servos import PARTS
from flightsw.sixdof.actuators import servo_step

LOG_2PI = math.log(2.0 * math.pi)
NZ = st.NZ
# workspace of `predict`: slopes of the rates, transition, a product, noise; of `correct`: readings expected, state before, gain
(M_A, M_F, M_B, M_Q, M_N) = range(5)
(V_READ, V_START, V_GAIN, V_N) = range(4)


@jit
def move_surfaces(
    now: np.ndarray, rate: np.ndarray, mean: np.ndarray, sent: np.ndarray, age: np.ndarray, wn: np.ndarray, zeta: float,
    lim: np.ndarray, dt: float,
) -> None:  # fmt: skip
    """Advance the servo models by dt [s]: now, rate, mean [C,3], in place. sent [k,3] commands, newest first; age [C] which of
    them acts; wn [C] rad/s, lim [3,3] as in `servo_step`. The throttle has no servo."""
    for c in range(now.shape[0]):
        command = sent[age[c]]
        for i in range(3):
            mean[c, i] = 0.0
        now[c, g.THROTTLE] = command[g.THROTTLE]
        for _ in range(PARTS):
            for i in range(3):
                mean[c, i] += now[c, i] * (0.5 / PARTS)
            servo_step(now[c], rate[c], command, lim, wn[c], zeta, dt / PARTS)
            now[c, g.THROTTLE] = command[g.THROTTLE]
            for i in range(3):
                mean[c, i] += now[c, i] * (0.5 / PARTS)


@jit
def carry(P: np.ndarray, A: np.ndarray, dt: float, Q: np.ndarray, F: np.ndarray, B: np.ndarray) -> None:
    """P [n,n] <- F P F' + Q with F = exp(A dt) to fourth order; F, B [n,n] workspace. Q [n,n]."""
    n = P.shape[0]
    for i in range(n):
        for j in range(n):
            F[i, j] = 1.0 if i == j else 0.0
    for order in range(4, 0, -1):  # F <- 1 + A dt / order F
        h = dt / order
        block_product(A, F, n, n, n, B)
        for i in range(n):
            for j in range(n):
                F[i, j] = B[i, j] * h + (1.0 if i == j else 0.0)
    block_product(F, P, n, n, n, B)
    for i in range(n):
        for j in range(i + 1):
            P[i, j] = Q[i, j]
    add_symmetric(B, F, n, n, P)


@jit
def predict(
    Z: np.ndarray, P: np.ndarray, of: np.ndarray, mean: np.ndarray, intensity: np.ndarray, wind: np.ndarray, rest: np.ndarray,
    p: np.ndarray, dt: float, W: np.ndarray, M: np.ndarray,
) -> None:  # fmt: skip
    """All filters dt [s] on: mean surfaces [C,3] of their servo models; noise intensity[F]^2 wind + rest [11,11]. W [6,11] and M
    [4,11,11] workspace."""
    a, Q = W[g.W_AIR], M[M_Q]
    for f in range(Z.shape[0]):
        u = mean[of[f]]
        st.rate_slopes(Z[f], u, p, a, M[M_B, : st.S_N], M[M_A])
        s2 = intensity[f] * intensity[f]
        for i in range(NZ):
            for j in range(NZ):
                Q[i, j] = s2 * wind[i, j] + rest[i, j]
        carry(P[f], M[M_A], dt, Q, M[M_F], M[M_B])
        st.propagate(Z[f], u, p, dt, W)


@jit
def foresee(
    z: np.ndarray, P: np.ndarray, u: np.ndarray, p: np.ndarray, codes: np.ndarray, y: np.ndarray, r: np.ndarray, m: int,
    a: np.ndarray, S: np.ndarray, C: np.ndarray, expected: np.ndarray, nu: np.ndarray, Sy: np.ndarray,
) -> None:  # fmt: skip
    """nu [>=m], Sy [>=m,>=m] <- innovations of the m readings y (channels `codes`, sigmas r) and their covariance, both
    triangles.

    z [11], P [11,11], u [3]; a [4], S [6,11], C [7,11], expected [7] workspace."""
    st.instruments(z, u, p, a, expected)
    st.instrument_slopes(z, u, p, a, S, C)
    for i in range(m):
        nu[i] = y[i] - expected[codes[i]]
        for j in range(i + 1):
            s = r[i] * r[i] if i == j else 0.0
            for k in range(NZ):
                for q in range(NZ):
                    s += C[codes[i], k] * P[k, q] * C[codes[j], q]
            Sy[i, j] = s
            Sy[j, i] = s


@jit
def correct(
    Z: np.ndarray, P: np.ndarray, of: np.ndarray, now: np.ndarray, p: np.ndarray, codes: np.ndarray, y: np.ndarray, R: np.ndarray,
    m: int, a: np.ndarray, S: np.ndarray, C: np.ndarray, w: np.ndarray, nis: np.ndarray, ll: np.ndarray,
) -> None:  # fmt: skip
    """All filters take the m readings y (channels `codes`); R [F,>=m] sigma of each in each filter; now [C,3] surfaces.

    nis [F], ll [F] <- normalised innovation squared and log-likelihood. a [4], S [6,11], C [7,11], w [3,11] workspace.
    """
    expected, start, K = w[V_READ], w[V_START], w[V_GAIN]
    for f in range(Z.shape[0]):
        z, V, u = Z[f], P[f], now[of[f]]
        st.instruments(z, u, p, a, expected)
        st.instrument_slopes(z, u, p, a, S, C)
        for i in range(NZ):
            start[i] = z[i]
        nis[f], ll[f] = 0.0, -0.5 * m * LOG_2PI
        for j in range(m):
            row = C[codes[j]]
            nu, s = y[j] - expected[codes[j]], R[f, j] * R[f, j]
            for i in range(NZ):
                nu -= row[i] * (z[i] - start[i])
            matvec(V, row, K)
            for i in range(NZ):
                s += row[i] * K[i]
            for i in range(NZ):
                z[i] += K[i] * nu / s
                for q in range(i + 1):
                    V[i, q] -= K[i] * K[q] / s
                    V[q, i] = V[i, q]
            nis[f] += nu * nu / s
            ll[f] -= 0.5 * (nu * nu / s + math.log(s))


@jit
def mix(
    Z: np.ndarray, P: np.ndarray, mu: np.ndarray, T: np.ndarray, Z0: np.ndarray, P0: np.ndarray, c: np.ndarray
) -> None:
    """Interacting multiple models, before the time update: filters Z [k,11], P [k,11,11] from all, probabilities mu [k] through
    the transition T [k,k], in place. Z0, P0, c: workspace of the sizes of Z, P, mu. Blom and Bar-Shalom (1988)."""
    k = Z.shape[0]
    for j in range(k):
        c[j] = 0.0
        for i in range(k):
            c[j] += mu[i] * T[i, j]
        for a in range(NZ):
            Z0[j, a] = 0.0
            for b in range(a + 1):
                P0[j, a, b] = 0.0
        for i in range(k):
            w = mu[i] * T[i, j] / c[j]
            for a in range(NZ):
                Z0[j, a] += w * Z[i, a]
        for i in range(k):
            w = mu[i] * T[i, j] / c[j]
            for a in range(NZ):
                for b in range(a + 1):
                    P0[j, a, b] += w * (P[i, a, b] + (Z[i, a] - Z0[j, a]) * (Z[i, b] - Z0[j, b]))
    for j in range(k):
        for a in range(NZ):
            Z[j, a] = Z0[j, a]
            for b in range(a + 1):
                P[j, a, b] = P0[j, a, b]
                P[j, b, a] = P0[j, a, b]
    for j in range(k):
        mu[j] = c[j]


@jit
def weigh(mu: np.ndarray, ll: np.ndarray, least: float) -> None:
    """mu [k] <- probabilities after readings of log-likelihood ll [k]; none falls below `least`. Not finite: as they were."""
    top = -math.inf
    for i in range(ll.shape[0]):
        if not math.isfinite(ll[i]):
            return
        top = max(top, ll[i])
    total = 0.0
    for i in range(mu.shape[0]):
        mu[i] *= math.exp(ll[i] - top)
        total += mu[i]
    again = 0.0
    for i in range(mu.shape[0]):
        mu[i] = max(mu[i] / total, least)
        again += mu[i]
    for i in range(mu.shape[0]):
        mu[i] /= again


@jit
def combine(Z: np.ndarray, P: np.ndarray, mu: np.ndarray, z: np.ndarray, V: np.ndarray) -> None:
    """z [11], V [11,11] <- mean and covariance of the mixture of the filters Z [k,11], P [k,11,11] with probabilities mu [k]."""
    for a in range(NZ):
        s = 0.0
        for i in range(Z.shape[0]):
            s += mu[i] * Z[i, a]
        z[a] = s
    for a in range(NZ):
        for b in range(a + 1):
            V[a, b] = 0.0
    for i in range(Z.shape[0]):
        for a in range(NZ):
            for b in range(a + 1):
                V[a, b] += mu[i] * (P[i, a, b] + (Z[i, a] - z[a]) * (Z[i, b] - z[b]))
    for a in range(NZ):
        for b in range(a):
            V[b, a] = V[a, b]
