"""Aids that only a receiver has, beside those of sixdof/aids.py and what stands in for the relative sensor (aids.py)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flightsw import refusal as rd
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, to_parent
from flightsw.missions.receiver.rotational import PROBE_CODE
from flightsw.sixdof.estimator_core import EstimatorCore
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import M_POS, M_VEL, TK_DCM, TK_RATE, TK_VEL, X_ALPHA, X_BETA, X_V, X_X, X_Y, X_Z
from flightsw.sixdof.motion import air_velocity
from flightsw.types import SensorFrame

AXES = range(3)


def relative_position(c: TrustedCore, f: SensorFrame, d: Sequence[float]) -> None:
    """xi of the relative sensor; d [15] rates of the state."""
    age, lost = (f.t_us - f.rel_t_us) * 1e-6, c.drift(rd.REL_POS, 2.0 * c.p.bias_vel)
    for i in AXES:
        c.add(M_POS + i, f.rel_pos_t[i] + d[X_X + i] * age, c.p.r_pos, rd.REL_POS, lost)


def relative_velocity(c: TrustedCore, f: SensorFrame, x: Sequence[float]) -> None:
    """d(xi)/dt of the relative sensor; x [15] the state."""
    # the tanker's rates are taken as exact in w_T x xi: the gate has to know better
    swing = c.p.r_peer_rate * math.sqrt(x[X_X] * x[X_X] + x[X_Y] * x[X_Y] + x[X_Z] * x[X_Z])
    for i in AXES:
        c.add(M_VEL + i, f.rel_vel_t[i], c.p.r_vel, rd.REL_VEL, swing)


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


def attitude_behind(f: SensorFrame, tk: np.ndarray, out: np.ndarray) -> None:
    """out [9] <- R_BRI R_BTI^T: own attitude reference relative to the tanker, tk [18] of now."""
    R = np.empty(9)
    dcm_from_quat(np.array(f.att_q_nb), R)
    mul33_t(R, tk[TK_DCM], out)


def calculated_wind(f: SensorFrame, air: np.ndarray, tk: np.ndarray) -> np.ndarray:
    """Wind [3] NED [m/s] from measured quantities: r_T' + R_BTI^T (xi' - S(w_T) xi - R^T R_BW V).

    Lee (6.14) with errata E7: xi carries its dot, R_BW is not transposed, S(w) = -[w x]. Position, velocity and attitude are the
    frame's, air [3] V, beta, alpha, tk [18] the tanker now.
    """
    R, u_a, out = np.empty(9), np.zeros(3), np.zeros(3)
    attitude_behind(f, tk, R)
    to_parent(R, np.array(air_velocity(*air)), u_a)
    to_parent(tk[TK_DCM], np.array(f.rel_vel_t) + np.cross(tk[TK_RATE], np.array(f.rel_pos_t)) - u_a, out)
    return tk[TK_VEL] + out


def inertial_rates(w: np.ndarray, R: np.ndarray, tk: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- own inertial body rates [rad/s]: those of the state, w [3], and R w_T, R [9] = R_BRBT, tk [18] tanker."""
    rel, C, (p, q, r) = w.tolist(), R.tolist(), tk[TK_RATE].tolist()
    for i in AXES:
        out[i] = rel[i] + C[3 * i] * p + C[3 * i + 1] * q + C[3 * i + 2] * r
