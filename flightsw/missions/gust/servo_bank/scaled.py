"""Linear model of the aircraft with its lift scaled, for the gains of the law."""

from __future__ import annotations

import numpy as np

from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.model import GustAircraft, LinearModel, Turbulence, linear_model, parameter_vector
from flightsw.missions.gust.servo_bank import states as st

Array = np.ndarray
NINE = slice(None, g.NX)


def scaled_model(ac: GustAircraft, t: Turbulence, lift: float) -> LinearModel:
    """Linear model with everything that changes lift larger by the share `lift`; 0: the aircraft's own matrices.

    What the scale changes is taken from the nonlinear model at trim, the rest from the aircraft file.
    """
    m = linear_model(ac, t)
    if lift == 0.0:
        return m
    A, B, C, D = m.A.copy(), m.B.copy(), m.C.copy(), m.D.copy()
    p, a, S = parameter_vector(ac, t), np.zeros(g.AIR_N), np.zeros((st.S_N, st.NZ))
    z, u, there, trim = np.zeros(st.NZ), np.zeros(g.NU), np.zeros((st.NZ, st.NZ)), np.zeros((st.NZ, st.NZ))
    st.rate_slopes(z, u, p, a, S, trim)
    z[st.LIFT] = lift
    st.rate_slopes(z, u, p, a, S, there)
    A += (there - trim)[NINE, NINE]
    B[g.AK] *= 1.0 + lift
    C[g.Y_AZ] = -ac.V0_mps * A[g.AK]
    C[g.Y_AZ, g.Q] += ac.V0_mps
    D[g.Y_AZ] = -ac.V0_mps * B[g.AK]
    return LinearModel(A, B, m.Br, C, D)
