"""What `sil identify SOURCE --like FILE` does: trim, differentiate, fit, measure the engines, write, check what was written."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.files import write_whole
from flightsw.strict import ConfigError
from hil_scripts.identify import fit, record
from hil_scripts.identify.bench import Bench, Condition, Point
from hil_scripts.identify.engines import Engines, Step
from hil_scripts.identify.lacks import lacks, thrust_Cm
from hil_scripts.identify.limits import Flown, flown
from hil_scripts.identify.regress import Equation
from hil_scripts.launch import tomlout
from sim_plant.aircraft.jsbsim import stock as s
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.trim import observation
from sim_plant.aircraft.sixdof.trim import trim as plant_trim
from sim_plant.kernels import layout as n

PREFIX = "jsbsim:"


@dataclass(frozen=True)
class Asked:
    """Of the command line: model, aircraft whose parts are taken, height [m], airspeed [m/s], fuel [kg] (negative: as the model
    is shipped), folder to write."""

    source: str
    like: str
    height_m: float
    V_mps: float
    fuel_kg: float
    out: Path | None


@dataclass(frozen=True)
class Found:
    """A trim with its thrust [N], the equations, the engines' answer, the limits."""

    trim: Point
    thrust_N: float
    fitted: dict[str, Equation]
    step: Step
    lever: float
    limits: Flown
    lacks: list[str]


def identify(a: Asked, console: Console) -> Path:
    """Identify a model and write its files; returns the folder. Raises ConfigError for a model that does not fly at the
    condition, with the reason, OSError for what cannot be written."""
    source = a.source.removeprefix(PREFIX)
    model, like = s.read(source), load_aircraft(a.like)
    fuel = a.fuel_kg if a.fuel_kg >= 0.0 else sum(model.contents_kg)
    if fuel > (most := sum(model.tanks_kg)):
        raise ConfigError(f"--fuel {fuel:g}: allowed for {model.name}: up to {most:.0f} kg")
    bench, engines = Bench(model, like, Condition(a.height_m, a.V_mps, fuel)), Engines(source)
    found, tree, coefficients = _measure(bench, engines, like)
    out = a.out or Path("identified") / model.name
    out.mkdir(parents=True, exist_ok=True)
    file = f"{model.name}.toml"
    head = _head(bench, found, a)
    notes = {k: f"+- {e.errors[k]:.1g}" for e in found.fitted.values() for k in e.values}
    notes["Cm0"] += f"; {thrust_Cm(bench, a.V_mps, found.thrust_N):+.5f} of it the thrust's"
    write_whole(out / file, record.with_notes(tomlout.dumps(record.rounded(tree)), head, notes))
    record.write(out / "flight_tanker.toml", record.flight_tree("tanker", file, found.trim, a.height_m, found.limits))
    receiver = record.flight_tree_of_receiver(file)
    record.write(out / "flight_receiver.toml", receiver)
    record.write(out / "racetrack.toml", record.racetrack_tree(source, file, found.trim, a.height_m))
    record.write(out / "refueling.toml", record.refueling_tree(source, file, found.trim, a.height_m))
    _show(console, bench, found, coefficients)
    _check(console, load_aircraft(str(out / file)), bench, found)
    console.print(
        f"written: {out / file}; fly it: sil run {out / 'racetrack.toml'}, sil run {out / 'refueling.toml'}",
        soft_wrap=True,
    )
    return out


def _measure(bench: Bench, engines: Engines, like: Aircraft) -> tuple[Found, dict[str, object], dict[str, float]]:
    c = bench.c
    mach, at = (
        c.V_mps / bench.sound_mps,
        f"{bench.stock.name} at {c.V_mps:g} m/s, {c.height_m:g} m, {bench.mass_kg:.0f} kg",
    )
    trim, thrust = bench.trim()
    most = engines.thrust(c.height_m, mach, 1.0)
    if not most > thrust:
        raise ConfigError(
            f"{at}: level flight needs {thrust / 1e3:.1f} kN of thrust, its engines "
            f"({', '.join(sorted(set(bench.stock.engines)))}) give {most / 1e3:.1f} kN there"
        )
    travel = engines.travel(c.height_m, mach)
    for name, angle in zip(("aileron", "elevator", "rudder"), trim.surfaces, strict=True):
        lo, hi = travel.get(name, (-math.inf, math.inf))
        if not lo < angle < hi:
            raise ConfigError(
                f"{at}: level flight needs {math.degrees(angle):.1f} deg of {name}; its travel is {math.degrees(lo):.1f} to "
                f"{math.degrees(hi):.1f} deg"
            )
    try:
        fitted = fit.derivatives(bench, trim)
    except ValueError as e:
        raise ConfigError(f"{bench.stock.name}: {e}") from None
    lever = engines.lever_for(c.height_m, mach, thrust)
    step, limits = engines.step(c.height_m, mach, lever), flown(bench, engines, trim)
    if not limits.V_min_mps <= c.V_mps <= limits.V_max_mps:
        raise ConfigError(f"{at}: allowed: {limits.V_min_mps:.0f} to {limits.V_max_mps:.0f} m/s")
    idle = engines.thrust(c.height_m, mach, 0.0) / most
    used = engines.consumption(c.height_m, mach, lever)
    engine = record.engine_table(bench, engines.table(), idle, step.up_63_s, used)
    coefficients = record.aero(fitted, thrust_Cm(bench, c.V_mps, thrust))
    tree = record.aircraft_tree(bench.stock.name, bench, like, coefficients, engine, travel, limits)
    short = lacks(bench, trim, thrust, fitted, step, like, limits.alpha_top)
    return Found(trim, thrust, fitted, step, lever, limits, short), tree, coefficients


