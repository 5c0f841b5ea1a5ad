"""One identification flight: plant and onboard process whole, read as from a log, fitted, and compared with what was drawn."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from flightsw.icd.port import WIRE
from flightsw.process.config import FlightConfig, flight_of
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.campaign.table import mean_interval, share_interval
from hil_scripts.identify.flight.identified import Identified, identify_flight
from hil_scripts.identify.flight.model import COEFFICIENTS
from hil_scripts.identify.flight.readings import Flight, Gatherer, window
from hil_scripts.identify.flight.truth import drawn
from hil_scripts.launch import runfolder
from hil_scripts.studies.integrity.snapshot import Flying

SCENARIO = str(Path(__file__).with_name("tanker.toml"))
AIRCRAFT, FILE = "tanker", "kc135r"
ON = "tanker.excitation.on=true"
Arr = NDArray[np.float64]


def settings(case: Case) -> tuple[str, ...]:
    """What the scenario is changed by."""
    sigma = float(case.params["sigma_mps"])
    air = (f"plant.wind.dryden.sigma_mps={sigma}", "plant.wind.dryden.axes=track") if sigma > 0.0 else ()
    return (ON, *air)


def fly(seed: int, sets: tuple[str, ...]) -> tuple[Flight, Arr, FlightConfig]:
    """The flight as its log would have it, the coefficients [26] it was flown with, its flight file. Raises ConfigError,
    AircraftLostError."""
    plan = runfolder.resolve(SCENARIO, seed, list(sets), None)
    cfg = flight_of(plan.flights[0].config, AIRCRAFT)
    flight, g = Flying(SCENARIO, seed, sets, WIRE), Gatherer(cfg, load_aircraft(FILE))
    while not flight.server.done:
        received, (reply,), (telemetry,) = flight.tick_heard()
        g.take(received, reply, b"".join(telemetry))
    truth = drawn(plan.scenario, seed, AIRCRAFT, load_aircraft(FILE))
    assert truth is not None
    return g.flight(f"seed {seed}"), truth, cfg


def values(found: Identified, truth: Arr) -> dict[str, float]:
    """Of each coefficient whether it is identified, alone or with others; where it is, whether its interval holds the truth, and
    how wide it is."""
    out = {"steps": float(found.fit.steps), "coloured": float(len(found.coloured))}
    for k, t in zip(COEFFICIENTS, found.verdict.told, strict=True):
        true = float(t.weights @ truth)
        out |= {f"{k}.alone": float(t.identified and " " not in t.name), f"{k}.identified": float(t.identified)}
        out |= {f"{k}.holds": float(t.holds(truth)), f"{k}.off_sigma": (t.value - true) / t.sigma}
        if true:
            out[f"{k}.half_pct"] = 100.0 * t.half / abs(true)
    return out


def run_case(case: Case, seed: int) -> RunResult:
    """One flight of one seed. Raises ConfigError for one that is not identified from."""
    f, truth, cfg = fly(seed % 2**31, settings(case))
    found = identify_flight(f, load_aircraft(FILE), *window(f, None), cfg.tables)
    return RunResult(values(found, truth))


def pooled(runs: Sequence[Mapping[str, float]]) -> dict[str, float | int | None]:
    """Of a case: share of the identified whose 95 % interval holds the truth, over all coefficients and runs, with the interval
    of a share, and with that over runs (the coefficients of one flight share its noise); then coefficient by coefficient."""
    out: dict[str, float | int | None] = {"n": len(runs)}
    shares, hits, all_ = [], 0.0, 0
    for r in runs:
        mine = [r[f"{k}.holds"] for k in COEFFICIENTS if r[f"{k}.identified"]]
        shares.append(float(np.mean(mine)) if mine else math.nan)
        hits, all_ = hits + sum(mine), all_ + len(mine)
    wilson = share_interval([1.0] * round(hits) + [0.0] * (all_ - round(hits)))
    out |= {"coverage": hits / all_ if all_ else None, "identified_per_run": all_ / len(runs)}
    out["coverage_wilson_lo"], out["coverage_wilson_hi"] = wilson or (None, None)
    over_runs = mean_interval([s for s in shares if math.isfinite(s)])
    out["coverage_runs_lo"], out["coverage_runs_hi"] = over_runs or (None, None)
    for k in COEFFICIENTS:
        those = [r for r in runs if r[f"{k}.identified"]]
        out[f"{k}.identified"], out[f"{k}.alone"] = len(those), int(sum(r[f"{k}.alone"] for r in runs))
        out[f"{k}.coverage"] = float(np.mean([r[f"{k}.holds"] for r in those])) if those else None
        out[f"{k}.off_sigma_rms"] = math.sqrt(float(np.mean([r[f"{k}.off_sigma"] ** 2 for r in runs])))
        halves = [r[f"{k}.half_pct"] for r in runs if f"{k}.half_pct" in r]
        out[f"{k}.half_pct"] = float(np.median(halves)) if halves else None
    return out
