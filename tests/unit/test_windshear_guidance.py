"""Hazard alerting, escape laws and inverse dynamics against closed forms, a root finder and their own limits."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from flightsw.aircraft import twinjet
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import inversion as kn
from flightsw.missions.windshear.control import NidParams, WindshearControl
from flightsw.missions.windshear.guidance import (
    ApproachParams,
    EscapeParams,
    WindshearGuidance,
    WindshearGuidanceParams,
    with_law,
)
from flightsw.missions.windshear.hazard import Hazard, HazardParams
from flightsw.missions.windshear.model import PathDemand, parameter_vector

P = parameter_vector(twinjet())
G = NidParams().vector()
DT = 0.02
X0 = np.array([-3000.0, 200.0, 76.0, -0.05, 0.07, 0.0, 30.0, -2.0, 0.5, 0.3, -0.2, 0.0, 0.0, 1.0, 1.0])


def lift_residual(a: float, x: np.ndarray, turn: float) -> float:
    lift, _ = k.lift_drag(x[k.VA], a, 0.0, x[k.KL], 1.0, P)
    need = P[k.P_M] * (x[k.VA] * turn + (P[k.P_G] + x[k.WHD]) * math.cos(x[k.GA]) - x[k.WXD] * math.sin(x[k.GA]))
    return 1e3 * x[k.T] * math.sin(a) + lift - need


@given(
    st.floats(55.0, 90.0), st.floats(-0.1, 0.1), st.floats(6.0, 90.0), st.floats(-2.0, 2.0), st.floats(-0.05, 0.05),
    st.floats(0.9, 1.1),
)  # fmt: skip
def test_incidence_is_the_root_of_the_lift_equation(
    V: float, gamma: float, T: float, wd: float, turn: float, scale: float
) -> None:
    x = X0.copy()
    x[k.VA], x[k.GA], x[k.T], x[k.WXD], x[k.WHD], x[k.KL] = V, gamma, T, wd, -wd, scale
    a = kn.incidence_for(turn, x, 0.0, -0.08, 0.2, P)
    lo, hi = lift_residual(-0.08, x, turn), lift_residual(0.2, x, turn)
    if lo >= 0.0:
        assert a == -0.08
    elif hi <= 0.0:
        assert a == 0.2
    else:
        assert a == pytest.approx(brentq(lift_residual, -0.08, 0.2, (x, turn), xtol=1e-13), abs=1e-8)


def test_thrust_of_the_present_and_not_of_the_command_lifts() -> None:
    """With the commanded thrust in the lift equation the two-second lag would come back as a path error."""
    d = np.array([float(kn.APPROACH), 4.0, 83.0, 0.0, 0.2])
    out = np.zeros(kn.NO)
    kn.invert(X0, d, 0.0, P, G, out)
    assert out[kn.O_TC] > X0[k.T] + 5.0
    turn = min(max(0.8 * (math.asin((4.0 - X0[k.WH]) / X0[k.VA]) - X0[k.GA]), -0.05), 0.05)
    assert lift_residual(out[kn.O_ALPHA], X0, turn) == pytest.approx(0.0, abs=1.0)


def test_inverse_gives_back_the_rates_it_was_asked_for() -> None:
    x = X0.copy()
    d = np.array([float(kn.APPROACH), -4.0, 76.5, 0.0, 0.2])
    out = np.zeros(kn.NO)
    kn.invert(x, d, 0.01, P, G, out)
    _, turn = k.path_rates(x, 1.0, 1.0, 0.01, P)
    q_c = 2.5 * (out[kn.O_ALPHA] - x[k.AL]) + turn
    got = k.pitch_acceleration(x[k.VA], x[k.AL], x[k.Q], out[kn.O_DE], P)
    assert got == pytest.approx(6.0 * (q_c - x[k.Q]), rel=1e-9)
    x[k.T], x[k.AL] = out[kn.O_TD], out[kn.O_ALPHA]  # with thrust and incidence asked for the speed changes as asked
    speed, _ = k.path_rates(x, 1.0, 1.0, 0.01, P)
    assert speed == pytest.approx(0.2 * (76.5 - x[k.VA]), abs=1e-9)


@given(st.integers(0, 3), st.floats(-30.0, 30.0), st.floats(40.0, 110.0), st.floats(-0.3, 0.6), st.floats(-0.3, 0.3))
def test_commands_stay_in_their_limits(mode: int, climb: float, V: float, pitch: float, q: float) -> None:
    x = X0.copy()
    x[k.VA], x[k.Q] = V, q
    out = np.zeros(kn.NO)
    kn.invert(x, np.array([float(mode), climb, 75.0, pitch, 0.2]), 0.01, P, G, out)
    top = k.thrust_limit(V, P)
    assert 0.06 * top - 1e-9 <= out[kn.O_TC] <= top + 1e-9
    assert abs(out[kn.O_DE]) <= 0.35
    if mode != kn.OPEN:
        assert -0.08 <= out[kn.O_ALPHA] <= 0.2


def test_control_holds_what_it_has_when_the_state_is_unusable() -> None:
    c = WindshearControl()
    c.reset(30.0, 0.02)
    x = X0.copy()
    x[k.GA] = np.nan
    assert c.step(x, PathDemand()).tolist() == [30.0, 0.02]
    x = X0.copy()
    x[k.VA] = 5.0
    assert c.step(x, PathDemand()).tolist() == [30.0, 0.02]
    assert c.step(X0, PathDemand("open")).tolist() == [pytest.approx(k.thrust_limit(76.0, P)), 0.02]


def test_low_passes_answer_a_step_as_first_order_lags() -> None:
    h = Hazard(HazardParams(settle_s=0.0))
    n = 150
    for _ in range(n):
        s = h.step(0.3, DT)
    assert s.quick == pytest.approx(0.3 * (1.0 - math.exp(-n * DT / 1.5)), rel=1e-9)
    assert s.slow == pytest.approx(0.3 * (1.0 - math.exp(-n * DT / 4.0)), rel=1e-9)
    first = {}
    h = Hazard(HazardParams(settle_s=0.0))
    for i in range(400):
        s = h.step(0.3, DT)
        for name in ("caution", "abort"):
            if getattr(s, name):
                first.setdefault(name, (i + 1) * DT)
    assert first["caution"] == pytest.approx(-1.5 * math.log(1.0 - 0.12 / 0.3), abs=DT)
    assert first["abort"] == pytest.approx(-4.0 * math.log(1.0 - 0.12 / 0.3), abs=DT)


def test_caution_comes_and_goes_and_abort_stays() -> None:
    h = Hazard(HazardParams(settle_s=0.0))
    for F in (0.2, 0.0, 0.2):
        for _ in range(100):
            s = h.step(F, DT)
    assert h.cautions == 2 and not s.abort
    for F in (0.4, -0.2):
        for _ in range(300):
            s = h.step(F, DT)
    assert s.abort and not s.caution
    kept = h.state
    assert h.step(math.nan, DT) is kept
    assert Hazard(HazardParams(settle_s=1.0)).step(5.0, 0.5).slow == 0.0
    quick = Hazard(HazardParams(settle_s=0.0, abort_on="caution"))
    for _ in range(60):
        s = quick.step(0.3, DT)
    assert s.abort and s.slow < 0.12


def test_sinking_air_aborts_in_the_time_of_its_low_pass() -> None:
    """A step of the part of F that sinking air makes is above its threshold after -T ln(1 - threshold / step)."""
    for T in (0.5, 1.0):
        h = Hazard(HazardParams(settle_s=0.0, sink_s=T, sink_F=0.1))
        n = next(n for n in range(1, 1000) if h.step(0.0, 0.02, sink=0.15).abort)
        assert n * 0.02 == pytest.approx(-T * math.log(1.0 - 0.1 / 0.15), abs=0.021)
    never = Hazard(HazardParams(settle_s=0.0, sink_F=0.0))
    assert not any(never.step(0.0, 0.02, sink=1.0).abort for _ in range(500))


def test_the_loss_that_follows_a_gain_aborts_by_the_quick_value() -> None:
    """10 s of gain, then loss: with gain_abort the abort comes with the quick low-pass, without it with the slow one; without a
    gain before it both are alike."""
    at = {}
    for gain, early in itertools.product((-0.3, 0.0), (False, True)):
        h = Hazard(HazardParams(settle_s=0.0, gain_abort=early))
        for _ in range(500):
            h.step(gain, 0.02)
        at[gain, early] = next(n for n in range(1, 2000) if h.step(0.25, 0.02).abort)
    assert at[-0.3, True] < at[-0.3, False] and at[0.0, True] == at[0.0, False]


def test_hazard_index_by_differences_is_that_by_rates() -> None:
    h = Hazard()
    x = X0.copy()
    assert h.index(x, 0.07, DT, 9.81) == 0.07  # nothing to compare with yet
    for _ in range(3):
        x[k.WX] += x[k.WXD] * DT
        x[k.WH] += x[k.WHD] * DT
        F = h.index(x, 0.0, DT, 9.81)
    assert pytest.approx(k.f_factor(x, 9.81), abs=1e-12) == F
    h.lost()
    x[k.WX] += 10.0
    assert h.index(x, 0.01, DT, 9.81) == 0.01  # a jump over a gap is not a shear
    assert Hazard(HazardParams(rates="states")).index(x, 0.02, DT, 9.81) == 0.02


def escaping(law: str, x: np.ndarray, F: float = 0.3, **more: float) -> PathDemand:
    g = WindshearGuidance(with_law(WindshearGuidanceParams(), law, **more))
    g.abort()
    for _ in range(200):
        d = g.step(x, F, DT)
    return d


def test_escape_laws_demand_what_they_say() -> None:
    still = X0.copy()
    still[k.WH] = -0.3 * still[k.VA]  # a steady sink of F = 0.3
    assert escaping("pitch", still, pitch_deg=12.0) == PathDemand("pitch", pitch_rad=math.radians(12.0))
    assert escaping("climb", still).climb_mps == 5.0
    assert escaping("open", still).mode == "open"
    e = EscapeParams()
    still[k.H] = e.target_m + 10.0
    d = escaping("managed", still)
    assert d.climb_mps == pytest.approx(-10.0 * e.height_gain_1ps) and d.alpha_max_rad == 0.22
    still[k.H] = 500.0
    assert escaping("managed", still).climb_mps == -e.descent_mps
    still[k.H], still[k.VA] = 30.0, 54.0
    still[k.WH] = -0.3 * 54.0
    assert escaping("managed", still).climb_mps == pytest.approx(5.0 - 0.6 * 8.0)  # speed before height
    still[k.H] = 25.0
    assert escaping("managed", still).climb_mps == pytest.approx(10.0 * e.height_gain_1ps)  # but not near the ground
    calm = X0.copy()
    calm[k.WH] = 0.0
    calm[k.H] = 60.0
    assert escaping("managed", calm, 0.0).climb_mps == e.after_mps
    assert escaping("continue", still).mode == "approach"
    with pytest.raises(ValueError, match="escape law 'up'"):
        with_law(WindshearGuidanceParams(), "up")


def test_turbulence_does_not_switch_between_escape_and_clear() -> None:
    """F swings about hold_F as in turbulence: escape until it stays below for clear_s, and again only above again_F."""
    base = WindshearGuidanceParams(hazard=HazardParams(rates="states", settle_s=0.0, caution_s=0.05))
    g = WindshearGuidance(base)
    e, x = base.escape, X0.copy()
    seen: list[str] = []

    def feed(F: float, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            g.step(x, F, DT)
            seen.append(g.phase)

    feed(0.3, 4.0)
    assert seen[-1] == "escape"
    for _ in range(10):
        feed(e.hold_F - 0.04, 0.5 * e.clear_s)
        feed(e.hold_F + 0.04, 0.3)
    assert seen[-1] == "escape"
    feed(e.hold_F - 0.04, e.clear_s + 0.3)
    for _ in range(10):
        feed(e.again_F - 0.02, 0.5)
        feed(e.hold_F - 0.04, 0.5)
    assert seen[-1] == "clear"
    feed(e.again_F + 0.1, 0.5)
    assert seen[-1] == "escape"
    assert sum(a != b for a, b in itertools.pairwise(seen)) == 4  # approach, caution, escape, clear, escape
    with pytest.raises(ValueError, match=r"again_F = 0.01; allowed: hold_F = 0.05 or more"):
        EscapeParams(again_F=0.01)


def test_caution_flies_no_steeper_than_the_slope() -> None:
    """Above the slope, as the head wind of a microburst leaves one, the approach would dive; in caution it does not."""
    x = X0.copy()
    x[[k.WXD, k.WHD, k.WH]] = 0.0
    g = WindshearGuidance()
    g.aim(x[k.X], x[k.H] - 30.0)
    ground = x[k.VA] * math.cos(x[k.GA]) + x[k.WX]
    nominal = -ground * math.tan(math.radians(3.0))
    assert g.step(x, 0.0, DT).climb_mps == g.p.approach.climb_min_mps < nominal
    for _ in range(400):
        x[k.WX] += 0.25 * 9.81 * DT
        d = g.step(x, 0.0, DT)
        if g.phase == "caution":
            break
    ground = x[k.VA] * math.cos(x[k.GA]) + x[k.WX]
    assert g.phase == "caution" and d.climb_mps == pytest.approx(-ground * math.tan(math.radians(3.0)))


def test_hazard_settles_anew_after_a_gap_of_the_estimate() -> None:
    h = Hazard(HazardParams(settle_s=1.0))
    for _ in range(100):
        h.step(0.0, DT)
    h.lost()
    for _ in range(48):
        assert h.step(3.0, DT).quick == 0.0
    for _ in range(10):
        h.step(3.0, DT)
    assert h.state.quick > 0.0


def test_a_go_around_in_calm_air_does_not_dive_first() -> None:
    g = WindshearGuidance()
    calm = X0.copy()
    calm[[k.WXD, k.WHD, k.WH]] = 0.0
    for _ in range(100):
        g.step(calm, 0.0, DT)
    g.abort()
    assert g.step(calm, 0.0, DT).climb_mps == g.p.escape.after_mps and g.phase == "clear"


def test_approach_follows_slope_and_ground_speed() -> None:
    g = WindshearGuidance()
    g.aim(-3000.0, 200.0)
    x = X0.copy()
    x[k.WH] = 0.0
    d = g.step(x, 0.0, DT)
    ground = x[k.VA] * math.cos(x[k.GA]) + x[k.WX]
    assert d.climb_mps == pytest.approx(-ground * math.tan(math.radians(3.0)))
    assert d.speed_mps == pytest.approx(77.0)
    x[k.X] += 100.0
    assert g.slope_height(x[k.X]) == pytest.approx(200.0 - 100.0 * math.tan(math.radians(3.0)))
    x[k.WX] = -30.0
    assert g.step(x, 0.0, DT).speed_mps == 83.0
    assert g.step(x, 0.0, DT, valid=False) is g.demand
    with pytest.raises(ValueError, match="speeds"):
        WindshearGuidance(replace(WindshearGuidanceParams(), approach=ApproachParams(speed_min_mps=90.0)))


def test_gain_of_energy_cautions_for_what_follows_it() -> None:
    """The head wind of a microburst comes first: a lasting F below -gain_F is a caution, held, and never an abort."""
    p = HazardParams(settle_s=0.0, gain_hold_s=5.0)
    h = Hazard(p)
    on = -4.0 * math.log(1.0 - p.gain_F / 0.2)
    for i in range(300):
        s = h.step(-0.2, DT)
        assert s.caution is ((i + 1) * DT > on - 1e-9)
    off = 4.0 * math.log(-s.slow / p.gain_F) + 5.0
    for i in range(500):
        s = h.step(0.0, DT)
        assert s.caution is ((i + 1) * DT < off - DT) or abs((i + 1) * DT - off) < 2.5 * DT
    assert not s.abort and h.cautions == 1
    g = WindshearGuidance()
    x = X0.copy()
    for _ in range(800):
        x[k.WX] -= 0.25 * 9.81 * DT
        d = g.step(x, 0.0, DT)
    assert g.phase == "caution"
    assert d.speed_mps == g.p.approach.speed_max_mps + g.p.approach.caution_speed_mps
