"""Colours for both themes, shapes, what two runs were flown with, bounds of the index."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from ground.gallery import find, page, within
from ground.rrd import palette
from ground.rrd.outline import ABOVE, SIDE, placed
from ground.rrd.series import AXIS
from ground.settings import differences
from tests.drawn import rows

DARK, LIGHT = (13, 16, 17), (255, 255, 255)  # backgrounds of the viewer's plots


def luminance(color: tuple[int, ...]) -> float:
    """Relative luminance of an sRGB colour (WCAG 2.2)."""
    c = np.array(color) / 255.0
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(a: tuple[int, ...], b: tuple[int, ...]) -> float:
    """Contrast ratio of two colours (WCAG 2.2)."""
    x, y = sorted((luminance(a), luminance(b)))
    return (y + 0.05) / (x + 0.05)


def test_contrast_against_the_standards_own_examples() -> None:
    assert contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert contrast((118, 118, 118), (255, 255, 255)) == pytest.approx(4.54, abs=0.01)


def test_lines_can_be_seen_in_both_themes() -> None:
    """WCAG 2.2, 1.4.11 asks for 3 of what carries meaning; limits about an estimate may be fainter."""
    p = palette
    for color in (p.TRUTH, p.NAV, p.BOX, p.COMMAND, p.ALARM, *p.CRAFTS, *AXIS):
        assert contrast(color, DARK) >= 3.0 and contrast(color, LIGHT) >= 3.0, color
    assert min(contrast(p.BAND, DARK), contrast(p.BAND, LIGHT)) >= 3.0
    assert contrast(p.WHITE, p.BACKGROUND) >= 7.0 and contrast(p.NAV, p.BACKGROUND) >= 3.0


def test_an_outline_is_turned_the_way_the_nose_points() -> None:
    at = np.array([[10.0, 5.0], [0.0, 0.0]])
    nose = placed(SIDE, at, np.array([0.0, np.pi / 2]), 4.0)[:, 0]
    assert nose == pytest.approx(np.array([[12.0, 5.0], [0.0, -2.0]]), abs=1e-6)  # forward, then up: y points down
    assert ABOVE[0].tolist() == [0.5, 0.0] and np.abs(ABOVE[:, 1].sum()) < 1e-12  # as much right as left


def test_what_two_runs_were_flown_with(tmp_path: Path) -> None:
    for name, seed, gain in (("a", 1, 0.4), ("b", 2, 0.5)):
        run = tmp_path / name
        run.mkdir()
        (run / "scenario.toml").write_text(
            f'[meta]\nseed = {seed}\n[[aircraft]]\nname = "tanker"\nmass = {seed}\n[expect]\nx = {seed}\n'
        )
        (run / "flight_tanker.toml").write_text(f"[nav]\ngain = {gain}\n")
    (tmp_path / "b" / "flight_receiver.toml").write_text("[nav]\ngain = 1.0\n")
    assert differences(tmp_path / "a", tmp_path / "a") == []
    assert differences(tmp_path / "a", tmp_path / "b") == [
        ("plant.aircraft.tanker.mass", 1, 2),
        ("plant.meta.seed", 1, 2),
        ("receiver.nav.gain", None, 1.0),
        ("tanker.nav.gain", 0.4, 0.5),
    ]
    (tmp_path / "b" / "scenario.toml").write_text("[meta\n")
    with pytest.raises(ValueError, match=r"scenario\.toml"):
        differences(tmp_path / "a", tmp_path / "b")


@pytest.mark.parametrize(
    ("bound", "value", "ok"),
    [(1.0, 0.9, True), (1.0, 1.1, False), ([0.5, 2.0], 0.4, False), ({"min": 3}, 4, True), ({"min": 3}, 2, False)]
    + [("completed", "lost", False), (True, True, True), (1.0, None, None), (1.0, float("nan"), None)],
)
def test_bounds(bound: object, value: object, ok: bool | None) -> None:
    assert within(bound, value) is ok


def test_an_index_of_nothing_and_of_damage(tmp_path: Path) -> None:
    assert "Neither a run nor a campaign" in page(tmp_path)[0]
    (tmp_path / "r").mkdir()
    (tmp_path / "r" / "meta.json").write_text('{"scenario": "<b>gust", "seed": 3}')
    (tmp_path / "r" / "summary.json").write_text("{")
    (tmp_path / "r" / "truth.tlog").write_bytes(b"rubbish" * 40)
    (tmp_path / "r" / "a.png").write_bytes(b"no picture")
    text, runs, campaigns = page(tmp_path)
    assert (runs, campaigns) == (1, 0) and "&lt;b&gt;gust" in text and "<b>gust" not in text
    assert find(tmp_path)[0].figures == {}


def test_two_runs_in_one_recording(tmp_path: Path) -> None:
    import runpy

    from ground.rrd.pair import overlay

    synth = runpy.run_path(str(Path(__file__).with_name("ground_synth.py")))["Synth"]
    a, b = (synth(duration_s=12.0, error=(e, 0.0, 0.0)).write(tmp_path / n) for n, e in (("a", 0.1), ("b", 0.4)))
    for run, seed in ((a, 1), (b, 2)):
        (run / "scenario.toml").write_text(f"[meta]\nseed = {seed}\n")
    said = overlay(a, b, tmp_path / "both.rrd")
    assert [line.split() for line in said] == [["a", "|", "b"], ["plant.meta.seed", "1", "|", "2"]]
    reader = RrdReader(str(tmp_path / "both.rrd"))
    paths = set(rows(tmp_path / "both.rrd"))
    assert len(reader.recordings()) == 1 and len(reader.blueprints()) == 1
    own = {p for p in paths if p.startswith(("/truth", "/nav", "/guid", "/timing"))}
    assert len(own) > 60 and {f"/other{p}" for p in own} <= paths
    assert {"/differences", "/difference/receiver/place", "/difference/tanker/wind/d"} <= paths
