"""Posterior Cramer-Rao bound of the tanker problem along a true trajectory.

The stochastic model is the true one: rigid-body dynamics without process noise, Dryden turbulence, a random walk of the
prevailing wind as fast as the wind model of the case, sensor noise as drawn (Tichavsky et al. 1998). The initial knowledge
is one reading of every sensor, as it is for the filters.

Entries 12..14 are inertial velocity (flightsw.sixdof.velocity_form_kernel). With wind in their place the gusts of the true
trajectory would enter the Jacobians as if they were known beforehand, and heading would seem observable from them: with
coloured noise the bound so computed is less than half of what can be reached across the wind.
"""

from __future__ import annotations

import numpy as np

from flightsw.filters.coloured import NoiseStates
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.gust_states import GUSTS, GustStates
from flightsw.sixdof.motion import air_jacobian, propagate_free
from flightsw.sixdof.params import parameter_vector
from flightsw.sixdof.velocity_form_kernel import air_slope, exchange, shear
from hil_scripts.studies.lee.bound import PosteriorBound, jacobian
from hil_scripts.studies.lee.flight import DT, Flight, study_aircraft

N = 15 + GUSTS
SCALE = np.array([1.0, *[1e-2] * 8, *[1.0] * 6, *[1.0] * GUSTS])


def wind_bound(fl: Flight, sigma: np.ndarray, gust_sigma: float, q_slow: float, tau_s: float = 0.0) -> np.ndarray:
    """Bound [N,3] on the 1-sigma error of wind north, east, down after each sample.

    sigma [15]: 1-sigma of the measurement channels; gust_sigma [m/s]; q_slow [m/s per sqrt(s)] of the prevailing wind;
    tau_s [s]: correlation time of the measurement noise, which then counts as 15 states (0: white).
    """
    ac = study_aircraft()
    P = parameter_vector(ac, ac.mass.empty_kg + float(fl.fuel[0]))
    gusts = GustStates(15, NavParams(gust_sigma=gust_sigma, q_slow=q_slow))
    noise = NoiseStates(N, 18 + GUSTS, sigma, np.full(15, tau_s)) if tau_s > 0.0 else None
    n = N + (15 if noise else 0)
    scale = np.concatenate((SCALE, sigma)) if noise else SCALE
    work, R, G, A = np.zeros((5, 15)), np.zeros(9), np.zeros((3, 3)), np.zeros((3, 6))
    SQ = np.zeros((n, n + 3))
    x = np.zeros((1, n))
    S0 = np.zeros((n, n))
    S0[:15, :15] = np.diag(sigma)
    x[0, :15] = fl.x[0]
    gusts.start(x[0], S0)
    r = sigma
    if noise:
        noise.start(x[0], S0, read=True)
        noise.fill(SQ, DT)
        r = 1e-2 * sigma  # a whisper of white noise keeps the update regular
    bound = PosteriorBound(S0)
    out = np.zeros((len(fl.t), 3))

    def step(X: np.ndarray) -> np.ndarray:
        X = np.ascontiguousarray(X)
        exchange(X, -1.0)
        propagate_free(X, fl.u[k], rho, P, DT, work)
        exchange(X, 1.0)
        gusts.propagate(X, SQ, x[0], G, DT, wind=False)
        if noise:
            noise.propagate(X, DT)
        return X

    def measure(X: np.ndarray) -> np.ndarray:
        return X[:, :15] + X[:, N:] if noise else X[:, :15]

    def truth(k: int) -> np.ndarray:
        x[0, :15] = fl.x[k]
        exchange(x, 1.0)
        return x[0]

    for k in range(len(fl.t)):
        if k:
            truth(k - 1)
            rho = density(-x[0, 11])
            dcm_from_euler(x[0, 6], x[0, 7], x[0, 8], R)
            air_jacobian(x[0, 0], x[0, 1], x[0, 2], R, G)
            F = jacobian(step, x[0], scale)
            SQ[12:15] = 0.0  # neither a gust nor a change of the prevailing wind moves the velocity at once
            bound.predict(F, SQ)
            bound.update(jacobian(measure, truth(k), scale), r)
        air_slope(fl.x[k], A)
        S = bound.S.copy()
        shear(S, A, -1.0)
        out[k] = np.sqrt(np.sum(S[12:15] ** 2, axis=1))
    return out
