"""A table of columns, of whatever aircraft, as a flight to identify from: deflections as measured, not as commanded."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hil_scripts.estimate import foreign
from hil_scripts.estimate.columns import ANGLE, ATT, RATE, SPEED, TIME, VANES, VEL, Column
from hil_scripts.estimate.flightlog import values_of
from hil_scripts.identify.flight.model import quaternions
from hil_scripts.identify.flight.readings import Flight, Samples

ACC = tuple(Column(f"acc_{a}_mps2", 200.0, "m/s^2 of specific force expected, this looks like g") for a in "xyz")
SURFACES = tuple(
    Column(f"{k}_rad", ANGLE, "rad expected, this looks like degrees") for k in ("aileron", "elevator", "rudder")
)
THROTTLE = Column("throttle", 1.0, "a share of the thrust available expected, 0 to 1", 0.0)
HEIGHT = Column("height_m", 20e3, "metres above sea level expected")
NEEDED = (TIME, *RATE, *ACC, SPEED, *VANES, *ATT, *VEL, HEIGHT, *SURFACES, THROTTLE)


def is_log(source: str) -> bool:
    """Whether a source is a log: a table, or a log of another format."""
    path = Path(source)
    return path.suffix.lower() in (".csv", ".txt", *(s for kind in foreign.SUFFIXES.values() for s in kind))


def read_log(path: Path) -> Flight:
    """The flight of a CSV table with columns NEEDED, on the grid of its usual step. Raises LogError naming what it does not
    have; of a log of another format that is what no message of it carries."""
    if foreign.is_foreign(path):
        have, _ = foreign.columns(path)
        missing = [c.name for c in NEEDED if c.name not in have]
        raise foreign.LogError(f"{path}: not read from this format: {', '.join(missing)}; expected a CSV with them")
    c = values_of(path, NEEDED)
    t = c[TIME.name]
    dt = float(np.median(np.diff(t)))
    at = np.round((t - t[0]) / dt).astype(np.int64)
    at, first = np.unique(at, return_index=True)

    def columns(wanted: tuple[Column, ...]) -> np.ndarray:
        return np.column_stack([c[k.name][first] for k in wanted])

    grid = np.arange(int(at[-1]) + 1)
    held = np.column_stack([np.interp(grid, at, c[k.name][first]) for k in (*SURFACES, THROTTLE)])
    samples = {
        "imu": Samples(at, columns((*RATE, *ACC))), "gnss": Samples(at, columns(VEL)),
        "att": Samples(at, quaternions(columns(ATT))), "baro": Samples(at, columns((HEIGHT,))),
        "air": Samples(at, columns((SPEED, VANES[1], VANES[0]))),
    }  # fmt: skip
    return Flight(path.name, dt, held[:, :3].copy(), held[:, 3].copy(), samples, 0, len(grid), measured=True)
