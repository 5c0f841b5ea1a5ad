"""Air-motion kernels: prevailing wind with height, frozen gust field, exact noise-shaping recursions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit, jit_own

Arr = NDArray[np.float64]


@jit
def gauss_markov_block(x: Arr, e: float, noise: Arr) -> None:
    """Turn unit white `noise` [m, c] in place into stationary unit-variance Gauss-Markov series.

    x' = e x + sqrt(1 - e^2) n with e = exp(-T/tau) (exact); `x` [c] carries the last value from block to block.
    """
    g = math.sqrt(1.0 - e * e)
    for k in range(noise.shape[0]):
        for j in range(noise.shape[1]):
            x[j] = e * x[j] + g * noise[k, j]
            noise[k, j] = x[j]


@jit_own
def linear_block(x: Arr, phi: Arr, chol: Arr, c: Arr, noise: Arr, tmp: Arr, out: Arr) -> None:
    """Run x' = phi x + chol n, y = c x over the rows of `noise` [m, nx]; `out` [m, ny] is filled, `x` carried on.

    The axes of a gust do not act on each other: of each row only what lies between its first and last entry is summed.
    """
    nx, ny = phi.shape[0], c.shape[0]
    first, last = np.full(nx, nx), np.zeros(nx, np.int64)
    from_, to = np.full(ny, nx), np.zeros(ny, np.int64)
    for j in range(nx):
        for i in range(nx):
            if phi[i, j] != 0.0 or chol[i, j] != 0.0:
                first[i], last[i] = min(first[i], j), j + 1
        for i in range(ny):
            if c[i, j] != 0.0:
                from_[i], to[i] = min(from_[i], j), j + 1
    for k in range(noise.shape[0]):
        for i in range(ny):
            y = 0.0
            for j in range(from_[i], to[i]):
                y += c[i, j] * x[j]
            out[k, i] = y
        for i in range(nx):
            v = 0.0
            for j in range(first[i], last[i]):
                v += phi[i, j] * x[j] + chol[i, j] * noise[k, j]
            tmp[i] = v
        for i in range(nx):
            x[i] = tmp[i]


@jit_own
def linear_mix(h: Arr, x: Arr, out: Arr) -> None:
    """out [m, lines, c] <- filters even in time: sum over l <= j, n of h[c, j, l, |n|] x[c, l, t + n]; line 0 is copied.

    h [c, lines, lines, taps + 1], x [c, lines, m + 2 taps]. The inner loop runs over time: its order of sums is fixed.
    """
    taps, m = h.shape[3] - 1, out.shape[0]
    acc = np.zeros(m)
    for c in range(h.shape[0]):
        for t in range(m):
            out[t, 0, c] = x[c, 0, t + taps]
        for j in range(1, h.shape[1]):
            acc[:] = 0.0
            for i in range(j + 1):
                g, line = h[c, j, i, 0], x[c, i]
                now = line[taps : taps + m]
                for t in range(m):
                    acc[t] += g * now[t]
                for k in range(1, taps + 1):
                    g, before, after = h[c, j, i, k], line[taps - k : taps - k + m], line[taps + k : taps + k + m]
                    for t in range(m):
                        acc[t] += g * (before[t] + after[t])
            for t in range(m):
                out[t, j, c] = acc[t]


@jit
def lay_gusts(cs: float, sn: float, gust: Arr, at: int, rings: Arr, k: int) -> None:
    """Store the gusts of tick k, gust[at, line] = (u, v, w) [m/s], in the ring buffers `rings` [lines, m, 3] in NED: u lies along
    the horizontal unit vector (cs, sn) north, east, v to the right of it.
    """
    i = k % rings.shape[1]
    for line in range(rings.shape[0]):
        u, v = gust[at, line, 0], gust[at, line, 1]
        rings[line, i, 0], rings[line, i, 1], rings[line, i, 2] = u * cs - v * sn, u * sn + v * cs, gust[at, line, 2]


@jit
def meet(
    cs: float,
    sn: float,
    gust: Arr,
    row: int,
    ahead: int,
    h: float,
    table: Arr,
    slow: Arr,
    at: int,
    rings: Arr,
    k: int,
    lag: float,
    calm: Arr,
    free: Arr,
    wind: Arr,
    probe: Arr,
) -> None:
    """Of who lays the gusts (row >= 0): lay_gusts of tick k + ahead. Then calm_air, free_air on the centre's line, and the
    undisturbed effective wind [NW] and probes' [m, 3] that go with it: what disturbs them adds to both."""
    if row >= 0:
        lay_gusts(cs, sn, gust, row, rings, k + ahead)
    calm_air(h, table, slow, at, calm)
    free_air(calm, rings[0], k, lag, free)
    wind[0], wind[1], wind[2] = free[0], free[1], free[2]
    wind[3:] = 0.0
    probe[:] = 0.0


@jit
def calm_air(h: float, table: Arr, slow: Arr, at: int, calm: Arr) -> None:
    """Wind [m/s, NED] without gusts and wake at height h [m]: sounding + slow[at] (north, east, down).

    `table` [m, 3] height, north, east component, ascending; components are interpolated linearly, ends held.
    """
    m = table.shape[0]
    if h <= table[0, 0]:
        calm[0], calm[1] = table[0, 1], table[0, 2]
    elif h >= table[m - 1, 0]:
        calm[0], calm[1] = table[m - 1, 1], table[m - 1, 2]
    else:
        lo, hi = 0, m - 1
        while hi - lo > 1:
            mid = (lo + hi) // 2
            if table[mid, 0] <= h:
                lo = mid
            else:
                hi = mid
        f = (h - table[lo, 0]) / (table[hi, 0] - table[lo, 0])
        calm[0] = table[lo, 1] + f * (table[hi, 1] - table[lo, 1])
        calm[1] = table[lo, 2] + f * (table[hi, 2] - table[lo, 2])
    calm[0] += slow[at, 0]
    calm[1] += slow[at, 1]
    calm[2] = slow[at, 2]


@jit
def free_air(calm: Arr, ring: Arr, k: int, lag: float, free: Arr) -> None:
    """Wind [m/s, NED] without wake: `calm` [3] and the gust laid `lag` ticks before tick k.

    The gust is interpolated linearly in the ring buffer; `lag` is limited to what the buffer holds.
    """
    size = ring.shape[0]
    lag = min(float(size - 2), max(0.0, lag))
    i = int(lag)
    f = lag - i
    a, b = (k - i) % size, (k - i - 1) % size
    free[0] = calm[0] + (ring[a, 0] + f * (ring[b, 0] - ring[a, 0]))
    free[1] = calm[1] + (ring[a, 1] + f * (ring[b, 1] - ring[a, 1]))
    free[2] = calm[2] + ring[a, 2] + f * (ring[b, 2] - ring[a, 2])
