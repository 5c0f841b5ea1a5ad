"""Air data on the ground in words: on the monitor, and states as lanes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightsw.icd.dialect import ENUMS
from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from ground.columns import Columns, load
from ground.link.live import Monitor
from ground.link.packets import decode
from ground.rrd.series import Sink
from ground.views.airdata.draw import airdata
from ground.views.airdata.read import (
    CHANNELS,
    DIRECTIONS,
    channel_words,
    fdi_words,
    wake_words,
)


def test_channels_are_named_as_in_the_dialect() -> None:
    for c, name in enumerate(CHANNELS):
        assert ENUMS["WKF_AIR_CHANNEL"][1 << c].name == "WKF_AIR_CHANNEL_" + name.upper().replace(" ", "_")
    assert channel_words(0) == ""
    assert channel_words(1 << 4 | 1 << 6, 1 << 6) == "beta left high, alpha nose low"


def test_portrait_directions_are_the_columns_of_an_orthonormal_null_basis() -> None:
    assert pytest.approx(np.eye(2), abs=1e-12) == DIRECTIONS.T @ DIRECTIONS
    assert DIRECTIONS.sum(axis=0) == pytest.approx(0.0, abs=1e-12)


def words(**fields: Any) -> str:
    return fdi_words(decode(Sender(2, 1).named("FDI_STATUS", time_usec=1, **fields)))


def test_fault_words() -> None:
    assert words(valid=1) == "ok"
    assert words(valid=0) == "not checked"
    assert words(valid=1, alarm=2) == "ALARM beta (not isolated)"
    assert words(valid=1, alarm=2, isolated=16, excluded=16, exclusions=2) == (
        "ALARM beta (beta left high); EXCLUDED beta left; 2 exclusions so far"
    )


def test_wake_words() -> None:
    packet = Sender(2, 1).named(
        "WAKE_POSITION", time_usec=1, pos=(-35.5, 0.12, 8.4), cov=(0.01, 0.0, 0.04), scale=(0.9, 0.6), valid=1
    )
    assert wake_words(decode(packet)) == "y +0.12 z +8.40 m (2 sigma 0.20 0.40), wake x0.90 0.60"
    bad = Sender(2, 1).named("WAKE_POSITION", time_usec=1, reason="not observable")
    assert wake_words(decode(bad)) == "not valid: not observable"


def test_monitor_keeps_an_alarm_of_one_sample() -> None:
    send = Sender(2, 1)
    monitor = Monitor(clock=lambda: 0.0)
    for k in range(30):
        alarm = {"alarm": 4, "isolated": 256, "negative": 256} if k == 3 else {}
        monitor.take(send.named("FDI_STATUS", time_usec=k * 100_000, valid=1, **alarm))
    monitor.take(send.named("WAKE_POSITION", time_usec=2_900_000, reason="lost"))
    [line] = monitor.lines()
    assert "air data not checked: wake position not valid: lost; last alarm 3 s ago: alpha (alpha right low)" in line
    assert "in wake not valid: lost" in line
    monitor.take(send.named("WAKE_POSITION", time_usec=2_900_000, valid=1))
    assert "air data ok; last alarm 3 s ago: alpha (alpha right low)" in monitor.lines()[0]
    monitor.take(send.named("FDI_STATUS", time_usec=3_000_000, valid=1, alarm=1, isolated=1))
    assert "air data ALARM V (V nose high)" in monitor.lines()[0]
    assert monitor.screen() is not None


def test_nothing_is_shown_as_it_was_once() -> None:
    """Every figure on the screen ends when its source does, whatever else still arrives."""
    send, monitor = Sender(2, 1), Monitor(clock=lambda: 0.0)

    def feed(t: int, **dead: bool) -> str:
        now = {"time_usec": t}
        nav = {"time_usec": t, "V": 190.0, "valid": int("nav" not in dead), "wind": (0.0, -10.0, 0.0)}
        out = send.named("NAV_STATE", **nav) + send.named("LOCAL_POSITION_NED", time_boot_ms=t // 1000, z=-7010.0)
        out += send.named("RELATIVE_STATE", **now, valid=int("rel" not in dead), pos=(-35.0, 0.0, 8.0))
        air = min(t, 5_000_000) if "air" in dead else t  # the last sample is sent again and again
        out += send.named("FDI_STATUS", time_usec=air, valid=1)
        if "wake" not in dead:
            out += send.named("WAKE_POSITION", time_usec=air, valid=1, cov=(0.01, 0.0, 0.04))
        if "health" not in dead:
            out += send.named("HEALTH_STATUS", **now)
        monitor.take(out)
        return monitor.lines()[0]

    line = feed(5_000_000)
    for words in (
        "air data ok",
        "in wake y",
        "health ok",
        "speed 190.0 m/s",
        "wind 10.0 m/s",
        "error -35.00",
        "altitude 7010",
    ):
        assert words in line, line
    line = feed(9_000_000, air=True)
    assert "air data no report for 4 s" in line and "in wake no report for 4 s" in line and "air data ok" not in line
    line = feed(13_000_000, wake=True)
    assert "air data not checked: wake position not valid: no report" in line and "in wake no report for 8 s" in line
    feed(30_000_000)
    assert "health no report for 4 s" in feed(34_000_000, health=True)
    line = feed(35_000_000, nav=True)
    for label in ("bank", "wind", "altitude"):
        assert f"{label} not valid" in line
    assert "speed navigation not valid" in line
    line = feed(36_000_000, rel=True)
    assert "position not valid" in line and "error not valid" in line
    assert feed(1_000_000).count("no report") == 0  # another run


def test_quiet_in_green_only_where_it_was_checked(tmp_path: Path) -> None:
    """Wake estimate not valid, test not valid, samples repeated, messages ended: none of them is quiet."""
    send, log = Sender(2, 1), TlogWriter(tmp_path / "tlm.tlog")
    for k in range(0, 1000, 10):  # 100 s, ten a second
        t = k * 100_000
        if t < 90_000_000:
            fresh = t if not 60_000_000 <= t < 70_000_000 else 60_000_000
            fdi = {"valid": int(not 40_000_000 <= t < 50_000_000), "alarm": int(80_000_000 <= t < 81_000_000)}
            log.write(t, send.named("FDI_STATUS", time_usec=fresh, threshold=9.2, **fdi))
            log.write(
                t, send.named("WAKE_POSITION", time_usec=t, valid=int(not 20_000_000 <= t < 30_000_000), reason="lost")
            )
        log.write(t, send.named("NAV_STATE", time_usec=t))
    log.close()
    tlm = load(tmp_path / "tlm.tlog")
    lanes: dict[str, list[tuple[float, str]]] = {}

    class Rec:
        def log(self, *args: object, **kwargs: object) -> None: ...

    class Lanes(Sink):
        def __init__(self) -> None:
            self.rec = Rec()  # type: ignore[assignment]

        def states(self, path: str, t_us: Any, names: list[str], colors: Any) -> None:
            green = [n for n in set(names) if tuple(colors[n]) == (55, 105, 70)]
            assert set(green) <= {"quiet", "none", "valid"}
            lanes[path] = [(t * 1e-6, n) for t, n in zip(t_us.tolist(), names, strict=True)]

        def columns(self, *args: object) -> None: ...
        def series(self, *args: object, **kwargs: object) -> None: ...
        def level(self, *args: object) -> None: ...

    airdata(Lanes(), tmp_path, Columns(), tlm)

    def at(lane: str, t: float) -> str:
        return [n for s, n in lanes[f"nav/receiver/fdi/{lane}"] if s <= t][-1]

    want = {10: "quiet", 25: "not checked", 35: "quiet", 45: "not checked", 55: "quiet", 65: "not checked", 75: "quiet",
            80.5: "V (not isolated)", 85: "quiet", 95: "no report"}  # fmt: skip
    assert {t: at("alarm/V", t) for t in want} == want
    assert at("alarm/beta", 80.5) == "quiet" and at("excluded", 10) == "none" and at("excluded", 95) == "no report"
    assert [n for s, n in lanes["nav/receiver/wake/state"] if s <= 25][-1] == "lost"
