"""A CSV as one sheet. Rows with another number of cells than the header are left out and counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from ground.columns import LogError
from ground.export.sheets import Sheet
from ground.reading.log import Log, from_zero, in_order, picked

# column that is the time -> microseconds in one
TIMES = {"t": 1e6, "t_s": 1e6, "time": 1e6, "time_s": 1e6, "timestamp": 1.0, "t_us": 1.0, "TimeUS": 1.0, "time_ms": 1e3}


def read(path: Path) -> Log:
    """Raises LogError for what is no table, or has no column of time."""
    short = 0

    def skip(_row: object) -> str:
        nonlocal short
        short += 1
        return "skip"

    with path.open("rb") as f:
        head = f.readline().decode("utf-8", "replace")
    mark = next((m for m in (",", ";", "\t") if m in head), ",")
    try:
        options = csv.ParseOptions(delimiter=mark, invalid_row_handler=skip)
        table = csv.read_csv(path, parse_options=options)
    except (pa.ArrowInvalid, OSError) as e:
        raise LogError(f"{path}: is no CSV that can be read: {e}") from None
    clock = next((c for c in table.column_names if c in TIMES), "")
    if not clock:
        raise LogError(f"{path}: no column of time; known are {', '.join(TIMES)}")
    t = table[clock].to_numpy().astype(np.float64)
    known = np.isfinite(t)
    t_us = np.where(known, np.rint(np.where(known, t, 0.0) * TIMES[clock]), 0).astype(np.int64)
    columns = {c: _column(table[c]) for c in table.column_names if c != clock}
    sheet = picked(Sheet(path.stem, t_us, columns), known)
    keep = in_order(sheet.t_us)
    damage = {"rows short or long": short, "rows without a time": int((~known).sum())}
    damage["rows out of order"] = int((~keep).sum())
    return Log("table", path.name, *from_zero([picked(sheet, keep)], []), damage)


def _column(values: pa.ChunkedArray) -> np.ndarray:
    if pa.types.is_floating(values.type) or pa.types.is_integer(values.type):
        return np.asarray(values.to_numpy())
    return np.array([str(v) if v is not None else "" for v in values.to_pylist()], dtype=object)
