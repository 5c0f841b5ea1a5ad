"""Grades of sensors: each term against its closed form, seeds, refusals. References: IEEE 952 (Allan variance of the terms),
scipy's chi-square quantiles."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from flightsw.strict import ConfigError
from hil_scripts.launch.allan import curve, deviation, theory
from sim_plant.kernels.layout import O_PROBE, S_FUEL, S_P
from sim_plant.rng import BLOCK
from sim_plant.scenario import load_scenario
from sim_plant.sensors.base import View
from sim_plant.sensors.errors import Errors, lag_of
from sim_plant.sensors.terms import FAMILIES, GRADES, PAPER, Terms, group_terms, source_of
from sim_plant.world import World

T = 0.01


def errors(
    group: str, over: dict[str, Any], seed: int = 1, period: float = T, name: str = "a", probes: int = 0
) -> Errors:
    terms = group_terms(group, PAPER, over, "terms")
    assert terms is not None
    return Errors(seed, name, group, terms, period, probes, 1.0, 1.0)


def series(err: Errors, m: int) -> np.ndarray:
    """m rows [m, columns] of a sensor at rest, by the blocks it draws itself."""
    view = View(0)
    return np.array([err.add([], round(k * err.period_s * 1e6), view) for k in range(m)])


@pytest.mark.parametrize("grade", GRADES[1:])
@pytest.mark.parametrize("family", ["gyro", "acc"])
def test_allan_curve_of_every_grade_lies_on_the_closed_form_of_its_terms(grade: str, family: str) -> None:
    """Points of the curve, three axes, inside the 99.9 % interval of their chi-square (Bonferroni over the points)."""
    taus, got, dof = curve(grade, family, seed=2, hours=1.0)
    terms = group_terms("imu", grade, {}, "")
    assert terms is not None
    want = theory(terms.columns[family], taus)
    p = 0.001 / (2 * got.size)
    lo, hi = np.sqrt(chi2.ppf(p, dof) / dof), np.sqrt(chi2.ppf(1 - p, dof) / dof)
    ratio = got / want[:, None]
    assert np.all(ratio > lo[:, None]) and np.all(ratio < hi[:, None]), ratio
    assert want.max() / want.min() > 3.0  # not a flat line


def test_allan_deviation_of_white_and_walk_is_the_textbooks() -> None:
    rng = np.random.default_rng(4)
    w = rng.standard_normal(200_000)
    m = np.array([1, 10, 100])
    assert np.allclose(deviation(w, m), 1.0 / np.sqrt(m), rtol=0.05)  # sigma / sqrt(m)
    assert np.allclose(deviation(np.cumsum(w), m), np.sqrt((2.0 * m * m + 1.0) / (6.0 * m)), rtol=0.15)


def test_gauss_markov_part_is_stationary_with_the_set_autocovariance() -> None:
    runs, lag = 1500, 40
    x = np.array([series(errors("baro", {"alt": {"gm": 2.0, "tau_s": 0.5}}, s), lag + 1)[:, 0] for s in range(runs)])
    for k in (0, lag):  # from the first sample on
        v = np.sum(x[:, k] ** 2) / 4.0
        assert chi2.ppf(0.0005, runs) < v < chi2.ppf(0.9995, runs)
    rho = math.exp(-lag * T / 0.5)
    r = float(np.mean(x[:, 0] * x[:, lag])) / 4.0
    assert abs(r - rho) < 3.3 * math.sqrt((1 + rho * rho) / runs)


def test_walk_and_constant_have_the_set_spread() -> None:
    runs, m = 400, 100
    over = {"gyro": {"walk": 0.3}, "acc": {"constant": 0.7}}
    x = np.array([series(errors("imu", over, s), m) for s in range(runs)])
    n = 3 * runs
    v = np.sum(x[:, -1, :3] ** 2) / (0.09 * m * T)
    assert chi2.ppf(0.0005, n) < v < chi2.ppf(0.9995, n)
    assert np.array_equal(x[:, 0, 3:], x[:, -1, 3:])
    assert chi2.ppf(0.0005, n) < np.sum(x[:, 0, 3:] ** 2) / 0.49 < chi2.ppf(0.9995, n)


def test_walk_goes_on_over_the_border_of_a_block() -> None:
    x = series(errors("baro", {"alt": {"walk": 1.0}}), BLOCK + 2)[:, 0]
    assert np.max(np.abs(np.diff(x))) < 6.0 * math.sqrt(T)


def test_lag_answers_a_step_and_a_ramp_in_closed_form() -> None:
    err, view, tau = errors("fuel", {"mass": {"lag_s": 0.3}}), View(0), 0.3
    ramp = []
    for k in range(200):
        view.s[S_FUEL] = 1000.0 + 5.0 * k * T
        ramp.append(view.s[S_FUEL] + err.add([], 0, view)[0])
    t = np.arange(200) * T
    assert np.allclose(ramp, 1000.0 + 5.0 * (t - tau * (1.0 - np.exp(-t / tau))), atol=1e-9)
    view.s[S_FUEL] += 10.0
    first = view.s[S_FUEL] + err.add([], 0, view)[0]
    after = [view.s[S_FUEL] + err.add([], 0, view)[0] for _ in range(300)]
    gap = (view.s[S_FUEL] - np.array(after)) / (view.s[S_FUEL] - first)
    assert np.allclose(gap, np.exp(-(np.arange(300) + 1) * T / tau), atol=1e-6)
    assert lag_of(0.0, T) == (0.0, 1.0, 0.0)


def test_quantisation_error_is_uniform_and_readings_are_multiples() -> None:
    err, view, q = errors("fuel", {"mass": {"quantum": 0.25}}), View(0), 0.25
    rng, e = np.random.default_rng(1), []
    for x in rng.uniform(100.0, 200.0, 3000):
        view.s[S_FUEL] = x
        e.append(err.add([], 0, view)[0])
        assert (x + e[-1]) / q == pytest.approx(round((x + e[-1]) / q), abs=1e-9)
    assert kstest(np.array(e) / q + 0.5, "uniform").pvalue > 1e-3


def test_misalignment_turns_and_keeps_the_length_to_first_order() -> None:
    err, view = errors("rel", {"pos": {"align": 1e-3}, "vel": {"align": 1e-3}}), View(0)
    view.rel[0:6] = [-30.0, 4.0, 9.0, 1.0, 2.0, 3.0]
    e = np.array(err.add([], 0, view))
    r, v = np.array(view.rel[0:3]), np.array(view.rel[3:6])
    assert np.linalg.norm(e[:3]) > 1e-3 and abs(e[:3] @ r) < 1e-9 and abs(e[3:] @ v) < 1e-9
    a = np.linalg.lstsq(np.vstack([_skew(r), _skew(v)]), e, rcond=None)
    assert np.allclose(np.vstack([_skew(r), _skew(v)]) @ a[0], e, atol=1e-12)  # one mounting for both


def _skew(r: np.ndarray) -> np.ndarray:
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def test_lever_arms_against_a_turn_in_closed_form() -> None:
    """Steady turn about z at the origin: centripetal specific force -w^2 r; antenna at C r, moving with w x r."""
    for group in ("imu", "gnss"):
        err, view = errors(group, {"lever_m": 2.0}), View(0)
        view.s[0:7] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.4]
        e, r = np.array(err.add([], 0, view)), err.lever[:3]
        e = np.array(err.add([], 0, view))
        turn = np.array([-0.4 * r[1], 0.4 * r[0], 0.0])
        want = [*r, *turn] if group == "gnss" else [0, 0, 0, -0.16 * r[0], -0.16 * r[1], 0.0]
        assert np.allclose(e, want, atol=1e-12)


def test_common_part_of_satellite_errors_cancels_between_aircraft_and_leaves_the_gradient() -> None:
    over = {f: {"common": 3.0, "common_tau_s": 60.0, "gradient": 1e-4} for f in ("pos_h", "pos_v")}
    near, far = [], []
    for s in range(150):
        a, b = errors("gnss", over, s, 0.1, "tanker"), errors("gnss", over, s, 0.05, "receiver")
        here, there = View(0), View(0)
        there.s[10] = 5000.0
        x, y = np.array(a.add([], 1_500_000, here)[:3]), np.array(b.add([], 1_500_000, here)[:3])
        near.append(x - y)
        far.append(np.array(b.add([], 1_500_000, there)[:3]) - x)
        assert np.any(np.abs(x) > 1e-3)
    assert np.max(np.abs(near)) < 1e-9
    # halfway between drawn values the variance of the linear interpolation is (1 + rho) / 2
    v = np.sum(np.square(far)) / (0.25 * 0.5 * (1.0 + math.exp(-1.0 / 60.0)))
    assert chi2.ppf(0.0005, 450) < v < chi2.ppf(0.9995, 450)


def test_a_rubbing_vane_runs_round_the_loop_of_play() -> None:
    """Of a direction of amplitude A a bearing that gives way at d leaves A - d, a loop of area 4 d (A - d) (a parallelogram),
    and nothing if A < d; d falls with the square of the airspeed."""
    f, rho, amp = 3.0, 1.225, 0.05  # isa at sea level
    x = amp * np.sin(np.linspace(0.0, 6.0 * math.pi, 6001))
    for V in (20.0, 40.0):
        d = f / (0.5 * rho * V * V)
        err, view = errors("air", {"alpha": {"friction": f}}, probes=2), View(2)
        out = []
        for a in x:
            for probe in (0, 1):
                view.o[O_PROBE + 3 * probe : O_PROBE + 3 * probe + 3] = [V, float(a), float(a)]
            e = err.add([], 0, view)
            assert e[1] == e[4] and e[0] == e[2] == e[3] == e[5] == 0.0
            out.append(a + e[1])
        z = np.array(out)[-2001:]  # one turn, the first ones forgotten
        assert abs(z.max() - (amp - d)) < 1e-6 and abs(z.min() + amp - d) < 1e-6
        area = abs(np.trapezoid(z, x[-2001:]))
        assert area == pytest.approx(4.0 * d * (amp - d), rel=1e-3)
    err, view = errors("air", {"alpha": {"friction": 0.5 * rho * 400.0 * 2.0 * amp}}, probes=1), View(1)
    view.o[O_PROBE : O_PROBE + 3] = [20.0, 0.0, 0.0]
    still = []
    for a in x[:2000]:
        view.o[O_PROBE + 1] = float(a)
        still.append(a + err.add([], 0, view)[1])
    assert np.max(np.abs(still)) < 1e-12


def test_weather_is_alike_for_every_barometer_and_no_satellite_s() -> None:
    over = {"alt": {"common": 15.0, "common_tau_s": 600.0, "gradient": 2e-4}}
    here, there = View(0), View(0)
    there.s[S_P + 1] = 30_000.0
    slope, level = [], []
    for s in range(200):
        a, b = errors("baro", over, s, 0.05, "tanker"), errors("baro", over, s, 0.1, "receiver")
        x = a.add([], 0, here)[0]
        assert b.add([], 0, here)[0] == x
        level.append(x)
        slope.append(b.add([], 0, there)[0] - x)
    for v in (np.square(level).sum() / 225.0, np.square(slope).sum() / 36.0):
        assert chi2.ppf(0.0005, 200) < v < chi2.ppf(0.9995, 200)
    same = {"common": 15.0, "common_tau_s": 600.0}
    sky = errors("gnss", {"pos_h": same}, 3).add([], 0, here)[0]
    assert abs(sky - errors("baro", {"alt": same}, 3).add([], 0, here)[0]) > 1e-6


def test_scale_is_a_share_of_the_reading_drawn_once_per_run() -> None:
    share, view = [], View(0)
    for s in range(400):
        err = errors("fuel", {"mass": {"scale": 0.02}}, s)
        for view.s[S_FUEL] in (500.0, 2000.0):
            share.append(err.add([], 0, view)[0] / view.s[S_FUEL])
    x = np.array(share).reshape(400, 2)
    assert np.allclose(x[:, 0], x[:, 1], atol=1e-12)
    assert chi2.ppf(0.0005, 400) < np.sum(x[:, 0] ** 2) / 0.0004 < chi2.ppf(0.9995, 400)


@pytest.mark.parametrize(
    ("xi", "factor"), [([-30.0, 0.0, 10.0], 1.3675), ([-30.0, 0.0, -10.0], 1.0), ([-80.0, 0.0, 20.0], 1.0)]
)
def test_an_aircraft_above_takes_from_the_sky_by_its_nearness(xi: list[float], factor: float) -> None:
    """Own errors grow linearly to `blocked` = 2 where it is; beside it, above it and beyond 50 m they do not."""
    err, view = errors("gnss", {"blocked": 2.0, "pos_h": {"white": 1.0}}), View(0)
    view.rel[0:3] = xi
    x = np.array([err.add([], 0, view)[:2] for _ in range(2000)])
    assert chi2.ppf(0.0005, 4000) < np.sum(x**2) / factor**2 < chi2.ppf(0.9995, 4000)


def test_outages_take_the_set_share() -> None:
    err = errors("gnss", {"outage_per_h": 360.0, "outage_s": 2.0}, period=0.1)
    lost = np.mean([err.lost() for _ in range(60_000)])
    assert 0.16 < lost < 0.24


def world(over: dict[str, Any]) -> list[Any]:
    """Frames' readings of 0.4 s: receiver's gyro and relative position, tanker's gyro; updates of the receiver."""
    w = World(load_scenario("refueling", over), 3)
    cmds, out = [w.trim_cmd(0), w.trim_cmd(1)], []
    for _ in range(40):
        f = w.sense()
        out.append((f[1].gyro_b, f[1].rel_pos_t, f[0].gyro_b, f[1].updated, f[1].gnss_t_us, f[1].t_us, f[1].acc_b))
        w.step(cmds)
    return out


