"""What one row of a flight log cannot show: time that runs back, sensors that froze, columns that contradict each other."""

from __future__ import annotations

import bisect
import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hil_scripts.estimate.columns import ANGLE, POS, VEL, YAW, Array, FlightLog, Frozen, LogError

FROZEN_S = 1.0  # [s] and
FROZEN_TIMES = 5.0  # times as long as a reading usually stands: then the sensor is frozen, not slow
MOVES_RADPS, MOVES_MPS = 0.03, 0.5  # [rad/s, m/s] standard deviation below which motion says nothing about units


def advancing(lines: Array, t: Array) -> tuple[Array, list[tuple[int, str]]]:
    """Indices of the longest run of rows whose time [s] advances, and (line, fault) of the rows left out.

    The fewest rows go: one stamp far ahead costs itself, not all that follow.
    """
    tails: list[float] = []
    ends: list[int] = []
    before = np.full(len(t), -1)
    for k, x in enumerate(t.tolist()):
        i = bisect.bisect_left(tails, x)
        before[k] = ends[i - 1] if i else -1
        if i == len(tails):
            tails.append(x)
            ends.append(k)
        elif x < tails[i]:  # of two rows with one stamp the first stays
            tails[i], ends[i] = x, k
    keep = []
    k = ends[-1] if ends else -1
    while k >= 0:
        keep.append(k)
        k = int(before[k])
    good = np.array(keep[::-1], dtype=int)
    out = np.setdiff1d(np.arange(len(t)), good)
    faults = []
    for k in out.tolist():
        j = int(np.searchsorted(good, k))
        last = f" from {t[good[j - 1]]:g}" if j else ""
        faults.append((int(lines[k]), f"line {lines[k]}: column t_s = {t[k]:g} does not advance{last}"))
    return good, faults


def check_time(path: Path, t: Array) -> None:
    """Raises LogError when the step is none of a flight log in seconds."""
    step = float(np.median(np.diff(t)))
    if not 1e-3 <= step <= 0.5:
        raise LogError(
            f"{path}: column t_s: median step {step:g}; allowed 0.001 to 0.5 s (milliseconds, or rows left out?)"
        )


def _runs(x: Array) -> list[tuple[int, int]]:
    """(first, one past the last) sample of every stretch of equal rows of x [n,k]."""
    change = np.flatnonzero((np.diff(x, axis=0) != 0.0).any(axis=1)) + 1
    edges = [0, *change.tolist(), len(x)]
    return list(itertools.pairwise(edges))


def frozen(log: FlightLog) -> list[tuple[str, int, int]]:
    """(sensor, first, one past the last sample) of every frozen stretch; its first reading is still a fresh one.

    A slow sensor stands for a few samples between readings, a frozen one for FROZEN_TIMES as long and FROZEN_S at least.
    """
    columns = {"attitude": log.euler, "rates": log.w_b, "velocity": log.vel_n, "airspeed": log.air[:, :1]}
    columns |= {n: log.air[:, i + 1 : i + 2] for i, n in enumerate(("beta", "alpha")) if log.vanes[i]}
    out = []
    for sensor, x in columns.items():
        runs = _runs(x)
        usual = float(np.median([b - a for a, b in runs])) if len(runs) > 1 else 1.0
        for a, b in runs:
            if log.t[b - 1] - log.t[a] >= FROZEN_S and b - a > FROZEN_TIMES * usual:
                out.append((sensor, a + 1, b))
    return out


