"""The whole way from a flight's readings to what they tell."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError, Tree
from hil_scripts.identify.flight.equation_error import start
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
    """From ticks lo to hi; tables: those of the flight file, for what it says of its sensors. Raises ConfigError for a flight
    that lacks sensors, is too short or finds no fit."""
    f.needs()
    if (hi - lo) * f.dt_s < LEAST_S:
        raise ConfigError(f"{f.name}: {(hi - lo) * f.dt_s:.1f} s to identify from; allowed: {LEAST_S:g} s and more")
    m = FlightModel(f, like, lo, hi, lasting(tables))
    x0, by_equation = start(m)
    try:
        found = fit(m, x0)
    except (NotFittedError, np.linalg.LinAlgError) as e:
        raise ConfigError(f"{f.name}: output error finds no fit: {e}") from None
    white, coloured = covariance(m, found)
    v = verdict(found.x[:NC], np.array(astuple(like.aero)), white[:NC, :NC], coloured[:NC, :NC])
    correlation = {
        c.name: float(r[1:] @ r[:-1] / (r @ r)) for c, r in zip(m.channels, found.residuals, strict=True) if len(r) > 1
    }
    return Identified(m, found, v, by_equation, correlation)