def _head(bench: Bench, f: Found, a: Asked) -> list[str]:
    """Comments of the aircraft file."""
    st, e, deg = bench.stock, f.trim.surfaces[1], math.degrees
    box = (
        f"alpha +-{deg(fit.ALPHA):.0f}, beta +-{deg(fit.BETA):.0f} deg about it, surfaces +-{deg(fit.SURFACE):.1f} deg"
    )
    rates = ", ".join(str(x) for x in fit.RATES)
    out = [
        f"JSBSim's {st.name}, identified at {a.height_m:g} m, {a.V_mps:g} m/s, {bench.mass_kg:.0f} kg; clean, bare airframe.",
        f"SHA-256 of the airframe as flown: {st.digest}",
        f"Trim: alpha {deg(f.trim.alpha):.3f}, elevator {deg(e):.3f} deg, thrust {f.thrust_N / 1e3:.2f} kN, lever {f.lever:.2f}.",
        f"Fitted to {fit.POINTS} points: {box}, rates +-{rates} rad/s; CD without sideslip, with the trim's elevator.",
        "Behind each derivative its standard error. What is left of each coefficient, RMS, and the share explained:",
    ]
    out += [f"  {k}: {f.fitted[k].rms:.2g}, {100 * f.fitted[k].r2:.2f} %" for k in record.ORDER]
    return [*out, "What this form cannot hold:", *(f"  {x}" for x in f.lacks)]


def _show(console: Console, bench: Bench, f: Found, coefficients: dict[str, float]) -> None:
    console.print(
        f"{bench.stock.name}, {bench.mass_kg:.0f} kg: alpha {math.degrees(f.trim.alpha):.2f} deg, elevator "
        f"{math.degrees(f.trim.surfaces[1]):.2f} deg, thrust {f.thrust_N / 1e3:.1f} kN, lever {f.lever:.2f}; level flight from "
        f"{f.limits.V_min_mps:.0f} to {f.limits.V_max_mps:.0f} m/s",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    table = Table("derivative", "value", "standard error", "RMS left", "explained")
    for name in record.ORDER:
        e = f.fitted[name]
        for i, k in enumerate(e.values):
            left = (f"{e.rms:.2g}", f"{100 * e.r2:.2f} %") if i == 0 else ("", "")
            table.add_row(k, f"{coefficients[k]:.5g}", f"{e.errors[k]:.1g}", *left, end_section=i == len(e.values) - 1)
    console.print(table)
    console.print("what the form cannot hold:")
    for x in f.lacks:
        console.print(f"  {x}", highlight=False, soft_wrap=True)


def _check(console: Console, ac: Aircraft, bench: Bench, f: Found) -> None:
    """The trim by the file that was written beside JSBSim's. Raises ConfigError if the file has none."""
    c, none = bench.c, np.zeros(n.NW)
    par = parameter_vector(ac)
    t = plant_trim(np.array([0.0, 0.0, -c.height_m]), np.array([c.V_mps, 0.0, 0.0]), none, c.fuel_kg, par)
    alpha = float(observation(t, none, par)[n.O_ALPHA]) - f.trim.alpha
    elevator, thrust = float(t[n.S_SURF + 1]) - f.trim.surfaces[1], float(t[n.S_T]) / f.thrust_N - 1.0
    console.print(
        f"trim by the file: alpha {math.degrees(alpha):+.3f} deg, elevator {math.degrees(elevator):+.3f} deg, thrust "
        f"{100 * thrust:+.2f} % of JSBSim's",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
