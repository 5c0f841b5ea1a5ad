"""A log of anybody's as a Rerun recording: every number a line, words as text rows; the viewer lays it out itself, for which each
line must be an entity.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from ground.reading.log import Log
from ground.rrd.palette import CRAFTS
from ground.rrd.series import Sink

NOTHING_US = 100_000  # [us] an empty log is drawn as long


def draw(log: Log, out: Path) -> None:
    """Write the recording. Raises OSError."""
    end = max((int(s.t_us[-1]) for s in log.sheets if len(s)), default=NOTHING_US)
    with out.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    sink = Sink.recording(log.title, 0, end)
    for i, sheet in enumerate(log.sheets):
        for name, values in sheet.numbers.items():
            label = f"{name} [{u}]" if (u := sheet.units.get(name)) else name
            path, most = f"{sheet.name}/{name}", rr.components.AggregationPolicy.MinMax
            color = CRAFTS[i % len(CRAFTS)]
            sink.look(path, rr.SeriesLines(colors=[color], widths=[1.0], names=[label], aggregation_policy=most))
            sink.rows(path, sheet.t_us, rr.Scalars, scalars=values.astype(np.float64))
    if log.texts:
        at = np.array([t.t_us for t in log.texts], dtype=np.int64)
        words = [f"{t.who}: {t.text}" if t.who else t.text for t in log.texts]
        level = ["ERROR" if t.severity <= 3 else "WARN" if t.severity == 4 else "INFO" for t in log.texts]
        sink.columns("texts", at, rr.TextLog.columns(text=words, level=level))
    sink.write(out)
