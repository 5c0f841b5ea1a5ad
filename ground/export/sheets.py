"""Signals as sheets: those of one source and aircraft share their times, and are the columns of one table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ground.signals import Signal


@dataclass(frozen=True, eq=False)
class Sheet:
    """One table. name: parts by "/"; t_us [N] sample times [us], ascending; columns [N] by name; units where known."""

    name: str
    t_us: NDArray[np.int64]
    columns: dict[str, NDArray]
    units: dict[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.t_us)

    @property
    def numbers(self) -> dict[str, NDArray]:
        """Columns that are no words."""
        return {k: v for k, v in self.columns.items() if v.dtype.kind != "O"}


@dataclass(frozen=True)
class Text:
    """A line of words: time [us], who said it, severity as in MAVLink (0 worst .. 7)."""

    t_us: int
    who: str
    text: str
    severity: int = 6


def sheets(signals: Iterable[Signal]) -> list[Sheet]:
    """Signals as sheets `<group>/<aircraft>/<source>`; a column is the rest of its path."""
    out: list[Sheet] = []
    at: dict[str, list[Sheet]] = {}
    for s in signals:
        top, name, rest = s.path.split("/", 2)
        where, sep, _ = rest.partition(f"{s.source}/")
        home = f"{top}/{name}/{where}{s.source}" if sep else f"{top}/{name}/{s.source}"
        cut = f"{home}/" if sep else f"{top}/{name}/"
        known = at.setdefault(home, [])
        sheet = next((k for k in known if np.array_equal(k.t_us, s.t_us)), None)
        if sheet is None:
            sheet = Sheet(home if not known else f"{home}-{len(known) + 1}", s.t_us, {}, {})
            known.append(sheet)
            out.append(sheet)
        for path, values in s.columns().items():
            key = path.removeprefix(cut)
            sheet.columns[key] = narrowed(values)
            if s.unit:
                sheet.units[key] = s.unit
    return out


def narrowed(values: NDArray) -> NDArray:
    """Numbers in single precision where that is all there was: same values, half the bytes."""
    if values.dtype != np.float64:
        return values
    with np.errstate(over="ignore"):
        single = values.astype(np.float32)
    return single if np.array_equal(single.astype(np.float64), values, equal_nan=True) else values
