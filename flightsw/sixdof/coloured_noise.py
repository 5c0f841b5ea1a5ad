"""Coloured measurement noise in an estimator: R scaled, measurements differenced, or noise states (Lee 2011, sections 3.5, 4.4).

Shared by the free aircraft and the receiver; lee.md 3.6, 3.7, 8.8. Channels are measurement codes 0 .. c-1; rows with a
higher code (calculated wind) are scaled, otherwise left alone.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.coloured import Differencer, NoiseStates, scaled_sigma
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.sixdof.layout import BEYOND, M_ALPHA, M_BETA, M_EULER, M_RATE, M_V, X_V

FLOW = slice(M_BETA, M_ALPHA + 1)


def colour_states(p: NavParams, channels: int) -> int:
    """How many noise states the chosen treatment appends."""
    return channels if p.colour_tau_s > 0.0 and p.colour == "augmented" else 0


class Colour:
    """Treatment of coloured noise as NavParams.colour, colour_tau_s and colour_form say."""

    def __init__(self, p: NavParams, sigma: np.ndarray, angles: slice, first: int, read: bool = False) -> None:
        """sigma [c] 1-sigma of the channels, `angles`: those that wrap, `first`: index of the first noise state.

        read: at the start column c of the factor is the error of the one reading of channel c the state was taken from
        (NoiseStates.start).
        """
        c = len(sigma)
        self.p = p
        self.mode = p.colour if p.colour_tau_s > 0.0 else "ignored"
        tau = np.full(c, max(p.colour_tau_s, 1e-9))
        wraps = np.zeros(c)
        wraps[angles] = 1
        self.channels = c
        self.sigma = np.array(sigma, dtype=float)
        self.noise = NoiseStates(first, first + BEYOND, sigma, tau) if self.mode == "augmented" else None
        self.diff = Differencer(sigma, tau, angle=wraps, form=p.colour_form) if self.mode == "removed" else None
        self._read = read
        self.floor = np.zeros(c)  # 1-sigma of white noise beside noise states; the owner fills it
        self._reading = np.zeros(c)
        self._had = np.zeros(c, dtype=bool)

    def reset(self) -> None:
        """Forget the readings."""
        self._had[:] = False
        if self.diff is not None:
            self.diff.reset()

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """Initial noise states into x and S, in place."""
        if self.noise is not None:
            self.noise.start(x, S, self._read)

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """Noise states of the points X over dt [s], and their process noise into SQ."""
        if self.noise is not None:
            self.noise.propagate(X, dt)
            self.noise.fill(SQ, dt)

    def arrange(self, c: EstimatorCore, dt: float, gyro_count: int) -> bool:
        """Before a correction, dt [s] after the last one: the core's queued rows as this treatment wants them; False: there is
        nothing to correct by yet.

        gyro_count: readings averaged into the rows of body rates, spread over dt.
        """
        if self.diff is not None and not self._difference(c, dt):
            return False
        if self.mode == "scaled" and dt > 0.0:
            tau, n = self.p.colour_tau_s, max(gyro_count, 1)
            for j in range(c.m):
                # a mean of n readings n times as often has the same spectral density at zero frequency
                c.r[j] *= scaled_sigma(1.0, dt / n if M_RATE <= c.codes[j] < M_EULER else dt, tau)
        return True

    def whiten(self, c: EstimatorCore) -> None:
        """Noise states into the expected readings ukf.Y of the queued rows; their r is what is left, white."""
        if self.noise is None:
            return
        for j in range(c.m):
            if c.codes[j] < self.channels:
                self.noise.add(c.ukf.X, c.ukf.Y, j, int(c.codes[j]))
                # the noise is a state now; what is left is white, or keeps the update regular
                c.r[j] = math.hypot(1e-2 * c.r[j], self.floor[c.codes[j]])

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
        q[M_V], q[FLOW] = c.q_wind, c.q_wind / c.ukf.x[X_V]  # air data rows carry the wind increment (lee.md trap 6)
        r = d.inflated(q, dt)
        c.pick(np.flatnonzero((k >= self.channels) | had[np.minimum(k, self.channels - 1)]))
        for j in range(c.m):
            code = int(c.codes[j])
            if code < self.channels:
                c.y[j], c.r[j] = d.y[code], r[code]
        return c.m > 0
