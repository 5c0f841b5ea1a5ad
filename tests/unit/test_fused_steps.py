"""Steps that were several calls of numpy and are one compiled call, or plain Python, against numpy's own arithmetic."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.filters.covariance import gain
from flightsw.filters.srukf import draw
from flightsw.kernels.atmosphere import G0, sound_speed
from flightsw.kernels.linalg import backward_sub_t, forward_sub, tria
from flightsw.kernels.rotations import dcm_from_quat, turn
from flightsw.missions.receiver.integrity import kernel
from flightsw.missions.receiver.integrity.layout import AB, NB, ROWS, D, U
from flightsw.sixdof.actuators import between, surface_limits, thrust_available
from flightsw.sixdof.command import cut
from flightsw.sixdof.estimator_core import fill_noise, sane
from flightsw.sixdof.layout import NX, X_X
from flightsw.sixdof.motion import air_velocity, propagate_free, propagate_relative
from flightsw.sixdof.params import parameter_vector
from flightsw.sixdof.recovery.answer_kernel import explained, learn, numbers, swinging, unexplained
from flightsw.sixdof.recovery.motion import AGE, BY_GYRO, BY_REFERENCE, STATE, TURNED, angle, carry
from flightsw.sixdof.recovery.motion import gain as gained
from flightsw.sixdof.recovery.readings_kernel import AHEAD, ALPHA, BELOW, BETA, DOWN, FORWARD, MOTION, SPEED

X = st.floats(-1e4, 1e4)


@given(st.lists(st.integers(-50_000, 50_000), min_size=2, max_size=8, unique=True), st.data())
@settings(max_examples=300, deadline=None)
def test_a_straight_line_between_points_is_numpys_to_the_bit(places: list[int], data: st.DataObject) -> None:
    """Points as tables have them: no slope between two overflows."""
    xs = [k / 7.0 for k in sorted(places)]
    ys = data.draw(st.lists(X, min_size=len(xs), max_size=len(xs)))
    for x in (*xs, data.draw(st.floats(-2e4, 2e4)), data.draw(st.floats(xs[0], xs[-1])), math.inf, -math.inf):
        assert between(x, xs, ys) == float(np.interp(x, xs, ys))
    assert math.isnan(between(math.nan, xs, ys))


def test_thrust_of_a_table_is_interpolated_row_by_row() -> None:
    """Beyond the table's ends too."""
    ac = load_aircraft("learjet24")
    e, r = ac.engine, np.random.default_rng(1)
    assert e.lapse != "bypass"
    for h, V in zip(r.uniform(-500.0, 16e3, 300).tolist(), r.uniform(0.0, 400.0, 300).tolist(), strict=True):
        rows = [np.interp(h, e.lapse_h_m, row) for row in e.lapse_frac]
        wanted = e.static_thrust_N * float(np.interp(V / sound_speed(h), e.lapse_mach, rows))
        assert thrust_available(ac, h, V) == wanted


