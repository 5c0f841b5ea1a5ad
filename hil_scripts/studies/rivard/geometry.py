"""`rivard_geometry`: the meeting from where it was not planned, with what it announces and the leg after the turn.

A run is a batch of meetings with a seed of its own; four runs are the 2048 of the acceptance. Every case flies run i on the same
normals.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous.params import Aids
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard.figures import proportion
from hil_scripts.studies.rivard.geometry_mc import Fault, GeometryCase, changed, run_geometry
from hil_scripts.studies.rivard.mc import KN
from hil_scripts.studies.rivard.pool import BOX_M, MOMENTS, Out, _moments, _put, spread

Array = np.ndarray
BATCH = 512
PLAIN = 0.7  # a prediction of a miss is false where the true one is inside this share of the box
STARTS = tuple((float(o), float(r)) for o in (0, 3, 5, 7, -3, -5, -7) for r in (18, 24, 30, 40))
SENSORS = {
    "": {},
    "_bearing": {"bearing_deg": 1.0, "bearing_bias_deg": 0.3, "nav_bearing_sigma_deg": 1.1},
    "_link": {"link_m": 100.0, "link_bias_m": 5.0},
}
# at a rate of their own, with errors correlated over 5 s (own_rate.py); of a link that sends ten times a second the software
# takes one a second. The leg is the product's where the side is known
_MEETING: dict[str, Any] = {
    "meet_leg_sided_s": 600.0, "meet_leg_sided_share": 0.4, "meet_straight_again": True, "meet_speed_sigma": 2.0,
    "nav_aids": Aids(on=True), "t_max_s": 1500.0,
}  # fmt: skip
OWN: dict[str, dict[str, Any]] = {
    "_bearing_own": _MEETING | {
        "bearing_deg": 1.0, "bearing_bias_deg": 0.3, "bearing_s": 1.0, "bearing_tau_s": 5.0, "nav_bearing_sigma_deg": 1.0
    },
    "_link_own": _MEETING | {
        "link_m": 100.0, "link_bias_m": 5.0, "link_s": 1.0, "link_tau_s": 5.0, "link_late_s": 0.15, "link_gone": 0.01,
    },
}  # fmt: skip
TURNS = (5.0, 10.0, 20.0, 30.0)


def _own_rate(plan: GeometryCase) -> dict[str, tuple[str, GeometryCase]]:
    """Bearing and data link at rates of their own."""
    out = {}
    for sensor, more in OWN.items():
        own = changed(plan, **more)
        out[f"as_planned{sensor}"] = ("plan", own)
        wrong = changed(own, truth_wind_error_mps=10.0 * KN)
        out[f"wind_error_10{sensor}"] = ("wind", wrong)
        told = {"meet_wind_sigma_mps": 8.0 * KN}  # about how wrong the own wind may be is known on board
        out[f"wind_error_10{sensor}_told"] = ("wind", changed(wrong, **told))
        for degrees in TURNS:
            for sign, name in ((1.0, "turn_towards"), (-1.0, "turn_away")):
                out[f"{name}_{degrees:g}{sensor}"] = (
                    "turn",
                    changed(own, truth_turn_at_s=60.0, truth_turn_deg=sign * degrees),
                )
        for kn, name in ((60.0, "faster_60"), (-60.0, "slower_60")):
            out[f"{name}{sensor}"] = ("speed", changed(own, receiver_kn=kn))
            out[f"{name}{sensor}_told"] = ("speed", changed(wrong, receiver_kn=kn, **told))
            out[f"{name}_trim_60{sensor}"] = (
                "authority",
                changed(own, receiver_kn=kn, guid_trim_mps=60.0 * KN, nav_velocity_sigma_mps=30.0 * KN),
            )
    link = changed(plan, truth_turn_at_s=60.0, truth_turn_deg=-30.0, **OWN["_link_own"])
    out["turn_away_30_known_60_own"] = ("turn", changed(link, known_s=60.0))
    out["turn_away_30_link_own_leg_300"] = ("turn", changed(link, meet_leg_sided_s=0.0))
    own = changed(plan, **OWN["_link_own"])
    for tau in (1.0, 20.0, 60.0):  # errors that fade sooner or later than the least favourable, known on board or not
        out[f"as_planned_link_own_not_told_tau_{tau:g}"] = ("plan", changed(own, link_tau_s=tau))
        out[f"turn_away_30_link_own_not_told_tau_{tau:g}"] = ("turn", changed(link, link_tau_s=tau))
        out[f"turn_away_30_link_own_tau_{tau:g}"] = (
            "turn",
            changed(link, link_tau_s=tau, nav_aids=Aids(on=True, link_tau_s=tau)),
        )
    return out


def _settings() -> dict[str, tuple[str, GeometryCase]]:
    """Kind and setting by name."""
    plan = GeometryCase()
    out = {"as_planned": ("plan", plan), "state_known": ("plan", changed(plan, known_s=0.0))}
    for kn in (15.0, 30.0, 45.0, 60.0, 70.0):
        for sign, name in ((1.0, f"cross_{kn:g}"), (-1.0, f"cross_minus_{kn:g}")):
            out[name] = ("wind", changed(plan, truth_wind_y_mps=sign * kn * KN))
    out["cross_60_fixed"] = ("wind", changed(plan, truth_wind_y_mps=60.0 * KN, guid_offset_bank_deg=0.0))
    out["wind_error_10"] = ("wind", changed(plan, truth_wind_error_mps=10.0 * KN))
    for offset, far in STARTS:
        side = "right" if offset >= 0.0 else "left"
        out[f"start_{side}_{abs(offset):g}_{far:g}"] = ("start", changed(plan, offset_nm=offset, range_nm=far))
    for far in (15.0, 17.0):
        out[f"close_{far:g}"] = ("forbidden", changed(plan, range_nm=far))
        out[f"close_{far:g}_trim_40"] = (
            "authority",
            changed(plan, range_nm=far, guid_trim_mps=40.0 * KN, meet_leg_s=600.0),
        )
    for far in (30.0, 40.0):
        out[f"away_{far:g}"] = ("forbidden", changed(plan, range_nm=far, heading_deg=180.0))
    for kn in (40.0, 60.0, -40.0, -60.0):
        name = f"faster_{kn:g}" if kn > 0.0 else f"slower_{-kn:g}"
        out[name] = ("speed", changed(plan, receiver_kn=kn))
        for far, components in ((60.0, 21), (100.0, 31)):
            heard = changed(plan, receiver_kn=kn, range_nm=far, sigma_y_nm=2.0, nav_components=components)
            out[f"{name}_{far:g}nm"] = ("speed", heard)
        out[f"{name}_link"] = ("speed", changed(plan, receiver_kn=kn, **SENSORS["_link"]))
        out[f"{name}_trim_60"] = (
            "authority",
            changed(plan, receiver_kn=kn, guid_trim_mps=60.0 * KN, nav_velocity_sigma_mps=30.0 * KN),
        )
    for degrees in TURNS:
        for sign, name in ((1.0, "turn_towards"), (-1.0, "turn_away")):
            for sensor, more in SENSORS.items():
                out[f"{name}_{degrees:g}{sensor}"] = (
                    "turn",
                    changed(plan, truth_turn_at_s=60.0, truth_turn_deg=sign * degrees, **more),
                )
    out |= _own_rate(plan)
    for known in (60.0, 80.0):  # what the law makes of a turn known from then on: no sensor tells it sooner
        out[f"turn_away_30_known_{known:g}"] = (
            "turn",
            changed(plan, truth_turn_at_s=60.0, truth_turn_deg=-30.0, known_s=known, **SENSORS["_link"]),
        )
    faults = {
        "first": Fault(0.0, 1.0, 5000.0),
        "second": Fault(10.0, 1.0, 5000.0),
        "spike_100": Fault(100.0, 1.0, 5000.0),
        "spike_150": Fault(150.0, 1.0, -1000.0),
        "two_spikes": Fault(100.0, 11.0, 5000.0),
        "stuck_40": Fault(80.0, 40.0, stuck=True),
        "stuck_on": Fault(120.0, math.inf, stuck=True),
        "bias_500": Fault(100.0, math.inf, 500.0),
        "silent_60": Fault(80.0, 60.0, silent=True),
        "silent_on": Fault(120.0, math.inf, silent=True),
    }
    for name, fault in faults.items():
        out[f"set_{name}"] = ("fault", changed(plan, fault=fault))
    return out


SETTINGS = _settings()


def outside(v: Array, share: float = 1.0) -> Array:
    """Whether misses [2,n] [m] lie outside this share of the box of 1 x 0.5 NM; one that is not finite does."""
    return ~((np.abs(v[0]) <= share * BOX_M[0]) & (np.abs(v[1]) <= share * BOX_M[1]))


def batch(rows: Array, trim: float = math.inf) -> dict[str, float]:
    """Values of one batch of rows [n, 20] (geometry_kernel.R_*): moments of the misses [m] and counts of meetings. trim [m/s]:
    of the tanker; who says that the receiver's speed is beyond it is wrong where it is not."""
    done = rows[:, gk.R_DONE] > 0.0
    rolled, end = rows[:, [gk.R_XR, gk.R_YR]].T, rows[:, [gk.R_X, gk.R_Y]].T
    before, said = (rows[:, j].astype(int) for j in (gk.R_SAID_BEFORE, gk.R_SAID))
    warned, turn = rows[:, gk.R_WARNED], rows[:, gk.R_TURN]
    early = (before > 0) | (warned <= turn)
    quiet = rows[:, gk.R_SILENT] > 0.0
    out_rolled, out_end = outside(rolled), outside(end)
    counts = {
        "unfinished": ~done,
        "rollout.outside": out_rolled,
        "end.outside": out_end,
        "leg": rows[:, gk.R_END] > rows[:, gk.R_ROLLED],
        "warned": np.isfinite(warned),
        "told.before": early,
        "told.outside": out_rolled & early,
        "told.speed": (before & kv.SAY_SPEED) > 0,
        "told.quiet": quiet,
        "false.turn": ((before & kv.SAY_LEG) > 0) & ~outside(rolled, PLAIN),
        "false.speed": ((before & kv.SAY_SPEED) > 0) & (np.abs(rows[:, gk.R_FASTER]) <= trim),
        "false.end": ((said & kv.SAY_MISSED) > 0) & ~outside(end, PLAIN),
        "silent.end": out_end & done & ((said & kv.SAY_MISSED) == 0),
        "silent.any": out_end & (said == 0) & ~np.isfinite(warned) & ~quiet,
        "restarted": rows[:, gk.R_RESTARTED] > 0.0,
    }
    values = {"n": float(len(rows)), "done": float(done.sum())} | {k: float(v.sum()) for k, v in counts.items()}
    for name, (x, y) in (("rollout", rolled[:, done]), ("end", end[:, done])):
        for axis, v in (("x", x), ("y", y)):
            values |= {f"{name}.{axis}.{m}": float(np.mean(v ** (i + 1))) for i, m in enumerate(MOMENTS)}
    at = {"turn.start_s": gk.R_TURN, "rollout.at_s": gk.R_ROLLED, "end.at_s": gk.R_END, "refused": gk.R_REFUSED}
    return (
        values
        | {k: float(np.nanmean(rows[:, j])) for k, j in at.items()}
        | {"opened": float(np.mean(rows[:, gk.R_OPENED]))}
    )


