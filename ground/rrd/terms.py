"""What the control laws of a run report (CONTROL_TERMS): entities ctrl/<aircraft>/<law>/..., and the tab Controller.

Below a law: <quantity>/{sent, proportional, integral, feedforward, cut, limit} of what it commands, error/ and error_integral/ of
what it controls, schedule/ of what its gains depend on. Angles in degrees, thrust in kN.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import rerun.blueprint as rrb

from flightsw.icd.codec_terms import ENUM, unit
from flightsw.icd.dialect import HOUSE
from ground.columns import Table
from ground.rrd.layout import Plots, Tab
from ground.rrd.palette import BOX, COMMAND, CRAFTS, NAV, TRUTH, Color
from ground.rrd.series import AXIS, Sink
from ground.run import Run

WORDS = HOUSE.words(ENUM)
SHOWN = {"rad": ("deg", 180.0 / math.pi), "rad/s": ("deg/s", 180.0 / math.pi), "N": ("kN", 1e-3)}
PARTS: tuple[tuple[str, Color, float], ...] = (
    ("proportional", CRAFTS[0], 1.0), ("integral", CRAFTS[1], 1.0), ("feedforward", CRAFTS[3], 1.0), ("cut", NAV, 1.0),
)  # fmt: skip
LIMIT = COMMAND  # colour of the marks where a limit is in force


@dataclass(frozen=True)
class Quantity:
    """A column of one of the message's arrays: its place there, its name, unit shown and factor to it."""

    at: int
    name: str
    unit: str
    factor: float


@dataclass(frozen=True, eq=False)
class Law:
    """One law of one aircraft: its rows, its place among those sent, what the columns of the arrays are; closed: in how many rows
    it flew; grown: what is controlled that has an integral."""

    aircraft: str
    name: str
    table: Table
    place: int
    outputs: tuple[Quantity, ...]
    controlled: tuple[Quantity, ...]
    scheduled: tuple[Quantity, ...]
    closed: int
    grown: frozenset[str]

    @property
    def path(self) -> str:
        """Entity of the law."""
        return f"ctrl/{self.aircraft}/{self.name}"

    def before(self, later: Law) -> Law:
        """This law with what a later stretch of the run adds to what is known of it."""
        return replace(self, closed=self.closed + later.closed, grown=self.grown | later.grown)


def _quantities(row: np.ndarray) -> tuple[Quantity, ...]:
    out = []
    for i, number in enumerate(row.tolist()):
        if number:
            shown, factor = SHOWN.get(unit(number), (unit(number), 1.0))
            out.append(Quantity(i, WORDS.get(number, f"quantity_{number}"), shown, factor))
    return tuple(out)


def laws_of(run: Run) -> list[Law]:
    """Every law of every aircraft, in the order they are sent."""
    out = []
    for sysid, aircraft in run.names.items():
        table = run.tlm.get(sysid, "CONTROL_TERMS")
        if table is None:
            continue
        _, first = np.unique(table["law"], return_index=True)
        for k in sorted(first.tolist(), key=lambda k: int(table["place"][k])):
            rows = table.pick(table["law"] == table["law"][k])
            name, place = table["law"][k].decode("utf-8", "replace"), int(table["place"][k])
            outputs, controlled, scheduled = (
                _quantities(table[what][k]) for what in ("output", "controlled", "scheduled")
            )
            closed = int(np.count_nonzero(rows["closed"]))
            grown = frozenset(q.name for q in controlled if np.any(rows["error_integral"][:, q.at]))
            out.append(Law(aircraft, name, rows, place, outputs, controlled, scheduled, closed, grown))
    return out


def draw(sink: Sink, found: Sequence[Law]) -> None:
    """Send the entities. What is no closed loop has feed-forward alone; a line that has begun goes on."""
    for law in found:
        d, t = law.table, law.table.t_us
        for q in law.outputs:
            at, part = f"{law.path}/{q.name}", {k: q.factor * d[k][:, q.at].astype(np.float64) for k, *_ in PARTS}
            sent = part["proportional"] + part["integral"] + part["feedforward"] - part["cut"]
            sink.series(f"{at}/sent", t, sent, "sent", TRUTH, 2.0)
            for key, color, width in PARTS:
                if key == "feedforward" or np.any(part[key]) or not sink.new(f"{at}/{key}"):
                    sink.series(f"{at}/{key}", t, part[key], key, color, width)
            limited = d["output_limit"][:, q.at] != 0
            if limited.any():
                sink.marks(f"{at}/limit", t[limited], sent[limited], "limit", LIMIT)
        for i, q in enumerate(law.controlled):
            held = d["controlled_limit"][:, q.at] != 0
            for key, words in (("error", "error"), ("error_integral", "integral of the error")):
                value = q.factor * d[key][:, q.at].astype(np.float64)
                path = f"{law.path}/{key}/{q.name}"
                if key == "error" or np.any(value) or not sink.new(path):
                    sink.series(path, t, value, f"{q.name} {words}", AXIS[i % len(AXIS)])
            if held.any():
                value = q.factor * d["error_integral"][held, q.at].astype(np.float64)
                sink.marks(f"{law.path}/error_limit/{q.name}", t[held], value, "held or at its bound", LIMIT)
        for q in law.scheduled:
            value = q.factor * d["schedule"][:, q.at].astype(np.float64)
            sink.series(f"{law.path}/schedule/{q.name}", t, value, q.name, BOX)
            out = d["schedule_limit"][:, q.at] != 0
            if out.any():
                sink.marks(f"{law.path}/schedule/{q.name}/limit", t[out], value[out], "beyond the nodes", LIMIT)


def controller_tab(p: Plots, found: Sequence[Law]) -> Tab:
    """The tab Controller: a page for each law that has flown, its outputs on the left, errors and schedule on the right; shown
    first: the one the first aircraft has flown by most."""
    closed = [law.closed for law in found]
    shown = [k for k, n in enumerate(closed) if n] or list(range(len(found)))
    first = max(
        range(len(shown)), key=lambda i: (found[shown[i]].aircraft == found[shown[0]].aircraft, closed[shown[i]])
    )
    return rrb.Vertical(rrb.Tabs(*(_page(p, found[k]) for k in shown), active_tab=first), name="Controller")


def _title(q: Quantity, what: str = "") -> str:
    return f"{q.name.replace('_', ' ')}{what}" + (f" [{q.unit}]" if q.unit else "")


def _page(p: Plots, law: Law) -> rrb.Horizontal:
    outputs = [
        p.plot(_title(q), [f"{law.path}/{q.name}/{key}" for key in ("limit", "sent", *(k for k, *_ in PARTS))])
        for q in law.outputs
    ]
    state = [p.plot(_title(q, " error"), [f"{law.path}/error/{q.name}"], legend=False) for q in law.controlled]
    grown = [q for q in law.controlled if q.name in law.grown]
    state += [
        p.plot(
            _title(q, " integral").replace("]", " s]"),
            [f"{law.path}/error_integral/{q.name}", f"{law.path}/error_limit/{q.name}"],
            legend=False,
        )
        for q in grown
    ]
    state += [
        p.plot(_title(q, " (schedule)"), [f"{law.path}/schedule/{q.name}/**"], legend=False) for q in law.scheduled
    ]
    columns = [rrb.Vertical(*column) for column in (outputs, state) if column]
    return rrb.Horizontal(*columns, name=f"{law.aircraft} {law.name.replace('_', ' ')}")
