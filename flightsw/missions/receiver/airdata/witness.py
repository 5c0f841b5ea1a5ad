"""The place across the tanker's path by one set of readings, for who compares witnesses of it.

Nothing that another sensor taught enters: circulations and height are the model's, offsets none, the wind common to the probes is
free. What is wrong with those is a lasting error of the row, of a size that is stated with it (separation.md 8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata import witness_kernel as kernel
from flightsw.missions.receiver.airdata.params import WakePositionParams

Arr = NDArray[np.float64]
FAR_M = 3.0  # [m] from where the rows were chosen: slopes are others there, and with them the lasting error


@dataclass(slots=True)
class WakeRows:
    """Two rows y = H d + lasting + passing error + noise, d the receiver less the tanker, NED [m], at t_us [us]."""

    t_us: int
    y: Arr  # [2] m
    H: Arr  # [2,3]
    r: Arr  # [2] m^2, of the noise, which is independent from row to row and from reading to reading
    lasting: Arr  # [2] m^2, variance of the lasting error before anything is known of it
    number: int  # of the choice of rows: with another the lasting error is another


class WakeWitness:
    """Chooses the rows: those of least noise that the common wind does not enter, kept while probes and place are the same."""

    def __init__(self, probes: Arr, p: WakePositionParams) -> None:
        """probes [3,3] m, body."""
        self.probes = probes
        flow, V = [p.offset_flow**2] * 3, [p.offset_V**2] * 3
        self._offsets = np.array([*V, *flow, *flow])
        self._learnt = np.array([p.scale_wing_sigma, p.scale_tail_sigma, p.height_sigma_m]) ** 2
        self._noise = np.repeat([p.sigma_V, p.sigma_beta, p.sigma_alpha], 3) ** 2
        self._h, self._J, self._at = np.zeros(9), np.zeros((9, 9)), np.zeros(kp.P_W + 3)
        self._at[kp.P_KW] = self._at[kp.P_KT] = 1.0
        self._rows, self._use, self._from = np.zeros((2, 9)), 0, np.zeros(3)
        self.number = 0

    def step(self, t_us: int, y: Arr, use: int, g: Arr, wk: Arr, x: Arr, own_air: Arr, R_nf: Arr) -> WakeRows | None:
        """Readings y [9] of the mask `use` in the frame g [11], wake vector wk [13]; x [3] m, F: near enough for slopes; own_air
        [9,9]: covariance of each probe's own air as white noise; R_nf [3,3]: NED to F. None: they do not tell."""
        good = [c for c in range(9) if use >> c & 1 and np.isfinite(y[c])]
        self._at[kp.P_Y], self._at[kp.P_Z] = x[kp.AX_Y], x[kp.AX_Z]
        kp.expected(self._at, g, self.probes, wk, True, self._h, self._J)
        N, mask = self._rows, sum(1 << c for c in good)
        if mask != self._use or math.dist(x, self._from) > FAR_M:
            self._use = 0
            if not kernel.choose(np.array(good, dtype=np.int64), self._J, self._noise, N):
                return None
            self._use, self._from = mask, x.copy()
            self.number += 1
        got = WakeRows(t_us, np.zeros(2), np.zeros((2, 3)), np.zeros(2), np.zeros(2), self.number)
        if not kernel.noise(N, self._noise, own_air, got.r) < kernel.MOST_M**2:
            return None
        off = np.zeros(9)
        off[good] = y[good] - self._h[good]
        kernel.tell(N, self._J, off, x, R_nf, self._offsets, self._learnt, got.y, got.H, got.lasting)
        return got
