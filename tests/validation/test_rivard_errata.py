"""Errata of Rivard (1982): the printed form fails where the corrected one holds. Numbers: rivard.md section 5."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous.params import KN, NM, RendezvousNavParams, three_vector
from hil_scripts.studies.rivard.cases import case
from hil_scripts.studies.rivard.figures import consistency, figures
from hil_scripts.studies.rivard.mc import run_case, truth_vectors
from sim_plant.couplings import traffic_kernel as tr

FT = 0.3048
V, G = 396.0 * KN, 9.80665
XVY = [k3.S3_X, k3.S3_V, k3.S3_Y]  # in the order of the source


def test_1_velocity_sigmas_are_six_and_ten_knots_not_swapped() -> None:
    """q_f = 2 sigma^2/T_f = 3.39e-8 NM^2/s^3 needs 10 kn for the fluctuating part; the summary's 6 kn gives a third of it."""
    assert pytest.approx(3.39e-8, rel=2e-3) == 2.0 * (10.0 / 3600.0) ** 2 / 455.0
    assert 2.0 * (6.0 / 3600.0) ** 2 / 455.0 < 0.4 * 3.39e-8
    p = RendezvousNavParams()
    assert (p.velocity_sigma_mps, p.fluctuation_sigma_mps) == pytest.approx((6 * KN, 10 * KN))


def test_2_and_3_altitude_sigma_and_noise_strength_follow_from_the_numbers_beside_them() -> None:
    p = RendezvousNavParams()
    assert p.altitude_sigma_m / NM == pytest.approx(0.02469, abs=1e-5)
    assert p.altitude_sigma_m / NM != pytest.approx(0.0274, rel=0.05)
    q = 2.0 * p.range_noise_sigma_m**2 / p.range_noise_tau_s / NM**2
    assert q == pytest.approx(1.422e-4, rel=1e-3)
    # with the text's e-6 the stationary sigma would be a tenth of the 0.016 NM printed beside it
    assert math.sqrt(0.5 * 1.422e-6 * 3.6) == pytest.approx(0.0016, rel=1e-2)


def test_4_the_printed_r_is_a_square_root() -> None:
    """sigma_b^2 + sigma_n^2 = 0.010256 NM^2 = (0.101 NM)^2. Taken literally the filter claims far more error than it has."""
    assert pytest.approx(0.010256) == 0.1**2 + 0.016**2
    assert math.sqrt(0.010256) == pytest.approx(0.101, abs=5e-4)
    right, literal = (consistency(run_case(case(n), 4000)) for n in ("k3_a", "filter_r_printed"))
    assert right["t120.nees3_lo"] > 1.0 > literal["t120.nees3_hi"]
    f = figures(run_case(case("filter_r_printed"), 8000))
    assert f["x.rms_m"] / NM == pytest.approx(0.78, abs=0.03) and f["y.rms_m"] / NM == pytest.approx(0.41, abs=0.02)


def test_6_gain_without_the_inverse_does_not_estimate() -> None:
    """K = P H' (H P H' + R) has the unit m^4/m^2: the first correction throws the estimate out of the country."""
    e = three_vector(RendezvousNavParams(estimator="ekf3"), -V)
    s, C = np.zeros(3), np.zeros((3, 3))
    k3.ekf3_start(s, C, 30 * NM, 0.0, -9.6 * NM, 0.0, NM, e)
    k3.ekf3_predict(s, C, 10.0, e)
    X, Y = s[k3.S3_X] - 2037.0, s[k3.S3_Y] + 9.6 * NM
    d = math.sqrt(X * X + Y * Y + 304.8**2)
    h = np.array([X / d, 0.0, Y / d])
    P = C[np.ix_(XVY, XVY)]
    S = float(h @ P @ h) + e[k3.E3_R]
    k3.ekf3_range(s, C, d + 200.0, 2037.0, -9.6 * NM, 0.0, e, np.zeros(2))
    assert abs(s[k3.S3_Y]) < NM
    assert abs((P @ h * S * 200.0)[0]) > 1e9


def test_8_measurement_noise_stands_outside_the_root() -> None:
    """sqrt(d^2 + v) instead of sqrt(d^2) + v: a 0.1 NM error would show as centimetres."""
    p, _ = truth_vectors(case("k3_a"))
    s = np.array([28 * NM, 0, 0, 0, 0, 0, 0.1 * NM, 0.0])
    clean = s.copy()
    clean[tr.S_B] = 0.0
    d = tr.tacan_range(clean, 0.0, -9.6 * NM, p)
    assert tr.tacan_range(s, 0.0, -9.6 * NM, p) - d == pytest.approx(0.1 * NM, rel=1e-9)
    assert math.sqrt(d * d + 0.1 * NM) - d < 0.01


