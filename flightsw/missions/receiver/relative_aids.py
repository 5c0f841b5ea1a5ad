"""Aids that only a receiver has, beside those of sixdof/aids.py and what stands in for the relative sensor (aids.py)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flightsw import refusal as rd
from flightsw.kernels.rotations import to_parent
from flightsw.missions.receiver.relative_kernel import attitude_behind
from flightsw.missions.receiver.rotational import PROBE_CODE
from flightsw.sixdof.estimator_core import EstimatorCore
from flightsw.sixdof.layout import TK_DCM, TK_RATE, TK_VEL, X_ALPHA, X_BETA, X_V
from flightsw.sixdof.motion import air_velocity
from flightsw.types import SensorFrame

AXES = range(3)


def single_probes(c: EstimatorCore, f: SensorFrame, d: Sequence[float]) -> None:
    """Every valid probe's airspeed, sideslip and incidence, carried forward with the rates d [15] of the mean air data."""
    p, age = c.p, (f.t_us - f.air_t_us) * 1e-6
    kinds = ((rd.V, X_V, p.r_V), (rd.BETA, X_BETA, p.r_beta), (rd.ALPHA, X_ALPHA, p.r_alpha))
    for i in range(min(len(f.air_V), len(c.probe_pos))):
        if not (f.air_mask >> i) & 1:
            continue
        readings = (f.air_V[i], f.air_beta[i], f.air_alpha[i])
        for j, (y, (kind, k, r)) in enumerate(zip(readings, kinds, strict=True)):
            if not f.air_bad >> (3 * j + i) & 1:
                c.add(PROBE_CODE + 3 * i + j, y + d[k] * age, r, kind)


def calculated_wind(f: SensorFrame, air: np.ndarray, tk: np.ndarray) -> np.ndarray:
    """Wind [3] NED [m/s] from measured quantities: r_T' + R_BTI^T (xi' - S(w_T) xi - R^T R_BW V).

    Lee (6.14) with errata E7: xi carries its dot, R_BW is not transposed, S(w) = -[w x]. Position, velocity and attitude are the
    frame's, air [3] V, beta, alpha, tk [18] the tanker now.
    """
    R, u_a, out = np.empty(9), np.zeros(3), np.zeros(3)
    attitude_behind(np.array(f.att_q_nb), tk, R)
    to_parent(R, np.array(air_velocity(*air)), u_a)
    to_parent(tk[TK_DCM], np.array(f.rel_vel_t) + np.cross(tk[TK_RATE], np.array(f.rel_pos_t)) - u_a, out)
    return tk[TK_VEL] + out
