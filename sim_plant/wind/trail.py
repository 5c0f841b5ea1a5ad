"""A wake where it was flown: its vortices bend with the path, sink, drift with their places' gusts and decay. docs/air.md 7."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.wind.config import Wake
from sim_plant.wind.trail_kernel import H_POS, NHIST, lay_trail, note
from sim_plant.wind.vortex import K_WING, source_strength

Arr = NDArray[np.float64]
RING = 1024  # ticks of path kept; what is older goes straight on
# [m] behind the roots: dense where a receiver flies
AWAY = np.array([0.0, 10.0, 22.0, 36.0, 60.0, 110.0, 220.0, 450.0, 950.0, 1900.0])
# [-] the sheet is rolled up after 0.28 A/C_L spans of wing (Spreiter and Sacks, J. Aeronaut. Sci. 18 (1951) 21), here in V b^2 /
# gamma with b = pi/4 of the span
ROLL_UP = 0.28 * (4.0 / math.pi) * (8.0 / math.pi**2)
DECAY = 0.45  # [-] Sarpkaya, Robins, Delisi, J. Aircraft 38 (2001) 687


def lifespan(eps: float) -> float:
    """Time to the breakdown of a vortex pair over that in which it sinks by its own width, at dissipation rate
    eps = (edr b)^(1/3) / V0 [-] of the air. Sarpkaya 2001: -180 eps + 9.18, at most 9;
    T^(1/4) exp(-0.70 T) = eps; eps T^(4/3) = 0.7475."""
    if eps > 0.2535:
        return float((0.7475 / eps) ** 0.75)
    if eps < 0.0121:
        return min(9.0, 9.18 - 180.0 * eps)
    lo, hi = 2.0, 8.0  # the left side falls there
    for _ in range(50):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if mid**0.25 * math.exp(-0.70 * mid) > eps else (lo, mid)
    return 0.5 * (lo + hi)


class Trail:
    """The vortices of one aircraft: `nodes` [4, len(AWAY), 4] (trail_kernel.lie), the `parts` between them (cut), and the decay
    `fade` [1/s] of their circulation."""

    def __init__(self, cfg: Wake, source: Arr, dt: float) -> None:
        """dt: [s] between calls of `shed`."""
        self._cfg, self._src, self._dt = cfg, source, dt
        self._hist = np.zeros((RING, NHIST))
        self._k = 0
        self.nodes, self.parts = np.zeros((4, len(AWAY), 4)), np.zeros((4, len(AWAY) - 1, 9))
        self.fade = 0.0

    def begin(self, s: Arr, obs: Arr, calm: Arr) -> None:
        """As if the aircraft of state s [NS], observation [NO], had always flown as it does now, in calm air [3]."""
        note(s, self._src, calm, calm, self._hist[0])
        self._hist[:] = self._hist[0]
        age = (-np.arange(RING) % RING) * self._dt
        self._hist[:, H_POS : H_POS + 3] -= age[:, None] * s[n.S_V : n.S_V + 3]
        self._k = -1
        self.shed(s, obs, calm, calm)

    def shed(self, s: Arr, obs: Arr, calm: Arr, free: Arr) -> None:
        """Another tick, in air `free` [3] (m/s, NED) of which `calm` is no gust."""
        self._k += 1
        cfg = self._cfg
        if cfg.edr_m2ps3 > 0.0 and self._k % 100 == 0:
            b = float(self._src[K_WING + 3])
            rate = source_strength(obs, self._src)[0] / (2.0 * math.pi * b)  # [m/s] at which the pair sinks far behind
            if rate > 0.0:
                self.fade = DECAY * rate / b / lifespan((cfg.edr_m2ps3 * b) ** (1.0 / 3.0) / rate)
        lay_trail(
            s, calm, free, self._hist, self._k, self._dt, AWAY, obs, self._src, cfg.sink, ROLL_UP, self.fade, cfg.meander,
            self.nodes, self.parts,
        )  # fmt: skip
