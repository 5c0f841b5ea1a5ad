"""A run that goes on, drawn as it flies: the calls that draw a whole run, over and over, each with the last stretch of it.

Telemetry comes as datagrams or from its log; truth, what the sensors gave and what was made to fail from the logs of the run
folder as they grow. Every row is sent once. What the drawing of a row needs of the past a view says (`View.memory_s`).
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import rerun as rr

from flightsw.icd.damage import LogDamageWarning
from flightsw.icd.signing import Signing
from ground import run as runs
from ground.columns import Columns, LogError
from ground.folder import LOGS
from ground.rrd import Screen, draw, screen, tick_us
from ground.rrd.common import COMMON
from ground.rrd.layout import Look
from ground.rrd.live import Live
from ground.rrd.series import APPLICATION
from ground.rrd.terms import Law, laws_of
from ground.run import GROUND, PLANT_LOG, Run, link_log, names_of
from ground.views import registry
from ground.views.base import View
from ground.views.registry import asked
from ground.whole import scenario
from ground.window import Tail, Telemetry

TURNS = 10  # batches in which plots have their turn: of the views, then each of `COMMON`; scenes move in every batch
LAG_US = 10_000_000  # [us] a log is waited for that long, then the others go on without it
TRUTH, TLM = LOGS


@dataclass(frozen=True, eq=False)
class Part(Run):
    """A stretch of a run, with the names of all its aircraft."""

    known: Mapping[int, str] = field(default_factory=dict)
    said: Columns = field(default_factory=Columns)
    links: Mapping[str, Columns] = field(default_factory=dict)

    @property
    def names(self) -> dict[int, str]:  # type: ignore[override]
        """Every aircraft by system id, also one that is silent in this stretch."""
        return dict(self.known)

    @property
    def plant(self) -> Columns:  # type: ignore[override]
        """What the plant said in this stretch."""
        return self.said

    def link(self, name: str) -> Columns:
        """What came over an aircraft's link in this stretch."""
        return self.links.get(name, Columns())