MEANS = ("turn.start_s", "rollout.at_s", "end.at_s", "refused", "opened")
SHARES = (
    "unfinished", "rollout.outside", "end.outside", "leg", "warned", "told.before", "told.speed", "told.quiet", "false.turn",
    "false.speed", "false.end", "silent.end", "silent.any", "restarted",
)  # fmt: skip


def pooled(runs: Sequence[Mapping[str, float]]) -> Out:
    """Lines of the summary of one case: shares with Clopper-Pearson intervals, RMS misses, means; n counts meetings."""
    n = round(sum(r["n"] for r in runs))
    out: Out = {"meetings": n}
    for name in SHARES:
        k = round(sum(r[name] for r in runs))
        _put(out, name, "mean", k / n, *proportion(k, n), n)
    missed = round(sum(r["rollout.outside"] for r in runs))
    if missed:  # of those the turn does not bring there: told before it
        k = round(sum(r["told.outside"] for r in runs))
        _put(out, "told.outside", "mean", k / missed, *proportion(k, missed), missed)
    for name in ("rollout", "end"):
        for axis in "xy":
            count, m = _moments(runs, f"{name}.{axis}", "done", 4)
            if count:
                spread(out, f"{name}.{axis}", "m", count, m)
    for name in MEANS:
        out |= {f"{name}.mean": sum(r[name] * r["n"] for r in runs) / n, f"{name}.n": n}
    return out


def run_batch(case: Case, seed: int) -> RunResult:
    """One batch of the case's setting. Raises ValueError for an unknown setting."""
    name = str(case.params["setting"])
    if name not in SETTINGS:
        raise ValueError(f"setting {name!r}: allowed: {', '.join(SETTINGS)}")
    setting = SETTINGS[name][1]
    rows = run_geometry(setting, int(case.params["batch"]), seed)
    return RunResult(batch(rows, setting.guid.trim_mps), {"miss_m": rows[:, [gk.R_XR, gk.R_YR, gk.R_X, gk.R_Y]]})


STUDY = Study(
    name="rivard_geometry",
    title="Rendezvous from anywhere",
    purpose=(
        "range-only rendezvous in crosswind, from starts nobody planned, with a receiver that turns or is faster than the "
        "tanker, with a faulty TACAN: what is reached, after one leg, and what is announced"
    ),
    cases=tuple(Case(name, {"kind": kind, "setting": name, "batch": BATCH}) for name, (kind, _) in SETTINGS.items()),
    run=run_batch,
    default_runs=4,
    pool=pooled,
)
