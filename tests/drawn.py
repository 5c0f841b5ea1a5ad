"""Lines of a recording against the signals of the run it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rerun.chunk import RrdReader

from ground import Run
from ground.rrd.lines import LINES, SHOWN


def lines(rrd: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Entity path -> times [us], values, of everything that is one line."""
    found: dict[str, list[tuple[int, float]]] = {}
    for chunk in RrdReader(str(rrd)).stream():
        batch = chunk.to_record_batch()
        names = batch.schema.names
        for column in (c for c in names if c.endswith("Scalars:scalars") and "sim_time" in names):
            at = np.array(batch.column("sim_time").cast("int64").to_pylist())
            at = (at + 500) // 1000  # of seconds as a float
            rows = zip(at.tolist(), batch.column(column).to_pylist(), strict=True)
            found.setdefault(str(chunk.entity_path).strip("/"), []).extend(
                (t, v[0]) for t, v in rows if v and len(v) == 1
            )
    arrays = {path: np.array(sorted(rows)) for path, rows in found.items() if rows}
    return {path: (a[:, 0].astype(np.int64), a[:, 1]) for path, a in arrays.items()}


def are_signals(run: Run, rrd: Path, factors: Mapping[str, float], but: frozenset[str] = frozenset()) -> set[str]:
    """Paths that are both lines of a recording and signals, or parts of one: each drawn row is a sample of it, in the unit of the
    plot. `factors`: where that is not degrees for radians, kN for N, per cent; `but`: not looked at. Raises AssertionError."""
    known = {path: (s, values) for s in run.find() if not s.is_text for path, values in s.columns().items()}
    met = set()
    for path, (t_us, drawn) in lines(rrd).items():
        if path in known and path not in but:
            s, values = known[path]
            at = np.searchsorted(s.t_us, t_us).clip(max=len(s) - 1)
            style = LINES.get("/".join(s.path.split("/")[::2])) if s.path.count("/") == 2 else None
            factor = factors.get(path, 100.0 if style and style.percent else SHOWN.get(s.unit, 1.0))
            assert np.array_equal(s.t_us[at], t_us), path
            assert np.allclose(drawn, factor * values[at], rtol=1e-5, atol=1e-6, equal_nan=True), path
            met.add(path)
    return met
