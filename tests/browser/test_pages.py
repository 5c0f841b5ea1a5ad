"""Pages in a real browser: the index of runs, and a run watched as it flies. Skipped by name where there is no Chromium."""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image

from ground.rrd.chromium import Chromium, count, missing, pixels
from ground.rrd.palette import NAV

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())
Synth = runpy.run_path(str(Path(__file__).parents[1] / "unit" / "ground_synth.py"))["Synth"]
AGAIN_S = 60.0  # [s] after which it is loaded again: a starved browser may have given up a connection
LOAD_S = 240.0  # [s] longest wait for a page drawn in software on a busy machine


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two runs and a campaign."""
    folder = tmp_path_factory.mktemp("runs")
    for name, seed, error in (("a", 1, 0.31), ("b", 2, 0.12)):
        run = Synth(duration_s=20.0, seed=seed).write(folder / name)
        (run / "scenario.toml").write_text('[expect]\n"contact.error_m" = 0.2\n')
        (run / "meta.json").write_text(
            json.dumps({"scenario": "refueling", "seed": seed, "started": f"2026-01-0{seed}"})
        )
        (run / "summary.json").write_text(
            json.dumps({"run.outcome": "completed", "contact.error_m": error, "loop.slips": 0})
        )
    Image.new("RGB", (64, 36), (10, 20, 200)).save(folder / "a" / "picture.png")
    campaign = folder / "study-7"
    campaign.mkdir()
    (campaign / "meta.json").write_text(json.dumps({"study": "study", "master_seed": 7, "cases": [], "identity": ""}))
    (campaign / "summary.json").write_text(json.dumps({"rows": 12}))
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Chromium]:
    """One window for all."""
    with Chromium((1100, 700)) as window:
        yield window


def test_the_index_sorts_filters_and_needs_no_other_file(runs: Path, browser: Chromium) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "ground", "index", str(runs)], capture_output=True, text=True, check=True
    )
    assert "2 runs, 1 campaigns" in done.stdout
    assert "http" not in (runs / "index.html").read_text().replace("http-equiv", "")
    browser.open((runs / "index.html").as_uri())
    order = "return [...document.querySelectorAll('tbody')[0].rows].map(r=>r.cells[0].querySelector('a').textContent)"
    head = (
        "const t=[...document.querySelectorAll('th')].find(t=>t.textContent==='contact.error_m'); t.click(); return !!t"
    )
    assert browser.run(order) == ["b", "a"]  # newest first
    assert browser.run(head) and browser.run(order) == ["a", "b"]  # largest first
    assert browser.run(head) and browser.run(order) == ["b", "a"]
    assert browser.run("return [...document.querySelectorAll('td.bad')].map(c=>c.dataset.value)") == ["0.31"]
    assert browser.run("return [...document.images].map(i=>i.naturalWidth>0)") == [True]
    assert browser.run("return document.querySelectorAll('svg polyline').length") == 4  # two aircraft each
    visible = "return [...document.querySelectorAll('tbody tr')].filter(r=>!r.hidden).length"
    filtered = "const b=document.getElementById('filter'); b.value=arguments[0]; b.dispatchEvent(new Event('input'));"
    browser.run(filtered, "study-7")
    assert browser.run(visible) == 1
    browser.run(filtered, "")
    assert browser.run(visible) == 3
    links = "return [...document.querySelectorAll('td a')].map(a=>a.href)"
    assert all(Path(href.removeprefix("file://")).exists() for href in browser.run(links))


def drawn(browser: Chromium, page: str, end: float) -> int:
    """Pixels of the estimate's colour on the page, opened anew; 84 of them are the viewer's own, while it loads."""
    browser.open(page)
    while (seen := count(pixels(browser.picture()), NAV)) < 150 and time.monotonic() < end:
        time.sleep(1.0)
    return seen


@pytest.mark.slow
def test_a_run_is_seen_in_the_browser(runs: Path, browser: Chromium) -> None:
    command = [
        sys.executable,
        "-m",
        "ground",
        "live",
        "--web",
        "--run",
        str(runs / "a"),
        "--web-port",
        "0",
        "--viewer-port",
        "0",
    ]
    live = subprocess.Popen(
        [*command, "--rate", "2"], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    )
    try:
        assert live.stdout is not None
        page = json.loads(live.stdout.readline())["page"]
        assert page.startswith("http://127.0.0.1:")
        end = time.monotonic() + LOAD_S
        while (seen := drawn(browser, page, min(end, time.monotonic() + AGAIN_S))) < 150 and time.monotonic() < end:
            pass
        assert seen >= 150
    finally:
        live.terminate()
        assert live.wait(30.0) == 130
