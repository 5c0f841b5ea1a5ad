"""Number cells of the rendezvous report: campaign values are SI, the reader sees nautical miles, knots or percent."""

from __future__ import annotations

import math
from html import escape

from ground.report import page as p
from ground.report.cases import CaseOf, Cases
from ground.report.figures import Point
from ground.report.load import Stat, finite
from ground.report.rivard.page import NM


def scaled(stat: Stat, scale: float, sign: float = 1.0, digits: int = 3, css: str = "") -> str:
    """A number cell in units of `scale` (SI per unit) times sign; `data-value` is the campaign's own SI value."""
    if stat.value is None:
        return p.blank(stat.why)
    v = sign * stat.value / scale
    ci = ""
    if stat.lo is not None and stat.hi is not None:
        lo, hi = sorted((sign * stat.lo / scale, sign * stat.hi / scale))
        ci = f"<small>{lo:.{digits}f} … {hi:.{digits}f}</small>"
    data = f'data-key="{escape(stat.key, quote=True)}" data-value="{stat.value!r}" data-scale="{sign * scale!r}"'
    return f'<td class="{("num " + css).strip()}" {data}>{v:.{digits}f}{ci}</td>'


def nm(case: CaseOf | None, value: str, sign: float = 1.0, css: str = "") -> str:
    """A value of a case in NM."""
    return p.blank() if case is None else scaled(case.stat(value), NM, sign, css=css)


def percent(case: CaseOf | None, value: str, css: str = "") -> str:
    """A share of a case in percent."""
    return p.blank() if case is None else scaled(case.stat(value), 0.01, digits=2, css=css)


def count(case: CaseOf | None) -> str:
    """Number of rendezvous of a case."""
    n = None if case is None else case.campaign.summary.get(f"{case.name}.rendezvous")
    return p.blank() if n is None else p.plain(int(n))


def words(text: str, css: str = "", below: str = "") -> str:
    """A number cell of ready text with a small line below."""
    small = f"<small>{escape(below)}</small>" if below else ""
    return f'<td class="{("num " + css).strip()}">{escape(text)}{small}</td>'


def number(case: CaseOf | None, value: str) -> float | None:
    """The bare value of a case, None without."""
    return None if case is None else case.stat(value).value


def average(case: CaseOf | None, value: str) -> float | None:
    """The mean over batches of a value, also of one whose name says "rms"; None without."""
    return None if case is None else finite(case.campaign.summary.get(f"{case.name}.{value}.mean"))


def point(cases: Cases, name: str, value: str, x: float, scale: float = NM) -> Point | None:
    """A point for a figure, None without; NaN where all runs were lost."""
    case = cases.named(name)
    s = None if case is None else case.stat(value)
    if s is not None and s.value is None and s.why:
        return Point(x, math.nan, lost=1.0)
    if s is None or s.value is None:
        return None
    return Point(x, s.value / scale, None if s.lo is None else s.lo / scale, None if s.hi is None else s.hi / scale)


def times(case: CaseOf, value: str) -> list[float]:
    """Sample times [s] at which a case has `value`."""
    have = case.params.get("times_s", [])
    return [t for t in have if case.stat(f"t{t:.0f}.{value}").value is not None]
