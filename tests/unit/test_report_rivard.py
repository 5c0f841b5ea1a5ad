"""The rendezvous report on small runs of the real study: self-contained, every number that of a summary, chapters present."""

from __future__ import annotations

import json
import re
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.report.cases import Cases
from ground.report.load import load
from ground.report.rivard import page as data
from ground.report.rivard.build import judge, rivard_report
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.rivard.study import STUDY

pytestmark = pytest.mark.usefixtures("small_pictures")

LEE = runpy.run_path(str(Path(__file__).with_name("test_report_lee.py")))
CASES = (
    "open", "cross_a", "cross_b", "k3_a", "k3_b", "t2_open", "gain_0", "gain_3", "gain_printed_6", "filter", "filter_2s",
    "eight_30", "b4", "b7re", "unaided_best", "bearing_1", "bearing_1_k3", "link_10", "bias_x2", "bias_x2_seed", "crosswind_30",
    "crosswind_30_seed", "crosswind_30_open", "turn_30", "turn_30_seed", "faster_50", "faster_50_seed", "slower_50", "latency_1",
    "latency_1_seed",
)  # fmt: skip
CHAPTERS = (
    "acceptance",
    "summary",
    "tables",
    "gain",
    "filters",
    "better",
    "sensors",
    "mismatch",
    "wind",
    "manoeuvre",
    "undone",
)


def fly(case: Case, seed: int) -> RunResult:
    """Stands for a flight of the full aircraft."""
    track = np.cumsum(np.ones((5, 7)), axis=0) * 1000.0
    return RunResult({"six.x_m": float(seed % 7)}, {"six.track": track, "kin.track": track + 50.0})


def pool(runs: object) -> dict[str, float | int | None]:
    """Figures with the names the study of the full aircraft uses."""
    return {
        "six.x.rms_m": 600.0,
        "six.x.rms_lo_m": 550.0,
        "six.x.rms_hi_m": 650.0,
        "six.unfinished": 0,
        "ratio.kin.x": 1.04,
    }


SIX = Study("rivard_6dof", "Full aircraft", "flights", (Case("product", {}),), fly, pool=pool)
OTHER = replace(SIX, name="rivard_more")


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Folders of a few cases, two batches of 40 each, and of two other studies."""
    root = tmp_path_factory.mktemp("campaigns")
    chosen = tuple(Case(c.name, c.params | {"batch": 40}) for c in STUDY.cases if c.name in CASES)
    studies = (replace(STUDY, cases=chosen), SIX, OTHER)
    return [run_campaign(s, 2, 1, root / s.name, workers=0, progress=False).folder for s in studies]


@pytest.fixture(scope="module")
def page(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on all of them."""
    return rivard_report(campaigns, tmp_path_factory.mktemp("report"))


def test_no_batch_failed(campaigns: list[Path]) -> None:
    assert [r["reason"] for c in campaigns for r in load(c).rows if r["status"] != "ok"] == []


def test_page_loads_nothing_and_has_every_chapter(page: Path) -> None:
    c = LEE["_cells"](page)
    assert not c.tags & {"script", "link", "iframe", "object", "embed"}
    assert c.loads and all(v.startswith(("#", "data:image/png;base64,")) for v in c.loads)
    text = page.read_text()
    for anchor in (*CHAPTERS, "rivard_6dof", "rivard_more", "provenance"):
        assert f'href="#{anchor}"' in text and f'id="{anchor}"' in text, anchor


def test_numbers_are_those_of_the_summaries(page: Path, campaigns: list[Path]) -> None:
    """Every number cell names a summary key, carries its SI value and shows it in its unit."""
    summaries = [json.loads((c / "summary.json").read_text()) for c in campaigns]
    pattern = r'data-key="([^"]+)" data-value="([^"]+)" data-scale="([^"]+)">([^<]+)<'
    cells = re.findall(pattern, page.read_text())
    assert len(cells) > 250
    for key, value, scale, shown in cells:
        assert any(s.get(key) == float(value) for s in summaries), key
        digits = len(shown.partition(".")[2])
        factor = float(scale)
        assert float(shown) == pytest.approx(float(value) / factor, abs=0.51 * 10.0**-digits), key
    assert {"open.x.rms_m.rms", "b7re.y.rms_m.rms", "product.six.x.rms_m"} <= {c[0] for c in cells}


def test_pictures_are_beside_the_page_and_inside_it(page: Path) -> None:
    names = {p.stem for p in page.parent.glob("*.png")}
    want = {
        "scatter",
        "gain",
        "consistency",
        "sigmas",
        "plan_b7re",
        "plan_unaided_best",
        "sensors_x",
        "sensors_y",
        "detection",
    }
    assert want | {"six_product"} == names
    assert page.read_text().count("data:image/png;base64,") == len(names)


def test_printed_numbers_and_bands_are_shown(page: Path) -> None:
    text = re.sub(r"<[^>]+>", " ", page.read_text())
    assert all(x in text for x in ("1.09", "1.62", "below print"))
    assert text.count("% below print") >= 6 * 6


def test_goals_name_cases_of_the_study_and_take_the_worst(campaigns: list[Path]) -> None:
    known = {c.name for c in STUDY.cases}
    assert {g.case for g in data.GOALS} <= known
    for group in (data.STEPS, data.UNAIDED, data.SENSORS):
        assert {row[0] for row in group} <= known
    assert {n for _, a, b in (*data.TABLE1, *data.TABLE2) for n in (a, b) if n} <= known
    cases = Cases([load(campaigns[0])], None)  # type: ignore[arg-type]
    goal = data.Goal("x", "b7re", ("y.rms_m", "x.rms_m"), "<=", 1.0)
    stat, met = judge(cases, goal)
    assert stat is not None and stat.key == "b7re.x.rms_m.rms" and met
    assert judge(cases, replace(goal, limit=0.01))[1] is False
    assert judge(cases, replace(goal, case="nowhere")) == (None, False)


@pytest.mark.parametrize(
    ("case", "text"),
    [
        ("turn_-30", "turns -30 deg at 60 s"),
        ("slower_50", "50 kn slower from 60 s"),
        ("latency_1", "1 s late, not stamped"),
    ],
)
def test_labels(case: str, text: str) -> None:
    assert data.label(case) == text


def test_command(campaigns: list[Path], tmp_path: Path) -> None:
    r = CliRunner().invoke(app, ["report", "rivard", str(campaigns[1]), "--out", str(tmp_path / "out")])
    assert r.exit_code == 0 and (tmp_path / "out" / "rivard.html").is_file()
    r = CliRunner().invoke(app, ["report", "rivard", str(tmp_path), "--out", str(tmp_path / "out")])
    assert r.exit_code == 2 and "meta.json" in r.stderr and len(r.stderr.strip().splitlines()) == 1
