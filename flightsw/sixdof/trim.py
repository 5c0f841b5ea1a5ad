"""Trim and linearisation of the onboard model, at start-up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import dcm_from_euler, to_parent
from flightsw.sixdof.motion import free_rates, relative_rates, relative_velocity
from flightsw.sixdof.params import parameter_vector


class TrimError(RuntimeError):
    """No equilibrium found; the text names aircraft, condition and residual."""


@dataclass(frozen=True)
class Trim:
    """Equilibrium: state x [15], controls u [4] (aileron, elevator, rudder [rad], thrust [N])."""

    x: np.ndarray
    u: np.ndarray


def free_derivative(x: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray) -> np.ndarray:
    """Time derivative [15] of the free aircraft."""
    d, R, fm = np.zeros(15), np.zeros(9), np.zeros(9)
    free_rates(x, u, rho, P, R, fm, d)
    return d


def relative_derivative(x: np.ndarray, u: np.ndarray, rho: float, P: np.ndarray, tk: np.ndarray) -> np.ndarray:
    """Time derivative [15] of the receiver relative to the tanker; tk [18]."""
    d, R, fm = np.zeros(15), np.zeros(9), np.zeros(9)
    relative_rates(x, u, rho, P, tk, R, fm, d)
    return d


def _solve(fun, z0, what: str) -> np.ndarray:  # type: ignore[no-untyped-def]
    from scipy.optimize import root  # slow to import: only where something is trimmed

    sol = root(fun, z0, method="hybr", tol=1e-12)
    res = float(np.abs(sol.fun).max())
    if not res <= 1e-6:
        raise TrimError(f"{what}: no trim, residual {res:.3g} after {sol.nfev} evaluations")
    return np.asarray(sol.x)


def trim_free(ac: Aircraft, mass_kg: float, h_m: float, V: float, psi_dot: float) -> Trim:
    """Level flight at altitude h [m], airspeed V [m/s], turn rate psi_dot [rad/s], no wind, no sideslip.

    Raises TrimError. Unknowns alpha, theta, phi, aileron, elevator, rudder, thrust.
    """
    P = parameter_vector(ac, mass_kg)
    rho = density(h_m)
    W = mass_kg * G0
    x = np.zeros(15)

    def fill(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, th, ph = z[0], z[1], z[2]
        x[:] = 0.0
        x[0], x[2], x[7], x[8] = V, a, th, ph
        x[3] = -psi_dot * math.sin(th)
        x[4] = psi_dot * math.cos(th) * math.sin(ph)
        x[5] = psi_dot * math.cos(th) * math.cos(ph)
        x[11] = -h_m
        return x, np.array([z[3], z[4], z[5], z[6] * W])

    def fun(z: np.ndarray) -> np.ndarray:
        d = free_derivative(*fill(z), rho, P)
        return np.array([d[0] / 10, d[1], d[2], d[3], d[4], d[5], d[11] / V])

    z = _solve(
        fun,
        [0.04, 0.04, math.atan(V * psi_dot / G0), 0, 0, 0, 0.07],
        f"{ac.meta.name} at {V:g} m/s, {psi_dot:.4g} rad/s",
    )
    xx, u = fill(z)
    top = math.radians(ac.limits.alpha_max_deg)  # beyond, the linear build-up has roots no wing flies at
    if not (abs(xx[2]) <= top and u[3] > 0.0):
        raise TrimError(
            f"{ac.meta.name} at {V:g} m/s, {psi_dot:.4g} rad/s: no trim the linear aerodynamics hold for "
            f"(alpha {xx[2]:.3g} rad, allowed +-{top:.3g}; thrust {u[3]:.4g} N)"
        )
    return Trim(xx.copy(), u)


def tanker_stage(x: np.ndarray) -> np.ndarray:
    """Tanker record tk [18] (R_BI, w, w_dot = 0, v NED) of a free-aircraft state x [15] in steady flight."""
    tk = np.zeros(18)
    dcm_from_euler(x[6], x[7], x[8], tk[:9])
    tk[9:12] = x[3:6]
    cb = math.cos(x[1])
    ua = np.array([x[0] * math.cos(x[2]) * cb, x[0] * math.sin(x[1]), x[0] * math.sin(x[2]) * cb])
    to_parent(tk[:9], ua, tk[15:18])
    tk[15:18] += x[12:15]
    return tk


def trim_relative(ac: Aircraft, mass_kg: float, tanker: Trim, xi: np.ndarray) -> Trim:
    """Receiver at rest at xi [3] (tanker body axes) behind a tanker in steady flight, no wake, no sideslip. Raises TrimError."""
    P = parameter_vector(ac, mass_kg)
    rho = density(-tanker.x[11])
    tk = tanker_stage(tanker.x)
    W = mass_kg * G0
    x = np.zeros(15)

    def fill(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x[:] = 0.0
        x[0], x[2], x[6:9], x[9:12] = z[0] * 200.0, z[1], z[2:5], xi
        return x, np.array([z[5], z[6], z[7], z[8] * W])

    def fun(z: np.ndarray) -> np.ndarray:
        d = relative_derivative(*fill(z), rho, P, tk)
        return np.concatenate((d[:6] * [0.1, 1, 1, 1, 1, 1], d[9:12] / 200.0))

    z0 = [tanker.x[0] / 200.0, 0.02, 0, -0.03, 0, 0, 0.03, 0, 0.12]
    xx, u = fill(_solve(fun, z0, f"{ac.meta.name} relative to tanker at {tanker.x[0]:g} m/s"))
    return Trim(xx.copy(), u)


def jacobian(fun, z: np.ndarray, step: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Central differences of fun(z [k]) -> [n] with per-component steps [k]: matrix [n,k]."""
    cols = []
    for i in range(len(z)):
        e = np.zeros(len(z))
        e[i] = step[i]
        cols.append((fun(z + e) - fun(z - e)) / (2.0 * step[i]))
    return np.array(cols).T


X_STEP = np.array([1e-2, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-2, 1e-2, 1e-1, 1e-2, 1e-2, 1e-2])
U_STEP = np.array([1e-4, 1e-4, 1e-4, 10.0])


def linearise_free(ac: Aircraft, mass_kg: float, t: Trim) -> tuple[np.ndarray, np.ndarray]:
    """A [15,15], B [15,4] of the free aircraft at a trim."""
    P, rho = parameter_vector(ac, mass_kg), density(-t.x[11])
    A = jacobian(lambda x: free_derivative(x, t.u, rho, P), t.x, X_STEP)
    B = jacobian(lambda u: free_derivative(t.x, u, rho, P), t.u, U_STEP)
    return A, B


def linearise_relative(
    ac: Aircraft, mass_kg: float, tanker: Trim, t: Trim
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A [15,15], B [15,4], and C_v [3,15] = d(xi_dot)/dx of the receiver relative to the tanker at a trim."""
    P, rho, tk = parameter_vector(ac, mass_kg), density(-tanker.x[11]), tanker_stage(tanker.x)
    A = jacobian(lambda x: relative_derivative(x, t.u, rho, P, tk), t.x, X_STEP)
    B = jacobian(lambda u: relative_derivative(t.x, u, rho, P, tk), t.u, U_STEP)

    def vel(x: np.ndarray) -> np.ndarray:
        R, v = np.zeros(9), np.zeros(3)
        dcm_from_euler(x[6], x[7], x[8], R)
        relative_velocity(x, tk, R, v)
        return v

    return A, B, jacobian(vel, t.x, X_STEP)
