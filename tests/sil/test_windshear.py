"""The windshear mission over MAVLink: sockets, one process and replay give the same bytes; estimators, go-around."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flightsw.types import HF_ENGINE
from ground.columns import load
from tests.sil.launch import apart, sil, summary

SECONDS = 4.0
LOGS = ("link_twinjet.tlog", "tlm.tlog", "truth.tlog")
KEY = "windshear.twinjet."
CLEAN = ("--set", "plant.aircraft.twinjet.plant.burst.outflow_mps=0")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, next_port_offset: Callable[[], int]) -> dict[str, Path]:
    """The same flight with separate processes and in one process."""
    base = tmp_path_factory.mktemp("windshear")
    out = {}
    for name, flags in (("sockets", ("--port-offset", next_port_offset())), ("single", ("--in-process",))):
        out[name] = base / name
        args = ("run", "windshear", "--seed", 5, "--duration", SECONDS, "--no-rrd", "--out", out[name], *flags)
        ended = sil(*args) if "--in-process" in flags else apart(*args, out=base / "words.txt")
        assert ended.code == 0, ended.text
    return out


def fly(out: Path, duration_s: float, *flags: object) -> dict[str, object]:
    """With the source's sensors: what the filters find is not the airspeed's error."""
    ended = sil("run", "windshear_paper", "--duration", duration_s, "--in-process", "--no-rrd", "--out", out, *flags)
    assert ended.code == 0, ended.text
    return summary(out)


@pytest.mark.parametrize("log", LOGS)
def test_one_seed_one_result(runs: dict[str, Path], log: str) -> None:
    assert (runs["sockets"] / log).read_bytes() == (runs["single"] / log).read_bytes()


def test_replay_repeats_every_output(runs: dict[str, Path]) -> None:
    ended = sil("replay", runs["sockets"])
    assert ended.code == 0, ended.text
    assert "twinjet" in ended.text


def test_telemetry_carries_every_sample(runs: dict[str, Path]) -> None:
    tlm = load(runs["single"] / "tlm.tlog")
    w, nav = tlm.get(5, "WINDSHEAR_STATE"), tlm.get(5, "NAV_STATE")
    assert w is not None and len(w) == round(SECONDS * 50)
    assert nav is not None and len(nav) == round(SECONDS * 10)
    assert tlm.get(5, "RELATIVE_STATE") is None and tlm.get(5, "GUST_STATE") is None


def test_the_whole_escape_stays_within_the_scenario_s_bounds(tmp_path: Path) -> None:
    ended = sil("run", "windshear", "--in-process", "--no-rrd", "--out", tmp_path / "run")
    assert ended.code == 0, ended.text  # 4: a bound of [expect] is violated
    assert summary(tmp_path / "run")[KEY + "survived"] is True


@pytest.mark.parametrize("flags", [("filter=ukf", "states=13"), ("filter=srckf", "states=15")])
def test_every_estimator_flies_the_loop(tmp_path: Path, flags: tuple[str, ...]) -> None:
    s = fly(tmp_path / "run", SECONDS, *(x for f in flags for x in ("--set", f"twinjet.nav.{f}")))
    assert s[KEY + "valid_pct"] == 100.0 and float(str(s[KEY + "w_x.rms_mps"])) < 0.5


def test_go_around_by_command(tmp_path: Path) -> None:
    event = '[{t_s=4.0, kind="command", target="twinjet", command=191, params=[0.0]}]'
    s = fly(tmp_path / "run", 12.0, "--set", f"plant.event={event}")
    assert s[KEY + "aborted"] is True and s[KEY + "by_hazard"] is False
    assert float(str(s[KEY + "abort_s"])) == pytest.approx(4.0, abs=0.15)


def test_an_aircraft_that_is_lost_leaves_whole_logs_and_figures(tmp_path: Path, port_offset: int) -> None:
    """The continued approach ends on the ground: said so, judged, drawn, and the same bytes with separate processes."""
    near = "plant.aircraft.twinjet.start.pos_n_m=[-700.0, 0.0, -150.8]"  # on the slope, just before the burst
    flags = ("--set", "twinjet.guid.escape.law=continue", "--set", near)
    for name, more in (("one", ("--in-process",)), ("many", ("--no-rrd", "--port-offset", port_offset))):
        args = ("run", "windshear", "--out", tmp_path / name, *flags, *more)
        ended = sil(*args) if "--in-process" in more else apart(*args, out=tmp_path / "words.txt")
        assert ended.code == 1 and "Traceback" not in ended.text, ended.text
        s = summary(tmp_path / name)
        assert s["run.outcome"] == "lost" and "twinjet hit the ground at t = " in s["run.reason"]
        assert s["run.reason"] in ended.text
        assert s[KEY + "survived"] is False
    assert (tmp_path / "one" / "run.rrd").exists()
    for log in LOGS:
        assert (tmp_path / "one" / log).read_bytes() == (tmp_path / "many" / log).read_bytes(), log
    assert sil("replay", tmp_path / "one").code == 0


def test_an_engine_that_stops_is_told_on_the_wire(tmp_path: Path) -> None:
    event = '[{t_s=3.0, kind="engine_off", target="twinjet", index=1}]'
    flags = (
        "--duration",
        9.0,
        "--in-process",
        "--no-rrd",
        "--out",
        tmp_path / "run",
        *CLEAN,
        "--set",
        f"plant.event={event}",
    )
    assert sil("run", "windshear", *flags).code == 0
    tlm = load(tmp_path / "run" / "tlm.tlog")
    learnt, health = tlm.get(5, "WINDSHEAR_ERRORS"), tlm.get(5, "HEALTH_STATUS")
    assert learnt is not None and health is not None
    out = learnt["flags"].astype(int) & 1
    told_s = learnt.t_us[int(out.argmax())] * 1e-6
    assert out[-1] == 1 and 3.3 < told_s < 6.5
    assert int(health["failed"][-1]) & HF_ENGINE and not int(health["failed"][0]) & HF_ENGINE
    assert learnt["est"][-1, 5] == pytest.approx(0.5, abs=0.15)  # factor of the thrust commanded


def test_wrong_lift_and_drag_of_the_plant_are_learnt(tmp_path: Path) -> None:
    error = (
        "--set",
        "plant.aircraft.twinjet.plant.lift_factor=1.1",
        "--set",
        "plant.aircraft.twinjet.plant.drag_factor=1.1",
    )
    s = fly(tmp_path / "run", 40.0, *error)
    assert float(str(s[KEY + "lift_scale"])) == pytest.approx(1.1, abs=0.02)
    assert float(str(s[KEY + "drag_scale"])) == pytest.approx(1.1, abs=0.02)
    assert float(str(s[KEY + "w_x.rms_mps"])) < 0.3
