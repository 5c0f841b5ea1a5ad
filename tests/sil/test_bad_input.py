"""Bad input: a clear message naming the thing, a non-zero exit, nothing left behind."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from hil_scripts.launch import ports
from hil_scripts.launch.places import SCENARIOS
from tests.sil.launch import Ended, sil

SHORT = ("--duration", 5, "--no-rrd")


def refused(tmp_path: Path, *args: object, out: Path | None = None) -> Ended:
    """Run with arguments that must be refused before anything is created."""
    run = out or tmp_path / "run"
    ended = sil("run", *args, *SHORT, "--out", run)
    assert ended.code == 2, ended.text
    assert "Traceback" not in ended.text
    assert not run.exists() or not any(run.iterdir())
    return ended


def edited(tmp_path: Path, old: str, new: str) -> Path:
    """A copy of the refuelling scenario with one edit."""
    text = (SCENARIOS / "refueling.toml").read_text()
    assert old in text
    path = tmp_path / "edited.toml"
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize(
    ("set_", "words"),
    [
        ("plant.wind.nonsense=1", ["wind.nonsense", "unknown key"]),
        ("plant.wind.dryden.sigma_mps=-1", ["wind.dryden.sigma_mps", "allowed"]),
        ("plant.link.actuator_delay_ticks=1.5", ["actuator_delay_ticks", "expected int"]),
        ("receiver.link.nonsense=1", ["link.nonsense", "unknown key"]),
        ("receiver.app.base_rate_hz=7", ["base_rate_hz", "allowed"]),
        ("receiver.app.sysid=9", ["receiver.app.sysid", "given by the scenario"]),
        ("nobody.app.name=x", ["nobody", "plant, tanker, receiver"]),
        ("nonsense", ["'nonsense'", "plant.<key>=<value>"]),
    ],
)
def test_bad_override(tmp_path: Path, set_: str, words: list[str]) -> None:
    ended = refused(tmp_path, "refueling", "--set", set_)
    for w in words:
        assert w in ended.text


def test_unknown_scenario(tmp_path: Path) -> None:
    assert "refueling" in refused(tmp_path, "no-such-scenario").text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('file = "learjet24"', 'file = "spruce_goose"', ["spruce_goose", "learjet24"]),
        ('mission = "receiver"', 'mission = "joyride"', ["mission", "joyride", "receiver"]),
        ("[wind]", "[wind", ["edited.toml", "not valid TOML"]),
        ("duration_s", "duration", ["meta.duration", "unknown key"]),
        ('target = "receiver"', 'target = "glider"', ["glider", "tanker, receiver"]),
    ],
)
def test_bad_scenario_file(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    ended = refused(tmp_path, edited(tmp_path, old, new))
    for w in words:
        assert w in ended.text


@pytest.mark.parametrize("purpose", ["ground telemetry", "plant link of receiver", "telemetry of tanker"])
def test_busy_port(tmp_path: Path, port_offset: int, purpose: str) -> None:
    need = ports.needed({1: "tanker", 2: "receiver"}, port_offset)
    port = next(p for p, what in need.items() if what == purpose)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind((ports.HOST, port))
        ended = refused(tmp_path, "refueling", "--port-offset", port_offset)
    assert f"{port} ({purpose})" in ended.text


def test_unwritable_folder(tmp_path: Path) -> None:
    blocker = tmp_path / "file"
    blocker.write_text("a file where a folder is wanted")
    ended = sil("run", "refueling", *SHORT, "--in-process", "--out", blocker / "run")
    assert ended.code == 2, ended.text
    assert str(blocker / "run") in ended.text and "cannot be written" in ended.text


def test_a_folder_with_another_run_in_it_is_not_overwritten(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "keep.txt").write_text("precious")
    ended = sil("run", "refueling", *SHORT, "--in-process", "--out", run)
    assert ended.code == 2 and "not empty" in ended.text
    assert [p.name for p in run.iterdir()] == ["keep.txt"]


def test_realtime_in_process_is_refused(tmp_path: Path) -> None:
    assert "--in-process" in refused(tmp_path, "refueling", "--realtime", "--in-process").text


def test_replay_of_no_run_folder(tmp_path: Path) -> None:
    ended = sil("replay", tmp_path)
    assert ended.code == 2 and "run folder" in ended.text


def test_violated_bound_fails_the_run(tmp_path: Path) -> None:
    text = (SCENARIOS / "refueling.toml").read_text()
    head, _, _ = text.partition("[expect]")
    head = head.replace("duration_s = 1000.0", "duration_s = 5.0")
    path = tmp_path / "strict.toml"
    path.write_text(head + '\n[expect]\n"run.sim_s" = { max = 1.0 }\n"run.outcome" = "completed"\n')
    ended = sil("run", path, "--in-process", "--no-rrd", "--out", tmp_path / "run")
    assert ended.code == 4, ended.text
    assert "bounds violated: run.sim_s" in ended.text
