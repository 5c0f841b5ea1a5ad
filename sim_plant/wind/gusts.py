"""Who lays which gusts: the series of one owner at the intensity of the time or of the height, and what it has flown through.

The air is frozen: a row laid at tick k is met by whoever comes to that place later, from the ring buffer.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.rng import BLOCK
from sim_plant.wind.air import lay_gusts
from sim_plant.wind.config import Dryden
from sim_plant.wind.dryden import DrydenSeries
from sim_plant.wind.forms import ShapedSeries
from sim_plant.wind.levels import strength
from sim_plant.wind.span import Across

Arr = NDArray[np.float64]
RING = 1024  # ticks of gust history kept: at 100 Hz and 195 m/s about 2 km behind the leader
LEVEL_S = 1.0  # [s] between looks at the height


class IntensityProfile:
    """Turbulence intensity against time as a factor on a series of the reference intensity."""

    def __init__(self, d: Dryden, dt_s: float) -> None:
        self.steps, self._dt = d.step, dt_s
        self.reference = max((d.sigma_mps, *(s.sigma_mps for s in d.step)))
        self._at = [s.t_s for s in d.step]
        self._times = np.array(self._at)
        self._levels = np.array([d.sigma_mps, *(s.sigma_mps for s in d.step)])

    def now(self, tick: int) -> float:
        """Factor of one tick."""
        return float(self._levels[bisect_right(self._at, tick * self._dt)]) / max(self.reference, 1e-12)

    def factors(self, tick: int, count: int) -> NDArray[np.float64]:
        """Factors [count] of the ticks from `tick` on."""
        t = (tick + np.arange(count)) * self._dt
        return np.asarray(self._levels[np.searchsorted(self._times, t, side="right")] / max(self.reference, 1e-12))


class Gusts:
    """What one aircraft lays: a series on every line of its air, and the ring buffers [line, RING, 3] (m/s, NED) of them.

    Line 0 is its centre's; others, with `across`, at that distance to its right. They are laid `ahead` ticks before its centre
    comes there.
    """

    def __init__(
        self,
        owner: str,
        d: Dryden,
        seed: int,
        dt_s: float,
        tick: int,
        height_m: float,
        across: Across | None = None,
        ahead: int = 0,
    ) -> None:
        """owner: name of the aircraft that lays it; tick: that of the first row; height [m] it starts at."""
        self.owner, self.tick, self.ahead, self.across = owner, tick, ahead, across
        self.most = float(RING - 2 - 2 * ahead)  # [ticks] a follower's lag: what the ring holds for its hindmost place
        self._d, self._time = d, IntensityProfile(d, dt_s)
        lines = 1 if across is None else len(across.y_m)
        self.sigma, self.lengths = np.full(3, self._time.reference), np.full(3, d.L_m)
        self._named = d.level != "none"
        self._plain = not self._named and d.model == "dryden"
        if self._named:
            self.sigma, self.lengths = strength(d.level, d.model, height_m)
        self._series: list[DrydenSeries | ShapedSeries] = []
        count = max(1, round(LEVEL_S / dt_s)) if self._named else BLOCK
        for i in range(lines):
            name = f"{owner}.{d.model}{f'.line{i}' if i else ''}"
            if self._plain:
                self._series.append(DrydenSeries(seed, name, d.V_mps, d.L_m, self._time.reference, dt_s))
            else:
                self._series.append(ShapedSeries(seed, name, d.model, d.V_mps, self.lengths, dt_s, count))
        if across is not None:
            across.settle(d.model, d.V_mps * dt_s, self.lengths, count)
        self.rings = np.zeros((lines, RING, 3))
        self.seen = np.zeros(n.NO)  # observation of the owner
        self.rows = np.zeros((1, lines, 3))  # to be laid
        self._at = 0

    @property
    def ring(self) -> Arr:
        """History of the centre's line [RING, 3] (m/s, NED)."""
        # not kept: in a copy of a flight a kept view would be an array of its own
        return self.rings[0]

    def lay(self, along: tuple[float, float], k: int, height_m: float) -> None:
        """The gusts met at tick k, with u along the unit vector `along` (north, east), by an owner at this height [m]."""
        row = self.next_row(height_m)
        lay_gusts(*along, self.rows, row, self.rings, k)

    def at_hand(self) -> int:
        """`next_row` if it is worked out already; else -1."""
        if self._at + 1 >= len(self.rows):
            return -1
        self._at += 1
        return self._at

    def next_row(self, height_m: float) -> int:
        """Which of `rows` [k, line, 3] an owner at this height [m] is to lay next."""
        self._at += 1
        if self._at >= len(self.rows):
            self._advance(height_m)
            while len(self.rows) == 0:  # the first of several lines
                self._advance(height_m)
            self._at = 0
        return self._at

    def sigma_w(self, k: int) -> float:
        """1-sigma [m/s] of the vertical gust at tick k."""
        return float(self.sigma[2]) * (self._time.now(k) if self._time.steps else 1.0)

    def _advance(self, height_m: float) -> None:
        if self._named:
            self.sigma, self.lengths = strength(self._d.level, self._d.model, height_m)
        blocks = []
        for s in self._series:
            if isinstance(s, ShapedSeries):
                s.tune(self.lengths)
            blocks.append(s.advance())
        self.rows = blocks[0][:, None, :] if self.across is None else self.across.next(blocks)
        if not self._plain:
            self.rows = self.rows * self.sigma
        if self._time.steps:
            self.rows = self.rows * self._time.factors(self.tick, len(self.rows))[:, None, None]
        self.rows = np.ascontiguousarray(self.rows)
        self.tick += len(self.rows)
