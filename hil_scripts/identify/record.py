"""The aircraft file, the flight files and the scenarios of an identified aircraft."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

from flightsw.aircraft import Aircraft
from flightsw.files import write_whole
from flightsw.strict import read_toml, to_dict
from hil_scripts.identify.bench import Bench, Point
from hil_scripts.identify.engines import HEIGHTS_M, MACHS
from hil_scripts.identify.limits import ALPHA_SHARE, Flown
from hil_scripts.identify.regress import Equation
from hil_scripts.launch import tomlout
from hil_scripts.launch.places import PARAMS
from sim_plant.scenario import HERE as SCENARIOS

ORDER = ("CL", "CD", "Cm", "CY", "Cl", "Cn")
DIGITS = 7
ALT_M, ALT_INT_MS = (
    1.5,
    8.0,
)  # [m], [m s] Bryson weights of the tanker's height: the KC-135R's let an MD-11 go 2.2 m in light air
NOTHING = 1e-9  # a coefficient no larger is none


def rounded(v: Any) -> Any:
    """A tree with its numbers to DIGITS digits."""
    if isinstance(v, dict):
        return {k: rounded(x) for k, x in v.items()}
    if isinstance(v, (list, tuple)):
        return [rounded(x) for x in v]
    return float(f"{v:.{DIGITS}g}") if isinstance(v, float) else v


def _scaled(v: Any, by: float) -> Any:
    return [_scaled(x, by) for x in v] if isinstance(v, (list, tuple)) else v * by


def aero(fitted: dict[str, Equation], thrust_cm: float) -> dict[str, float]:
    """[aero]: what was fitted, nothing for what is nothing, the thrust's moment in Cm0."""
    found = {k: v for name in ORDER for k, v in fitted[name].values.items()}
    found["Cm0"] += thrust_cm
    return {k: (v if abs(v) > NOTHING else 0.0) for k, v in found.items()}


def aircraft_tree(
    name: str, bench: Bench, like: Aircraft, coefficients: dict[str, float], engine: dict[str, Any],
    travel: dict[str, tuple[float, float]], limits: Flown,
) -> dict[str, Any]:  # fmt: skip
    """The file as a tree; geometry of `like` that JSBSim has none of is scaled by the span, its boom is not."""
    tree, st = to_dict(like), bench.stock
    by = bench.b_m / like.geometry.b_m
    capacity = sum(st.tanks_kg)
    fuels = (0.0, 0.5 * capacity, capacity)
    columns = list(zip(*(bench.inertia(f) for f in fuels), strict=True))
    tree["meta"] = {"name": name}
    tree["geometry"] = {"S_m2": bench.S_m2, "b_m": bench.b_m, "c_m": bench.c_m}
    tree["mass"] = {
        "empty_kg": st.empty_kg, "max_kg": st.empty_kg + capacity, "fuel_capacity_kg": capacity,
        "default_fuel_kg": bench.c.fuel_kg,
    }  # fmt: skip
    tree["inertia"] = {"mass_kg": [st.empty_kg + f for f in fuels]} | {
        f"{k}_kgm2": list(c) for k, c in zip(("Ixx", "Iyy", "Izz", "Ixz"), columns, strict=True)
    }
    order = list(tree["aero"])
    tree["aero"] = {k: coefficients[k] for k in order}
    tree["engine"] = engine
    for k in ("stall", "mach", "balance"):
        tree.pop(k, None)
    for surface, ends in travel.items():
        tree["controls"][f"{surface}_deg"] = [math.degrees(x) for x in ends]
    tree["limits"] |= {
        "alpha_max_deg": ALPHA_SHARE * math.degrees(limits.alpha_top), "V_min_mps": limits.V_min_mps,
        "V_max_mps": limits.V_max_mps,
    }  # fmt: skip
    tree["structure"]["bars"] = _scaled(tree["structure"]["bars"], by)
    tree["wake"] = {k: _scaled(v, by) for k, v in tree["wake"].items()}
    for probe in tree["probe"]:
        probe["position_m"] = _scaled(probe["position_m"], by)
    return tree


