"""What the onboard software believes of its actuators, and the probe average, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.actuators import ActuatorModel, servo_step, surface_limits
from flightsw.sixdof.measure import average_probes

repeatable = settings(deadline=None, derandomize=True)
DT = 0.01
WIDE = np.array([[-9.0, 9.0, 99.0]] * 3)


@pytest.mark.parametrize(("wn", "zeta"), [(15.0, 0.7), (20.0, 0.7)])
def test_servo_follows_the_second_order_step_response(wn: float, zeta: float) -> None:
    """Sub-stepped integration against the closed form: 3 % of the step while it moves, 1e-6 once it has settled."""
    pos, rate, cmd = np.zeros(3), np.zeros(3), np.array([0.1, -0.05, 0.02])
    wd, out = wn * math.sqrt(1 - zeta**2), []
    for _ in range(150):
        servo_step(pos, rate, cmd, WIDE, wn, zeta, DT)
        out.append(pos / cmd)
    t = DT * np.arange(1, 151)
    exact = 1 - np.exp(-zeta * wn * t) * (np.cos(wd * t) + zeta * wn / wd * np.sin(wd * t))
    assert np.abs(np.array(out) - exact[:, None]).max() < 0.03
    assert np.abs(out[-1] - 1.0).max() < 1e-5


@pytest.mark.parametrize("name", ["kc135r", "learjet24"])
@repeatable
@given(st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=20))
def test_servo_never_leaves_travel_or_rate_limits(name: str, commands: list[float]) -> None:
    ac = load_aircraft(name)
    lim, pos, rate = surface_limits(ac), np.zeros(3), np.zeros(3)
    for c in commands:
        before = pos.copy()
        for _ in range(10):
            servo_step(pos, rate, np.array([c, -c, c]), lim, ac.controls.servo_wn_radps, ac.controls.servo_zeta, DT)
            assert (pos >= lim[:, 0]).all() and (pos <= lim[:, 1]).all()
        assert (np.abs(pos - before) <= lim[:, 2] * 10 * DT * (1 + 1e-12)).all()


def test_limits_are_the_aircraft_files_in_the_order_aileron_elevator_rudder() -> None:
    want = np.radians([[-20, 20, 40], [-25, 15, 30], [-25, 25, 40]])
    assert np.allclose(surface_limits(load_aircraft("kc135r")), want)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_command_reaches_the_actuators_after_the_link_delay(delay: int) -> None:
    act = ActuatorModel(load_aircraft("learjet24"), delay)
    act.reset(np.zeros(3), 5000.0)
    u = np.array([0.05, 0.02, -0.03, 6000.0])
    for k in range(delay + 2):
        moved = np.abs(act.pos).max() > 0 or act.thrust != 5000.0
        assert moved == (k > delay), f"after {k} ticks"
        act.step(u, DT)


def test_thrust_follows_the_first_order_lag_exactly() -> None:
    ac = load_aircraft("kc135r")
    act = ActuatorModel(ac, 0)
    act.reset(np.zeros(3), 50e3)
    for k in range(1, 301):
        act.step(np.array([0.0, 0.0, 0.0, 90e3]), DT)
        assert act.thrust == pytest.approx(90e3 - 40e3 * math.exp(-k * DT / ac.engine.tau_s), rel=1e-12)


def test_mean_is_the_time_average_of_what_acted_and_starts_again() -> None:
    act = ActuatorModel(load_aircraft("learjet24"), 1)
    act.reset(np.array([0.01, 0.02, 0.03]), 5000.0)
    assert np.allclose(act.take_mean(), [0.01, 0.02, 0.03, 5000.0])
    path = [np.append(act.pos.copy(), act.thrust)]
    for k in range(5):
        act.step(np.array([0.05 * k, -0.02, 0.0, 7000.0]), DT)
        path.append(np.append(act.pos.copy(), act.thrust))
    p = np.array(path)
    assert np.allclose(act.take_mean(), (0.5 * (p[1:] + p[:-1])).mean(axis=0), rtol=1e-13)
    act.step(np.array([0.2, -0.02, 0.0, 7000.0]), DT)
    last = np.append(act.pos.copy(), act.thrust)
    assert np.allclose(act.take_mean(), 0.5 * (p[-1] + last), rtol=1e-13)


# --- probes ----------------------------------------------------------------------------------------------------------
def readings(u_a: np.ndarray, w: np.ndarray, pos: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What ideal probes at pos [N,3] of a body with rates w in uniform air show: V, alpha, beta [N]."""
    u = u_a + np.cross(w, pos)
    V = np.linalg.norm(u, axis=1)
    return V, np.arctan2(u[:, 2], u[:, 0]), np.arcsin(u[:, 1] / V)


@repeatable
@given(
    st.floats(120, 240),
    st.floats(-0.2, 0.3),
    st.floats(-0.2, 0.2),
    st.tuples(*[st.floats(-0.5, 0.5)] * 3),
    st.integers(1, 7),
)
def test_probe_average_takes_the_rotation_off_exactly(
    V: float, alpha: float, beta: float, rates: tuple[float, float, float], mask: int
) -> None:
    pos = np.array([p.position_m for p in load_aircraft("learjet24").probe])
    w = np.array(rates)
    u_a = V * np.array([math.cos(alpha) * math.cos(beta), math.sin(beta), math.sin(alpha) * math.cos(beta)])
    ok = np.array([(mask >> i) & 1 for i in range(3)], dtype=np.int64)
    Vs, al, be = readings(u_a, w, pos)
    Vs[ok == 0] = np.nan  # a probe that is out must not be read
    out = np.zeros(3)
    assert average_probes(Vs, al, be, ok, pos, w, out) == ok.sum()
    assert np.abs(out - [V, beta, alpha]).max() < 1e-11


def test_no_probe_left_changes_nothing() -> None:
    out = np.array([1.0, 2.0, 3.0])
    pos = np.zeros((2, 3))
    bad = np.full(2, np.nan)
    assert average_probes(bad, bad, bad, np.zeros(2, dtype=np.int64), pos, np.zeros(3), out) == 0
    assert (out == [1.0, 2.0, 3.0]).all()
