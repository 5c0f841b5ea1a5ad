"""Sheets as an MCAP file for Foxglove and PlotJuggler: a topic each, JSON messages with a JSON schema; words as `foxglove.Log`.

JSON, because every reader has it and field names stay as they are; zstd takes its length away again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.export.sheets import Sheet, Text
from ground.frames import need

TEXTS = "texts"
LOG = {
    "type": "object",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "level": {"type": "integer"},
        "message": {"type": "string"},
        "name": {"type": "string"},
        "file": {"type": "string"},
        "line": {"type": "integer"},
    },
}
# severity of MAVLink -> level of foxglove.Log: 5 fatal, 4 error, 3 warning, 2 info, 1 debug
LEVELS = (5, 5, 5, 4, 3, 2, 2, 1)


def _schema(sheet: Sheet) -> dict[str, Any]:
    kinds = {"O": "string", "f": "number"}
    about = {
        name: {"type": kinds.get(v.dtype.kind, "integer")} | ({"description": f"[{u}]"} if (u := sheet.units.get(name)) else {})
        for name, v in sheet.columns.items()
    }  # fmt: skip
    return {"type": "object", "properties": {"t": {"type": "number", "description": "[s]"}} | about}


def _column(values: NDArray) -> tuple[str, list[Any]]:
    """Format of a column and its values for it. What JSON cannot hold is null."""
    if values.dtype.kind == "O":
        return "%s", [json.dumps(v) for v in values.tolist()]
    if values.dtype.kind != "f":
        return "%d", values.tolist()
    digits = "%.9g" if values.dtype == np.float32 else "%.17g"
    if np.isfinite(values).all():
        return digits, values.tolist()
    return "%s", [digits % v if np.isfinite(v) else "null" for v in values.tolist()]


def rows(sheet: Sheet) -> Iterator[tuple[int, bytes]]:
    """(time [us], JSON) of every row."""
    formats, columns = zip(*(_column(v) for v in sheet.columns.values()), strict=True)
    names = (json.dumps(name).replace("%", "%%") for name in sheet.columns)
    template = '{"t":%.6f,' + ",".join(f"{n}:{f}" for n, f in zip(names, formats, strict=True)) + "}"
    for t_us, *row in zip(sheet.t_us.tolist(), *columns, strict=True):
        yield t_us, (template % (t_us / 1e6, *row)).encode()


def write(path: Path, sheets: Sequence[Sheet], texts: Sequence[Text], title: str) -> None:
    """Write an MCAP file, messages in the order of their time. Raises OSError; ImportError naming the extra."""
    writer = need("mcap.writer")
    with path.open("wb") as f:
        out = writer.Writer(f, compression=writer.CompressionType.ZSTD)
        out.start(profile="", library="wakefield")
        out.add_metadata("run", {"title": title})
        found: list[tuple[int, int, bytes]] = []
        for sheet in sheets:
            channel = _channel(out, sheet.name, sheet.name.replace("/", "."), _schema(sheet))
            found += [(t, channel, data) for t, data in rows(sheet)]
        if texts:
            channel = _channel(out, TEXTS, "foxglove.Log", LOG)
            found += [(t.t_us, channel, _log(t)) for t in texts]
        found.sort(key=lambda m: m[0])
        for number, (t_us, channel, data) in enumerate(found):
            ns = max(t_us, 0) * 1000
            out.add_message(channel_id=channel, log_time=ns, publish_time=ns, data=data, sequence=number & 0xFFFFFFFF)
        out.finish()


def _channel(out: Any, topic: str, name: str, schema: dict[str, Any]) -> int:
    known = out.register_schema(name=name, encoding="jsonschema", data=json.dumps(schema).encode())
    return int(out.register_channel(topic=f"/{topic}", message_encoding="json", schema_id=known))


def _log(t: Text) -> bytes:
    sec, us = divmod(max(t.t_us, 0), 1_000_000)
    level = LEVELS[min(max(t.severity, 0), 7)]
    stamp = {"sec": sec, "nsec": us * 1000}
    line = {"timestamp": stamp, "level": level, "message": t.text, "name": t.who, "file": "", "line": 0}
    return json.dumps(line).encode()
