"""The air the aircraft fly in: sounding, slow variation, turbulence as a frozen field, and what disturbs it (wakes)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.rng import BLOCK, generator
from sim_plant.wind.air import gauss_markov_block, meet
from sim_plant.wind.config import Wind
from sim_plant.wind.extent import Over, extent, lines
from sim_plant.wind.gusts import RING, Gusts
from sim_plant.wind.prevailing import constant_table, sounding_table

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member

Arr = NDArray[np.float64]
SPEED_OFF = 0.3  # [-] of the airspeed: the filters' may be off by, with a level by name


class Disturbance(Protocol):
    """What changes the wind on some aircraft beyond the free air."""

    def over(self, m: Member) -> None:
        """Add to m.wind, fill m.probe_wake."""


class AirMass:
    """Effective wind on every aircraft, evaluated once per tick.

    Frozen field: gusts stay where they are in the air. The first aircraft that flies in formation lays them, and a follower xi_x
    behind meets them (-xi_x)/V later; those that fly by themselves meet the gusts of the first of them at the same time. With
    `independent` each aircraft has its own series.
    """

    def __init__(self, cfg: Wind, aloft: Sequence[tuple[str, bool]], seed: int, dt_s: float) -> None:
        """aloft: names of the aircraft in scenario order, and whether they fly in formation."""
        self.table = sounding_table(cfg.sounding) if cfg.prevailing == "sounding" else constant_table(*cfg.constant_mps)
        self._cfg, self._seed = cfg.dryden, seed
        self.aligned = cfg.dryden.axes == "track"
        self._owner: dict[str, str] = {}  # whose gusts an aircraft meets
        first: dict[bool, str] = {}
        for name, formation in aloft:
            self._owner[name] = name if cfg.dryden.independent else first.setdefault(formation, name)
        self._formation = dict(aloft)
        self._gusts: dict[str, Gusts] = {}
        self._over: dict[str, Over] = {}
        self.disturbances: list[Disturbance] = []
        self._slow_cfg, self._sines, self._dt = cfg.slow, cfg.sine, dt_s
        self.slow = np.zeros((BLOCK, 3))  # north, east, down [m/s], of which now `slow_at`
        self.slow_at = BLOCK
        self._slow_block = 0
        if cfg.slow.sigma_mps > 0.0:
            self._slow_rng = generator(seed, "wind.slow")
            self._slow_x = self._slow_rng.standard_normal(2) * (0.0 if cfg.slow.from_zero else 1.0)
            self._slow_e = math.exp(-dt_s / cfg.slow.tau_s)
        self.rate = 1.0 / dt_s
        self._zero = np.zeros((1, 3))
        self._none = np.zeros((1, 2, 3))

    def disturb(self, d: Disturbance) -> None:
        """Let `d` act on every aircraft from now on."""
        self.disturbances.append(d)

    def mean(self, m: Member) -> None:
        """Wind on `m` without gusts and slow variation (for trim): fills m.calm, m.free, m.wind, m.probe_wake."""
        no = self._none
        meet(
            1.0,
            0.0,
            no,
            -1,
            0,
            m.height_m,
            self.table,
            self._zero,
            0,
            no,
            0,
            0.0,
            m.calm,
            m.free,
            m.wind,
            m.probe_wake,
        )
        self._disturbed(m)

    def steady(self, alt_m: float) -> tuple[float, float]:
        """Prevailing wind [m/s] north, east (towards) at a height [m]."""
        h, north, east = self.table.T
        return float(np.interp(alt_m, h, north)), float(np.interp(alt_m, h, east))

    def fill_history(self, members: Sequence[Member]) -> None:
        """Lay the gusts of `members`, those of formations through the buffer before tick 0, so that a follower has gusts to meet
        at once. Raises ConfigError for a member that cannot feel them as the scenario says."""
        d = self._cfg
        for m in members:
            name = m.cfg.name
            if self._owner[name] != name:
                continue
            V = float(m.view.o[n.O_V])
            if d.level != "none" and not abs(d.V_mps - V) <= SPEED_OFF * V:
                raise ConfigError(
                    f"wind.dryden.V_mps = {d.V_mps:g} with wind.dryden.level = {d.level!r}: allowed: {1.0 - SPEED_OFF:g} to "
                    f"{1.0 + SPEED_OFF:g} of the {V:.1f} m/s with which {name!r} meets the gusts"
                )
            meet = [x for x in members if self._owner[x.cfg.name] == name]
            tick = 1 - RING if self._formation[name] else 0
            across, ahead = lines(d, meet, self._dt)
            g = Gusts(name, d, self._seed, self._dt, tick, m.height_m, across, ahead)
            for x in meet:
                self._gusts[x.cfg.name] = g
                over = extent(d, x, g, self._seed, self._dt)
                if over is not None:
                    self._over[x.cfg.name] = over
            for k in range(g.tick, g.ahead):
                g.lay(self._axes(m), k, m.height_m)

    def shared(self, members: Sequence[Member]) -> Gusts | None:
        """The gusts that all `members` meet where their centres are, if the first lays them; else None."""
        g = self._gusts[members[0].cfg.name]
        alike = all(self._gusts[m.cfg.name] is g for m in members)
        return g if alike and g.owner == members[0].cfg.name and not self._over else None

    def begin(self) -> None:
        """Go to the next tick; before the first `step` of it."""
        self.slow_at += 1
        if self.slow_at >= BLOCK:
            self.slow_at = 0
            self._next_slow()

    def step(self, m: Member, k: int) -> None:
        """Wind on `m` at tick k: fills m.calm, m.free, m.wind, m.probe_wake. In scenario order; each observes before the next."""
        name, h, lag, row, cs, sn = m.cfg.name, m.height_m, 0.0, -1, 1.0, 0.0
        g = self._gusts[name]
        if g.owner == name:
            (cs, sn), row = self._axes(m), g.next_row(h)
            g.seen = m.obs
        else:
            lag = min(g.most, max(0.0, -m.view.rel[n.R_XI]) / max(1.0, float(g.seen[n.O_V])) * self.rate)
        meet(
            cs, sn, g.rows, row, g.ahead, h, self.table, self.slow, self.slow_at, g.rings, k, lag, m.calm, m.free, m.wind,
            m.probe_wake,
        )  # fmt: skip
        self._disturbed(m)
        over = self._over.get(name)
        if over is not None:
            over.turn(m.s, k, lag, m.wind, m.probe_wake)

    def _axes(self, m: Member) -> tuple[float, float]:
        return m.track() if self.aligned else (1.0, 0.0)

    def _disturbed(self, m: Member) -> None:
        for d in self.disturbances:
            d.over(m)

    def _next_slow(self) -> None:
        if self._slow_cfg.sigma_mps > 0.0:
            unit = self._slow_rng.standard_normal((BLOCK, 2))
            gauss_markov_block(self._slow_x, self._slow_e, unit)
            self.slow[:, :2] = unit * self._slow_cfg.sigma_mps
        if self._sines:
            self.slow[:, (2 if self._slow_cfg.sigma_mps > 0.0 else 0) :] = 0.0
            t = (self._slow_block * BLOCK + np.arange(BLOCK)) * self._dt
            for w in self._sines:
                for i in range(3):
                    a, period, phase = w.amplitude_mps[i], w.period_s[i], w.phase_rad[i]
                    angle = 2.0 * math.pi * t / period + phase
                    self.slow[:, i] += a * np.array([math.sin(v) for v in angle.tolist()])
        self._slow_block += 1
