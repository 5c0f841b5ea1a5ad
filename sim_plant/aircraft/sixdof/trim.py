"""Trim: the attitude, surfaces and thrust with which the plant's own equations hold a given inertial velocity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import ConfigError
from sim_plant.aircraft.sixdof.eom import derivative
from sim_plant.aircraft.sixdof.observe import observe
from sim_plant.kernels import layout as n
from sim_plant.kernels.rot import quat_from_euler

Arr = NDArray[np.float64]


def observation(s: Arr, wind: Arr, par: Arr) -> Arr:
    """Observation vector (layout.O_*) of state `s` in effective wind, without probes and magnetic field."""
    out, none = np.zeros(n.NO), np.zeros((0, 3))
    observe(s, wind, wind[:3], par, np.zeros(3), none, none, np.zeros(n.N_RIGID), out)
    return out


def trim(pos_n: Arr, vel_n: Arr, wind: Arr, fuel_kg: float, par: Arr) -> Arr:
    """State vector [NS] of steady, non-rotating flight at position [m] and inertial velocity [m/s] in wind `wind` [NW].

    Unknown: heading, pitch, bank, three surfaces, thrust. Wanted zero: linear and angular acceleration, sideslip.
    Powell's hybrid method (MINPACK: no linear algebra library, whose last digits differ from processor to processor) on
    `derivative`; raises ConfigError if no trim exists within the aircraft's limits.
    """
    s = np.zeros(n.NS)
    s[n.S_P : n.S_P + 3], s[n.S_V : n.S_V + 3], s[n.S_FUEL] = pos_n, vel_n, fuel_kg
    air = vel_n - wind[:3]
    psi0 = math.atan2(air[1], air[0])
    k = np.zeros(n.N_RIGID)
    t_scale = 0.1 * par[n.P_T0]

    def put(z: Arr) -> None:
        s[0:4] = quat_from_euler(psi0 + z[0], z[1], z[2])
        s[n.S_SURF : n.S_SURF + 3] = z[3:6]
        s[n.S_T] = z[6] * t_scale

    def residual(z: Arr) -> Arr:
        put(z)
        derivative(s, z[3], z[4], z[5], 0.0, wind, fuel_kg, par, k)
        beta = observation(s, wind, par)[n.O_BETA]
        return np.array([*k[n.S_V : n.S_V + 3], *(10.0 * k[n.S_W : n.S_W + 3]), 10.0 * beta])

    from scipy.optimize import root  # slow to import: only where something is trimmed

    z0 = np.array([0.0, 0.03, 0.0, 0.0, 0.0, 0.0, 1.5])
    z = root(residual, z0, method="hybr", tol=1e-14).x
    off = float(np.max(np.abs(residual(z))))
    lo, hi = par[n.P_LO : n.P_LO + 3], par[n.P_HI : n.P_HI + 3]
    avail = observation(s, wind, par)[n.O_AVAIL]
    if not off <= 1e-6 or np.any(z[3:6] < lo) or np.any(z[3:6] > hi) or not 0.0 < s[n.S_T] <= avail:
        raise ConfigError(
            f"no trim at airspeed {math.hypot(*air):.1f} m/s, height {-pos_n[2]:.0f} m: residual {off:.2g}, "
            f"surfaces {np.degrees(z[3:6]).round(2)} deg, thrust {s[n.S_T]:.0f} N of {avail:.0f} N available"
        )
    return s


def throttle_for(s: Arr, wind: Arr, par: Arr) -> float:
    """Throttle [-] that holds the thrust in `s`."""
    return float(s[n.S_T] / observation(s, wind, par)[n.O_AVAIL])
