"""ULog through pyulog. The format has no CRC: length and type of every message are walked over here first, and damage is counted
in bytes; rows whose time runs back or away are left out.
"""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np

from ground.columns import LogError
from ground.export.sheets import Sheet, Text
from ground.frames import need
from ground.reading.log import Log, from_zero, in_order, picked

HEADER = 16  # [byte]
KINDS = frozenset(b"BFIMPQADLCSOR")
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
LONGEST = 10_000  # [byte] readers take a longer message for damage


def walk(raw: bytes) -> tuple[int, int]:
    """(bytes that belong to no message, bytes of an unfinished last one). After damage it goes on at the next synchronisation."""
    pos, end, junk = HEADER, len(raw), 0
    while pos + 3 <= end:
        size = raw[pos] | raw[pos + 1] << 8
        if raw[pos + 2] in KINDS and 0 < size <= LONGEST:
            if pos + 3 + size > end:
                return junk, end - pos
            pos += 3 + size
            continue
        found = raw.find(SYNC, pos)
        stop = end if found < 0 else found + len(SYNC)
        junk += stop - pos
        pos = stop
    return junk, end - pos


def read(path: Path) -> Log:
    """Every topic as a sheet, `<topic>` or `<topic>/<instance>`. Raises LogError, ImportError."""
    pyulog = need("pyulog")
    junk, cut = walk(path.read_bytes())
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # it talks
            log = pyulog.ULog(str(path))
    except Exception as e:  # whatever a damaged header makes of it
        raise LogError(f"{path}: is no ULog that can be read: {type(e).__name__}: {e}") from None
    found, disordered = [], 0
    for d in log.data_list:
        t_us = d.data["timestamp"].astype(np.int64)
        name = d.name if d.multi_id == 0 else f"{d.name}/{d.multi_id}"
        sheet = Sheet(name, t_us, {k: v for k, v in d.data.items() if k != "timestamp"})
        keep = in_order(t_us)
        disordered += int((~keep).sum())
        found.append(picked(sheet, keep))
    texts = [Text(int(m.timestamp), "", m.message, max(m.log_level - ord("0"), 0)) for m in log.logged_messages]
    damage = {"bytes damaged": junk, "bytes of a cut end": cut, "rows out of order": disordered}
    damage["dropouts of the logger"] = len(log.dropouts)
    return Log("ulog", path.name, *from_zero(found, texts), damage)
