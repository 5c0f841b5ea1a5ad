"""However a run is ended, it ends soon, says why, leaves readable logs and no process behind.

Waits are bounded generously; how fast is stated by the run's own peer time-out, not by these tests.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from flightsw.icd.tlog import read
from tests.sil.launch import apart, processes, start, summary, wait_for

ONE = "rendezvous"  # one aircraft: a process less to start
TWO = "refueling"
END_S = 30.0  # [s] patience for an end that takes about one second


def logs(run: Path, scenario: str) -> list[Path]:
    """Every log of a run."""
    names = ("tanker", "receiver") if scenario == TWO else ("tanker",)
    return [run / f"link_{n}.tlog" for n in names] + [run / "tlm.tlog", run / "truth.tlog"]


class Flight:
    """A run in mid-flight."""

    def __init__(self, tmp: Path, offset: int, scenario: str = ONE) -> None:
        self.run, self.words = tmp / "run", tmp / "words.txt"
        self.logs = logs(self.run, scenario)
        args = ("run", scenario, "--duration", 100000, "--no-rrd", "--out", self.run, "--port-offset", offset)
        self.sil = start(*args, out=self.words)

    def airborne(self) -> bool:
        """Wait until every log holds something: what a killed process has not written yet is lost."""

        def all_written() -> bool:
            return all(p.exists() and p.stat().st_size > 0 for p in self.logs)

        return wait_for(lambda: self.sil.poll() is not None or all_written())

    def pid(self, *what: str) -> int:
        """Process whose command line contains all of `what`."""
        alive = processes(self.run)
        found = [p for p, line in alive.items() if all(w in line for w in what)]
        assert len(found) == 1, f"{what}: {found} of {alive}; sil {self.sil.poll()}: {self.text()}"
        return found[0]

    def text(self) -> str:
        """What the launcher has printed, without line breaks."""
        return " ".join(self.words.read_text().split())

    def assert_clean(self) -> None:
        """No process is left and every log reads."""
        assert wait_for(lambda: not processes(self.run), END_S), processes(self.run)
        for path in self.logs:
            assert sum(1 for _ in read(path)) > 0, path


@pytest.fixture
def flight(request: pytest.FixtureRequest, tmp_path: Path, port_offset: int) -> Iterator[Flight]:
    f = Flight(tmp_path, port_offset, getattr(request, "param", ONE))
    try:
        assert f.airborne()
        assert f.sil.poll() is None, f.text()
        yield f
    finally:
        if f.sil.poll() is None:
            f.sil.kill()
        f.sil.wait()


@pytest.mark.parametrize(
    ("flight", "module", "extra", "name"),
    [
        (TWO, "-m flightsw", "flight_receiver", "flightsw-receiver"),
        (ONE, "-m sim_plant", "scenario.toml", "sim-plant"),
        (ONE, "-m ground", "record", "ground"),
    ],
    indirect=["flight"],
)
def test_killing_any_process_ends_the_run_and_names_it(flight: Flight, module: str, extra: str, name: str) -> None:
    pid = flight.pid(module, extra)
    os.kill(pid, signal.SIGKILL)
    assert flight.sil.wait(END_S) == 1
    assert f"{name} (pid {pid}) ended: killed by SIGKILL" in flight.text()
    s = summary(flight.run)
    assert s["run.outcome"] == "failed" and name in s["run.reason"]
    flight.assert_clean()


@pytest.mark.parametrize("flight", [TWO], indirect=True)
def test_a_frozen_process_is_named_by_the_one_that_waits_for_it(flight: Flight) -> None:
    pid = flight.pid("flight_receiver")
    os.kill(pid, signal.SIGSTOP)
    try:
        assert flight.sil.wait(END_S) == 1
    finally:
        try:
            os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            pass
    assert "receiver (sysid 2" in flight.text() and "last answered tick" in flight.text()
    assert wait_for(lambda: not processes(flight.run), END_S)


def test_ctrl_c_in_flight(flight: Flight) -> None:
    flight.sil.send_signal(signal.SIGINT)
    assert flight.sil.wait(END_S) == 130
    assert "stopped by SIGINT" in flight.text()
    found = summary(flight.run)
    assert found["run.outcome"] == "aborted" and found["log.truth.end_s"] > 0.0 and "wind.tanker.samples" in found
    flight.assert_clean()


def test_the_launcher_killed_outright_leaves_no_orphan_and_whole_logs(flight: Flight) -> None:
    """Nobody reads what the children say any more: they end all the same with every log written to its last tick."""
    flight.sil.kill()
    flight.sil.wait()
    flight.assert_clean()
    last = {path.name: max(t for t, _, _ in read(path)) for path in flight.logs}
    assert max(last.values()) - min(last.values()) <= 150_000, last  # [us] the slowest log has a record every 0.1 s


def test_a_run_whose_folder_is_deleted_ends_in_one_line(flight: Flight) -> None:
    shutil.rmtree(flight.run)
    assert flight.sil.wait(END_S) == 1
    assert f"run folder {flight.run} has been deleted" in flight.text() and "Traceback" not in flight.text()
    assert wait_for(lambda: not processes(flight.run), END_S)
    assert not flight.run.exists()


@pytest.mark.parametrize(("at", "signum"), [("folder", signal.SIGINT), ("processes", signal.SIGTERM)])
def test_stopped_during_start_up(tmp_path: Path, port_offset: int, at: str, signum: signal.Signals) -> None:
    f = Flight(tmp_path, port_offset)
    try:
        assert wait_for(f.run.exists if at == "folder" else lambda: bool(processes(f.run)))
        f.sil.send_signal(signum)
        assert f.sil.wait(END_S) == 128 + signum
        assert f"stopped by {signum.name}" in f.text()
        assert wait_for(lambda: not processes(f.run), END_S)
        assert summary(f.run)["run.outcome"] == "aborted"
    finally:
        if f.sil.poll() is None:
            f.sil.kill()
        f.sil.wait()


@pytest.mark.parametrize("flags", [(), ("--in-process",)], ids=["processes", "in-process"])
def test_a_full_disk_is_named_with_its_file(tmp_path: Path, port_offset: int, flags: tuple[str, ...]) -> None:
    """A limit on file size stands for the full disk: writing on fails in the same call, with another reason."""
    run = tmp_path / "run"
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    args = ("run", ONE, "--duration", 100000, "--no-rrd", "--out", run, *flags)
    # a machine that stands still for seconds is not what is looked for here
    patient = ("--set", "plant.clock.peer_timeout_s=30", "--set", "tanker.link.peer_timeout_s=30")
    args += () if flags else ("--port-offset", port_offset, *patient)
    full = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (400_000, hard))
    ended = apart(*args, out=tmp_path / "words.txt", first=full)
    assert ended.code == 1, ended.text
    assert ".tlog: cannot be written" in ended.text and "Traceback" not in ended.text
    assert summary(run)["run.outcome"] == "failed"
    assert wait_for(lambda: not processes(run), END_S)
    for path in logs(run, ONE):
        assert sum(1 for _ in read(path)) > 0, path
