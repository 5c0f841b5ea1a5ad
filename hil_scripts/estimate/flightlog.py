"""Flight log as CSV: typed columns in SI, checked before anything is computed from them."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Array = np.ndarray


class LogError(ValueError):
    """The log cannot be used. The text names file, line, column, value and what is allowed."""


@dataclass(frozen=True)
class Column:
    """Name, largest believable magnitude and what a larger one suggests."""

    name: str
    limit: float
    hint: str


def _group(names: str, limit: float, hint: str) -> tuple[Column, ...]:
    return tuple(Column(n, limit, hint) for n in names.split())


TIME = Column("t_s", 1e6, "seconds from the start of the log are expected, this looks like milliseconds or a date")
VEL = _group("vel_n_mps vel_e_mps vel_d_mps", 400.0, "m/s expected, this looks like cm/s or km/h")
ATT = _group("yaw_rad pitch_rad roll_rad", 2.0 * math.pi + 0.01, "rad expected, this looks like degrees")
RATE = _group("p_radps q_radps r_radps", 12.0, "rad/s expected, this looks like deg/s")
AIR = (
    Column("airspeed_mps", 400.0, "m/s expected, this looks like cm/s or km/h"),
    *_group("beta_rad alpha_rad", 1.2, "rad expected, this looks like degrees"),
)
WIND = _group("wind_n_mps wind_e_mps wind_d_mps", 120.0, "m/s expected, this looks like cm/s or km/h")
POS = _group(
    "pos_n_m pos_e_m pos_d_m", 1e6, "metres from a local origin expected, this looks like an earth-fixed frame"
)
REQUIRED = (TIME, *VEL, *ATT, *RATE, *AIR)


@dataclass(frozen=True)
class FlightLog:
    """n samples. t [n] s; euler [n,3] (psi, theta, phi) rad; w_b [n,3] rad/s; vel_n [n,3] m/s NED; air [n,3] (V m/s, beta,
    alpha rad); wind_n [n,3] m/s NED as estimated onboard, pos_n [n,3] m NED, both None where the log has none.
    """

    name: str
    t: Array
    euler: Array
    w_b: Array
    vel_n: Array
    air: Array
    wind_n: Array | None
    pos_n: Array | None

    def __len__(self) -> int:
        return len(self.t)


def read(path: Path) -> FlightLog:
    """Read and check a log. Raises LogError for anything that would silently spoil the estimate."""
    names, rows = _table(path)
    missing = [c.name for c in REQUIRED if c.name not in names]
    if missing:
        raise LogError(f"{path}: missing column {', '.join(missing)}; needed are {', '.join(c.name for c in REQUIRED)}")
    doubled = sorted({n for n in names if names.count(n) > 1})
    if doubled:
        raise LogError(f"{path}: column {', '.join(doubled)} appears more than once")
    data: dict[str, Array] = {}
    for group in (REQUIRED, WIND, POS):
        if all(c.name in names for c in group):
            for c in group:
                data[c.name] = _values(path, rows, names.index(c.name), c)

    def stack(cols: tuple[Column, ...]) -> Array:
        return np.ascontiguousarray(np.stack([data[c.name] for c in cols], axis=-1))

    log = FlightLog(
        name=path.name,
        t=data[TIME.name],
        euler=stack(ATT),
        w_b=stack(RATE),
        vel_n=stack(VEL),
        air=stack(AIR),
        wind_n=stack(WIND) if WIND[0].name in data else None,
        pos_n=stack(POS) if POS[0].name in data else None,
    )
    _check_time(path, log.t)
    _check_motion(path, log)
    return log


def _table(path: Path) -> tuple[list[str], list[list[str]]]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as f:
            rows = list(csv.reader(f))
    except OSError as e:
        raise LogError(f"{path}: cannot be read: {e.strerror}") from None
    except (UnicodeDecodeError, csv.Error) as e:
        raise LogError(f"{path}: not a CSV text file: {e}") from None
    while rows and not rows[-1]:
        rows.pop()
    if len(rows) < 101:
        raise LogError(f"{path}: {max(len(rows) - 1, 0)} samples; at least 100 are needed")
    names = [n.strip() for n in rows[0]]
    for k, row in enumerate(rows[1:], start=2):
        if len(row) != len(names):
            raise LogError(f"{path}: line {k}: {len(row)} cells, the header has {len(names)}")
    return names, rows[1:]


def _values(path: Path, rows: list[list[str]], i: int, c: Column) -> Array:
    out = np.empty(len(rows))
    for k, row in enumerate(rows):
        try:
            out[k] = float(row[i])
        except ValueError:
            raise LogError(f"{path}: line {k + 2}: column {c.name}: '{row[i]}' is not a number") from None
    bad = np.flatnonzero(~np.isfinite(out) | (np.abs(out) > c.limit))
    if bad.size:
        k = int(bad[0])
        why = f"beyond {c.limit:g} in magnitude: {c.hint}" if math.isfinite(out[k]) else "must be finite"
        raise LogError(f"{path}: line {k + 2}: column {c.name} = {out[k]:g} {why}")
    if c.name == AIR[0].name and (out < 0.0).any():
        k = int(np.flatnonzero(out < 0.0)[0])
        raise LogError(f"{path}: line {k + 2}: column {c.name} = {out[k]:g} must not be negative")
    return out


def _check_time(path: Path, t: Array) -> None:
    d = np.diff(t)
    bad = np.flatnonzero(d <= 0.0)
    if bad.size:
        k = int(bad[0])
        raise LogError(f"{path}: line {k + 3}: column t_s = {t[k + 1]:g} does not advance from {t[k]:g}")
    step = float(np.median(d))
    if not 1e-3 <= step <= 0.5:
        raise LogError(
            f"{path}: column t_s: median step {step:g}; allowed 0.001 to 0.5 s (milliseconds, or rows left out?)"
        )


def _ratio(of: Array, by: Array) -> float:
    """Least-squares factor of `of` on `by`, NaN when `by` hardly moves."""
    by, of = by - by.mean(), of - of.mean()
    return float(of @ by / (by @ by)) if float(by.std()) > 1e-9 else math.nan


def _check_motion(path: Path, log: FlightLog) -> None:
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
        c = _ratio(slope, rate)
        # a little motion says nothing about units
        if rate.std() > (0.03 if whole.endswith("rad") else 0.5) and not 0.5 < c < 2.0:
            raise LogError(
                f"{path}: d({whole})/dt is {c:.3g} times what {part} gives; allowed 0.5 to 2: check units, signs and axes"
                " (rad, rad/s, m, m/s; north-east-down, forward-right-down)"
            )
