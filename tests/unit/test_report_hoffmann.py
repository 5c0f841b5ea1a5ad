"""The gust report on small runs of the real studies: self-contained, every number that of a summary, chapters present."""

from __future__ import annotations

import json
import re
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from flightsw.missions.gust.printed import H_PRINTED
from ground.__main__ import app
from ground.report.goals import judge
from ground.report.hoffmann import found_goals
from ground.report.hoffmann import page as data
from ground.report.hoffmann.build import hoffmann_report
from ground.report.load import load
from ground.report.page import number
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, Study
from hil_scripts.studies.hoffmann import loop as hoffmann_loop
from hil_scripts.studies.hoffmann import robust as hoffmann_robust
from hil_scripts.studies.hoffmann import sensors as hoffmann_sensors
from hil_scripts.studies.hoffmann import study as hoffmann

pytestmark = pytest.mark.usefixtures("small_pictures")

LEE = runpy.run_path(str(Path(__file__).with_name("test_report_lee.py")))
SHORT: dict[str, dict[str, Any]] = {
    "changing": {"duration_s": 9.0, "steps": [[0.0, 0.0], [3.0, 1.0], [6.0, 0.0]]},
    "sigma_1": {"duration_s": 30.0},
}  # fmt: skip


def _small(study: Study, *names: str, duration_s: float = 6.0) -> Study:
    chosen = [c for c in study.cases if not names or c.name in names]
    short = {"duration_s": duration_s} if duration_s else {}
    return replace(study, cases=tuple(Case(c.name, c.params | short | SHORT.get(c.name, {})) for c in chosen))


STUDIES = (
    hoffmann.GAINS,
    hoffmann.OBSERVABILITY,
    _small(hoffmann.CASES, "case1", "case2", "nonlinear"),
    _small(hoffmann.SPECTRA, "sigma_1"),
    _small(hoffmann.CONSISTENCY, "sigma_0p3"),
    _small(hoffmann_loop.ALLEVIATION, "linear", "nonlinear", duration_s=5.0),
    _small(hoffmann_robust.STUDY, "as_believed", "servo_80", duration_s=5.0),
    _small(hoffmann_sensors.STUDY, "nominal", "late_2", duration_s=8.0),
    _small(hoffmann_loop.ADAPTATION, "calm", "changing"),
)
ALL = (*hoffmann.STUDIES, *hoffmann_loop.STUDIES, hoffmann_robust.STUDY, hoffmann_sensors.STUDY)


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of a few cases of each study, one run each."""
    root = tmp_path_factory.mktemp("campaigns")
    return [run_campaign(s, 1, 1, root / s.name, workers=0, progress=False).folder for s in STUDIES]


@pytest.fixture(scope="module")
def page(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on all of them."""
    return hoffmann_report(campaigns, tmp_path_factory.mktemp("report"))


def test_page_loads_nothing_and_has_every_chapter(page: Path, campaigns: list[Path]) -> None:
    assert [r["reason"] for c in campaigns for r in load(c).rows if r["status"] != "ok"] == []
    c = LEE["_cells"](page)
    assert not c.tags & {"script", "link", "iframe", "object", "embed"}
    assert c.loads and all(v.startswith(("#", "data:image/png;base64,")) for v in c.loads)
    text = page.read_text()
    for anchor in ("acceptance", "gains", "cases", "spectra", "consistency", "observability", "alleviation", "robustness",
                   "sensors", "prints", "adaptation", "provenance"):  # fmt: skip
        assert f'href="#{anchor}"' in text and f'id="{anchor}"' in text


def test_numbers_are_those_of_the_summaries(page: Path, campaigns: list[Path]) -> None:
    """Every number cell names a key of some summary.json and shows its value to three digits."""
    summaries = [json.loads((c / "summary.json").read_text()) for c in campaigns]
    cells = LEE["_cells"](page).cells
    assert len(cells) > 400
    for key, value, shown in cells:
        assert any(s.get(key) == value for s in summaries), key
        assert shown == number(value)


