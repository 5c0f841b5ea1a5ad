"""Relative motion of two aircraft, and the refuelling boom between them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm

Arr = NDArray[np.float64]


@jit
def relative(st: Arr, sr: Arr, geo: Arr, out: Arr) -> None:
    """Receiver `sr` seen from the tanker `st`, written to `out` [NR] in tanker body axes.

    xi = C_bn (p_R - p_T) [m]; xidot = C_bn (v_R - v_T) - w_T x xi [m/s]; the receptacle at geo[3:6] (receiver body,
    m) in boom coordinates about the pivot geo[0:3] (tanker body, m): elevation (negative below) and azimuth
    (positive right) [rad], extension beyond the retracted length geo[6] and its rate [m, m/s], speed of the
    receptacle in tanker axes [m/s].
    """
    t00, t01, t02, t10, t11, t12, t20, t21, t22 = quat_dcm(st[0], st[1], st[2], st[3])
    dx, dy, dz = sr[10] - st[10], sr[11] - st[11], sr[12] - st[12]
    x = t00 * dx + t10 * dy + t20 * dz
    y = t01 * dx + t11 * dy + t21 * dz
    z = t02 * dx + t12 * dy + t22 * dz
    dx, dy, dz = sr[7] - st[7], sr[8] - st[8], sr[9] - st[9]
    p, q, r = st[4], st[5], st[6]
    vx = t00 * dx + t10 * dy + t20 * dz - (q * z - r * y)
    vy = t01 * dx + t11 * dy + t21 * dz - (r * x - p * z)
    vz = t02 * dx + t12 * dy + t22 * dz - (p * y - q * x)
    out[0], out[1], out[2], out[3], out[4], out[5] = x, y, z, vx, vy, vz

    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(sr[0], sr[1], sr[2], sr[3])
    gx, gy, gz = geo[3], geo[4], geo[5]
    an, ae, ad = c00 * gx + c01 * gy + c02 * gz, c10 * gx + c11 * gy + c12 * gz, c20 * gx + c21 * gy + c22 * gz
    rx = t00 * an + t10 * ae + t20 * ad
    ry = t01 * an + t11 * ae + t21 * ad
    rz = t02 * an + t12 * ae + t22 * ad
    # receptacle velocity: xidot + (w_R - w_T) x lever, the lever turning with the receiver
    bx, by, bz = sr[5] * gz - sr[6] * gy, sr[6] * gx - sr[4] * gz, sr[4] * gy - sr[5] * gx
    an, ae, ad = c00 * bx + c01 * by + c02 * bz, c10 * bx + c11 * by + c12 * bz, c20 * bx + c21 * by + c22 * bz
    ux = vx + t00 * an + t10 * ae + t20 * ad - (q * rz - r * ry)
    uy = vy + t01 * an + t11 * ae + t21 * ad - (r * rx - p * rz)
    uz = vz + t02 * an + t12 * ae + t22 * ad - (p * ry - q * rx)
    bx, by, bz = x + rx - geo[0], y + ry - geo[1], z + rz - geo[2]
    length = math.sqrt(bx * bx + by * by + bz * bz)
    out[n.R_EL] = math.atan2(-bz, math.sqrt(bx * bx + by * by))
    out[n.R_AZ] = math.atan2(by, -bx)
    out[n.R_EXT] = length - geo[6]
    out[n.R_EXTDOT] = (bx * ux + by * uy + bz * uz) / max(length, 1e-9)
    out[n.R_SPEED] = math.sqrt(ux * ux + uy * uy + uz * uz)