def without_frozen(path: Path, log: FlightLog) -> FlightLog:
    """The log with frozen stretches marked. A vane that never moves is none; raises LogError when too little of another
    sensor is left."""
    stale: dict[str, Array] = {}
    marks = []
    vanes = list(log.vanes)
    air, notes = log.air.copy(), list(log.notes)
    for sensor, a, b in frozen(log):
        if sensor in ("beta", "alpha") and b - a == len(log) - 1:
            i = ("beta", "alpha").index(sensor)
            notes.append(f"{sensor} is {air[0, 1 + i]:g} in every row: taken as not measured")
            vanes[i], air[:, 1 + i] = False, 0.0
            continue
        mask = stale.setdefault(sensor, np.zeros(len(log), dtype=bool))
        mask[a:b] = True
        marks.append(Frozen(sensor, float(log.t[a - 1] - log.t[0]), float(log.t[b - 1] - log.t[0]), b - a))
    for sensor, mask in stale.items():
        if sensor not in ("beta", "alpha") and int((~mask).sum()) < max(100, len(log) // 2):
            raise LogError(
                f"{path}: {sensor} is frozen in {int(mask.sum())} of {len(log)} rows; allowed: up to half of them"
            )
    return replace(log, air=air, vanes=(vanes[0], vanes[1]), stale=stale, frozen=tuple(marks), notes=tuple(notes))


def _ratio(of: Array, by: Array) -> float:
    """Least-squares factor of `of` on `by`, NaN when `by` hardly moves."""
    by, of = by - by.mean(), of - of.mean()
    return float(of @ by / (by @ by)) if float(by.std()) > 1e-9 else math.nan


def check_motion(path: Path, log: FlightLog) -> None:
    """Columns that must be derivatives of each other: a wrong unit, sign or axis shows as a factor far from one."""
    k = max(1, round(0.2 / float(np.median(np.diff(log.t)))))
    dt = log.t[k:] - log.t[:-k]

    def mean_over(x: Array) -> Array:
        s = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(log.t))])
        return (s[k:] - s[:-k]) / dt

    phi, theta = log.euler[:, 2], log.euler[:, 1]
    p, q, r = log.w_b.T
    turn = (q * np.sin(phi) + r * np.cos(phi)) / np.maximum(np.cos(theta), 0.05)
    psi = np.unwrap(log.euler[:, 0])
    pairs = [
        ("roll_rad", "p_radps, q_radps, r_radps", np.unwrap(phi), p + turn * np.sin(theta)),
        ("pitch_rad", "q_radps, r_radps", theta, q * np.cos(phi) - r * np.sin(phi)),
        ("yaw_rad", "q_radps, r_radps", psi, turn),
    ]
    if log.pos_n is not None:
        pairs += [(POS[i].name, VEL[i].name, log.pos_n[:, i], log.vel_n[:, i]) for i in range(3)]
    for whole, part, x, xdot in pairs:
        slope, rate = (x[k:] - x[:-k]) / dt, mean_over(xdot)
        # a little motion says nothing about units; neither does a stretch in which a sensor is frozen
        sensors = ("attitude", "rates") if whole.endswith("rad") else ("velocity",)
        ok = np.all([log.fresh(s) for s in sensors], axis=0)
        ok = ok[k:] & ok[:-k]
        c = _ratio(slope[ok], rate[ok])
        moves = bool(rate[ok].std() > (MOVES_RADPS if whole.endswith("rad") else MOVES_MPS))
        if moves and not 0.5 < c < 2.0:
            raise LogError(
                f"{path}: d({whole})/dt is {c:.3g} times what {part} gives; allowed 0.5 to 2: check units, signs and axes"
                " (rad, rad/s, m, m/s; north-east-down, forward-right-down)"
            )
        if whole == YAW.name and not moves:
            _check_heading(path, log)


def _check_heading(path: Path, log: FlightLog) -> None:
    """Without turns to compare, a heading beyond one turn is radians only if it points along the track better than degrees do."""
    yaw = log.euler[:, 0]
    if float(np.abs(yaw).max()) <= ANGLE:
        return
    track = np.arctan2(log.vel_n[:, 1], log.vel_n[:, 0])
    along, as_degrees = (float(np.mean(np.cos(a - track))) for a in (yaw, np.radians(yaw)))
    if not (along > 0.5 and along >= as_degrees):
        far = float(yaw[np.argmax(np.abs(yaw))])
        raise LogError(
            f"{path}: column {YAW.name} = {far:g} points away from the track over ground; rad expected (it may count turns), "
            "this looks like degrees"
        )
