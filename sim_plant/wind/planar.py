"""Own wind of an aircraft in the vertical plane: Dryden turbulence, 1-cosine gusts and ramps, as one series per run.

Components: air moving down and air moving forward (tail wind) [m/s], at the ticks of the plant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import Range
from sim_plant.rng import generator
from sim_plant.wind.air import linear_block
from sim_plant.wind.dryden import discretise, noise_factor, shaping, stationary_draw

Arr = NDArray[np.float64]
AXES = {"down": 0, "tail": 1}


@dataclass(frozen=True)
class Gust:
    """One discrete gust: ramp to `size` [m/s] in length_s [s] and then held, or 1-cosine of that length."""

    axis: str  # "down" or "tail"
    size_mps: Annotated[float, Range(-50.0, 50.0)]
    start_s: Annotated[float, Range(0.0)]
    length_s: float
    shape: str = "ramp"  # "ramp" or "one_cosine"

    def __post_init__(self) -> None:
        if self.axis not in AXES:
            raise ValueError(f"gust axis {self.axis!r}; allowed: {', '.join(AXES)}")
        if self.shape not in ("ramp", "one_cosine"):
            raise ValueError(f"gust shape {self.shape!r}; allowed: ramp, one_cosine")
        if not self.length_s > 0.0:
            raise ValueError(f"gust length_s = {self.length_s}; allowed > 0")

    def at(self, t: NDArray[Any]) -> NDArray[Any]:
        """Speed [m/s] at times t [s]."""
        s = np.clip((t - self.start_s) / self.length_s, 0.0, 1.0)
        if self.shape == "ramp":
            return self.size_mps * s
        return 0.5 * self.size_mps * (1.0 - np.array([math.cos(v) for v in (2.0 * math.pi * s).tolist()]))


@dataclass(frozen=True)
class PlanarWind:
    """Turbulence (standard deviations [m/s] and scale lengths [m] of the down and tail components) and discrete gusts.

    steps: (time [s], factor) pairs, ascending; from each time on the turbulence is multiplied by its factor.
    """

    sigma_w_mps: Annotated[float, Range(0.0, 50.0)] = 3.5
    sigma_u_mps: Annotated[float, Range(0.0, 50.0)] = 5.0
    L_w_m: Annotated[float, Range(1.0, 5000.0)] = 93.0
    L_u_m: Annotated[float, Range(1.0, 5000.0)] = 100.0
    steady_tail_mps: Annotated[float, Range(-15.0, 15.0)] = 0.0
    gusts: tuple[Gust, ...] = ()
    steps: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Raises ValueError naming the step that is out of order or has no factor of 0 or more."""
        before = -math.inf
        for i, (t, factor) in enumerate(self.steps):
            if not before < t < math.inf:
                raise ValueError(f"steps[{i}]: time {t} after {before}; allowed: ascending times")
            if not 0.0 <= factor < math.inf:
                raise ValueError(f"steps[{i}]: factor {factor}; allowed >= 0")
            before = t


def turbulence(w: PlanarWind, V: float, count: int, dt: float, seed: int) -> tuple[Arr, Arr]:
    """Series [count,2] (down, tail) [m/s] at airspeed V [m/s], tick dt [s], stationary from the start, and the auxiliary state
    [count] of the down component's observer form divided by V: (T = L/V)

    F(s) = sigma sqrt(T) (1 + sqrt(3) T s)/(1 + T s)^2 is written as b1 + b2 s over (s + 1/T)^2; with v'' = r - 2 v'/T - v/T^2
    the output is b1 v + b2 v' and the auxiliary state (2 b1/T - b2/T^2) v + b1 v'.
    Raises ValueError for a standard deviation below 0 or NaN, which would otherwise pass for calm air.
    """
    for name in ("sigma_w_mps", "sigma_u_mps"):
        if not 0.0 <= getattr(w, name) < math.inf:
            raise ValueError(f"{name} = {getattr(w, name)}; allowed >= 0")
    series, aux = np.zeros((count, 2)), np.zeros(count)
    if w.sigma_w_mps > 0.0:
        a, bbt, c = shaping(V, w.L_w_m, w.sigma_w_mps)
        i = slice(3, 5)  # the vertical axis of the three-axis form
        b1, b2 = c[2, 3], c[2, 4]
        om = V / w.L_w_m
        out = np.array([[b1, b2], [2.0 * om * b1 - om * om * b2, b1]])
        rows = _series(a[i, i], bbt[i, i], out, count, dt, seed, "alexis.gust.down")
        series[:, 0], aux[:] = rows[:, 0], rows[:, 1] / V
    if w.sigma_u_mps > 0.0:
        a, bbt, c = shaping(V, w.L_u_m, w.sigma_u_mps)
        series[:, 1] = _series(a[:1, :1], bbt[:1, :1], c[:1, :1], count, dt, seed, "alexis.gust.tail")[:, 0]
    return series, aux


def _series(a: Arr, bbt: Arr, c: Arr, count: int, dt: float, seed: int, name: str) -> Arr:
    phi, q = discretise(a, bbt, dt)
    g = generator(seed, name)
    x = stationary_draw(phi, q, g)
    out = np.zeros((count, len(c)))
    noise = g.standard_normal((count, len(a)))
    linear_block(x, phi, noise_factor(q), np.ascontiguousarray(c), noise, np.zeros(len(a)), out)
    return out


def wind_series(w: PlanarWind, V: float, count: int, dt: float, seed: int) -> tuple[Arr, Arr]:
    """All of the wind: series [count,2] (down, tail) [m/s] and the turbulence's auxiliary state [count] (see turbulence)."""
    series, aux = turbulence(w, V, count, dt, seed)
    t = np.arange(count) * dt
    if w.steps:
        factor = np.ones(count)
        for start, f in w.steps:
            factor[t >= start] = f
        series *= factor[:, None]
        aux = aux * factor
    for g in w.gusts:
        series[:, AXES[g.axis]] += g.at(t)
    series[:, 1] += w.steady_tail_mps
    return np.ascontiguousarray(series), aux
