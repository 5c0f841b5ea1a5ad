"""Rendezvous estimators against matrix algebra, matrix exponentials and brute-force quadrature written here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial.hermite_e import hermegauss

from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.params import (
    ESTIMATORS,
    KN,
    NM,
    RendezvousNavParams,
    eight_vector,
    nominal_velocity,
    three_vector,
)
from sim_plant.couplings import traffic_kernel as tr
from tests.sampled import transition_and_noise

U = -396.0 * KN
P0 = RendezvousNavParams()


def truth_model() -> tuple[np.ndarray, np.ndarray]:
    F, Q = np.zeros((8, 8)), np.zeros((8, 8))
    F[0, 1] = F[0, 2] = F[3, 4] = 1.0
    F[2, 2], F[7, 7] = -1.0 / 455.0, -1.0 / 3.6
    Q[2, 2] = 2.0 * (10.0 * KN) ** 2 / 455.0
    Q[3, 3] = (500.0 * 0.3048) ** 2 / 600.0
    Q[7, 7] = 2.0 * (0.016 * NM) ** 2 / 3.6
    return F, Q


@pytest.mark.parametrize("dt", [1e-3, 0.01, 0.5, 5.0, 9.0, 9.2, 10.0, 60.0, 900.0])
def test_exact_discretisation_onboard_and_plant_equal_the_matrix_exponential(dt: float) -> None:
    F, Q = truth_model()
    Phi, Qd = transition_and_noise(F, Q, dt)
    D = np.zeros(8)
    k8.discretise(dt, eight_vector(P0, U), D)
    assert D[:3] == pytest.approx([Phi[0, 2], Phi[2, 2], Phi[7, 7]], rel=1e-9, abs=1e-15)
    assert D[3:] == pytest.approx([Qd[0, 0], Qd[0, 2], Qd[2, 2], Qd[3, 3], Qd[7, 7]], rel=1e-8)
    p = np.zeros(tr.P_N)
    p[[tr.P_SF, tr.P_TF, tr.P_QY, tr.P_SN, tr.P_TN]] = 10 * KN, 455.0, Q[3, 3], 0.016 * NM, 3.6
    w = np.zeros(8)
    tr.discrete(dt, p, w)
    assert w[[1, 0, 6]] == pytest.approx(D[:3], rel=1e-12)
    plant = [w[3] ** 2 * w[2] ** 2 + w[4] ** 2, w[3] * w[2] ** 2, w[2] ** 2, w[5] ** 2, w[7] ** 2]
    assert plant == pytest.approx(D[3:], rel=1e-10)


@given(st.floats(0.01, 30.0), st.floats(0.01, 30.0), st.integers(0, 99))
def test_two_steps_are_one(a: float, b: float, seed: int) -> None:
    e, r = eight_vector(P0, U), np.random.default_rng(seed)
    A = r.normal(size=(8, 8)) * np.array([500, 3, 5, 900, 0.4, 45, 185, 30])[:, None]
    m1, P1, D = r.normal(size=8) * 100, A @ A.T, np.zeros(8)
    m2, P2 = m1.copy(), P1.copy()
    for dt in (a, b):
        k8.discretise(dt, e, D)
        k8.eight_predict(m1, P1, dt, U, D)
    k8.discretise(a + b, e, D)
    k8.eight_predict(m2, P2, a + b, U, D)
    scale = np.sqrt(np.outer(np.diag(P2), np.diag(P2)))
    assert np.abs(P1 - P2).max() <= 1e-9 * scale.max() and (np.abs(P1 - P2) <= 1e-9 * scale).all()
    assert m1 == pytest.approx(m2, rel=1e-9, abs=1e-6)


def matrix_ekf3(
    z: list[float], own: list[tuple[float, float]], dt: float, cross: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Rivard's filter in matrix form, with F, Q and the Hessian written out: state (x, v, y)."""
    a0, R = 304.8, 0.010256 * NM**2
    F = np.array([[0.0, 1.0, 0.0], [0, 0, 0], [0, 0, 0]])
    Phi, Q = transition_and_noise(F, np.diag([0.0, 1.696e-8, 2.521e-3]) * NM**2, dt)
    (x0, y0), d = own[0], z[0]
    X = math.sqrt(d * d - y0 * y0 - a0 * a0)
    s = np.array([x0 + X, 0.0, 0.0])
    J = np.array([[d / X, 0.0, y0 / X], [0, 1, 0], [0, 0, 1.0]])  # from (range error, v, y)
    P = J @ np.diag([(0.1**2 + 0.016**2) * NM**2, (36.0 + 100.0) * KN**2, NM**2]) @ J.T
    for zi, (xo, yo) in zip(z[1:], own[1:], strict=True):
        s = Phi @ s + np.array([U * dt, 0.0, 0.0])
        P = Phi @ P @ Phi.T + Q
        v = np.array([s[0] - xo, s[2] - yo, a0])
        d = float(np.linalg.norm(v))
        hess = (np.eye(3) - np.outer(v, v) / d**2)[:2, :2] / d
        if not cross:
            hess = np.diag(np.diag(hess))
        H = np.array([[v[0] / d, 0.0, v[1] / d]])
        S = (H @ P @ H.T).item() + R
        K = P @ H.T / S
        s = s + K[:, 0] * (zi - d - 0.5 * np.trace(hess @ P[np.ix_([0, 2], [0, 2])]))
        P = (np.eye(3) - K @ H) @ P @ (np.eye(3) - K @ H).T + K @ K.T * R
    return s, P


