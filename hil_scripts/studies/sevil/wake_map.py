"""Wake maps: what the three probes read at every node of a grid of relative positions, at one attitude.

    python -m hil_scripts.studies.sevil.wake_map make --out DIR [--flight receiver_airdata --theta DEG --name NAME ...]
    python -m hil_scripts.studies.sevil.wake_map import FILE.csv --out DIR
    python -m hil_scripts.studies.sevil.wake_map score --map NAME|FILE.toml [--noise N]

`make` writes maps of the wake model, `small` (441 nodes) and `extended` (1533 nodes) if no grid is named; `import` one of
somebody's own (map_table.py has the form); `score` tells what the algorithms make of a map's own readings. A map is .npz (the
readings) and .toml (provenance: parameters, grid, attitude, hashes). Without aircraft or flight file the wake and probe geometry
are those of sevil.md section 4: so are `small` and `extended` of flightsw/missions/receiver/airdata/maps. The same parameters
give the same bytes.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.airdata_params import AirDataParams
from flightsw.missions.receiver.airdata.contour.wake_map import V3, Axis, MapSpec, WakeMap, load_map, parameter_text
from flightsw.missions.receiver.airdata.wake_kernel import probe_readings
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_params_of, wake_vector
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError, convert
from hil_scripts.launch.places import PARAMS
from hil_scripts.studies.sevil.map_score import score
from hil_scripts.studies.sevil.map_table import read_table

Arr = NDArray[np.float64]
SPECS = {
    "small": MapSpec(Axis(-2.0, 0.2, 21), Axis(6.5, 0.2, 21)),
    "extended": MapSpec(Axis(-4.0, 1.0, 73), Axis(-6.0, 1.0, 21)),
}
HOLDS = ("x_m", "V_mps", "rho_kgpm3", "psi_deg", "theta_deg", "phi_deg")  # of MapConditions, options of `make`


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


def save_map(m: WakeMap, name: str, folder: Path, table: Path | None = None) -> None:
    """Write `name`.npz and `name`.toml into `folder`; table: the file it was imported from. Same map, same bytes."""
    data = folder / f"{name}.npz"
    np.savez(data, y=m.y, z=m.z, readings=m.readings)
    text = parameter_text(m.spec)
    head = (
        "# Wake map written by `python -m hil_scripts.studies.sevil.wake_map`; do not edit.\n"
        f'name = "{name}"\n'
        f"nodes = {len(m.y) * len(m.z)}\n"
        f'parameters_sha256 = "{_sha256(text.encode())}"\n'
        f'data_sha256 = "{_sha256(data.read_bytes())}"\n'
    )
    if table is not None:
        head += f'table_sha256 = "{_sha256(table.read_bytes())}"\n'
    body = "\n".join(f"[parameters.{line[1:]}" if line.startswith("[") else line for line in text.splitlines())
    (folder / f"{name}.toml").write_text(f"{head}\n[parameters]\n{body}\n", encoding="utf-8")


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def spec_for(base: MapSpec, tanker: str, receiver: str, mass_kg: float) -> MapSpec:
    """`base` with wake and probes of two aircraft records; the receiver must have three probes (nose, left, right).

    Raises ConfigError if it has not, or if a record does not exist.
    """
    return replace(base, wake=wake_params_of(load_aircraft(tanker), mass_kg), probes_m=_probes(receiver))


def spec_of_flight(base: MapSpec, flight: str) -> MapSpec:
    """`base` with the wake a receiver's flight file (a name in flightsw/params, or a path) believes in, and the probes of its
    aircraft. Raises ConfigError."""
    cfg = load_flight(Path(flight) if Path(flight).suffix else PARAMS / f"{flight}.toml")
    p = convert(cfg.tables.get("airdata", {}), AirDataParams, f"{flight}: airdata")
    return replace(base, wake=p.wake, probes_m=_probes(cfg.app.aircraft))


def _probes(receiver: str) -> tuple[V3, V3, V3]:
    ac = load_aircraft(receiver)
    if len(ac.probe) != 3:
        raise ConfigError(f"{receiver}: probe: {len(ac.probe)} entries; allowed: 3")
    a, b, c = (p.position_m for p in ac.probe)
    return a, b, c


def _make(a: argparse.Namespace) -> None:
    """Command `make`. Raises ConfigError."""
    if bool(a.tanker) != bool(a.receiver):
        raise ConfigError("--tanker and --receiver: give both or neither")
    if a.tanker and a.flight:
        raise ConfigError("--flight: allowed without --tanker and --receiver")
    if not (math.isfinite(a.mass) and 1e3 <= a.mass <= 1e6):
        raise ConfigError(f"--mass = {a.mass}: allowed 1000 to 1000000")
    if a.name and not a.grid:
        raise ConfigError("--name: allowed with --grid")
    given = {k: getattr(a, k) for k in HOLDS if getattr(a, k) is not None}
    for grid in (a.grid,) if a.grid else SPECS:
        spec = replace(SPECS[grid], **given)
        if a.flight:
            spec = spec_of_flight(spec, a.flight)
        elif a.tanker:
            spec = spec_for(spec, a.tanker, a.receiver, a.mass)
        convert(tomllib.loads(parameter_text(spec)), MapSpec, "make")  # ranges
        _store(make_map(spec), a.name or grid, a.out)


def _store(m: WakeMap, name: str, out: Path, table: Path | None = None) -> None:
    out.mkdir(parents=True, exist_ok=True)
    save_map(m, name, out, table)
    print(f"{out / name}.npz: {len(m.y) * len(m.z)} nodes")


def main(argv: list[str] | None = None) -> None:
    """Commands `make`, `import`, `score`. Exit code 2 with a message naming what is wrong."""
    top = argparse.ArgumentParser(prog="python -m hil_scripts.studies.sevil.wake_map", description="Wake maps.")
    sub = top.add_subparsers(dest="command", required=True)
    p = sub.add_parser("make", help="maps of the wake model")
    p.add_argument("--out", type=Path, required=True, help="folder for the .npz and .toml files")
    p.add_argument("--grid", choices=tuple(SPECS), help="only this grid (default: both)")
    p.add_argument("--name", help="name of the map (default: its grid's)")
    p.add_argument(
        "--flight", help="receiver's flight file whose wake and probes are used (default: sevil.md section 4)"
    )
    p.add_argument("--tanker", help="aircraft record of the tanker, instead of --flight")
    p.add_argument("--receiver", help="aircraft record whose probes are used (with --tanker)")
    p.add_argument("--mass", type=float, default=WakeParams().mass_kg, help="tanker mass [kg] (with --tanker)")
    for key in HOLDS:
        p.add_argument(f"--{key.partition('_')[0]}", dest=key, type=float, help=f"{key} the map holds for")
    p = sub.add_parser("import", help="a table of somebody's own: CFD, wind tunnel, flight")
    p.add_argument("table", type=Path, help="the .csv file, its first lines # and TOML")
    p.add_argument("--out", type=Path, required=True, help="folder for the .npz and .toml files")
    p.add_argument("--name", help="name of the map (default: that of the table's file)")
    p = sub.add_parser("score", help="what Algorithms 1 to 16 make of a map's own readings")
    p.add_argument("--map", required=True, help="name of a map that comes with the software, or path of its .toml file")
    p.add_argument("--noise", type=float, default=0.0, help="multiple of the source's noise variance, mean over 1 s")
    a = top.parse_args(argv)
    try:
        if a.command == "make":
            _make(a)
        elif a.command == "import":
            _store(read_table(a.table), a.name or a.table.stem, a.out, a.table)
        else:
            print("\n".join(score(load_map(a.map), a.noise)))
    except ConfigError as e:
        top.error(str(e))


if __name__ == "__main__":
    main()
