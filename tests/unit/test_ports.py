"""Pitot tubes, static port and vanes that are blocked, iced or frozen; errors and failures of the boom's signal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.strict import ConfigError
from flightsw.types import Command
from sim_plant.failures import numbers as inject
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.scenario import load_scenario
from sim_plant.sensors.ports import airspeed, total
from sim_plant.world import World

EXACT = {"noise.scale": 0.0, "noise.bias_scale": 0.0}
EXACT_BUT = {f"sensors.receiver.air.{k}": 0.0 for k in ("V_std_mps", "alpha_std", "beta_std", "alpha_bias_std")}
AT = 0.5  # [s] faults begin
CLIMB = 300.0  # [m] of both aircraft at 1 s


@pytest.mark.parametrize(  # NACA report 1135, table I: M, p/pt, T/Tt
    ("mach", "pressure", "temperature"),
    [(0.3, 0.9395, 0.9823), (0.6, 0.7840, 0.9328), (0.8, 0.6560, 0.8865), (1.0, 0.5283, 0.8333)],
)
def test_total_pressure_and_temperature_are_those_of_the_tables(
    mach: float, pressure: float, temperature: float
) -> None:
    t, p, _, a = isa(7010.0)
    pt, tt = total(mach * a, p, t)
    assert (p / pt, t / tt) == pytest.approx((pressure, temperature), abs=5e-5)
    assert airspeed(pt, p, tt) == pytest.approx(mach * a, rel=1e-12)


def test_slow_air_is_bernoulli_s() -> None:
    t, p, rho, _ = isa(500.0)
    for V in (10.0, 30.0, 60.0):
        assert total(V, p, t)[0] - p == pytest.approx(0.5 * rho * V * V, rel=0.01)
    assert airspeed(p, p, t) == airspeed(0.9 * p, p, t) == 0.0


def fly(
    *events: dict[str, Any], over: dict[str, Any] = EXACT, climb: float = CLIMB, seconds: float = 2.0
) -> dict[str, np.ndarray]:
    """Readings of the receiver at 20 Hz, both aircraft lifted by `climb` at 1 s: V, alpha, beta [k, 3], height [k], boom [k, 3],
    and the true V [k], alpha [k], elevation, azimuth, extension [k, 3]."""
    scripted = [{"t_s": AT, "target": "receiver", **e} for e in events]
    w = World(load_scenario("refueling", {"event": scripted, **over}), 1)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    out: dict[str, list[Any]] = {
        k: [] for k in ("V", "alpha", "beta", "height", "boom", "true_V", "true_alpha", "true_boom")
    }
    for k in range(round(100 * seconds)):
        if k == 100:
            for m in w.members:
                m.s[n.S_P + 2] -= climb
        f, v = w.sense()[1], w.members[1].view
        if k % 5 == 0:
            out["V"].append(f.air_V)
            out["alpha"].append(f.air_alpha)
            out["beta"].append(f.air_beta)
            out["height"].append(f.baro_alt_m)
            out["boom"].append((f.boom_elevation, f.boom_azimuth, f.boom_extension_m))
            out["true_V"].append(v.o[n.O_PROBE : n.O_PROBE + 9 : 3])
            out["true_alpha"].append(v.o[n.O_PROBE + 1 : n.O_PROBE + 9 : 3])
            out["true_boom"].append(v.boom[n.R_EL : n.R_EXT + 1])
        w.step(cmds)
    return {k: np.array(v) for k, v in out.items()}


def test_a_blocked_pitot_rises_in_a_climb_and_its_neighbours_do_not() -> None:
    f = fly({"kind": "blocked", "sensor": "air", "index": 0})
    V = f["V"]
    assert np.allclose(V[:, 1:], f["true_V"][:, 1:], atol=1e-9) and np.allclose(V[:10, 0], f["true_V"][:10, 0])
    h = f["height"]
    before, after = V[19, 0], V[20, 0]
    # (1 + M^2/5)^3.5 ps is what was trapped, whatever ps does
    _, p0, _, a0 = isa(h[10])
    _, p1, _, a1 = isa(h[20])
    m0 = f["true_V"][10, 0] / a0
    m1 = math.sqrt(5.0 * ((p0 * (1.0 + m0 * m0 / 5.0) ** 3.5 / p1) ** (2.0 / 7.0) - 1.0))
    true_m1 = f["true_V"][20, 0] / a1
    tt = 1.0 + true_m1**2 / 5.0  # over the static temperature
    assert after == pytest.approx(m1 * a1 * math.sqrt(tt / (1.0 + m1 * m1 / 5.0)), rel=1e-9)
    # hydrostatics and Bernoulli: V^2 grows by twice g h
    assert after - before == pytest.approx(math.sqrt(before**2 + 2.0 * 9.80665 * CLIMB) - before, rel=0.2)
    assert after - before > 10.0


def test_a_blocked_static_port_holds_the_height_and_takes_from_the_airspeed_in_a_climb() -> None:
    f = fly({"kind": "blocked", "sensor": "baro", "for_s": 1.2})
    h, V = f["height"], f["V"]
    assert np.ptp(h[10:34]) == 0.0 and h[34] - h[33] == pytest.approx(CLIMB, abs=5.0)
    _, ps, _, _ = isa(h[20])
    t, p, _, a = isa(h[20] + CLIMB)
    m = f["true_V"][20] / a
    qc = p * ((1.0 + m * m / 5.0) ** 3.5 - 1.0)
    ind = np.sqrt(5.0 * (((qc + p - ps) / ps + 1.0) ** (2.0 / 7.0) - 1.0))
    want = ind * np.sqrt(1.4 * 287.053 * t * (1.0 + m * m / 5.0) / (1.0 + ind * ind / 5.0))
    assert np.allclose(V[20], want, rtol=2e-4) and (V[20] < f["true_V"][20] - 5.0).all()
    assert np.allclose(V[34:], f["true_V"][34:])


def test_a_port_closed_twice_keeps_what_the_first_has_trapped() -> None:
    """From 0.5 to 1.2 s and from 1.1 s on, the climb at 1 s between: one height, one pressure for the airspeeds."""
    twice = ({"kind": "blocked", "sensor": "baro", "for_s": 0.7}, {"kind": "blocked", "sensor": "baro", "t_s": 1.1})
    f, once = fly(*twice, seconds=1.5), fly({"kind": "blocked", "sensor": "baro"}, seconds=1.5)
    assert np.array_equal(f["height"], once["height"]) and np.array_equal(f["V"], once["V"])


def test_both_blocked_shows_one_airspeed_whatever_the_height() -> None:
    both = ({"kind": "blocked", "sensor": "air"}, {"kind": "blocked", "sensor": "baro"})
    f = fly(*both)
    # pressures stand; the total temperature is the only thing left that changes
    assert np.ptp(f["V"][20:, 0] / np.sqrt(_tt(f)[20:])) / np.mean(f["V"][20:, 0] / np.sqrt(_tt(f)[20:])) < 1e-3
    assert abs(f["V"][20, 0] - f["V"][19, 0]) < 2.0


def _tt(f: dict[str, np.ndarray]) -> np.ndarray:
    h = f["height"] + np.where(np.arange(len(f["height"])) >= 20, CLIMB, 0.0)
    return np.array([isa(x)[0] for x in h]) + f["true_V"][:, 0] ** 2 / (2.0 * 1004.7)


def test_an_iced_pitot_loses_its_share_of_the_impact_pressure() -> None:
    f = fly({"kind": "iced", "sensor": "air", "index": 2, "value": [0.8]}, climb=0.0)
    loss = np.clip(0.8 * (np.arange(40) * 0.05 - AT), 0.0, 1.0)
    t, p, _, a = isa(f["height"][0])
    for k in (9, 12, 20, 33, 39):
        m = f["true_V"][k, 2] / a
        qc = p * ((1.0 + m * m / 5.0) ** 3.5 - 1.0) * (1.0 - loss[k])
        ind2 = 5.0 * ((qc / p + 1.0) ** (2.0 / 7.0) - 1.0)
        want = math.sqrt(ind2 * 1.4 * 287.053 * t * (1.0 + m * m / 5.0) / (1.0 + ind2 / 5.0))
        assert f["V"][k, 2] == pytest.approx(want, rel=1e-4)
    assert f["V"][39, 2] == 0.0 and np.allclose(f["V"][:, :2], f["true_V"][:, :2])


def test_a_frozen_vane_stands_in_its_bearing_and_its_noise_goes_on() -> None:
    """The noise of the converter stays; nothing of the truth leaks through the sensor's scale."""
    alpha = {"white": 1e-3, "scale": 0.5}
    plain, scaled = ({"sensors.receiver.air.terms.alpha": t} | EXACT_BUT for t in ({"white": 1e-3}, alpha))
    event = {"kind": "frozen", "sensor": "air", "index": 1, "channel": "alpha"}
    f, clean, unscaled = fly(event, over=scaled), fly(over=scaled), fly(over=plain)
    assert np.array_equal(f["alpha"][:, (0, 2)], clean["alpha"][:, (0, 2)])
    assert np.array_equal(f["V"], clean["V"]) and np.array_equal(f["beta"], clean["beta"])
    assert len(set(f["alpha"][10:, 1])) == 30 and np.std(f["alpha"][10:, 1]) == pytest.approx(1e-3, rel=0.4)
    factor = np.mean((clean["alpha"] - unscaled["alpha"])[:, 1] / f["true_alpha"][:, 1])
    moved = f["true_alpha"][10:, 1] - f["true_alpha"][10, 1]
    assert abs(factor) > 0.05 and np.ptp(moved) > 1e-3
    assert np.allclose((clean["alpha"] - f["alpha"])[10:, 1], (1.0 + factor) * moved, atol=1e-12)