def test_rows_are_those_of_the_state_before() -> None:
    """H of the state at the sample is H times the transition matrix from before; noise and readings along with it."""
    r, tau, grown = np.random.default_rng(2), 0.35, 0.04
    H, y, var = r.normal(size=(ROWS, NB)), r.normal(size=ROWS), r.uniform(1.0, 2.0, ROWS)
    moved, faster = r.normal(size=3), r.normal(size=3)
    H0, y0, r0 = np.empty_like(H), np.empty(ROWS), np.empty(ROWS)
    kernel.ahead(H, y, var, tau, *moved, *faster, grown, H0, y0, r0)
    phi, eye = np.eye(NB), np.eye(3)
    phi[D, U], phi[D, AB], phi[U, AB] = tau * eye, 0.5 * tau * tau * eye, tau * eye
    np.testing.assert_allclose(H0, H @ phi, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(y0, y - H[:, D] @ moved - H[:, U] @ faster, rtol=1e-12, atol=1e-13)
    wander = np.diag(H[:, D] @ H[:, D].T) * tau**2 / 3.0 + np.diag(H[:, U] @ H[:, U].T)
    np.testing.assert_allclose(r0, var + grown * wander, rtol=1e-13)


def test_filters_are_as_far_apart_as_their_positions() -> None:
    r, M = np.random.default_rng(3), 5
    states, place = r.normal(size=(M, NB)), r.normal(size=(3, NB))
    roots = r.normal(size=(M, NB, NB))
    P = np.array([root @ root.T for root in roots])
    P[1:] += P[0]  # a filter that hears less knows less
    z, off, sigma = np.zeros(M), np.zeros((M, 3)), np.zeros((M, 3))
    kernel.spread(states, P, place, 0.3, z, off, sigma)
    var = np.array([np.diag(place @ p @ place.T) for p in P])
    np.testing.assert_allclose(off, np.abs((states - states[0]) @ place.T), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(sigma, np.sqrt(var + 0.3), rtol=1e-12)
    np.testing.assert_allclose(z[1:], (off / np.sqrt(np.maximum(var - var[0], 1e-4 * var)))[1:].max(axis=1), rtol=1e-10)
    assert z[0] == 0.0 and kernel.sigmas(P[2], place, 0.3) == tuple(sigma[2])


def test_what_lasts_is_learnt_and_missed_thrust_is_not() -> None:
    r = np.random.default_rng(4)
    off, mean, lasting, square = r.normal(size=8), r.normal(size=(2, 8)), r.normal(size=8), r.uniform(size=(2, 8))
    for weak in (False, True):
        a, b = lasting.copy(), square.copy()
        learn(off, mean, 0.1, weak, a, b)
        gone = np.where(weak & (np.arange(8) % 4 == 3), 0.0, off - lasting)
        assert (a == lasting + 0.1 * gone).all() and (b == square + 0.1 * (mean * mean - square)).all()


def test_what_is_believed_explains_nothing_more() -> None:
    r = np.random.default_rng(5)
    x, P, u = r.uniform(0.5, 1.5, MOTION), numbers(load_aircraft("learjet24")), r.normal(size=4)
    whole, rest = np.zeros(8), np.zeros(8)
    explained(x, P, 0.05, whole)
    unexplained(x, P, 0.05, u, rest)
    assert (rest == whole - np.tile(u, 2)).all()


def test_the_incidence_swings_as_the_velocity_turns_in_the_body() -> None:
    """alpha' of a velocity that forces, gravity and rates change, without sideslip; with it, roll makes sideslip of incidence."""
    r = np.random.default_rng(8)
    for _ in range(5):
        x, w, force, down = r.normal(size=MOTION), r.normal(size=3), r.normal(size=3), r.normal(size=3)
        V, alpha, beta, dt = r.uniform(100.0, 200.0), r.uniform(-0.2, 0.4), r.uniform(-0.3, 0.3), 1e-3
        x[: w.size], x[AHEAD : DOWN + 1], x[[FORWARD, BELOW]] = w, force, down[[0, 2]]
        x[[SPEED, ALPHA, BETA]] = V, alpha, 0.0
        v = V * np.array([np.cos(alpha), 0.0, np.sin(alpha)])
        change = (force + G0 * down - np.cross(w, v)) * dt
        (ahead, _, below), (u, _, d) = v + change, v - change
        assert swinging(x) == pytest.approx(
            (np.arctan2(below, ahead) - np.arctan2(d, u)) / (2.0 * dt), rel=1e-4, abs=1e-6
        )
        straight, x[BETA] = swinging(x), beta
        assert swinging(x) - straight == pytest.approx(-w[0] * np.tan(beta), rel=1e-9)


@pytest.mark.parametrize("fresh", [False, True])
def test_both_windows_go_on_as_one_by_one(fresh: bool) -> None:
    r = np.random.default_rng(9)
    own, reference, first, second = r.normal(size=9), r.normal(size=9), r.normal(size=STATE), r.normal(size=STATE)
    q, w, force, dt = r.normal(size=4), r.normal(size=3), r.normal(size=3), 0.05
    first[AGE], second[AGE] = 1.5, -1.0
    was, still = [x.copy() for x in (own, reference, first)], second.copy()
    off, _ = carry(own, True, reference, fresh, *q, first, second, *w, *force, 0.2, dt)
    turn(was[0], *w, dt)
    if fresh:
        dcm_from_quat(q, was[1])
    turn(was[2][:BY_GYRO], *w, dt)
    gained(was[2][:BY_GYRO], force, dt, was[2][BY_GYRO:BY_REFERENCE])
    gained(was[1], force, dt, was[2][BY_REFERENCE:AGE])
    was[2][AGE], was[2][TURNED] = 1.5 + dt, was[2][TURNED] + 0.2 * dt
    assert off == (angle(was[1], was[0]) if fresh else 0.0)
    assert all((a == b).all() for a, b in zip((own, reference, first, second), (*was, still), strict=True))


def test_the_noise_factor_has_diagonal_and_wind() -> None:
    r = np.random.default_rng(6)
    x, R, q = np.zeros(15), np.linalg.qr(r.normal(size=(3, 3)))[0].ravel(), r.uniform(size=15)
    x[:3] = 180.0, 0.02, 0.06
    for correlated in (False, True):
        SQ, J = np.zeros((15, 18)), np.zeros((3, 3))
        fill_noise(SQ, x, R, q, 0.2, 0.05, correlated, J)
        wanted = np.zeros((15, 18))
        wanted[:, :15] = np.diag(q * 0.2)
        wanted[12:, 15:] = 0.05 * np.eye(3)
        # a wind of the size dW changes the velocity through the air by -R dW
        u, step = np.array(air_velocity(*x[:3])), 1e-4
        for j in range(3):
            v = u - step * R.reshape(3, 3)[:, j]
            V = np.linalg.norm(v)
            change = (V - x[0], math.asin(v[1] / V) - x[1], math.atan2(v[2], v[0]) - x[2])
            wanted[:3, 15 + j] = 0.05 * np.array(change) / step if correlated else 0.0
        np.testing.assert_allclose(SQ, wanted, rtol=1e-4, atol=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", ["x", "S"])
def test_a_filter_that_is_not_finite_or_flies_at_no_airspeed_is_not_sane(bad: float, place: str) -> None:
    x, S = np.zeros(15), np.eye(15)
    x[:3] = 180.0, 0.01, 0.05
    assert sane(x, S)
    for i, v in ((0, 19.0), (0, 401.0), (1, 0.7), (2, -0.7)):
        y = x.copy()
        y[i] = v
        assert not sane(y, S)
    (x if place == "x" else S[14])[14] = bad
    assert not sane(x, S)


def test_angle_between_attitudes() -> None:
    """A turn about one axis by as much."""
    for a in (0.0, 1e-3, 0.7, 3.0):
        c, s = math.cos(a), math.sin(a)
        turned = np.array([c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0])
        assert angle(np.eye(3).ravel(), turned) == pytest.approx(a, abs=1e-7)


@pytest.mark.parametrize("n", [1, 3, 4, 6, 15])
def test_rows_side_by_side_are_those_one_by_one(n: int) -> None:
    """A reflection applied to a row by itself, and a system solved for a row by itself, give the same last digit."""
    r, k = np.random.default_rng(5), n + 11
    A, L = r.normal(size=(n, k)), np.zeros((n, n))
    rows = A.tolist()
    tria(A, n, k, L)
    for i, a in enumerate(rows):
        norm = math.sqrt(_sum(x * x for x in a[i:]))
        alpha = -norm if a[i] > 0.0 else norm
        v = [a[i] - alpha, *a[i + 1 :]]
        length = 2.0 * norm * (norm + abs(a[i]))
        for b in rows[i + 1 :]:
            d = 2.0 * _sum(x * y for x, y in zip(v, b[i:], strict=True)) / length
            b[i:] = [y - d * x for x, y in zip(v, b[i:], strict=True)]
        a[i:] = [alpha, *[0.0] * (k - i - 1)]
    assert [[abs(x) for x in row[:n]] for row in rows] == np.abs(L).tolist()
    K = r.normal(size=(n, n))
    one = K.copy()
    gain(K, n, L, n)
    for row in one:
        forward_sub(L, n, row)
        backward_sub_t(L, n, row)
    assert K.tobytes() == one.tobytes()


@pytest.mark.parametrize("behind", [False, True])
def test_points_that_differ_in_place_and_wind_alone_move_as_each_by_itself(behind: bool) -> None:
    """Of the points of a triangular factor, some of whose states are zero: a sign of a zero is a difference."""
    ac, r = load_aircraft("learjet24"), np.random.default_rng(6)
    P, u, W = parameter_vector(ac, 5000.0), np.array([0.01, -0.02, 0.01, 5e3]), np.zeros((5, NX))
    tanker = [np.array([*np.eye(3).ravel(), *r.normal(0.0, 0.02, 6), 195.0, 3.0, 0.0]) for _ in range(3)]
    for still in (0.0, -0.0, 0.01):
        x = np.array([195.0, still, 0.03, *r.normal(0.0, 0.01, 5), still, -59.0, 20.0, 6.0, 5.0, still, 1.0])
        S, X = np.tril(r.normal(0.0, 0.1, (NX, NX))), np.zeros((2 * NX + 1, NX))
        draw(x, S, 3.9, X)
        assert (X[:, :X_X] == x[:X_X]).all(axis=1).sum() == 1 + 2 * (NX - X_X)
        alone = [row[None, :].copy() for row in X]
        for points in (X, *alone):
            if behind:
                propagate_relative(points, u, 0.59, P, np.array(tanker), 0.05, W)
            else:
                propagate_free(points, u, 0.59, P, 0.05, W)
        assert X.tobytes() == np.concatenate(alone).tobytes()


def _sum(terms: Iterable[float]) -> float:
    """One after the other; the built-in keeps what rounding loses."""
    s = 0.0
    for x in terms:
        s += x
    return s


@pytest.mark.parametrize("kept", [1, 3])
def test_a_command_is_cut_and_remembered_or_left_alone(kept: int) -> None:
    r, lim = np.random.default_rng(10), surface_limits(load_aircraft("learjet24"))
    low, high = np.array([*lim[:, 0], 800.0]), np.array([*lim[:, 1], 9e3])
    old, found = r.normal(size=(kept, 4)), set()
    for k in range(200):
        asked = np.array([*r.normal(0.0, 0.15, 3), r.uniform(500.0, 10e3)])
        if k % 20 == 0:
            asked[k // 20 % 4] = (math.nan, math.inf, -math.inf)[k // 20 % 3]
        u, was = asked.copy(), old.copy()
        out = cut(u, lim, 800.0, 9e3, old)
        found.add(out)
        if np.isfinite(asked).all():
            assert (u == np.clip(asked, low, high)).all() and out == (u != asked).any()
            assert (old[0] == u).all() and (old[1:] == was[:-1]).all()
        else:
            assert out == -1 and (old == was).all() and np.array_equal(u, asked, equal_nan=True)
    assert found == {-1, 0, 1}
