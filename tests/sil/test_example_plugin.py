"""A mission from another package: found, flown, replayed, shown and commanded without a line of ours that names it."""

from __future__ import annotations

import json
import os
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


def start(site: Path, module: str, *args: object) -> subprocess.CompletedProcess[str]:
    """`python -m MODULE ARGS` with the package installed, to its end."""
    return subprocess.run(
        [sys.executable, "-m", module, *map(str, args)], capture_output=True, text=True, timeout=TIMEOUT_S, check=False,
        env={**os.environ, "PYTHONPATH": str(site), "COLUMNS": "200"},
    )  # fmt: skip


def call(site: Path, module: str, *args: object) -> str:
    """Words of `python -m MODULE ARGS` with the package installed; it must end well."""
    r = start(site, module, *args)
    assert r.returncode == 0, r.stdout[-2000:] + r.stderr[-2000:]
    return r.stdout


@pytest.fixture(scope="module")
def run(site: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its scenario, flown a while; with picture."""
    out = tmp_path_factory.mktemp("runs") / "run"
    scenario = site / "example" / "scenarios" / "cruise.toml"
    call(site, "hil_scripts.sil", "run", scenario, "--duration", SECONDS, "--in-process", "--out", out)
    return out


def test_it_flies_and_its_view_gives_figures(run: Path) -> None:
    s = json.loads((run / "summary.json").read_text())
    assert s["run.outcome"] == "completed" and s["example.navion.samples"] > 30
    assert s["example.navion.wind_rms_mps.n"] < 1.5 and s["example.navion.wind_inside_3sigma_pct"] > 95.0
    assert s["log.unknown"] == 0
    assert (run / "dialect" / "dialect.xml").read_text() == (EXAMPLE / "example" / "dialect.xml").read_text()
    assert (run / "aircraft" / "navion.toml").exists()


def test_its_tab_is_in_the_recording(run: Path) -> None:
    assert {"/nav/navion/triangle/n", "/guid/navion/course_error"} <= set(rows(run / "run.rrd"))


def test_replay_repeats_it(site: Path, run: Path) -> None:
    words = call(site, "hil_scripts.sil", "replay", run)
    row = next(line for line in words.splitlines() if "navion" in line)
    ticks, packets, differ, extra = (int(x) for x in row.replace("│", " ").split()[1:])
    assert (ticks, differ, extra) == (round(SECONDS * 100), 0, 0) and packets > ticks


def test_its_study_report_and_commands_are_found(site: Path, tmp_path: Path) -> None:
    listed = call(site, "hil_scripts.sil", "list", "campaigns")
    assert "Wind by the triangle" in listed
    assert "course: example_cruise" in call(site, "ground", "send", "list")
    assert "triangle" in call(site, "ground", "report", "--help")
    call(site, "ground", "dialect", "--out", tmp_path / "all.py")
    assert "EXAMPLE_WIND" in (tmp_path / "all.py").read_text()


def test_its_filter_and_its_law_fly_anybody_s_mission(site: Path, tmp_path: Path) -> None:
    call(site, "hil_scripts.sil", "run", "refueling", "--duration", 10, "--in-process", "--no-rrd", "--out", tmp_path / "run",
         "--set", "receiver.nav.filter=example:MyFilter", "--set", "tanker.nav.filter=example_fading",
         "--set", "tanker.ctrl.law=example:MyLaw")  # fmt: skip
    run = load(tmp_path / "run")
    assert json.loads((run.folder / "summary.json").read_text())["run.outcome"] == "completed"
    said, truth = run.tlm.get(1, "CONTROL_TERMS"), run.truth.get(1, "TRUTH")
    assert said is not None and truth is not None
    assert set(said["law"].tolist()) == {b"cascade", b"recovery"}  # the second watches
    assert (said["closed"] != 0)[said["law"] == b"cascade"].mean() > 0.9
    assert np.abs(truth["V"] - 195.0).max() < 2.0 and np.abs(truth["pos_n"][:, 2] + 7010.0).max() < 15.0


def test_a_law_that_is_none_is_refused_by_the_name_of_its_key(site: Path, tmp_path: Path) -> None:
    r = start(site, "hil_scripts.sil", "run", "refueling", "--duration", 1, "--in-process", "--no-rrd", "--out", tmp_path / "run",
              "--set", "tanker.ctrl.law=example:MyFilter")  # fmt: skip
    assert r.returncode == 2, r.stdout
    words = " ".join((r.stdout + r.stderr).split())
    assert "ctrl.law = 'example:MyFilter'" in words


def test_a_weight_that_its_law_does_not_obey_is_refused(site: Path, tmp_path: Path) -> None:
    """The flight file's own, which the tanker would have without it, is none that was set."""
    r = start(site, "hil_scripts.sil", "run", "refueling", "--duration", 1, "--in-process", "--no-rrd", "--out", tmp_path / "run",
              "--set", "tanker.ctrl.law=example:MyLaw", "--set", "tanker.ctrl.w_input=[0.1, 0.1, 0.1, 3e4]")  # fmt: skip
    assert r.returncode == 2, r.stdout
    assert "ctrl.w_input = (0.1, 0.1, 0.1, 30000.0): not obeyed by" in " ".join((r.stdout + r.stderr).split())
