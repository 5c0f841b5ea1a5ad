"""The scenario's [expect] bounds against summary.json, and the tables shown at the end of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from flightsw.strict import ConfigError
from hil_scripts.launch.screen import verdict


@dataclass(frozen=True)
class Check:
    """One bound and what was measured; `measured` is None when the summary has no such key."""

    key: str
    bound: str
    measured: Any
    ok: bool


def flatten(tree: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables as flat dotted keys; a table holding only `min`/`max` is a bound and stays whole."""
    out: dict[str, Any] = {}
    for k, v in tree.items():
        if isinstance(v, dict) and not set(v) <= {"min", "max"}:
            out |= flatten(v, f"{prefix}{k}.")
        else:
            out[prefix + k] = v
    return out


def evaluate(expect: dict[str, Any], summary: dict[str, Any]) -> list[Check]:
    """Check every bound. A number is an upper bound, [lo, hi] or {min, max} a band, a text or bool must be equal.

    Raises ConfigError when a bound is none of these. A missing measurement fails.
    """
    return [_check(k, b, summary.get(k)) for k, b in flatten(expect).items()]


def _check(key: str, bound: Any, value: Any) -> Check:
    if isinstance(bound, (str, bool)):
        return Check(key, f"= {bound}", value, value == bound)
    if isinstance(bound, (int, float)):
        lo, hi = -math.inf, float(bound)
    elif isinstance(bound, dict):
        lo, hi = float(bound.get("min", -math.inf)), float(bound.get("max", math.inf))
    elif isinstance(bound, (list, tuple)) and len(bound) == 2:
        lo, hi = float(bound[0]), float(bound[1])
    else:
        raise ConfigError(
            f"expect.{key} = {bound!r}: allowed: a number (upper bound), [low, high], {{min, max}}, a text"
        )
    text = f"<= {hi:g}" if lo == -math.inf else f">= {lo:g}" if hi == math.inf else f"{lo:g} .. {hi:g}"
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return Check(key, text, value, number and lo <= value <= hi)  # NaN compares false and fails


def _text(v: Any) -> str:
    if v is None:
        return "-"
    return f"{v:.4g}" if isinstance(v, float) else str(v)


def show_checks(console: Console, checks: list[Check]) -> None:
    """Table of bound against measured."""
    t = Table(title="scenario bounds", title_justify="left")
    for head, just in (("quantity", "left"), ("bound", "right"), ("measured", "right"), ("", "left")):
        t.add_column(head, justify=just, no_wrap=True)  # type: ignore[arg-type]
    for c in checks:
        t.add_row(c.key, c.bound, _text(c.measured), verdict(c.ok, "ok", "violated"))
    console.print(t)


def show_summary(console: Console, summary: dict[str, Any]) -> None:
    """Table of summary.json; keys that differ in their last part only share a row, empty figures are left out."""
    rows: dict[str, dict[str, Any]] = {}
    for key, v in summary.items():
        head, _, last = key.rpartition(".")
        if len(last) == 1 and head:
            rows.setdefault(f"{head}.", {})[last] = v
        else:
            rows[key] = {"": v}
    t = Table(title="summary", title_justify="left")
    t.add_column("quantity", no_wrap=True)
    t.add_column("value", justify="right")
    for key, vals in rows.items():
        if any(v is not None for v in vals.values()):
            t.add_row(key + "|".join(vals), "  ".join(_text(v) for v in vals.values()))
    console.print(t)
