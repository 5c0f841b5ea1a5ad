"""The gust mission over MAVLink: sockets, one process and replay give the same bytes; every estimator and law flies the loop."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from ground.columns import load
from tests.sil.launch import apart, sil, summary

SECONDS = 4.0
LOGS = ("link_alexis.tlog", "link_reference.tlog", "tlm.tlog", "truth.tlog")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, next_port_offset: Callable[[], int]) -> dict[str, Path]:
    """The same flight with separate processes and in one process."""
    base = tmp_path_factory.mktemp("gust")
    out = {}
    for name, flags in (("sockets", ("--port-offset", next_port_offset())), ("single", ("--in-process",))):
        out[name] = base / name
        args = ("run", "gust", "--seed", 5, "--duration", SECONDS, "--no-rrd", "--out", out[name], *flags)
        ended = sil(*args) if "--in-process" in flags else apart(*args, out=base / "words.txt")
        assert ended.code == 0, ended.text
    return out


@pytest.mark.parametrize("log", LOGS)
def test_one_seed_one_result(runs: dict[str, Path], log: str) -> None:
    assert (runs["sockets"] / log).read_bytes() == (runs["single"] / log).read_bytes()


def test_replay_repeats_every_output(runs: dict[str, Path]) -> None:
    ended = sil("replay", runs["sockets"])
    assert ended.code == 0, ended.text
    assert "alexis" in ended.text and "reference" in ended.text


def test_figures_of_a_short_flight(runs: dict[str, Path]) -> None:
    s = summary(runs["single"])
    assert s["gust.alexis.valid_pct"] == 100.0
    assert s["gust.alexis.alpha_w.rms_deg"] < 1.0 and s["gust.alexis.v_w.rms_mps"] < 0.6
    assert s["gust.alleviation.low_reduction_pct"] > 40.0
    assert s["link.dropped"] == 0


def test_telemetry_carries_every_sample(runs: dict[str, Path]) -> None:
    tlm = load(runs["single"] / "tlm.tlog")
    for sysid in (3, 4):
        g, nav = tlm.get(sysid, "GUST_STATE"), tlm.get(sysid, "NAV_STATE")
        assert g is not None and len(g) == round(SECONDS * 50)
        assert nav is not None and len(nav) == round(SECONDS * 10)
        assert tlm.get(sysid, "RELATIVE_STATE") is None and tlm.get(sysid, "RENDEZVOUS_STATE") is None


@pytest.mark.parametrize("estimator", ["printed", "linear", "ukf"])
def test_every_estimator_flies_the_loop(tmp_path: Path, estimator: str) -> None:
    flags = ["--set", f"alexis.nav.estimator={estimator}", "--in-process", "--no-rrd", "--out", tmp_path / "run"]
    ended = sil("run", "gust", "--duration", SECONDS, *flags)
    assert ended.code == 0, ended.text
    s = summary(tmp_path / "run")
    assert s["gust.alexis.valid_pct"] > 99.0 and s["gust.alexis.height_rms_m"] < 10.0


def test_the_law_is_switched_by_command(tmp_path: Path) -> None:
    event = '[{t_s=4.0, kind="command", target="alexis", command=31011, params=[0.0]}]'
    ended = sil(
        "run",
        "gust",
        "--duration",
        8.0,
        "--set",
        f"plant.event={event}",
        "--in-process",
        "--no-rrd",
        "--out",
        tmp_path / "run",
    )
    assert ended.code == 0, ended.text
    s = summary(tmp_path / "run")
    assert (
        s["gust.alexis.alleviation.a_z.low_rms_mps2"] is not None and s["gust.alexis.hold.a_z.low_rms_mps2"] is not None
    )
