"""Attitude kernels: Hamilton quaternion, scalar first, q_nb rotating body vectors into NED."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels.jit import jit

Mat = tuple[float, float, float, float, float, float, float, float, float]


@jit
def quat_dcm(q0: float, q1: float, q2: float, q3: float) -> Mat:
    """Direction cosine matrix C_nb, row-major, of a unit quaternion; v_n = C_nb v_b. Source: Hamilton product q v
    q*."""
    return (
        1.0 - 2.0 * (q2 * q2 + q3 * q3),
        2.0 * (q1 * q2 - q0 * q3),
        2.0 * (q1 * q3 + q0 * q2),
        2.0 * (q1 * q2 + q0 * q3),
        1.0 - 2.0 * (q1 * q1 + q3 * q3),
        2.0 * (q2 * q3 - q0 * q1),
        2.0 * (q1 * q3 - q0 * q2),
        2.0 * (q2 * q3 + q0 * q1),
        1.0 - 2.0 * (q1 * q1 + q2 * q2),
    )


@jit
def quat_mul(
    a0: float, a1: float, a2: float, a3: float, b0: float, b1: float, b2: float, b3: float
) -> tuple[float, float, float, float]:
    """Hamilton product a b [-]."""
    return (
        a0 * b0 - a1 * b1 - a2 * b2 - a3 * b3,
        a0 * b1 + a1 * b0 + a2 * b3 - a3 * b2,
        a0 * b2 - a1 * b3 + a2 * b0 + a3 * b1,
        a0 * b3 + a1 * b2 - a2 * b1 + a3 * b0,
    )


@jit
def quat_rate(
    q0: float, q1: float, q2: float, q3: float, p: float, q: float, r: float
) -> tuple[float, float, float, float]:
    """Quaternion derivative [1/s] for body rates p, q, r [rad/s]: half of q times (0, w)."""
    return (
        -0.5 * (q1 * p + q2 * q + q3 * r),
        0.5 * (q0 * p + q2 * r - q3 * q),
        0.5 * (q0 * q + q3 * p - q1 * r),
        0.5 * (q0 * r + q1 * q - q2 * p),
    )


@jit
def quat_normalise(s: NDArray[np.float64], at: int) -> None:
    """Scale the four entries of `s` from index `at` to unit length, in place."""
    n = 1.0 / math.sqrt(s[at] ** 2 + s[at + 1] ** 2 + s[at + 2] ** 2 + s[at + 3] ** 2)
    for i in range(4):
        s[at + i] *= n


@jit
def quat_from_euler(psi: float, theta: float, phi: float) -> tuple[float, float, float, float]:
    """Quaternion q_nb of the 3-2-1 angles heading, pitch, roll [rad]."""
    cy, sy = math.cos(0.5 * psi), math.sin(0.5 * psi)
    cp, sp = math.cos(0.5 * theta), math.sin(0.5 * theta)
    cr, sr = math.cos(0.5 * phi), math.sin(0.5 * phi)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


@jit
def euler_from_quat(q0: float, q1: float, q2: float, q3: float) -> tuple[float, float, float]:
    """3-2-1 angles (psi, theta, phi) [rad] of a unit quaternion; psi and phi in (-pi, pi]."""
    st = 2.0 * (q0 * q2 - q1 * q3)
    st = min(1.0, max(-1.0, st))
    return (
        math.atan2(2.0 * (q1 * q2 + q0 * q3), 1.0 - 2.0 * (q2 * q2 + q3 * q3)),
        math.asin(st),
        math.atan2(2.0 * (q2 * q3 + q0 * q1), 1.0 - 2.0 * (q1 * q1 + q2 * q2)),
    )
