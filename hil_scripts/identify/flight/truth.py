"""The coefficients an own run was flown with, where its scenario says what was drawn. For comparison only."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from sim_plant.aircraft.sixdof.params import N_AERO, parameter_vector, perturb
from sim_plant.kernels import layout as n


def flown(folder: Path, name: str, ac: Aircraft) -> NDArray[np.float64] | None:
    """Coefficients [26] of aircraft `name` of a run folder; None: its scenario does not say."""
    try:
        scenario: dict[str, Any] = tomllib.loads((folder / "scenario.toml").read_text())
        return drawn(scenario, int(scenario["meta"]["seed"]), name, ac)
    except (OSError, tomllib.TOMLDecodeError, KeyError, ValueError):
        return None


def drawn(scenario: dict[str, Any], seed: int, name: str, ac: Aircraft) -> NDArray[np.float64] | None:
    """Coefficients [26] of aircraft `name` in a scenario with this seed; None: it flies by other equations than the derivatives
    of its file. Raises KeyError for a scenario without it."""
    mine = {a["name"]: a for a in scenario["aircraft"]}[name]
    if mine.get("model", "sixdof") != "sixdof" or mine.get("airframe", "derivatives") != "derivatives":
        return None
    par = perturb(parameter_vector(ac), float(mine.get("aero_error_frac", 0.0)), seed, name)
    return par[n.CL0 : n.CL0 + N_AERO].copy()