def test_one_sensor_s_grade_moves_nobody_else_s_draws_and_latency_is_exact() -> None:
    paper = world({})
    assert world({"sensors.receiver.grade": "paper", "sensors.receiver.imu.grade": "paper"}) == paper
    imu = world({"sensors.receiver.imu.grade": "mems"})
    assert [x[1:3] for x in imu] == [x[1:3] for x in paper] and all(
        a[0] != b[0] for a, b in zip(imu[2:], paper[2:], strict=True)
    )
    every = world({"sensors.receiver.grade": "mems"})
    assert [x[0] for x in every] == [x[0] for x in imu] and [x[2] for x in every] == [x[2] for x in paper]
    late = world({"sensors.receiver.gnss.terms.latency_ms": 70})
    assert _ages(late) == {70_000}
    one = world({"sensors.receiver.imu.terms.acc.constant": 0.5})
    d = np.array([np.subtract(a[6], b[6]) for a, b in zip(one, paper, strict=True)])
    assert np.allclose(d, d[0], atol=1e-12) and np.min(np.abs(d[0])) > 1e-3


def _ages(rows: list[Any]) -> set[int]:
    """Age [us] of each satellite position at the tick that first shows it."""
    return {b[5] - b[4] for a, b in pairwise(rows) if b[4] != a[4]}