def test_the_ground_makes_and_ends_the_same_failures() -> None:
    w = World(load_scenario("refueling", dict(EXACT)), 1)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]

    def step(climb: float = 0.0) -> tuple[float, float, float]:
        for m in w.members:
            m.s[n.S_P + 2] -= climb
        for _ in range(5):
            f = w.sense()[1]
            w.step(cmds)
        return (
            f.air_V[0] - w.members[1].view.o[n.O_PROBE],
            f.air_V[1] - w.members[1].view.o[n.O_PROBE + 3],
            f.baro_alt_m,
        )

    def order(*p: float) -> int:
        return w.command(1, Command(420, (*p, *([0.0] * (7 - len(p)))), 255, 190)).verdict.result

    step()
    assert order(inject.UNIT_AIRSPEED, inject.BLOCKED, 1) == 0
    step()
    first, second, height = step(200.0)
    assert first > 5.0 and abs(second) < 1.0
    assert order(inject.UNIT_AIRSPEED, inject.OK) == 0 and order(3, inject.BLOCKED) == 0
    step()
    first, second, still = step(200.0)
    assert first < -5.0 and second < -5.0 and still == pytest.approx(height, abs=20.0)
    assert order(3, inject.OK) == 0
    step()
    first, second, now = step()
    assert abs(first) < 1.0 and abs(second) < 1.0 and now > still + 150.0


