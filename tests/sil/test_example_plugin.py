"""A mission from another package: found, flown, replayed, shown and commanded without a line of ours that names it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from ground.run import load
from tests.drawn import rows
from tests.sil.launch import TIMEOUT_S

EXAMPLE = Path(__file__).resolve().parents[1] / "data" / "example_plugin"
SECONDS = 24.0  # a little past the time from which its figures count


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package as an installer leaves it: its folder, and what its pyproject.toml declares."""
    site = tmp_path_factory.mktemp("site")
    shutil.copytree(EXAMPLE / "example", site / "example", ignore=shutil.ignore_patterns("__pycache__"))
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    info = site / f"wakefield_example-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    lines = [f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in table.items())
             for group, table in project["entry-points"].items()]  # fmt: skip
    (info / "entry_points.txt").write_text("\n".join(lines))
    return site


TURNS = """
import json, runpy, sys
for name, *words in json.load(sys.stdin):
    sys.argv = [name, *words]
    try:
        runpy.run_module(name, run_name="__main__", alter_sys=True)
        code = 0
    except SystemExit as end:
        code = end.code or 0
    print(f"\\f{code}", flush=True)
"""
Call = tuple[object, ...]  # module and words of `python -m`


def calls(site: Path, *wanted: Call) -> list[tuple[int, str]]:
    """Exit code and words of each `python -m MODULE ARGS` with the package installed, one after the other in one process."""
    r = subprocess.run(
        [sys.executable, "-c", TURNS], input=json.dumps([[str(w) for w in c] for c in wanted]), check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT_S,
        env={**os.environ, "PYTHONPATH": str(site), "COLUMNS": "200"},
    )  # fmt: skip
    said = re.findall(r"(.*?)\f(\d+)\n", r.stdout, re.DOTALL)
    assert len(said) == len(wanted), r.stdout[-3000:]
    return [(int(code), words) for words, code in said]


@pytest.fixture(scope="module")
def told(site: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """What its scenario, flown a while, and the commands that look for parts say; "folder": where the run and the dialect are."""
    out = tmp_path_factory.mktemp("runs")
    scenario = site / "example" / "scenarios" / "cruise.toml"
    wanted: dict[str, Call] = {
        "run": ("hil_scripts.sil", "run", scenario, "--duration", SECONDS, "--in-process", "--out", out / "run"),
        "list": ("hil_scripts.sil", "list", "campaigns"),
        "send": ("ground", "send", "list"),
        "report": ("ground", "report", "--help"),
        "dialect": ("ground", "dialect", "--out", out / "all.py"),
    }
    return dict(zip(wanted, calls(site, *wanted.values()), strict=True)) | {"folder": (0, str(out))}


@pytest.fixture(scope="module")
def run(told: dict[str, tuple[int, str]]) -> Path:
    """Its scenario, flown a while; with picture."""
    code, words = told["run"]
    assert code == 0, words[-2000:]
    return Path(told["folder"][1]) / "run"


MINE = ("--set", "receiver.nav.filter=example:MyFilter", "--set", "tanker.nav.filter=example_fading",
        "--set", "tanker.ctrl.law=example:MyLaw")  # fmt: skip
OTHERS: dict[str, tuple[object, ...]] = {  # settings of the refuelling, and its duration [s]
    "mine": (10, *MINE),
    "none": (1, "--set", "tanker.ctrl.law=example:MyFilter"),
    "weight": (1, "--set", "tanker.ctrl.law=example:MyLaw", "--set", "tanker.ctrl.w_input=[0.1, 0.1, 0.1, 3e4]"),
}


@pytest.fixture(scope="module")
def flown(site: Path, run: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """The replay of that run, in another process, and refuellings with its parts; "folder": where they are."""
    out = tmp_path_factory.mktemp("others")
    refuel = ("hil_scripts.sil", "run", "refueling", "--in-process", "--no-rrd")
    wanted: dict[str, Call] = {"replay": ("hil_scripts.sil", "replay", run)}
    wanted |= {n: (*refuel, "--out", out / n, "--duration", seconds, *sets) for n, (seconds, *sets) in OTHERS.items()}
    return dict(zip(wanted, calls(site, *wanted.values()), strict=True)) | {"folder": (0, str(out))}


def test_it_flies_and_its_view_gives_figures(run: Path) -> None:
    s = json.loads((run / "summary.json").read_text())
    assert s["run.outcome"] == "completed" and s["example.navion.samples"] > 30
    assert s["example.navion.wind_rms_mps.n"] < 1.5 and s["example.navion.wind_inside_3sigma_pct"] > 95.0
    assert s["log.unknown"] == 0
    assert (run / "dialect" / "dialect.xml").read_text() == (EXAMPLE / "example" / "dialect.xml").read_text()
    assert (run / "aircraft" / "navion.toml").exists()


def test_its_tab_is_in_the_recording(run: Path) -> None:
    assert {"/nav/navion/triangle/n", "/guid/navion/course_error"} <= set(rows(run / "run.rrd"))


def test_replay_repeats_it(flown: dict[str, tuple[int, str]]) -> None:
    code, words = flown["replay"]
    assert code == 0, words[-2000:]
    row = next(line for line in words.splitlines() if "navion" in line)
    ticks, packets, differ, extra = (int(x) for x in row.replace("│", " ").split()[1:])
    assert (ticks, differ, extra) == (round(SECONDS * 100), 0, 0) and packets > ticks


def test_its_study_report_and_commands_are_found(told: dict[str, tuple[int, str]]) -> None:
    assert [told[name][0] for name in ("list", "send", "report", "dialect")] == [0] * 4, told
    assert "Wind by the triangle" in told["list"][1]
    assert "course: example_cruise" in told["send"][1]
    assert "triangle" in told["report"][1]
    assert "EXAMPLE_WIND" in (Path(told["folder"][1]) / "all.py").read_text()


def test_its_filter_and_its_law_fly_anybody_s_mission(flown: dict[str, tuple[int, str]]) -> None:
    code, words = flown["mine"]
    assert code == 0, words[-2000:]
    run = load(Path(flown["folder"][1]) / "mine")
    assert json.loads((run.folder / "summary.json").read_text())["run.outcome"] == "completed"
    said, truth = run.tlm.get(1, "CONTROL_TERMS"), run.truth.get(1, "TRUTH")
    assert said is not None and truth is not None
    assert set(said["law"].tolist()) == {b"cascade", b"recovery"}  # the second watches
    assert (said["closed"] != 0)[said["law"] == b"cascade"].mean() > 0.9
    assert np.abs(truth["V"] - 195.0).max() < 2.0 and np.abs(truth["pos_n"][:, 2] + 7010.0).max() < 15.0


def test_a_law_that_is_none_is_refused_by_the_name_of_its_key(flown: dict[str, tuple[int, str]]) -> None:
    code, words = flown["none"]
    assert code == 2, words
    assert "ctrl.law = 'example:MyFilter'" in " ".join(words.split())


def test_a_weight_that_its_law_does_not_obey_is_refused(flown: dict[str, tuple[int, str]]) -> None:
    """The flight file's own, which the tanker would have without it, is none that was set."""
    code, words = flown["weight"]
    assert code == 2, words
    assert "ctrl.w_input = (0.1, 0.1, 0.1, 30000.0): not obeyed by" in " ".join(words.split())
