"""Errors of one graded sensor: what is drawn (rows by blocks, one random stream per family and term) and what acts on the
measured quantity (compiled, shape_kernel.py). A stream is named "<aircraft>.<sensor>.<family>.<term>": no sensor's grade moves
another's draws.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.rng import BLOCK, generator
from sim_plant.sensors.bank_kernel import PAIR
from sim_plant.sensors.base import View
from sim_plant.sensors.faulty import Flicker
from sim_plant.sensors.rows import Rows
from sim_plant.sensors.shape_kernel import (
    HEAD,
    K_AT,
    K_HOW,
    LEVER,
    LEVER_ACC,
    LEVER_GNSS,
    NLEVER,
    NODE_US,
    NWORK,
    RUBS,
    SHAPES,
    SKY,
    W_B0,
    W_COMMON,
    W_FRICTION,
    W_GRADIENT,
    W_QUANTUM,
    W_SIGN,
    W_SKY,
    told,
)
from sim_plant.sensors.shared import Shared
from sim_plant.sensors.terms import FAMILIES, Group
from sim_plant.wind.air import gauss_markov_block

Arr = NDArray[np.float64]
SHARED = {"gnss": "gnss.constellation", "baro": "baro.weather"}  # stream of what all aircraft have alike
NEAR_M = 50.0  # [m] within which another aircraft blocks part of the sky (our choice: a tanker's span)


NONE = np.zeros(n.NR)  # in place of relative motion, for those who measure none
STATE, FLOW = 0, n.NS  # where state and observation lie in what a column is read from; relative motion behind them


def measured(group: str, probes: int) -> list[int]:
    """Where the measured quantity of every column of a group's error row lies; -1: nowhere, its errors do not depend on it."""
    s, o, r = STATE, FLOW, PAIR
    at: dict[str, list[int]] = {
        "imu": [*range(s + n.S_W, s + n.S_W + 3), *range(o + n.O_F, o + n.O_F + 3)],
        "baro": [s + n.S_P + 2],
        "mag": [*range(o + n.O_MAG, o + n.O_MAG + 3)],
        "gnss": [*range(s + n.S_P, s + n.S_P + 3), *range(s + n.S_V, s + n.S_V + 3)],
        "att": [-1, -1, -1],
        "fuel": [s + n.S_FUEL],
        "air": [*range(o + n.O_PROBE, o + n.O_PROBE + 3 * probes)],
        "rel": [*range(r, r + 6)],
        "radalt": [s + n.S_P + 2],
        "boom": [*range(r + n.R_EL, r + n.R_EXT + 1)],
    }
    return at[group]


def sign(group: str) -> float:
    """-1 where a sensor reads heights of a place that counts downwards, else 1."""
    return -1.0 if group in ("baro", "radalt") else 1.0


@dataclass(frozen=True)
class Draw:
    """Rows of white, Gauss-Markov, random walk and constant of some columns. Call block() for the next [rows, columns]."""

    streams: tuple[np.random.Generator, np.random.Generator, np.random.Generator]
    white: float
    gm: float
    e: float  # correlation of the Gauss-Markov part from row to row
    step: float  # [u] of the random walk per row
    constant: Arr
    x: Arr  # state of the Gauss-Markov part, of unit variance
    sum: Arr  # state of the random walk

    def block(self, rows: int) -> Arr:
        """The next rows [rows, columns]."""
        m = len(self.x)
        out = np.tile(self.constant, (rows, 1))
        w, g, r = self.streams
        if self.white > 0.0:
            out += self.white * w.standard_normal((rows, m))
        if self.gm > 0.0:
            unit = g.standard_normal((rows, m))
            gauss_markov_block(self.x, self.e, unit)
            out += self.gm * unit
        if self.step > 0.0:
            walk = np.cumsum(self.step * r.standard_normal((rows, m)), axis=0) + self.sum
            self.sum[:] = walk[-1]
            out += walk
        return out


