"""One seed, one result: over sockets, in process, and in replay; another seed, another result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.sil.launch import apart, sil, summary

SECONDS = 3.0
SEED = 5
LOGS = ("link_tanker.tlog", "link_receiver.tlog", "tlm.tlog", "truth.tlog")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory, next_port_offset: Callable[[], int]) -> dict[str, Path]:
    """The same flight with separate processes, in process, with another seed, with another parameter."""
    base = tmp_path_factory.mktemp("runs")
    out = {}
    for name, seed, flags in (
        ("first", SEED, ("--port-offset", next_port_offset())),
        ("single", SEED, ("--in-process",)),
        ("other", SEED + 1, ("--in-process",)),
        ("tuned", SEED, ("--in-process", "--set", "receiver.nav.q_wind=0.4")),
    ):
        out[name] = base / name
        args = ("run", "refueling", "--seed", seed, "--duration", SECONDS, "--no-rrd", "--out", out[name], *flags)
        ended = sil(*args) if "--in-process" in flags else apart(*args, out=base / "words.txt")
        assert ended.code == 0, ended.text
    return out


@pytest.mark.parametrize("log", LOGS)
def test_in_process_equals_separate_processes(runs: dict[str, Path], log: str) -> None:
    assert (runs["first"] / log).read_bytes() == (runs["single"] / log).read_bytes()


@pytest.mark.parametrize("log", LOGS)
def test_another_seed_differs(runs: dict[str, Path], log: str) -> None:
    assert (runs["single"] / log).read_bytes() != (runs["other"] / log).read_bytes()


@pytest.mark.parametrize("which", ["single", "tuned"])
def test_resolved_files_fly_the_same_run_again(runs: dict[str, Path], tmp_path: Path, which: str) -> None:
    again = tmp_path / "again"
    ended = sil("run", runs[which] / "scenario.toml", "--in-process", "--no-rrd", "--out", again)
    assert ended.code == 0, ended.text
    assert (again / "scenario.toml").read_text() == (runs[which] / "scenario.toml").read_text()
    for log in LOGS:
        assert (again / log).read_bytes() == (runs[which] / log).read_bytes()


def test_summaries_agree_in_everything_but_speed(runs: dict[str, Path]) -> None:
    a, b = summary(runs["first"]), summary(runs["single"])
    assert {k for k in a if a[k] != b.get(k)} <= {"run.sim_s_per_wall_s"}
    assert set(a) == set(b)


def test_the_accounts_of_every_process_are_in_the_summary(runs: dict[str, Path]) -> None:
    s = summary(runs["first"])
    for who in ("tanker", "receiver"):
        assert s[f"flightsw.{who}.ticks"] == round(SECONDS * 100)
        lost = (
            "slips",
            "late_p99_us",
            "unsent_datagrams",
            "unlogged_datagrams",
            "overrun_datagrams",
            "refused_packets",
        )
        assert [s[f"flightsw.{who}.{k}"] for k in lost] == [0] * len(lost)
        assert s[f"plant.missed_ticks.{who}"] == s[f"plant.rejected_datagrams.{who}"] == 0
    assert s["plant.late_ticks"] == s["plant.overrun_datagrams"] == 0
    assert s["ground.packets"] > 100 * SECONDS
    assert [s[f"ground.{k}"] for k in ("lost_packets", "junk_packets", "late_packets", "overrun_datagrams")] == [0] * 4


def test_replay_repeats_every_output(runs: dict[str, Path]) -> None:
    ended = sil("replay", runs["first"])
    assert ended.code == 0, ended.text
    assert "receiver" in ended.text and "tanker" in ended.text
