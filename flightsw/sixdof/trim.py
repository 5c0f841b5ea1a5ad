"""Trim and linearisation of the onboard model, at start-up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.rotations import dcm_from_euler, to_parent
from flightsw.sixdof.layout import (
    EULER,
    POS,
    RATE,
    TK_DCM,
    TK_RATE,
    TK_VEL,
    WIND,
    X_ALPHA,
    X_BETA,
    X_P,
    X_PHI,
    X_PSI,
    X_Q,
    X_R,
    X_THETA,
    X_V,
    X_Z,
)
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
        a, th, ph, aileron, elevator, rudder, thrust = z
        x[:] = 0.0
        x[X_V], x[X_ALPHA], x[X_THETA], x[X_PHI] = V, a, th, ph
        x[X_P] = -psi_dot * math.sin(th)
        x[X_Q] = psi_dot * math.cos(th) * math.sin(ph)
        x[X_R] = psi_dot * math.cos(th) * math.cos(ph)
        x[X_Z] = -h_m
        return x, np.array([aileron, elevator, rudder, thrust * W])

    def fun(z: np.ndarray) -> np.ndarray:
        d = free_derivative(*fill(z), rho, P)
        return np.array([d[X_V] / 10, d[X_BETA], d[X_ALPHA], d[X_P], d[X_Q], d[X_R], d[X_Z] / V])

    z = _solve(
        fun,
        [0.04, 0.04, math.atan(V * psi_dot / G0), 0, 0, 0, 0.07],
        f"{ac.meta.name} at {V:g} m/s, {psi_dot:.4g} rad/s",
    )
    xx, u = fill(z)
    top = math.radians(ac.limits.alpha_max_deg)  # beyond, the linear build-up has roots no wing flies at
    if not (abs(xx[X_ALPHA]) <= top and u[3] > 0.0):
        raise TrimError(
            f"{ac.meta.name} at {V:g} m/s, {psi_dot:.4g} rad/s: no trim the linear aerodynamics hold for "
            f"(alpha {xx[X_ALPHA]:.3g} rad, allowed +-{top:.3g}; thrust {u[3]:.4g} N)"
        )
    return Trim(xx.copy(), u)


def tanker_stage(x: np.ndarray) -> np.ndarray:
    """Tanker record tk [18] (R_BI, w, w_dot = 0, v NED) of a free-aircraft state x [15] in steady flight."""
    tk = np.zeros(18)
    dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], tk[TK_DCM])
    tk[TK_RATE] = x[RATE]
    cb = math.cos(x[X_BETA])
    V, a = x[X_V], x[X_ALPHA]
    ua = np.array([V * math.cos(a) * cb, V * math.sin(x[X_BETA]), V * math.sin(a) * cb])
    to_parent(tk[TK_DCM], ua, tk[TK_VEL])
    tk[TK_VEL] += x[WIND]
    return tk


def trim_relative(ac: Aircraft, mass_kg: float, tanker: Trim, xi: np.ndarray) -> Trim:
    """Receiver at rest at xi [3] (tanker body axes) behind a tanker in steady flight, no wake, no sideslip. Raises TrimError."""
    P = parameter_vector(ac, mass_kg)
    rho = density(-tanker.x[X_Z])
    tk = tanker_stage(tanker.x)
    W = mass_kg * G0
    x = np.zeros(15)

    def fill(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x[:] = 0.0
        V, a, psi, th, ph, aileron, elevator, rudder, thrust = z
        x[X_V], x[X_ALPHA], x[EULER], x[POS] = V * 200.0, a, (psi, th, ph), xi
        return x, np.array([aileron, elevator, rudder, thrust * W])

    def fun(z: np.ndarray) -> np.ndarray:
        d = relative_derivative(*fill(z), rho, P, tk)
        return np.concatenate((d[:X_PSI] * [0.1, 1, 1, 1, 1, 1], d[POS] / 200.0))

    z0 = [tanker.x[X_V] / 200.0, 0.02, 0, -0.03, 0, 0, 0.03, 0, 0.12]
    xx, u = fill(_solve(fun, z0, f"{ac.meta.name} relative to tanker at {tanker.x[X_V]:g} m/s"))
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
    P, rho = parameter_vector(ac, mass_kg), density(-t.x[X_Z])
    A = jacobian(lambda x: free_derivative(x, t.u, rho, P), t.x, X_STEP)
    B = jacobian(lambda u: free_derivative(t.x, u, rho, P), t.u, U_STEP)
    return A, B


def linearise_relative(
    ac: Aircraft, mass_kg: float, tanker: Trim, t: Trim
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A [15,15], B [15,4], and C_v [3,15] = d(xi_dot)/dx of the receiver relative to the tanker at a trim."""
    P, rho, tk = parameter_vector(ac, mass_kg), density(-tanker.x[X_Z]), tanker_stage(tanker.x)
    A = jacobian(lambda x: relative_derivative(x, t.u, rho, P, tk), t.x, X_STEP)
    B = jacobian(lambda u: relative_derivative(t.x, u, rho, P, tk), t.u, U_STEP)

    def vel(x: np.ndarray) -> np.ndarray:
        R, v = np.zeros(9), np.zeros(3)
        dcm_from_euler(x[X_PSI], x[X_THETA], x[X_PHI], R)
        relative_velocity(x, tk, R, v)
        return v

    return A, B, jacobian(vel, t.x, X_STEP)
