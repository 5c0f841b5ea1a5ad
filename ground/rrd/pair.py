"""Two runs in one recording: the second beside the first in every plot, under paths and in colours of its own; what is different
between their truths; what they were flown with.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ground import run as runs
from ground.columns import match
from ground.geometry import quat_euler
from ground.rrd import NOTHING_US, draw, interest, screen, tick_us
from ground.rrd.layout import Look, Plots, Tab
from ground.rrd.palette import CRAFTS, Color
from ground.rrd.series import AXIS, Array, Sink, Times
from ground.rrd.terms import laws_of
from ground.run import Run
from ground.settings import Difference, differences
from ground.views import registry
from ground.views.registry import Failed

OTHER = "other"  # root of the second run's entities
DOCUMENT = "differences"
TINT: Color = (150, 70, 220)
SHARE = 0.6  # of the tint
PERIOD_US = 100_000  # [us]


def _tinted(color: Sequence[int]) -> list[int]:
    return [round((1.0 - SHARE) * c + SHARE * t) for c, t in zip(color, TINT, strict=False)]


class Beside(Sink):
    """A recording's second run: all under `OTHER`, tinted, named by `label`."""

    def __init__(self, first: Sink, label: str) -> None:
        super().__init__(first.rec, first.start_us, first.end_us, first.tick_us)
        self.lines, self.label = first.lines, label

    def at(self, path: str) -> str:
        """Under its root."""
        return f"{OTHER}/{path}" if path != "/" else OTHER

    def series(
        self, path: str, t_us: Times, values: Array, name: str, color: Sequence[int], *rest: Any, **more: Any
    ) -> None:
        """Tinted and named."""
        super().series(path, t_us, values, f"{self.label}: {name}", _tinted(color), *rest, **more)

    def marks(self, path: str, t_us: Times, values: Array, name: str, color: Sequence[int]) -> None:
        """Tinted and named."""
        super().marks(path, t_us, values, f"{self.label}: {name}", _tinted(color))


def _truths(sink: Sink, a: Run, b: Run) -> list[str]:
    """difference/<aircraft>/...: second less first run, at times both have; aircraft drawn."""
    drawn = []
    for i, (sysid, name) in enumerate(a.names.items()):
        x, y = a.truth.get(sysid, "TRUTH"), b.truth.get(sysid, "TRUTH")
        if x is None or y is None:
            continue
        ia, ib = match(x.t_us, y.t_us)
        x, y = x.pick(ia).decimated(PERIOD_US), y.pick(ib).decimated(PERIOD_US)
        if not len(x):
            continue
        color = CRAFTS[i % len(CRAFTS)]
        sink.series(f"difference/{name}/V", x.t_us, y["V"] - x["V"], f"{name} V", color)
        sink.series(
            f"difference/{name}/altitude", x.t_us, x["pos_n"][:, 2] - y["pos_n"][:, 2], f"{name} altitude", color
        )
        away = np.linalg.norm((y["pos_n"] - x["pos_n"])[:, :2], axis=1)
        sink.series(f"difference/{name}/place", x.t_us, away, f"{name} horizontal distance", color)
        turn = quat_euler(y["q_nb"]) - quat_euler(x["q_nb"])
        turn = np.degrees(np.angle(np.exp(1j * turn)))
        for k, word in enumerate(("heading", "pitch", "bank")):
            sink.series(f"difference/{name}/{word}", x.t_us, turn[:, k], f"{name} {word}", AXIS[k])
        for k, axis in enumerate("ned"):
            wind = y["wind_n"][:, k] - x["wind_n"][:, k]
            sink.series(f"difference/{name}/wind/{axis}", x.t_us, wind, f"{name} wind {axis}", AXIS[k])
        drawn.append(name)
    return drawn


def _tab(p: Plots, names: Sequence[str]) -> Tab:
    """The tab "Differences"."""
    single = p.alone()
    return rrb.Vertical(
        rrb.TextDocumentView(origin=DOCUMENT, name="Flown with"),
        single.plot("horizontal distance of the two runs [m]", [f"difference/{a}/place" for a in names]),
        single.plot("altitude, second less first [m]", [f"difference/{a}/altitude" for a in names]),
        single.plot("true airspeed, second less first [m/s]", [f"difference/{a}/V" for a in names]),
        *(single.plot(f"{a} wind, second less first [m/s]", [f"difference/{a}/wind/**"]) for a in names),
        name="Differences",
        row_shares=[2.0, *[1.0] * (3 + len(names))],
    )


def words(a: str, b: str, found: Sequence[Difference]) -> list[str]:
    """What differs, a line for each key."""
    if not found:
        return ["flown with the same settings and seed"]
    width = max(len(k) for k, _, _ in found)
    return [f"{'':{width}}  {a} | {b}"] + [f"{k:{width}}  {x} | {y}" for k, x, y in found]


def _document(a: str, b: str, found: Sequence[Difference]) -> str:
    def cell(v: object) -> str:
        return "-" if v is None else str(v).replace("|", "\\|")

    if not found:
        return f"**{a}** and **{b}** were flown with the same settings and seed."
    rows = "\n".join(f"| {k} | {cell(x)} | {cell(y)} |" for k, x, y in found)
    return f"| key | {a} | {b} |\n|---|---|---|\n{rows}\n"


def overlay(first: Path, second: Path, out: Path, failed: Failed = None) -> list[str]:
    """Write the recording `out` of two run folders and return what they were flown with that differs, in lines.

    Raises LogError for what is no run folder, ValueError naming a file of settings that cannot be read, OSError if unwritable,
    ViewError for a view that fails; with a list for `failed` what views fail with is added there and the rest is drawn.
    """
    a, b = runs.load(first), runs.load(second)
    found = differences(first, second)
    views = registry.found(a.tlm, failed)
    end = max(a.end_us, b.end_us, NOTHING_US)
    look = Look(interest(a.tlm, end), end * 1e-6, other=OTHER)
    names = [
        n for s, n in a.names.items() if a.truth.get(s, "TRUTH") is not None and b.truth.get(s, "TRUTH") is not None
    ]
    title, tabs = f"{a.title} and {b.title}", (_tab(look.plots(), names),)
    shown = screen(a, views, laws_of(a), look, title=title, extra=tabs, failed=failed)
    with out.open("wb"):
        pass
    sink = Sink.recording(title, 0, end, tick_us(a))
    document = rr.TextDocument(_document(a.title, b.title, found), media_type=rr.MediaType.MARKDOWN)
    sink.look(DOCUMENT, document)
    _truths(sink, a, b)
    draw(sink, a, views, shown.states, failed)
    draw(Beside(sink, b.title), b, registry.found(b.tlm, failed), shown.states, failed)
    shown.fit(sink.lines)
    sink.write(out, shown.blueprint)
    return words(a.title, b.title, found)
