"""`.tlog` of anybody: messages of our dialect by its own layout, others by pymavlink's (ArduPilot's and the common set)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from flightsw.icd.framing import crc
from flightsw.icd.scan import Records
from flightsw.icd.tlog import EPOCH_US, TlogError, records
from ground.columns import Columns, LogError, gathered
from ground.columns import of as columns_of
from ground.export.sheets import Sheet, Text
from ground.export.sheets import sheets as sheets_of
from ground.reading.log import Log, from_zero, in_order, picked
from ground.signals import fields

OURS_US = 30 * 86_400_000_000  # [us] a stamp this near to that of sample time 0 is one of ours
NUMPY = {
    "b": "i1",
    "B": "u1",
    "h": "<i2",
    "H": "<u2",
    "i": "<i4",
    "I": "<u4",
    "q": "<i8",
    "Q": "<u8",
    "f": "<f4",
    "d": "<f8",
}


def read(path: Path) -> Log:
    """Every message of every system, `<system>/<MESSAGE>`. Raises LogError."""
    try:
        log = records(path)
    except TlogError as e:
        raise LogError(str(e)) from e
    known = columns_of(log)
    signals = [s for k in known.sysids() for s in fields(known, (k,), f"message/{k}")]
    found = [Sheet(s.name.removeprefix("message/"), s.t_us, s.columns, s.units) for s in sheets_of(signals)]
    others, damage = _others(log)
    found += others
    damage |= {"bytes damaged": log.junk_bytes, "stamps damaged": log.bad_stamps}
    out = []
    for s in found:
        keep = in_order(s.t_us)
        damage["rows out of order"] = damage.get("rows out of order", 0) + int((~keep).sum())
        out.append(picked(s, keep))
    texts = _texts(known)
    first = min((int(s.t_us[0]) for s in out if len(s)), default=0)
    if abs(first) > OURS_US:
        out, texts = from_zero(out, texts)
    return Log("tlog", path.name, out, texts, damage)


def _texts(log: Columns) -> list[Text]:
    out = []
    for (sysid, message), t in log.tables.items():
        if message == "STATUSTEXT":
            for at, text, severity in zip(t.t_us, t["text"], t["severity"], strict=True):
                out.append(Text(int(at), f"system {sysid}", text.decode("utf-8", "replace"), int(severity)))
    return sorted(out, key=lambda x: x.t_us)


@cache
def _stock() -> Mapping[int, Any]:
    from pymavlink.dialects.v20 import ardupilotmega  # slow to import

    return ardupilotmega.mavlink_map


def _layout(message: Any) -> tuple[np.dtype, dict[str, str]]:
    """Layout of a stock message in the order of the wire, and its units."""
    spec: list[tuple[Any, ...]] = []
    codes = bytes(message.native_format).decode().removeprefix("<")
    for name, code, length in zip(message.ordered_fieldnames, codes, message.array_lengths, strict=True):
        if code in "cs":
            spec.append((name, f"S{max(length, 1)}"))
        else:
            spec.append((name, NUMPY[code], (length,)) if length else (name, NUMPY[code]))
    return np.dtype(spec), dict(message.fieldunits_by_name)


def _others(log: Records) -> tuple[list[Sheet], dict[str, int]]:
    """Sheets of messages that only the stock dialect has, each packet's CRC checked; how many nobody knows or are damaged."""
    odd = np.flatnonzero(~log.known)
    damage = {"packets of unknown messages": 0, "packets damaged": 0}
    if not len(odd):
        return [], damage
    rows: dict[tuple[int, int], list[int]] = {}
    for k in odd.tolist():
        mid = int(log.msgid[k])
        if mid not in _stock():
            damage["packets of unknown messages"] += 1
            continue
        end = int(log.payload[k] + log.length[k])
        body = log.raw[int(log.head[k]) + 1 : end] + bytes((_stock()[mid].crc_extra,))
        if crc(body) != int.from_bytes(log.raw[end : end + 2], "little"):
            damage["packets damaged"] += 1
            continue
        rows.setdefault((int(log.sysid[k]), mid), []).append(k)
    out = []
    for (sysid, mid), index in rows.items():
        message, at = _stock()[mid], np.array(index)
        dtype, units = _layout(message)
        data = gathered(log.raw, log.payload[at], log.length[at], dtype)
        columns: dict[str, np.ndarray] = {}
        for name in dtype.names or ():
            values = data[name]
            if values.dtype.kind == "S":
                columns[name] = np.array([b.decode("utf-8", "replace") for b in values.tolist()], dtype=object)
            elif values.ndim > 1:
                columns |= {f"{name}/{i}": values[:, i] for i in range(values.shape[1])}
            else:
                columns[name] = values
        t_us = (log.stamp[at] & ~3) - EPOCH_US
        out.append(Sheet(f"{sysid}/{message.msgname}", t_us, columns, {k: v for k, v in units.items() if k in columns}))
    return out, damage
