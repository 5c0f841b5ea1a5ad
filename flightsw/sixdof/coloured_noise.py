"""Coloured measurement noise in an estimator: R scaled, measurements differenced, or noise states (Lee 2011, sections 3.5, 4.4).

Shared by the free aircraft and the receiver; lee.md 3.6, 3.7, 8.8. Channels are measurement codes 0 .. c-1; rows with a
higher code (calculated wind) are scaled, otherwise left alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flightsw.filters.coloured import Differencer, NoiseStates, scaled_sigma
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams

Measure = Callable[[], None]  # writes core.ukf.Y[:, :core.m] from core.ukf.X
Rates = Callable[[float, float, int], None]  # (cf, cx, m): writes cf dh/dt + cx h of the first m rows


def colour_states(p: NavParams, channels: int) -> int:
    """How many noise states the chosen treatment appends."""
    return channels if p.colour_tau_s > 0.0 and p.colour == "augmented" else 0


class Colour:
    """Treatment of coloured noise as NavParams.colour, colour_tau_s and colour_form say."""

    def __init__(self, p: NavParams, sigma: np.ndarray, angles: slice, first: int) -> None:
        """sigma [c] 1-sigma of the channels, `angles`: those that wrap, `first`: index of the first noise state.

        The noise columns of SQ start at first + 3 (three columns of the wind come before).
        """
        c = len(sigma)
        self.p = p
        self.mode = p.colour if p.colour_tau_s > 0.0 else "ignored"
        tau = np.full(c, max(p.colour_tau_s, 1e-9))
        wraps = np.zeros(c)
        wraps[angles] = 1
        self.channels = c
        self.sigma = np.array(sigma, dtype=float)
        self.noise = NoiseStates(first, first + 3, sigma, tau) if self.mode == "augmented" else None
        self.diff = Differencer(sigma, tau, angle=wraps, form=p.colour_form) if self.mode == "removed" else None
        self.floor = np.zeros(c)  # 1-sigma of white noise beside noise states; the owner fills it
        self._reading = np.zeros(c)
        self._had = np.zeros(c, dtype=bool)

    def start(self, x: np.ndarray, S: np.ndarray, read: bool = False) -> None:
        """Initial noise states into x and S, in place; readings forgotten.

        read: column c of S is the error of the one reading of channel c the state was taken from (NoiseStates.start).
        """
        self._had[:] = False
        if self.noise is not None:
            self.noise.start(x, S, read)
        if self.diff is not None:
            self.diff.reset()

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """Noise states of the points X over dt [s], and their process noise into SQ."""
        if self.noise is not None:
            self.noise.propagate(X, dt)
            self.noise.fill(SQ, dt)

    def correct(self, c: EstimatorCore, dt: float, gyro_count: int, measure: Measure, rates: Rates) -> float:
        """Measurement update with the core's queued rows, dt [s] after the last one; returns NIS.

        gyro_count: readings averaged into rows 3..5, spread over dt.
        """
        if self.diff is not None and not self._difference(c, dt):
            return 0.0
        if self.mode == "scaled" and dt > 0.0:
            tau, n = self.p.colour_tau_s, max(gyro_count, 1)
            for j in range(c.m):
                # a mean of n readings n times as often has the same spectral density at zero frequency
                c.r[j] *= scaled_sigma(1.0, dt / n if 3 <= c.codes[j] < 6 else dt, tau)
        c.ukf.draw()
        measure()
        if self.diff is not None:
            rates(float(self.diff.cf[0]), float(self.diff.cx[0]), int((c.codes[: c.m] < self.channels).sum()))
        if self.noise is not None:
            for j in range(c.m):
                if c.codes[j] < self.channels:
                    self.noise.add(c.ukf.X, c.ukf.Y, j, int(c.codes[j]))
                    # the noise is a state now; what is left is white, or keeps the update regular
                    c.r[j] = math.hypot(1e-2 * c.r[j], self.floor[c.codes[j]])
        return c.update()

    def _difference(self, c: EstimatorCore, dt: float) -> bool:
        """Replace the queued rows by differenced ones; rows without a reading one step ago are dropped."""
        d = self.diff
        assert d is not None
        k = c.codes[: c.m]
        own = k < self.channels
        self._reading[k[own]] = c.y[: c.m][own]
        had, self._had = self._had, np.zeros(self.channels, dtype=bool)
        self._had[k[own]] = True
        if not d.push(self._reading, dt):
            return False
        q = np.zeros(self.channels)
        q[0], q[1:3] = c.q_wind, c.q_wind / c.ukf.x[0]  # air data rows carry the wind increment (lee.md trap 6)
        r = d.inflated(q, dt)
        c.pick(np.flatnonzero((k >= self.channels) | had[np.minimum(k, self.channels - 1)]))
        for j in range(c.m):
            code = int(c.codes[j])
            if code < self.channels:
                c.y[j], c.r[j] = d.y[code], r[code]
        return c.m > 0
