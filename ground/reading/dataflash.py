"""ArduPilot's DataFlash `.bin`: layouts as pymavlink reads them, records found and gathered here.

The format has no CRC. A record counts only if its header is right, its type known and another header, or the end, follows its
length; rows whose time runs back or away are left out.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from pymavlink.DFReader import FORMAT_TO_STRUCT, DFFormat

from ground.columns import LogError
from ground.export.sheets import Sheet, Text
from ground.reading.log import Log, from_zero, in_order, picked

HEAD = b"\xa3\x95"
FMT, FMT_SIZE = 0x80, 89
NUMPY = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "f": "<f4", "d": "<f8", "q": "<i8", "Q": "<u8",
         "e": "<f2", "4s": "S4", "16s": "S16", "64s": "S64"}  # fmt: skip
TIMES = {"TimeUS": 1, "TimeMS": 1000}  # column -> microseconds in one


def read(path: Path) -> Log:
    """Every message with a time as a sheet, `<NAME>` or `<NAME>/<instance>`. Raises LogError."""
    raw = path.read_bytes()
    formats, offsets, junk, cut = _walk(raw)
    if not offsets or junk > len(raw) // 2:
        raise LogError(f"{path}: is no DataFlash log: {junk} of {len(raw)} bytes belong to no record")
    _units(raw, formats, offsets)
    found: list[Sheet] = []
    disordered = 0
    for kind, at in offsets.items():
        f = formats[kind]
        clock = next((c for c in f.columns if c in TIMES), "")
        if not clock or kind == FMT:
            continue
        data = _gather(raw, np.array(at), f)
        t_us = data.pop(clock).astype(np.int64) * TIMES[clock]
        units = dict(zip(f.columns, f.units or (), strict=False))
        sheet = Sheet(f.name, t_us, data, {k: u for k, u in units.items() if u and k in data})
        for part in _instances(sheet, f.instance_field):
            keep = in_order(part.t_us)
            disordered += int((~keep).sum())
            found.append(picked(part, keep))
    texts = [
        Text(int(t), "", str(words))
        for s in found if s.name == "MSG" and "Message" in s.columns
        for t, words in zip(s.t_us, s.columns["Message"], strict=True)
    ]  # fmt: skip
    damage = {"bytes damaged": junk, "bytes of a cut end": cut, "rows out of order": disordered}
    return Log("dataflash", path.name, *from_zero(found, texts), damage)


def _walk(raw: bytes) -> tuple[dict[int, Any], dict[int, list[int]], int, int]:
    """(formats, offsets of the payloads by type, bytes damaged, bytes of an unfinished last record)."""
    formats: dict[int, Any] = {FMT: DFFormat(FMT, "FMT", FMT_SIZE, "BBnNZ", "Type,Length,Name,Format,Columns")}
    sizes, offsets = {FMT: FMT_SIZE}, dict[int, list[int]]()
    pos = junk = 0
    end = len(raw)

    def sound(at: int) -> int:
        """Where the record that begins at `at` ends, 0 if none begins there."""
        size = sizes.get(raw[at + 2], 0) if at + 3 <= end and raw[at] == 0xA3 and raw[at + 1] == 0x95 else 0
        stop = at + size
        return stop if size and (stop == end or raw.startswith(HEAD, stop)) else 0

    while pos < end:
        stop = sound(pos)
        if not stop:
            if end - pos < 256 and raw.startswith(HEAD, pos) and pos + sizes.get(raw[min(pos + 2, end - 1)], 3) > end:
                return formats, offsets, junk, end - pos
            found = raw.find(HEAD, pos + 1)
            while found >= 0 and not sound(found):
                found = raw.find(HEAD, found + 1)
            junk += (end if found < 0 else found) - pos
            pos = end if found < 0 else found
            continue
        kind = raw[pos + 2]
        offsets.setdefault(kind, []).append(pos + 3)
        if kind == FMT:
            _define(raw, pos + 3, formats, sizes)
        pos = stop
    return formats, offsets, junk, 0


def _define(raw: bytes, at: int, formats: dict[int, Any], sizes: dict[int, int]) -> None:
    """A FMT record: the layout of another. One that contradicts itself defines nothing."""
    kind, size = raw[at], raw[at + 1]
    name, text, columns = (
        raw[at + a : at + b].split(b"\0")[0].decode("ascii", "replace") for a, b in ((2, 6), (6, 22), (22, 86))
    )
    if not all(c in FORMAT_TO_STRUCT for c in text):
        return
    length = 3 + sum(np.dtype(NUMPY[FORMAT_TO_STRUCT[c][0]]).itemsize for c in text)
    if length == size and len([c for c in columns.split(",") if c]) == len(text):
        formats[kind], sizes[kind] = DFFormat(kind, name, size, text, columns), size


def _gather(raw: bytes, at: np.ndarray, f: Any) -> dict[str, np.ndarray]:
    """Columns of the records whose payloads stand at `at`, scaled as the format says."""
    dtype = np.dtype([(c, NUMPY[FORMAT_TO_STRUCT[k][0]]) for c, k in zip(f.columns, f.format, strict=True)])
    window = sliding_window_view(np.frombuffer(raw, dtype=np.uint8), dtype.itemsize)
    rows = np.ascontiguousarray(window[at]).view(dtype).ravel()
    out: dict[str, np.ndarray] = {}
    for name, kind in zip(f.columns, f.format, strict=True):
        values, factor = rows[name], FORMAT_TO_STRUCT[kind][1]
        if kind == "a":
            numbers = (
                np.ascontiguousarray(values).view("<i2").reshape(len(rows), -1) if len(rows) else np.empty((0, 32))
            )
            out |= {f"{name}/{i}": numbers[:, i] for i in range(numbers.shape[1])}
        elif values.dtype.kind == "S":
            out[name] = np.array([b.decode("utf-8", "replace") for b in values.tolist()], dtype=object)
        else:
            out[name] = values.astype(np.float64) * factor if factor else values
    return out


def _units(raw: bytes, formats: dict[int, Any], offsets: dict[int, list[int]]) -> None:
    """Units and instances, from the records UNIT and FMTU where the log has them."""
    by_name = {f.name: f for f in formats.values()}

    def columns(name: str) -> dict[str, np.ndarray]:
        f = by_name.get(name)
        return _gather(raw, np.array(offsets[f.type]), f) if f is not None and offsets.get(f.type) else {}

    unit, fmtu = columns("UNIT"), columns("FMTU")
    words = {chr(int(k)): str(v) for k, v in zip(unit.get("Id", ()), unit.get("Label", ()), strict=True)}
    for kind, ids in zip(fmtu.get("FmtType", ()), fmtu.get("UnitIds", ()), strict=True):
        if int(kind) in formats:
            formats[int(kind)].set_unit_ids(str(ids), words)


def _instances(sheet: Sheet, column: str | None) -> list[Sheet]:
    """A sheet for each instance of a sensor."""
    if column is None or column not in sheet.columns:
        return [sheet]
    of = sheet.columns[column]
    found = np.unique(of).tolist()
    parts = [picked(sheet, of == k) for k in found]
    return [Sheet(f"{p.name}/{k}", p.t_us, p.columns, p.units) for k, p in zip(found, parts, strict=True)]
