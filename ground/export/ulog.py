"""Sheets as a ULog file, for PlotJuggler, pyulog and PX4's tools, written from the format's public description (docs.px4.io, ULog
file format, version 1).

A sheet is one logged message, its columns the fields; lines of words are logged strings, settings parameters. Columns of words
have no place in the format: what they say is in the strings.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ground.export.sheets import Sheet, Text

MAGIC = b"ULog\x01\x12\x35\x01"
TYPES = {
    "i1": "int8_t", "u1": "uint8_t", "i2": "int16_t", "u2": "uint16_t", "i4": "int32_t", "u4": "uint32_t", "i8": "int64_t",
    "u8": "uint64_t", "f4": "float", "f8": "double",
}  # fmt: skip
LONGEST = 8000  # [byte] of a message; readers take one of more than 10000 for damage
SEVERITY = "01234567"  # levels are those of Linux, MAVLink's too


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<Hc", len(body), kind.encode()) + body


def _info(kind: str, key: str, value: bytes, message: str = "I") -> bytes:
    name = f"{kind} {key}".encode()
    return _message(message, bytes((len(name),)) + name + value)


def _name(text: str, taken: set[str]) -> str:
    """A name the format allows, unlike those taken."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", text)
    name, n = plain, 1
    while name in taken:
        n += 1
        name = f"{plain}_{n}"
    taken.add(name)
    return name


def _dtype(sheet: Sheet) -> np.dtype:
    taken = {"timestamp"}
    own = [(_name(k, taken), v.dtype.newbyteorder("<")) for k, v in sheet.numbers.items()]
    return np.dtype([("timestamp", "<u8"), *own])


def _definitions(formats: Mapping[str, np.dtype], title: str, settings: Mapping[str, object]) -> Iterator[bytes]:
    yield _message("B", bytes(40))
    yield _info(f"char[{len(title.encode())}]", "sys_name", title.encode())
    for name, dtype in formats.items():
        fields = "".join(f"{TYPES[dtype[k].str[1:]]} {k};" for k in dtype.names or ())
        yield _message("F", f"{name}:{fields}".encode())
    for key, value in settings.items():
        if isinstance(value, (bool, int)) and abs(value) < 1 << 31:
            yield _info("int32_t", key, struct.pack("<i", int(value)), "P")
        elif isinstance(value, float) and abs(value) < 3e38:
            yield _info("float", key, struct.pack("<f", value), "P")


def _rows(sheet: Sheet, dtype: np.dtype, number: int) -> list[bytes]:
    """Every row as a data message."""
    whole = np.dtype([("size", "<u2"), ("kind", "S1"), ("number", "<u2"), ("row", dtype)])
    out = np.zeros(len(sheet), dtype=whole)
    out["size"], out["kind"], out["number"] = 2 + dtype.itemsize, b"D", number
    out["row"]["timestamp"] = np.maximum(sheet.t_us, 0)
    for name, values in zip((dtype.names or ())[1:], sheet.numbers.values(), strict=True):
        out["row"][name] = values
    raw, size = out.tobytes(), whole.itemsize
    return [raw[i : i + size] for i in range(0, len(raw), size)]


def write(
    path: Path, sheets: Sequence[Sheet], texts: Sequence[Text], title: str, settings: Mapping[str, object] | None = None
) -> None:
    """Write a ULog file, messages in the order of their time. settings: numbers among them become parameters (single precision,
    as the format has it). Raises OSError."""
    taken: set[str] = set()
    shown = [s for s in sheets if s.numbers and len(s)]
    parts = [p for s in shown for p in _fitting(s)]
    formats = {_name(p.name, taken): _dtype(p) for p in parts}
    first = min((int(s.t_us[0]) for s in shown), default=0)
    data: list[tuple[int, bytes]] = []
    for number, (p, dtype) in enumerate(zip(parts, formats.values(), strict=True)):
        data += zip(p.t_us.tolist(), _rows(p, dtype, number), strict=True)
    for t in texts:
        body = SEVERITY[min(max(t.severity, 0), 7)].encode() + struct.pack("<Q", max(t.t_us, 0))
        data.append((t.t_us, _message("L", body + f"{t.who}: {t.text}".encode())))
    data.sort(key=lambda m: m[0])
    with path.open("wb") as f:
        f.write(MAGIC + struct.pack("<Q", max(first, 0)))
        f.writelines(_definitions(formats, title, settings or {}))
        for number, name in enumerate(formats):
            f.write(_message("A", struct.pack("<BH", 0, number) + name.encode()))
        f.writelines(m for _, m in data)


def _fitting(sheet: Sheet) -> Iterator[Sheet]:
    """The sheet in parts whose definition and rows fit into a message."""
    part: dict[str, np.ndarray] = {}
    size = text = 0
    for key, values in sheet.numbers.items():
        if part and (size + values.itemsize > LONGEST or text + len(key) + 16 > LONGEST):
            yield Sheet(sheet.name, sheet.t_us, part, sheet.units)
            part, size, text = {}, 0, 0
        part[key] = values
        size, text = size + values.itemsize, text + len(key) + 16
    yield Sheet(sheet.name, sheet.t_us, part, sheet.units)
