"""Rotations on arrays, for plots and metrics only. NED navigation frame, FRD body axes, quaternion scalar first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def quat_conj(q: Array) -> Array:
    """Conjugate of (n,4) unit quaternions: the inverse rotation."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def quat_mul(a: Array, b: Array) -> Array:
    """Hamilton product of (n,4) quaternions: rotation b first, then a."""
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=1,
    )


def quat_rotate(q: Array, v: Array) -> Array:
    """Vectors (n,3) rotated by quaternions (n,4): v' = v + 2 w (u x v) + 2 u x (u x v)."""
    u = q[:, 1:]
    t = 2.0 * np.cross(u, v)
    return v + q[:, :1] * t + np.cross(u, t)


def quat_euler(q: Array) -> Array:
    """Heading, pitch, bank [rad] (3-2-1) of body-to-NED quaternions (n,4); returns (n,3) psi, theta, phi."""
    w, x, y, z = q.T
    psi = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    theta = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
    phi = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return np.stack([psi, theta, phi], axis=1)


def euler_quat(euler: Array) -> Array:
    """Body-to-reference quaternions (n,4) of 3-2-1 angles (n,3) psi, theta, phi [rad]."""
    (cs, ct, cp), (ss, st, sp) = np.cos(euler.T / 2), np.sin(euler.T / 2)
    return np.stack(
        [
            cs * ct * cp + ss * st * sp,
            cs * ct * sp - ss * st * cp,
            cs * st * cp + ss * ct * sp,
            ss * ct * cp - cs * st * sp,
        ],
        axis=1,
    )


def wrap(angle: Array) -> Array:
    """Angles [rad] into (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2.0 * np.pi)
