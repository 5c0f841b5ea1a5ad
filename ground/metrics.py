"""Figures of a run for `summary.json`: those every run has, and those of each view that finds its messages.

Common: where the logs end and what they lost (ground.whole), wind estimates against truth (ground.wind), whether published sigmas
tell the truth, what navigation refused, fuel that ran dry (ground.consistency), slips, lost packets, failures injected. Keys are
flat and dotted, SI unless the name ends in another unit; a figure without samples is None.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.plugins import VIEWS
from flightsw.strict import ConfigError
from ground.columns import Columns, load
from ground.consistency import consistency_figures, fuel_metrics, refusal_figures
from ground.run import Run
from ground.run import load as load_run
from ground.views import registry
from ground.views.base import Figures, Mask
from ground.views.registry import Failed, ViewError, asked
from ground.whole import log_figures
from ground.wind import Counts, wind_figures

FAILED = "run.failed_views"  # of the figures: which views failed, and with what
SETTLE_S = 60.0  # [s] errors of estimates count from here, where no mission says when they do


def failure_metrics(run: Path) -> Figures:
    """plant.failures.accepted and .refused: MAV_CMD_INJECT_FAILURE in RUN/plant.tlog; {} where nobody sent any."""
    path = run / "plant.tlog"
    if not path.exists():
        return {}
    log = load(path)
    acks = [t for s in log.sysids() if (t := log.get(s, "COMMAND_ACK")) is not None]
    result = np.concatenate([t["result"] for t in acks]) if acks else np.empty(0)
    return {"plant.failures.accepted": int((result == 0).sum()), "plant.failures.refused": int((result != 0).sum())}


def loop_metrics(tlm: Columns) -> Figures:
    """loop.slips (all aircraft, last report of each) and link.dropped (telemetry packets missing by sequence)."""
    slips = 0
    for sysid in tlm.sysids():
        timing = tlm.get(sysid, "LOOP_TIMING")
        if timing is not None and len(timing):
            slips += int(timing["slips"][-1])
    return {"loop.slips": slips, "link.dropped": sum(tlm.dropped.values())}


def common(run: Run, crafts: Mapping[int, str], counts: Counts) -> Figures:
    """What every run has, whatever it flew; wind and pose of the aircraft `crafts` (system id -> name)."""
    return (
        log_figures(run.folder, run.truth, run.tlm)
        | wind_figures(run, crafts, counts)
        | loop_metrics(run.tlm)
        | consistency_figures(run, crafts)
        | refusal_figures(run, crafts)
        | fuel_metrics(run.folder, run.truth)
        | failure_metrics(run.folder)
    )


def compute(folder: Path, failed: Failed = None) -> Figures:
    """All metrics of a run folder. Raises LogError if it is none or a log is no log, ValueError if meta.json is broken,
    ConfigError if two views give one figure, ViewError for a view that fails; with a list for `failed` what views fail with is
    added there and the figures are those of the others."""
    run = load_run(folder)
    views = registry.found(run.tlm, failed)

    def counts(sysid: int, t_us: NDArray[np.int64]) -> Mask:
        said = (asked(n, "counts", partial(v.counts, run.tlm, sysid, t_us), None, failed) for n, v in views.items())
        mask = next((m for m in said if m is not None), None)
        return t_us >= SETTLE_S * 1e6 if mask is None else mask

    nobody: frozenset[int] = frozenset()
    judged = [asked(n, "judges", partial(v.judges, run.tlm), nobody, failed) for n, v in views.items()]
    apart = nobody.union(*judged)
    out = common(run, {s: name for s, name in run.names.items() if s not in apart}, counts)
    for name, view in views.items():
        own: Figures = asked(name, "figures", partial(view.figures, run), {}, failed)
        if twice := out.keys() & own.keys():
            raise ConfigError(f"{VIEWS} = {name!r}: figure {min(twice)!r} is another's")
        out |= own
    if failed:
        out[FAILED] = "; ".join(dict.fromkeys(failed))
    return out


__all__ = ["FAILED", "ViewError", "compute"]
