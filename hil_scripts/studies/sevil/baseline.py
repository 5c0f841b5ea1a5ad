"""Sevil (2013) as a baseline in flight: Algorithms 11 and 15 on board in place of the filter, on the same seeds.

Scenario `airdata`, begun 2.4 m from contact: how far the position in the wake is off at contact, how often there is none, and
whether the station is held by it when the relative sensor falls silent. In calm air without noise, moved across: its lag, and
how far it is off meanwhile: the motion turns the flow at every vane, which the maps do not know and take for another place.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil.loop_flight import BREAKAWAY, CONTACT, TO_CONTACT, Arr, Setting, Track, fly
from hil_scripts.studies.sevil.six_dof import STILL
from hil_scripts.studies.sevil.track import errors

NEAR = (-38.0, 0.0, 6.7)  # [m] of the start, tanker axes; contact is reached after 25 s
ASIDE = (-38.0, 1.2, 6.7)  # [m] and of a flight that moves across
SETTLE_S = 3.0  # in contact before samples count
LOST_S, FOR_S = 48.0, 20.0  # [s] the relative sensor falls silent, and for how long
CALM_S = 34.0  # [s] length of a flight in calm air
MOVED_ON_S = 3.0  # [s] after the move across that tell of its lag as well
LEAST = 40  # rows a lag is found from
SHIFT_S, LONGEST_S = 0.005, 3.0  # [s] step and range of the lags tried
SINGLE = "receiver.airdata.position.contours.window=1"
REL_LOST = {"t_s": LOST_S, "kind": "off", "target": "receiver", "sensor": "rel", "for_s": FOR_S}
CALM = (*STILL, "plant.wind.dryden.sigma_mps=0.0")
HOLD = ("receiver.airdata.aid.fix_sigma_max_m=3.0",)  # else a position so uncertain holds no station by rule
METHODS = {
    "filter": (),
    "filter_air_only": ("receiver.airdata.aid.velocity=false",),
    "algorithm_11": ("receiver.airdata.position.method=algorithm_11",),
    "algorithm_15": ("receiver.airdata.position.method=algorithm_15",),
    "algorithm_11_10s": (
        "receiver.airdata.position.method=algorithm_11",
        "receiver.airdata.position.contours.window=200",
    ),
}  # fmt: skip


def position(name: str, tr: Track, rows: np.ndarray) -> dict[str, float]:
    """Error of the position in the wake over `rows` [N] of a flight, where it is valid; how often it is."""
    e = np.where(tr.valid[:, None], (tr.wake - tr.xi)[:, 1:], math.nan)[rows]
    out = {f"{name}.{k}": v for k, v in errors(e).items()}
    have = e[np.isfinite(e).all(axis=1)]
    for i, axis in enumerate("yz"):
        if len(have):
            out[f"{name}.p95_m.{axis}"] = float(np.percentile(np.abs(have[:, i]), 95))
            out[f"{name}.mean_m.{axis}"] = float(have[:, i].mean())
    return out


def lag(t: Arr, late: Arr, early: Arr, rows: np.ndarray) -> float:
    """Shift [s] with which the series `late` [N] follows `early` [N] best over `rows` [N] of the times t [N], by least squares,
    `early` linear between its samples. NaN: too few rows in which both are."""
    have, rows = np.isfinite(early), rows & np.isfinite(late)
    if rows.sum() < LEAST or have.sum() < LEAST:
        return math.nan
    shifts = np.arange(0.0, LONGEST_S, SHIFT_S)
    gap = [np.mean((late[rows] - np.interp(t[rows] - s, t[have], early[have])) ** 2) for s in shifts]
    return float(shifts[int(np.argmin(gap))])


def moved(sets: tuple[str, ...], seed: int) -> tuple[dict[str, float], Track]:
    """A flight in calm air that moves across: lag of the position behind truth (the filter) or behind the positions that single
    readings give on the same motion, and the largest error across meanwhile."""
    tr = _calm(sets, seed)
    printed = any(".method=" in s for s in sets)
    early = _across(_calm((*sets, SINGLE), seed)) if printed else tr.xi[:, 1]
    moving = np.flatnonzero(tr.phase == TO_CONTACT)
    if not len(moving):
        return {}, tr
    rows = (tr.t >= tr.t[moving[0]]) & (tr.t < float(tr.t[moving[-1]]) + MOVED_ON_S)
    late = _across(tr)
    error = (late - tr.xi[:, 1])[rows]
    return {"lag_s": lag(tr.t, late, early, rows), "moving.max_m.y": float(np.nanmax(np.abs(error)))}, tr


def _calm(sets: tuple[str, ...], seed: int) -> Track:
    return fly(Setting(CALM_S, (), (*CALM, *sets), start_m=ASIDE), seed)


def _across(tr: Track) -> Arr:
    """y [N] m, NaN where there is no position."""
    return np.where(tr.valid, tr.wake[:, 1], math.nan)


def figures(tr: Track) -> dict[str, float]:
    """Position at contact with the relative sensor at work; then without: for how long the flight went on, and how well."""
    since = np.flatnonzero(tr.phase == CONTACT)
    settled = tr.mask(CONTACT, t0=float(tr.t[since[0]]) + SETTLE_S, t1=LOST_S) if len(since) else tr.t < 0.0
    out = {"contact.reached": float(len(since) > 0), **position("contact", tr, settled)}
    end = LOST_S + FOR_S
    away = np.flatnonzero((tr.phase == BREAKAWAY) & (tr.t >= LOST_S) & (tr.t < end))
    until = float(tr.t[away[0]]) if len(away) else end
    lost = tr.mask(CONTACT, t0=LOST_S, t1=until)
    out |= {"breakaway": float(len(away) > 0), "lost.kept_s": until - LOST_S, **position("lost", tr, lost)}
    if lost.any():
        g = (tr.xi - tr.ref)[lost]
        out["lost.station.rms_m"] = float(np.sqrt(np.mean(np.sum(g * g, axis=1))))
        out["lost.station.max_m"] = float(np.abs(g).max())
    return out


def run_case(case: Case, seed: int) -> RunResult:
    """One flight of a case; `calm`: in still air without noise, moved across."""
    p = case.params
    sets = tuple(p["sets"])
    if p["calm"]:
        values, tr = moved(sets, seed)
    else:
        tr = fly(Setting(LOST_S + FOR_S, (REL_LOST,), (*sets, *HOLD), start_m=NEAR), seed)
        values = figures(tr)
    traces: dict[str, Arr] = {"t": tr.t, "xi": tr.xi, "wake": tr.wake, "valid": tr.valid.astype(np.int8)}
    return RunResult(values, traces)


def _cases() -> tuple[Case, ...]:
    def params(sets: tuple[str, ...], calm: bool) -> dict[str, Any]:
        return {"sets": list(sets), "calm": calm}

    flown = [Case(name, params(sets, False)) for name, sets in METHODS.items()]
    still = [Case(f"{name}_calm", params(METHODS[name], True)) for name in ("filter", "algorithm_11", "algorithm_15")]
    return (*flown, *still)


STUDY = Study(
    name="sevil_baseline",
    title="The printed position in the loop",
    purpose="Algorithms 11 and 15 flown on board beside the filter: position at contact, share without one, lag, and whether the "
    "station is held when the relative sensor is lost",
    cases=_cases(),
    run=run_case,
    default_runs=20,
    small_cases=("filter", "algorithm_11", "algorithm_15"),
    binary=("breakaway", "reached"),
)
