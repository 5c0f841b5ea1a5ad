"""Kernels of trail.py: where the vortices lie now, and what they induce. Equations: docs/air.md 7."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import quat_dcm
from sim_plant.wind.vortex import K_NU, K_TAIL, K_WING, V3, bound, feel, source_strength

Arr = NDArray[np.float64]
# a row of the history: position, arms to the four roots (wing left, right, tail left, right), down axis of the body, calm air,
# gust; all NED [m], [-], [m/s]
H_POS, H_ARM, H_DOWN, H_CALM, H_GUST, NHIST = 0, 3, 15, 18, 21, 24


@jit
def note(s: Arr, src: Arr, calm: Arr, free: Arr, row: Arr) -> None:
    """Fill a row [NHIST] from the state [NS] of who sheds, its source vector, calm air and air with gusts [3] (m/s, NED)."""
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(s[0], s[1], s[2], s[3])
    for i in range(4):
        at = K_WING if i < 2 else K_TAIL
        x, z, side = src[at], src[at + 2], 0.5 * src[at + 3]
        y = src[at + 1] + (side if i % 2 else -side)
        j = H_ARM + 3 * i
        row[j], row[j + 1], row[j + 2] = (
            c00 * x + c01 * y + c02 * z,
            c10 * x + c11 * y + c12 * z,
            c20 * x + c21 * y + c22 * z,
        )
    row[H_DOWN], row[H_DOWN + 1], row[H_DOWN + 2] = c02, c12, c22
    for i in range(3):
        row[H_POS + i] = s[n.S_P + i]
        row[H_CALM + i] = calm[i]
        row[H_GUST + i] = free[i] - calm[i]


@jit
def lie(
    hist: Arr,
    k: int,
    dt: float,
    away: Arr,
    speed: float,
    slope: float,
    rolled: float,
    fade: float,
    meander: float,
    nodes: Arr,
) -> None:
    """Fill nodes [4, m, 4]: places of the four vortices at distances `away` [m] behind their roots, from the cg now [m, NED], and
    their age [s].

    hist [r, NHIST], newest row k % r, dt [s] apart. Since it was shed an element has drifted with the air of its place (calm,
    and `meander` times its gust) and sunk along the body's down axis: slope (x - e (1 - exp(-x/e))), e = `rolled` [m], less by
    the decay `fade` [1/s].
    """
    size = hist.shape[0]
    now = k % size
    for j in range(away.shape[0]):
        ticks = min(away[j] / (speed * dt), float(size - 2))
        age, i0 = ticks * dt, int(ticks)
        f = ticks - i0
        p, q = (k - i0) % size, (k - i0 - 1) % size
        x = age * speed
        down = slope * (x - rolled * (1.0 - math.exp(-x / rolled)))
        if fade * age > 1e-9:
            down *= (1.0 - math.exp(-fade * age)) / (fade * age)
        for i in range(3):
            place = hist[p, i] + f * (hist[q, i] - hist[p, i]) - hist[now, i]
            calm = hist[p, H_CALM + i] + f * (hist[q, H_CALM + i] - hist[p, H_CALM + i])
            gust = hist[p, H_GUST + i] + f * (hist[q, H_GUST + i] - hist[p, H_GUST + i])
            axis = hist[p, H_DOWN + i] + f * (hist[q, H_DOWN + i] - hist[p, H_DOWN + i])
            place += age * (calm + meander * gust) + down * axis
            for leg in range(4):
                c = H_ARM + 3 * leg + i
                nodes[leg, j, i] = place + hist[p, c] + f * (hist[q, c] - hist[p, c])
        for leg in range(4):
            nodes[leg, j, 3] = age


@jit
def piece(x: float, y: float, z: float, a: Arr, b: Arr, far: bool, core2: float, nu: float) -> V3:
    """Velocity over circulation [1/m] at a point [m] of the straight vortex from node a to node b [4], to infinity if `far`;
    circulation along it, core^2 [m^2], viscosity [m^2/s]: as vortex.leg, the age that of its middle."""
    dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    long = math.sqrt(dx * dx + dy * dy + dz * dz)
    if long < 1e-6:
        return 0.0, 0.0, 0.0
    dx, dy, dz = dx / long, dy / long, dz / long
    px, py, pz = x - a[0], y - a[1], z - a[2]
    along = px * dx + py * dy + pz * dz
    hx, hy, hz = px - along * dx, py - along * dy, pz - along * dz
    h2 = hx * hx + hy * hy + hz * hz
    near = along / math.sqrt(h2 + along * along + 1e-18)
    rest = along - long
    end = -1.0 if far else rest / math.sqrt(h2 + rest * rest + 1e-18)
    f = (near - end) / (4.0 * math.pi * (h2 + core2))
    age = 0.5 * (a[3] + b[3])
    if nu > 0.0 and age > 0.0:
        old = h2 / (4.0 * nu * age)
        if old < 40.0:
            f *= 1.0 - math.exp(-old)
    return f * (dy * hz - dz * hy), f * (dz * hx - dx * hz), f * (dx * hy - dy * hx)


@jit
def trail_velocity(x: float, y: float, z: float, nodes: Arr, gamma: Arr, fade: float, src: Arr) -> V3:
    """Velocity [m/s, NED] at a point [m, NED from the cg of who sheds] of its four vortices; gamma [2]: wing, tail [m^2/s]."""
    u = v = w = 0.0
    last = nodes.shape[1] - 2
    for leg in range(4):
        core = src[(K_WING if leg < 2 else K_TAIL) + 4]
        g = gamma[leg // 2] * (1.0 if leg % 2 else -1.0)
        for j in range(last + 1):
            a, b = nodes[leg, j], nodes[leg, j + 1]
            g_here = g * math.exp(-0.5 * fade * (a[3] + b[3])) if fade > 0.0 else g
            du, dv, dw = piece(x, y, z, a, b, j == last, core * core, src[K_NU])
            u, v, w = u + g_here * du, v + g_here * dv, w + g_here * dw
    return u, v, w


@jit
def trail_on_airframe(
    st: Arr,
    obs: Arr,
    src: Arr,
    nodes: Arr,
    fade: float,
    sr: Arr,
    points: Arr,
    weight: Arr,
    n_span: int,
    n_frame: int,
    wind: Arr,
    probe_wake: Arr,
) -> None:
    """vortex.wake_on_airframe with vortices that lie at `nodes`; the bound ones as there."""
    t00, t01, t02, t10, t11, t12, t20, t21, t22 = quat_dcm(st[0], st[1], st[2], st[3])
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(sr[0], sr[1], sr[2], sr[3])
    ox, oy, oz = sr[10] - st[10], sr[11] - st[11], sr[12] - st[12]
    gw, gt = source_strength(obs, src)
    gamma = np.array([gw, gt])
    for i in range(points.shape[0]):
        bx, by, bz = points[i, 0], points[i, 1], points[i, 2]
        dn = ox + c00 * bx + c01 * by + c02 * bz
        de = oy + c10 * bx + c11 * by + c12 * bz
        dd = oz + c20 * bx + c21 * by + c22 * bz
        un, ue, ud = trail_velocity(dn, de, dd, nodes, gamma, fade, src)
        x = t00 * dn + t10 * de + t20 * dd
        y = t01 * dn + t11 * de + t21 * dd
        z = t02 * dn + t12 * de + t22 * dd
        for at, g in ((K_WING, gw), (K_TAIL, gt)):
            a, b, c = bound(x - src[at], y - src[at + 1], z - src[at + 2], 0.5 * src[at + 3], g, src[at + 4])
            un, ue, ud = (
                un + t00 * a + t01 * b + t02 * c,
                ue + t10 * a + t11 * b + t12 * c,
                ud + t20 * a + t21 * b + t22 * c,
            )
        if i >= n_frame:
            probe_wake[i - n_frame, 0] += un
            probe_wake[i - n_frame, 1] += ue
            probe_wake[i - n_frame, 2] += ud
            continue
        wy = c01 * un + c11 * ue + c21 * ud
        wz = c02 * un + c12 * ue + c22 * ud
        feel(i, n_span, weight, un, ue, ud, wy, wz, wind)
