"""Reading a flight log: every way it can be wrong has its own message; the figures of the real one."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from hil_scripts.estimate import columns, command, figure, flightlog, offline
from hil_scripts.estimate.compare import without_probe
from hil_scripts.estimate.kinematic import KinematicParams

REAL = Path(__file__).parents[2] / "data" / "flight_logs" / "ampyx_ap2_20171003_50hz.csv"
Rows = list[list[str]]


@pytest.fixture(autouse=True)
def small_figure(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests read figures, not pictures: few pixels, axes where they fall."""
    whole = figure.plt.figure
    monkeypatch.setattr(figure.plt, "figure", lambda **kw: whole(**(kw | {"dpi": 30, "layout": None})))


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
        (lambda r: cut(r, "airspeed_mps"), "missing column airspeed_mps"),
        (lambda r: [r[0], *(x[:-3] for x in r[1:])], "line 2: 22 cells, the header has 25"),
        (lambda r: spoil(r, "airspeed_mps", lambda x: -x), "line 2: column airspeed_mps = -3.*599 of 599 rows"),
        (lambda r: [r[0], *r[:1:-1]], "does not advance.*597 of 598 rows cannot be used"),
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


@pytest.mark.parametrize(
    ("change", "says", "lines"),
    [
        (lambda r: [*r[:41], r[41][:-3], *r[42:]], "line 42: 22 cells, the header has 25", [41]),
        (
            lambda r: spoil(r, "airspeed_mps", lambda x: math.nan, 7),
            "line 8: column airspeed_mps = nan must be finite",
            [7],
        ),
        (lambda r: spoil(r, "airspeed_mps", lambda x: -x, 7), "line 8: column airspeed_mps = -3", [7]),
        (lambda r: spoil(r, "t_s", lambda x: 1.0, 100), "line 101: column t_s = 1 does not advance from 1", [100]),
        (lambda r: spoil(r, "t_s", lambda x: 9e5, 100), "line 101: column t_s = 900000 does not advance", [100]),
        (lambda r: spoil(r, "q_radps", lambda x: 99.0, 100), "line 101: column q_radps = 99 beyond 12", [100]),
        (lambda r: [*r[:30], *r[30:33], r[32], *r[33:]], "line 34: column t_s = .* does not advance", []),
    ],
)
def test_one_bad_row_is_left_out_and_told(
    tmp_path: Path, rows: Rows, change: Callable[[Rows], Rows], says: str, lines: list[int]
) -> None:
    """The rest is read as if the row had never been there."""
    log = flightlog.read(write(tmp_path / "log.csv", change(rows)))
    rest = flightlog.read(write(tmp_path / "rest.csv", [r for k, r in enumerate(rows) if k not in lines]))
    assert len(log.skipped) == 1 and re.search(says, log.skipped[0])
    assert np.array_equal(log.t, rest.t) and np.array_equal(log.air, rest.air)


def test_text_cell_and_missing_file(tmp_path: Path, rows: Rows) -> None:
    bad = [list(r) for r in rows]
    bad[9][rows[0].index("beta_rad")] = "n/a"
    assert flightlog.read(write(tmp_path / "log.csv", bad)).skipped == (
        "line 10: column beta_rad: 'n/a' is not a number",
    )
    with pytest.raises(flightlog.LogError, match="cannot be read"):
        flightlog.read(tmp_path / "none.csv")


