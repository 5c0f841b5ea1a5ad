"""The part of a campaign that runs in a worker process: one run, its result or the reason it has none."""

from __future__ import annotations

import gc
import hashlib
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil_scripts.campaign.study import Case, RunResult

ROOT = Path(__file__).resolve().parents[2]
CODE = ("flightsw", "sim_plant", "hil_scripts/studies", "hil_scripts/identify", "hil_scripts/campaign/study.py")
TIDY_S = 1.0  # [s] a longer run leaves a flight behind whose parts know each other: only the collector takes it back
REASON_LENGTH = 300  # characters kept of a failure's text


@dataclass(frozen=True)
class Row:
    """One run: its key, how it ended and what it gave. wall_s [s] is information and never part of a result file."""

    case: str
    run: int
    seed: int
    status: str  # "ok" or "failed"
    reason: str = ""
    values: dict[str, float] = field(default_factory=dict)
    wall_s: float = 0.0


@dataclass(frozen=True)
class Job:
    """One run to be made; `keep` asks for its traces."""

    case: Case
    run: int
    seed: int
    keep: bool


def _checked(result: Any) -> RunResult:
    if not isinstance(result, RunResult):
        raise TypeError(f"the study returned {type(result).__name__}, not RunResult")
    values: dict[str, float] = {}
    for key, value in result.values.items():
        if not isinstance(key, str) or not key:
            raise TypeError(f"value key {key!r} is not a text")
        try:
            values[key] = float(value)
        except (TypeError, ValueError):
            raise TypeError(f"value {key!r} is {type(value).__name__}, not a number") from None
    return RunResult(values, {k: np.asarray(v) for k, v in result.traces.items()})


def execute(run: Callable[[Case, int], RunResult], job: Job) -> tuple[Row, dict[str, NDArray[Any]]]:
    """Make one run. Whatever the study raises becomes a failed row; the text of the exception is its reason."""
    t0 = time.monotonic()
    try:
        result = _checked(run(job.case, job.seed))
    except Exception as e:
        text = " ".join(f"{type(e).__name__}: {e}".split())[:REASON_LENGTH]
        return Row(job.case.name, job.run, job.seed, "failed", text, wall_s=time.monotonic() - t0), {}
    finally:
        if time.monotonic() - t0 > TIDY_S:
            gc.collect()
    row = Row(job.case.name, job.run, job.seed, "ok", values=result.values, wall_s=time.monotonic() - t0)
    return row, result.traces if job.keep else {}


def identity() -> dict[str, str]:
    """What results depend on besides the seed: `code`, a digest of models, algorithms and studies, and the libraries."""
    h = hashlib.sha256()
    for part in CODE:
        path = ROOT / part
        files = [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.suffix in (".py", ".toml", ".txt"))
        for p in files:
            h.update(f"{p.relative_to(ROOT).as_posix()}\0".encode() + p.read_bytes() + b"\0")
    return {
        "code": h.hexdigest()[:16],
        "python": platform.python_version(),
        **{n: version(n) for n in ("numpy", "scipy", "numba")},
    }
