"""What acts on the aircraft by its commands: deflections by the servo model of its file, mass by the gauge, thrust available."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.sixdof.actuators import servo_step, surface_limits, thrust_available
from hil_scripts.identify.flight.kernel import NT, T_H, T_H0, T_IDLE, T_MOST, T_TAU, T_V, T_V0
from hil_scripts.identify.flight.readings import Flight

Arr = NDArray[np.float64]
PARTS = 8  # calls of the servo model per half tick: it is of first order in its step
DV, DH = 5.0, 200.0  # [m/s], [m] over which the slopes of the thrust available are taken


def deflections(commands: Arr, ac: Aircraft, dt: float) -> Arr:
    """Surface angles [n,3,3] rad at begin, middle and end of the step from each tick; commands [n,3] rad in force during it. The
    first command is where they begin."""
    lim, c = surface_limits(ac), ac.controls
    held = np.clip(commands, lim[:, 0], lim[:, 1])
    pos, rate = held[0].copy(), np.zeros(3)
    out = np.empty((len(held), 3, 3))
    h = 0.5 * dt / PARTS
    for k, cmd in enumerate(held):
        out[k, 0] = pos
        for half in (1, 2):
            for _ in range(PARTS):
                servo_step(pos, rate, cmd, lim, c.servo_wn_radps, c.servo_zeta, h)
            out[k, half] = pos
    return out


def as_measured(surfaces: Arr, ac: Aircraft, dt: float) -> Arr:
    """As `deflections`, of angles [n,3] rad that were measured at the ticks: straight lines between them."""
    after = np.vstack([surfaces[1:], surfaces[-1:]])
    return np.stack([surfaces, 0.5 * (surfaces + after), after], axis=1)


def masses(f: Flight, ac: Aircraft, lo: int, hi: int) -> Arr:
    """Mass [kg] and Ixx, Iyy, Izz, Ixz [kg m^2] at ticks lo to hi [n,5]: a straight line through the gauge's readings in between;
    without a gauge, the file's usual fuel."""
    k = np.arange(lo, hi)
    fuel = np.full(len(k), ac.mass.default_fuel_kg)
    if (g := f.samples.get("fuel")) is not None:
        inside = (g.at >= lo) & (g.at < hi)
        if inside.sum() > 1:
            fuel = np.polyval(np.polyfit(g.at[inside] - lo, g.values[inside, 0], 1), k - lo)
        elif len(g.at):
            fuel = np.full(len(k), float(g.values[np.argmin(np.abs(g.at - lo)), 0]))
    m, t = ac.mass.empty_kg + fuel, ac.inertia
    table = (t.Ixx_kgm2, t.Iyy_kgm2, t.Izz_kgm2, t.Ixz_kgm2)
    return np.column_stack([m, *(np.interp(m, t.mass_kg, col) for col in table)])


def engine(ac: Aircraft, V: float, h: float) -> Arr:
    """Entries T_* [NT] of the kernel: thrust available about airspeed V [m/s] and height h [m]."""
    e = np.zeros(NT)
    e[T_MOST], e[T_V0], e[T_H0] = thrust_available(ac, h, V), V, h
    e[T_V] = (thrust_available(ac, h, V + DV) - thrust_available(ac, h, V - DV)) / (2.0 * DV)
    e[T_H] = (thrust_available(ac, h + DH, V) - thrust_available(ac, h - DH, V)) / (2.0 * DH)
    e[T_TAU], e[T_IDLE] = ac.engine.tau_s, ac.engine.idle_frac
    return e


def thrust_at(throttle: Arr, e: Arr, dt: float) -> Arr:
    """Thrust [n] N at each tick from throttle [n] in force during the step from it, airspeed and height of the point; it begins
    settled."""
    asked = np.maximum(throttle, e[T_IDLE]) * e[T_MOST]
    keep = np.exp(-dt / e[T_TAU])
    out = np.empty(len(asked))
    t = asked[0]
    for k, a in enumerate(asked):
        out[k] = t
        t = a + (t - a) * keep
    return out
