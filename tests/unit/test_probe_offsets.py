"""Probes with errors of their own: what a filter learns of them beside a known position, what another makes of that, and how a
prediction left alone grows less certain."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsw.filters.correction import state_update
from flightsw.missions.receiver.airdata import iekf as kf
from flightsw.missions.receiver.airdata import state as k
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_filter import WakePosition
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector
from hil_scripts.studies.sevil.flight import Conditions, fly_air
from tests.unit.wake_flight import AC, CONTACT, predict

DEG = math.radians(1.0)
P = WakePositionParams(offset_V=0.3, offset_flow=0.1 * DEG, q_offset_V=0.003, q_offset_flow=1e-3 * DEG, aid_slow_m=0.1)
ALL = 0b111111111
SHORT = Conditions(legs_s=(30.0, 20.0, 40.0, 30.0, 60.0))
PROBES = np.array([(6.0, 0.0, 0.0), (1.5, -5.4, 0.2), (1.5, 5.4, 0.2)])
R = [c for c in range(k.N) if c not in k.TAUGHT]


def filter_at(seed: int) -> tuple[np.ndarray, np.ndarray]:
    r = np.random.default_rng(seed)
    s = np.array(
        [0.5, 0.5, 0.1, 0.1, 0.1, 0.3, 0.2, *[0.4] * 6, 0.02, 0.02, 0.5, *[0.3] * 3, *[2e-3] * 6, 0.1, 0.1, 0.02]
    )
    A = r.normal(size=(k.N, k.N)) * s[:, None]
    x = np.array([0.2, 8.4, *r.normal(size=k.N - 2) * 0.1 * s[2:]])
    return x, A @ A.T / k.N + np.diag(s * s)


def test_slopes_of_the_readings_are_those_of_finite_differences() -> None:
    x, _ = filter_at(1)
    g = np.array([-36.0, 0.1, 0.01, 0.05, -0.01, 0.01, 0.02, 0.01, 195.0, 0.59, 0.0])
    wk, h, H, n = wake_vector(WakeParams()), np.zeros(9), np.zeros((9, k.N)), np.zeros((9, k.N))
    k.linearise(x, g, PROBES, wk, h, H)
    for j in range(k.N):
        step = 1e-6 if j in range(k.X_OFF, k.X_AID) else 1e-4
        up, down = x.copy(), x.copy()
        up[j] += step
        down[j] -= step
        a, b = np.zeros(9), np.zeros(9)
        k.linearise(up, g, PROBES, wk, a, n)
        k.linearise(down, g, PROBES, wk, b, n)
        assert np.allclose(H[:, j], (a - b) / (2.0 * step), rtol=1e-4, atol=1e-8), j


def test_what_is_considered_keeps_its_value_and_its_uncertainty_counts() -> None:
    x, C = filter_at(2)
    fixed = np.zeros(k.N, dtype=np.int64)
    fixed[k.TAUGHT] = 1
    free_x, free_C, K, row = x.copy(), C.copy(), np.zeros(k.N), np.zeros(k.N)
    a, A = x.copy(), C.copy()
    assert state_update(a, A, 0, 25, 0.6, 0.04, 25.0, fixed, K, row) == pytest.approx(
        state_update(free_x, free_C, 0, 25, 0.6, 0.04, 25.0, np.zeros_like(fixed), K, row)
    )
    H = np.zeros(k.N)
    H[[0, 25]] = 1.0
    s = H @ C @ H + 0.04
    gain = C @ H / s
    assert np.allclose(free_x, x + gain * (0.6 - x[0] - x[25])) and np.allclose(free_C, C - np.outer(gain, gain) * s)
    gain[k.TAUGHT] = 0.0
    J = np.eye(k.N) - np.outer(gain, H)
    assert np.allclose(a, x + gain * (0.6 - x[0] - x[25])) and np.allclose(A, J @ C @ J.T + 0.04 * np.outer(gain, gain))
    assert np.array_equal(a[k.TAUGHT], x[k.TAUGHT])


def test_readings_leave_considered_states_alone() -> None:
    x, C = filter_at(3)
    g = np.array([-36.0, 0.1, 0.01, 0.05, -0.01, 0.01, 0.02, 0.01, 195.0, 0.59, 0.0])
    wk, e, S = wake_vector(WakeParams()), np.zeros(9), np.zeros((9, 9))
    kf.foresee(x, C, g, 3e-4, PROBES, wk, e, S)
    fixed, own = np.zeros(k.N, dtype=np.int64), np.diag([0.01] * 3 + [1e-6] * 6)
    fixed[k.TAUGHT] = 1
    y = e + np.array([0.3, -0.2, 0.1, *[1e-3, -1e-3, 0.0] * 2])
    sig, ok, out = np.array([0.447, 7.8e-4, 7.8e-4]), np.ones(9, dtype=np.int64), np.zeros(2)
    a, A = x.copy(), C.copy()
    assert kf.correct(a, A, y, ok, sig, g, 3e-4, PROBES, wk, 3, 10.0, 1e9, fixed, own, out) == kf.OK
    h, H = np.zeros(9), np.zeros((9, k.N))
    k.linearise(x, g, PROBES, wk, h, H)
    N = np.diag(np.repeat(sig, 3) ** 2) + own
    for v in (3, 6):
        N[v : v + 3, v : v + 3] += 3e-4**2
    K = C @ H.T @ np.linalg.inv(H @ C @ H.T + N)
    K[k.TAUGHT] = 0.0
    J = np.eye(k.N) - K @ H
    assert np.allclose(a, x + K @ (y - h), rtol=0, atol=1e-9) and np.allclose(A, J @ C @ J.T + K @ N @ K.T, atol=1e-11)


def test_what_another_filter_learnt_moves_the_rest_as_it_depends_on_it() -> None:
    """Against the joint Gaussian: the taught states measured, exactly so much better than they are known."""
    x, C = filter_at(4)
    T = k.TAUGHT
    A = C[np.ix_(T, T)]
    H = np.random.default_rng(5).normal(size=(12, 12))
    noise = np.diag(np.diag(H @ A @ H.T))
    K = A @ H.T @ np.linalg.inv(H @ A @ H.T + noise)
    what, new = x[T] + K @ np.random.default_rng(6).normal(size=12) * 0.01, A - K @ H @ A
    a, B = x.copy(), C.copy()
    k.be_taught(a, B, what, new)
    X = C[np.ix_(R, T)] @ np.linalg.inv(A)
    assert np.allclose(a[T], what) and np.allclose(B[np.ix_(T, T)], new)
    assert np.allclose(a[R], x[R] + X @ (what - x[T]), rtol=0, atol=1e-9)
    assert np.allclose(B[np.ix_(R, T)], X @ new, rtol=0, atol=1e-9)
    assert np.allclose(B[np.ix_(R, R)], C[np.ix_(R, R)] - X @ (A - new) @ X.T, rtol=0, atol=1e-9)
    assert np.linalg.eigvalsh(B).min() > -1e-12
    none = np.zeros((k.N, k.N))
    none[np.ix_(R, R)] = C[np.ix_(R, R)]
    k.be_taught(a, none, what, new)  # what was certain so far has moved nothing
    assert np.allclose(none[np.ix_(R, R)], C[np.ix_(R, R)]) and not none[np.ix_(R, T)].any()


def flown(
    seed: int, lost_s: float = 0.0, params: WakePositionParams = P
) -> tuple[np.ndarray, np.ndarray, WakePosition]:
    """Errors [n,2] and covariances [n,2,2] at contact of the filter that goes by air data and what it is taught; the teacher
    knows the position to 0.5 m white and 0.1 m fixed, but in the last lost_s."""
    d = fly_air(SHORT, seed)
    g = np.random.default_rng(1000 + seed)
    d.readings[:, :3] += 0.3 * g.standard_normal(3)
    d.readings[:, 3:] += 0.1 * DEG * g.standard_normal(6)
    off, last = 0.1 * g.standard_normal(2), len(d.t) - round(20 * lost_s)
    learn, wake = (
        WakePosition(AC, params, WakeParams()),
        WakePosition(AC, replace(params, scales=False, height=False), WakeParams()),
    )
    wake.consider(True)
    for est in (learn, wake):
        est.seed(float(d.guess[0]), float(d.guess[1]), 5.0)
    error, cov = [], []
    for i in range(len(d.t)):
        for est in (learn, wake):
            predict(est, d, i)
        if i < last:
            y, z = d.xi[i, 1:] + off + 0.5 * g.standard_normal(2)
            learn.aid((float(y), float(z)), (0.5, 0.5))
        else:
            learn.consider(True)
            learn.drift(0.01, 2e-5, 0.05 * (i - last), 0.05)
        wake.learn_from(learn)
        learn.update(d.readings[i], ALL)
        fix = wake.update(d.readings[i], ALL)
        if d.leg[i] == CONTACT:
            error.append(np.array(fix.pos_f[1:]) - d.xi[i, 1:])
            cov.append([[fix.cov_yy, fix.cov_yz], [fix.cov_yz, fix.cov_zz]])
    return np.array(error), np.array(cov), learn


def test_offsets_are_learnt_beside_a_known_position_and_the_other_filter_is_as_sure_as_it_may_be() -> None:
    """Radial RMS at contact 0.45 m, NEES of 2 dof within 1 to 3 over six flights; offsets against each other to a third."""
    nees, rms = [], []
    for seed in range(6):
        e, C, learn = flown(seed)
        nees.append(float(np.mean(np.einsum("ni,nij,nj->n", e, np.linalg.inv(C), e))))
        rms.append(float(np.sqrt(np.mean(np.sum(e * e, axis=1)))))
        flow = learn.P[k.X_OFF + 3 : k.X_AID, k.X_OFF + 3 : k.X_AID]
        part = flow[0, 0] + flow[1, 1] - 2.0 * flow[0, 1]
        assert math.sqrt(part) < 0.7 * math.sqrt(2.0) * 0.1 * DEG
    assert float(np.sqrt(np.mean(np.square(rms)))) <= 0.45
    assert 1.0 <= float(np.mean(nees)) <= 3.0


def test_a_prediction_left_alone_grows_less_certain() -> None:
    _, C, _ = flown(1, lost_s=30.0)
    sigma = np.sqrt(C[:, 0, 0] + C[:, 1, 1])
    assert sigma[-1] > 1.5 * sigma[-30 * 20 - 1]