def test_log_without_wind_and_position_is_estimated_too(tmp_path: Path, rows: Rows) -> None:
    """And a second run writes the same bytes."""
    few = rows
    for name in ("wind_n_mps", "pos_e_m"):
        few = cut(few, name)
    path = write(tmp_path / "log.csv", few)
    v = command.estimate(path, tmp_path / "out", 0, Console(quiet=True))
    command.estimate(path, tmp_path / "again", 0, Console(quiet=True))
    assert (tmp_path / "out/summary.json").read_bytes() == (tmp_path / "again/summary.json").read_bytes()
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
    triangle does.
    """
    v = command.estimate(REAL, tmp_path / "a", 0, Console(quiet=True))
    assert json.loads((tmp_path / "a/summary.json").read_text()) == v
    for a in "ned":
        assert v[f"diff.as_read_triangle.{a}.rms"] < 0.15
        assert v[f"diff.estimate_triangle.{a}.inside_3sigma"] > 0.99
    for a in "ne":
        assert v[f"diff.as_read_logged_undelayed.{a}.rms"] < 0.9
        # at the logged wind's lag, and without it, no worse than the raw triangle
        assert v[f"diff.estimate_logged.{a}.rms"] <= v[f"diff.triangle_logged.{a}.rms"] < 0.56
        assert v[f"diff.estimate_logged_undelayed.{a}.rms"] <= v[f"diff.triangle_logged_undelayed.{a}.rms"]
        assert v[f"diff.estimate_logged.{a}.inside_3sigma"] > 0.98
    assert "diff.estimate_logged.d.rms" not in v  # the logged vertical wind is a constant
    assert 0.2 < v["delay.logged_s"] < 0.5
    # 49 s of gusts and turns say less about the probe than was known before
    for name in ("scale", "beta", "alpha"):
        assert 0.1 < v[f"probe.{name}.information_gained"] < 0.5
        assert v[f"probe.{name}.value"] == 0.0 and v[f"probe.{name}.sigma"] == v[f"probe.{name}.prior_sigma"]
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


# --- forms a log may have ------------------------------------------------------------------------------------------
def test_semicolons_and_decimal_commas_are_read_and_said(tmp_path: Path, rows: Rows) -> None:
    plain = flightlog.read(write(tmp_path / "a.csv", rows))
    for mark, point in ((";", ","), (";", "."), ("\t", ".")):
        text = "\n".join(mark.join(c.replace(".", point) for c in r) for r in rows)
        (tmp_path / "b.csv").write_text(text)
        log = flightlog.read(tmp_path / "b.csv")
        assert np.array_equal(log.t, plain.t) and np.array_equal(log.euler, plain.euler)
        assert log.notes == (
            f"{'semicolons' if mark == ';' else 'tabs'} part the columns, a comma in a number is its point",
        )
    text = io.StringIO()
    command.show_faults(Console(file=text, width=200), log)
    assert "note: tabs part the columns" in text.getvalue()


def test_a_heading_that_counts_its_turns_is_the_same_heading(tmp_path: Path, rows: Rows) -> None:
    plain = flightlog.read(write(tmp_path / "a.csv", rows))
    far = flightlog.read(write(tmp_path / "b.csv", spoil(rows, "yaw_rad", lambda x: x - 10.0 * math.pi)))
    p = KinematicParams()
    assert far.euler[0, 0] < -28.0
    assert offline.run(far, p).wind == pytest.approx(offline.run(plain, p).wind, abs=1e-6)


def straight(yaw: float, speed: float = 20.0, n: int = 300) -> Rows:
    """Level flight along a heading of 4.0 rad, which the log calls `yaw`; the airspeed wanders a little."""
    names = [c.name for c in columns.REQUIRED]
    out = [names]
    for k in range(n):
        v = dict.fromkeys(names, 0.0) | {
            "t_s": 0.02 * k,
            "yaw_rad": yaw,
            "airspeed_mps": speed + 0.1 * math.sin(0.3 * k),
        }
        v |= {
            "vel_n_mps": speed * math.cos(4.0),
            "vel_e_mps": speed * math.sin(4.0) + 1e-3 * k,
            "p_radps": 1e-4 * (k % 7),
        }
        v["roll_rad"] = 1e-4 * (k % 5)
        out.append([repr(v[x]) for x in names])
    return out


def test_straight_flight_tells_a_heading_in_degrees_by_its_track(tmp_path: Path) -> None:
    """229 deg is 4.0 rad; 16.566 rad is 4.0 rad after two turns. No turn rate tells them apart, the track does."""
    assert len(flightlog.read(write(tmp_path / "a.csv", straight(4.0 + 4.0 * math.pi)))) == 300
    with pytest.raises(flightlog.LogError, match=r"yaw_rad = 229\.\d+ points away from the track.*looks like degrees"):
        flightlog.read(write(tmp_path / "b.csv", straight(4.0 * DEG)))


def test_a_frozen_stretch_of_airspeed_is_flagged_and_not_used(tmp_path: Path, rows: Rows) -> None:
    """3 s of one reading, the aircraft manoeuvring on: told with its times, and the wind carries no step from it."""
    i = rows[0].index("airspeed_mps")
    stuck = [list(r) for r in rows]
    for k in range(201, 351):
        stuck[k][i] = rows[200][i]
    path = write(tmp_path / "log.csv", stuck)
    log, whole = flightlog.read(path), flightlog.read(write(tmp_path / "whole.csv", rows))
    assert [(f.sensor, f.samples) for f in log.frozen] == [("airspeed", 150)] and whole.frozen == ()
    assert log.frozen[0].start_s == pytest.approx(3.98, abs=0.01) and log.frozen[0].end_s == pytest.approx(
        6.98, abs=0.01
    )
    p = KinematicParams()
    tr = offline.run(log, p)
    true = offline.run(whole, p)
    taken = offline.run(replace(log, stale={}), p)  # as if it were a reading

    def off(t: offline.Track) -> float:
        return float(np.sqrt(np.mean(((t.wind - true.wind)[205:349, :2]) ** 2)))

    assert off(tr) < 0.7 * off(taken)
    assert (np.abs(tr.wind - true.wind)[200:350] < 3.0 * np.hypot(tr.sigma, true.sigma)[200:350]).mean() > 0.99
    assert tr.sigma[349, :2].max() > 1.5 * true.sigma[349, :2].max()
    text = io.StringIO()
    v = command.estimate(path, tmp_path / "out", 0, Console(file=text, width=200))
    assert v["log.frozen.airspeed_s"] == pytest.approx(3.0, abs=0.01)
    assert "airspeed frozen from 3.98 to 6.98 s (150 samples): not used there" in text.getvalue()


def test_a_slow_sensor_is_not_a_frozen_one(tmp_path: Path, rows: Rows) -> None:
    """A reading five times a second stands for ten rows; one that stands for three seconds does not."""
    i = rows[0].index("airspeed_mps")
    slow = [list(r) for r in rows]
    for k in range(1, len(rows)):
        slow[k][i] = rows[1 + (k - 1) // 10 * 10][i]
    assert flightlog.read(write(tmp_path / "a.csv", slow)).frozen == ()
    for k in range(201, 351):
        slow[k][i] = slow[200][i]
    assert [f.sensor for f in flightlog.read(write(tmp_path / "b.csv", slow)).frozen] == ["airspeed"]


@pytest.mark.parametrize("sensor", ["attitude", "velocity"])
def test_other_sensors_that_freeze_are_flagged_too(tmp_path: Path, rows: Rows, sensor: str) -> None:
    names = {"attitude": ("yaw_rad", "pitch_rad", "roll_rad"), "velocity": ("vel_n_mps", "vel_e_mps", "vel_d_mps")}[
        sensor
    ]
    stuck = [list(r) for r in rows]
    for name in names:
        i = rows[0].index(name)
        for k in range(201, 301):
            stuck[k][i] = rows[200][i]
    log = flightlog.read(write(tmp_path / "log.csv", stuck))
    assert [f.sensor for f in log.frozen] == [sensor]
    assert np.isfinite(offline.run(log, KinematicParams()).wind).all()


def test_a_sensor_frozen_most_of_the_time_is_refused(tmp_path: Path, rows: Rows) -> None:
    stuck = spoil(rows, "airspeed_mps", lambda x: 20.0)
    with pytest.raises(flightlog.LogError, match="airspeed is frozen in 598 of 599 rows; allowed: up to half"):
        flightlog.read(write(tmp_path / "log.csv", stuck))


def test_alpha_and_beta_may_be_missing_or_never_move(tmp_path: Path, rows: Rows) -> None:
    """The horizontal wind is then that of an aircraft without sideslip; the sigma says what that is worth."""
    few = cut(cut(rows, "alpha_rad"), "beta_rad")
    log = flightlog.read(write(tmp_path / "a.csv", few))
    still = flightlog.read(
        write(tmp_path / "b.csv", spoil(spoil(rows, "alpha_rad", lambda x: 0.0), "beta_rad", lambda x: 0.0))
    )
    assert log.vanes == still.vanes == (False, False)
    assert still.notes[0] == "beta is 0 in every row: taken as not measured"
    p = offline.params_for(log, KinematicParams())
    tr, full = offline.run(log, p), offline.run(flightlog.read(write(tmp_path / "c.csv", rows)), KinematicParams())
    assert tr.held == (True, True, True)
    assert (tr.sigma[100:].mean(axis=0) > [1.5, 3.0, 3.0] * full.sigma[100:].mean(axis=0)).all()
    assert (np.abs(tr.wind - full.wind)[100:] < 3.0 * tr.sigma[100:]).mean() > 0.95
    text = io.StringIO()
    command.show_faults(Console(file=text, width=200), log)
    assert "no beta in the log: taken as 0 +- 1.7 deg" in text.getvalue()
    one = flightlog.read(write(tmp_path / "d.csv", cut(rows, "alpha_rad")))
    assert one.vanes == (True, False)


def test_a_real_log_without_vanes_is_no_worse_than_the_triangle(tmp_path: Path) -> None:
    """A small aircraft with a pitot tube only. Its own filter is slow: no shift brings its wind closer, so none is taken."""
    v = command.estimate(REAL.parent / "alfa_carbonz_20180718_10hz.csv", tmp_path, 5, Console(quiet=True))
    assert v["delay.found"] == 0.0 and "diff.estimate_logged_undelayed.n.rms" not in v
    for a in "ne":
        assert v[f"diff.estimate_logged.{a}.rms"] == pytest.approx(v[f"diff.triangle_logged.{a}.rms"], rel=0.02)
    assert v["probe.scale.held"] == 1.0 and v["probe.scale.value"] == 0.0
    assert "twin.exact.n" not in v and "residual.estimate.beta.rms" not in v
