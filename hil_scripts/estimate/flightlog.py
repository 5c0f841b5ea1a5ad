"""Flight log as CSV: typed columns in SI, checked before anything is computed from them.

A row that cannot be used is left out and counted; a log in which such rows are common is refused with the first of them.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from hil_scripts.estimate import foreign, logcheck
from hil_scripts.estimate.columns import (
    ATT,
    OPTIONAL,
    POS,
    RATE,
    REQUIRED,
    SPEED,
    TIME,
    VANES,
    VEL,
    WIND,
    Array,
    Column,
    FlightLog,
    LogError,
)

LEAST = 100  # rows a log must have
BAD_SHARE, BAD_FEW = 0.01, 3  # rows that may be left out: this share, and at least so many


def read(path: Path) -> FlightLog:
    """Read and check a log: a table in CSV, or one of the formats of `foreign`. Raises LogError for anything that would silently
    spoil the estimate."""
    if foreign.is_foreign(path):
        return _foreign(path)
    names, rows, notes = _table(path)
    missing = [c.name for c in REQUIRED if c.name not in names]
    if missing:
        raise LogError(f"{path}: missing column {', '.join(missing)}; needed are {', '.join(c.name for c in REQUIRED)}")
    doubled = sorted({n for n in names if names.count(n) > 1})
    if doubled:
        raise LogError(f"{path}: column {', '.join(doubled)} appears more than once")
    columns = _present(names)
    lines, values, skipped = _numbers(path, names, rows, columns)
    return _log(path, columns, lines, values, skipped, len(rows), notes)


def values_of(path: Path, needed: Sequence[Column]) -> dict[str, Array]:
    """Columns [n] of a CSV table by name: the rows in which each of `needed` is believable and time advances. Raises LogError,
    naming all that the table does not have."""
    names, rows, _ = _table(path)
    missing = [c.name for c in needed if c.name not in names]
    if missing:
        raise LogError(f"{path}: not in the log: {', '.join(missing)}")
    lines, values, skipped = _numbers(path, names, rows, list(needed))
    keep, late = logcheck.advancing(lines, values[:, [c.name for c in needed].index(TIME.name)])
    _judge(path, sorted(skipped + late), len(rows))
    return dict(zip((c.name for c in needed), values[keep].T, strict=True))


def _present(names: Iterable[str]) -> list[Column]:
    """The columns a log with these names has, groups of which one is missing left out."""
    return [*REQUIRED, *(c for group in OPTIONAL if all(c.name in names for c in group) for c in group)]


def _foreign(path: Path) -> FlightLog:
    found, notes = foreign.columns(path)
    columns = _present(found)
    values = np.column_stack([found[c.name] for c in columns])
    lines = np.arange(1, len(values) + 1)
    bad: dict[int, str] = {}
    for i, c in enumerate(columns):
        x = values[:, i]
        for k in np.flatnonzero(~(np.isfinite(x) & (np.abs(x) <= c.limit) & (x >= c.lowest))).tolist():
            bad.setdefault(k, f"sample {k + 1}: column {c.name}{_cell(str(x[k]), c)[1]}")
    keep = np.setdiff1d(np.arange(len(values)), list(bad))
    if len(keep) < LEAST:
        raise LogError(f"{path}: {len(keep)} samples can be used; at least {LEAST} are needed")
    skipped = [(k + 1, text) for k, text in bad.items()]
    return _log(path, columns, lines[keep], values[keep], skipped, len(values), notes)


def _log(
    path: Path,
    columns: list[Column],
    lines: Array,
    values: Array,
    skipped: list[tuple[int, str]],
    rows: int,
    notes: tuple[str, ...],
) -> FlightLog:
    """The log of believable rows, checked for what no single row shows."""
    keep, late = logcheck.advancing(lines, values[:, 0])
    skipped += late
    skipped.sort()
    _judge(path, skipped, rows)
    data = dict(zip((c.name for c in columns), values[keep].T, strict=True))

    def stack(cols: tuple[Column, ...]) -> Array:
        return np.ascontiguousarray(np.stack([data[c.name] for c in cols], axis=-1))

    vanes = (VANES[0].name in data, VANES[1].name in data)
    zero = np.zeros(len(data[TIME.name]))
    log = FlightLog(
        name=path.name,
        t=data[TIME.name],
        euler=stack(ATT),
        w_b=stack(RATE),
        vel_n=stack(VEL),
        air=np.stack([data[SPEED.name], *(data.get(c.name, zero) for c in VANES)], axis=-1),
        wind_n=stack(WIND) if WIND[0].name in data else None,
        pos_n=stack(POS) if POS[0].name in data else None,
        vanes=vanes,
        skipped=tuple(text for _, text in skipped),
        notes=notes,
    )
    logcheck.check_time(path, log.t)
    log = logcheck.without_frozen(path, log)
    logcheck.check_motion(path, log)
    return log


def _table(path: Path) -> tuple[list[str], list[tuple[int, list[str]]], tuple[str, ...]]:
    """Names, (line, cells) of every row that is not empty, and what was noticed about the file."""
    try:
        raw = path.read_bytes()
    except OSError as e:
        raise LogError(f"{path}: cannot be read: {e.strerror}") from None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    head = text.split("\n", 1)[0]
    mark = next((m for m in (",", ";", "\t") if m in head), ",")
    notes: list[str] = []
    try:
        table = [(k, r) for k, r in enumerate(csv.reader(io.StringIO(text, newline=""), delimiter=mark), start=1) if r]
    except csv.Error as e:
        raise LogError(f"{path}: not a CSV text file: {e}") from None
    if mark != ",":
        notes.append(f"{'semicolons' if mark == ';' else 'tabs'} part the columns, a comma in a number is its point")
        table = [table[0], *((k, [c.replace(",", ".") for c in r]) for k, r in table[1:])]
    if len(table) < LEAST + 1:
        raise LogError(f"{path}: {max(len(table) - 1, 0)} samples; at least {LEAST} are needed")
    return [n.strip() for n in table[0][1]], table[1:], tuple(notes)


def _numbers(
    path: Path, names: list[str], rows: list[tuple[int, list[str]]], columns: list[Column]
) -> tuple[Array, Array, list[tuple[int, str]]]:
    """Line numbers [m], values [m,columns] of the rows in which every column is believable, and (line, fault) of the others."""
    at = [names.index(c.name) for c in columns]
    lines, good, bad = [], [], []
    for line, row in rows:
        if len(row) != len(names):
            bad.append((line, f"line {line}: {len(row)} cells, the header has {len(names)}"))
            continue
        values = []
        for i, c in zip(at, columns, strict=True):
            text, why = _cell(row[i], c)
            if why:
                bad.append((line, f"line {line}: column {c.name}{why}"))
                break
            values.append(text)
        else:
            lines.append(line)
            good.append(values)
    if not good:
        raise LogError(f"{path}: {bad[0][1]}; {len(bad)} of {len(rows)} rows cannot be used")
    return np.array(lines), np.array(good), bad


def _cell(text: str, c: Column) -> tuple[float, str]:
    """Value of a cell, and what is wrong with it."""
    try:
        x = float(text)
    except ValueError:
        return 0.0, f": '{text}' is not a number"
    if not math.isfinite(x):
        return x, f" = {x:g} must be finite"
    if abs(x) > c.limit:
        return x, f" = {x:g} beyond {c.limit:g} in magnitude: {c.hint}"
    if x < c.lowest:
        return x, f" = {x:g} must not be negative"
    return x, ""


def _judge(path: Path, skipped: list[tuple[int, str]], rows: int) -> None:
    may = max(BAD_FEW, int(BAD_SHARE * rows))
    if len(skipped) > may:
        raise LogError(
            f"{path}: {skipped[0][1]}; {len(skipped)} of {rows} rows cannot be used, allowed to leave out: {may}"
        )
    if rows - len(skipped) < LEAST:
        raise LogError(f"{path}: {rows - len(skipped)} samples can be used; at least {LEAST} are needed")
