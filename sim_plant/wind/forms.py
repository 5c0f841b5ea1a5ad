"""Shaping filters of unit variance, in time over T = L/V: what of a gust's spectrum does not depend on speed and scale.

H(s) = c (n_0 + n_1 s + ...) / (d_0 + ... + d_n s^n) per axis, driven by noise of intensity pi (lee.md trap 8), s in 1/T. As time
enters only by T, the stationary covariance of the states does not change with it: speed and scale may change in flight.
Dryden: exact. von Karman: (1 + s)^(1/6), s = 1.339 s T, by three pairs of zero and pole, within 2 % of the spectrum up to
s = 400 (docs/air.md 3); u of order 4, v and w of order 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.rng import generator
from sim_plant.wind.air import linear_block
from sim_plant.wind.dryden import discretise, noise_factor, stationary_draw
from sim_plant.wind.span_kernel import KARMAN

Arr = NDArray[np.float64]
# corners of zero, pole, zero, ...: least largest error of |.|^2 against (1 + w^2)^(1/6), 0.02 <= w <= 400
SIXTH = (2.03023, 2.7682, 15.5037, 22.067, 132.22287, 193.23943)


@dataclass(frozen=True)
class Form:
    """States of u, v, w side by side: a [n, n], bbt [n, n] per T, c [3, n]."""

    a: Arr
    bbt: Arr
    c: Arr
    axis: tuple[int, ...]  # of every state


def _product(corners: list[float]) -> Arr:
    """Coefficients, ascending, of prod (1 + s / corner)."""
    out = np.ones(1)
    for x in corners:
        out = np.append(out, 0.0) + np.append(0.0, out / x)
    return out


def _transfer(spectrum: str) -> list[tuple[Arr, Arr]]:
    """Numerator and denominator, ascending, of u, v, w."""
    if spectrum == "dryden":
        side = (math.sqrt(1.0 / math.pi) * _product([1.0 / math.sqrt(3.0)]), _product([1.0, 1.0]))
        return [(math.sqrt(2.0 / math.pi) * np.ones(1), _product([1.0])), side, side]
    s = 1.0 / KARMAN
    zeros, poles = [s * x for x in SIXTH[0::2]], [s * x for x in SIXTH[1::2]]
    along = (math.sqrt(2.0 / math.pi) * _product(zeros), _product([s, *poles]))
    lift = s / math.sqrt(8.0 / 3.0)
    side = (math.sqrt(1.0 / math.pi) * _product([lift, *zeros]), _product([s, s, *poles]))
    return [along, side, side]


def form(spectrum: str) -> Form:
    """The filters of "dryden" or "von_karman", in companion form."""
    parts = _transfer(spectrum)
    size = sum(len(d) - 1 for _, d in parts)
    a, bbt, c, axis, at = np.zeros((size, size)), np.zeros((size, size)), np.zeros((3, size)), [], 0
    for i, (num, den) in enumerate(parts):
        order = len(den) - 1
        end = at + order
        a[np.arange(at, end - 1), np.arange(at + 1, end)] = 1.0
        a[end - 1, at:end] = -den[:-1] / den[-1]
        bbt[end - 1, end - 1] = math.pi
        c[i, at : at + len(num)] = num / den[-1]
        axis += [i] * order
        at = end
    return Form(a, bbt, c, tuple(axis))


class ShapedSeries:
    """Gusts (u, v, w) of unit variance, `rows` [count, 3] a block, stationary from the start.

    `tune` sets the scale lengths before a block; the states go on with their covariance unchanged.
    """

    def __init__(self, seed: int, name: str, spectrum: str, V: float, lengths: Arr, dt: float, count: int) -> None:
        """V: airspeed [m/s], lengths [3] (m), dt: step [s]."""
        self.rows = np.zeros((count, 3))
        self._f, self._V, self._dt = form(spectrum), V, dt
        self._rng = generator(seed, name)
        self._lengths = np.zeros(3)
        self.tune(lengths)
        self._x = stationary_draw(self._phi, self._q, self._rng)
        self._tmp = np.zeros(len(self._x))

    def tune(self, lengths: Arr) -> None:
        """From the next block on: scale lengths [3] (m)."""
        if np.array_equal(lengths, self._lengths):
            return
        self._lengths = lengths.copy()
        rate = (self._V / lengths)[list(self._f.axis)]
        self._phi, self._q = discretise(self._f.a * rate[:, None], self._f.bbt * rate[:, None], self._dt)
        self._chol = noise_factor(self._q)

    def advance(self) -> Arr:
        """Fill `rows` with the next values and return it (the array is reused)."""
        noise = self._rng.standard_normal((len(self.rows), len(self._x)))
        linear_block(self._x, self._phi, self._chol, self._f.c, noise, self._tmp, self.rows)
        return self.rows
