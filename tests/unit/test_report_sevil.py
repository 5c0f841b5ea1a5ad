"""The air-data report on small runs of the real studies: self-contained, every number that of a summary, chapters present."""

from __future__ import annotations

import json
import re
import runpy
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.report.cases import Cases
from ground.report.load import load
from ground.report.page import number
from ground.report.sevil import page as data
from ground.report.sevil.build import judge, sevil_report
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil import dynamic as sevil_dynamic
from hil_scripts.studies.sevil import faults as sevil_faults
from hil_scripts.studies.sevil import static as sevil_static
from hil_scripts.studies.sevil import study as sevil
from hil_scripts.studies.sevil.flight import fly_air

pytestmark = pytest.mark.usefixtures("small_pictures")

LEE = runpy.run_path(str(Path(__file__).with_name("test_report_lee.py")))
LEGS_S = (30.0, 10.0, 20.0, 10.0, 30.0)
SHORT = {"legs_s": (30.0, 10.0, 10.0, 10.0, 20.0), "faults": False}
SMALL: dict[str, dict[str, Any]] = {
    "static": {"points": 25}, "algorithms": {"points": 25}, "probes": {"points": 5}, "two_faults": {"windows": 500},
    "fdi_sweep": {"duration_s": 30.0}, "dynamic": {"filters": ["height"]}, "mismatch": {"filters": ["fixed", "height"]},
}  # fmt: skip


def fly_loop(case: Case, seed: int) -> RunResult:
    """Stands for a closed-loop flight."""
    return RunResult({"contact.rms_m.y": 0.1 + seed % 7 / 100.0, "exclusions": 1.0, "lost": 0.0})


LOOP = Study("sevil_loop_faults", "Closed-loop faults", "flights", (Case("beta_left", {}),), fly_loop)


def _small(study: Study, *names: str) -> Study:
    chosen = [c for c in study.cases if not names or c.name in names]
    return replace(study, cases=tuple(Case(c.name, c.params | SMALL.get(c.params["kind"], {})) for c in chosen))


STUDIES = (
    _small(sevil.TABLE, "static_clean", "static_all", "static_noise", "dynamic_all", "mismatch_weight_-10", "two_same_V",
           "two_unequal_V", "integrated_nose", "integrated_none"),
    _small(sevil_static.SWEEPS, "turbulence_0.1", "turbulence_0.2", "turbulence_0.39"),
    _small(sevil_static.ALGORITHM_STUDY, "small_off_node", "small_all"),
    _small(sevil_static.PROBES, "all", "tips"),
    _small(sevil_dynamic.DYNAMIC, "self_start"),
    _small(sevil_faults.SWEEPS, "fault_0", "fault_1", "fault_2", "window_5"),
    LOOP,
)  # fmt: skip


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Path]]:
    """Folders of a few cases of each study, one run each; the closed loop with three. Kinematic flights are short ones."""
    root = tmp_path_factory.mktemp("campaigns")
    rough = next(c for c in sevil.TABLE.cases if c.name == "fdi_refuelling")
    table = STUDIES[0].cases + (Case(rough.name, rough.params | SHORT),)
    studies = (replace(STUDIES[0], cases=table), *STUDIES[1:])
    with pytest.MonkeyPatch.context() as m:
        for module in (sevil_dynamic, sevil_faults):
            m.setattr(module, "fly_air", lambda c, seed: fly_air(replace(c, legs_s=LEGS_S), seed))
        m.setattr(sevil_faults, "CONTACT_S", (72.0, 82.0))
        yield [
            run_campaign(s, 3 if s is LOOP else 1, 1, root / s.name, workers=0, progress=False).folder for s in studies
        ]


