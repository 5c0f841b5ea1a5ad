"""Turbulence at the probes: how strong it is, and how much of it each probe has for itself (docs/sources/probe-offsets.md 3).

Isotropic frozen turbulence of scale length L: two probes a few metres apart meet nearly the same gust, and what differs is nearly
white. Both intensities are learnt from differences in time, to which offsets and steady winds add nothing.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.expected import OF_ALPHA, OF_BETA, OF_V

Arr = NDArray[np.float64]
AXES = range(3)
PROBES = range(3)
FLOW = (1, 2)  # beta, alpha
STEP_S = 0.05  # [s] between readings
LAG, LAG_OWN = 6, 3  # samples over which a difference is taken: of the common gust, of what a pair of probes differs by
WHITE = 60  # samples over which what differs is summed to noise as good as white
CHANCE = 0.12  # [(m/s)^2] of that intensity, squared, which the noise of the readings alone makes up in ten seconds
FIRST_S, FIRST_MPS = 2.0, 2.0  # [s] until something is known; [m/s] taken until then
OF = (OF_V, OF_BETA, OF_ALPHA)


def tensor(r: tuple[float, float, float], L: float) -> list[list[float]]:
    """Covariance [3][3] of isotropic turbulence of unit intensity at separation r [m] (Batchelor 1953, eq. 3.4.5): longitudinal
    exp(-r/L), transverse (1 - r/2L) exp(-r/L)."""
    d = math.hypot(*r)
    f = math.exp(-d / L)
    g = (1.0 - 0.5 * d / L) * f
    q = (f - g) / (d * d) if d > 0.0 else 0.0
    return [[q * r[i] * r[j] + (g if i == j else 0.0) for j in AXES] for i in AXES]


def spread(probes: Arr, V: float, L: float, n: int) -> Arr:
    """Covariance [9,9] of the mean of n readings (V [m/s], beta, alpha [rad]) by which each probe's air differs from that of all,
    per unit intensity [(m/s)^2]; probes [3,3] m, V [m/s]."""
    at = probes.tolist()
    C = np.zeros((9, 9))
    for a in PROBES:
        for b in PROBES:
            ahead, right, below = (p - q for p, q in zip(at[a], at[b], strict=True))
            for lag in range(1 - n, n):
                T = tensor((ahead + lag * V * STEP_S, right, below), L)
                share = (n - abs(lag)) / (n * n)
                for i in AXES:
                    for j in AXES:
                        C[3 * i + a, 3 * j + b] += share * T[i][j]
    for i in AXES:  # less the mean of the probes, rows then columns
        C[OF[i], :] -= C[OF[i], :].mean(axis=0)
    for i in AXES:
        C[:, OF[i]] -= C[:, OF[i]].mean(axis=1)[:, None]
    by = np.repeat([1.0, 1.0 / V, 1.0 / V], 3)
    return C * by[:, None] * by[None, :]


def changes(L: float, way: float) -> tuple[float, float, float]:
    """Variance along, across and down of the change of a gust of unit intensity over `way` [m] (rough-air.md 1)."""
    T = tensor((way, 0.0, 0.0), L)
    along, across, down = (2.0 * (1.0 - T[i][i]) for i in AXES)
    return along, across, down


def parting(r: tuple[float, float, float], L: float, way: float) -> tuple[float, float, float]:
    """Variance of the change over `way` [m] of what two probes r [m] apart differ by, unit intensity: along, across, down."""

    def differ(s: float) -> list[float]:
        x, y, z = r
        here, there, back = (tensor((s + k * x, k * y, k * z), L) for k in (0, 1, -1))
        return [2.0 * here[i][i] - there[i][i] - back[i][i] for i in AXES]

    along, across, down = (2.0 * (a - b) for a, b in zip(differ(0.0), differ(way), strict=True))
    return along, across, down


class OwnAir:
    """Learns `sigma` [m/s], 1-sigma per axis of the turbulence, and `own` [m/s], the intensity that explains what the probes
    differ by: 0 where all meet the same gusts."""

    def __init__(
        self, probes: Arr, L: float, V: float, noise: tuple[float, float, float], least: float, memory_s: float
    ) -> None:
        """probes [3,3] m, V [m/s] airspeed, noise of one reading of V [m/s], beta, alpha [rad], least [m/s] of `sigma`; memory_s
        [s]: what is learnt from."""
        self.least, self.memory_s = least, memory_s
        self._by = (1.0, V, V)
        self._noise = [a * b for a, b in zip(noise, self._by, strict=True)]
        self._unit = changes(L, V * STEP_S * LAG)
        at = probes.tolist()
        self._pairs = [((k + 1) % 3, (k + 2) % 3) for k in PROBES]
        self._part = []  # of flow only: the noise of V hides it
        for i, j in self._pairs:
            x, y, z = (a - b for a, b in zip(at[i], at[j], strict=True))
            _, across, down = parting((x, y, z), L, V * STEP_S * LAG_OWN)
            self._part.append(across + down)
        self._common: deque[list[float]] = deque(maxlen=LAG + 1)  # [m/s] gust of all probes, along, across, down
        self._each: deque[list[list[float]]] = deque(maxlen=LAG_OWN + 1)  # and of each
        self._square, self._parted = [0.0] * 3, [0.0] * 3
        self._s = 0.0
        self.sigma, self.own = max(least, FIRST_MPS), FIRST_MPS

    def forget(self) -> None:
        """Readings or expectation have been interrupted: differences over the gap say nothing."""
        self._common.clear()
        self._each.clear()

    def hear(self, r: Arr, use: int, gust: Arr) -> None:
        """One set of readings less expected ones r [9] of which those of the mask `use` count, expected with the common gust
        [3] m/s, F."""
        off = r.tolist()
        common, each = [], []
        for v in AXES:
            good = [off[3 * v + i] for i in PROBES if use >> (3 * v + i) & 1]
            mean = math.fsum(good) / len(good) if good else math.nan
            common.append(float(gust[v]) - self._by[v] * mean)
            each.append([self._by[v] * off[3 * v + i] if use >> (3 * v + i) & 1 else math.nan for i in PROBES])
        self._common.append(common)
        self._each.append(each)
        if len(self._common) <= LAG:
            return
        self._s = min(self._s + STEP_S, self.memory_s)
        gain = STEP_S / self._s
        for v, (now, then) in enumerate(zip(common, self._common.popleft(), strict=True)):
            x = now - then
            if math.isfinite(x):
                seen = (x * x - 2.0 * self._noise[v] ** 2 / 3.0) / self._unit[v]
                self._square[v] += gain * (seen - self._square[v])
        before = self._each.popleft()
        for k, (i, j) in enumerate(self._pairs):
            total = 0.0
            for v in FLOW:
                x = each[v][i] - each[v][j] - before[v][i] + before[v][j]
                total += x * x - 4.0 * self._noise[v] ** 2
            if math.isfinite(total):
                self._parted[k] += gain * (total / self._part[k] - self._parted[k])
        if self._s >= FIRST_S:
            # the middle axis, and the pair that differs least: one axis, one probe may be a fault's doing
            self.own = math.sqrt(max(min(self._parted) - CHANCE, 0.0))
            _, middle, _ = sorted(self._square)
            self.sigma = max(math.sqrt(max(middle, 0.0)), self.own, self.least)
