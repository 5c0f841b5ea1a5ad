"""Control design: discretisation with delay, Riccati solution, gain schedule, closed loops of all nominals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver import station_keeping
from flightsw.missions.receiver.station_keeping import ReceiverControl, ReceiverCtrlParams
from flightsw.sixdof import autopilot
from flightsw.sixdof.autopilot import TankerControl, TankerCtrlParams
from flightsw.sixdof.command import ScheduleParams
from flightsw.sixdof.lqr import DesignError, augment, design, discretise
from flightsw.sixdof.schedule import GainSchedule, blended, scheduled, shares, weights

repeatable = settings(deadline=None, derandomize=True)
YD = np.radians([-1.7, 0.0, 1.7])
VN = np.array([180.0, 200.0])
T = 0.05


def lagrange(psi_dot: float, V: float) -> np.ndarray:
    w = np.zeros(6)
    weights(psi_dot, V, YD, VN, w)
    return w


# --- weights (lee.md 3.4) ------------------------------------------------------------------------------------------
@repeatable
@given(st.floats(-0.1, 0.1), st.floats(100.0, 300.0))
def test_weights_sum_to_one_everywhere(psi_dot: float, V: float) -> None:
    assert abs(lagrange(psi_dot, V).sum() - 1.0) < 1e-14


@pytest.mark.parametrize("i", range(3))
@pytest.mark.parametrize("j", range(2))
def test_weights_are_cardinal_at_the_nodes(i: int, j: int) -> None:
    want = np.zeros(6)
    want[2 * i + j] = 1.0
    assert np.abs(lagrange(YD[i], VN[j]) - want).max() < 1e-15


@repeatable
@given(st.floats(YD[0], YD[2]), st.floats(180.0, 200.0))
def test_weights_reproduce_what_is_quadratic_in_turn_rate_and_linear_in_speed(psi_dot: float, V: float) -> None:
    def f(y: float, v: float) -> float:
        return (3.0 - 40.0 * y + 900.0 * y * y) * (1.0 + 0.02 * v)

    nodes = np.array([f(y, v) for y in YD for v in VN])
    assert lagrange(psi_dot, V) @ nodes == pytest.approx(f(psi_dot, V), rel=1e-12)


@pytest.mark.parametrize(("y", "v", "node"), [(-1.0, 100.0, 0), (-1.0, 300.0, 1), (1.0, 100.0, 4), (1.0, 300.0, 5)])
def test_weights_are_held_outside_the_nodes(y: float, v: float, node: int) -> None:
    """The quadratic would give weights of several units at twice the node range."""
    assert np.abs(lagrange(y, v) - np.eye(6)[node]).max() < 1e-15


# --- discretisation ------------------------------------------------------------------------------------------------
def example() -> tuple[np.ndarray, np.ndarray]:
    """A stiff oscillator with an integrator, two inputs."""
    rng = np.random.default_rng(2)
    A = np.array([[0, 1, 0, 0], [-225, -21, 0, 0], [0.3, 0.1, -0.4, 0], [0, 0, 1, 0]], dtype=float)
    return A, rng.normal(size=(4, 2))


def test_without_delay_discretisation_is_scipys_zero_order_hold() -> None:
    A, B = example()
    phi, new, old = discretise(A, B, T, 0.0)
    want, wantB, *_ = cont2discrete((A, B, np.eye(4), np.zeros((4, 2))), T, "zoh")
    assert np.allclose(phi, want, atol=1e-13) and np.allclose(new, wantB, atol=1e-13)
    assert not old.any()


def test_a_whole_period_of_delay_moves_the_input_to_the_previous_sample() -> None:
    A, B = example()
    _, new, old = discretise(A, B, T, T)
    assert np.abs(new).max() < 1e-15
    assert np.allclose(old, discretise(A, B, T, 0.0)[1], atol=1e-13)


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.015, 0.03, 0.05])
def test_delayed_discretisation_is_what_a_simulation_of_the_late_input_gives(delay: float) -> None:
    A, B = example()
    phi, new, old = discretise(A, B, T, delay)
    rng, x = np.random.default_rng(5), np.array([0.1, -0.3, 0.2, 1.0])
    u_old = rng.normal(size=2)
    for _ in range(4):
        u_new, y = rng.normal(size=2), x.copy()
        for u, span in ((u_old, delay), (u_new, T - delay)):
            if span > 0:
                kw = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
                y = solve_ivp(lambda t, s, u=u: A @ s + B @ u, (0, span), y, **kw).y[:, -1]
        x = phi @ x + new @ u_new + old @ u_old
        assert np.allclose(x, y, rtol=1e-9, atol=1e-11)
        u_old = u_new


@pytest.mark.parametrize("delay", [-0.001, 0.0501])
def test_a_delay_outside_one_period_is_refused(delay: float) -> None:
    A, B = example()
    with pytest.raises(ValueError, match=r"allowed 0 to one control period"):
        discretise(A, B, T, delay)


def test_augmented_model_holds_servo_engine_and_integrals() -> None:
    """Transfer functions at one frequency, worked out by hand: command -> servo -> state, thrust lag, integral."""
    ac = load_aircraft("learjet24")
    rng = np.random.default_rng(0)
    A, B, C, D = -np.eye(2), rng.normal(size=(2, 4)), rng.normal(size=(1, 2)), rng.normal(size=(1, 4))
    Aa, Ba = augment(A, B, C, D, ac)
    s = 1j * 3.0
    X = np.linalg.solve(s * np.eye(len(Aa)) - Aa, Ba)
    wn, z, tau = ac.controls.servo_wn_radps, ac.controls.servo_zeta, ac.engine.tau_s
    act = np.diag([*[wn**2 / (s * s + 2 * z * wn * s + wn**2)] * 3, 1 / (tau * s + 1)])
    x = np.linalg.solve(s * np.eye(2) - A, B @ act)
    assert np.allclose(X[:2], x)
    assert np.allclose(X[2:5], act[:3])
    assert np.allclose(X[5:8], s * act[:3])
    assert np.allclose(X[8], act[3])
    assert np.allclose(X[9:], (C @ x + D @ act) / s)


# --- Riccati -------------------------------------------------------------------------------------------------------
def small_design() -> tuple[np.ndarray, ...]:
    A, B = example()
    A, B = np.pad(A, (0, 0)), np.hstack((B, B[:, ::-1]))
    q, r = np.array([1.0, 0.1, 2.0, 3.0]), np.array([1.0, 2.0, 0.5, 1.5])
    return A, B, q, r


def test_lqr_gain_satisfies_the_cost_identity() -> None:
    """x0' P x0 with scipy's P is the cost the closed loop really accumulates, and no nearby gain is cheaper."""
    A, B, q, r = small_design()
    d = design(A, B, T, 0.015, q, r, np.zeros(4), np.zeros(4), "example")
    phi, new, old = discretise(A, B, T, 0.015)
    Ad, Bd = np.block([[phi, old], [np.zeros((4, 8))]]), np.vstack((new, np.eye(4)))
    Q, R = np.diag([*q, *[1e-9] * 4]), np.diag(r)
    P = solve_discrete_are(Ad, Bd, Q, R)
    x0 = np.array([1.0, -2.0, 0.5, 1.0, 0.1, 0.0, -0.1, 0.2])

    def cost(K: np.ndarray) -> float:
        x, total = x0, 0.0
        for _ in range(6000):
            u = -K @ x
            total += float(x @ Q @ x + u @ R @ u)
            x = Ad @ x + Bd @ u
        return total

    best = cost(d.K)
    assert best == pytest.approx(float(x0 @ P @ x0), rel=1e-9)
    rng = np.random.default_rng(1)
    assert all(cost(d.K + 1e-3 * rng.normal(size=d.K.shape)) > best for _ in range(5))
    assert d.radius == pytest.approx(np.abs(np.linalg.eigvals(Ad - Bd @ d.K)).max(), rel=1e-9)
    assert d.radius < 1.0


def test_an_undamped_state_outside_the_cost_is_refused_by_name() -> None:
    """lee.md trap 9: heading and horizontal position have no place in the design."""
    A, B, q, r = small_design()
    A = np.pad(A, ((0, 1), (0, 1)))  # an integrator nobody can move
    with pytest.raises(DesignError, match=r"the case in hand"):
        design(
            A, np.pad(B, ((0, 1), (0, 0))), T, 0.0, np.append(q, 0.0), r, np.zeros(5), np.zeros(4), "the case in hand"
        )


# --- the six nominals of both aircraft -----------------------------------------------------------------------------
@pytest.fixture(scope="module")
def laws() -> dict[str, GainSchedule]:
    tan, rec = load_aircraft("kc135r"), load_aircraft("learjet24")
    captured: dict[str, GainSchedule] = {}
    captured["tanker"] = TankerControl(tan, TankerCtrlParams(ScheduleParams()), T).sched
    captured["receiver"] = ReceiverControl(rec, tan, ReceiverCtrlParams(ScheduleParams(mass_kg=5300.0)), T).sched
    return captured


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_schedule_has_six_finite_laws_in_the_works_order(laws: dict[str, GainSchedule], who: str) -> None:
    s = laws[who]
    assert s.K.shape == (6, 4, s.nz) and np.isfinite(s.K).all()
    # thrust grows with bank at the same speed, and the two turns mirror each other
    thrust = s.u0[:, 3]
    assert thrust[0] > thrust[2] and thrust[4] > thrust[2]
    if who == "tanker":
        assert thrust[0] == pytest.approx(thrust[4], rel=1e-6)
        assert s.u0[[0, 1], 0] == pytest.approx(-s.u0[[4, 5], 0], abs=1e-7)


def test_shares_make_up_the_command_and_each_is_what_it_is_called(laws: dict[str, GainSchedule]) -> None:
    s, rng = laws["receiver"], np.random.default_rng(5)
    s.set_condition(0.01, 190.0)
    z, off = s.w @ s.z0 + rng.normal(size=s.nz) * 0.01, np.zeros(s.nz)
    integrals = slice(19, 22)
    u, parts, less = np.zeros(4), np.zeros((3, 4)), np.zeros((3, 4))
    scheduled(s.K, s.z0, s.u0, s.w, z, off, u)
    shares(s.K, s.z0, s.u0, s.w, z, off, integrals.start, integrals.stop, parts)
    assert parts.sum(axis=0) == pytest.approx(u, rel=1e-9, abs=1e-9)
    assert parts[2] == pytest.approx(s.w @ s.u0)
    moved = z.copy()
    moved[integrals] = (
        0.0  # the nominals have no integral: without it nothing of that part is left, and the feedback stays
    )
    shares(s.K, s.z0, s.u0, s.w, moved, off, integrals.start, integrals.stop, less)
    assert less[0] == pytest.approx(parts[0])
    assert np.abs(less[1]).max() == 0.0 < np.abs(parts[1]).max()


def test_between_two_schedules_the_command_is_in_a_straight_line(laws: dict[str, GainSchedule]) -> None:
    s, rng = laws["receiver"], np.random.default_rng(6)
    z, off, u, parts = (
        s.z0[2] + rng.normal(size=s.nz) * 0.01,
        np.zeros(s.nz),
        rng.normal(size=4),
        rng.normal(size=(3, 4)),
    )
    own, own_parts = np.zeros(4), np.zeros((3, 4))
    s.set_condition(-0.02, 195.0)
    scheduled(s.K, s.z0, s.u0, s.w, z, off, own)
    shares(s.K, s.z0, s.u0, s.w, z, off, 19, 22, own_parts)
    wanted = u + 0.3 * (own - u), parts + 0.3 * (own_parts - parts)
    blended(-0.02, 195.0, *s.tables(), z, off, 19, 22, 0.3, u, parts)
    assert (u == wanted[0]).all() and (parts == wanted[1]).all()


@pytest.mark.parametrize("who", ["tanker", "receiver"])
@pytest.mark.parametrize("node", range(6))
def test_every_nominal_closed_loop_is_stable(who: str, node: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sampled, delayed loop is rebuilt here from the linear model the design was given; nothing of the law is
    reused.
    """
    import flightsw.missions.receiver.station_keeping as receiver
    import flightsw.sixdof.autopilot as tanker

    seen: list[tuple] = []

    def record(A, B, period, delay, q, r, z0, u0, what):  # type: ignore[no-untyped-def]
        d = design(A, B, period, delay, q, r, z0, u0, what)
        seen.append((A, B, period, delay, d))
        return d

    monkeypatch.setattr(tanker if who == "tanker" else receiver, "design", record)
    s = ScheduleParams(psi_dot_degps=(-1.7, 0.0, 1.7)) if who == "tanker" else ScheduleParams(mass_kg=5300.0)
    yd, V = math.radians(s.psi_dot_degps[node // 2]), s.V_mps[node % 2]
    tan, rec = load_aircraft("kc135r"), load_aircraft("learjet24")
    if who == "tanker":
        law = object.__new__(TankerControl)
        law.p = autopilot.sized(tan, TankerCtrlParams(s))
        law._design(tan, yd, V, T)
    else:
        other = object.__new__(ReceiverControl)
        other.p = station_keeping.sized(rec, tan, ReceiverCtrlParams(s))
        p = other.p
        other._design(rec, tan, yd, V, T, (p.w_pos_m, p.w_int_ms, p.w_input))
    A, B, period, delay, d = seen[0]
    nz = len(A)
    # fine brute-force sampling of the late input: 200 explicit sub-intervals of the matrix exponential
    phi, new, _ = discretise(A, B, period / 200, 0.0)
    k = round(200 * delay / period)
    x, u_part = np.eye(nz), np.zeros((nz, 4))
    g_old, g_new = u_part.copy(), u_part.copy()
    for i in range(200):
        x, g_old, g_new = phi @ x, phi @ g_old, phi @ g_new
        if i < k:
            g_old = g_old + new
        else:
            g_new = g_new + new
    Ad, Bd = np.block([[x, g_old], [np.zeros((4, nz + 4))]]), np.vstack((g_new, np.eye(4)))
    radius = np.abs(np.linalg.eigvals(Ad - Bd @ d.K)).max()
    assert radius < 1.0
    assert radius == pytest.approx(d.radius, abs=1e-6)
