"""The kinematic air-data flight: printed wake figures, Biot-Savart quadrature, motion, statistics of every error source."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import ncx2

from hil_scripts.studies.sevil.flight import LEG_NAMES, LONG_LEGS, SPEC_PROBES, Conditions, Fault, fly_air, table_faults
from hil_scripts.studies.sevil.point_gusts import dryden_tensor, point_gusts
from hil_scripts.studies.sevil.probe_air import PlantWake, plant_readings, span_wind
from sim_plant.wind.vortex import source_strength, wake_velocity

QUIET = Conditions(turbulence_mps=0.0, wind_mps=(0.0, 0.0, 0.0))
STILL = replace(QUIET, wander_m=0.0)
CONTACT = np.array([[-35.5, 0.0, 8.5]])


def test_circulations_and_effective_wind_are_those_of_the_specification() -> None:
    """sevil.md section 4: 336.58 and -57.03 m^2/s; section 3.1: W_eff = (0.08, 0.48, 4.96) at (-35.5, 2, 8.5)."""
    obs, src = PlantWake().vectors()
    assert source_strength(obs, src) == pytest.approx((336.58, -57.03), abs=0.005)
    assert span_wind(np.array([-35.5, 2.0, 8.5]), PlantWake())[0] == pytest.approx((0.08, 0.48, 4.96), abs=0.005)


def test_wake_without_cores_is_biot_savart() -> None:
    """Direct quadrature over the three filaments of both horseshoes."""
    wake = PlantWake(core_wing_m=1e-9, core_tail_m=1e-9, nu_m2ps=0.0)
    obs, src = wake.vectors()
    gammas = source_strength(obs, src)
    place = np.array([-35.5, 3.0, 8.5])
    total = np.zeros(3)
    for (at, span), gamma in zip(((wake.wing_m, 39.88), (wake.tail_m, 12.27)), gammas, strict=True):
        half = math.pi / 8.0 * span
        # in along the left leg, left to right on the wing, out along the right leg
        parts = (
            (lambda s, h=half, a=at: np.array([a[0] - s, -h, a[2]]), np.array([1.0, 0, 0]), 0.0, np.inf),
            (lambda s, a=at: np.array([a[0], s, a[2]]), np.array([0, 1.0, 0]), -half, half),
            (lambda s, h=half, a=at: np.array([a[0] - s, h, a[2]]), np.array([-1.0, 0, 0]), 0.0, np.inf),
        )
        for where, tangent, lo, hi in parts:
            for i in range(3):

                def f(s: float, i: int = i, where=where, tangent=tangent) -> float:  # type: ignore[no-untyped-def]
                    r = place - where(s)
                    return float(np.cross(tangent, r)[i] / np.linalg.norm(r) ** 3)

                total[i] += gamma / (4.0 * math.pi) * quad(f, lo, hi, epsabs=1e-11, limit=400)[0]
    assert np.allclose(wake_velocity(*place, obs, src), total, atol=1e-6)


def test_mirror_symmetry_and_the_side_of_the_sidewash() -> None:
    """V, alpha left(y) = right(-y), beta left(y) = -beta right(-y); below and between the vortices left > 0 > right."""
    y = np.linspace(-6.0, 60.0, 41)
    xi = np.stack([np.full(41, -35.5), y, np.full(41, 8.0)], axis=1)
    att = np.array([0.0, 0.05, 0.0])
    a, b = plant_readings(xi, att), plant_readings(xi * [1, -1, 1], att)
    swap = [0, 2, 1]
    assert np.allclose(a[:, 0:3], b[:, swap], atol=1e-10) and np.allclose(a[:, 6:9], b[:, 6:9][:, swap], atol=1e-12)
    assert np.allclose(a[:, 3:6], -b[:, 3:6][:, swap], atol=1e-12)
    r = plant_readings(CONTACT, att)[0]
    assert r[4] > 0.005 > -0.005 > r[5] and abs(r[3]) < 1e-12


def test_readings_without_wake_are_rigid_body_kinematics() -> None:
    rng = np.random.default_rng(1)
    att, om, xd, w = (0.1 * rng.standard_normal((5, 3)) for _ in range(4))
    out = plant_readings(np.zeros((5, 3)), att, xi_dot=xd, omega=om, air=w, wake=None)
    from scipy.spatial.transform import Rotation

    for i in range(5):
        C = Rotation.from_euler("ZYX", att[i]).as_matrix().T
        for j, p in enumerate(SPEC_PROBES):
            u = C @ (np.array([200.0, 0, 0]) + xd[i] - w[i]) + np.cross(om[i], p)
            V = np.linalg.norm(u)
            assert out[i, [j, 3 + j, 6 + j]] == pytest.approx(
                (V, math.asin(u[1] / V), math.atan2(u[2], u[0])), abs=1e-12
            )


def test_flight_goes_from_observation_to_contact_and_its_rates_are_its_derivatives() -> None:
    f = fly_air(STILL, 1)
    assert len(f.t) == 6600 and [int(np.sum(f.leg == i)) for i in range(5)] == [1200, 600, 1600, 800, 2400]
    assert len(LEG_NAMES) == 5
    assert np.allclose(f.xi[f.leg == 0], (-59.13, 56.33, 0.0)) and np.allclose(f.xi[f.leg == 4], CONTACT)
    g = fly_air(QUIET, 1)
    assert np.allclose(np.gradient(g.xi, 0.05, axis=0)[1:-1], g.xi_dot[1:-1], atol=1e-4)
    assert np.allclose(np.gradient(g.xi_dot, 0.05, axis=0)[1:-1], g.acc[1:-1], atol=5e-4)
    assert np.allclose((g.xi - f.xi).std(axis=0), 0.15, rtol=0.15)
    deg = np.degrees(f.att)
    assert 2.5 < deg[:, 1].min() < 2.9 and 4.3 < deg[:, 1].max() < 4.5
    assert -1.1 < deg[:, 0].min() < -0.9 and np.abs(deg[:, 2]).max() < 0.5
    # the body rates are those that turn one attitude into the next
    from scipy.spatial.transform import Rotation

    R = Rotation.from_euler("ZYX", g.att)
    turned = (R[:-1].inv() * R[1:]).as_rotvec() / 0.05
    assert np.allclose(turned, 0.5 * (g.omega[:-1] + g.omega[1:]), atol=2e-4)


def test_plain_parity_sees_what_the_specification_measured() -> None:
    """sevil.md 9.2, quiet air, 3000 s: percent of gamma > 9.2103, before / during / after, for V, beta, alpha."""
    f = fly_air(replace(QUIET, legs_s=LONG_LEGS), 1)
    expected = ((1.14, 1.13, 1.02), (1.07, 59.6, 100.0), (4.25, 18.6, 2.01))
    spread = ((0.3, 0.6, 0.2), (0.3, 3.0, 0.01), (0.6, 3.0, 0.4))
    for var in range(3):
        d = f.readings[:, 3 * var : 3 * var + 3] / Conditions().sigma[var]
        gamma = np.sum((d - d.mean(axis=1, keepdims=True)) ** 2, axis=1)
        for i, m in enumerate((f.leg == 0, (f.leg > 0) & (f.leg < 4), f.leg == 4)):
            assert 100.0 * np.mean(gamma[m] > 9.2103) == pytest.approx(expected[var][i], abs=spread[var][i])


def test_table_faults_have_the_noncentral_power_and_leave_the_rest_of_the_run() -> None:
    """Solo: V 3 m/s at sigma^2 0.2 has lambda 30: 99.483 % (sevil.md 9.1), either sign."""
    base = replace(QUIET, legs_s=LONG_LEGS, wake=None)
    ref = fly_air(base, 3)
    theory = 1.0 - ncx2.cdf(9.2103, 2, 30.0)
    for sign in (1.0, -1.0):
        f = fly_air(replace(base, faults=table_faults(sign)), 3)
        assert np.array_equal(f.clean, ref.clean) and np.array_equal(f.att_m, ref.att_m)
        d = f.readings - ref.readings
        m = (f.t >= 500.0) & (f.t < 1500.0)
        assert np.allclose(d[m, 1], 3.0 * sign) and not d[~m, 1].any() and np.array_equal(f.faulty & 2 > 0, m)
        assert np.allclose(d[(f.t >= 1125.0) & (f.t < 2125.0), 3], math.radians(sign))
        assert np.allclose(d[(f.t >= 1750.0) & (f.t < 2750.0), 8], math.radians(sign))
        v = f.readings[m, :3] / math.sqrt(0.2)
        tap = np.mean(np.sum((v - v.mean(axis=1, keepdims=True)) ** 2, axis=1) > 9.2103)
        assert tap == pytest.approx(theory, abs=4 * math.sqrt(theory * (1 - theory) / m.sum()))


def test_a_ramp_fault_drifts() -> None:
    f = fly_air(replace(STILL, faults=(Fault(2, 0, 0.0, 100.0, 1e9, rate=1e-4),)), 1)
    d = f.readings - fly_air(STILL, 1).readings
    assert d[f.t == 150.0, 6] == pytest.approx(5e-3) and not d[f.t < 100.0].any()


def test_noise_has_the_set_spread_and_same_seed_same_bytes() -> None:
    c = Conditions()
    f, g, h = fly_air(c, 5), fly_air(c, 5), fly_air(c, 6)
    assert f.readings.tobytes() == g.readings.tobytes() != h.readings.tobytes()
    assert np.allclose((f.readings - f.clean).std(axis=0), np.repeat(c.sigma, 3), rtol=0.04)
    assert np.allclose((f.acc_m - f.acc).std(axis=0), 0.05, rtol=0.05)
    assert np.allclose(np.degrees(f.att_m - f.att).std(axis=0), 0.02, rtol=0.05)
    runs = [fly_air(replace(STILL, legs_s=(0.5, 0.0, 0.0, 0.0, 0.0)), s) for s in range(300)]
    assert np.std([r.guess - r.xi[0, 1:] for r in runs]) == pytest.approx(5.0, rel=0.1)
    assert np.std([r.x_m[0] - r.xi[0, 0] for r in runs]) == pytest.approx(1.0, rel=0.12)
    assert np.std([np.degrees((r.att_m - r.att).mean(axis=0)) for r in runs]) == pytest.approx(0.1, rel=0.1)
    assert np.std([(r.acc_m - r.acc).mean(axis=0) for r in runs]) == pytest.approx(
        math.hypot(0.02, 0.05 / 10**0.5), rel=0.1
    )


def test_turbulence_is_common_unless_points_are_separate() -> None:
    f = fly_air(Conditions(), 2)
    assert np.array_equal(f.air[:, 0], f.air[:, 1]) and np.array_equal(f.air[:, 0], f.air[:, 2])
    assert np.allclose(f.air.mean(axis=(0, 1)), (2.0, 1.0, 0.5), atol=0.2)


def test_separate_points_follow_the_exact_covariance() -> None:
    """Variance, difference between the tips, and lagged covariance of every pair against the isotropic tensor."""
    pts, V, L, s, dt, n = np.array(SPEC_PROBES), 200.0, 53.0, 0.39, 0.05, 1 << 17
    a = point_gusts(1, V, L, s, dt, pts, n)
    for lag in (0, 1, 5):
        for i in range(3):
            for j in range(3):
                got = a[lag:, i].T @ a[: n - lag, j] / (n - lag)
                r = pts[i] - pts[j] + np.array([V * dt * lag, 0.0, 0.0])
                assert np.allclose(got, dryden_tensor(r, L, s), atol=0.005)
    assert point_gusts(1, V, L, s, dt, pts, 999).tobytes() == point_gusts(1, V, L, s, dt, pts, 999).tobytes()


def test_the_tensor_gives_the_one_point_dryden_correlations() -> None:
    """Along the track: exp(-r/L) and (1 - r/2L) exp(-r/L), the transforms of the Dryden spectra."""
    for d in (0.0, 30.0, 700.0):
        c = dryden_tensor(np.array([d, 0.0, 0.0]), 533.4, 0.39)
        e = 0.39**2 * math.exp(-d / 533.4)
        assert np.allclose(np.diag(c), (e, e * (1 - d / 1066.8), e * (1 - d / 1066.8)))


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="broadcast"):
        plant_readings(np.zeros((5, 3)), np.zeros((4, 3)))
