"""Prevailing wind against height: a constant, or a measured radiosonde ascent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError

DATA = Path(__file__).resolve().parent.parent / "data"
KNOT = 0.514444  # [m/s]


def sounding_path(name: str) -> Path:
    """Where a sounding lies: an absolute path, or a file of sim_plant/data."""
    return Path(name) if Path(name).is_absolute() else DATA / name


def sounding_table(name: str) -> NDArray[np.float64]:
    """Rows (height [m], north, east component [m/s], air moves towards) of a University of Wyoming listing.

    `name`: file in sim_plant/data or a path. Fixed columns of 7 characters: HGHT second, DRCT (direction FROM, deg)
    and SKNT (knots) seventh and eighth; rows without wind are left out. Raises ConfigError naming the file.
    """
    path = sounding_path(name)
    try:
        lines = path.read_text().splitlines()
    except OSError as e:
        have = ", ".join(sorted(p.name for p in DATA.glob("sounding*.txt")))
        raise ConfigError(f"sounding file {str(path)!r} cannot be read ({e.strerror}); shipped: {have}") from None
    rows: list[tuple[float, float, float]] = []
    for line in lines:
        cells = [line[i : i + 7].strip() for i in range(0, 77, 7)]
        try:
            height, direction, knots = float(cells[1]), float(cells[6]), float(cells[7])
        except (ValueError, IndexError):
            continue
        a, v = np.radians(direction), knots * KNOT
        if not rows or height > rows[-1][0]:
            rows.append((height, float(-v * np.cos(a)), float(-v * np.sin(a))))
    if len(rows) < 2:
        raise ConfigError(f"sounding file {str(path)!r} holds no levels with height, direction and speed")
    return np.array(rows)


def constant_table(north: float, east: float) -> NDArray[np.float64]:
    """The same wind [m/s] at every height, in the form of `sounding_table`."""
    return np.array([[0.0, north, east], [40000.0, north, east]])
