"""Gravity, curvature and turning of a round earth, and the rigid body's equations of motion over it or over a flat one.

The position of the state vector is the linear map's (north, east, down of mean sea level), velocity and attitude are given in the
local north-east-down axes of the place. `par` holds the earth (layout.P_ROUND ..).
Source of every equation: docs/sources/earth.md.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm, quat_rate

Arr = NDArray[np.float64]
R_GEOPOTENTIAL = 6356766.0  # [m] US Standard Atmosphere 1976: r0


@jit
def air_height(h: float, par: Arr) -> float:
    """Height [m] at which the standard atmosphere is to be read at geometric height h [m]: geopotential r h / (r + h) (US
    Standard Atmosphere 1976, eq. 18; earth.md 9); over the flat earth of constant gravity the two are one."""
    if par[n.P_ROUND] == 0.0:
        return h
    return R_GEOPOTENTIAL * h / (R_GEOPOTENTIAL + h)


@jit
def curvature(sin_lat: float, par: Arr) -> tuple[float, float]:
    """Radii of curvature M (meridian) and N (prime vertical) [m] at geodetic latitude, from its sine (earth.md 1)."""
    w2 = 1.0 - par[n.P_ECC2] * sin_lat * sin_lat
    w = math.sqrt(w2)
    return par[n.P_RADIUS] * (1.0 - par[n.P_ECC2]) / (w2 * w), par[n.P_RADIUS] / w


@jit
def gravitation(sin_lat: float, cos_lat: float, h: float, par: Arr) -> tuple[float, float]:
    """North and down component [m/s^2] of the attraction (not of the turning) at geodetic latitude and height h [m]
    (earth.md 3, 4)."""
    _, prime = curvature(sin_lat, par)
    p = (prime + h) * cos_lat  # from the axis
    z = (prime * (1.0 - par[n.P_ECC2]) + h) * sin_lat  # above the equator
    r2 = p * p + z * z
    r = math.sqrt(r2)
    k = par[n.P_GM] / (r2 * r)
    s2 = z * z / r2
    j = 1.5 * par[n.P_J2] * par[n.P_RADIUS] * par[n.P_RADIUS] / r2
    gp = -k * p * (1.0 + j * (1.0 - 5.0 * s2))
    gz = -k * z * (1.0 + j * (3.0 - 5.0 * s2))
    return cos_lat * gz - sin_lat * gp, -cos_lat * gp - sin_lat * gz


@jit
def weight(north_m: float, h: float, par: Arr) -> float:
    """Down component [m/s^2] of gravity, turning included, at map north and height h [m] (earth.md 4, 6)."""
    if par[n.P_ROUND] == 0.0:
        return n.G0
    lat = par[n.P_LAT0] + north_m / par[n.P_MAP_N]
    sl, cl = math.sin(lat), math.cos(lat)
    _, prime = curvature(sl, par)
    _, down = gravitation(sl, cl, h, par)
    return down - par[n.P_OMEGA] * par[n.P_OMEGA] * (prime + h) * cl * cl


@jit
def flow_turned(x: Arr, wn: float, we: float, wd: float, par: Arr) -> tuple[float, float, float]:
    """w_ie x v + (w_ie + w_en) x W [m/s^2], local axes: what the change of the air-relative velocity lacks if it is taken as
    F/m + g - w x u with inertial rates w, in a wind W [m/s] over a round earth (earth.md 7)."""
    lat = par[n.P_LAT0] + x[n.S_P] / par[n.P_MAP_N]
    h = -x[n.S_P + 2]
    sl, cl = math.sin(lat), math.cos(lat)
    meridian, prime = curvature(sl, par)
    vn, ve, vd = x[n.S_V], x[n.S_V + 1], x[n.S_V + 2]
    en, ed = par[n.P_OMEGA] * cl, -par[n.P_OMEGA] * sl
    lon_dot = ve / ((prime + h) * cl)
    kn, ke, kd = en + lon_dot * cl, -vn / (meridian + h), ed - lon_dot * sl
    return (
        -ed * ve + ke * wd - kd * we,
        ed * vn - en * vd + kd * wn - kn * wd,
        en * ve + kn * we - ke * wn,
    )


@jit
def rigid_rates(
    x: Arr,
    fx: float, fy: float, fz: float,
    mx: float, my: float, mz: float,
    mass: float, ixx: float, iyy: float, izz: float, ixz: float,
    par: Arr, out: Arr,
) -> None:  # fmt: skip
    """Rates of attitude, body rates, velocity and position (entries 0..12 of the rigid-body state) under force [N] and moment
    [N m] in body axes, gravity not among them.

    Newton in local axes: v' = C_nb F/m + g - (2 w_ie + w_en) x v; Euler in body axes with Ixz and inertial rates,
    I w' = M - w x I w; attitude against the local axes, which turn at w_ie + w_en. Source: earth.md 5, 6, 7, 8.
    """
    p, q, r = x[n.S_W], x[n.S_W + 1], x[n.S_W + 2]
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(x[0], x[1], x[2], x[3])
    hx, hy, hz = ixx * p - ixz * r, iyy * q, izz * r - ixz * p
    tx, ty, tz = mx - (q * hz - r * hy), my - (r * hx - p * hz), mz - (p * hy - q * hx)
    det = 1.0 / (ixx * izz - ixz * ixz)
    out[n.S_W], out[n.S_W + 1], out[n.S_W + 2] = (izz * tx + ixz * tz) * det, ty / iyy, (ixz * tx + ixx * tz) * det
    im = 1.0 / mass
    vn, ve, vd = x[n.S_V], x[n.S_V + 1], x[n.S_V + 2]
    an = (c00 * fx + c01 * fy + c02 * fz) * im
    ae = (c10 * fx + c11 * fy + c12 * fz) * im
    ad = (c20 * fx + c21 * fy + c22 * fz) * im
    if par[n.P_ROUND] == 0.0:
        out[n.S_V], out[n.S_V + 1], out[n.S_V + 2] = an, ae, ad + n.G0
        out[n.S_P], out[n.S_P + 1], out[n.S_P + 2] = vn, ve, vd
    else:
        lat = par[n.P_LAT0] + x[n.S_P] / par[n.P_MAP_N]
        h = -x[n.S_P + 2]
        sl, cl = math.sin(lat), math.cos(lat)
        meridian, prime = curvature(sl, par)
        gn, gd = gravitation(sl, cl, h, par)
        om = par[n.P_OMEGA]
        axis = (prime + h) * cl
        gn -= om * om * axis * sl
        gd -= om * om * axis * cl
        lat_dot, lon_dot = vn / (meridian + h), ve / axis
        # rate of the local axes: the earth's, and the one of moving over it
        wn, we, wd = (om + lon_dot) * cl, -lat_dot, -(om + lon_dot) * sl
        kn, ke, kd = wn + om * cl, we, wd - om * sl
        out[n.S_V] = an + gn - (ke * vd - kd * ve)
        out[n.S_V + 1] = ae - (kd * vn - kn * vd)
        out[n.S_V + 2] = ad + gd - (kn * ve - ke * vn)
        out[n.S_P], out[n.S_P + 1], out[n.S_P + 2] = lat_dot * par[n.P_MAP_N], lon_dot * par[n.P_MAP_E], vd
        p -= c00 * wn + c10 * we + c20 * wd
        q -= c01 * wn + c11 * we + c21 * wd
        r -= c02 * wn + c12 * we + c22 * wd
    out[0], out[1], out[2], out[3] = quat_rate(x[0], x[1], x[2], x[3], p, q, r)
