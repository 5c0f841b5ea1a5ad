"""Real time over a line: what came late and what never is told apart, and both ends' clocks are compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.hil.board import fly
from tests.hil.proxy import Proxy
from tests.hil.ptys import PtyLine
from tests.sil.launch import summary

pytestmark = pytest.mark.rt

SECONDS = 10.0


def test_serial_line_at_its_rate(tmp_path: Path, port_offset: int) -> None:
    with PtyLine(baud=921_600) as line:
        at = f"serial:{line.a}:921600"
        flown = fly(
            tmp_path / "run",
            port_offset,
            at,
            SECONDS,
            ("--link", f"serial:{line.b}:921600", "--realtime"),
            "--realtime",
        )
    assert flown.launcher.code == 0, flown.launcher.text
    got = summary(flown.run)
    came = got["plant.replies_on_time.receiver"] + got["plant.replies_late.receiver"]
    assert came > 0.5 * 100 * SECONDS and got["plant.noise_bytes.receiver"] == 0
    assert came + got["plant.ticks_passed_over.receiver"] > 0.8 * 100 * SECONDS
    assert 2.0 < got["plant.latency_p50_ms.receiver"] < 60.0
    assert abs(got["plant.clock_offset_s.receiver"]) < 0.1  # one machine, one clock


def test_a_slow_network_is_late_and_a_poor_one_loses(tmp_path: Path, port_offset: int) -> None:
    to = ("127.0.0.1", 4700 + port_offset)
    with Proxy(to, 0.02, 0.005, 0.05) as proxy:
        at, link = f"udp:127.0.0.1:{proxy.port}", f"udp:{to[0]}:{to[1]}"
        flown = fly(tmp_path / "run", port_offset, at, SECONDS, ("--link", link, "--realtime"), "--realtime")
    got = summary(flown.run)
    assert got["plant.replies_late.receiver"] > 300 > 10 > got["plant.replies_on_time.receiver"]
    assert got["plant.replies_lost.receiver"] > 5 and got["plant.latency_p50_ms.receiver"] > 35.0