@pytest.fixture(scope="module")
def page(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on all of them."""
    return sevil_report(campaigns, tmp_path_factory.mktemp("report"))


def test_no_run_failed(campaigns: list[Path]) -> None:
    assert [r["reason"] for c in campaigns for r in load(c).rows if r["status"] != "ok"] == []


def test_page_loads_nothing_and_has_every_chapter(page: Path) -> None:
    """No script, no address but anchors and embedded pictures; each link of the contents leads somewhere."""
    c = LEE["_cells"](page)
    assert not c.tags & {"script", "link", "iframe", "object", "embed"}
    assert c.loads and all(v.startswith(("#", "data:image/png;base64,")) for v in c.loads)
    text = page.read_text()
    for anchor in ("acceptance", "tables", "power", "two", "static", "sweeps", "algorithms", "dynamic", "mismatch", "integrated",
                   "sevil_loop_faults", "provenance"):  # fmt: skip
        assert f'href="#{anchor}"' in text and f'id="{anchor}"' in text


def test_numbers_are_those_of_the_summaries(page: Path, campaigns: list[Path]) -> None:
    """Every number cell names a key of some summary.json and shows its value to three digits."""
    summaries = [json.loads((c / "summary.json").read_text()) for c in campaigns]
    cells = LEE["_cells"](page).cells
    assert len(cells) > 300
    for key, value, shown in cells:
        assert any(s.get(key) == value for s in summaries), key
        assert shown == number(value)
    keys = {c[0] for c in cells}
    assert {"static_all.diff.rms_m.rms", "fdi_refuelling.printed.beta.fap_during_pct.mean"} <= keys
    assert "beta_left.contact.rms_m.y.rms" in keys


def test_pictures_are_beside_the_page_and_inside_it(page: Path) -> None:
    names = {p.stem for p in page.parent.glob("*.png")}
    assert {"map_static_all", "sweep_turbulence", "ranking", "residuals", "power_fault", "roc", "dynamic_track", "mismatch",
            "integrated"} <= names  # fmt: skip
    assert page.read_text().count("data:image/png;base64,") == len(names)


def test_printed_numbers_of_table_6_4_are_shown(page: Path) -> None:
    text = re.sub(r"<[^>]+>", " ", page.read_text())
    assert all(x in text for x in ("36.0", "77.0", "15.3"))


def test_targets_take_the_worst_of_their_values(campaigns: list[Path]) -> None:
    cases = Cases([load(c) for c in campaigns], None)  # type: ignore[arg-type]
    t = data.Target("x", "static_all", ("A11.rms_m", "diff.rms_m"), "<=", 1.0)
    stat, met = judge(cases, t)
    assert stat is not None and stat.key == "static_all.A11.rms_m.rms" and met is False
    assert judge(cases, replace(t, case="nowhere")) == (None, False)
    high = data.Target("x", "static_all", ("A11.available_pct", "diff.available_pct"), ">=", 100.0)
    stat, met = judge(cases, high)
    assert stat is not None and stat.key.startswith("static_all.A11") and not met


@pytest.mark.parametrize(
    ("sense", "value", "met"),
    [("<=", 1.0, True), ("<", 1.0, False), (">=", 1.0, True), ("within", 1.4, True), ("within", 1.6, False)],
)
def test_target_senses(sense: str, value: float, met: bool) -> None:
    assert data.Target("x", "c", ("v",), sense, 1.0, 0.5).met(value) is met


def test_every_target_names_a_case_of_the_table_study() -> None:
    assert {t.case for t in data.TARGETS} <= {c.name for c in sevil.TABLE.cases}
    assert {c for t in data.FDI_TABLES for _, c, _ in t.columns} <= {c.name for c in sevil.TABLE.cases}


def test_command_makes_the_page_of_one_folder(campaigns: list[Path], tmp_path: Path) -> None:
    r = CliRunner().invoke(app, ["report", "sevil", str(campaigns[1]), "--out", str(tmp_path / "out")])
    assert r.exit_code == 0 and (tmp_path / "out" / "sevil.html").is_file()


def test_command_names_a_folder_that_is_none(tmp_path: Path) -> None:
    r = CliRunner().invoke(app, ["report", "sevil", str(tmp_path), "--out", str(tmp_path / "out")])
    assert r.exit_code == 2 and "meta.json" in r.stderr and len(r.stderr.strip().splitlines()) == 1
