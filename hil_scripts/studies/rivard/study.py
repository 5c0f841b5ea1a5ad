"""Rivard (1982), the range-only rendezvous: the printed tables, what each improvement brings, and the cases left open.

A run is a batch of rendezvous with a seed of its own, so 20 runs are 20,000 rendezvous of a case; figures are those of all of
them together (pool.py). Every case flies run i on the same normals.
"""

from __future__ import annotations

import math
from typing import Any

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.rivard import cases as rc
from hil_scripts.studies.rivard.flight import fly_one
from hil_scripts.studies.rivard.mc import run_case
from hil_scripts.studies.rivard.pool import batch, pooled

MANY, SOME, FEW = 1000, 500, 150  # rendezvous of a batch: three-state filter, Gaussian sum, Gaussian sum from 100 NM
RADAR_TIMES = tuple(float(t) for t in range(10, 201, 10))  # [s] of consistency figures, first range at zero
FAR_TIMES = tuple(float(t) for t in (*range(10, 200, 10), *range(200, 310, 20), 310, *range(320, 481, 20)))
SCATTER = 1000  # misses kept for the picture

# x mean sigma RMS, y (as y_T - y) mean sigma RMS, NM; of 30 runs
PRINTED: dict[str, tuple[float | None, ...]] = {
    "open": (0.83, 0.71, 1.09, 0.35, 1.11, 1.16),
    "cross_a": (0.89, 1.06, 1.38, 0.14, 0.23, 0.27),
    "cross_b": (0.89, 1.06, 1.38, 0.14, 0.23, 0.27),
    "k2_a": (0.09, 0.84, 0.84, 0.10, 0.43, 0.44),
    "k2_b": (0.09, 0.84, 0.84, 0.10, 0.43, 0.44),
    "k3_a": (-0.21, 0.54, 0.58, -0.10, 0.41, 0.42),
    "k3_b": (-0.21, 0.54, 0.58, -0.10, 0.41, 0.42),
    "true_k3_a": (None, None, 0.17, None, None, 0.09),
    "true_k3_b": (None, None, 0.17, None, None, 0.09),
    "t2_open": (0.96, 0.70, 1.19, -1.22, 1.07, 1.62),
    "t2_cross": (0.93, 1.02, 1.38, 0.04, 0.13, 0.14),
    "t2_k3": (-0.15, 0.74, 0.75, -0.09, 0.39, 0.40),
}


def run_batch(case: Case, seed: int) -> RunResult:
    """One batch of the case's setting. Raises ValueError for an unknown setting."""
    p = case.params
    setting = rc.case(str(p["setting"]))
    times = tuple(float(t) for t in p.get("times_s", ()))
    r = run_case(setting, int(p["batch"]), seed, workers=1, samples=bool(times), times=times)
    printed = p.get("printed_nm")
    values = batch(
        r, setting.truth.turn_at_s, None if printed is None else [math.nan if v is None else v for v in printed]
    )
    traces: dict[str, Any] = {"miss_m": r.rows[:SCATTER, [2, 3]]}
    if "picture_s" in p:
        traces |= fly_one(setting, seed, snaps=tuple(float(t) for t in p["picture_s"]))
    return RunResult(values, traces)


def _case(kind: str, setting: str, n: int, **more: Any) -> Case:
    if setting in PRINTED:
        more["printed_nm"] = list(PRINTED[setting])
    return Case(setting, {"kind": kind, "setting": setting, "batch": n, **more})


def _tables() -> list[Case]:
    radar, far = list(RADAR_TIMES), list(FAR_TIMES)
    out = [_case("table1", s, MANY) for s in list(PRINTED)[:9]]
    out += [_case("table2", s, MANY) for s in list(PRINTED)[9:]]
    out.append(_case("table1", "open_interpolated", MANY))
    out += [_case("gain", f"gain_{k}", MANY, gain=k) for k in rc.GAINS]
    out += [_case("gain", f"gain_printed_{k}", MANY, gain=k) for k in rc.PRINTED_GAINS]
    filters = ("filter", "filter_2s", "filter_no_bias", "filter_r_printed", "eight_30")
    out += [_case("filter", s, MANY, times_s=radar) for s in filters]
    out += [_case("filter", s, MANY, times_s=far) for s in ("unaided_seed", "seven_unaided")]
    out.append(_case("sampling", "loop_2s", MANY))
    return out


def _better() -> list[Case]:
    radar, far = list(RADAR_TIMES), list(FAR_TIMES)
    out = [_case("better", s, MANY, times_s=radar) for s in ("b2", "b3", "b4")]
    out += [_case("better", s, MANY) for s in ("b1", "b8", "roll_uncompensated")]
    out += [_case("better", s, SOME) for s in ("b5", "b6", "b7", "b7r", "b7e")]
    out.append(_case("better", "b7re", MANY, times_s=radar, picture_s=[0, 60, 120, 170]))
    out += [_case("unaided", s, FEW) for s in ("unaided", "unaided_roll", "unaided_roll_no_trim")]
    out.append(_case("unaided", "unaided_best", 2 * FEW, times_s=far, picture_s=[0, 120, 240, 320]))
    out.append(_case("unaided", "weave_60", FEW))
    for name in ("bearing_2", "bearing_1", "bearing_0p5", "link_100", "link_10"):
        out += [_case("sensors", name, SOME), _case("sensors", f"{name}_k3", SOME)]
    return [*out, _case("sensors", "perfect", SOME)]


MISMATCH = ("bias_x2", "noise_x2", "fluctuation_x1p5", "velocity_x2", "drift_x5", "all_four")
MANOEUVRES = (
    *(f"turn_{d}" for d in rc.SWEPT_TURNS), "turn_30_late",
    *(f"faster_{k}" if k > 0 else f"slower_{-k}" for k in rc.SWEPT_SPEEDS), "faster_50_late",
)  # fmt: skip
TROUBLE = (
    "dropout_30", "dropout_60", "outage_60", "outage_turn", "latency_1_stamped", "latency_1", "latency_3_stamped", "latency_3",
    "wind_error_10", "wind_error_20", "tanker_errors", "tanker_errors_x3",
)  # fmt: skip


def _open_questions() -> list[Case]:
    out = []
    for kind, names in (("mismatch", MISMATCH), ("manoeuvre", MANOEUVRES), ("undone", TROUBLE)):
        for name in names:
            out += [_case(kind, f"{name}_seed", MANY), _case(kind, name, SOME)]
    for name in ("crosswind_30", "crosswind_60", "headwind_30", "headwind_60"):
        out += [_case("wind", f"{name}_seed", MANY), _case("wind", name, SOME)]
    return [*out, _case("wind", "crosswind_30_open", SOME), _case("wind", "crosswind_60_open", SOME)]


STUDY = Study(
    name="rivard",
    title="Range-only rendezvous",
    purpose=(
        "the tables of Rivard (1982), printed beside reproduced; each improvement of estimator and guidance with the same "
        "sensor; and the cases the source left open"
    ),
    cases=(*_tables(), *_better(), *_open_questions()),
    run=run_batch,
    pool=pooled,
)
