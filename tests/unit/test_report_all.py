"""`ground report all`: every page there are campaigns for, from folders or a folder of them; what no page reads is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.report.base import Report
from ground.report.lee import states
from ground.report.load import load
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.hoffmann import study as hoffmann
from hil_scripts.studies.lee import study as lee

pytestmark = pytest.mark.usefixtures("small_pictures")


def _nothing(case: Case, seed: int) -> RunResult:
    return RunResult({"value": 1.0})


OTHER = Study("other", "Of nobody", "read by no page", (Case("a"),), _nothing)


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of three campaigns, two of them of works."""
    root = tmp_path_factory.mktemp("campaigns")
    short = tuple(
        Case(c.name, c.params | {"duration_s": 12.0, "after_s": 4.0}) for c in lee.TABLE.cases if c.name == "tanker_II"
    )
    for study in (OTHER, hoffmann.GAINS, replace(lee.TABLE, cases=short)):
        run_campaign(study, 1, 1, root / f"{study.name}-1", workers=0, progress=False)
    return root


def test_pages_of_a_folder_of_campaigns(campaigns: Path, tmp_path: Path) -> None:
    r = CliRunner().invoke(app, ["report", "all", str(campaigns), "--out", str(tmp_path)])
    assert r.exit_code == 0, r.output
    assert sorted(p.name for p in tmp_path.iterdir()) == ["hoffmann", "lee"]
    for work in ("hoffmann", "lee"):
        text = (tmp_path / work / f"{work}.html").read_text()
        assert 'id="prints"' in text and "reproduced with correction" in text
    assert "no page reads: other" in r.output


def test_single_folders_do_as_well_and_nothing_is_an_error(campaigns: Path, tmp_path: Path) -> None:
    one = campaigns / "hoffmann_gains-1"
    r = CliRunner().invoke(app, ["report", "all", str(one), "--out", str(tmp_path)])
    assert r.exit_code == 0 and [p.name for p in tmp_path.iterdir()] == ["hoffmann"]
    empty = CliRunner().invoke(app, ["report", "all", str(tmp_path / "none"), "--out", str(tmp_path)])
    assert empty.exit_code == 2 and "not a campaign folder" in empty.output


def test_a_page_reads_names_and_patterns() -> None:
    r = Report("lee, lee_*", "", lambda folders, out: out)
    assert r.reads("lee") and r.reads("lee_noise") and not r.reads("leer")


def test_state_figures_are_those_of_the_print(campaigns: Path) -> None:
    """Twenty-eight figures, numbered as printed, and four drawn of the case flown here."""
    first = [n + i for n in states.FIGURES.values() for i in range(len(states.GROUPS))]
    assert len(first) == len(set(first)) == 28 and (min(first), max(first)) == (4, 45)
    assert states.FIGURES.keys() <= {c.name for c in lee.TABLE.cases}
    drawn: list[str] = []

    class Keeper:
        def add(self, name: str, png: bytes, caption: str) -> str:
            drawn.append(caption)
            return ""

    assert "States" in states.chapter(load(campaigns / "lee-1"), Keeper())  # type: ignore[arg-type]
    assert [d.split()[1] for d in drawn] == ["7.10", "7.11", "7.12", "7.13"]
