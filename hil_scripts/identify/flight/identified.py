"""The whole way from a flight's readings to what they tell."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError, Tree
from hil_scripts.identify.flight.equation_error import start
from hil_scripts.identify.flight.gusts import Gusts
from hil_scripts.identify.flight.intervals import Verdict, covariance, verdict
from hil_scripts.identify.flight.model import NC, FlightModel, lasting
from hil_scripts.identify.flight.output_error import Fit, NotFittedError, fit
from hil_scripts.identify.flight.readings import Flight

Arr = NDArray[np.float64]
LEAST_S = 20.0  # [s] of flight
COLOURED = 0.2  # [-] of a channel's residual correlated with the one before: more is no sensor's noise


@dataclass(frozen=True)
class Identified:
    """Model and fit of a flight, what it tells, whether equation error gave the start, correlation of each channel's residuals
    from one sample to the next [-]."""

    model: FlightModel
    fit: Fit
    verdict: Verdict
    by_equation: bool
    correlation: dict[str, float]

    @property
    def coloured(self) -> list[str]:
        """Channels whose residuals are not white: what moved them is not in the model, and intervals are lower bounds."""
        return [k for k, v in self.correlation.items() if v > COLOURED]


def identify_flight(f: Flight, like: Aircraft, lo: int, hi: int, tables: Tree) -> Identified:
    """From ticks lo to hi, in still air first; where that leaves residuals that are no sensors' noise, with gusts; tables: those
    of the flight file, for what it says of its sensors. Raises ConfigError for a flight that lacks sensors, is too short or
    finds no fit."""
    f.needs()
    if (hi - lo) * f.dt_s < LEAST_S:
        raise ConfigError(f"{f.name}: {(hi - lo) * f.dt_s:.1f} s to identify from; allowed: {LEAST_S:g} s and more")
    known = lasting(tables)
    still = FlightModel(f, like, lo, hi, known)
    x0, by_equation = start(still)
    try:
        one = _of(still, fit(still, x0), by_equation)
        if not one.coloured:
            return one
        x0 = one.fit.x
    except (NotFittedError, np.linalg.LinAlgError):
        pass
    m = FlightModel(f, like, lo, hi, known, Gusts(float(x0[NC])))
    try:
        return _of(m, fit(m, np.concatenate([x0, np.zeros(m.size - still.size)])), by_equation)
    except (NotFittedError, np.linalg.LinAlgError) as e:
        raise ConfigError(f"{f.name}: output error finds no fit, without turbulence and with it: {e}") from None


def _of(m: FlightModel, found: Fit, by_equation: bool) -> Identified:
    white, coloured = covariance(m, found)
    v = verdict(found.x[:NC], np.array(astuple(m.like.aero)), white, coloured)
    correlation = {
        c.name: float(r[1:] @ r[:-1] / (r @ r)) for c, r in zip(m.channels, found.residuals, strict=True) if len(r) > 1
    }
    return Identified(m, found, v, by_equation, correlation)
