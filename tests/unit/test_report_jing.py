"""The windshear report on small runs of the real studies: self-contained, every number that of a summary, chapters present."""

from __future__ import annotations

import json
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.report.goals import judged
from ground.report.jing import page as data
from ground.report.jing import sensors as sensor_chapter
from ground.report.jing.build import jing_report
from ground.report.load import load
from ground.report.page import number
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Study
from hil_scripts.studies.jing import escape as jing_escape
from hil_scripts.studies.jing import sensors as jing_sensors
from hil_scripts.studies.jing import study as jing

pytestmark = pytest.mark.usefixtures("small_pictures")

LEE = runpy.run_path(str(Path(__file__).with_name("test_report_lee.py")))
ALL = (*jing.STUDIES, *jing_escape.STUDIES)


FEW = ("managed", "pitch_15", "pitch_10")  # laws flown here


def _small(study: Study, *names: str, **params: Any) -> Study:
    chosen = (c for c in study.cases if c.name in names)
    return replace(study, cases=tuple(replace(c, params=c.params | params) for c in chosen))


STUDIES = (
    _small(jing.NOMINAL, "ukf13", "ekf15"),
    _small(jing.MODEL_ERROR, "ukf13_printed_noise", "ekf15"),
    _small(jing_escape.ESCAPE, "severe_350_pair_light"),
    _small(jing_escape.SURVIVAL, "light", laws=list(FEW)),
    _small(jing_escape.ALERTS, "clear_1p5", "seed_0_quick", duration_s=40.0),
    _small(jing_sensors.STUDY, "clean_tactical", "fault_baro_lost"),
)


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of a few cases of each study, one run each."""
    root = tmp_path_factory.mktemp("campaigns")
    with pytest.MonkeyPatch.context() as m:
        m.setattr(jing_escape, "LAWS", {name: jing_escape.LAWS[name] for name in FEW})
        for end in ("CLEAN_S", "BURST_S"):  # a few seconds after the fault
            m.setattr(jing_sensors, end, jing_sensors.FAULT_S + 5.0)
        return [run_campaign(s, 1, 1, root / s.name, workers=0, progress=False).folder for s in STUDIES]


@pytest.fixture(scope="module")
def page(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on all of them."""
    return jing_report(campaigns, tmp_path_factory.mktemp("report"))


def test_page_loads_nothing_and_has_every_chapter(page: Path, campaigns: list[Path]) -> None:
    assert [r["reason"] for c in campaigns for r in load(c).rows if r["status"] != "ok"] == []
    c = LEE["_cells"](page)
    assert not c.tags & {"script", "link", "iframe", "object", "embed"}
    assert c.loads and all(v.startswith(("#", "data:image/png;base64,")) for v in c.loads)
    text = page.read_text()
    for anchor in ("acceptance", "nominal", "error", "escape", "survival", "alerts", "sensors", "provenance"):
        assert f'href="#{anchor}"' in text and f'id="{anchor}"' in text


def test_numbers_are_those_of_the_summaries(page: Path, campaigns: list[Path]) -> None:
    """Every number cell names a key of some summary.json and shows its value to three digits."""
    summaries = [json.loads((c / "summary.json").read_text()) for c in campaigns]
    cells = LEE["_cells"](page).cells
    assert len(cells) > 100
    for key, value, shown in cells:
        assert any(s.get(key) == value for s in summaries), key
        assert shown == number(value)


def test_pictures_are_beside_the_page_and_inside_it(page: Path) -> None:
    names = {p.stem for p in page.parent.glob("*.png")}
    assert names == {"jing_ekf15", "jing_model_error_ekf15", "jing_model_error_ukf13_printed_noise",
                     "escape_severe_350_pair_light", "survival_light"}  # fmt: skip
    assert page.read_text().count("data:image/png;base64,") == len(names)


def test_goals_and_references_name_what_the_studies_have() -> None:
    cases = {s.name: {c.name for c in s.cases} for s in ALL}
    assert all(g.case in cases[g.study] for g in sensor_chapter.GOALS)
    assert {g.study for g in data.GOALS} <= cases.keys() and set(data.ORDER) == cases.keys()
    assert all(g.case in cases[g.study] for g in data.GOALS)
    assert all(held.keys() <= cases[study] for study, held in data.HELD_OUT.items())
    assert set(data.LAWS) | {"continue"} == set(jing.LAWS) and data.SURVIVED.keys() <= data.LAWS.keys()
    assert cases["jing_model_error"] == data.REMEDY.keys()
    assert cases["jing_survival"] == data.SURVIVAL_CASES.keys()
    assert cases["jing"] | cases["jing_model_error"] == data.LABELS.keys()


def test_goals_are_judged_where_there_is_a_campaign(campaigns: list[Path]) -> None:
    found = {c.study: c for c in map(load, campaigns)}
    table, cards = judged(found, data.GOALS)
    flown = {(study.name, case.name) for study in STUDIES for case in study.cases}
    assert table.count("<tr>") == 1 + sum((g.study, g.case) in flown for g in data.GOALS)  # a row of heads
    assert "acceptance figures met" in cards
    table, cards = judged({"jing": found["jing"]}, data.GOALS)
    assert table.count("<tr>") == 5 and " of 4</b>" in cards


def test_command(campaigns: list[Path], tmp_path: Path) -> None:
    ended = CliRunner().invoke(app, ["report", "jing", str(campaigns[0]), "--out", str(tmp_path / "r")])
    assert ended.exit_code == 0 and (tmp_path / "r" / "jing.html").exists()
    ended = CliRunner().invoke(app, ["report", "jing", str(tmp_path / "none"), "--out", str(tmp_path / "r")])
    assert ended.exit_code == 2
