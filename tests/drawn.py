"""What a recording holds, lines under paths of their own; its lines against the signals of the run it was made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
from rerun.chunk import RrdReader

from ground import Run
from ground.rrd.lines import LINES, SHOWN


def tables(rrd: Path) -> Iterator[tuple[str, pa.RecordBatch, dict[str, str]]]:
    """Chunks of a recording: entity, rows, and of every column that is a line of its own the path of that line."""
    for chunk in RrdReader(str(rrd)).stream():
        batch, entity = chunk.to_record_batch(), str(chunk.entity_path)
        own = {}
        for f in batch.schema:
            kind = (f.metadata or {}).get(b"rerun:archetype", b"rerun").decode()
            if f.name == "Scalars:scalars" or (f.name.endswith(":scalars") and not kind.startswith("rerun")):
                own[f.name] = entity if f.name == "Scalars:scalars" else f"{entity.rstrip('/')}/{kind}"
        yield entity, batch, own


def rows(rrd: Path) -> dict[str, int]:
    """Path -> rows, of entities and of lines."""
    out: dict[str, int] = {}
    for entity, batch, own in tables(rrd):
        builtin = [f for f in batch.schema if (f.metadata or {}).get(b"rerun:archetype", b"").startswith(b"rerun")]
        for path in {*own.values(), *([entity] if builtin else [])}:
            out[path] = out.get(path, 0) + batch.num_rows
    return out


def lines(rrd: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Path -> times [us], values, of everything that is one line."""
    found: dict[str, list[tuple[int, float]]] = {}
    for _, batch, own in tables(rrd):
        for column, path in own.items():
            at = batch.column("sim_time").cast("int64").to_numpy() // 1000
            values = zip(at.tolist(), batch.column(column).to_pylist(), strict=True)
            found.setdefault(path.strip("/"), []).extend((t, v[0]) for t, v in values if v and len(v) == 1)
    arrays = {path: np.array(sorted(values)) for path, values in found.items() if values}
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
