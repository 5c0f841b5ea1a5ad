"""Terms of sensor errors and the named grades that set them all: data files in grades/, each number 1 sigma, SI and radians.

`paper` is not a file: it is the `*_std` and `latency_ms` of the scenario's table. Another grade stands in their place.
Single terms of a scenario's table `terms` are laid over either.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from flightsw.strict import ConfigError, OneOf, Range, convert, near, read_toml

HERE = Path(__file__).parent / "grades"
PAPER = "paper"
GRADES = (PAPER, "navigation", "tactical", "mems")
Grade = Annotated[str, OneOf(GRADES)]
OwnGrade = Annotated[str, OneOf(("", *GRADES))]  # "": that of the aircraft
NonNeg = Annotated[float, Range(0.0)]
Time = Annotated[float, Range(1e-3)]

DRAWN = ("white", "gm", "tau_s", "walk", "constant")  # what needs no truth
SHAPED = ("scale", "lag_s", "quantum")  # what acts on the measured quantity
COMMON = ("common", "common_tau_s", "gradient")
# columns of a group's error row, by family, and the terms a family takes; air data repeats its columns for every probe
FAMILIES: dict[str, dict[str, tuple[tuple[int, ...], tuple[str, ...]]]] = {
    "imu": {
        "gyro": ((0, 1, 2), (*DRAWN, *SHAPED, "density", "align")),
        "acc": ((3, 4, 5), (*DRAWN, *SHAPED, "density", "align")),
    },
    "baro": {"alt": ((0,), (*DRAWN, *SHAPED, *COMMON))},
    "mag": {"field": ((0, 1, 2), (*DRAWN, *SHAPED, "align"))},
    "gnss": {
        "pos_h": ((0, 1), (*DRAWN, "quantum", *COMMON)),
        "pos_v": ((2,), (*DRAWN, "quantum", *COMMON)),
        "vel_h": ((3, 4), (*DRAWN, "lag_s", "quantum")),
        "vel_v": ((5,), (*DRAWN, "lag_s", "quantum")),
    },
    "att": {"tilt": ((0, 1), DRAWN), "heading": ((2,), DRAWN)},
    "fuel": {"mass": ((0,), (*DRAWN, *SHAPED))},
    "air": {
        "V": ((0,), (*DRAWN, *SHAPED)),
        "alpha": ((1,), (*DRAWN, *SHAPED, "friction")),
        "beta": ((2,), (*DRAWN, *SHAPED, "friction")),
    },
    "rel": {"pos": ((0, 1, 2), (*DRAWN, *SHAPED, "align")), "vel": ((3, 4, 5), (*DRAWN, *SHAPED, "align"))},
    "radalt": {"height": ((0,), (*DRAWN, *SHAPED))},
    "boom": {"angle": ((0, 1), (*DRAWN, *SHAPED)), "extension": ((2,), (*DRAWN, *SHAPED))},
}


@dataclass(frozen=True)
class Terms:
    """Errors of the columns of one family, 1 sigma, in the unit of the column (u)."""

    white: NonNeg = 0.0  # [u] per sample
    density: NonNeg = 0.0  # [u/rt-Hz] white, by the rate: angle and velocity random walk of a data sheet
    gm: NonNeg = 0.0  # [u] first-order Gauss-Markov, stationary from the start
    tau_s: Time = 100.0
    walk: NonNeg = 0.0  # [u/rt-s] random walk from zero
    constant: NonNeg = 0.0  # [u] drawn once per run
    scale: NonNeg = 0.0  # [-] factor less one, drawn once per run
    align: NonNeg = (
        0.0  # [rad] rotation about each axis, drawn once per run; of families with the same draw of a group: shared
    )
    lag_s: NonNeg = 0.0  # first-order lag
    quantum: NonNeg = 0.0  # [u] step of the output
    friction: NonNeg = (
        0.0  # [rad Pa] of a vane's bearing: over the dynamic pressure, the angle within which it stays (vane.py)
    )
    common: NonNeg = 0.0  # [u] Gauss-Markov of the constellation or the weather: the same series for every aircraft
    common_tau_s: Time = 1800.0
    gradient: NonNeg = 0.0  # [u/m] its change with place, per axis: Gauss-Markov of common_tau_s


@dataclass(frozen=True)
class Group:
    """Errors of one sensor."""

    columns: dict[str, Terms]
    latency_ms: Annotated[float, Range(0.0, 5000.0)] | None = None  # None: the scenario's
    lever_m: NonNeg = 0.0  # per body axis: what the survey of the place left over, drawn once per run
    outage_per_h: NonNeg = 0.0  # outages that begin per hour, and their mean length
    outage_s: Time = 1.0
    blocked: Annotated[float, Range(1.0)] = 1.0  # factor on own errors below another aircraft, at no distance from it


@dataclass(frozen=True)
class _Rest:
    """What a table says beside its families."""

    latency_ms: Annotated[float, Range(0.0, 5000.0)] | None = None
    lever_m: NonNeg = 0.0
    outage_per_h: NonNeg = 0.0
    outage_s: Time = 1.0
    blocked: Annotated[float, Range(1.0)] = 1.0


ONLY = {"lever_m": ("imu", "gnss"), "blocked": ("gnss",)}


@cache
def _file(grade: str) -> dict[str, Any]:
    return read_toml(HERE / f"{grade}.toml")


def source_of(grade: str, group: str) -> str:
    """Where the numbers of a group are from."""
    return str(_file(grade)[group]["source"])


def grade_of(own: str, aircraft: str) -> str:
    """Grade of a sensor: its own, else its aircraft's."""
    return own or aircraft


def group_terms(group: str, grade: str, over: dict[str, Any], at: str) -> Group | None:
    """Errors of sensor `group`: those of the grade's file with the table `over` laid over them, key by key; None: paper's alone.

    Raises ConfigError naming the key (below `at`) and what is allowed.
    """
    if grade == PAPER and not over:
        return None
    fams = FAMILIES[group]
    tree: dict[str, Any] = {} if grade == PAPER else {k: v for k, v in _file(grade)[group].items() if k != "source"}
    rest_ok = [f.name for f in fields(_Rest) if group in ONLY.get(f.name, (group,))]
    for k, v in over.items():
        if k not in fams and k not in rest_ok:
            allowed = (*fams, *rest_ok)
            raise ConfigError(f"{at}.{k}: unknown; allowed: {', '.join(allowed)}{near(k, allowed)}")
        if k not in fams:
            tree[k] = v
            continue
        if not isinstance(v, dict):
            raise ConfigError(f"{at}.{k} = {v!r}: expected a table of {', '.join(fams[k][1])}")
        for term in v:
            if term not in fams[k][1]:
                raise ConfigError(
                    f"{at}.{k}.{term}: unknown term; allowed: {', '.join(fams[k][1])}{near(term, fams[k][1])}"
                )
        tree[k] = tree.get(k, {}) | v
    columns = {k: convert(tree.get(k, {}), Terms, f"{at}.{k}") for k in fams}
    rest = convert({k: v for k, v in tree.items() if k not in fams}, _Rest, at)
    return Group(columns, rest.latency_ms, rest.lever_m, rest.outage_per_h, rest.outage_s, rest.blocked)
