"""Integrity of the relative position on the ground, from made-up logs whose answers are known."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image

from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import Sender
from ground.link.live import Monitor
from ground.link.packets import decode
from ground.report.integrity.stanford import counts, limits, stanford
from ground.run import Run, load
from ground.views.refueling.integrity import figures, judge, signals, words

N, NONE = 401, 1e9
AT = (-35.0, 0.5, 8.0)
ERROR = np.linspace(-4.0, 4.0, N)  # [m] along x, a step of 0.02 m


def status(t_us: int = 1_000_000, **over: Any) -> bytes:
    base: dict[str, Any] = {
        "pl": (0.9, NONE, 3.5), "al": (3.0, 3.0, 3.0), "sigma": (0.1, 0.2, 0.3), "pos": AT, "ratio": (0.4, 1.3, 0.0, 0.2),
        "used": 8, "excluded": 2, "undecided": 1,
    }  # fmt: skip
    return Sender(2, 1).named("INTEGRITY_STATUS", time_usec=t_us, **base | over)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """x: error -4..4 m, level 2, limit 3; y: no level; z: no error, level 3.5 over limit 3, at the end no limit."""
    folder = tmp_path_factory.mktemp("integrity")
    truth, tlm = TlogWriter(folder / "truth.tlog"), TlogWriter(folder / "tlm.tlog")
    for k, e in enumerate(ERROR.tolist()):
        t = 200_000 * k
        for j in range(4):
            at = t + 50_000 * j
            truth.write(at, Sender(2, 190).named("TRUTH", time_usec=at, xi=AT, q_nb=(1.0, 0.0, 0.0, 0.0)))
        al = (3.0, 3.0, 3.0 if k < 300 else NONE)
        pos = (AT[0] + e, AT[1], AT[2])
        tlm.write(t, status(t, pl=(2.0, NONE, 3.5), al=al, pos=pos, excluded=2 if k < 100 else 0, undecided=0))
    truth.close()
    tlm.close()
    return load(folder)


def test_figures_of_a_known_log(run: Run) -> None:
    got = figures(run.truth, run.tlm)
    beyond = {limit: int((np.abs(ERROR) > limit + 1e-5).sum()) for limit in (2.0, 3.0)}
    assert beyond == {2.0: 200, 3.0: 100}
    assert got["integrity.samples"] == N
    assert [got[f"integrity.misleading.{a}"] for a in "xyz"] == pytest.approx(
        [200, 0, 0], abs=2
    )  # float32 on the edges
    assert [got[f"integrity.hazardous.{a}"] for a in "xyz"] == pytest.approx([100, 0, 0], abs=2)
    assert [got[f"integrity.available_pct.{a}"] for a in "xyz"] == [100.0, 0.0, 0.0]
    assert [got[f"integrity.pl_m.median.{a}"] for a in "xyz"] == [2.0, None, 3.5]
    assert got["integrity.error_over_pl_max.x"] == pytest.approx(2.0, abs=1e-5)
    assert got["integrity.excluded_pct.gnss"] == pytest.approx(100 * 100 / N) and got["integrity.undecided_pct"] == 0.0
    assert got["integrity.excluded_pct.rel"] == 0.0
    from ground.views.refueling.view import VIEW

    assert VIEW.figures(run).items() >= got.items()


def test_a_run_without_the_message_has_no_figures_and_no_picture(run: Run) -> None:
    assert figures(run.truth, run.truth) == {} and stanford(run.truth, run.truth) is None
    no_truth = figures(run.tlm, run.tlm)
    assert no_truth["integrity.misleading.x"] is None and no_truth["integrity.available_pct.x"] == 100.0


def test_arrays_have_no_number_where_there_is_none(run: Run) -> None:
    found = {s.path.removeprefix("nav/receiver/integrity/"): s for s in signals(run)}
    states = {f"state/{s}" for s in ("rel", "gnss", "boom", "wake")}
    assert set(found) == {"pl", "al", "sigma", "position", "error", "ratio", "turbulence"} | states
    assert np.isnan(found["pl"].values[:, 1]).all() and (found["pl"].values[:, 0] == 2.0).all()
    assert np.isnan(found["al"].values[300:, 2]).all() and (found["al"].values[:300, 2] == 3.0).all()
    assert found["error"].values[:, 0] == pytest.approx(ERROR, abs=1e-5)
    assert found["ratio"].parts == ("rel", "gnss", "boom", "wake")
    last = {k: found[f"state/{k}"].values[-1] for k in found["ratio"].parts}
    assert last == {"rel": "live", "gnss": "live", "boom": "not live", "wake": "in use"}
    assert found["state/gnss"].values[0] == "excluded"


@pytest.mark.parametrize("dark", [False, True])
def test_stanford_plot_counts_its_regions_and_has_both_themes(run: Run, dark: bool) -> None:
    j = judge(run.truth, run.tlm)
    assert j is not None and limits(j, 0) == [3.0]
    x, y, z = (counts(j, i) for i in range(3))
    assert (x["available"], x["unavailable"], x["no level"]) == (N, 0, 0)
    assert x["misleading"] == pytest.approx(200, abs=2) and x["hazardous"] == pytest.approx(100, abs=2)
    assert y["no level"] == N and y["available"] == y["misleading"] == 0
    assert (z["unavailable"], z["available"], z["misleading"]) == (300, 101, 0)
    png = stanford(run.truth, run.tlm, dark=dark)
    assert png is not None
    corner = Image.open(io.BytesIO(png)).convert("RGB").getpixel((2, 2))
    assert isinstance(corner, tuple) and (max(corner) < 60) == dark


def test_monitor_says_level_against_limit_sources_and_tests_by_name() -> None:
    said = {w.label: (w.text, w.bad) for w in words(decode(status()))}
    assert said["PL x"] == ("0.90 of 3.00 m", False)
    assert said["PL y"] == ("none of 3.00 m", True) and said["PL z"] == ("3.50 of 3.00 m", True)
    assert said["sources"] == ("wake position; EXCLUDED GNSS difference; UNDECIDED relative sensor", True)
    assert said["tests"] == ("relative sensor 0.40, GNSS difference 1.30, wake position 0.20", True)
    calm = status(pl=(0.5,) * 3, al=(NONE,) * 3, ratio=(0.4, 0.0, 0.0, 0.0), used=1, excluded=0, undecided=0)
    said = {w.label: (w.text, w.bad) for w in words(decode(calm))}
    assert said["PL x"] == ("0.50 m, no limit", False) and said["sources"] == ("relative sensor", False)
    nothing = status(pl=(NONE,) * 3, al=(NONE,) * 3, ratio=(0.0,) * 4, used=0, excluded=0, undecided=0)
    said = {w.label: (w.text, w.bad) for w in words(decode(nothing))}
    assert said["PL x"] == ("none, no limit", False) and said["sources"] == ("NONE in use", True)
    assert words(None) == []
    monitor = Monitor(lambda: 0.0)
    monitor.take(status())
    [line] = monitor.lines()
    assert "PL z 3.50 of 3.00 m" in line and "EXCLUDED GNSS difference" in line


def test_the_viewer_gets_level_limit_error_tests_and_a_lane_for_each_source(run: Run) -> None:
    from ground.views.refueling.integrity_draw import LINES, ROOT, STATES, draw

    class Sink:
        def __init__(self) -> None:
            self.sent: dict[str, Any] = {}

        def series(self, path: str, t_us: Any, values: Any, *_: Any) -> None:
            self.sent[path] = values

        def states(self, path: str, t_us: Any, names: list[str], colors: Any) -> None:
            assert set(names) <= set(colors) == set(STATES)
            self.sent[path] = names

        def level(self, path: str, values: Any, *_: Any) -> None:
            self.sent[path] = values

    sink = Sink()
    draw(sink, run)  # type: ignore[arg-type]
    sources = ("rel", "gnss", "boom", "wake")
    want = {f"{ROOT}/{k}/{a}" for k in LINES for a in "xyz"} | {
        f"{ROOT}/{k}/{s}" for k in ("ratio", "state") for s in sources
    }
    assert set(sink.sent) == want | {f"{ROOT}/threshold"}
    assert sink.sent[f"{ROOT}/error/x"] == pytest.approx(np.abs(ERROR), abs=1e-5)
