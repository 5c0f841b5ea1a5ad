"""The report: nothing loaded from elsewhere, every number that of summary.json, tolerant of what is missing."""

from __future__ import annotations

import json
import re
import runpy
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ground.__main__ import app
from ground.report.lee.build import lee_report
from ground.report.load import ReportError, load
from ground.report.page import number

pytestmark = pytest.mark.usefixtures("small_pictures")

SYNTH = runpy.run_path(str(Path(__file__).with_name("report_synth.py")))


class Cells(HTMLParser):
    """Collects number cells (key, value, text shown) and every address a browser would load."""

    def __init__(self) -> None:
        super().__init__()
        self.cells: list[tuple[str, float, str]] = []
        self.loads: list[str] = []
        self.tags: set[str] = set()
        self._key: tuple[str, float] | None = None

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note the cell and what it would load."""
        self.tags.add(tag)
        a = dict(attrs)
        self.loads += [v for k, v in attrs if k in ("src", "href", "data", "srcset") and v]
        if "data-key" in a:
            self._key = str(a["data-key"]), float(str(a["data-value"]))

    def handle_data(self, data: str) -> None:
        """The first text of a cell is its number."""
        if self._key is not None:
            self.cells.append((*self._key, data))
            self._key = None


@pytest.fixture(scope="module")
def campaigns(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Synthetic folders of lee, lee_colour and lee_noise, four runs a case."""
    found: list[Path] = SYNTH["write"](tmp_path_factory.mktemp("campaigns"), 4)
    return found


@pytest.fixture(scope="module")
def page(campaigns: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report on all of them."""
    return lee_report(campaigns, tmp_path_factory.mktemp("report"))


def _cells(page: Path) -> Cells:
    parser = Cells()
    parser.feed(page.read_text())
    return parser


def test_page_loads_nothing(page: Path) -> None:
    """No script, no address but in-page anchors and embedded pictures, no url() in the style."""
    c = _cells(page)
    assert not c.tags & {"script", "link", "iframe", "object", "embed"}
    assert c.loads and all(v.startswith(("#", "data:image/png;base64,")) for v in c.loads)
    style = re.search(r"<style>(.*?)</style>", page.read_text(), re.S)
    assert style is not None and "url(" not in style[1] and "@import" not in style[1]
    assert "http://" not in page.read_text() and "https://" not in page.read_text()


def test_numbers_are_those_of_the_summaries(page: Path, campaigns: list[Path]) -> None:
    """Every number cell names a key of some summary.json and shows its value to three digits."""
    summaries = [json.loads((c / "summary.json").read_text()) for c in campaigns]
    cells = _cells(page).cells
    assert len(cells) > 500
    for key, value, shown in cells:
        assert any(s.get(key) == value for s in summaries), key
        assert shown == number(value)
    assert {"tanker_I.default.wind.magnitude_rms_pct.rms", "tau_20.printed.wind.direction_rms_deg.rms"} <= {
        c[0] for c in cells
    }
    assert "G_7.measured.lost.mean" in {c[0] for c in cells}


def test_pictures_beside_the_page(page: Path) -> None:
    """Overview, two time histories of each tanker case, and the sweeps, each as a PNG file and inside the page."""
    names = {p.stem for p in page.parent.glob("*.png")}
    assert {"tanker_magnitude", "tanker_I_wind", "tanker_I_errors", "lee_colour_wind", "lee_noise_contact"} <= names
    assert page.read_text().count("data:image/png;base64,") == len(names)


def test_failed_runs_are_told_with_their_reason(page: Path, campaigns: list[Path]) -> None:
    """A failed run shows in the page whenever the campaign has one, and a made-up one always does."""
    c = load(campaigns[0])
    for row in c.rows[:2]:
        row |= {"status": "failed", "reason": "<b>lost</b>"}
    assert c.reasons()[c.rows[0]["case"], "<b>lost</b>"] >= 1
    from ground.report.build import provenance

    assert "&lt;b&gt;lost&lt;/b&gt;" in provenance([c])


def test_better_counts_runs_on_the_same_noise(campaigns: list[Path]) -> None:
    """The synthetic default is better in every run."""
    better = load(campaigns[0]).better("tanker_II", "default.wind.magnitude_rms_pct", "cmw.wind.magnitude_rms_pct")
    assert better == (4, 4)


def test_missing_traces_and_filters_are_left_out(campaigns: list[Path], tmp_path: Path) -> None:
    """Without traces there are no time histories; the tables stay."""
    folder = tmp_path / "c"
    shutil.copytree(campaigns[0], folder, ignore=shutil.ignore_patterns("traces"))
    made = lee_report([folder], tmp_path / "out")
    assert not (tmp_path / "out" / "tanker_I_wind.png").exists()
    assert _cells(made).cells


@pytest.mark.parametrize(
    ("break_it", "says"),
    [
        (lambda f: (f / "meta.json").unlink(), "meta.json: No such file"),
        (lambda f: (f / "summary.json").write_text("{"), "summary.json: damaged"),
        (lambda f: (f / "runs.parquet").write_bytes(b"PAR1"), "runs.parquet: cannot be read"),
        (lambda f: (f / "traces" / "tanker_I.npz").write_bytes(b"PK"), "tanker_I.npz: cannot be read"),
    ],
)
def test_damaged_folder_is_named(campaigns: list[Path], tmp_path: Path, break_it: object, says: str) -> None:
    """One line on stderr naming the file, exit 1, no traceback."""
    folder = tmp_path / "c"
    shutil.copytree(campaigns[0], folder)
    break_it(folder)  # type: ignore[operator]
    r = CliRunner().invoke(app, ["report", "lee", str(folder), "--out", str(tmp_path / "out")])
    assert r.exit_code == 2 and says in r.stderr and len(r.stderr.strip().splitlines()) == 1


def test_two_campaigns_of_one_study_are_refused(campaigns: list[Path], tmp_path: Path) -> None:
    """Which one would be shown is not for the program to guess."""
    with pytest.raises(ReportError, match="both of study lee"):
        lee_report([campaigns[0], campaigns[0]], tmp_path)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        (float("nan"), "–"),
        (0.0, "0"),
        (3, "3"),
        (1.2345, "1.23"),
        (99.96, "100.0"),
        (1234.5, "1234"),
        (1e-6, "1.00e-06"),
    ],
)
def test_numbers_are_shown_to_three_digits(value: float | None, shown: str) -> None:
    """Fixed point where that can be read, a dash for no number."""
    assert number(value) == shown
