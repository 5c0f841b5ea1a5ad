"""A log as sheets, whatever wrote it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ground.columns import LogError
from ground.export.sheets import Sheet, Text

BEGINS = {b"ULog\x01\x12\x35": "ulog", b"\xa3\x95": "dataflash"}  # first bytes -> kind
SUFFIXES = {".csv": "table", ".txt": "table"}
NEAR_US = 60_000_000  # [us] a stamp stands at most this far from those around it


@dataclass(frozen=True)
class Log:
    """What a log holds. kind: tlog, ulog, dataflash or table; damage: what was left out, by kind, in bytes, rows or packets."""

    kind: str
    title: str
    sheets: list[Sheet]
    texts: list[Text] = field(default_factory=list)
    damage: dict[str, int] = field(default_factory=dict)

    def get(self, name: str) -> Sheet | None:
        """The sheet of a name, None without one."""
        return next((s for s in self.sheets if s.name == name), None)

    @property
    def lost(self) -> str:
        """What was left out, in words; "" if nothing."""
        return ", ".join(f"{n} {what}" for what, n in self.damage.items() if n)


def kind_of(path: Path) -> str:
    """What wrote a file, by its first bytes, else by its name. Raises LogError if it cannot be read."""
    try:
        with path.open("rb") as f:
            first = f.read(8)
    except OSError as e:
        raise LogError(f"{path}: cannot be read: {e.strerror}") from None
    for begin, kind in BEGINS.items():
        if first.startswith(begin):
            return kind
    return SUFFIXES.get(path.suffix.lower(), "tlog")


def read(path: Path) -> Log:
    """A log of any kind known. Raises LogError naming the file and the reason; ImportError naming the extra that is missing."""
    reader: Callable[[Path], Log] = import_module(f"ground.reading.{kind_of(path)}").read
    return reader(path)


def in_order(t_us: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Rows whose stamp can be believed: near those around it and not behind one before."""
    n = len(t_us)
    if n < 3:
        return np.ones(n, dtype=bool)
    wide = np.pad(t_us, 2, mode="edge")
    good = np.abs(t_us - np.median(sliding_window_view(wide, 5), axis=1)) <= NEAR_US
    newest = np.maximum.accumulate(np.where(good, t_us, np.iinfo(np.int64).min))
    return good & (t_us >= newest)


def picked(sheet: Sheet, keep: NDArray[np.bool_]) -> Sheet:
    """Some rows of a sheet."""
    if keep.all():
        return sheet
    return Sheet(sheet.name, sheet.t_us[keep], {k: v[keep] for k, v in sheet.columns.items()}, sheet.units)


def from_zero(sheets: list[Sheet], texts: list[Text]) -> tuple[list[Sheet], list[Text]]:
    """Times counted from the first sample."""
    first = min((int(s.t_us[0]) for s in sheets if len(s)), default=0)
    moved = [Sheet(s.name, s.t_us - first, s.columns, s.units) for s in sheets]
    return moved, [Text(max(t.t_us - first, 0), t.who, t.text, t.severity) for t in texts]
