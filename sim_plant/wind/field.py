"""The air the aircraft fly in: sounding, slow variation, turbulence as a frozen field, wake."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sim_plant.kernels import layout as n
from sim_plant.rng import BLOCK, generator
from sim_plant.scenario import Dryden, Wind
from sim_plant.wind.air import free_air, gauss_markov_block, lay_gust
from sim_plant.wind.dryden import DrydenSeries
from sim_plant.wind.prevailing import constant_table, sounding_table
from sim_plant.wind.vortex import wake_on_airframe

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Craft
    from sim_plant.aircraft.sixdof.vehicle import Vehicle

RING = 1024  # ticks of gust history kept: at 100 Hz and 195 m/s about 2 km behind the leader


class _Rows:
    """One gust series, row by row, at the intensity of the time."""

    def __init__(self, series: DrydenSeries, level: IntensityProfile, tick: int = 0) -> None:
        """tick: that of the first row."""
        self.series, self.level, self.tick = series, level, tick
        self.at = BLOCK - 1

    def next(self) -> int:
        """Index in `series.rows` of the next row (u, v, w) [m/s]."""
        self.at += 1
        if self.at == BLOCK:
            rows = self.series.advance()
            if self.level.steps:
                rows *= self.level.factors(self.tick, len(rows))[:, None]
            self.tick += len(rows)
            self.at = 0
        return self.at


class _Gusts(_Rows):
    """A gust series and the ring buffer of what its aircraft has flown through."""

    def __init__(self, series: DrydenSeries, level: IntensityProfile) -> None:
        super().__init__(series, level, 1 - RING)  # the history is laid first
        self.ring = np.zeros((RING, 3))

    def lay(self, v: Vehicle, aligned: bool, k: int) -> None:
        lay_gust(v.s, v.wind, aligned, self.series.rows, self.next(), self.ring, k)


class IntensityProfile:
    """Turbulence intensity against time as a factor on a series of the reference intensity."""

    def __init__(self, d: Dryden, dt_s: float) -> None:
        self.steps, self._dt = d.step, dt_s
        self.reference = max((d.sigma_mps, *(s.sigma_mps for s in d.step)))
        self._times = np.array([s.t_s for s in d.step])
        self._levels = np.array([d.sigma_mps, *(s.sigma_mps for s in d.step)])

    def factors(self, tick: int, count: int) -> np.ndarray:
        """Factors [count] of the ticks from `tick` on."""
        t = (tick + np.arange(count)) * self._dt
        return np.asarray(self._levels[np.searchsorted(self._times, t, side="right")] / max(self.reference, 1e-12))


class AirMass:
    """Effective wind on every aircraft, evaluated once per tick.

    Frozen field: the leader's gusts stay where they are in the air; a follower xi_x behind meets them (-xi_x)/V
    later. With `independent` each aircraft has its own series. Aircraft of the vertical plane (`planar`: their names) follow
    nobody: they meet the same gusts at the same time, or each its own.
    """

    def __init__(
        self, cfg: Wind, vehicles: list[Vehicle], seed: int, dt_s: float, planar: tuple[str, ...] = ()
    ) -> None:
        self._table = (
            sounding_table(cfg.sounding) if cfg.prevailing == "sounding" else constant_table(*cfg.constant_mps)
        )
        d = cfg.dryden
        self._aligned = d.axes == "track"
        self._frozen = not d.independent
        level = IntensityProfile(d, dt_s)
        count = min(1, len(vehicles)) if self._frozen else len(vehicles)
        self._gusts = [
            _Gusts(DrydenSeries(seed, f"{vehicles[i].cfg.name}.dryden", d.V_mps, d.L_m, level.reference, dt_s), level)
            for i in range(count)
        ]
        self._planar = {
            name: _Rows(DrydenSeries(seed, f"{name}.dryden", d.V_mps, d.L_m, level.reference, dt_s), level)
            for name in (planar[:1] if self._frozen else planar)
        }
        self._row: dict[str, np.ndarray] = {}  # gust (u, v, w) of this tick
        self._shared = planar[0] if planar and self._frozen else ""
        self._slow_cfg, self._sines, self._dt = cfg.slow, cfg.sine, dt_s
        self._slow = np.zeros((BLOCK, 3))  # north, east, down [m/s]
        self._slow_at = BLOCK
        self._slow_block = 0
        if cfg.slow.sigma_mps > 0.0:
            self._slow_rng = generator(seed, "wind.slow")
            self._slow_x = self._slow_rng.standard_normal(2) * (0.0 if cfg.slow.from_zero else 1.0)
            self._slow_e = math.exp(-dt_s / cfg.slow.tau_s)
        self._lead: Vehicle
        if vehicles:
            self._lead = vehicles[0]
        self._wake = bool(cfg.wake.source)
        self._rate = 1.0 / dt_s
        self._zero = np.zeros((1, 3))
        self._calm = np.zeros((2, 3))

    def mean(self, v: Vehicle) -> None:
        """Wind on `v` without gusts and slow variation (for trim): fills v.free, v.wind."""
        free_air(v.s, self._table, self._zero, 0, self._calm, 0, 0.0, v.free)
        self._add_wake(v)

    def steady(self, alt_m: float) -> tuple[float, float]:
        """Prevailing wind [m/s] north, east (towards) at a height [m]."""
        h, north, east = self._table.T
        return float(np.interp(alt_m, h, north)), float(np.interp(alt_m, h, east))

    def fill_history(self, vehicles: list[Vehicle]) -> None:
        """Let the series run through the buffer before tick 0, so that a follower has gusts to meet at once."""
        for i, g in enumerate(self._gusts):
            for k in range(1 - RING, 0):
                g.lay(vehicles[i], self._aligned, k)

    def begin(self) -> None:
        """Go to the next tick; before the first `step` or `over` of it."""
        self._next_slow()
        for name, rows in self._planar.items():
            i = rows.next()
            self._row[name] = rows.series.rows[i]

    def over(self, c: Craft) -> None:
        """Wind on an aircraft of the vertical plane at this tick: fills c.free."""
        north, east = self.steady(c.height_m)
        u, v, w = self._row[self._shared or c.cfg.name].tolist()
        if self._aligned:  # without sideslip to speak of the air-relative track is the heading
            (a, b) = c.ahead
            u, v = u * a - v * b, u * b + v * a
        slow = self._slow[self._slow_at]
        c.free[:] = north + slow[0] + u, east + slow[1] + v, slow[2] + w

    def step(self, v: Vehicle, k: int) -> None:
        """Wind on `v` at tick k: fills v.free, v.wind, v.probe_wake. Aircraft must come in order, the leader first."""
        lag, ring_of = 0.0, v.index
        if v.index and self._frozen:
            ring_of = 0
            lag = max(0.0, -v.rel[0]) / max(1.0, self._lead.obs[n.O_V]) * self._rate
        else:
            self._gusts[ring_of].lay(v, self._aligned, k)
        free_air(v.s, self._table, self._slow, self._slow_at, self._gusts[ring_of].ring, k, lag, v.free)
        self._add_wake(v)

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

    def _add_wake(self, v: Vehicle) -> None:
        v.wind[0:3] = v.free
        v.wind[3:6] = 0.0
        if self._wake and v.index:
            a = self._lead
            wake_on_airframe(
                a.s, a.obs, a.wake_source, v.s, v.points, v.weight, v.n_span, v.n_frame, v.wind, v.probe_wake
            )
