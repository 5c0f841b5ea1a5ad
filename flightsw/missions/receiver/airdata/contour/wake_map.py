"""Wake maps on board: what three probes read at every node of a grid of relative positions, at one attitude and speed.

A map is two files of one name: .npz with the arrays y [ny], z [nz] and readings [9, nz, ny], .toml with where they are from and
the hashes by which a changed file is found. They are written by hil_scripts/studies/sevil/wake_map.py, from the wake model or
from a table of somebody's own. Those that come with the software lie in `maps` beside this package.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.strict import ConfigError, Range, convert, near, read_toml

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]
Place = Annotated[V3, Range(-100.0, 100.0)]
Degrees = Annotated[float, Range(-45.0, 45.0)]
MAPS = Path(__file__).parent.parent / "maps"
SEVIL_PROBES: tuple[V3, V3, V3] = ((6.0, 0.0, 0.0), (1.5, -5.4, 0.2), (1.5, 5.4, 0.2))  # [m, body]
READINGS = tuple(f"{v}{i}" for v in ("V", "beta", "alpha") for i in (1, 2, 3))  # nose, left tip, right tip
PLAIN = (
    "x_m",
    "V_mps",
    "rho_kgpm3",
    "psi_deg",
    "theta_deg",
    "phi_deg",
    "probes_m",
)  # of every map, in the order of the hash


@dataclass(frozen=True)
class Axis:
    """Evenly spaced nodes first, first + step, ... [m]."""

    first_m: float
    step_m: Annotated[float, Range(1e-3, 1e3)]
    count: Annotated[int, Range(2, 10000)]

    def nodes(self) -> Arr:
        """Node coordinates [count] in metres."""
        return np.round(self.first_m + self.step_m * np.arange(self.count), 9)


@dataclass(frozen=True, kw_only=True)
class MapConditions:
    """What every map holds for. F: the tanker's air-path axes, origin at its cg (wake_kernel.py)."""

    x_m: Annotated[float, Range(-500.0, 500.0)] = -35.5  # of the receiver's cg, F
    V_mps: Annotated[float, Range(10.0, 400.0)] = 200.0  # tanker airspeed
    rho_kgpm3: Annotated[float, Range(0.01, 2.0)] = 0.58883
    psi_deg: Degrees = 0.0  # attitude of the own body relative to F
    theta_deg: Degrees = 3.0
    phi_deg: Degrees = 0.0
    probes_m: tuple[Place, Place, Place] = SEVIL_PROBES  # nose, left tip, right tip; body axes


@dataclass(frozen=True)
class MapSpec(MapConditions):
    """All a map of the wake model depends on."""

    y: Axis
    z: Axis
    wake: WakeParams = field(default_factory=WakeParams)


@dataclass(frozen=True)
class MapOrigin(MapConditions):
    """Where a map of somebody's own (CFD, wind tunnel, flight) is from."""

    source: str
    licence: str

    def __post_init__(self) -> None:
        for name, text in (("source", self.source), ("licence", self.licence)):
            if not text.strip():
                raise ValueError(f"{name} = {text!r}: allowed: whose data they are, and under which terms")


@dataclass(frozen=True)
class WakeMap:
    """y [ny], z [nz] node coordinates, rising [m, F]; readings [9, nz, ny]: V1..3 [m/s], beta1..3, alpha1..3 [rad]."""

    spec: MapSpec | MapOrigin
    y: Arr
    z: Arr
    readings: Arr

    def nodes(self) -> Arr:
        """Node positions [nz * ny, 2] as (y, z) [m, F], y fastest."""
        Y, Z = np.meshgrid(self.y, self.z)
        return np.stack([Y.ravel(), Z.ravel()], axis=1)


def parameter_text(spec: MapSpec | MapOrigin) -> str:
    """The specification as TOML, in one fixed order: what the parameter hash is taken of."""

    def v(x: object) -> str:
        if isinstance(x, tuple):
            return "[" + ", ".join(v(i) for i in x) + "]"
        return json.dumps(x) if isinstance(x, str) else repr(x)

    lines = [f"{n} = {v(getattr(spec, n))}" for n in PLAIN]
    if isinstance(spec, MapOrigin):
        return "\n".join([*lines, f"source = {v(spec.source)}", f"licence = {v(spec.licence)}"]) + "\n"
    for name in ("y", "z", "wake"):
        lines += ["", f"[{name}]", *(f"{k} = {v(x)}" for k, x in vars(getattr(spec, name)).items())]
    return "\n".join(lines) + "\n"


def map_files(name: str, folder: Path = MAPS) -> tuple[Path, Path]:
    """The .toml and the .npz of a map: `name` of one in `folder`, or the path of a .toml file with its .npz beside it. Raises
    ConfigError if one of them is missing."""
    meta = Path(name) if Path(name).suffix else folder / f"{name}.toml"
    data = meta.with_suffix(".npz")
    if not meta.is_file() or not data.is_file():
        have = sorted(p.stem for p in folder.glob("*.npz"))
        allowed = ", ".join(have) or "none"
        raise ConfigError(
            f"map = {name!r}: no such wake map in {meta.parent}; allowed: {allowed}, or the path of a .toml file with its .npz"
            f" beside it{near(name, have)}"
        )
    return meta, data


def load_map(name: str, folder: Path = MAPS) -> WakeMap:
    """A stored map, named as for `map_files`.

    Raises ConfigError naming the file if it is missing, if the data are not those of its provenance file, or are no map.
    """
    path, data = map_files(name, folder)
    meta = read_toml(path)
    if "parameters" not in meta or "data_sha256" not in meta:
        raise ConfigError(f"{path}: missing key; needed: parameters, data_sha256")
    if hashlib.sha256(data.read_bytes()).hexdigest() != meta["data_sha256"]:
        raise ConfigError(f"{data}: its hash is not data_sha256 of {path.name}; make the map again")
    kind = MapOrigin if "source" in meta["parameters"] else MapSpec
    spec = convert(meta["parameters"], kind, f"{path}: parameters")
    assert isinstance(spec, (MapSpec, MapOrigin))
    if hashlib.sha256(parameter_text(spec).encode()).hexdigest() != meta.get("parameters_sha256"):
        raise ConfigError(f"{path}: parameters_sha256 is not the hash of the parameters; make the map again")
    with np.load(data, allow_pickle=False) as f:
        if missing := sorted({"y", "z", "readings"} - set(f.files)):
            raise ConfigError(f"{data}: missing array {missing[0]}; needed: y, z, readings")
        arrays = [np.ascontiguousarray(f[k], dtype=np.float64) for k in ("y", "z", "readings")]
    y, z, readings = arrays
    check_grid(str(data), y, z, readings)
    return WakeMap(spec, y, z, readings)


def check_grid(where: str, y: Arr, z: Arr, readings: Arr) -> None:
    """Raise ConfigError unless y [ny] and z [nz] rise, readings are [9, nz, ny] and everything is finite."""
    for name, axis in (("y", y), ("z", z)):
        if axis.ndim != 1 or len(axis) < 2 or not (np.diff(axis) > 0.0).all():
            raise ConfigError(f"{where}: {name}: shape {axis.shape}; allowed: two or more nodes in one row, rising")
    if readings.shape != (len(READINGS), len(z), len(y)):
        raise ConfigError(f"{where}: readings: shape {readings.shape}; allowed: {(len(READINGS), len(z), len(y))}")
    for name, a in (("y", y), ("z", z), ("readings", readings)):
        if not np.isfinite(a).all():
            raise ConfigError(
                f"{where}: {name}: {int((~np.isfinite(a)).sum())} values not finite; allowed: finite numbers"
            )
