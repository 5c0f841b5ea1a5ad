"""Test inputs for identification in flight: orthogonal phase-optimised multisines on the commands
(docs/sources/identification.md 1).

A control's multisine is a sum of cosines at harmonics of 1 / duration_s. The harmonics of the band are dealt out in turn, so no
two controls share one: over the whole duration they are orthogonal, and each begins and ends at zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.sixdof.actuators import surface_limits
from flightsw.strict import ConfigError, Range
from flightsw.types import Text

CONTROLS = ("aileron_deg", "elevator_deg", "rudder_deg", "throttle")
LEAST = 4  # harmonics of a control: fewer have no phases worth choosing
OVER = 16  # points per period of the highest harmonic
SWAPS = 60  # of time and frequency domain
CLIP = 0.9  # [-] of the peak, at which the time domain is cut
TRAVEL = 0.5  # [-] of the lesser travel, at most
RATE = 0.2  # [-] of the step rate, up to which a held command still follows its sine
Deg = Annotated[float, Range(0.0, 10.0)]


@dataclass(frozen=True)
class ExcitationParams:
    """[excitation] of a flight file: test inputs added to the commands, peak to each side; 0: that control gets none."""

    on: bool = False
    start_s: Annotated[float, Range(0.0, 1e5)] = 30.0  # after navigation is valid
    duration_s: Annotated[float, Range(10.0, 600.0)] = 80.0
    band_hz: tuple[Annotated[float, Range(0.005, 10.0)], Annotated[float, Range(0.005, 10.0)]] = (0.02, 1.0)
    aileron_deg: Deg = 6.0
    elevator_deg: Deg = 5.0
    rudder_deg: Deg = 6.0
    throttle: Annotated[float, Range(0.0, 0.3)] = 0.2  # [-] of the thrust available

    def __post_init__(self) -> None:
        """Raises ConfigError for what is set and not obeyed, and for test inputs that are none."""
        if not self.on:
            for f in fields(self):
                if getattr(self, f.name) != f.default:
                    raise ConfigError(
                        f"excitation.{f.name} = {getattr(self, f.name)}: nothing obeys it with on = false"
                    )
        elif not any(self.amplitudes):
            raise ConfigError(f"excitation.on = true: allowed with one of {', '.join(CONTROLS)} above 0")

    @property
    def amplitudes(self) -> tuple[float, float, float, float]:
        """Peaks of aileron, elevator, rudder [rad], throttle [-]."""
        a, e, r = (math.radians(x) for x in (self.aileron_deg, self.elevator_deg, self.rudder_deg))
        return a, e, r, self.throttle


def harmonics(p: ExcitationParams) -> list[list[int]]:
    """Numbers of the harmonics of 1 / duration_s of each of CONTROLS; none for a control without test input. Raises ConfigError
    for a band without room for them."""
    lo, hi = math.ceil(p.band_hz[0] * p.duration_s - 1e-9), math.floor(p.band_hz[1] * p.duration_s + 1e-9)
    used = [i for i, a in enumerate(p.amplitudes) if a > 0.0]
    room = list(range(max(lo, 1), hi + 1))
    if len(room) < LEAST * len(used):
        raise ConfigError(
            f"excitation.band_hz = {list(p.band_hz)}: {len(room)} harmonics of 1 / {p.duration_s:g} s; allowed: {LEAST} for each "
            f"of {len(used)} controls"
        )
    return [room[used.index(i) :: len(used)] if i in used else [] for i in range(len(CONTROLS))]


class Period:
    """n points of a period: cosine and sine of each harmonic by one table."""

    def __init__(self, ks: np.ndarray, n: int) -> None:
        turn = [2.0 * math.pi * i / n for i in range(n)]
        c, s = np.array([math.cos(x) for x in turn]), np.array([math.sin(x) for x in turn])
        at = [int(k) * np.arange(n) % n for k in ks]
        self.cos, self.sin = [c[i] for i in at], [s[i] for i in at]
        self.n = n

    def wave(self, phases: list[float]) -> np.ndarray:
        """Sum [n] of the harmonics' cosines with phases [m] rad."""
        y = np.zeros(self.n)
        for c, s, x in zip(self.cos, self.sin, phases, strict=True):
            y += math.cos(x) * c - math.sin(x) * s
        return y

    def phases(self, y: np.ndarray) -> list[float]:
        """Phases [m] rad of the harmonics in y [n]."""
        return [
            math.atan2(-float((y * s).sum()), float((y * c).sum())) for c, s in zip(self.cos, self.sin, strict=True)
        ]


