"""A wake map of somebody's own as a table: CFD, wind tunnel or flight, in one .csv file.

The first lines begin with # and are TOML: every key of MapConditions, and `source` and `licence`:

    # x_m = -35.5
    # V_mps = 200.0
    # rho_kgpm3 = 0.589
    # psi_deg = 0.0
    # theta_deg = 3.0
    # phi_deg = 0.0
    # probes_m = [[6.0, 0.0, 0.0], [1.5, -5.4, 0.2], [1.5, 5.4, 0.2]]
    # source = "RANS of ..., report ..., table 4"
    # licence = "CC BY 4.0"
    y_m,z_m,V1_mps,V2_mps,V3_mps,beta1_deg,beta2_deg,beta3_deg,alpha1_deg,alpha2_deg,alpha3_deg
    -2.0,6.5,199.2,...

Then the names of the columns, in any order, and one row per node, in any order; every y with every z. Angles in rad or deg, as
the name of their column says; probes 1 nose, 2 left tip, 3 right tip; (y, z) is the place of the receiver's cg in the tanker's
air-path axes F, y right, z down, and the readings are what the probes show there in still air.
"""

from __future__ import annotations

import csv
import math
import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.contour.wake_map import PLAIN, READINGS, MapOrigin, WakeMap, check_grid
from flightsw.strict import ConfigError, convert

Arr = NDArray[np.float64]
UNITS = {"m": 1.0, "mps": 1.0, "rad": 1.0, "deg": math.radians(1.0)}
FAR_M = 500.0  # [m] |y|, |z|
FLOW_RAD = math.pi / 4.0  # [rad] |beta|, |alpha|: an angle in the wrong unit is beyond it
V_SHARE = 0.5, 1.5  # [-] of the tanker's airspeed: a speed in the wrong unit is beyond these


def read_table(path: Path) -> WakeMap:
    """The map of a table. Raises ConfigError naming file, line, field, value and what is allowed."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as e:
        raise ConfigError(f"{path}: cannot be read: {getattr(e, 'strerror', None) or e}") from None
    top = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    origin = _origin(path, "\n".join(line.removeprefix("#").strip() for line in lines[:top]))
    if top == len(lines):
        raise ConfigError(f"{path}: no line with the names of the columns")
    columns = _columns(path, [c.strip() for c in next(csv.reader([lines[top]]))])
    rows = [
        _row(path, n, line, columns, origin.V_mps) for n, line in enumerate(lines[top + 1 :], top + 2) if line.strip()
    ]
    return _grid(path, origin, np.array(rows).reshape(len(rows), len(columns)), list(columns))


def _origin(path: Path, text: str) -> MapOrigin:
    try:
        head = tomllib.loads(text)
    except tomllib.TOMLDecodeError as e:
        raise ConfigError(f"{path}: lines that begin with #: not valid TOML: {e}") from None
    for key in PLAIN:  # nothing of a stranger's map is taken for granted
        if key not in head:
            raise ConfigError(f"{path}: {key}: missing key; needed: {', '.join((*PLAIN, 'source', 'licence'))}")
    return convert(head, MapOrigin, str(path))


def _columns(path: Path, names: list[str]) -> dict[str, tuple[int, float]]:
    """Field -> (place in the row, factor to SI), fields y, z and READINGS in this order."""
    allowed = {"y": ("m",), "z": ("m",), **{r: ("mps",) if r.startswith("V") else ("rad", "deg") for r in READINGS}}
    named = {f"{field}_{unit}": (field, unit) for field, units in allowed.items() for unit in units}
    found: dict[str, tuple[int, float]] = {}
    for i, name in enumerate(names):
        if name not in named:
            raise ConfigError(f"{path}: column {name!r}: allowed: {', '.join(named)}")
        field, unit = named[name]
        if field in found:
            raise ConfigError(f"{path}: column {name!r}: {field} is there twice; allowed: once")
        found[field] = i, UNITS[unit]
    for field, units in allowed.items():
        if field not in found:
            raise ConfigError(f"{path}: no column {' or '.join(f'{field}_{u}' for u in units)}")
    return {field: found[field] for field in allowed}


def _row(path: Path, n: int, line: str, columns: dict[str, tuple[int, float]], V_mps: float) -> list[float]:
    """Values [11] in SI of line n."""
    cells = next(csv.reader([line]))
    if len(cells) != len(columns):
        raise ConfigError(f"{path}: line {n}: {len(cells)} values; allowed: {len(columns)}")
    out = []
    for field, (i, factor) in columns.items():
        lo, hi = _limits(field, V_mps)
        try:
            value = float(cells[i]) * factor
        except ValueError:
            value = math.nan
        if not lo <= value <= hi:
            lo, hi = lo / factor, hi / factor
            raise ConfigError(f"{path}: line {n}: {field} = {cells[i].strip()!r}: allowed {lo:.4g} to {hi:.4g}")
        out.append(value)
    return out


def _limits(field: str, V_mps: float) -> tuple[float, float]:
    if field in ("y", "z"):
        return -FAR_M, FAR_M
    lo, hi = V_SHARE
    return (lo * V_mps, hi * V_mps) if field.startswith("V") else (-FLOW_RAD, FLOW_RAD)


def _grid(path: Path, origin: MapOrigin, rows: Arr, fields: list[str]) -> WakeMap:
    """Rows [n,11] sorted into the grid; every node once."""
    at = {f: rows[:, i] for i, f in enumerate(fields)}
    y, z = np.unique(at["y"]), np.unique(at["z"])
    readings = np.full((len(READINGS), len(z), len(y)), np.nan)
    j, i = np.searchsorted(z, at["z"]), np.searchsorted(y, at["y"])
    seen = np.zeros((len(z), len(y)), dtype=np.int64)
    np.add.at(seen, (j, i), 1)
    for count, what in ((seen > 1, "there twice"), (seen < 1, "missing")):
        if count.any():
            b, a = np.argwhere(count)[0]
            raise ConfigError(f"{path}: node y = {y[a]:g}, z = {z[b]:g} is {what}; allowed: every y with every z, once")
    for c, name in enumerate(READINGS):
        readings[c, j, i] = at[name]
    check_grid(str(path), y, z, readings)
    return WakeMap(origin, y, z, readings)