def test_each_reference_stands_beside_the_statistic_it_is_of(page: Path) -> None:
    text = page.read_text()
    rows = [r for r in re.findall(r"<tr>(.*?)</tr>", text) if 'data-key="case2.printed.alpha_w.rms_deg.rms"' in r]
    cells = re.findall(r"<td[^>]*?(?:data-key=\"([^\"]*)\"[^>]*)?>([^<]*)", rows[0])
    at = [key for key, _ in cells].index
    assert cells[at("case2.printed.alpha_w.mean_deg.mean") + 1] == ("", "0.280")
    assert cells[at("case2.printed.alpha_w.std_deg.pooled") + 1] == ("", "0.590")
    assert cells[at("case2.printed.v_w.mean_mps.mean") + 1] == ("", "0.400")


def test_the_page_says_what_the_printed_gain_achieves_when_joined(page: Path) -> None:
    words = re.sub(r"<[^>]+>", " ", page.read_text())
    for name in ("printed gain", "printed gain, readings joined", "estimate, told medium turbulence"):
        assert re.search(rf"{name}: -?\d+ % below 2 Hz, -?\d+ % in total", words)


def test_all_45_gains_stand_beside_the_print(page: Path) -> None:
    cells = {key: value for key, value, _ in LEE["_cells"](page).cells}
    for i in range(9):
        for j in range(5):
            assert cells[f"back_fitted.gain_{i + 1}_{j + 1}.printed.mean"] == H_PRINTED[i, j]
            assert f"back_fitted.gain_{i + 1}_{j + 1}.computed.mean" in cells
    text = re.sub(r"<[^>]+>", " ", page.read_text())
    assert text.count("rounded") >= 1


def test_pictures_are_beside_the_page_and_inside_it(page: Path) -> None:
    names = {p.stem for p in page.parent.glob("*.png")}
    assert {"states_case1", "errors_case1", "errors_case2", "spectra_case1", "spectra_case2"} <= names
    assert {"gains", "flight_case1", "flight_case2", "flight_nonlinear", "spectra", "loads_linear", "loads_nonlinear",
            "adaptation"} <= names  # fmt: skip
    assert page.read_text().count("data:image/png;base64,") == len(names)


def test_goals_and_references_name_what_the_studies_have() -> None:
    cases = {s.name: {c.name for c in s.cases} for s in ALL}
    assert all(g.case in cases[g.study] for g in found_goals.GOALS)
    assert {g.study for g in data.GOALS} <= cases.keys() and set(data.ORDER) == cases.keys()
    assert all(g.case in cases[g.study] for g in data.GOALS)
    loops = {a for _, *pair in [(s[2], s[0], s[1]) for s in data.STEPS] for a in pair}
    assert loops | {a for held in data.ALLEVIATION.values() for a in held} <= data.LABELS.keys()
    assert data.AIRCRAFT.keys() == cases["hoffmann_robustness"]
    assert data.HELD_OUT.keys() <= cases["hoffmann"] and data.ALLEVIATION.keys() <= cases["hoffmann_alleviation"]


def test_the_gain_goal_is_met_and_a_missing_campaign_says_nothing(campaigns: list[Path]) -> None:
    found = {c.study: c for c in map(load, campaigns)}
    stat, met = judge(found, data.GOALS[0])
    assert stat is not None and stat.value == 45.0 and met
    assert judge({}, data.GOALS[0]) == (None, False)


def test_command_makes_the_page_of_one_folder(campaigns: list[Path], tmp_path: Path) -> None:
    r = CliRunner().invoke(app, ["report", "hoffmann", str(campaigns[0]), "--out", str(tmp_path / "out")])
    assert r.exit_code == 0 and (tmp_path / "out" / "hoffmann.html").exists()
    assert CliRunner().invoke(app, ["report", "hoffmann", str(tmp_path / "nothing")]).exit_code == 2


def test_bench_has_a_row_for_every_estimator_and_law() -> None:
    from flightsw.missions.gust.estimators import ESTIMATORS
    from flightsw.missions.gust.laws import LAWS
    from hil_scripts.bench import gust as bench_gust

    took = bench_gust.estimators(2.0) | bench_gust.laws(120)
    assert set(took) == {*ESTIMATORS, *LAWS}
    assert all(0.0 < t.median_us <= t.p99_us for t in took.values())