class Flow:
    """Sources of a run that goes on, and what is known of it. `folder`: its run folder, None: there is only telemetry. `signing`:
    of the telemetry's link. What views fail with is added to `failed`."""

    def __init__(self, folder: Path | None, by_log: bool = False, signing: Signing | None = None) -> None:
        self.folder = folder or Path("live")
        self.tlm: Telemetry | Tail = Tail(self.folder / TLM) if by_log else Telemetry(signing)
        self.tails = {name: Tail(self.folder / name) for name in (TRUTH, PLANT_LOG)} if folder else {}
        self.names: dict[int, str] = {}
        self.views: dict[str, View] = {}
        self.estimating: set[int] = set()
        self.laws: dict[str, Law] = {}
        self.failed: list[str] = []
        self.marks: dict[str, int] = {}  # log -> time [us] it had reached at the last batch
        self._seen_us = -1

    @property
    def every(self) -> dict[str, Telemetry | Tail]:
        """All sources by the names of their logs."""
        return {TLM: self.tlm, **self.tails}

    def take(self) -> bool:
        """Decode what has come in; whether what is shown has to be laid out anew."""
        self.tlm.settle() if isinstance(self.tlm, Telemetry) else self.tlm.take()
        for tail in list(self.tails.values()):
            tail.take()
        new = self.tlm.stretch.since(self._seen_us + 1)
        self._seen_us = max(self.tlm.stretch.newest().values(), default=self._seen_us)
        before = self._known()
        crafts = scenario(self.folder).get("aircraft", [])
        true = self.tails[TRUTH].stretch.newest("TRUTH") if self.tails else {}
        sysids = (
            {int(a["sysid"]) for a in crafts if "sysid" in a}
            | set(self.names)
            | set(true)
            | set(new.sysids()) - {GROUND}
        )
        if sysids != set(self.names):
            self.names = names_of(self.folder, sorted(sysids))
            if self.tails:
                self.tails |= {
                    link_log(n): Tail(self.folder / link_log(n))
                    for n in self.names.values()
                    if link_log(n) not in self.tails
                }
        self.know(Part(self.folder, Columns(), new, known=self.names))
        return before != self._known()

    def know(self, run: Run) -> None:
        """Whose messages are in a stretch of the run."""
        found = registry.found(run.tlm, self.failed)
        self.views = {n: v for n, v in registry.views().items() if n in self.views or n in found}
        self.estimating |= {s for s, message in run.tlm.tables if message == "NAV_STATE"}
        for law in laws_of(run):
            old = self.laws.get(law.path)
            self.laws[law.path] = law if old is None else old.before(law)

    def _known(self) -> tuple[object, ...]:
        """What the layout depends on."""
        laws = {(path, law.closed > 0, law.grown) for path, law in self.laws.items()}
        return len(self.names), len(self.views), len(self.estimating), laws

    @property
    def end_us(self) -> int:
        """Newest time [us] of telemetry and truth."""
        return max([0, *(t for s in (TLM, TRUTH) if s in self.every for t in self.every[s].stretch.newest().values())])

    def part(self, memory_s: float, whole: bool = False) -> Part:
        """What is new since `done`, and as much of the past before it. The truth goes as far as what is heard, unless `whole`."""
        memory = int(memory_s * 1e6)
        heard = [] if whole else self.tlm.stretch.newest("MISSION_STATUS").values()
        first = min([self.marks.get(TLM, 0), self.marks.get(TRUTH, self.marks.get(TLM, 0))])
        first = max(first, self.marks.get(TLM, 0) - LAG_US) - memory
        cut = {
            n: t.stretch.since(
                first if n == TRUTH else self.marks.get(n, 0) - memory, min(heard, default=None) if n == TRUTH else None
            )
            for n, t in self.tails.items()
        }
        links = {n: cut[link_log(n)] for n in self.names.values() if link_log(n) in cut}
        tlm = self.tlm.stretch.since(first)
        said = cut.get(PLANT_LOG, Columns())
        return Part(self.folder, cut.get(TRUTH, Columns()), tlm, known=self.names, said=said, links=links)

    def reached(self) -> dict[str, int]:
        """How far [us] each log has come."""
        return {name: min(source.stretch.newest().values(), default=0) for name, source in self.every.items()}

    def done(self, drawn: dict[str, int]) -> None:
        """Everything has been drawn up to there: forget what no drawing will need."""
        keep = 1e6 * max([View.memory_s, *(v.memory_s for v in self.views.values())])
        self.marks |= drawn
        oldest = min(self.marks.get(TLM, 0), self.marks.get(TRUTH, self.marks.get(TLM, 0)))
        for name, source in self.every.items():
            mark = self.marks.get(name, 0)
            base = oldest if name in LOGS else mark
            source.stretch.forget(int(max(base, mark - LAG_US) - keep))

    def begun(self) -> Run | None:
        """All that the run folder has by now; None without one or while there is nothing in it."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", LogDamageWarning)  # the last record is being written
                run = runs.load(self.folder) if self.tails else None
        except (LogError, OSError):
            return None
        return run if run is not None and run.end_us else None


class Picture:
    """A picture of a flow in one recording: blueprint, then batch after batch."""

    def __init__(self, flow: Flow, title: str, rec: rr.RecordingStream) -> None:
        self.flow, self.title, self.rec = flow, title, rec
        self.sink = Live(rec, tick_us(flow.part(0.0)))
        self.shown: Screen | None = None
        self._turn = 0
        self._drawn: dict[str, int] = {}  # what the first turn of the round could see

    @classmethod
    def sent_to(cls, flow: Flow, title: str, url: str) -> Picture:
        """One that a viewer shows; `url`: where it listens."""
        rec = rr.RecordingStream(APPLICATION, recording_id=title)
        rec.connect_grpc(url)
        return cls(flow, title, rec)

    def lay_out(self) -> None:
        """Send the blueprint of what is known now."""
        part = self.flow.part(View.memory_s)
        end_s = float(scenario(self.flow.folder).get("meta", {}).get("duration_s", 0.0)) or self.flow.end_us * 1e-6
        flow, look = self.flow, Look((0.0, end_s), end_s, live=True)
        order = list(flow.names.values())
        laws = [law for law in flow.laws.values() if law.aircraft in order]
        laws.sort(key=lambda law: (order.index(law.aircraft), law.place))
        self.shown = screen(part, flow.views, laws, look, title=self.title, failed=flow.failed)
        self.shown.fit(self.sink.lines)
        self.rec.send_blueprint(self.shown.blueprint)

    def _fit(self) -> None:
        """Send the blueprint again if there are lines now that its plots did not know of."""
        if self.shown is not None and self.shown.fit(self.sink.lines):
            self.rec.send_blueprint(self.shown.blueprint)

    def catch_up(self) -> None:
        """Send what the run folder has already."""
        run = self.flow.begun()
        if run is None:
            return
        self.flow.know(run)
        self.lay_out()
        assert self.shown is not None
        self.sink.begin(run.end_us)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogDamageWarning)
            draw(self.sink, run, self.flow.views, self.shown.states, self.flow.failed)
        self._fit()
        self.flow.done(self.flow.reached())

    def batch(self, last: bool = False) -> None:
        """Send what is new."""
        if self.shown is None:
            self.lay_out()
        assert self.shown is not None
        turn, self._turn = self._turn, (self._turn + 1) % TURNS
        if turn == 0:
            self._drawn = self.flow.reached()
        self.sink.begin(self.flow.end_us, last, last or turn == 0)
        for name, view in self.flow.views.items():
            part = self.flow.part(view.memory_s, last)
            asked(name, "draw", partial(view.draw, self.sink, part), None, self.flow.failed)
        self.sink.stand()
        part = self.flow.part(View.memory_s, last)
        for i, each in enumerate(COMMON):
            if last or turn == i + 1:
                each(self.sink, part, self.shown.states)
        self.sink.join()
        if last or turn == TURNS - 1:
            self._fit()
        if turn == TURNS - 1:
            self.flow.done(self._drawn)

    def flush(self, within_s: float) -> bool:
        """Whether the viewer has taken everything within a time [s]."""
        try:
            self.rec.flush(timeout_sec=within_s)
        except Exception:  # the binding raises plain exceptions of several kinds
            return False
        return True

    def close(self) -> None:
        """Let go of the viewer without waiting for it."""
        self.rec.disconnect()