def test_9_propagation_leaves_p23_and_moves_p13() -> None:
    """36e prints P13 = P23: P would lose the x-y correlation that carries the information, and its positivity."""
    e = three_vector(RendezvousNavParams(estimator="ekf3"), -V)
    s, C = np.zeros(3), np.zeros((3, 3))
    s[k3.S3_X] = 5e4
    P = np.array([[4e5, 600.0, -5e5], [600.0, 68.0, 300.0], [-5e5, 300.0, 3.4e6]])
    C[np.ix_(XVY, XVY)] = P
    F = np.array([[1.0, 10.0, 0], [0, 1, 0], [0, 0, 1]])
    want = F @ P @ F.T
    k3.ekf3_predict(s, C, 10.0, e)
    assert C[k3.S3_X, k3.S3_Y] == pytest.approx(want[0, 2], rel=1e-12)
    assert C[k3.S3_V, k3.S3_Y] == pytest.approx(want[1, 2], rel=1e-12)
    assert P[1, 2] != pytest.approx(want[0, 2], rel=0.5)  # what 36e would put into P13


def test_10_bias_correction_is_half_the_trace_only_with_the_cross_term() -> None:
    X, Y, a = 40e3, 17e3, 304.8
    P = np.array([[4e5, -5e5], [-5e5, 3.4e6]])
    draws = np.random.default_rng(1).multivariate_normal([X, Y], P, 2_000_000)
    d = math.sqrt(X * X + Y * Y + a * a)
    # control variate: the linear part has a known mean
    lin = ((draws - [X, Y]) @ np.array([X, Y])) / d
    actual = float(np.mean(np.sqrt((draws**2).sum(1) + a * a) - d - lin))
    bias = {}
    for cross in (0.0, 1.0):
        e = three_vector(RendezvousNavParams(estimator="ekf3"), -V)
        e[k3.E3_CROSS] = cross
        s, C, nu = np.zeros(3), np.diag([0.0, 60.0, 0.0]), np.zeros(2)
        s[[k3.S3_X, k3.S3_Y]] = X, Y
        C[np.ix_([k3.S3_X, k3.S3_Y], [k3.S3_X, k3.S3_Y])] = P
        k3.ekf3_range(s, C, d, 0.0, 0.0, 0.0, e, nu)
        bias[cross] = -nu[k3.NU]
    assert bias[1.0] == pytest.approx(actual, rel=0.02)
    assert abs(bias[0.0] - actual) > 10.0 * abs(bias[1.0] - actual)


def test_11_and_12_radius_is_speed_squared_over_g_tan_bank() -> None:
    """(50) prints v/(g tan phi), a time; (44) L sin(psi) would turn the aircraft by where it points, not by how it banks."""
    c, q = np.array([0.0, 0.0, 0.0, 0.4, V]), np.array([0.0, 0, 0, 0, 0, 0, G])
    tr.tanker_step(c, 0.4, V, math.pi * V / (G * math.tan(0.4)), q)
    assert c[2] == pytest.approx(math.pi)
    assert c[1] / 2.0 == pytest.approx(V * V / (G * math.tan(0.4)), rel=1e-12)
    assert c[1] / 2.0 != pytest.approx(V / (G * math.tan(0.4)), rel=0.9)


def test_13_a_required_bank_beyond_thirty_degrees_is_thirty() -> None:
    """ "If phi_r <= 30 set 30" would fly every rendezvous at 30 deg and never obey the limit."""
    t = np.zeros(kt.T_N)
    top = math.radians(30.0)
    for offset, limited in ((9.6, False), (7.95, False), (7.9, True), (5.0, True)):
        o = np.array([0.0, -offset * NM, 0.0, 0.0, V, 0.0, 0.0, 0.0])
        kt.turn_point(o, np.array([4e4, -V, 0.0, 0.0]), top, 0.01, 2 * NM, 0.0, True, G, t)
        assert (t[kt.T_LIMITED] > 0.0) == limited and t[kt.T_BANK] <= top


def test_17_curvature_with_its_cross_term() -> None:
    """78 ft at 100 NM and 6 ft at 30 NM; the printed 65 ft and 1.7 ft leave out 2 a_0 a_c."""
    p, _ = truth_vectors(case("k3_a"))
    flat = p.copy()
    flat[tr.P_RE] = 1e15
    for nm, want, printed in ((100.0, 78.0, 65.0), (30.0, 6.0, 1.73)):
        s = np.zeros(8)
        s[tr.S_X] = nm * NM
        got = (tr.tacan_range(s, 0.0, 0.0, p) - tr.tacan_range(s, 0.0, 0.0, flat)) / FT
        assert got == pytest.approx(want, abs=0.6)
        assert abs(got - printed) > 3.0


def test_18_two_miles_wider_moves_the_open_loop_mean_only_one_way() -> None:
    """Printed +.35 to -1.22: the tables show y_T - y, though the text defines y - y_T."""
    narrow, wide = figures(run_case(case("open"), 3000)), figures(run_case(case("t2_open"), 3000))
    assert (wide["y.mean_m"] - narrow["y.mean_m"]) / NM == pytest.approx(2.0, abs=0.02)


def test_trap_1_unguarded_radius_blows_up_as_printed_and_the_guard_stops_it() -> None:
    guarded = [figures(run_case(case(f"gain_{k}"), 4000)) for k in (3, 12)]
    printed = [figures(run_case(case(f"gain_printed_{k}"), 4000)) for k in (3, 6, 9, 12)]
    assert all(f["x.rms_m"] < 0.8 * NM for f in guarded)
    x = [f["x.rms_m"] / NM for f in printed]
    assert x[0] < x[1] < x[3] and x[2] > 2.0 and x[3] > 3.0
    assert printed[3]["unfinished"] > 0.002
