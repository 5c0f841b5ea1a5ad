"""Wake maps: what the three probes read at every node of a grid of relative positions, at one attitude.

    python -m hil_scripts.studies.sevil.wake_map --out DIR [--tanker kc135r --receiver learjet24 --mass KG]

writes `small` (441 nodes) and `extended` (1533 nodes), each as .npz (the readings) and .toml (provenance: parameters,
grid, attitude, hashes). Without aircraft names the wake and probe geometry are those of sevil.md section 4, which is
what is stored in hil_scripts/studies/sevil/maps. The same parameters give the same bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.wake_kernel import probe_readings
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_params_of, wake_vector
from flightsw.strict import ConfigError, Range, convert, read_toml

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]
HERE = Path(__file__).parent / "maps"
SEVIL_PROBES: tuple[V3, V3, V3] = ((6.0, 0.0, 0.0), (1.5, -5.4, 0.2), (1.5, 5.4, 0.2))  # [m, body]


@dataclass(frozen=True)
class Axis:
    """Evenly spaced nodes first, first + step, ... [m]."""

    first_m: float
    step_m: Annotated[float, Range(1e-3, 1e3)]
    count: Annotated[int, Range(2, 10000)]

    def nodes(self) -> Arr:
        """Node coordinates [count] in metres."""
        return np.round(self.first_m + self.step_m * np.arange(self.count), 9)


@dataclass(frozen=True)
class MapSpec:
    """All a map depends on. Positions in F, attitude of the own body relative to F (wake_kernel.py)."""

    y: Axis
    z: Axis
    x_m: float = -35.5
    V_mps: Annotated[float, Range(10.0, 400.0)] = 200.0  # tanker airspeed
    rho_kgpm3: Annotated[float, Range(0.01, 2.0)] = 0.58883
    psi_deg: float = 0.0
    theta_deg: float = 3.0
    phi_deg: float = 0.0
    probes_m: tuple[V3, V3, V3] = SEVIL_PROBES
    wake: WakeParams = field(default_factory=WakeParams)


SPECS = {
    "small": MapSpec(Axis(-2.0, 0.2, 21), Axis(6.5, 0.2, 21)),
    "extended": MapSpec(Axis(-4.0, 1.0, 73), Axis(-6.0, 1.0, 21)),
}


@dataclass(frozen=True)
class WakeMap:
    """y [ny], z [nz] node coordinates [m, F]; readings [9, nz, ny]: V1..3 [m/s], beta1..3, alpha1..3 [rad]."""

    spec: MapSpec
    y: Arr
    z: Arr
    readings: Arr

    def nodes(self) -> Arr:
        """Node positions [nz * ny, 2] as (y, z) [m, F], y fastest."""
        Y, Z = np.meshgrid(self.y, self.z)
        return np.stack([Y.ravel(), Z.ravel()], axis=1)


def attitude(spec: MapSpec) -> Arr:
    """(psi, theta, phi) [rad] of a map."""
    return np.radians(np.array([spec.psi_deg, spec.theta_deg, spec.phi_deg]))


def expected_readings(spec: MapSpec, points: Arr, wind: Arr | None = None) -> Arr:
    """Readings [n, 9] by the model of a map at positions points [n, 2] = (y, z) [m, F], in still air or in a uniform
    wind [n, 3] or [3] [m/s, F]; no rates, no relative motion (sevil.md section 3.2)."""
    e, zero, wk, probes = attitude(spec), np.zeros(3), wake_vector(spec.wake), np.array(spec.probes_m)
    w = np.broadcast_to(zero if wind is None else np.asarray(wind, dtype=float), (len(points), 3))
    out = np.zeros((len(points), 9))
    for i, (y, z) in enumerate(points):
        xi = np.array([spec.x_m, y, z])
        wi = np.array(w[i])  # writable, as everywhere: one kernel
        probe_readings(xi, e, zero, spec.V_mps, spec.rho_kgpm3, wi, zero, probes, wk, 1.0, 1.0, out[i])
    return out


def make_map(spec: MapSpec) -> WakeMap:
    """The map of a specification, in still air."""
    y, z = spec.y.nodes(), spec.z.nodes()
    empty = WakeMap(spec, y, z, np.zeros((9, 0, 0)))
    values = expected_readings(spec, empty.nodes())
    return replace(empty, readings=np.ascontiguousarray(values.T.reshape(9, len(z), len(y))))


def parameter_text(spec: MapSpec) -> str:
    """The specification as TOML, in one fixed order: what the parameter hash is taken of."""

    def v(x: object) -> str:
        return "[" + ", ".join(v(i) for i in x) + "]" if isinstance(x, tuple) else repr(x)

    lines = [f"{n} = {v(getattr(spec, n))}" for n in ("x_m", "V_mps", "rho_kgpm3", "psi_deg", "theta_deg", "phi_deg")]
    lines.append(f"probes_m = {v(spec.probes_m)}")
    for name in ("y", "z", "wake"):
        lines += ["", f"[{name}]", *(f"{k} = {v(x)}" for k, x in vars(getattr(spec, name)).items())]
    return "\n".join(lines) + "\n"


def save_map(m: WakeMap, name: str, folder: Path) -> None:
    """Write `name`.npz and `name`.toml into `folder`. Same map, same bytes."""
    data = folder / f"{name}.npz"
    np.savez(data, y=m.y, z=m.z, readings=m.readings)
    text = parameter_text(m.spec)
    head = (
        "# Wake map written by `python -m hil_scripts.studies.sevil.wake_map`; do not edit.\n"
        f'name = "{name}"\n'
        f"nodes = {len(m.y) * len(m.z)}\n"
        f'parameters_sha256 = "{hashlib.sha256(text.encode()).hexdigest()}"\n'
        f'data_sha256 = "{hashlib.sha256(data.read_bytes()).hexdigest()}"\n\n[parameters]\n'
    )
    body = "\n".join(f"[parameters.{line[1:]}" if line.startswith("[") else line for line in text.splitlines())
    (folder / f"{name}.toml").write_text(head + body + "\n", encoding="utf-8")


def load_map(name: str, folder: Path = HERE) -> WakeMap:
    """A stored map: "small" (441 nodes) or "extended" (1533), or another one in `folder`.

    Raises ConfigError naming the file if it is missing, or if the data are not those of its provenance file.
    """
    path, data = folder / f"{name}.toml", folder / f"{name}.npz"
    if not path.is_file() or not data.is_file():
        have = ", ".join(sorted(p.stem for p in folder.glob("*.npz"))) or "none"
        raise ConfigError(f"name = {name!r}: no such wake map in {folder}; allowed: {have}")
    meta = read_toml(path)
    if "parameters" not in meta or "data_sha256" not in meta:
        raise ConfigError(f"{path}: missing key; needed: parameters, data_sha256")
    if hashlib.sha256(data.read_bytes()).hexdigest() != meta["data_sha256"]:
        raise ConfigError(f"{data}: its hash is not data_sha256 of {path.name}; make the map again")
    spec = convert(meta["parameters"], MapSpec, f"{path}: parameters")
    if hashlib.sha256(parameter_text(spec).encode()).hexdigest() != meta.get("parameters_sha256"):
        raise ConfigError(f"{path}: parameters_sha256 is not the hash of the parameters; make the map again")
    with np.load(data, allow_pickle=False) as f:
        return WakeMap(spec, f["y"], f["z"], np.ascontiguousarray(f["readings"]))


def spec_for(base: MapSpec, tanker: str, receiver: str, mass_kg: float) -> MapSpec:
    """`base` with wake and probes of two aircraft records; the receiver must have three probes (nose, left, right).

    Raises ConfigError if it has not, or if a record does not exist.
    """
    ac = load_aircraft(receiver)
    if len(ac.probe) != 3:
        raise ConfigError(f"{receiver}: probe: {len(ac.probe)} entries; allowed: 3")
    a, b, c = (p.position_m for p in ac.probe)
    return replace(base, wake=wake_params_of(load_aircraft(tanker), mass_kg), probes_m=(a, b, c))


def main(argv: list[str] | None = None) -> None:
    """Command: write both maps."""
    p = argparse.ArgumentParser(prog="python -m hil_scripts.studies.sevil.wake_map", description="Write the wake maps.")
    p.add_argument("--out", type=Path, required=True, help="folder for the .npz and .toml files")
    p.add_argument("--tanker", help="aircraft record of the tanker (default: sevil.md section 4)")
    p.add_argument("--receiver", help="aircraft record whose probes are used (with --tanker)")
    p.add_argument("--mass", type=float, default=WakeParams().mass_kg, help="tanker mass [kg] (with --tanker)")
    a = p.parse_args(argv)
    if bool(a.tanker) != bool(a.receiver):
        p.error("--tanker and --receiver: give both or neither")
    if not (math.isfinite(a.mass) and 1e3 <= a.mass <= 1e6):
        p.error(f"--mass = {a.mass}: allowed 1000 to 1000000")
    a.out.mkdir(parents=True, exist_ok=True)
    for name, base in SPECS.items():
        try:
            spec = spec_for(base, a.tanker, a.receiver, a.mass) if a.tanker else base
        except ConfigError as e:
            p.error(str(e))
        m = make_map(spec)
        save_map(m, name, a.out)
        print(f"{a.out / name}.npz: {len(m.y) * len(m.z)} nodes")


if __name__ == "__main__":
    main()
