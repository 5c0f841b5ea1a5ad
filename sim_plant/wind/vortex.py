"""Induced velocity of horseshoe vortices and its mean and gradients over another aircraft's airframe."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]
# wake source vector: wing (x, y, z, vortex span, core), tail (same), eddy viscosity, tail lift / weight; body: flux over speed
# [m^2] (0 = none), x of its source and of its sink, z
K_WING, K_TAIL, K_NU, K_TAIL_FRAC, K_BODY, NK = 0, 5, 10, 11, 12, 16


@jit
def leg(
    px: float, py: float, pz: float, dx: float, dy: float, dz: float, gamma: float, core: float, nu: float, speed: float
) -> V3:
    """Velocity [m/s] at offset p [m] from the start of a semi-infinite filament along unit vector d, circulation
    along d.

    Gamma h / (2 pi (h^2 + rc^2)) (1 + cos g) / 2 [1 - exp(-h^2 / (4 nu tau))], tau = distance downstream / speed
    (lee.md section 3.5: Burnham-Hallock core with Lamb-Oseen ageing). gamma [m^2/s], core [m], nu [m^2/s].
    """
    along = px * dx + py * dy + pz * dz
    hx, hy, hz = px - along * dx, py - along * dy, pz - along * dz
    h2 = hx * hx + hy * hy + hz * hz
    dist = math.sqrt(h2 + along * along)
    if dist < 1e-9:
        return 0.0, 0.0, 0.0
    f = gamma / (4.0 * math.pi * (h2 + core * core)) * (1.0 + along / dist)
    if along > 0.0 and nu > 0.0:
        f *= 1.0 - math.exp(-h2 * speed / (4.0 * nu * along))
    return f * (dy * hz - dz * hy), f * (dz * hx - dx * hz), f * (dx * hy - dy * hx)


@jit
def bound(ax: float, ay: float, az: float, half: float, gamma: float, core: float) -> V3:
    """Velocity [m/s] at offset a [m] from the middle of a filament along +y of half length `half` [m], circulation
    +y."""
    h2 = ax * ax + az * az
    left, right = ay + half, half - ay
    c = left / math.sqrt(h2 + left * left + 1e-18) + right / math.sqrt(h2 + right * right + 1e-18)
    f = gamma / (4.0 * math.pi * (h2 + core * core)) * c
    return f * az, 0.0, -f * ax


@jit
def horseshoe(
    x: float,
    y: float,
    z: float,
    src: Arr,
    at: int,
    gamma: float,
    d0: float,
    d1: float,
    d2: float,
    nu: float,
    speed: float,
) -> V3:
    """Velocity [m/s, source body axes] at point (x, y, z) [m] of the horseshoe src[at:at+5], legs along unit vector d.

    Circulation of positive lift: left leg upstream, bound leg left to right, right leg downstream.
    """
    px, py, pz = x - src[at], y - src[at + 1], z - src[at + 2]
    half, core = 0.5 * src[at + 3], src[at + 4]
    u1, v1, w1 = leg(px, py - half, pz, d0, d1, d2, gamma, core, nu, speed)
    u2, v2, w2 = leg(px, py + half, pz, d0, d1, d2, -gamma, core, nu, speed)
    u3, v3, w3 = bound(px, py, pz, half, gamma, core)
    return u1 + u2 + u3, v1 + v2 + v3, w1 + w2 + w3


@jit
def oval(x: float, y: float, z: float, flux: float, fore: float, aft: float, below: float) -> V3:
    """Velocity [m/s] at a point [m] by a source of `flux` [m^3/s] at (fore, 0, below) and as much a sink at (aft, 0, below)."""
    f = flux / (4.0 * math.pi)
    dz = z - below
    h2 = y * y + dz * dz + 1e-6
    a, b = x - fore, x - aft
    ra2, rb2 = a * a + h2, b * b + h2
    ra, rb = ra2 * math.sqrt(ra2), rb2 * math.sqrt(rb2)
    side = f / ra - f / rb
    return f * a / ra - f * b / rb, side * y, side * dz


@jit
def source_strength(obs: Arr, src: Arr) -> tuple[float, float]:
    """Circulation [m^2/s] of wing and tail: lift / (rho V vortex span); the tail carries K_TAIL_FRAC of the weight."""
    tail = src[K_TAIL_FRAC] * obs[n.O_MASS] * n.G0
    rv = obs[n.O_RHO] * obs[n.O_V]
    return (obs[n.O_LIFT] - tail) / (rv * src[K_WING + 3]), tail / (rv * src[K_TAIL + 3])


@jit
def downstream(obs: Arr) -> V3:
    """Unit vector [body axes] along the flow met by who is observed in `obs`."""
    ca, sa = math.cos(obs[n.O_ALPHA]), math.sin(obs[n.O_ALPHA])
    cb, sb = math.cos(obs[n.O_BETA]), math.sin(obs[n.O_BETA])
    return -ca * cb, -sb, -sa * cb


@jit
def wake_velocity(x: float, y: float, z: float, obs: Arr, src: Arr) -> V3:
    """Velocity [m/s, source body axes] at a point [m, same] by wing and tail, or wing and body, of who is observed in `obs`."""
    gw, gt = source_strength(obs, src)
    d0, d1, d2 = downstream(obs)
    return shed(x, y, z, gw, gt, d0, d1, d2, obs[n.O_V], src)


@jit
def shed(
    x: float, y: float, z: float, gw: float, gt: float, d0: float, d1: float, d2: float, speed: float, src: Arr
) -> V3:
    """wake_velocity by circulations of wing and tail [m^2/s], legs along the unit vector d, at `speed` [m/s]."""
    a0, a1, a2 = horseshoe(x, y, z, src, K_WING, gw, d0, d1, d2, src[K_NU], speed)
    if src[K_BODY] > 0.0:
        b0, b1, b2 = oval(x, y, z, src[K_BODY] * speed, src[K_BODY + 1], src[K_BODY + 2], src[K_BODY + 3])
    else:
        b0, b1, b2 = horseshoe(x, y, z, src, K_TAIL, gt, d0, d1, d2, src[K_NU], speed)
    return a0 + b0, a1 + b1, a2 + b2


@jit
def feel(i: int, n_span: int, weight: Arr, un: float, ue: float, ud: float, wy: float, wz: float, wind: Arr) -> None:
    """Add the air [m/s] met at point i of an airframe, NED and along its y and z, to the effective wind [NW]: wing stations are
    the first n_span; weight as in wake.airframe_points."""
    wt = weight[i, 0]
    wind[0] += wt * un
    wind[1] += wt * ue
    wind[2] += wt * ud
    if i < n_span:
        wind[n.W_ROT] += weight[i, 1] * wz
    else:
        wind[n.W_ROT + 1] -= weight[i, 2] * wz
        wind[n.W_ROT + 2] += weight[i, 2] * wy


@jit
def wake_on_airframe(
    st: Arr,
    obs: Arr,
    src: Arr,
    sr: Arr,
    points: Arr,
    weight: Arr,
    n_span: int,
    n_frame: int,
    wind: Arr,
    probe_wake: Arr,
) -> None:
    """Add the wake of source aircraft (`st`, `obs`, `src`) to the effective wind of `sr`, and to its probes' air.

    points [m, 3] (body of `sr`): n_span wing stations, then fuselage stations up to n_frame, then probes.
    weight [n_frame, 3]: weight in the mean; least-squares slope against y (wing); against x (fuselage). Effective wind:
    translation = weighted mean [NED]; p = dWz/dy on the wing, q = -dWz/dx and r = dWy/dx on the fuselage: one
    gradient per lifting surface (lee.md E23). wind [NW] and probe_wake [m - n_frame, 3] (NED) are added to.
    """
    t00, t01, t02, t10, t11, t12, t20, t21, t22 = quat_dcm(st[0], st[1], st[2], st[3])
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(sr[0], sr[1], sr[2], sr[3])
    ox, oy, oz = sr[10] - st[10], sr[11] - st[11], sr[12] - st[12]
    gw, gt = source_strength(obs, src)
    d0, d1, d2 = downstream(obs)
    for i in range(points.shape[0]):
        bx, by, bz = points[i, 0], points[i, 1], points[i, 2]
        dn = ox + c00 * bx + c01 * by + c02 * bz
        de = oy + c10 * bx + c11 * by + c12 * bz
        dd = oz + c20 * bx + c21 * by + c22 * bz
        x = t00 * dn + t10 * de + t20 * dd
        y = t01 * dn + t11 * de + t21 * dd
        z = t02 * dn + t12 * de + t22 * dd
        u, v, w = shed(x, y, z, gw, gt, d0, d1, d2, obs[n.O_V], src)
        un, ue, ud = t00 * u + t01 * v + t02 * w, t10 * u + t11 * v + t12 * w, t20 * u + t21 * v + t22 * w
        if i >= n_frame:
            probe_wake[i - n_frame, 0] += un
            probe_wake[i - n_frame, 1] += ue
            probe_wake[i - n_frame, 2] += ud
            continue
        wy = c01 * un + c11 * ue + c21 * ud
        wz = c02 * un + c12 * ue + c22 * ud
        feel(i, n_span, weight, un, ue, ud, wy, wz, wind)
