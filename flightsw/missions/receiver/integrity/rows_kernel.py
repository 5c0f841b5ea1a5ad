"""Rows of what the sources read, and how far they lie off what filter 0 expects, all in one call (readings.py)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, to_parent
from flightsw.missions.receiver.integrity.kernel import surprise
from flightsw.missions.receiver.integrity.layout import (
    B_AT,
    B_D,
    B_G,
    B_GV,
    B_OB,
    B_RC,
    B_RS,
    B_RV,
    B_U,
    BOOM,
    GNSS,
    REL,
)
from flightsw.missions.receiver.integrity.waiting import FREE, NUMBER, empty
from flightsw.missions.receiver.integrity.way_kernel import at
from flightsw.missions.receiver.tanker_link import carried
from flightsw.sixdof.layout import TK_DCM, TK_P, TK_Q, TK_R

# of what a latched boom is reckoned from: pivot and lever [3] m, attitude quaternion [4] of the receiver, and room for what is
# worked out of them, attitude [9], turn from the tanker [9], lever in the tanker's axes [3]
PIVOT, LEVER, QUAT, ATT, TURN, ARM, LATCHED = 0, 3, 6, 10, 19, 28, 31
# variances of noise: relative position [m^2], velocity [m^2/s^2], the tanker's rates [rad^2/s^2], difference of two fixes [m^2]
# and of their velocities [m^2/s^2], boom's extension [m^2]; its angles [rad] 1-sigma; its length drawn in [m]
REL_POS2, REL_VEL2, RATE2, GNSS_POS2, GNSS_VEL2, EXT2, ANGLE, LENGTH, NOISE = range(9)
# of an own fix: [us] time, position [3] m and velocity [3] m/s NED
FIX_AT, FIX_POS, FIX_VEL, FIX = 0, 1, 4, 7
SAME_US = 60_000  # [us] two fixes are of one instant


@jit
def in_tanker_axes(tk: np.ndarray, dx: float, dy: float, dz: float, H: np.ndarray) -> tuple[float, float, float]:
    """First three rows of H [>=3,n] <- the position in tanker axes by the attitude C of tk [18], xi = C d - (C d) x a; C d."""
    x = tk[0] * dx + tk[1] * dy + tk[2] * dz
    y = tk[3] * dx + tk[4] * dy + tk[5] * dz
    z = tk[6] * dx + tk[7] * dy + tk[8] * dz
    for i in range(3):
        for j in range(3):
            H[i, B_D + j] = tk[3 * i + j]
    H[0, B_AT], H[0, B_AT + 1], H[0, B_AT + 2] = -0.0, z, -y
    H[1, B_AT], H[1, B_AT + 1], H[1, B_AT + 2] = -z, -0.0, x
    H[2, B_AT], H[2, B_AT + 1], H[2, B_AT + 2] = y, -x, -0.0
    return x, y, z


@jit
def relative(
    R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float, dx: float, dy: float, dz: float,
    px: float, py: float, pz: float, vx: float, vy: float, vz: float, pos2: float, vel2: float, rate2: float,
    tk: np.ndarray, H: np.ndarray, y: np.ndarray, r: np.ndarray,
) -> None:  # fmt: skip
    """H [6,n], which is zero, y, r [6] <- rows of the relative position (px, py, pz) [m] and velocity (vx, vy, vz) [m/s].

    R, w, v, a, dt as `carried`, which gives tk [18]; (dx, dy, dz) [m] NED: where the receiver is, near enough for what turns with
    it; variances of noise pos2 [m^2], vel2 [m^2/s^2] and of the tanker's rates rate2 [rad^2/s^2].
    """
    carried(R, w, v, a, dt, tk)
    x0, x1, x2 = in_tanker_axes(tk, dx, dy, dz, H)
    for i in range(3):
        H[i, B_RS + i] = H[i, B_RC + i] = H[3 + i, B_RV + i] = 1.0
        for j in range(3):
            H[3 + i, B_U + j] = tk[3 * i + j]
    p, q, s = tk[TK_P], tk[TK_Q], tk[TK_R]
    y[0], y[1], y[2] = px, py, pz
    y[3], y[4], y[5] = vx + (q * x2 - s * x1), vy + (s * x0 - p * x2), vz + (p * x1 - q * x0)
    far2 = x0 * x0 + x1 * x1 + x2 * x2
    r[0] = r[1] = r[2] = pos2
    r[3] = r[4] = r[5] = vel2 + rate2 * far2


@jit
def latched(
    R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float, dx: float, dy: float, dz: float,
    x: float, y: float, z: float, noise2: float, s: np.ndarray, tk: np.ndarray, H: np.ndarray, out: np.ndarray, r: np.ndarray,
) -> None:  # fmt: skip
    """H [>=3,n], which is zero, out, r [>=3] <- rows of a boom (x, y, z) [m] long in the tanker's axes, with noise2 [m^2].

    R, w, v, a, dt, (dx, dy, dz), tk as `relative`; s [LATCHED]: pivot, lever and attitude, the rest is written.
    """
    carried(R, w, v, a, dt, tk)
    in_tanker_axes(tk, dx, dy, dz, H)
    dcm_from_quat(s[QUAT:ATT], s[ATT:TURN])
    mul33_t(s[ATT:TURN], tk[TK_DCM], s[TURN:ARM])
    to_parent(s[TURN:ARM], s[LEVER:QUAT], s[ARM:])
    for i, along in enumerate((x, y, z)):
        H[i, B_OB + i] = 1.0
        out[i] = s[PIVOT + i] + along - s[ARM + i]
        r[i] = noise2


@jit
def nearest(fixes: np.ndarray, n: int, t_us: int) -> int:
    """Index of the fix nearest to t_us, the oldest of equals, of n taken into fixes [k,FIX] by turns; -1: none is near."""
    near, least, kept = -1, SAME_US + 1.0, fixes.shape[0]
    for i in range(max(n - kept, 0), n):
        off = abs(fixes[i % kept, FIX_AT] - t_us)
        if off < least:
            least, near = off, i % kept
    return near


@jit
def gnss(
    own: np.ndarray, t_us: int, fx: float, fy: float, fz: float, fu: float, fv: float, fw: float, pos2: float, vel2: float,
    H: np.ndarray, y: np.ndarray, r: np.ndarray,
) -> None:  # fmt: skip
    """H [6,n], which is zero, y, r [6] <- rows of the difference of two fixes: own [FIX], carried to t_us, less the other's of
    t_us, (fx, fy, fz) [m], (fu, fv, fw) [m/s] NED; variances of their noise pos2 [m^2], vel2 [m^2/s^2]."""
    dt = (t_us - own[FIX_AT]) * 1e-6
    for i, (pos, vel) in enumerate(((fx, fu), (fy, fv), (fz, fw))):
        H[i, B_D + i] = H[i, B_G + i] = H[3 + i, B_U + i] = H[3 + i, B_GV + i] = 1.0
        y[i], y[3 + i] = own[FIX_POS + i] + own[FIX_VEL + i] * dt - pos, own[FIX_VEL + i] - vel
        r[i], r[3 + i] = pos2, vel2


@jit
def offered(
    which: int, rel_us: int, px: float, py: float, pz: float, vx: float, vy: float, vz: float,
    fix_us: int, fx: float, fy: float, fz: float, fu: float, fv: float, fw: float,
    boom_us: int, elevation: float, azimuth: float, extension: float, q0: float, q1: float, q2: float, q3: float,
    sample_us: int, R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, fixes: np.ndarray, n: int, noise: np.ndarray,
    s: np.ndarray, tk: np.ndarray, path: np.ndarray, steps: int, own_us: int, accel2: float, X: np.ndarray, P: np.ndarray,
    H0: np.ndarray, y0: np.ndarray, r0: np.ndarray, z: np.ndarray,
    H: np.ndarray, y: np.ndarray, r: np.ndarray, when: np.ndarray,
) -> tuple[bool, int, float, int, float, int, float]:  # fmt: skip
    """Readings of the sources in the mask `which` into free places of H, y, r, when (Waiting). Whether there is room; then of
    relative sensor, GNSS and boom the place (-1: there is no reading) and how far it lies off as `surprise` has it.

    Relative position (px, py, pz) [m] and velocity (vx, vy, vz) [m/s] of rel_us; the other's fix (fx, fy, fz) [m], (fu, fv, fw)
    [m/s] of fix_us; boom's angles [rad] and extension [m] of boom_us with the own attitude (q0, q1, q2, q3). The tanker: R, w, v,
    a, tk as `carried`, of sample_us; n own fixes into fixes [k,FIX]; noise [NOISE], s [LATCHED] as above; path, steps, own_us,
    accel2, X, P, H0, y0, r0, z as `surprise`.
    """
    rel = fix = boom = -1
    off_rel = off_fix = off_boom = 0.0
    room = 0
    for k in range(when.shape[0]):
        room += when[k, NUMBER] == FREE
    if room < 3:
        return False, rel, off_rel, fix, off_fix, boom, off_boom
    k = -1
    if which >> REL & 1:
        k = rel = empty(when, k + 1, REL, rel_us, 6, H, y, r)
        dx, dy, dz = at(path, steps, rel_us)[:3]
        relative(
            R, w, v, a, (rel_us - sample_us) * 1e-6, dx, dy, dz, px, py, pz, vx, vy, vz, noise[REL_POS2], noise[REL_VEL2],
            noise[RATE2], tk, H[k], y[k], r[k],
        )  # fmt: skip
        off_rel = surprise(X, P, H[k], y[k], r[k], 6, rel_us, own_us, path, steps, accel2, H0, y0, r0, z)
    near = nearest(fixes, n, fix_us) if which >> GNSS & 1 else -1
    if near >= 0:
        k = fix = empty(when, k + 1, GNSS, fix_us, 6, H, y, r)
        gnss(fixes[near], fix_us, fx, fy, fz, fu, fv, fw, noise[GNSS_POS2], noise[GNSS_VEL2], H[k], y[k], r[k])
        off_fix = surprise(X, P, H[k], y[k], r[k], 6, fix_us, own_us, path, steps, accel2, H0, y0, r0, z)
    if which >> BOOM & 1:
        k = boom = empty(when, k + 1, BOOM, boom_us, 3, H, y, r)
        dx, dy, dz = at(path, steps, boom_us)[:3]
        length = noise[LENGTH] + extension
        ce, across = math.cos(elevation), noise[ANGLE] * length
        s[QUAT], s[QUAT + 1], s[QUAT + 2], s[QUAT + 3] = q0, q1, q2, q3
        latched(
            R, w, v, a, (boom_us - sample_us) * 1e-6, dx, dy, dz, -length * ce * math.cos(azimuth),
            length * ce * math.sin(azimuth), -length * math.sin(elevation), across * across + noise[EXT2], s, tk, H[k], y[k],
            r[k],
        )  # fmt: skip
        off_boom = surprise(X, P, H[k], y[k], r[k], 3, boom_us, own_us, path, steps, accel2, H0, y0, r0, z)
    return True, rel, off_rel, fix, off_fix, boom, off_boom
