"""Dryden turbulence as filter states: five gust states beside the total wind of a 15-state estimator.

State 12..14 stays the total wind. Its increment over a step is that of the gusts (known dynamics, turned from track axes to
NED) plus a slow random walk of the prevailing wind; every increment reaches V, beta, alpha through -eps^-1 R_BI at once.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.gauss_markov import dryden
from flightsw.kernels.sampled import multiply
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.layout import AIR, BEYOND, N_WIND, WIND, X_PSI, X_V

GUSTS = 5  # u; v, v'; w, w' (filters.gauss_markov.dryden)


class GustStates:
    """Layout and dynamics of the gust states at indices first .. first + 4 (after any others)."""

    def __init__(self, first: int, p: NavParams) -> None:
        """`first`: index of the first gust state."""
        self.states = slice(first, first + GUSTS)
        self.columns = slice(first + BEYOND, first + BEYOND + GUSTS)
        self.p = p
        self._key = (0.0, 0.0)

    def _model(self, dt: float, V: float) -> None:
        key = (dt, round(V))
        if key != self._key:
            self._key = key
            self.Phi, self.L, C, _ = dryden(dt, float(key[1]), self.p.gust_L_m, self.p.gust_sigma)
            self.Cd, self.CL = multiply(C, self.Phi - np.eye(GUSTS)), multiply(C, self.L)

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """Stationary turbulence into the state x and the factor S, in place."""
        _, _, _, P0 = dryden(0.05, float(x[X_V]), self.p.gust_L_m, self.p.gust_sigma)
        i = self.states
        x[i] = 0.0
        S[i, :] = S[:, i] = 0.0
        S[i, i] = np.sqrt(P0)

    def propagate(
        self, X: np.ndarray, SQ: np.ndarray, x: np.ndarray, G: np.ndarray, dt: float, psi: float | None = None,
        wind: bool = True,
    ) -> None:  # fmt: skip
        """Advance the gust states of the points X over dt [s] and fill the wind columns of SQ.

        x: the mean the step started from; G [3,3] = -eps^-1 R_BI there (change of V, beta, alpha per wind increment).
        psi [rad]: own heading where entry 6 of the state is another angle. wind: entries 12..14 of X are wind; else inertial
        velocity, which a gust does not move at once.
        """
        self._model(dt, x[X_V])
        i, j = self.states, self.columns
        heading = x[X_PSI] if psi is None else psi
        c, s = math.cos(heading), math.sin(heading)
        T = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # track axes (heading) to NED
        dW = multiply(X[:, i], multiply(T, self.Cd).T)
        if wind:
            X[:, WIND] += dW
        X[:, AIR] += multiply(dW, G.T)
        X[:, i] = multiply(X[:, i], self.Phi.T)
        slow = self.p.q_slow * math.sqrt(dt)
        SQ[WIND, N_WIND] = np.eye(3) * slow
        SQ[AIR, N_WIND] = G * slow
        SQ[i, j] = self.L
        SQ[WIND, j] = multiply(T, self.CL)
        SQ[AIR, j] = multiply(G, SQ[WIND, j])