@pytest.mark.parametrize(
    ("over", "says"),
    [
        ({"sensors.receiver.grade": "best"}, "allowed: paper, navigation, tactical, mems"),
        ({"sensors.receiver.imu.grade": "tacticl"}, "did you mean 'tactical'"),
        ({"sensors.receiver.imu.terms.gyro.bias": 1}, "terms.gyro.bias: unknown term; allowed: white"),
        ({"sensors.receiver.imu.terms.gyros.gm": 1}, "terms.gyros: unknown; allowed: gyro, acc"),
        ({"sensors.receiver.baro.terms.lever_m": 1}, "terms.lever_m: unknown"),
        ({"sensors.receiver.imu.terms.gyro.gm": -1}, "allowed 0 to inf"),
        ({"sensors.receiver.air.terms.V.friction": 1}, "terms.V.friction: unknown term"),
        ({"sensors.receiver.grade": "mems", "noise.tau_s": 1.0}, "noise.tau_s"),
    ],
)
def test_what_is_unknown_is_refused_by_name(over: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says.replace("(", "\\(")):
        load_scenario("refueling", over)


def test_every_grade_sets_every_sensor_and_says_where_from() -> None:
    for grade in GRADES[1:]:
        for group, fams in FAMILIES.items():
            g = group_terms(group, grade, {}, "")
            assert g is not None and len(source_of(grade, group)) > 20
            assert all(g.columns[f] != Terms() for f in fams)


def test_grades_are_ordered() -> None:
    """No term of a better grade is worse."""
    for group, fams in FAMILIES.items():
        rows = [group_terms(group, grade, {}, "") for grade in GRADES[1:]]
        for f in fams:
            for term in ("white", "density", "gm", "constant", "scale", "common", "quantum", "friction"):
                x = [getattr(r.columns[f], term) for r in rows if r is not None]
                assert x == sorted(x), (group, f, term, x)
