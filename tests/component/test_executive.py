"""Rate groups, accounting and clocks."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import numpy as np
import pytest

import flightsw
from flightsw.priority import REST, SOON_US, TAKEN_US, Eager, realtime_priority, take_turns
from flightsw.process.clock import LockstepClock, RealtimeClock
from flightsw.process.executive import Executive, Histogram
from flightsw.types import Timing


def test_groups_run_on_their_ticks_in_order() -> None:
    ran: list[str] = []
    ex = Executive()
    ex.add("fast", 1, 0, lambda: ran.append("f"))
    ex.add("slow", 5, 2, lambda: ran.append("s"))
    for tick in range(10):
        ex.run(tick)
    assert "".join(ran) == "fffsfffffsff"
    assert [g.runs for g in ex.groups] == [10, 2]


@pytest.mark.parametrize(("divisor", "offset"), [(0, 0), (5, 5), (5, -1)])
def test_impossible_group_is_refused(divisor: int, offset: int) -> None:
    with pytest.raises(ValueError, match=f"rate group g: divisor {divisor}, offset {offset}"):
        Executive().add("g", divisor, offset, lambda: None)


def test_lockstep_accounts_hold_no_wall_time() -> None:
    ex = Executive()
    ex.add("g", 1, 0, lambda: None)
    ex.run(0)
    ex.account(123.0, 45.0, 0)
    t = Timing()
    ex.fill(t)
    assert t == Timing(ticks=1)


def test_execution_time_comes_from_the_injected_clock() -> None:
    now = iter(range(0, 1000, 7))
    ex = Executive(lambda: next(now))
    ex.add("g", 1, 0, lambda: None)
    ex.run(0)
    assert ex.groups[0].last_us == 7.0 and ex.groups[0].cost.max == 7.0
    ex.account(50.0, 10.0, 2)
    ex.run(1)
    ex.account(150.0, 30.0, 0)
    t = Timing()
    ex.fill(t)
    assert (t.ticks, t.slips, t.exec_us_last, t.exec_us_max, t.exec_us_mean) == (2, 2, 150.0, 150.0, 100.0)
    assert t.late_us_max == 30.0
    assert ex.new_slips() == 2 and ex.new_slips() == 0


def test_histogram_quantiles_against_numpy() -> None:
    rng = np.random.default_rng(1)
    x = rng.lognormal(4.0, 1.5, 20_000)
    h = Histogram()
    for v in x:
        h.add(float(v))
    for q in (0.5, 0.99, 0.999):
        assert h.quantile(q) == pytest.approx(float(np.quantile(x, q)), rel=0.08, abs=0.1)
    assert h.max == x.max() and h.mean == pytest.approx(x.mean())
    assert Histogram().quantile(0.5) == 0.0
    h.add(-5.0)
    h.add(1e300)


class Wall:
    """A wall clock that only moves when told or slept on; sleeping overruns by `over`."""

    def __init__(self) -> None:
        self.t = 1_000_000
        self.over = 30

    def now(self) -> int:
        return self.t

    def sleep(self, s: float) -> None:
        self.t += round(s * 1e6) + self.over


def test_deadlines_do_not_drift() -> None:
    w = Wall()
    c = RealtimeClock(10_000, w.now, w.sleep)
    for k in range(1, 101):
        assert c.wait_tick() == 1 and c.late_us == 30
        assert w.t == 1_000_000 + k * 10_000 + 30
        w.t += 4_000  # the tick's work


@pytest.mark.parametrize(("work_us", "periods"), [(9_000, 1), (10_500, 1), (19_960, 1), (20_000, 2), (35_000, 3)])
def test_late_loop_skips_whole_periods_without_catching_up(work_us: int, periods: int) -> None:
    w = Wall()
    c = RealtimeClock(10_000, w.now, w.sleep)
    c.wait_tick()
    w.t += work_us
    assert c.wait_tick() == periods
    assert c.wait_tick() == 1  # no burst


def test_lockstep_clock_is_the_stamp() -> None:
    c = LockstepClock(10_000)
    assert c.now_us() == -1
    assert c.advance(0) == 0.01
    assert (c.now_us(), c.wait_tick()) == (0, 1)
    assert c.advance(30_000) == 0.03
    assert (c.now_us(), c.wait_tick()) == (30_000, 3)


def test_priority_says_what_it_got(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError("not permitted")

    monkeypatch.setattr("os.sched_setscheduler", refuse)
    monkeypatch.setattr("ctypes.CDLL", lambda *a, **k: (_ for _ in ()).throw(OSError("no libc")))
    assert realtime_priority() == "no SCHED_FIFO (not permitted), memory not locked (no libc)"


def test_in_lockstep_no_core_is_taken_from_the_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    before = os.sched_getscheduler(0)
    try:
        take_turns()
        assert os.sched_getscheduler(0) == os.SCHED_BATCH
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))
    monkeypatch.delattr("os.sched_setscheduler")  # a system that has none
    take_turns()


class Core:
    """A wall clock [us], and a socket that has something to read from `at` on. Giving the core away costs `taken` [us]."""

    def __init__(self, at: float, taken: int = 2) -> None:
        self.t, self.at, self.taken, self.given = 0, at, taken, 0

    def now_us(self) -> int:
        return self.t

    def poll(self, ms: int) -> list[tuple[int, int]]:
        assert ms == 0  # it never sleeps itself
        return [(7, 1)] if self.t >= self.at else []

    def give(self) -> None:
        self.given += 1
        self.t += self.taken


def test_a_peer_that_answers_soon_is_waited_for_awake(monkeypatch: pytest.MonkeyPatch) -> None:
    for at, came, given in ((0, [(7, 1)], 0), (50, [(7, 1)], 25), (1e9, [], SOON_US // 2)):
        core = Core(at)
        monkeypatch.setattr("os.sched_yield", core.give)
        assert Eager(core, core.now_us).soon() == came
        assert core.given == given


@pytest.mark.parametrize("at", [1e9, TAKEN_US])  # the answer has come meanwhile
def test_a_core_that_is_needed_is_left_alone_for_longer_and_longer(monkeypatch: pytest.MonkeyPatch, at: float) -> None:
    core = Core(at, taken=TAKEN_US + 1)
    monkeypatch.setattr("os.sched_yield", core.give)
    eager = Eager(core, core.now_us)
    for rest in (REST, 2 * REST, 4 * REST):
        core.given, core.at = 0, core.t + at
        eager.soon()
        assert core.given == 1
        core.at = 1e18
        for _ in range(rest):
            assert eager.soon() == []
        assert core.given == 1
    core.taken, core.at = 2, core.t + 10  # nobody needs it any more
    assert eager.soon() == [(7, 1)]
    core.given, core.taken, core.at = 0, TAKEN_US + 1, 1e18
    for _ in range(REST + 2):
        eager.soon()
    assert core.given == 2


def test_a_system_that_cannot_give_the_core_away_sleeps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.sched_yield")
    core = Core(1e9)
    assert Eager(core, core.now_us).soon() == [] and core.t == 0


def test_clock_is_the_only_importer_of_time_on_board() -> None:
    root = Path(flightsw.__file__).parent
    for p in root.rglob("*.py"):
        if p.name in ("clock.py",):
            continue
        for node in ast.walk(ast.parse(p.read_text())):
            found = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            found += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert "time" not in found and "datetime" not in found, p
