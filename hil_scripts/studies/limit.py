"""Posterior Cramer-Rao bound of the tanker problem along a true trajectory.

The stochastic model is the true one: rigid-body dynamics without process noise, Dryden turbulence, a random walk of the
prevailing wind as fast as the wind model of the case, sensor noise as drawn (Tichavsky et al. 1998).
"""

from __future__ import annotations

import numpy as np

from flightsw.filters.bound import PosteriorBound, jacobian
from flightsw.filters.coloured import NoiseStates
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.models.airframe import air_jacobian, propagate_free
from flightsw.models.measure import measure_free
from flightsw.models.params import parameter_vector
from flightsw.nav.common import NavParams
from flightsw.nav.gusts import GUSTS, GustStates
from hil_scripts.studies.flight import DT, Flight, study_aircraft

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
    work, R, G = np.zeros((5, 15)), np.zeros(9), np.zeros((3, 3))
    SQ = np.zeros((n, n + 3))
    codes = np.arange(15)
    x = np.zeros(n)
    S0 = np.diag([*sigma[:9], *(2.0 * sigma[9:12]), 20.0, 20.0, 20.0, *[0.0] * (n - 15)])
    x[:15] = fl.x[0]
    gusts.start(x, S0)
    r = sigma
    if noise:
        noise.start(x, S0)
        noise.fill(SQ, DT)
        r = 1e-2 * sigma  # a whisper of white noise keeps the update regular
    bound = PosteriorBound(S0)
    out = np.zeros((len(fl.t), 3))

    def step(X: np.ndarray) -> np.ndarray:
        X = np.ascontiguousarray(X)
        propagate_free(X, fl.u[k], rho, P, DT, work)
        gusts.propagate(X, SQ, x, G, DT)
        if noise:
            noise.propagate(X, DT)
        return X

    def measure(X: np.ndarray) -> np.ndarray:
        Y = np.zeros((len(X), 15))
        measure_free(np.ascontiguousarray(X), codes, 15, Y)
        if noise:
            Y += X[:, N:]
        return Y

    for k in range(len(fl.t)):
        if k:
            x[:15] = fl.x[k - 1]
            rho = density(-x[11])
            dcm_from_euler(x[6], x[7], x[8], R)
            air_jacobian(x[0], x[1], x[2], R, G)
            bound.predict(jacobian(step, x, scale), SQ)
        x[:15] = fl.x[k]
        bound.update(jacobian(measure, x, scale), r)
        out[k] = bound.sigmas()[12:15]
    return out
