"""What a study is: named cases and one function that makes one run of one case from a seed."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import near
from hil_scripts.campaign.error import CampaignError as CampaignError

SHOWN = 20  # cases named where one is refused
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")  # names become file and folder names


@dataclass(frozen=True)
class Case:
    """One setting of a study; `params` holds plain JSON values (SI, keys end in the unit)."""

    name: str
    params: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class RunResult:
    """What one run gives.

    values: flat dotted keys to scalars, SI unless the key names another unit, for example
        "default.wind.magnitude_rms_pct". NaN and infinity are kept in the table and left out of the statistics.
    traces: small arrays for pictures, for example t [N] s, wind_true [N,3] m/s NED; kept for run 0 of each case.
    """

    values: dict[str, float]
    traces: dict[str, NDArray[Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A campaign's definition.

    run(case, seed) must be a module-level function that depends on nothing but its arguments: workers in other processes
    and on other machines call it, in any order. An exception it raises becomes a failed run with that reason.
    binary: last parts of value keys that are 0 or 1, for example "lost"; their mean gets a Wilson interval.
    pool: for runs that are batches: the values of all good runs of a case (in order) to its lines of the summary,
        "<value>.<statistic>", in place of statistics over runs.
    small_runs, small_cases: what `--runs small` makes, cases by name or pattern (none: all), so that all studies of the project
        are through within an hour on two cores.
    warm: a module-level function that builds once what every run needs, in the process that local workers are forked from;
        results do not depend on it.
    """

    name: str
    title: str
    purpose: str
    cases: tuple[Case, ...]
    run: Callable[[Case, int], RunResult]
    default_runs: int = 20
    binary: tuple[str, ...] = ("lost",)
    pool: Callable[[Sequence[Mapping[str, float]]], dict[str, float | int | None]] | None = None
    small_runs: int = 1
    small_cases: tuple[str, ...] = ()
    warm: Callable[[], None] | None = None

    def __post_init__(self) -> None:
        names = [c.name for c in self.cases]
        for what, text in [("study", self.name), *(("case", n) for n in names)]:
            if not NAME.fullmatch(text):
                raise CampaignError(
                    f"{what} name {text!r}: allowed are letters, digits and _ . + - (first: letter, digit)"
                )
        twice = sorted({n for n in names if names.count(n) > 1})
        if not names or twice:
            raise CampaignError(f"study {self.name}: " + (f"case {twice[0]} twice" if twice else "no cases"))

    def choose(self, wanted: list[str] | None) -> tuple[Case, ...]:
        """The cases the names or patterns (`*`, `?`) fit, in the study's order; all without any. Raises CampaignError for one
        that fits none."""
        if not wanted:
            return self.cases
        known, chosen = [c.name for c in self.cases], set()
        for name in wanted:
            fitting = {k for k in known if fnmatchcase(k, name)}
            if not fitting:
                some = ", ".join(known[:SHOWN])
                more = f", ... ({len(known)}: `sil campaign {self.name} --list`)" if len(known) > SHOWN else ""
                raise CampaignError(
                    f"case {name!r}: study {self.name} has no such case; known: {some}{more}{near(name, known)}"
                )
            chosen |= fitting
        return tuple(c for c in self.cases if c.name in chosen)


def run_seed(master_seed: int, study: str, run: int) -> int:
    """Seed of run index `run`: the first 63 bits of SHA-256 of (master seed, study, run).

    The case is left out on purpose: every case and every filter sees the same noise in run i, so that they are compared
    on the same luck. The value is part of the file format: it never changes.
    """
    digest = hashlib.sha256(f"{master_seed}\n{study}\n{run}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1


def finite(value: float) -> bool:
    """True for a value that enters the statistics."""
    return bool(np.isfinite(value))
