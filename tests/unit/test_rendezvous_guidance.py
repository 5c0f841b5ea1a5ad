"""Rendezvous guidance against turns integrated by scipy, the traps of its source, and the border of the frame."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous import turn_law as kg
from flightsw.missions.rendezvous.frame import RendezvousFrame
from flightsw.missions.rendezvous.guidance import OwnState, RendezvousGuidance, RendezvousGuidanceParams
from sim_plant.couplings import traffic_kernel as tr

NM, KN, G = 1852.0, 1852.0 / 3600.0, 9.80665
V = 396.0 * KN
TOP, LOW = math.radians(30.0), math.radians(0.3)


def own(x: float, y: float, psi: float, wx: float = 0.0, wy: float = 0.0, bank: float = 0.0) -> np.ndarray:
    return np.array([x, y, psi, bank, V, wx, wy, math.asin(wy / V)])


def fly(o: np.ndarray, banks: list[tuple[float, float]]) -> np.ndarray:
    """(x, y, psi) after flying each bank over each heading change, by numerical integration; returns [x, y, psi, time]."""
    s = np.array([o[0], o[1], o[2], 0.0])
    for bank, dpsi in banks:
        rate = G * math.tan(bank) / V

        def f(_t: float, q: np.ndarray, rate: float = rate) -> list[float]:
            return [V * math.cos(q[2]) + o[5], V * math.sin(q[2]) + o[6], rate, 1.0]

        s = solve_ivp(f, (0.0, dpsi / rate), s, rtol=1e-12, atol=1e-9).y[:, -1]
    return s


@pytest.mark.parametrize(
    ("psi", "wx", "wy"), [(0.0, 0.0, 0.0), (0.4, 8.0, -20.0), (2.2, -15.0, 25.0), (-0.2, 0.0, 30.0)]
)
def test_turn_point_ends_on_the_track_at_the_predicted_miss(psi: float, wx: float, wy: float) -> None:
    o = own(1000.0, -24e3, psi, wx, wy)
    r = np.array([40e3, -200.0 + wx, -400.0, 0.0])
    t = np.zeros(kt.T_N)
    kt.turn_point(o, r, TOP, LOW, 2 * NM, 0.0, True, G, t)
    assert t[kt.T_LIMITED] == 0.0
    end = fly(o, [(t[kt.T_BANK], t[kt.T_DPSI])])
    assert end[1] == pytest.approx(r[2], abs=1e-5)
    assert end[2] == pytest.approx(math.pi + o[7], rel=1e-12)
    assert end[3] == pytest.approx(t[kt.T_TIME], rel=1e-9)
    assert r[0] + r[1] * end[3] - 2 * NM - end[0] == pytest.approx(t[kt.T_XM], abs=1e-5)
    assert t[kt.T_YM] == pytest.approx(0.0, abs=1e-6)


def test_turn_after_the_time_to_go_rolls_out_where_it_should() -> None:
    o, r = own(0.0, -9.6 * NM, 0.0), np.array([50e3, -205.0, 0.0, 0.0])
    t = np.zeros(kt.T_N)
    kt.turn_point(o, r, TOP, LOW, 2 * NM, 0.0, True, G, t)
    o[0] += V * t[kt.T_TTG]
    end = fly(o, [(t[kt.T_BANK], math.pi)])
    x_receiver = r[0] + r[1] * (t[kt.T_TTG] + end[3])
    assert x_receiver - end[0] == pytest.approx(2 * NM, abs=1e-5)
    assert end[1] == pytest.approx(0.0, abs=1e-5)


def test_roll_compensated_turn_meets_the_track_within_a_thousandth() -> None:
    """5 deg/s in and out of the bank, rolled out on the lead: miss small against the 9.6 NM offset it turns through."""
    rate = math.radians(5.0)
    o, r = own(0.0, -9.6 * NM, 0.0), np.array([40e3, -V, 0.0, 0.0])
    t = np.zeros(kt.T_N)
    kt.turn_point(o, r, TOP, LOW, 2 * NM, rate, True, G, t)
    q = np.array([0.0, 0.0, rate, 0.5 * KN, 0.0, 0.0, G])
    c, time = np.array([0.0, -9.6 * NM, 0.0, 0.0, V]), 0.0
    while math.pi - c[2] > kt.rollout_lead(c[3], V, rate, G):
        tr.tanker_step(c, t[kt.T_BANK], V, 0.01, q)
        time += 0.01
    while c[3] > 0.0:
        tr.tanker_step(c, 0.0, V, 0.01, q)
        time += 0.01
    assert c[2] == pytest.approx(math.pi, rel=1e-3)
    assert c[1] == pytest.approx(0.0, abs=1e-3 * 9.6 * NM)
    assert r[0] + r[1] * time - 2 * NM - c[0] == pytest.approx(t[kt.T_XM], abs=5e-4 * 9.6 * NM)
    assert time == pytest.approx(t[kt.T_TIME], rel=2e-4)


def test_rollout_lead_is_the_heading_a_ramp_sweeps() -> None:
    rate, phi = math.radians(5.0), 0.5
    q = np.array([0.0, 0.0, rate, 0.5 * KN, 0.0, 0.0, G])
    c = np.array([0.0, 0.0, 0.0, phi, V])
    tr.tanker_step(c, 0.0, V, phi / rate, q)
    assert c[3] == 0.0
    assert c[2] == pytest.approx(kt.rollout_lead(phi, V, rate, G), rel=1e-4)
    assert kt.rollout_lead(-phi, V, rate, G) == -kt.rollout_lead(phi, V, rate, G)
    assert kt.rollout_lead(phi, V, 0.0, G) == 0.0


def test_plant_arc_is_exact_for_any_step() -> None:
    q = np.array([12.0, -7.0, 0.0, 0.0, 0.0, 0.0, G])
    one, many = np.array([0.0, 0.0, 0.3, 0.4, V]), np.array([0.0, 0.0, 0.3, 0.4, V])
    tr.tanker_step(one, 0.4, V, 100.0, q)
    for _ in range(1000):
        tr.tanker_step(many, 0.4, V, 0.1, q)
    assert one == pytest.approx(many, rel=1e-10)
    s = own(0.0, 0.0, 0.3, 12.0, -7.0)
    end = fly(s, [(0.4, G * math.tan(0.4) / V * 100.0)])
    assert one[:2] == pytest.approx(end[:2], rel=1e-9)


@given(st.floats(0.0, 2.4), st.floats(-25, 25), st.floats(-25, 25), st.floats(1.05, 2.0), st.floats(1.05, 2.0))
def test_two_arcs_close_both_misses_when_the_bank_allows(
    psi: float, wx: float, wy: float, f1: float, f2: float
) -> None:
    o = own(500.0, -12e3, psi, wx, wy)
    low = V * V / (G * math.tan(TOP))
    want = (f1 * low, f2 * low)
    d = 0.5 * (math.pi + o[7] - psi)
    end = fly(o, [(math.atan(V * V / (G * r)), d) for r in want])
    vx, vy = -205.0 + wx, 1.5
    r = np.array([end[0] + 2 * NM - vx * end[3], vx, end[1] - vy * end[3], vy])
    radii = np.zeros(2)
    kt.two_arcs(o, r, TOP, 2 * NM, 0.0, 0.0, G, radii)
    assert radii == pytest.approx(want, rel=1e-5)


def test_two_arcs_hold_the_bank_limit() -> None:
    low = V * V / (G * math.tan(TOP))
    radii = np.zeros(2)
    for x in (-2e4, 0.0, 2e4, 6e4):
        for y in (-2e4, -11e3, 0.0, 2e4):
            kt.two_arcs(own(0.0, -12e3, 1.0), np.array([x, -200.0, y, 0.0]), TOP, 2 * NM, 0.01, 0.0, G, radii)
            assert (radii >= low * (1 - 1e-12)).all() and np.isfinite(radii).all()


def test_offset_and_bank_of_the_half_turn() -> None:
    """30 deg needs 7.916 NM, 25 deg 9.80 NM; 9.6 NM is a 25.46 deg turn, the source's "about 9.6 NM" for 25 deg is not."""
    assert kt.offset_for_bank(math.radians(30.0), V, 0.0, 0.0, G) / NM == pytest.approx(7.916, abs=5e-4)
    assert kt.offset_for_bank(math.radians(25.0), V, 0.0, 0.0, G) / NM == pytest.approx(9.80, abs=5e-3)
    assert kt.offset_for_bank(math.radians(25.46), V, 0.0, 0.0, G) / NM == pytest.approx(9.60, abs=5e-3)
    wy = 30.0 * KN
    assert kt.offset_for_bank(math.radians(25.46), V, math.asin(wy / V), wy, G) / NM == pytest.approx(10.77, abs=0.01)
    t = np.zeros(kt.T_N)
    kt.turn_point(own(0.0, -9.6 * NM, 0.0), np.array([4e4, -V, 0.0, 0.0]), TOP, LOW, 2 * NM, 0.0, True, G, t)
    assert math.degrees(t[kt.T_BANK]) == pytest.approx(25.46, abs=0.01)


