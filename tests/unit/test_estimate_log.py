"""Reading a flight log: every way it can be wrong has its own message; the figures of the real one."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from flightsw.nav.kinematic import KinematicParams
from hil_scripts.estimate import command, flightlog, offline
from hil_scripts.estimate.compare import without_probe

REAL = Path(__file__).parents[2] / "data" / "flight_logs" / "ampyx_ap2_20171003_50hz.csv"
Rows = list[list[str]]


@pytest.fixture(scope="module")
def rows() -> Rows:
    with REAL.open(newline="") as f:
        return list(csv.reader(f))[:600]


def write(path: Path, rows: Rows) -> Path:
    with path.open("w", newline="") as f:
        csv.writer(f).writerows(rows)
    return path


def spoil(rows: Rows, name: str, change: Callable[[float], float], only: int | None = None) -> Rows:
    i = rows[0].index(name)
    out = [list(r) for r in rows]
    for k in range(1, len(out)):
        if only is None or k == only:
            out[k][i] = repr(change(float(out[k][i])))
    return out


def cut(rows: Rows, name: str) -> Rows:
    i = rows[0].index(name)
    return [r[:i] + r[i + 1 :] for r in rows]


DEG = 57.29578


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda r: cut(r, "alpha_rad"), "missing column alpha_rad"),
        (lambda r: [[*r[0]], *r[1:40], [*r[40][:-1], ""], r[41][:-3], *r[42:]], "line 42: 22 cells, the header has 25"),
        (
            lambda r: spoil(r, "airspeed_mps", lambda x: float("nan"), 7),
            "line 8: column airspeed_mps = nan must be finite",
        ),
        (lambda r: spoil(r, "airspeed_mps", lambda x: -x, 7), "line 8: column airspeed_mps = -3"),
        (lambda r: spoil(r, "t_s", lambda x: 1.0, 100), "line 101: column t_s = 1 does not advance|line 102"),
        (lambda r: spoil(r, "t_s", lambda x: 1e3 * x), "median step 20"),
        (lambda r: spoil(r, "roll_rad", lambda x: x * DEG), "column roll_rad = .* looks like degrees"),
        (lambda r: spoil(r, "r_radps", lambda x: x * DEG), "column r_radps = .* looks like deg/s"),
        (lambda r: spoil(r, "airspeed_mps", lambda x: 100 * x), "column airspeed_mps = .* looks like cm/s"),
        (lambda r: spoil(r, "r_radps", lambda x: -x), "check units, signs and axes"),
        (lambda r: spoil(r, "vel_n_mps", lambda x: 3.6 * x), "d\\(pos_n_m\\)/dt is 0.2.* check units"),
        (lambda r: r[:50], "49 samples; at least 100"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, rows: Rows, change: Callable[[Rows], Rows], says: str) -> None:
    with pytest.raises(flightlog.LogError, match=says):
        flightlog.read(write(tmp_path / "log.csv", change(rows)))


def test_text_cell_and_missing_file(tmp_path: Path, rows: Rows) -> None:
    bad = [list(r) for r in rows]
    bad[9][rows[0].index("beta_rad")] = "n/a"
    with pytest.raises(flightlog.LogError, match="line 10: column beta_rad: 'n/a' is not a number"):
        flightlog.read(write(tmp_path / "log.csv", bad))
    with pytest.raises(flightlog.LogError, match="cannot be read"):
        flightlog.read(tmp_path / "none.csv")


def test_log_without_wind_and_position_is_estimated_too(tmp_path: Path, rows: Rows) -> None:
    few = rows
    for name in ("wind_n_mps", "pos_e_m"):
        few = cut(few, name)
    path = write(tmp_path / "log.csv", few)
    v = command.estimate(path, tmp_path / "out", 0, Console(quiet=True))
    assert "diff.estimate_logged.n.rms" not in v
    assert v["estimate.valid_share"] == 1.0
    assert (tmp_path / "out" / "wind.png").stat().st_size > 20_000


def test_triangle_of_the_real_log_is_what_others_computed() -> None:
    """Mean and standard deviation of the wind triangle as noted when the log was collected, by other code."""
    tri = offline.triangle(flightlog.read(REAL))
    assert tri.mean(axis=0) == pytest.approx([-2.92, 12.70, -0.60], abs=0.01)
    assert tri.std(axis=0) == pytest.approx([1.51, 1.87, 1.17], abs=0.01)


def test_real_log_against_triangle_and_logged_wind(tmp_path: Path) -> None:
    """The probe taken as read, the estimate is the triangle with its noise taken out, and agrees with the logged wind as the
    triangle does; a second run writes the same bytes.
    """
    v = command.estimate(REAL, tmp_path / "a", 0, Console(quiet=True))
    command.estimate(REAL, tmp_path / "b", 0, Console(quiet=True))
    assert (tmp_path / "a/summary.json").read_bytes() == (tmp_path / "b/summary.json").read_bytes()
    assert json.loads((tmp_path / "a/summary.json").read_text()) == v
    for a in "ned":
        assert v[f"diff.as_read_triangle.{a}.rms"] < 0.15
        assert v[f"diff.estimate_triangle.{a}.inside_3sigma"] > 0.99
    for a in "ne":
        assert v[f"diff.as_read_logged.{a}.rms"] < 0.9
        assert v[f"delay.{a}.rms"] < 0.65
    assert "diff.estimate_logged.d.rms" not in v  # the logged vertical wind is a constant
    assert 0.2 < v["delay.logged_s"] < 0.5
    assert 2.5 < v["nis.air.mean"] < 3.6


def test_look_ahead_is_impossible() -> None:
    """The estimate up to a sample does not depend on what comes after it."""
    log = flightlog.read(REAL)
    p = without_probe(KinematicParams())
    whole = offline.run(log, p).wind[:500]
    nav_only = offline.run(
        flightlog.FlightLog("cut", *(x[:500] for x in (log.t, log.euler, log.w_b, log.vel_n, log.air)), None, None), p
    ).wind
    assert np.array_equal(whole, nav_only)
