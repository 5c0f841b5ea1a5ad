"""Aids of an aircraft's own sensors: each function queues the rows of one sensor for the coming correction.

A reading is carried from its sample time to now with the modelled rates of change. Rows are told apart by sensor (refusal.py),
which is how a sensor is judged, kept out and reported: `TrustedCore.aids` has a status for each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flightsw import refusal as rd
from flightsw.kernels.rotations import wrap_pi
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import M_ALPHA, M_BETA, M_EULER, M_POS, M_RATE, M_V, X_ALPHA, X_BETA, X_P, X_PSI, X_V, X_X
from flightsw.types import SensorFrame

AXES = range(3)


def air_data(c: TrustedCore, f: SensorFrame, n: int, d: Sequence[float]) -> None:
    """Air data of n probes averaged into c.air; d [15] rates of the state."""
    age, s = (f.t_us - f.air_t_us) * 1e-6, 1.0 / math.sqrt(n)
    V, beta, alpha = c.air.tolist()
    c.add(M_V, V + d[X_V] * age, c.p.r_V * s, rd.V)
    c.add(M_BETA, beta + d[X_BETA] * age, c.p.r_beta * s, rd.BETA)
    c.add(M_ALPHA, alpha + d[X_ALPHA] * age, c.p.r_alpha * s, rd.ALPHA)


def gyro(c: TrustedCore, f: SensorFrame, d: Sequence[float]) -> None:
    """Mean gyro reading, from the middle of its window; d [15] rates of the state."""
    r = c.p.r_rate / math.sqrt(f.gyro_count)
    for i in AXES:
        c.add(M_RATE + i, f.gyro_mean_b[i] + d[X_P + i] * f.gyro_age_s, r, rd.GYRO)


def attitude(
    c: TrustedCore, f: SensorFrame, e: Sequence[float], x: Sequence[float], d: Sequence[float], more: float = 0.0
) -> None:  # fmt: skip
    """Angles e [3] of the attitude reference about the state x [15] with rates d [15]; more: 1-sigma [rad] for the gate."""
    age, lost = (f.t_us - f.att_t_us) * 1e-6, c.drift(rd.ATT, c.p.bias_gyro)
    slack = math.hypot(lost, more)
    for i in AXES:
        # the measured angle is brought near the state: psi stays unwrapped, only the innovation is wrapped
        near = x[X_PSI + i]
        c.add(M_EULER + i, near + wrap_pi(e[i] + d[X_PSI + i] * age - near), c.p.r_euler, rd.ATT, slack)


def gnss_position(c: TrustedCore, f: SensorFrame, d: Sequence[float]) -> None:
    """Own position NED; d [15] rates of the state."""
    age, lost = (f.t_us - f.gnss_t_us) * 1e-6, c.drift(rd.GNSS_POS, c.p.bias_vel)
    for i in AXES:
        c.add(M_POS + i, f.gnss_pos_n[i] + d[X_X + i] * age, c.p.r_pos, rd.GNSS_POS, lost)


def gnss_velocity(c: TrustedCore, f: SensorFrame, code: int, acc: Sequence[float], sigma: float) -> None:
    """Own inertial velocity NED, measurement codes from `code`; acc [3] modelled acceleration [m/s^2], sigma [m/s]."""
    age = (f.t_us - f.gnss_t_us) * 1e-6
    for i in AXES:
        c.add(code + i, f.gnss_vel_n[i] + acc[i] * age, sigma, rd.GNSS_VEL)
