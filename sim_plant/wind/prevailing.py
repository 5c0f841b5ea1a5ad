"""Prevailing wind against height: a constant, or a measured radiosonde ascent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.wind.sounding import Sounding, read

DATA = Path(__file__).resolve().parent.parent / "data"


def sounding_path(name: str) -> Path:
    """Where a sounding lies: an absolute path, or a file of sim_plant/data."""
    return Path(name) if Path(name).is_absolute() else DATA / name


def read_sounding(name: str) -> Sounding:
    """The ascent a scenario names: a file in sim_plant/data or a path. Raises ConfigError naming file, line and value."""
    path = sounding_path(name)
    try:
        return read(path)
    except OSError as e:
        have = ", ".join(sorted(p.name for p in DATA.glob("sounding*.txt")))
        raise ConfigError(f"sounding file {str(path)!r} cannot be read ({e.strerror}); shipped: {have}") from None


def sounding_table(name: str) -> NDArray[np.float64]:
    """Rows (height [m], north, east component [m/s], air moves towards) of a sounding. Raises ConfigError."""
    return read_sounding(name).wind


def constant_table(north: float, east: float) -> NDArray[np.float64]:
    """The same wind [m/s] at every height, in the form of `sounding_table`."""
    return np.array([[0.0, north, east], [40000.0, north, east]])