def engine_table(
    bench: Bench, table: list[list[float]], idle: float, tau_s: float, consumption: float
) -> dict[str, Any]:
    """[engine] from full thrust [N] at MACHS and HEIGHTS_M."""
    static = table[0][0]
    cg = bench.centre_m(bench.c.fuel_kg)
    return {
        "static_thrust_N": static, "lapse": "table", "idle_frac": max(idle, 0.0), "tau_s": tau_s, "tsfc_kgpNs": consumption,
        "y_m": [y - cg[1] for _, y, _ in bench.stock.thrusters_m], "lapse_mach": list(MACHS), "lapse_h_m": list(HEIGHTS_M),
        "lapse_frac": [[x / static for x in row] for row in table],
    }  # fmt: skip


def with_notes(text: str, head: list[str], notes: dict[str, str]) -> str:
    """A TOML text with comments before it and behind keys of [aero]."""
    lines, table = [f"# {x}".rstrip() for x in head] + [""], ""
    for line in text.splitlines():
        if m := re.fullmatch(r"\[+(.+?)\]+", line):
            table = m.group(1)
        key = line.partition(" = ")[0]
        lines.append(f"{line} # {notes[key]}" if table == "aero" and key in notes else line)
    return "\n".join(lines) + "\n"


def flight_tree(name: str, file: str, trim: Point, height_m: float, limits: Flown) -> dict[str, Any]:
    """The tanker's flight file for the aircraft: masses and thrust by the file, speeds and height of the condition."""
    tree = read_toml(PARAMS / f"{name}.toml")
    tree["app"]["aircraft"] = file
    lo = max(trim.V - 15.0, limits.V_min_mps)
    hi = min(trim.V + 5.0, limits.V_max_mps)
    tree["ctrl"]["w_input"][3] = 0.0
    tree["ctrl"]["w_alt_m"], tree["ctrl"]["w_int"][1] = ALT_M, ALT_INT_MS
    tree["ctrl"]["schedule"] |= {"mass_kg": 0.0, "V_mps": [lo, hi], "h_m": height_m}
    tree["guid"] |= {"V_mps": trim.V, "alt_m": height_m}
    return tree


def flight_tree_of_receiver(file: str) -> dict[str, Any]:
    """The receiver's flight file for this tanker, whose mass is that of its file."""
    tree = read_toml(PARAMS / "receiver.toml")
    tree["tanker"] = file
    return tree


def _model(tree: dict[str, Any], source: str, file: str, trim: Point, height_m: float) -> None:
    tanker = next(a for a in tree["aircraft"] if a["name"] == "tanker")
    tanker |= {"file": file, "model": "jsbsim", "plant": {"source": source}}
    tanker.pop("aero_error_frac", None)
    tanker["start"] |= {"pos_n_m": [0.0, 0.0, -height_m], "V_mps": trim.V}


def racetrack_tree(source: str, file: str, trim: Point, height_m: float) -> dict[str, Any]:
    """A scenario: the aircraft alone on the tanker's racetrack in the refuelling's wind and light turbulence."""
    tree = tomllib.loads((SCENARIOS / "refueling.toml").read_text())
    out = {k: tree[k] for k in ("clock", "noise", "link")}
    out["link"] = {k: v for k, v in out["link"].items() if not k.startswith("radio")}
    tree["meta"] |= {"name": "racetrack", "purpose": f"JSBSim's {source} on a racetrack by its identified file"}
    wind = {k: tree["wind"][k] for k in ("prevailing", "sounding")}
    wind["dryden"] = {"level": "light", "axes": "track"}
    bounds = {"run.outcome": "completed", "wind.tanker.magnitude_rms_pct": 2.0, "wind.tanker.direction_rms_deg": 1.2}
    out = {"meta": tree["meta"], **out, "aircraft": [tree["aircraft"][0]], "wind": wind, "expect": bounds}
    _model(out, source, file, trim, height_m)
    return out


def refueling_tree(source: str, file: str, trim: Point, height_m: float) -> dict[str, Any]:
    """The refuelling with the aircraft as its tanker."""
    tree = tomllib.loads((SCENARIOS / "refueling.toml").read_text())
    tree["meta"] |= {"purpose": f"the refuelling behind JSBSim's {source}"}
    _model(tree, source, file, trim, height_m)
    return tree


def write(path: Path, tree: dict[str, Any]) -> None:
    """As TOML. Raises OSError."""
    write_whole(path, tomlout.dumps(rounded(tree)))
