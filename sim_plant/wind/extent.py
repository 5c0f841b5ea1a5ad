"""What a gust does over an airframe: the same everywhere, turning as MIL-F-8785C has it, or each place in its own air."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.rng import BLOCK, generator
from sim_plant.wind.air import gauss_markov_block
from sim_plant.wind.config import Dryden
from sim_plant.wind.extent_kernel import field_gusts, filtered_gusts
from sim_plant.wind.gusts import Gusts
from sim_plant.wind.span import Across
from sim_plant.wind.wake import WING_SHARE, Exposure

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member

Arr = NDArray[np.float64]
NODE = math.sqrt(0.5)  # [-] of the half span: outer nodes of Gauss' rule of three for an elliptic load


@dataclass(frozen=True)
class Places:
    """Where an aircraft meets gusts, body axes [m]: three stations of the wing, nose, centre and tail, probes. weight [6, 3]: of
    the mean, of the slope along y, of the slope along x."""

    points: Arr
    weight: Arr


def places(span_m: float, wing_x_m: float, nose_x_m: float, tail_x_m: float, probes: Arr) -> Places:
    """Stations at 0 and +-0.707 of the half span with weights 1/2, 1/4, 1/4: exact for elliptic load and gusts up to the fifth
    power of y (Gauss-Chebyshev, second kind)."""
    y = 0.5 * NODE * span_m
    frame = np.array([nose_x_m, 0.0, tail_x_m])
    points = np.zeros((6, 3))
    points[:3, 0], points[1:3, 1], points[3:, 0] = wing_x_m, (-y, y), frame
    weight = np.zeros((6, 3))
    weight[:3, 0] = WING_SHARE * np.array([0.5, 0.25, 0.25])
    weight[[3, 5], 0] = 0.5 * (1.0 - WING_SHARE)
    weight[1:3, 1] = -0.5 / y, 0.5 / y
    off = frame - frame.mean()
    weight[3:, 2] = off / np.sum(off * off)
    return Places(np.ascontiguousarray(np.vstack([points, probes])), weight)


class Over(Protocol):
    """What adds to the effective wind [NW] and to the probes' [m, 3] (m/s, NED) of an aircraft of state s [NS], at tick k, `lag`
    ticks (at most Gusts.most) behind whoever lays the gusts."""

    def turn(self, s: Arr, k: int, lag: float, wind: Arr, probe: Arr) -> None:
        """Add what a tick brings."""
        ...


class Field:
    """Each place of one aircraft in its own air: laid beside its centre's line, met before or after it."""

    def __init__(self, p: Places, g: Gusts, step_m: float) -> None:
        """step_m: way of the gusts in a tick [m]."""
        assert g.across is not None
        self._g, self._p = g, p
        at = {y: i for i, y in enumerate(g.across.y_m)}
        self._line = np.array([at[round(y, 6)] for y in p.points[:, 1].tolist()])
        self._late = -p.points[:, 0] / step_m

    def turn(self, s: Arr, k: int, lag: float, wind: Arr, probe: Arr) -> None:
        """Each place's gust less the centre's, and the slopes of what the places meet."""
        field_gusts(s, self._g.rings, k, lag, self._line, self._late, self._p.weight, wind, probe)


class Filtered:
    """Rotational gusts p, q, r of one aircraft by the spectra of MIL-F-8785C 3.7.5 (docs/air.md 4)."""

    def __init__(self, g: Gusts, seed: int, name: str, span_m: float, V: float, dt: float) -> None:
        """span_m: its span [m], V: airspeed of the gusts [m/s], dt: tick [s]."""
        self._g, self._b = g, span_m
        self._rng, self._at = generator(seed, f"{name}.gust.p"), BLOCK
        self._x = self._rng.standard_normal(1)
        self._rows = np.zeros((BLOCK, 1))
        tau = 4.0 * span_m / (math.pi * V)
        self._e = math.exp(-dt / tau)  # of p and q
        self._c = np.array([_lag(tau, V, dt), _lag(0.75 * tau, V, dt)])
        self._slow = np.full((3, 3), math.nan)

    def turn(self, s: Arr, k: int, lag: float, wind: Arr, probe: Arr) -> None:
        """p of its own draws, q and r of the gusts met."""
        if self._at == BLOCK:
            self._rows = self._rng.standard_normal((BLOCK, 1))
            gauss_markov_block(self._x, self._e, self._rows)
            self._at = 0
        g = self._g
        p = sigma_p(g.sigma_w(k), float(g.lengths[2]), self._b) * float(self._rows[self._at, 0])
        self._at += 1
        filtered_gusts(s, g.ring, k, lag, p, self._c, self._slow, wind)


def _lag(tau: float, V: float, dt: float) -> tuple[float, float, float, float]:
    """Row of a slope behind a lag tau [s] for filtered_gusts."""
    e, r = math.exp(-dt / tau), dt / tau
    share = (1.0 - e) / r
    return e, share - e, 1.0 - share, 1.0 / (tau * V)


def sigma_p(sigma_w: float, L_w: float, b: float) -> float:
    """1-sigma [rad/s] of p over a span b [m]: square root of the integral of its spectrum (docs/air.md 4)."""
    return sigma_w * math.sqrt(0.1 * math.pi**2 / (b * L_w) * math.cbrt(0.25 * math.pi * L_w / b))


def lines(d: Dryden, members: Sequence[Member], dt: float) -> tuple[Across | None, int]:
    """Lines of air that `members` need, and how many ticks [dt, s] before their centres the foremost place comes there."""
    if d.over != "field":
        return None, 0
    points = np.vstack([_places(d, m).points for m in members])
    y = sorted({round(v, 6) for v in points[:, 1].tolist()}, key=abs)
    return Across((0.0, *(v for v in y if v != 0.0))), math.ceil(np.abs(points[:, 0]).max() / (d.V_mps * dt)) + 1


def extent(d: Dryden, m: Member, g: Gusts, seed: int, dt: float) -> Over | None:
    """How gusts act over a member; None: alike everywhere. Raises ConfigError for one that has no extent."""
    if d.over == "point":
        return None
    if d.over == "field":
        return Field(_places(d, m), g, d.V_mps * dt)
    return Filtered(g, seed, m.cfg.name, _felt(d, m).span_m, d.V_mps, dt)


def _felt(d: Dryden, m: Member) -> Exposure:
    if m.exposure is None:
        who = f"aircraft.{m.cfg.name}.model = {m.cfg.model!r}"
        raise ConfigError(f"wind.dryden.over = {d.over!r}: {who} is a point to the air; allowed: point")
    return m.exposure


def _places(d: Dryden, m: Member) -> Places:
    x = _felt(d, m)
    nose, tail = x.points[x.n_span], x.points[x.n_frame - 1]
    return places(x.span_m, float(x.points[0, 0]), float(nose[0]), float(tail[0]), m.probes)
