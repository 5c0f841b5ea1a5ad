"""The air the aircraft fly in: sounding, slow variation, turbulence as a frozen field, and what disturbs it (wakes)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.rng import BLOCK, generator
from sim_plant.wind.air import free_air, gauss_markov_block, lay_gust
from sim_plant.wind.config import Dryden, Wind
from sim_plant.wind.dryden import DrydenSeries
from sim_plant.wind.prevailing import constant_table, sounding_table

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member

RING = 1024  # ticks of gust history kept: at 100 Hz and 195 m/s about 2 km behind the leader


class Disturbance(Protocol):
    """What changes the wind on some aircraft beyond the free air."""

    def over(self, m: Member) -> None:
        """Add to m.wind, fill m.probe_wake."""


class _Gusts:
    """A gust series at the intensity of the time, and the ring buffer of what its owner has flown through."""

    def __init__(self, owner: str, series: DrydenSeries, level: IntensityProfile, tick: int) -> None:
        """owner: name of the aircraft that lays it; tick: that of the first row."""
        self.owner, self.series, self.level, self.tick = owner, series, level, tick
        self.ring = np.zeros((RING, 3))
        self.seen = np.zeros(n.NO)  # observation of the owner
        self._at = BLOCK - 1

    def lay(self, along: tuple[float, float], k: int) -> None:
        """The gust of tick k, with u along the unit vector `along` (north, east)."""
        self._at += 1
        if self._at == BLOCK:
            rows = self.series.advance()
            if self.level.steps:
                rows *= self.level.factors(self.tick, len(rows))[:, None]
            self.tick += len(rows)
            self._at = 0
        lay_gust(*along, self.series.rows, self._at, self.ring, k)


class IntensityProfile:
    """Turbulence intensity against time as a factor on a series of the reference intensity."""

    def __init__(self, d: Dryden, dt_s: float) -> None:
        self.steps, self._dt = d.step, dt_s
        self.reference = max((d.sigma_mps, *(s.sigma_mps for s in d.step)))
        self._times = np.array([s.t_s for s in d.step])
        self._levels = np.array([d.sigma_mps, *(s.sigma_mps for s in d.step)])

    def factors(self, tick: int, count: int) -> NDArray[np.float64]:
        """Factors [count] of the ticks from `tick` on."""
        t = (tick + np.arange(count)) * self._dt
        return np.asarray(self._levels[np.searchsorted(self._times, t, side="right")] / max(self.reference, 1e-12))


class AirMass:
    """Effective wind on every aircraft, evaluated once per tick.

    Frozen field: gusts stay where they are in the air. The first aircraft that flies in formation lays them, and a follower xi_x
    behind meets them (-xi_x)/V later; those that fly by themselves meet the gusts of the first of them at the same time. With
    `independent` each aircraft has its own series.
    """

    def __init__(self, cfg: Wind, aloft: Sequence[tuple[str, bool]], seed: int, dt_s: float) -> None:
        """aloft: names of the aircraft in scenario order, and whether they fly in formation."""
        self._table = (
            sounding_table(cfg.sounding) if cfg.prevailing == "sounding" else constant_table(*cfg.constant_mps)
        )
        d = cfg.dryden
        self._aligned = d.axes == "track"
        level = IntensityProfile(d, dt_s)
        self._gusts: dict[str, _Gusts] = {}  # whose gusts an aircraft meets
        first: dict[bool, str] = {}
        for name, formation in aloft:
            owner = name if d.independent else first.setdefault(formation, name)
            if owner == name:
                series = DrydenSeries(seed, f"{name}.dryden", d.V_mps, d.L_m, level.reference, dt_s)
                self._gusts[name] = _Gusts(name, series, level, 1 - RING if formation else 0)
            self._gusts[name] = self._gusts[owner]
        self._disturbances: list[Disturbance] = []
        self._slow_cfg, self._sines, self._dt = cfg.slow, cfg.sine, dt_s
        self._slow = np.zeros((BLOCK, 3))  # north, east, down [m/s]
        self._slow_at = BLOCK
        self._slow_block = 0
        if cfg.slow.sigma_mps > 0.0:
            self._slow_rng = generator(seed, "wind.slow")
            self._slow_x = self._slow_rng.standard_normal(2) * (0.0 if cfg.slow.from_zero else 1.0)
            self._slow_e = math.exp(-dt_s / cfg.slow.tau_s)
        self._rate = 1.0 / dt_s
        self._zero = np.zeros((1, 3))
        self._calm = np.zeros((2, 3))

    def disturb(self, d: Disturbance) -> None:
        """Let `d` act on every aircraft from now on."""
        self._disturbances.append(d)

    def mean(self, m: Member) -> None:
        """Wind on `m` without gusts and slow variation (for trim): fills m.free, m.wind, m.probe_wake."""
        free_air(m.height_m, self._table, self._zero, 0, self._calm, 0, 0.0, m.free)
        self._disturbed(m)

    def steady(self, alt_m: float) -> tuple[float, float]:
        """Prevailing wind [m/s] north, east (towards) at a height [m]."""
        h, north, east = self._table.T
        return float(np.interp(alt_m, h, north)), float(np.interp(alt_m, h, east))

    def fill_history(self, members: Sequence[Member]) -> None:
        """Let the series of formations run through the buffer before tick 0, so that a follower has gusts to meet at once."""
        for m in members:
            g = self._gusts[m.cfg.name]
            if g.owner == m.cfg.name:
                for k in range(g.tick, 0):
                    g.lay(self._axes(m), k)

    def begin(self) -> None:
        """Go to the next tick; before the first `step` of it."""
        self._next_slow()

    def step(self, m: Member, k: int) -> None:
        """Wind on `m` at tick k: fills m.free, m.wind, m.probe_wake. In scenario order; each observes before the next."""
        g, lag = self._gusts[m.cfg.name], 0.0
        if g.owner == m.cfg.name:
            g.lay(self._axes(m), k)
            g.seen = m.obs
        else:
            lag = max(0.0, -m.view.rel[n.R_XI]) / max(1.0, float(g.seen[n.O_V])) * self._rate
        free_air(m.height_m, self._table, self._slow, self._slow_at, g.ring, k, lag, m.free)
        self._disturbed(m)

    def _axes(self, m: Member) -> tuple[float, float]:
        return m.track() if self._aligned else (1.0, 0.0)

    def _disturbed(self, m: Member) -> None:
        m.wind[0:3] = m.free
        m.wind[3:6] = 0.0
        for d in self._disturbances:
            d.over(m)

    def _next_slow(self) -> None:
        self._slow_at += 1
        if self._slow_at < BLOCK:
            return
        self._slow_at = 0
        if self._slow_cfg.sigma_mps > 0.0:
            unit = self._slow_rng.standard_normal((BLOCK, 2))
            gauss_markov_block(self._slow_x, self._slow_e, unit)
            self._slow[:, :2] = unit * self._slow_cfg.sigma_mps
        if self._sines:
            self._slow[:, (2 if self._slow_cfg.sigma_mps > 0.0 else 0) :] = 0.0
            t = (self._slow_block * BLOCK + np.arange(BLOCK)) * self._dt
            for w in self._sines:
                for i in range(3):
                    a, period, phase = w.amplitude_mps[i], w.period_s[i], w.phase_rad[i]
                    angle = 2.0 * math.pi * t / period + phase
                    self._slow[:, i] += a * np.array([math.sin(v) for v in angle.tolist()])
        self._slow_block += 1