def test_the_boom_s_signal_has_errors_by_grade() -> None:
    """White of the table within 99.9 % of chi-square; constant drawn once."""
    paper = fly(seconds=10.0)
    assert np.array_equal(paper["boom"], paper["true_boom"])
    f = fly(over={"sensors.receiver.boom.terms": {"angle": {"white": 1.75e-3, "constant": 3.5e-3}}}, seconds=10.0)
    d = f["boom"] - f["true_boom"]
    assert np.array_equal(d[:, 2], np.zeros(len(d)))
    for c in (0, 1):
        assert 0.84 < np.std(d[:, c]) / 1.75e-3 < 1.17 and 1e-5 < abs(np.mean(d[:, c])) < 0.015
    graded = fly(over={"sensors.receiver.boom.grade": "tactical"}, seconds=1.0)
    assert np.std((graded["boom"] - graded["true_boom"])[5:, 2]) > 0.01


@pytest.mark.parametrize(
    ("event", "shift"),
    [
        ({"kind": "bias", "value": [0.02, 0.0, 0.5]}, (0.02, 0.0, 0.5)),
        ({"kind": "drift", "value": [0.01, 0.0, 0.0]}, (0.01 * 0.5, 0.0, 0.0)),
        ({"kind": "scale", "value": [1.0, 1.0, 1.5]}, (0.0, 0.0, None)),
    ],
    ids=lambda e: e["kind"] if isinstance(e, dict) else "",
)
def test_the_boom_s_signal_fails_column_by_column(event: dict[str, Any], shift: tuple[float | None, ...]) -> None:
    f = fly({"sensor": "boom", **event}, climb=0.0, seconds=1.1)
    d = (f["boom"] - f["true_boom"])[20]
    want = [0.5 * f["true_boom"][20, 2] if x is None else x for x in shift]
    assert d == pytest.approx(want, abs=1e-12) and np.array_equal(f["boom"][:10], f["true_boom"][:10])


@pytest.mark.parametrize(
    ("event", "says"),
    [
        ({"kind": "blocked", "sensor": "gnss"}, "sensor = 'gnss': blocked is of sensor = air or baro"),
        ({"kind": "iced", "sensor": "baro"}, "sensor = 'baro': iced is of sensor = air"),
        ({"kind": "iced", "sensor": "air", "value": [0.0]}, "an iced event takes one rate above 0"),
        ({"kind": "blocked", "sensor": "air", "channel": "V"}, "a blocked event has none"),
        ({"kind": "blocked", "sensor": "baro", "index": 1}, "only sensor = 'air' has probes"),
    ],
)
def test_what_no_tube_or_port_can_do_is_refused_by_name(event: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        fly(event)
