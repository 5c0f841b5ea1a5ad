"""Shared by the dialect tests: one sample of field values per message."""

from __future__ import annotations

import math
import struct
from typing import Any

from flightsw.icd import wire

from .generated import mav

FLOAT_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
RANGES = {
    "uint8_t": (0, 2**8 - 1),
    "int8_t": (-(2**7), 2**7 - 1),
    "uint16_t": (0, 2**16 - 1),
    "int16_t": (-(2**15), 2**15 - 1),
    "uint32_t": (0, 2**32 - 1),
    "int32_t": (-(2**31), 2**31 - 1),
    "uint64_t": (0, 2**64 - 1),
    "int64_t": (-(2**63), 2**63 - 1),
    "float": (-FLOAT_MAX, FLOAT_MAX),
    "double": (-1.7e308, 1.7e308),
}


def kinds(name: str) -> dict[str, tuple[str, int]]:
    """Field name -> (wire type, array length or 0), in declaration order."""
    cls = mav.mavlink_map[wire.BY_NAME[name].id]
    lengths = dict(zip(cls.ordered_fieldnames, cls.array_lengths, strict=True))
    return {f: (t, lengths[f]) for f, t in zip(cls.fieldnames, cls.fieldtypes, strict=True)}


def extreme(name: str, which: int) -> dict[str, Any]:
    """Values of every field at its lower (0) or upper (1) limit, all zero (2), or NaN where there are floats (3)."""
    out: dict[str, Any] = {}
    for field, (kind, n) in kinds(name).items():
        if kind == "char":
            out[field] = ("", "x" * n, "", "short")[which]
            continue
        lo, hi = RANGES[kind]
        v = (lo, hi, 0, math.nan if kind in ("float", "double") else 1)[which]
        out[field] = (v,) * n if n else v
    return out


def generated(name: str, fields: dict[str, Any], sysid: int, compid: int, seq: int) -> bytes:
    """The same packet by the generated codec."""
    link = mav.MAVLink(None, sysid, compid)
    link.seq = seq
    values = [list(v) if isinstance(v, tuple) else (v.encode() if isinstance(v, str) else v) for v in fields.values()]
    return mav.mavlink_map[wire.BY_NAME[name].id](*values).pack(link)