def test_receiver_on_the_wrong_side_takes_full_bank() -> None:
    t = np.zeros(kt.T_N)
    for y in (-9.6 * NM, -12 * NM, -9.6 * NM + 1e-9):
        kt.turn_point(own(0.0, -9.6 * NM, 0.0), np.array([4e4, -V, y, 0.0]), TOP, LOW, 2 * NM, 0.0, True, G, t)
        assert t[kt.T_BANK] == TOP and t[kt.T_LIMITED] == 1.0 and np.isfinite(t).all()


def test_negative_radius_means_full_bank_and_without_the_guard_a_turn_to_the_right() -> None:
    t = np.zeros(kt.T_N)
    kt.turn_point(own(0.0, -6e3, 2.0), np.array([-9e3, -V, 0.0, 0.0]), TOP, LOW, 2 * NM, 0.0, False, G, t)
    r = V * V / (G * math.tan(t[kt.T_BANK]))
    assert t[kt.T_LIMITED] == 0.0 and r + 12.0 * t[kt.T_XM] / t[kt.T_DPSI] < 0.0
    assert kt.closed_loop_bank(t, 12.0, V, TOP, True, G) == TOP
    assert kt.closed_loop_bank(t, 12.0, V, TOP, False, G) < 0.0


def test_a_tick_exactly_on_the_final_heading_divides_by_nothing() -> None:
    g = RendezvousGuidance(RendezvousGuidanceParams(law="closed_loop", roll_rate_degps=0.0, steer=False))
    g.gs[kg.G_PHASE] = kg.TURN
    c = g.step(OwnState(0.0, 0.0, math.pi, 0.4, V), (3e3, -V, 50.0, 0.0), 5e3, 0.5)
    assert c.phase == "done" and c.bank == 0.0 and math.isfinite(c.miss_x_m)
    for law in ("cross_track", "closed_loop", "two_arc"):
        g = RendezvousGuidance(RendezvousGuidanceParams(law=law, steer=False))
        g.gs[kg.G_PHASE] = kg.TURN
        for psi in (math.pi - 1e-9, math.pi, math.pi + 0.02):
            c = g.step(OwnState(0.0, 0.0, psi, 0.0, V), (3e3, -V, 50.0, 0.0), 5e3, 0.5)
            assert math.isfinite(c.bank)