class Errors(Rows):
    """Errors of the sensor `group` of aircraft `name` at sample period `period_s`; `add` once per sample.

    scale, bias_scale: factors of [noise] on what varies and on what is drawn once per run.
    """

    def __init__(
        self,
        seed: int,
        name: str,
        group: str,
        terms: Group,
        period_s: float,
        probes: int,
        scale: float,
        bias_scale: float,
    ) -> None:
        at = measured(group, probes)
        super().__init__(len(at))
        self.terms, self.period_s = terms, period_s
        fams = FAMILIES[group]
        self.draws: list[tuple[list[int], Draw]] = []
        work = self.work
        work[W_B0] = 1.0
        work[W_SIGN] = sign(group)
        mat = work[NWORK:]
        mat[:] = np.eye(self.width)
        shaping = False
        self._sky: list[tuple[int, Shared]] = []
        self._second = -1  # up to which the sky is known
        key = f"{name}.{group}"
        turns: Arr = generator(seed, f"{key}.align").standard_normal(3)  # one mounting for the whole sensor
        for fam, (base, _) in fams.items():
            t = terms.columns[fam]
            cols = [c + 3 * i for i in range(probes) for c in base] if group == "air" else list(base)
            m = len(cols)

            def rng(term: str, fam: str = fam) -> np.random.Generator:
                return generator(seed, f"{key}.{fam}.{term}")

            gm = rng("gm")
            white = scale * math.hypot(t.white, t.density / math.sqrt(period_s))
            draw = Draw(
                (rng("white"), gm, rng("walk")), white, scale * t.gm, math.exp(-period_s / t.tau_s),
                scale * t.walk * math.sqrt(period_s), bias_scale * t.constant * rng("constant").standard_normal(m),
                gm.standard_normal(m), np.zeros(m),
            )  # fmt: skip
            self.draws.append((cols, draw))
            factor = bias_scale * t.scale * rng("scale").standard_normal(m)
            for i, c in enumerate(cols):
                mat[c, c] += factor[i]
                work[W_QUANTUM, c], work[W_FRICTION, c] = t.quantum, t.friction
                work[: W_B0 + 2, c] = lag_of(t.lag_s, period_s)
                if t.common > 0.0 or t.gradient > 0.0:
                    shared = Shared.of(seed, SHARED[group], t.common_tau_s)
                    self._sky.append((c, shared))
                    work[W_COMMON, c], work[W_GRADIENT, c] = scale * t.common, scale * t.gradient
            if t.align > 0.0:
                a, b, c3 = (bias_scale * t.align * turns).tolist()
                i0, i1, i2 = cols
                # a sensor mounted turned by (a, b, c) sees v - (a, b, c) x v
                for row, col, x in ((i0, i1, c3), (i0, i2, -b), (i1, i0, -c3), (i1, i2, a), (i2, i0, b), (i2, i1, -a)):
                    mat[row, col] += x
            shaping |= max(t.scale, t.align, t.lag_s, t.quantum, t.friction) > 0.0
        self.lever[:] = math.nan
        self.lever[:3] = bias_scale * terms.lever_m * generator(seed, f"{key}.lever").standard_normal(3)
        self.lever[3] = period_s
        how = SHAPES * shaping | RUBS * bool(work[W_FRICTION].any()) | SKY * bool(self._sky)
        if terms.lever_m > 0.0:
            how |= {"imu": LEVER_ACC, "gnss": LEVER_GNSS}[group]
        k = self.store.k[self.j]
        k[K_HOW], k[K_AT : K_AT + self.width] = how, at
        self.out = np.zeros(self.width)
        self.few = bool(self._sky) or terms.blocked > 1.0  # `prepare` has something to do
        self._pair, self._boom = at[0] >= PAIR, group == "boom"
        share = terms.outage_per_h * terms.outage_s / 3600.0
        self.flicker = None
        if share > 0.0:
            mean = max(1.0, terms.outage_s / period_s)
            self.flicker = Flicker(min(share, 0.999), mean, generator(seed, f"{key}.outage"))

    @property
    def work(self) -> Arr:
        """Work array [NWORK + width, width] (shape_kernel.py)."""
        return self.store.f[self.j, : NWORK + self.width, : self.width]

    @property
    def lever(self) -> Arr:
        """Lever arm and what it remembers [NLEVER] (shape_kernel.py)."""
        return self.store.f[self.j, LEVER, :NLEVER]

    def block(self) -> Arr:
        rows = np.zeros((BLOCK, self.width))
        for cols, d in self.draws:
            rows[:, cols] = d.block(BLOCK)
        return rows

    def lost(self) -> bool:
        """Whether the sample of now falls into an outage; ask once per sample."""
        return self.flicker is not None and self.flicker.lost()

    def add(self, e: list[float], t_us: int, view: View) -> list[float]:
        """Error row of the sample taken at t_us: `e` (what the paper's model draws; [] for nothing), and everything else."""
        self.row()
        if self.few or e:
            self.prepare(e, t_us, view)
        s, o = view.arrays or (np.array(view.s), np.array(view.o))
        r = NONE if not self._pair else np.array(view.boom if self._boom else view.rel)
        f, k, out = self.store.f[self.j], self.store.k[self.j], self.out
        told(
            s,
            o,
            r,
            f[HEAD:],
            self.use(),
            k[K_AT : K_AT + self.width],
            f[:LEVER],
            f[LEVER],
            k[K_HOW],
            t_us % NODE_US / NODE_US,
            out,
        )
        return out.tolist()  # type: ignore[no-any-return]

    def prepare(self, e: list[float], t_us: int, view: View) -> None:
        """What is asked of few, before the sample of t_us: of a blocked sky, the paper's draws `e`, errors that all share."""
        if self.terms.blocked > 1.0 and (factor := self._blocked(view)) > 1.0:
            row = self.row()
            row *= factor
        if e:
            row = self.row()
            row += e
        if self._sky and t_us // NODE_US != self._second:
            self._second = t_us // NODE_US
            for c, shared in self._sky:
                self.work[W_SKY:NWORK, c] = shared.around(c, t_us)

    def _blocked(self, view: View) -> float:
        r = view.rel
        d = math.hypot(r[0], r[1], r[2])
        if d == 0.0 or r[2] <= 0.0:  # nobody is there, or not above
            return 1.0
        return 1.0 + (self.terms.blocked - 1.0) * max(0.0, 1.0 - d / NEAR_M)


def lag_of(tau_s: float, period_s: float) -> tuple[float, float, float]:
    """a, b0, b1 of y' = a y + b0 u' + b1 u: the first-order lag of time constant tau_s, exact for an input that is linear from
    sample to sample (ramp-invariant transform). tau_s = 0: y' = u'."""
    if tau_s <= 0.0:
        return 0.0, 1.0, 0.0
    a = math.exp(-period_s / tau_s)
    c = (1.0 - a) * tau_s / period_s
    return a, 1.0 - c, c - a
