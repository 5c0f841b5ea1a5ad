"""Every bound of every scenario can fail: held against the figures of sound flights it passes, against those of a plausible fault
it does not, on each side it has.

`flown.toml`: least and most of each judged figure over sound flights in lockstep.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ground.metrics import compute
from hil_scripts.launch import verdict
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.places import SCENARIOS
from hil_scripts.launch.runfolder import make_folder, resolve

FLOWN = tomllib.loads(Path(__file__).with_name("flown.toml").read_text())
Fault = tuple[str, Callable[[float], float]]

# key -> what may go wrong, and what it does to the figure
FAULTS: tuple[tuple[str, tuple[Fault, ...]], ...] = (
    (r"nees3", (("errors twice what the filter says", lambda v: 4.0 * v),  # one meeting is few independent errors
                ("sigma grown to five times", lambda v: v / 25.0))),
    (r"nees|nis|gamma", (("errors twice what the filter says", lambda v: 4.0 * v),
                         ("errors half what the filter says", lambda v: v / 4.0))),
    (r"inside_2sigma", (("errors three times what the filter says", lambda v: 100.0 - 100.0 * math.exp(-2.0 / 9.0)),
                        ("errors a third of what the filter says", lambda v: 100.0))),
    (r"magnitude_rms", (("wind wrong by 1 m/s of 15", lambda v: 6.7),)),
    (r"direction_rms", (("wind wrong by 1 m/s of 15", lambda v: 3.8),)),
    (r"contact\.time_s", (("contact lost for a minute", lambda v: v - 60.0), ("counted from closing in on", lambda v: v + 60.0))),
    (r"inside_envelope|available|valid_pct", (("a tenth of the time not", lambda v: 0.9 * v),)),
    (r"threshold", (("detector made deaf: 1e-9 instead of 1e-5", lambda v: 41.4), ("made nervous: 1e-3", lambda v: 13.8))),
    (r"exclusions|dropped|slips|alarms|refused", (("one", lambda v: v + 1.0),)),
    (r"reduction_pct", (("alleviation without effect", lambda v: 0.0),)),
    (r"scale_mean", (("turbulence taken for twice its strength", lambda v: 2.0 * v), ("for half", lambda v: 0.5 * v))),
    (r"(lift|drag)_scale", (("5 % too much learnt", lambda v: v + 0.05), ("5 % too little", lambda v: v - 0.05))),
    (r"height_min", (("escape 15 m lower", lambda v: v - 15.0),)),
    (r"speed_min", (("escape 15 m/s slower", lambda v: v - 15.0),)),
    (r"apart_s", (("the monitor accuses for 2 s", lambda v: v + 2.0),)),
    (r"done", (("no turn", lambda v: 0.0), ("two", lambda v: 2.0))),
    (r"rendezvous\.[xy]_m", (("turn 2 min late", lambda v: v + 24_000.0), ("turn 2 min early", lambda v: v - 24_000.0))),
    (r"closing_mps", (("rolls out 50 m/s fast", lambda v: v + 50.0), ("or slow", lambda v: v - 50.0))),
    (r"bank_max", (("10 deg more bank than asked", lambda v: v + 10.0),)),
    (r"height_error_max", (("height held to 15 m", lambda v: 15.0),)),
    (r"join\.(joinup|contact)_at|join\.duration", (("5 min late", lambda v: v + 300.0), ("handed over at once", lambda v: 0.0))),
    (r"closure_max", (("closing 10 m/s faster", lambda v: v + 10.0),)),
    (r"wake_clearance", (("through the wake", lambda v: 5.0),)),
    (r"forward_max", (("overrun by 50 m", lambda v: v + 50.0),)),
    (r"burned_to_boom", (("burns twice", lambda v: 2.0 * v), ("or half", lambda v: 0.5 * v))),
    (r"gained_in_contact", (("fuel flows for a minute more", lambda v: v + 150.0), ("or less", lambda v: v - 150.0))),
    (r"rms|p95", (("three times the error", lambda v: 3.0 * v),)),
)  # fmt: skip


def bounds(scenario: str) -> dict[str, Any]:
    """[expect] of a scenario, flat."""
    return verdict.flatten(tomllib.loads((SCENARIOS / f"{scenario}.toml").read_text())["expect"])


CASES = [(s.stem, key) for s in sorted(SCENARIOS.glob("*.toml")) for key in bounds(s.stem)]


def sides(bound: Any) -> tuple[float, float]:
    """Lower and upper end of a bound, infinite where it has none."""
    if isinstance(bound, dict):
        return float(bound.get("min", -math.inf)), float(bound.get("max", math.inf))
    return (float(bound[0]), float(bound[1])) if isinstance(bound, list) else (-math.inf, float(bound))


def holds(scenario: str, key: str, value: Any) -> bool:
    (check,) = verdict.evaluate({key: bounds(scenario)[key]}, {key: value})
    return check.ok


@pytest.mark.parametrize(("scenario", "key"), CASES)
def test_it_holds_in_sound_flights(scenario: str, key: str) -> None:
    flown = FLOWN[scenario][key]
    for value in flown if isinstance(flown, list) else [flown]:
        assert holds(scenario, key, value), value


@pytest.mark.parametrize(("scenario", "key"), CASES)
def test_it_fails_under_a_fault_on_each_side(scenario: str, key: str) -> None:
    bound, flown = bounds(scenario)[key], FLOWN[scenario][key]
    assert not holds(scenario, key, None)  # nobody measured it
    if isinstance(bound, str | bool):
        other = {"completed": "lost", True: False, False: True}[bound]
        assert not holds(scenario, key, other)
        return
    assert not holds(scenario, key, math.nan)
    faults = next(f for pattern, f in FAULTS if re.search(pattern, key))
    made = [make(v) for _, make in faults for v in flown]
    lo, hi = sides(bound)
    assert lo == -math.inf or min(made) < lo, f"no fault gets below {lo:g} from {flown}"
    assert hi == math.inf or max(made) > hi, f"no fault gets above {hi:g} from {flown}"


@pytest.mark.parametrize("scenario", sorted(FLOWN))
def test_nothing_is_recorded_that_is_not_judged(scenario: str) -> None:
    assert set(FLOWN[scenario]) == set(bounds(scenario))


def test_no_share_is_bounded_by_what_it_cannot_pass() -> None:
    """A percentage that may be 0 to 100 is no bound, nor is one from below at 0."""
    for scenario, key in CASES:
        bound = bounds(scenario)[key]
        if key.endswith("_pct") or "_pct." in key:
            lo, hi = sides(bound)
            assert lo != 0.0 and hi != 100.0, (scenario, key)


@pytest.mark.parametrize(
    ("sets", "violated"),
    [
        ([], set()),
        (["receiver.airdata.on=false"], {"threshold", "exclusions"}),  # no detection, no figures of it
        (["receiver.airdata.fdi.p_alarm=1e-9"], {"threshold"}),
        (["receiver.airdata.fdi.p_alarm=1e-2"], {"threshold"}),
    ],
    ids=["as shipped", "off", "deaf", "nervous"],
)
def test_the_air_data_flight_is_judged_by_its_fault_detection(
    sets: list[str], violated: set[str], tmp_path: Path
) -> None:
    """The first seconds of it, with the detection as shipped, off, deaf and nervous."""
    plan = resolve("airdata", 1, sets, 4.0)
    run = make_folder(plan, tmp_path / "run")
    flight = InProcess(plan, run)
    while not flight.server.done:
        flight.tick()
    flight.finish()
    judged = {k: v for k, v in bounds("airdata").items() if k in ("airdata.fdi.threshold", "airdata.fdi.exclusions")}
    checks = verdict.evaluate(judged, compute(run))
    assert {c.key.rpartition(".")[2] for c in checks if not c.ok} == violated