def flat_phases(ks: np.ndarray) -> tuple[np.ndarray, float]:
    """Phases [m] rad of harmonics ks [m] for a small peak, starting at a zero, and a bound of the peak [-] at any time.

    Schroeder's phases, then swaps of time and frequency domain with the peaks cut (Van der Ouderaa et al. 1988). Between n
    points a sum of harmonics up to k exceeds its largest value there by 1 / cos(pi k / n) at most (Ehlich and Zeller 1964).
    """
    m, n = len(ks), OVER * int(ks[-1])
    grid = Period(ks, n)
    best = phases = [-math.pi * i * i / m for i in range(m)]
    y = grid.wave(phases)
    peak = float(np.abs(y).max())
    for _ in range(SWAPS):
        top = CLIP * float(np.abs(y).max())
        phases = grid.phases(np.clip(y, -top, top))
        y = grid.wave(phases)
        if (new := float(np.abs(y).max())) < peak:
            best, peak = phases, new
    y = grid.wave(best)
    at = int(np.flatnonzero((y[:-1] <= 0.0) & (y[1:] > 0.0))[0])  # no constant in it: it rises through zero somewhere
    lo, hi = 2.0 * math.pi * at / n, 2.0 * math.pi * (at + 1) / n
    for _ in range(50):
        mid = 0.5 * (lo + hi)
        lo, hi = (mid, hi) if cosines(ks, best, mid) <= 0.0 else (lo, mid)
    turned = np.mod([x + k * lo for x, k in zip(best, ks.tolist(), strict=True)], 2.0 * math.pi)
    return turned, peak / math.cos(math.pi * float(ks[-1]) / n)


def cosines(w: Iterable[float], phases: Iterable[float], t: float) -> float:
    """Sum of cos(w t + phase)."""
    return sum(math.cos(a * t + b) for a, b in zip(w, phases, strict=True))


class Multisine:
    """Of one control: `at` gives its value, within +- amplitude at any time."""

    def __init__(self, ks: list[int], amplitude: float, duration_s: float) -> None:
        phases, peak = flat_phases(np.array(ks, dtype=np.int64))
        self.phases: list[float] = phases.tolist()
        self.w = [2.0 * math.pi * k / duration_s for k in ks]
        self.share = amplitude / peak

    def at(self, t_s: float) -> float:
        """Value t_s [s] after its begin."""
        return self.share * cosines(self.w, self.phases, t_s)


WAITING, RUNNING, OVER_ = range(3)


class Excitation:
    """Test inputs of one aircraft. `step` at every mission step; `texts`: messages, which the mission takes away."""

    def __init__(self, ac: Aircraft, p: ExcitationParams, period_s: float) -> None:
        """Raises ConfigError for amplitudes beyond the aircraft and a band beyond the step period_s [s]."""
        self.p, self.texts = p, list[Text]()
        self._lim, self._idle = surface_limits(ac), ac.engine.idle_frac
        for i, key in enumerate(CONTROLS[:3]):
            most = TRAVEL * float(np.abs(self._lim[i, :2]).min())
            if p.amplitudes[i] > most:
                raise ConfigError(
                    f"excitation.{key} = {getattr(p, key):g}: allowed for {ac.meta.name}: up to {math.degrees(most):g} deg"
                )
        if p.band_hz[1] > RATE / period_s:
            raise ConfigError(
                f"excitation.band_hz = {list(p.band_hz)}: allowed at {1.0 / period_s:g} steps a second: up to "
                f"{RATE / period_s:g} Hz"
            )
        self.sines = [
            Multisine(k, a, p.duration_s) if k else None for k, a in zip(harmonics(p), p.amplitudes, strict=True)
        ]
        self._phase, self._t0 = WAITING, -1

    def stop(self, why: str) -> None:
        """Give up what is under way, for good."""
        if self._phase == RUNNING:
            self._phase = OVER_
            self.texts.append(Text(4, f"excitation stopped: {why}"))

    def step(self, u: np.ndarray, throttle: float, t_us: int) -> tuple[np.ndarray, float]:
        """The law's command u [4] (surfaces [rad], thrust [N]) and throttle [-] at t_us [us], with the test inputs and within the
        travel."""
        if self._t0 < 0:
            self._t0 = t_us
        t = (t_us - self._t0) * 1e-6 - self.p.start_s
        if self._phase == OVER_ or t < 0.0 or not (math.isfinite(throttle) and np.isfinite(u).all()):
            return u, throttle
        if self._phase == WAITING:
            self._phase = RUNNING
            self.texts.append(Text(5, f"excitation begins: {self.p.duration_s:g} s"))
        if t >= self.p.duration_s:
            self._phase = OVER_
            self.texts.append(Text(5, "excitation ends"))
            return u, throttle
        out = u.copy()
        for i, s in enumerate(self.sines[:3]):
            if s is not None:
                out[i] = min(max(u[i] + s.at(t), self._lim[i, 0]), self._lim[i, 1])
        lever = self.sines[3]
        if lever is not None and throttle > 0.0:
            share = min(max(throttle + lever.at(t), self._idle), 1.0)
            out[3] = u[3] * share / throttle
            return out, share
        return out, throttle
