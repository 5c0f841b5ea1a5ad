"""Gusts on several lines side by side, coherent across as isotropic turbulence is. Equations: docs/air.md 5.

Every line's gust is its own shaped series, combined with those of the lines before it: the lower triangular factor of the lines'
coherence at each frequency, as filters even in time. Line 0 is its own series unchanged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.dense import lower_factor
from sim_plant.wind.air import linear_mix
from sim_plant.wind.span_kernel import correlate

Arr = NDArray[np.float64]
TAPS = 128  # ticks to each side: what two lines have in common beyond the spectrum is decided within some of their distances
PERIOD = 1 << 14  # ticks over which correlations are summed: more than ten scale lengths
RIDGE = 1e-9  # [-] added to unit spectra: lines far closer than their distance from the others stay apart in rounding


def cross_spectra(spectrum: str, y: Arr, step_m: float, L: float) -> Arr:
    """Sampled cross spectra [3, len(y), PERIOD/2 + 1] of u, v, w on lines `y` [m] apart, variance 1."""
    half = np.zeros((3, len(y), PERIOD // 2 + 1))
    correlate(spectrum == "von_karman", y, step_m, L, half)
    return np.ascontiguousarray(np.fft.rfft(np.concatenate([half, half[:, :, -2:0:-1]], axis=2)).real)


def factors(spectrum: str, y: Arr, step_m: float, lengths: Arr) -> Arr:
    """Half impulse responses [3, lines, lines, TAPS + 1] (ticks 0, 1, ...) of the lower triangular factor of the coherence of u,
    v, w, of scale lengths [3] (m), between lines at `y` [m]. Raises ArithmeticError when two lines are at one place."""
    m = len(y)
    which, apart = _pairs(y)
    out = np.zeros((3, m, m, TAPS + 1))
    for L in sorted(set(lengths.tolist())):
        s = cross_spectra(spectrum, apart, step_m, L)[:, :, :: PERIOD // (2 * TAPS)]
        for axis in np.flatnonzero(lengths == L).tolist():
            low = np.zeros((TAPS + 1, m, m))
            for k in range(TAPS + 1):
                ratio = s[axis][which, k] / s[axis, 0, k] + RIDGE * np.eye(m)
                if not lower_factor(np.ascontiguousarray(ratio), low[k]):
                    raise ArithmeticError(f"lines at {y.tolist()} m: no coherence of {spectrum}")
            out[axis] = np.fft.irfft(low, axis=0)[: TAPS + 1].transpose(1, 2, 0)
    out[..., TAPS] *= 0.5  # both ends of a period are one tick of it
    return out


def _pairs(y: Arr) -> tuple[NDArray[np.int64], Arr]:
    """Index [m, m] into the distances [k] (m) that occur between lines, ascending from 0."""
    apart = np.abs(y[:, None] - y[None, :]).round(6)
    distances, which = np.unique(apart, return_inverse=True)
    return which.reshape(apart.shape), distances


class Across:
    """Lines at `y_m` (m to the right of line 0, which is at 0) of one owner's air."""

    def __init__(self, y_m: tuple[float, ...]) -> None:
        """Raises ValueError unless the first is 0 and all differ."""
        if y_m[0] != 0.0 or len(set(y_m)) != len(y_m):
            raise ValueError(f"lines at {y_m} m; allowed: different ones, the first 0")
        self.y_m = y_m

    def settle(self, spectrum: str, step_m: float, lengths: Arr, count: int) -> None:
        """Set the filters for a step [m] and scale lengths [3] (m), blocks of `count` rows."""
        self._h = factors(spectrum, np.array(self.y_m), step_m, lengths)
        self._x = np.zeros((3, len(self.y_m), count + 2 * TAPS))
        self._out = np.zeros((count, len(self.y_m), 3))
        self._early = TAPS  # rows before the first

    def next(self, blocks: list[Arr]) -> Arr:
        """Gusts [k, line, 3] after another block [count, 3] of every line's series; k <= count: they lag by TAPS."""
        x, count = self._x, len(self._out)
        x[:, :, :-count] = x[:, :, count:].copy()
        for i, b in enumerate(blocks):
            x[:, i, -count:] = b.T
        linear_mix(self._h, x, self._out)
        skip = min(self._early, count)
        self._early -= skip
        return self._out[skip:]
