"""Thrust in time, and what it and the fuel's place do to the moments: closed forms, statics, and the certification rule."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flightsw.aircraft import load_aircraft
from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.aircraft.sixdof.eom import derivative, step
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.kernels import layout as n

BOTH = pytest.mark.parametrize("name", ["kc135r", "learjet24"])
STILL = np.zeros(n.NW)


def flying(par: np.ndarray, V: float = 195.0, h: float = 7010.0) -> np.ndarray:
    """State [NS] in level flight, slightly sideways."""
    s = np.zeros(n.NS)
    s[0], s[n.S_V], s[n.S_V + 1], s[n.S_V + 2], s[n.S_P + 2] = 1.0, V, 3.0, 5.0, -h
    s[n.S_FUEL] = 0.5 * par[n.P_FUEL_CAP]
    return s


def rise(par: np.ndarray, s: np.ndarray, throttle: float, start: float, seconds: float):
    """Thrust [N] over time from `start` [N], the flight's state held."""

    def rate(t: float, thrust: np.ndarray) -> list[float]:
        x, out = s.copy(), np.zeros(n.N_RIGID)
        x[n.S_T] = thrust[0]
        derivative(x, 0.0, 0.0, 0.0, throttle, STILL, x[n.S_FUEL], par, out)
        return [float(out[n.S_T])]

    return solve_ivp(rate, (0.0, seconds), [start], rtol=1e-9, atol=1e-3, max_step=0.02, dense_output=True).sol


@BOTH
def test_the_spool_rises_by_its_own_exponential_and_within_the_rule(name: str) -> None:
    """dT/dt = s0 Tmax + (s1 - s0) T solved in closed form; 14 CFR 33.73(b): 15 to 95 % of the rated thrust in 5 s at most. The
    rule binds the spool by itself: the tanker's lag of 2.5 s takes 7.1 s alone."""
    full, lag = parameter_vector(load_aircraft(name), full=True), parameter_vector(load_aircraft(name))
    s = flying(full, 70.0, 0.0)
    top = float(rise(lag, s, 1.0, 0.0, 60.0)(60.0)[0])  # without the spool: the lag's end
    at = rise(full, s, 1.0, 0.15 * top, 12.0)
    k, c = full[n.P_SPOOL_1] - full[n.P_SPOOL_0], full[n.P_SPOOL_0] * top / (full[n.P_SPOOL_1] - full[n.P_SPOOL_0])
    t_half = math.log((0.3 * top + c) / (0.15 * top + c)) / k
    assert float(at(t_half)[0]) == pytest.approx(0.3 * top, rel=2e-4)
    t = np.linspace(0.0, 12.0, 1201)
    reached = t[np.argmax(at(t)[0] >= 0.95 * top)]
    assert reached > t[np.argmax(rise(lag, s, 1.0, 0.15 * top, 12.0)(t)[0] >= 0.95 * top)]  # slower than the lag alone
    spool = full.copy()
    spool[n.P_TAU] = 0.02
    assert 1.0 < t[np.argmax(rise(spool, s, 1.0, 0.15 * top, 12.0)(t)[0] >= 0.95 * top)] <= 5.0
    idle = full[n.P_IDLE] * top  # what falls is held by the lag only
    want = idle + (top - idle) * math.exp(-1.0 / full[n.P_TAU])
    assert float(rise(full, s, 0.0, top, 1.0)(1.0)[0]) == pytest.approx(want, rel=1e-5)


@BOTH
def test_without_fuel_the_thrust_runs_down_with_its_lag(name: str) -> None:
    par, c, scratch = parameter_vector(load_aircraft(name)), np.zeros(n.NC), np.zeros((4, n.NS))
    s = flying(par)
    s[n.S_T], c[n.C_THROTTLE] = 0.3 * par[n.P_T0], 0.3
    s[n.S_FUEL] = par[n.P_TSFC] * s[n.S_T] * 0.5  # for half a second, more or less
    dry, thrust = [], []
    for _ in range(300):
        step(s, c, STILL, par, 0.01, scratch)
        dry.append(s[n.S_FUEL] == 0.0)
        thrust.append(s[n.S_T])
    first = dry.index(True)
    assert 30 < first < 80 and all(dry[first:])
    t = 0.01 * (299 - first)
    assert thrust[299] == pytest.approx(thrust[first] * math.exp(-t / par[n.P_TAU]), rel=1e-6)


@BOTH
def test_thrust_line_and_fuel_turn_the_airframe_as_statics_has_it(name: str) -> None:
    """Moment about the centre of gravity: that about the reference plus r x F."""
    ac = load_aircraft(name)
    plain, full = parameter_vector(ac), parameter_vector(ac, full=True)
    full[n.P_MACH] = 0.0  # the forces of both alike
    s = flying(full)
    s[n.S_T] = 0.2 * full[n.P_T0]
    assert ac.balance is not None
    for fuel in (0.1, 0.9):
        mass = full[n.P_EMPTY] + fuel * full[n.P_FUEL_CAP]
        a = np.array(loads(s, 0.02, -0.03, 0.01, STILL, mass, plain)[:6])
        b = np.array(loads(s, 0.02, -0.03, 0.01, STILL, mass, full)[:6])
        assert np.allclose(a[:3], b[:3], rtol=1e-12)
        ahead = (fuel * full[n.P_FUEL_CAP] - ac.balance.fuel_kg) * ac.balance.fuel_x_m / mass
        turn = np.cross([-ahead, 0.0, 0.0], a[:3]) + np.cross([0.0, 0.0, ac.engine.below_m], [s[n.S_T], 0.0, 0.0])
        assert np.allclose(b[3:] - a[3:], turn, rtol=1e-9, atol=1e-6)
        assert np.max(np.abs(turn)) > 10.0
