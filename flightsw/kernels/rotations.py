"""Rotation kernels: 3-2-1 Euler angles, quaternions, direction-cosine matrices.

Matrices are flat row-major float64[9]. `dcm_bn` maps navigation components to body components,
R_BI = R1(phi) R2(theta) R3(psi) (Lee 2011, section 2.2).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit, jit_own

Vec3 = tuple[float, float, float]


@jit
def dcm_from_euler(psi: float, theta: float, phi: float, R: np.ndarray) -> None:
    """R [9] <- R1(phi) R2(theta) R3(psi), parent to child components; angles [rad]."""
    sp, cp = math.sin(psi), math.cos(psi)
    st, ct = math.sin(theta), math.cos(theta)
    sf, cf = math.sin(phi), math.cos(phi)
    dcm_of_turns(sp, cp, st, ct, sf, cf, R)


@jit
def dcm_of_turns(sp: float, cp: float, st: float, ct: float, sf: float, cf: float, R: np.ndarray) -> None:
    """R [9] <- as dcm_from_euler by sine and cosine of psi, theta and phi, for who needs those besides."""
    R[0] = ct * cp
    R[1] = ct * sp
    R[2] = -st
    R[3] = sf * st * cp - cf * sp
    R[4] = sf * st * sp + cf * cp
    R[5] = sf * ct
    R[6] = cf * st * cp + sf * sp
    R[7] = cf * st * sp - sf * cp
    R[8] = cf * ct


@jit
def euler_from_dcm(R: np.ndarray, e: np.ndarray) -> None:
    """e [3] <- (psi, theta, phi) [rad] of a parent-to-child matrix R [9]; psi in (-pi, pi]."""
    s = -R[2]
    if s > 1.0:
        s = 1.0
    elif s < -1.0:
        s = -1.0
    e[0] = math.atan2(R[1], R[0])
    e[1] = math.asin(s)
    e[2] = math.atan2(R[5], R[8])


@jit
def dcm_from_quat(q: np.ndarray, R: np.ndarray) -> None:
    """R [9] <- parent-to-child matrix of the unit quaternion q [4] (scalar first) that rotates child vectors to parent."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    R[0] = w * w + x * x - y * y - z * z
    R[1] = 2.0 * (x * y + w * z)
    R[2] = 2.0 * (x * z - w * y)
    R[3] = 2.0 * (x * y - w * z)
    R[4] = w * w - x * x + y * y - z * z
    R[5] = 2.0 * (y * z + w * x)
    R[6] = 2.0 * (x * z + w * y)
    R[7] = 2.0 * (y * z - w * x)
    R[8] = w * w - x * x - y * y + z * z


@jit
def quat_from_euler(psi: float, theta: float, phi: float, q: np.ndarray) -> None:
    """q [4] <- unit quaternion (scalar first, child to parent) of 3-2-1 angles [rad]."""
    a, b, c = 0.5 * psi, 0.5 * theta, 0.5 * phi
    ca, sa, cb, sb, cc, sc = math.cos(a), math.sin(a), math.cos(b), math.sin(b), math.cos(c), math.sin(c)
    q[0] = cc * cb * ca + sc * sb * sa
    q[1] = sc * cb * ca - cc * sb * sa
    q[2] = cc * sb * ca + sc * cb * sa
    q[3] = cc * cb * sa - sc * sb * ca


@jit
def mul33(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> None:
    """C <- A B, all [9]; C distinct from A and B."""
    for i in range(3):
        for j in range(3):
            C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j]


@jit
def mul33_t(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> None:
    """C <- A B^T, all [9]; C distinct from A and B."""
    for i in range(3):
        for j in range(3):
            C[3 * i + j] = A[3 * i] * B[3 * j] + A[3 * i + 1] * B[3 * j + 1] + A[3 * i + 2] * B[3 * j + 2]


@jit
def to_parent(R: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- R^T v: child components v [3] to parent components; out distinct from v."""
    for i in range(3):
        out[i] = R[i] * v[0] + R[3 + i] * v[1] + R[6 + i] * v[2]


@jit
def to_child(R: np.ndarray, v: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- R v: parent components v [3] to child components; out distinct from v."""
    for i in range(3):
        out[i] = R[3 * i] * v[0] + R[3 * i + 1] * v[1] + R[3 * i + 2] * v[2]


@jit
def rotate_dcm(R: np.ndarray, w: np.ndarray, dt: float, out: np.ndarray) -> None:
    """out [9] <- R [9] (parent to child) after turning the child at body rate w [rad/s] for dt [s] (Rodrigues, exact)."""
    n = math.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    a = n * dt
    if abs(a) < 1e-12:
        for i in range(9):
            out[i] = R[i]
        return
    x, y, z = w[0] / n, w[1] / n, w[2] / n
    s, c = math.sin(a), math.cos(a)
    v = 1.0 - c
    # transposed Rodrigues matrix: components in the turned frame
    e0, e1, e2 = c + v * x * x, v * x * y + s * z, v * x * z - s * y
    e3, e4, e5 = v * x * y - s * z, c + v * y * y, v * y * z + s * x
    e6, e7, e8 = v * x * z + s * y, v * y * z - s * x, c + v * z * z
    for j in range(3):
        b0, b1, b2 = R[j], R[3 + j], R[6 + j]
        out[j] = e0 * b0 + e1 * b1 + e2 * b2
        out[3 + j] = e3 * b0 + e4 * b1 + e5 * b2
        out[6 + j] = e6 * b0 + e7 * b1 + e8 * b2


@jit_own
def turn(R: np.ndarray, p: float, q: float, r: float, dt: float) -> None:
    """R [9], parent to body, turned on in place at the body rates p, q, r [rad/s] for dt [s]."""
    w, turned = np.empty(3), np.empty(9)
    w[0], w[1], w[2] = p, q, r
    rotate_dcm(R, w, dt, turned)
    for i in range(9):
        R[i] = turned[i]


@jit
def wrap_pi(a: float) -> float:
    """Angle a [rad] wrapped to [-pi, pi)."""
    return a - 2.0 * math.pi * math.floor((a + math.pi) / (2.0 * math.pi))


def vec3(a: np.ndarray) -> tuple[float, float, float]:
    """First three entries of an array as a tuple of floats (what port types hold)."""
    x, y, z = a[:3].tolist()
    return x, y, z


def less(a: Vec3, b: Vec3) -> Vec3:
    """a - b of two triples of plain floats."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def added(a: Vec3, b: Vec3) -> Vec3:
    """a + b of two triples of plain floats."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def quat4(a: np.ndarray) -> tuple[float, float, float, float]:
    """First four entries of an array as a tuple of floats."""
    w, x, y, z = a[:4].tolist()
    return w, x, y, z