@pytest.mark.parametrize("cross", [False, True])
def test_three_state_filter_equals_its_matrix_form(cross: bool) -> None:
    own = [(203.7 * 10.0 * i, -9.6 * NM + 150.0 * i * i) for i in range(12)]
    z = [30.0 * NM - 4000.0 * i + 37.0 * (-1) ** i for i in range(12)]
    e = three_vector(RendezvousNavParams(estimator="ekf3", ekf3_cross_term=cross), U)
    s, C, i = np.zeros(3), np.zeros((3, 3)), [k3.S3_X, k3.S3_V, k3.S3_Y]
    k3.ekf3_start(s, C, z[0], *own[0], 0.0, NM, e)
    for zi, o in zip(z[1:], own[1:], strict=True):
        k3.ekf3_predict(s, C, 10.0, e)
        assert k3.ekf3_range(s, C, zi, *o, 0.0, e, np.zeros(2))
    x, P = matrix_ekf3(z, own, 10.0, cross)
    assert s[i] == pytest.approx(x, rel=1e-9)
    assert C[np.ix_(i, i)] == pytest.approx(P, rel=1e-8)


def component(seed: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    e = eight_vector(P0, U)
    m, P = np.zeros(8), np.zeros((8, 8))
    k8.eight_start(m, P, 30.0 * NM, 0.0, -9.6 * NM, 500.0 * seed, 0.4 * NM, 1.0, e)
    D = np.zeros(8)
    k8.discretise(10.0, e, D)
    k8.eight_predict(m, P, 10.0, U, D)
    return m, P, e


@pytest.mark.parametrize("angle", [False, True])
def test_quadrature_equals_a_dense_rule(angle: bool) -> None:
    m, P, _ = component()
    own = (2000.0, -9.6 * NM)
    h = np.zeros(7)
    k8.quadrature(m, P, *own, angle, 304.8, 6.378e6, h)
    C = P[np.ix_([0, 3], [0, 3])]
    x, w = hermegauss(60)
    g = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    W = np.outer(w, w).ravel() / (2.0 * math.pi)
    pts = np.array([m[0] - own[0], m[3] - own[1]]) + g @ np.linalg.cholesky(C).T
    r2 = (pts**2).sum(1)
    f = np.arctan2(pts[:, 1], pts[:, 0]) if angle else np.sqrt(r2 + (304.8 + r2 / (2 * 6.378e6)) ** 2)
    mean = W @ f
    slope = np.linalg.solve(C, ((pts - W @ pts) * (W * (f - mean))[:, None]).sum(0))
    rest = W @ (f - mean) ** 2 - slope @ C @ slope
    assert h[5] == pytest.approx(mean, rel=1e-9)
    assert h[:2] == pytest.approx(slope, rel=1e-6)
    assert h[6] == pytest.approx(rest, rel=1e-3)


def test_correction_equals_joseph_form_and_stays_symmetric() -> None:
    m, P, e = component()
    h, k, R = np.zeros(7), np.zeros(8), e[k8.E8_R]
    k8.range_quadrature(m, P, 2000.0, -9.6 * NM, e, h)
    S = k8.innovation_variance(P, h, R)
    H = np.zeros((1, 8))
    H[0, [0, 3, 5, 6, 7]] = h[:5]
    assert pytest.approx((H @ P @ H.T).item() + R + h[6], rel=1e-12) == S
    K = P @ H.T / S
    A = np.eye(8) - K @ H
    want_m, want_P = m + K[:, 0] * 120.0, A @ P @ A.T + K @ K.T * (R + h[6])
    k8.eight_fuse(m, P, h, 120.0, S, k)
    assert m == pytest.approx(want_m, rel=1e-9)
    assert np.abs(P - want_P).max() < 1e-9 * np.abs(want_P).max()
    assert (P == P.T).all() and np.linalg.eigvalsh(P).min() > 0.0


def test_linearised_row_is_the_derivative_of_the_range() -> None:
    m, _, e = component()
    h = np.zeros(7)
    k8.range_ekf(m, np.zeros((8, 8)), 2000.0, -9.6 * NM, e, h)

    def f(x: np.ndarray) -> complex:
        h2 = (x[0] - 2000.0) ** 2 + (x[3] + 9.6 * NM) ** 2
        return np.sqrt(h2 + (304.8 + x[5] + h2 / (2.0 * e[k8.E8_RE])) ** 2) + x[6] + x[7]

    J = [f(m + 1e-20j * np.eye(8)[i]).imag / 1e-20 for i in (0, 3, 5, 6, 7)]
    assert h[5] == pytest.approx(f(m).real, rel=1e-12)
    # the change of the curvature term with distance is left out of the row: 4e-5
    assert h[:5] == pytest.approx(J, abs=1e-4)


def test_bank_is_bayes_rule() -> None:
    """Weights after an update: prior weight times likelihood of each component's own innovation."""
    e = eight_vector(P0, U)
    M = 7
    m, P, lw = np.zeros((M, 8)), np.zeros((M, 8, 8)), np.zeros(M)
    kb.bank_start(m, P, lw, 30.0 * NM, 0.0, -9.6 * NM, 0.0, NM, 3.0, 1.0, e)
    D, wk, k, nu = np.zeros(8), np.zeros((M, 9)), np.zeros(8), np.zeros(2)
    kb.bank_predict(m, P, lw, 10.0, e, D)
    z, want, parts = 27.8 * NM, np.zeros(M), []
    for i in range(M):
        h = np.zeros(7)
        k8.range_quadrature(m[i], P[i], 2037.0, -9.6 * NM, e, h)
        S = k8.innovation_variance(P[i], h, e[k8.E8_R])
        want[i] = math.exp(lw[i]) * math.exp(-0.5 * (z - h[5]) ** 2 / S) / math.sqrt(S)
        parts.append((math.exp(lw[i]), z - h[5], S))
    assert kb.bank_range(m, P, lw, z, 2037.0, -9.6 * NM, True, 0.0, e, wk, k, nu)
    got = np.where(lw > kb.DEAD, np.exp(lw), 0.0)
    assert got / got.sum() == pytest.approx(want / want.sum(), rel=1e-9, abs=1e-15)
    w = np.array([p[0] for p in parts])
    w /= w.sum()
    r, S = np.array([p[1] for p in parts]), np.array([p[2] for p in parts])
    assert nu[0] == pytest.approx(w @ r, rel=1e-9)
    assert nu[1] == pytest.approx(w @ (S + r * r) - (w @ r) ** 2, rel=1e-9)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_interface_is_the_same_for_every_estimator(name: str) -> None:
    """100 Hz prediction equals one step; state restores; components are a mixture; a stale or missing range is survived."""
    p = RendezvousNavParams(estimator=name, components=9)

    def run(ticks: int) -> RangeEstimator:
        e = RangeEstimator(p, 5.0, 20.0)
        assert not e.out.valid and not e.update(5e4, 0.0, 0.0)
        e.start(55e3, 0.0, -17e3, 0.0, NM)
        for i in range(3):
            for _ in range(ticks):
                e.predict(10.0 / ticks)
            e.update(51e3 - 3.9e3 * i, 2037.0 * (i + 1), -17e3, bearing_rad=0.3 + 0.03 * i, datalink=None)
        e.predict(1.5)
        return e

    a, b = run(1000), run(1)
    assert a.mean == pytest.approx(b.mean, rel=1e-9, abs=1e-6)
    assert a.covariance == pytest.approx(b.covariance, rel=1e-6, abs=1e-6)
    assert a.out.age_s == pytest.approx(1.5) and a.out.updates == 4
    w, mean, cov = a.components()
    assert w.sum() == pytest.approx(1.0) and mean.shape == (len(w), 2) and cov.shape == (len(w), 2, 2)
    keep = a.get_state()
    was = a.mean
    a.predict(3.0)
    a.update(30e3, 9e3, -17e3, age_s=1.0, datalink=(3e4, 100.0))
    assert a.out.age_s == pytest.approx(1.0)
    c = RangeEstimator(p, 5.0, 20.0)
    c.set_state(keep)
    assert c.mean == was and c.out.updates == 4
    assert not c.update(math.nan, 0.0, 0.0) and not c.update(None, 0.0, 0.0)
    assert all(map(math.isfinite, c.mean))


def test_gate_refuses_a_wild_range_and_the_window_warns_of_a_steady_one() -> None:
    p = RendezvousNavParams(estimator="bank", components=9, gate_nis=36.0)
    e = RangeEstimator(p)
    e.start(55e3, 0.0, -17e3, 0.0, NM)
    e.predict(10.0)
    before = e.mean
    assert not e.update(20e3, 2037.0, -17e3) and e.out.refused == 1
    assert e.mean == pytest.approx(before)
    for i in range(8):
        e.predict(10.0)
        e.update(47e3 - 3.0e3 * i, 2037.0 * (i + 2), -17e3)
    assert e.out.alarm


def test_bad_first_range_is_refused_with_a_reason() -> None:
    e = RangeEstimator(P0)
    for d in (math.nan, math.inf, 10.0):
        e.start(d, 0.0, 0.0, 0.0, NM)
        assert not e.out.valid and "refused" in e.out.reason


def test_nominal_velocity_holds_the_track() -> None:
    u, delta = nominal_velocity(P0, 12.0, 30.0)
    assert P0.receiver_mps * math.sin(delta) == pytest.approx(30.0, rel=1e-12)
    assert u == pytest.approx(12.0 - math.sqrt(P0.receiver_mps**2 - 900.0), rel=1e-12)
