"""Alleviation law and hold: optimality, timing, limits, and the servo twin against the plant's servo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust import law
from flightsw.missions.gust.model import linear_model, published
from flightsw.missions.gust.servos import GustServos
from flightsw.sixdof.lqr import DesignError
from sim_plant.kernels import layout as n
from sim_plant.kernels.servo import servo_step

AC, M = published(), linear_model()
DT = 0.02
P = law.AlleviationParams(wind_triangle=False)


def cost(K: np.ndarray, z0: np.ndarray, p: law.AlleviationParams = P) -> float:
    """Integral of the weighted squares over 60 s from z0, held commands one step late, by fine integration: over a step it is a
    quadratic form of the state at its beginning."""
    A, B, row = law.plant_matrices(M, AC, p.low_pass_hz)
    parts = 20
    h = DT / parts
    big = np.zeros((16, 16))
    big[:14, :14], big[:14, 14:] = A * h, B * h
    F = np.eye(16)
    term = np.eye(16)
    for i in range(1, 15):
        term = term @ big / i
        F += term
    weights = [(law.LOW, p.a_z_low), (k.TH, p.Theta), (k.H, p.H), (k.VK, p.V_K)]
    weighted = np.vstack((row / p.a_z, *(np.eye(14)[i] / s for i, s in weights)))
    so_far, form = np.eye(16), np.zeros((16, 16))
    for _ in range(parts):
        mid = weighted @ (0.5 * (so_far + F @ so_far))[:14]
        form += h * mid.T @ mid
        so_far = F @ so_far
    z, total = z0.copy(), 0.0
    for _ in range(3000):
        u = -K @ z
        total += float(z @ form @ z) + DT * ((u[0] / p.elevator) ** 2 + (u[1] / p.flap) ** 2)
        z = np.concatenate(((so_far @ z)[:14], u))
    return total


def test_no_neighbouring_gain_is_cheaper() -> None:
    K, radius = law.alleviation_gain(P, M, AC, DT)
    assert 0.9 < radius < 1.0
    z0 = np.zeros(16)
    z0[[k.AW, k.AK, k.VW]] = 0.03, 0.02, 0.5
    best = cost(K, z0)
    r = np.random.default_rng(1)
    for _ in range(6):
        other = K * (1.0 + 0.1 * r.standard_normal(K.shape))
        assert cost(other, z0) > best * 0.9999


@pytest.mark.parametrize("late", [0, 1, 2, 3])
def test_gain_stabilises_whatever_the_delay(late: int) -> None:
    K, radius = law.alleviation_gain(law.AlleviationParams(late_steps=late), M, AC, DT)
    assert K.shape == (2, 14 + 2 * late)
    assert radius < 1.0
    g = law.GustAlleviation(law.AlleviationParams(late_steps=late))
    s = GustServos(AC, late_steps=late)
    assert np.isfinite(g.step(np.zeros(9), s)).all()


def test_low_pass_row_and_servo_rows_are_what_they_say() -> None:
    A, B, row = law.plant_matrices(M, AC, 3.0)
    w = 2 * math.pi * 3.0
    H = np.linalg.solve(1j * w * np.eye(14) - A, B)
    low = H[law.LOW] / (row @ H)
    assert np.abs(low) == pytest.approx(1 / math.sqrt(2), rel=1e-9)  # Butterworth: -3 dB at its corner
    dc = -np.linalg.solve(A[8:12, 8:12], B[8:12])
    assert dc[[0, 2]] == pytest.approx(np.eye(2))


def test_servo_twin_follows_the_plant_servo() -> None:
    twin = GustServos(AC)
    s, c, par = np.zeros(n.NS), np.zeros(n.NC), np.zeros(n.P_TABLES)
    lim = np.radians([15.0, 20.0, 1.0])
    par[n.P_LO : n.P_LO + 3], par[n.P_HI : n.P_HI + 3] = -lim, lim
    par[n.P_RATE : n.P_RATE + 3], par[n.P_WN], par[n.P_ZETA] = math.radians(300.0), 40.0, 0.7
    r = np.random.default_rng(3)
    pending = np.zeros(3)
    for _ in range(200):
        command = np.array([*r.uniform(-0.05, 0.05, 1), 5.0, *r.uniform(-0.05, 0.05, 1)])
        twin.send(command)
        c[n.C_SURF], c[n.C_SURF + 1] = pending[0], pending[2]
        mean = np.zeros(2)
        for _ in range(40):
            mean += s[n.S_SURF : n.S_SURF + 2] / 80
            servo_step(s, c, par, DT / 40)
            mean += s[n.S_SURF : n.S_SURF + 2] / 80
        twin.step(DT)
        pending = command
        assert twin.now[[0, 2]] == pytest.approx(s[n.S_SURF : n.S_SURF + 2], abs=0.003)
        assert twin.mean[[0, 2]] == pytest.approx(mean, abs=0.003)
    assert twin.queue[0] == pytest.approx(command)
    twin.reset()
    assert not twin.now.any() and not twin.queue.any()
    with pytest.raises(ValueError, match="late_steps = -1"):
        GustServos(AC, late_steps=-1)


def test_commands_stay_within_travel_and_bad_estimates_give_trim() -> None:
    g, s = law.GustAlleviation(), GustServos(AC)
    x = np.zeros(9)
    x[k.AW], x[k.VK] = 0.6, 8.0
    for sign in (1.0, -1.0):
        u = g.step(sign * x, s)
        assert abs(u[k.ELEVATOR]) <= AC.elevator_limit_rad
        assert abs(u[k.FLAP]) <= AC.flap_limit_rad
        assert abs(u[k.THROTTLE]) <= 100.0
    x[k.Q] = math.nan
    assert not g.step(x, s).any()


def test_a_down_gust_lowers_the_flap_and_zeroed_wind_columns_do_not() -> None:
    x = np.zeros(9)
    x[k.AW] = 0.05
    assert law.GustAlleviation().step(x, GustServos(AC))[k.FLAP] > 0.05
    blind = law.GustAlleviation(law.AlleviationParams(feed_wind=False, wind_triangle=False))
    assert not blind.K[:, :3].any()
    assert np.abs(blind.K[:, k.AK]).max() > 1.0  # alpha_K alone is not the aerodynamic angle


def test_equivalent_state_gives_the_linear_lift_the_nonlinear_need() -> None:
    """With flap and incidence that hold the path in the nonlinear model, the linear a_z of the equivalent state is zero."""
    from flightsw.missions.gust.model import Turbulence, parameter_vector

    par = parameter_vector(AC, Turbulence())
    x = np.zeros(9)
    x[k.VK], x[k.VW], x[k.AW] = 2.0, -1.0, 0.06
    a = np.zeros(4)
    k.air(x, par, a)
    ratio = (a[0] / 20.0) ** 2
    flap = (9.81 / ratio - 9.81 - 219.08 * a[1]) / 80.0
    lift, _ = k.lift_drag(a[0], a[1], 0.0, np.array([0.0, 0.0, flap]), par)
    assert lift == pytest.approx(9.81)
    z = np.zeros(8)
    law.equivalent(x, 20.0, z)
    linear = float(M.C[k.Y_AZ, :8] @ z + M.D[k.Y_AZ, k.FLAP] * flap)
    plain = float(M.C[k.Y_AZ, :8] @ x[:8] + M.D[k.Y_AZ, k.FLAP] * flap)
    assert abs(linear) < 0.1
    assert abs(plain) > 1.0


def test_equivalent_state_is_the_state_to_first_order() -> None:
    x = np.random.default_rng(5).standard_normal(9) * 1e-4
    z = np.zeros(8)
    law.equivalent(x, 20.0, z)
    assert z == pytest.approx(x[:8], abs=3e-6)


def test_hold_returns_to_pitch_and_height() -> None:
    hold = law.GustHold()
    A, B = M.A[3:8, 3:8], M.B[3:8]

    def rates(t: float, s: np.ndarray) -> np.ndarray:
        return A @ s + B @ hold.step(s[0], s[3], s[4], s[2])

    end = solve_ivp(rates, (0.0, 60.0), [0.2, 0.05, 1.0, 0.1, 10.0], rtol=1e-8).y[:, -1]
    assert abs(end[3]) < 0.01
    assert abs(end[4]) < 0.5
    assert abs(hold.step(math.nan, 0.0, 0.0)[k.ELEVATOR]) == 0.0
    assert hold.step(0.0, 0.0, 1e6)[k.ELEVATOR] <= AC.elevator_limit_rad


def test_gain_repeats_and_an_impossible_design_is_named() -> None:
    with pytest.raises(DesignError, match="gust alleviation"):
        law.GustAlleviation(law.AlleviationParams(a_z=math.nan))
    assert law.alleviation_gain(P, M, AC, DT)[0].tobytes() == law.alleviation_gain(P, M, AC, DT)[0].tobytes()
    g = law.GustAlleviation(law.AlleviationParams(use_flap=False))
    assert not g.step(np.full(9, 0.02), GustServos(AC))[k.FLAP]


def test_laws_alike_share_their_gain_and_none_changes_anothers() -> None:
    """A law that feeds no wind has zeros where the others of the same design have the feed-forward."""
    first, second = law.GustAlleviation(), law.GustAlleviation()
    blind = law.GustAlleviation(law.AlleviationParams(feed_wind=False))
    after = law.GustAlleviation(law.AlleviationParams(feed_wind=False, wind_triangle=False))
    wanted, _ = law.alleviation_gain(P, M, AC, DT)
    for each in (first, second, law.GustAlleviation()):
        np.testing.assert_array_equal(each.K, wanted)
    for each in (blind, after):
        assert not each.K[:, law.WIND].any()
        np.testing.assert_array_equal(each.K[:, law.WIND.stop :], wanted[:, law.WIND.stop :])
    stiffer = law.GustAlleviation(law.AlleviationParams(a_z=2.0 * P.a_z))
    assert np.abs(stiffer.K - wanted).max() > 1e-3


def test_throttle_held_has_its_own_mean_at_once() -> None:
    servos = GustServos(AC, late_steps=0)
    servos.send(np.array([0.0, 100.0, 0.0]))
    servos.step(0.02)
    assert servos.mean[k.THROTTLE] == pytest.approx(100.0) and servos.now[k.THROTTLE] == 100.0
