"""The command `flightsw` where it cannot start or go on: named in one line, in bounded time, with its exit code."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flightsw.__main__ import app as flightsw_app
from flightsw.icd.link import plant_port, telemetry_port
from tests.component.test_flight_process import FLIGHT, Flight


def test_plant_that_never_comes(tmp_path: Path, port_offset: int) -> None:
    f = Flight(tmp_path, port_offset, "--set", "link.startup_timeout_s=0.3", "--set", "link.peer_timeout_s=0.2")
    assert f.wait() == 3
    assert "no tick was received" in f.err()
    f.close()


@pytest.mark.parametrize("which", ["plant", "telemetry"])
def test_busy_port_is_named(tmp_path: Path, port_offset: int, which: str) -> None:
    port = plant_port(2, port_offset) if which == "plant" else telemetry_port(2, port_offset)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", port))
        f = Flight(tmp_path, port_offset)
        assert f.wait() == 2
        assert f"UDP port 127.0.0.1:{port} ({which}" in f.err()
        f.close()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--set", "app.speed=1"], "app.speed: unknown key; allowed: name"),
        (["--set", "nonsense"], "--set 'nonsense': expected key=value"),
        (["--set", "app.aircraft=concorde"], "aircraft file"),
        (["--run-dir", "/nowhere/at/all"], "/nowhere/at/all/link_receiver.tlog: cannot be created"),
        (["--config", "/none.toml"], "/none.toml: cannot be read"),
    ],
)
def test_bad_start_is_one_line_and_code_2(tmp_path: Path, port_offset: int, args: list[str], message: str) -> None:
    (tmp_path / "flight.toml").write_text(FLIGHT)
    argv = [
        "--config",
        str(tmp_path / "flight.toml"),
        "--run-dir",
        str(tmp_path),
        "--port-offset",
        str(port_offset),
        *args,
    ]
    r = CliRunner().invoke(flightsw_app, argv)
    assert r.exit_code == 2
    assert message in r.stderr and len(r.stderr.strip().splitlines()) == 1


def test_a_process_that_cannot_start_says_so_and_ends(tmp_path: Path, port_offset: int) -> None:
    f = Flight(tmp_path, port_offset, "--config", "/none.toml")
    assert f.wait() == 2
    err = f.err()
    assert "/none.toml: cannot be read" in err and len(err.strip().splitlines()) == 1
    f.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_full_disk_ends_the_run_with_code_4(tmp_path: Path, port_offset: int) -> None:
    (tmp_path / "link_receiver.tlog").symlink_to("/dev/full")
    f = Flight(tmp_path, port_offset)
    f.start()
    for k in range(1, 400):
        f.link.send(f.plant.at(k), f.to)
        if f.link.recv(0.5) is None:
            break
    assert f.wait() == 4
    err = f.err()
    assert "link_receiver.tlog: cannot be written: No space left on device" in err and "Traceback" not in err
    f.close()
