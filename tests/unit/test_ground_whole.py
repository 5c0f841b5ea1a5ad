"""A run whose logs stop short is not completed: cut at every kind of place, judged by what the launcher said of its end."""

from __future__ import annotations

import json
import runpy
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from pymavlink.dialects.v10 import common as v1
from typer.testing import CliRunner

from flightsw.icd.dialect import VALUES
from flightsw.icd.tlog import LINK_IN, TlogWriter, read
from flightsw.icd.wire import Sender
from ground.__main__ import app
from ground.metrics import compute

Synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
SECONDS = 20.0
SCENARIO = f"""
[meta]
duration_s = {SECONDS}
[clock]
base_rate_hz = 10
truth_hz = 10
[[aircraft]]
name = "tanker"
sysid = 1
[[aircraft]]
name = "receiver"
sysid = 2
"""
Cut = Callable[[Path], object]
pytestmark = pytest.mark.filterwarnings("ignore::flightsw.icd.damage.LogDamageWarning")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two aircraft with everything a launcher leaves."""
    synth = Synth(duration_s=SECONDS - 0.1)  # its last sample is one step before the end
    run: Path = synth.write(tmp_path_factory.mktemp("whole") / "run")
    (run / "scenario.toml").write_text(SCENARIO)
    (run / "summary.json").write_text(json.dumps({"run.outcome": "completed", "run.sim_s": SECONDS, "run.seed": 7}))
    for i, name in enumerate(("tanker", "receiver")):
        plant, log = Sender(i + 1, 190), TlogWriter(run / f"link_{name}.tlog")
        for t in synth.t_us.tolist():
            log.write(t, plant.named("HIL_SENSOR", time_usec=t), LINK_IN)
        end = {"command": VALUES["MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN"], "param1": 2.0}
        log.write(t, plant.named("COMMAND_LONG", target_system=i + 1, **end), LINK_IN)
        log.close()
    return run


def without(name: str, keep: Callable[[int, bytes], bool]) -> Cut:
    """Leave records out of a log."""

    def cut(run: Path) -> None:
        records = [r for r in read(run / name) if keep(r[0], r[2])]
        log = TlogWriter(run / name)
        for t, link, packet in records:
            log.write(t, packet, link)
        log.close()

    return cut


def shorter(name: str, size: Callable[[int], int]) -> Cut:
    """Cut a file to a size."""

    def cut(run: Path) -> None:
        raw = (run / name).read_bytes()
        (run / name).write_bytes(raw[: size(len(raw))])

    return cut


CUTS: dict[str, tuple[Cut, str]] = {
    "half the truth": (shorter("truth.tlog", lambda n: n // 2), "truth.tlog ends at t = "),
    "truth empty": (shorter("truth.tlog", lambda n: 0), "truth.tlog is empty"),
    "truth within its last record": (shorter("truth.tlog", lambda n: n - 1), "truth.tlog: its last record is cut off"),
    "truth's last three times": (without("truth.tlog", lambda t, p: t < 19_700_000), "truth.tlog ends at t = 19.60 s"),
    "one aircraft's truth": (without("truth.tlog", lambda t, p: p[5] == 1 or t < 9_000_000), "truth.tlog ends at t = 8.90 s"),
    "half the telemetry": (shorter("tlm.tlog", lambda n: n // 2), "tlm.tlog ends at t = "),
    "telemetry within a record": (shorter("tlm.tlog", lambda n: n - 40), "tlm.tlog: its last record is cut off"),
    "one aircraft's telemetry": (without("tlm.tlog", lambda t, p: p[5] == 2 or t < 19_000_000), "tlm.tlog ends at t = 18.90 s"),
    "an aircraft never heard": (without("tlm.tlog", lambda t, p: p[5] == 2), "tlm.tlog is empty"),
    "a link's last word": (without("link_tanker.tlog", lambda t, p: p[7] != 76), "link_tanker.tlog ends before the run does"),
    "a link within a record": (shorter("link_receiver.tlog", lambda n: n - 3), "link_receiver.tlog ends before the run does"),
    "a link empty": (shorter("link_receiver.tlog", lambda n: 0), "link_receiver.tlog ends before the run does"),
}  # fmt: skip


def test_a_whole_run_is_what_the_launcher_says(whole: Path) -> None:
    found = compute(whole)
    assert (found["run.outcome"], found["run.sim_s"], found["run.seed"]) == ("completed", SECONDS, 7)
    assert "run.reason" not in found
    assert found["log.truth.end_s"] == found["log.tlm.end_s"] == pytest.approx(19.9)


@pytest.mark.parametrize("name", CUTS)
def test_each_cut_is_said(whole: Path, tmp_path: Path, name: str) -> None:
    run = Path(shutil.copytree(whole, tmp_path / "run"))
    cut, words = CUTS[name]
    cut(run)
    found = compute(run)
    assert found["run.outcome"] == "truncated" and words in found["run.reason"]


def test_the_scenario_says_it_where_the_launcher_did_not(whole: Path, tmp_path: Path) -> None:
    """As after the launcher was killed: no summary.json."""
    run = Path(shutil.copytree(whole, tmp_path / "run"))
    (run / "summary.json").unlink()
    (run / "meta.json").unlink()
    assert compute(run)["run.outcome"] is None
    CUTS["half the telemetry"][0](run)
    assert compute(run)["run.outcome"] == "truncated"


@pytest.mark.parametrize("outcome", ["lost", "aborted", "failed"])
def test_a_run_that_ended_otherwise_stays_what_it_was(whole: Path, tmp_path: Path, outcome: str) -> None:
    run = Path(shutil.copytree(whole, tmp_path / "run"))
    (run / "summary.json").write_text(json.dumps({"run.outcome": outcome, "run.sim_s": 12.0}))
    without("truth.tlog", lambda t, p: t < 12_000_000)(run)
    assert compute(run)["run.outcome"] == outcome


# --- the commands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "line", ["metrics RUN", "convert RUN", "screenshot RUN --out x.png", "diff RUN RUN", "diff WHOLE RUN"]
)
@pytest.mark.parametrize(
    ("what", "why"), [("nothing", "it does not exist"), ("file", "it is a file"), ("empty", "it has no ")]
)
def test_no_run_folder_in_the_same_words_everywhere(
    whole: Path, tmp_path: Path, line: str, what: str, why: str
) -> None:
    run = tmp_path / what
    if what == "file" and line.startswith("convert"):
        line = line.replace("convert", "screenshot --out x.png")  # a log by itself can be drawn
    if what == "file":
        run.write_bytes((whole / "tlm.tlog").read_bytes())
        line = line.replace("metrics", "metrics --write")  # without it: what is in the log
    elif what == "empty":
        run.mkdir()
    args = [{"RUN": str(run), "WHOLE": str(whole)}.get(a, a) for a in line.split()]
    r = CliRunner().invoke(app, args)
    assert r.exit_code == 2
    assert r.stderr.startswith(f"ground: '{run}' is not a run folder: {why}") and len(r.stderr.splitlines()) == 1


@pytest.mark.parametrize("line", ["metrics", "convert", "screenshot --out x.png"])
def test_a_log_that_is_none_is_refused_by_every_command(whole: Path, tmp_path: Path, line: str) -> None:
    run = Path(shutil.copytree(whole, tmp_path / "run"))
    (run / "tlm.tlog").write_bytes(b"\x01" * 5000)
    r = CliRunner().invoke(app, [*line.split(), str(run)])
    assert r.exit_code == 2 and "tlm.tlog: is no log: 5000 of 5000 bytes" in r.stderr


def test_damage_is_said_on_screen_and_in_the_figures(whole: Path, tmp_path: Path) -> None:
    """One flipped bit of a velocity: one packet less, no figure of 1e19 m/s."""
    run = Path(shutil.copytree(whole, tmp_path / "run"))
    raw = bytearray((run / "truth.tlog").read_bytes())
    raw[len(raw) // 2] ^= 0x40
    (run / "truth.tlog").write_bytes(bytes(raw))
    r = CliRunner().invoke(app, ["metrics", str(run)])
    found, before = json.loads(r.stdout), compute(whole)
    assert r.exit_code == 0 and "truth.tlog: " in r.stderr and "bytes are damaged, in 1 place" in r.stderr
    assert found["log.junk_bytes"] > 0 and found["run.outcome"] == "completed"
    for key in ("contact.error_rms_m.z", "wind.receiver.rms_mps.n"):
        assert found[key] == pytest.approx(before[key], rel=1e-3)


@pytest.mark.parametrize("line", ["metrics", "convert", "screenshot --out x.png"])
def test_a_log_of_another_vehicle_is_no_truth(tmp_path: Path, line: str) -> None:
    """MAVLink 1 of an aircraft, put where the plant's log should be: one line and exit 2, no phantom systems."""
    mav = v1.MAVLink(None, srcSystem=1, srcComponent=1)
    raw = b"".join(
        (1_600_000_000_000_000 + k * 100_000).to_bytes(8, "big")
        + v1.MAVLink_heartbeat_message(1, 3, 81, 0, 4, 3).pack(mav)
        for k in range(40)
    )
    for name in ("truth.tlog", "tlm.tlog"):
        (tmp_path / name).write_bytes(raw)
    r = CliRunner().invoke(app, [*line.split(), str(tmp_path)])
    assert r.exit_code == 2 and len(r.stderr.splitlines()) == 1
    assert "truth.tlog' is no plant's log: none of its 40 packets, of system 1, is a TRUTH" in r.stderr


def test_what_is_in_one_log(whole: Path) -> None:
    r = CliRunner().invoke(app, ["metrics", str(whole / "truth.tlog")])
    found = json.loads(r.stdout)
    assert r.exit_code == 0 and found["log.packets"] == 400 and found["log.systems"] == [1, 2]
    assert found["log.1.TRUTH"] == found["log.2.TRUTH"] == 200


@pytest.mark.parametrize(
    "line", ["", "record", "metrics", "convert", "screenshot", "live", "send", "diff", "report", "report lee"]
)
def test_help_everywhere(line: str) -> None:
    for flag in ("-h", "--help"):
        r = CliRunner().invoke(app, [*line.split(), flag])
        assert r.exit_code == 0 and "Usage:" in r.stdout


def test_version_and_units_in_help() -> None:
    assert CliRunner().invoke(app, ["--version"]).stdout.startswith("wakefield ")
    assert "[m/s]" in CliRunner().invoke(app, ["send", "-h"]).stdout
