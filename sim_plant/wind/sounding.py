"""Radiosonde ascents: University of Wyoming listings (text, and the newer CSV) and SPC files, read by what their header says.

The header decides which column is what and in which unit; a level that cannot be is refused by its line, a file that holds no
wind or two ascents is refused. Levels are kept where the balloon is higher than ever before.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError

Arr = NDArray[np.float64]
KNOT = 0.514444  # [m/s]
ZERO_C = 273.15  # [K]
FALL_M = 500.0  # [m] a level lower than the highest before it by this belongs to another ascent
GAP_M = 2500.0  # [m] levels without wind over a longer stretch than this: the wind was lost there

HEIGHT, DIRECTION, SPEED, TEMPERATURE, PRESSURE = "height", "direction", "speed", "temperature", "pressure"
NEEDED = (HEIGHT, DIRECTION, SPEED)
COLUMNS = {
    "hght": HEIGHT, "geopotential height": HEIGHT, "height": HEIGHT,
    "drct": DIRECTION, "wdir": DIRECTION, "wind direction": DIRECTION,
    "sknt": SPEED, "sped": SPEED, "wspd": SPEED, "wind speed": SPEED,
    "temp": TEMPERATURE, "temperature": TEMPERATURE,
    "pres": PRESSURE, "level": PRESSURE, "pressure": PRESSURE,
}  # fmt: skip
UNITS = {
    HEIGHT: {"m": (1.0, 0.0)},
    DIRECTION: {"deg": (1.0, 0.0), "degree": (1.0, 0.0), "degrees": (1.0, 0.0)},
    SPEED: {"knot": (KNOT, 0.0), "knots": (KNOT, 0.0), "kt": (KNOT, 0.0), "kts": (KNOT, 0.0), "m/s": (1.0, 0.0)},
    TEMPERATURE: {"c": (1.0, ZERO_C), "k": (1.0, 0.0)},
    PRESSURE: {"hpa": (100.0, 0.0), "mb": (100.0, 0.0), "pa": (1.0, 0.0)},
}  # scale and offset to SI
SPC_UNITS = {
    HEIGHT: "m",
    DIRECTION: "deg",
    SPEED: "knot",
    TEMPERATURE: "C",
    PRESSURE: "hPa",
}  # the format's, not in the file
PLAUSIBLE = {  # in SI and degrees: beyond it a number is a code for "missing", another column or a misprint
    HEIGHT: (-500.0, 60e3),
    DIRECTION: (0.0, 360.0),
    SPEED: (0.0, 200.0),
    TEMPERATURE: (130.0, 340.0),
    PRESSURE: (10.0, 110e3),
}
MISSING, NO_VALUE = ("", "-", "nan", "null"), -9999.0


@dataclass(frozen=True)
class Sounding:
    """One ascent. `wind` [m,3]: height [m], north, east component [m/s, air moves towards]; `air` [k,3]: height [m], pressure
    [Pa], temperature [K]; heights ascending in both, above mean sea level. A missing pressure is not a number."""

    path: Path
    wind: Arr
    air: Arr

    def temperature(self, height_m: float) -> float:
        """Temperature [K] at a height, linear between levels. Raises ValueError outside the ascent."""
        h = self.air[:, 0]
        if len(h) == 0 or not h[0] <= height_m <= h[-1]:
            known = f"{h[0]:.0f} to {h[-1]:.0f} m" if len(h) else "none in this file"
            raise ValueError(f"{self.path}: temperature at {height_m:.0f} m; known: {known}")
        return float(np.interp(height_m, h, self.air[:, 2]))

    def lost(self, height_m: float) -> str:
        """Why there is no measured wind at a height, or "" where there is.

        Below the first level of the ascent (the station's ground) its wind counts as measured; above the last one, and where
        levels without wind stretch over more than GAP_M, it does not.
        """
        h = self.wind[:, 0]
        if height_m > h[-1]:
            return f"wind up to {h[-1]:.0f} m"
        bare = self.air[:, 0]
        if height_m < h[0]:
            ground = bool(len(bare) and bare[0] < h[0] and height_m >= bare[0])
            return f"levels from {bare[0]:.0f} m, wind from {h[0]:.0f} m only" if ground else ""
        above = int(np.searchsorted(h, height_m))
        lo, hi = float(h[max(above - 1, 0)]), float(h[above])
        if hi - lo > GAP_M and bool(((bare > lo) & (bare < hi)).any()):
            return f"no wind between {lo:.0f} and {hi:.0f} m"
        return ""


@dataclass(frozen=True)
class _Layout:
    """Where the columns of the lines below a header are: ends of fixed-width cells, or none where commas part them."""

    line: int
    at: dict[str, int]
    scale: dict[str, tuple[float, float]]
    ends: tuple[int, ...] = ()

    def cells(self, text: str) -> list[str]:
        if not self.ends:
            return [c.strip() for c in next(csv.reader([text]))]
        starts = (0, *self.ends[:-1])
        return [text[a:b].strip() for a, b in zip(starts, self.ends, strict=True)]


class _Reader:
    """One file, line by line; every error names file and line."""

    def __init__(self, path: Path, text: str) -> None:
        self.path, self.lines = path, text.splitlines()
        self.wind: list[tuple[float, float, float]] = []
        self.air: list[tuple[float, float, float]] = []
        self.layout: _Layout | None = None
        self.text_at = 0  # line of text below the levels of a listing, 0: none yet
        self.highest = -math.inf

    def error(self, line: int, text: str) -> ConfigError:
        return ConfigError(f"sounding file {str(self.path)!r}: line {line}: {text}")

    def read(self) -> Sounding:
        skip = 0
        for i, text in enumerate(self.lines):
            if i < skip:
                continue
            if (names := _header(text)) is not None:
                if self.highest > -math.inf:
                    raise self.error(i + 1, "a second ascent begins here; allowed: one ascent a file")
                self.layout, skip = self._columns(i, text, names)
            elif text.strip().upper().startswith("%END"):
                break
            elif self.layout is not None:
                self._line(i + 1, text)
        if self.layout is None:
            raise ConfigError(
                f"sounding file {str(self.path)!r}: no line names the columns; known: Wyoming listings "
                "(PRES HGHT TEMP ... DRCT SKNT), their CSV, SPC files (LEVEL,HGHT,TEMP,DWPT,WDIR,WSPD)"
            )
        if len(self.wind) < 2:
            raise self.error(
                self.layout.line, "fewer than two levels below have a height, a wind direction and a wind speed"
            )
        return Sounding(self.path, np.array(self.wind), np.array(self.air).reshape(-1, 3))

    def _columns(self, i: int, text: str, names: list[tuple[str, str, int]]) -> tuple[_Layout, int]:
        """Layout of the header in line index i, and the index of the first line that may be a level."""
        at: dict[str, int] = {}
        for k, (name, _, _) in enumerate(names):
            if (what := COLUMNS.get(name)) is not None and what not in at:
                at[what] = k
        listed = ", ".join(n for n, _, _ in names)
        if missing := [w for w in NEEDED if w not in at]:
            known = {w: " or ".join(n for n, x in COLUMNS.items() if x == w) for w in missing}
            need = "; ".join(f"{w} ({known[w]})" for w in missing)
            raise self.error(i + 1, f"columns {listed}: missing: {need}")
        commas = "," in text
        spc = not commas and any("%RAW%" in t.upper() for t in self.lines[i + 1 : i + 4])
        ends = () if commas or spc else tuple(e for _, _, e in names)
        units = {w: names[k][1] for w, k in at.items()}
        skip = i + 1
        if ends and i + 1 < len(self.lines):
            below = _Layout(i + 1, at, {}, ends).cells(self.lines[i + 1])
            if below[at[HEIGHT]].lower() in UNITS[HEIGHT]:
                units = {w: below[k] for w, k in at.items()}
                skip = i + 2
        if spc:
            units = dict(SPC_UNITS)
        scale = {}
        for w, k in at.items():
            known_units = UNITS[w]
            if units.get(w, "").lower() not in known_units:
                if w in NEEDED:
                    raise self.error(
                        skip, f"unit of column {names[k][0]} = {units.get(w, '')!r}; allowed: {', '.join(known_units)}"
                    )
                continue  # what only describes the air is left out when nobody says what it means
            scale[w] = known_units[units[w].lower()]
        return _Layout(i + 1, {w: k for w, k in at.items() if w in scale}, scale, ends), skip

    def _line(self, line: int, text: str) -> None:
        assert self.layout is not None
        bare = text.strip()
        if not bare or set(bare) <= set("-= ") or bare.startswith(("%", "<", "#")):
            return
        if self.layout.ends and not _numbers(bare):
            self.text_at = self.text_at or line  # station data and indices below a listing
            return
        if self.text_at:
            raise self.error(self.text_at, f"not a level, but levels follow in line {line}")
        cells = self.layout.cells(text)
        v = {w: self._value(line, w, cells) for w in self.layout.at}
        height = v[HEIGHT]
        if height is None:
            if v[DIRECTION] is not None and v[SPEED] is not None:
                raise self.error(line, "a wind without its height")
            return
        if height < self.highest - FALL_M:
            raise self.error(
                line, f"height {height:.0f} m after {self.highest:.0f} m: a second ascent; allowed: one ascent a file"
            )
        self.highest = max(self.highest, height)
        direction, speed, temperature, pressure = v[DIRECTION], v[SPEED], v.get(TEMPERATURE), v.get(PRESSURE)
        if direction is not None and speed is not None and (not self.wind or height > self.wind[-1][0]):
            a = math.radians(direction)
            self.wind.append((height, -speed * math.cos(a), -speed * math.sin(a)))
        if temperature is not None and (not self.air or height > self.air[-1][0]):
            self.air.append((height, math.nan if pressure is None else pressure, temperature))

    def _value(self, line: int, what: str, cells: list[str]) -> float | None:
        assert self.layout is not None
        k = self.layout.at[what]
        if k >= len(cells):
            raise self.error(line, f"{len(cells)} columns; the header has more: no {what}")
        text = cells[k]
        if text.lower() in MISSING:
            return None
        try:
            raw = float(text)
        except ValueError:
            raise self.error(line, f"{what} = {text!r}; allowed: a number, or nothing where it is missing") from None
        if raw == NO_VALUE:
            return None
        scale, offset = self.layout.scale[what]
        lo, hi = PLAUSIBLE[what]
        if not lo <= raw * scale + offset <= hi:
            a, b = (lo - offset) / scale, (hi - offset) / scale
            raise self.error(
                line, f"{what} = {text}; allowed {a:.6g} to {b:.6g}, and nothing or -9999 where it is missing"
            )
        return raw * scale + offset


def _header(text: str) -> list[tuple[str, str, int]] | None:
    """(name, unit, end of its cell) of every column when the line is a header: words, one of them a height."""
    if "," in text:
        cells = [(c.strip(), 0) for c in next(csv.reader([text]))]
    else:
        cells, at = [], 0
        for word in text.split():
            at = text.index(word, at) + len(word)
            cells.append((word, at))
    out = []
    for c, end in cells:
        name, _, unit = c.rpartition("_")
        out.append((name.lower(), unit, end) if name else (c.lower(), "", end))
    names = [n for n, _, _ in out]
    return out if len(out) >= 3 and any(COLUMNS.get(n) == HEIGHT for n in names) else None


def _numbers(text: str) -> bool:
    """Whether a line is a level: most of its words are numbers, none is a name with a colon."""
    words = text.split()
    good = 0
    for w in words:
        try:
            float(w)
            good += 1
        except ValueError:
            pass
    return ":" not in text and 2 * good > len(words)


def read(path: Path) -> Sounding:
    """The ascent in a file. Text that is not UTF-8 is taken as Latin-1: only names of places can differ.

    Raises ConfigError naming the file, the line, the value and what is allowed; OSError when it cannot be read.
    """
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return _Reader(path, text).read()