def test_phases_follow_and_bad_numbers_leave_the_command_standing() -> None:
    p = RendezvousGuidanceParams()
    g = RendezvousGuidance(p)
    q = np.array([0.0, 0.0, math.radians(5.0), 0.5 * KN, 0.0, 0.0, G])
    c, t, x = np.array([0.0, -9.6 * NM, 0.0, 0.0, V]), 0.0, 28.4 * NM
    seen, keep = [], None
    while g.out.phase != "done" and t < 400.0:
        out = g.step(OwnState(*c[:4], c[4]), (x - V * t, -V, 0.0, 0.0), 1e6, 0.1)
        if not seen or seen[-1] != out.phase:
            seen.append(out.phase)
        tr.tanker_step(c, out.bank, out.speed, 0.1, q)
        t += 0.1
        if 90.0 < t < 90.2:
            before, state = out.bank, g.get_state()
            assert g.step(OwnState(math.nan, 0, 0, 0, V), (x, -V, 0.0, 0.0), 1e6, 0.1).bank == before
            keep = state
    assert seen == ["approach", "turn", "rollout", "done"] and keep is not None
    assert x - V * t - c[0] == pytest.approx(2 * NM, abs=0.03 * NM)
    assert c[1] == pytest.approx(0.0, abs=0.03 * NM)
    g.set_state(keep)
    assert g.gs[kg.G_PHASE] == kg.TURN
    g.reset()
    assert g.out.phase == "approach" and g.out.speed == p.speed_mps


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.0, -2.0])
def test_frame_is_a_rotation_with_y_to_the_left(heading: float) -> None:
    f = RendezvousFrame(1000.0, -2000.0, heading)
    n, e = 1000.0 + 50.0 * math.cos(heading), -2000.0 + 50.0 * math.sin(heading)
    assert f.to_r(n, e) == pytest.approx((50.0, 0.0), abs=1e-9)
    left = heading - math.pi / 2.0
    assert f.to_r(1000.0 + math.cos(left), -2000.0 + math.sin(left)) == pytest.approx((0.0, 1.0), abs=1e-9)
    assert f.to_n(*f.to_r(123.0, 456.0)) == pytest.approx((123.0, 456.0))
    # a target 90 deg to the right of a tanker heading along +x is on -y
    assert f.line_of_sight(math.pi / 2, heading) == pytest.approx(-math.pi / 2)
    assert f.bank(0.3) == -0.3


def test_heading_runs_on_through_pi() -> None:
    """A left turn of 250 deg seen through headings wrapped to (-pi, pi]: psi never jumps."""
    f = RendezvousFrame(0.0, 0.0, 2.5)
    psi = 0.0
    for k in range(1000):
        want = math.radians(0.25 * k)
        h = f.heading(want)
        psi = f.psi(h - 2.0 * math.pi * (h > math.pi), psi)
        assert psi == pytest.approx(want, abs=1e-9)
