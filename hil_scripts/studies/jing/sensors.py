"""The campaign `jing_sensors`: sensors of a grade, fixed errors, an engine, faults; each with an aircraft other than believed."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import cache

from flightsw.strict import read_toml
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.launch.places import PARAMS
from hil_scripts.studies.jing.draw import draw
from hil_scripts.studies.jing.sensor_faults import FAULTS, FIXED, SLOPE_M, Fault, Fixed
from hil_scripts.studies.jing.sensor_flight import CLEAN, DT, OTHER_AIRCRAFT, PLANT, WHO, SensorFlight
from sim_plant.failures.script import Event

BURST_S, CLEAN_S = 110.0, 85.0
PAPER = (f"{WHO}.nav.states=26", f"{WHO}.nav.trust.on=true")  # the filter with error states on the source's sensors
# tables of the flight file `windshear`, by which both fly
GUIDANCE = ("guid.hazard", "guid.approach", "guid.escape", "guid.engine_out", "ctrl")
FAULT_S, ENGINE_S = 25.0, 30.0


def settings(sensors: str, *more: str) -> tuple[str, tuple[str, ...]]:
    """Scenario and settings of a flight with `sensors` "tactical", or "paper", which the same filter flies."""
    if sensors == "paper":
        return "windshear_paper", (*PAPER, *_guidance(), *OTHER_AIRCRAFT, *more)
    return "windshear", (*OTHER_AIRCRAFT, *more)


@cache
def _guidance() -> tuple[str, ...]:
    """Settings of guidance and control as in the flight file `windshear`: between sensors only sensors differ."""
    file = read_toml(PARAMS / "windshear.toml")
    tables = {**file, **{f"guid.{t}": v for t, v in file["guid"].items()}}
    return tuple(f"{WHO}.{t}.{key}={json.dumps(v)}" for t in GUIDANCE for key, v in tables[t].items())


def drawn(seed: int) -> tuple[str, ...]:
    """Settings of the microburst and the start of run `seed`."""
    burst, start = draw(seed)
    table = {
        "outflow_mps": burst.outflow_mps, "radius_m": burst.radius_m, "outflow_height_m": burst.outflow_height_m,
        "offset_m": burst.offset_m,
    }  # fmt: skip
    return (
        *(f"{PLANT}burst.{key}={value!r}" for key, value in table.items()),
        f"plant.aircraft.{WHO}.start.pos_n_m=[-4500.0, 0.0, {-start.height_m!r}]",
    )


def run_drawn(case: Case, seed: int) -> RunResult:
    """A drawn microburst: one flight up to the alert, and from there on every law of the case on the same luck."""
    p, seed = case.params, seed % 2**31
    trunk = SensorFlight(*_of(p["sensors"], seed, *drawn(seed)))
    trunk.fly(BURST_S, "near")
    values: dict[str, float] = {}
    for law in p["laws"]:
        flight = trunk.branch()
        flight.mission.guidance.choose(law)
        flight.fly(BURST_S, "safe")
        got = flight.figures()
        values[f"{law}.survived"] = 1.0 - got["lost"]
        values |= {f"{law}.{key}": got[key] for key in ("height_min_m", "speed_min_mps")}
        if law == p["laws"][0]:
            values |= {key: v for key, v in got.items() if key.startswith(("w_", "h.", "nis", "abort"))}
            values["distrusted"] = float(math.isfinite(flight.seen.first("estimate not trusted")))
    return RunResult(values)


def run_clean(case: Case, seed: int) -> RunResult:
    """An approach in light turbulence and no microburst."""
    flight = SensorFlight(*_of(case.params["sensors"], seed % 2**31, *CLEAN))
    flight.fly(CLEAN_S, "far")
    got = flight.figures()
    got["announced"] = float(math.isfinite(flight.seen.announced(0.0)))
    return RunResult(got, flight.traces())


def run_fixed(case: Case, seed: int) -> RunResult:
    """Every fixed error on the same luck, and how far its flight is from the one without."""
    p, seed = case.params, seed % 2**31
    still = CLEAN if p["air"] == "clean" else ()
    values: dict[str, float] = {}
    base: dict[str, float] = {}
    for name in ("none", *p["errors"]):
        fixed: Fixed | None = FIXED.get(name)
        flight = SensorFlight(*_of("tactical", seed, *still))
        for event in fixed.events if fixed else ():
            flight.inject(event)
        flight.fly(CLEAN_S if still else BURST_S, "far" if still else "safe")
        got = flight.figures()
        base = base or got
        values |= {f"{name}.{key}": got[key] for key in ("lost", "aborted", "height_min_m", "slope_max_m", "w_h.rms")}
        for key in ("height_min_m", "slope_max_m"):
            values[f"{name}.{key}.apart"] = abs(got[key] - base[key])
    return RunResult(values)


def run_engine(case: Case, seed: int) -> RunResult:
    """One engine stops in the severe microburst, at the abort or at a fixed time."""
    flight = SensorFlight(*_of("tactical", seed % 2**31))
    at = case.params["at"]
    flight.fly(BURST_S if at == "abort" else ENGINE_S, "given_up" if at == "abort" else "")
    t = flight.t_s
    flight.inject(Event(t, "engine_off", WHO, index=0))
    flight.fly(BURST_S)
    got = flight.figures()
    got["announced_s"] = flight.seen.first("engine out") - t
    got["in_time"] = float(got["announced_s"] <= 3.0)
    return RunResult(got, flight.traces())


def run_fault(case: Case, seed: int) -> RunResult:
    """One fault of one sensor on the clean and on the severe case: lost, off the slope, announced, or harmless."""
    fault: Fault = FAULTS[case.params["fault"]]
    values: dict[str, float] = {}
    for air, still in (("clean", CLEAN), ("severe", ())):
        flight = SensorFlight(*_of("tactical", seed % 2**31, *still))
        flight.fly(FAULT_S)
        flight.inject(fault.event(flight.t_s))
        flight.fly(CLEAN_S if still else BURST_S, "far" if still else "safe")
        got, said = flight.figures(), flight.seen.announced(FAULT_S)
        gone = got["aborted"] > 0.0 and bool(still)
        harm = got["lost"] > 0.0 or got["slope_max_m"] > SLOPE_M or gone
        loss_s = len(flight.seen.truth) * DT if got["lost"] > 0.0 else math.inf
        values |= {f"{air}.{key}": got[key] for key in ("lost", "height_min_m", "slope_max_m", "aborted")}
        values[f"{air}.announced"] = float(said < loss_s)
        values[f"{air}.harmless"] = float(not harm)
        values[f"{air}.silent"] = float(harm and not said < loss_s)
        if math.isfinite(said):
            values[f"{air}.after_s"] = said - FAULT_S
    return RunResult(values)


def _of(sensors: str, seed: int, *more: str) -> tuple[str, int, tuple[str, ...]]:
    scenario, changes = settings(sensors, *more)
    return scenario, seed, changes


RUN: dict[str, Callable[[Case, int], RunResult]] = {
    "drawn": run_drawn, "clean": run_clean, "fixed": run_fixed, "engine": run_engine, "fault": run_fault,
}  # fmt: skip


def run_case(case: Case, seed: int) -> RunResult:
    """One run of the kind the case is of."""
    return RUN[case.params["kind"]](case, seed)


STUDY = Study(
    name="jing_sensors",
    title="Windshear with sensors as they are",
    purpose="drawn microbursts and clean approaches with sensors of the grade tactical and an aircraft of 5 % less lift, 5 % "
    "more drag and 10 % less pitching moment than believed; fixed errors, one engine out, faults of every sensor",
    cases=(
        Case("drawn_tactical", {"kind": "drawn", "sensors": "tactical", "laws": ["managed", "pitch"]}),
        Case("drawn_paper", {"kind": "drawn", "sensors": "paper", "laws": ["managed"]}),
        Case("clean_tactical", {"kind": "clean", "sensors": "tactical"}),
        Case("clean_paper", {"kind": "clean", "sensors": "paper"}),
        *(Case(f"fixed_{air}", {"kind": "fixed", "air": air, "errors": list(FIXED)}) for air in ("clean", "severe")),
        *(Case(f"engine_{at}", {"kind": "engine", "at": at}) for at in ("abort", "30s")),
        *(Case(f"fault_{name}", {"kind": "fault", "fault": name}) for name in FAULTS),
    ),
    run=run_case,
    default_runs=20,
    small_cases=("drawn_*", "clean_*", "fixed_severe", "engine_*", "fault_*_lost"),
    binary=(
        "lost", "survived", "aborted", "announced", "harmless", "silent", "in_time", "distrusted",
    ),
)  # fmt: skip
