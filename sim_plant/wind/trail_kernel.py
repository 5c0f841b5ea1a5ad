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
def cut(nodes: Arr, fade: float, parts: Arr) -> None:
    """Fill parts [4, m - 1, 9] with the straight vortices between nodes [4, m, 4]: start [m, NED], unit vector, length [m], share
    of the circulation left after its age at decay `fade` [1/s], over 4 pi, left legs negative; age of its middle [s]."""
    for leg in range(4):
        for j in range(parts.shape[1]):
            a, b, out = nodes[leg, j], nodes[leg, j + 1], parts[leg, j]
            dx, dy, dz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            long = max(math.sqrt(dx * dx + dy * dy + dz * dz), 1e-9)
            age = 0.5 * (a[3] + b[3])
            out[0], out[1], out[2] = a[0], a[1], a[2]
            out[3], out[4], out[5], out[6] = dx / long, dy / long, dz / long, long
            out[7] = (1.0 if leg % 2 else -1.0) * math.exp(-fade * age) / (4.0 * math.pi)
            out[8] = age


@jit
def lie(
    hist: Arr,
    k: int,
    dt: float,
    away: Arr,
    obs: Arr,
    src: Arr,
    sink: bool,
    roll_up: float,
    fade: float,
    meander: float,
    nodes: Arr,
    parts: Arr,
) -> None:
    """Fill nodes [4, m, 4]: places of the four vortices at distances `away` [m] behind their roots, from the cg now [m, NED], and
    their age [s]; and the parts between them (cut).

    hist [r, NHIST], newest row k % r, dt [s] apart. Since it was shed an element has drifted with the air of its place (calm,
    and `meander` times its gust) and, with `sink`, sunk along the body's down axis: gamma / (2 pi b V) (x - e (1 - exp(-x/e))),
    e = roll_up V b^2 / gamma [m], less by the decay `fade` [1/s].
    """
    gamma, b, speed = source_strength(obs, src)[0], src[K_WING + 3], obs[n.O_V]
    slope = gamma / (2.0 * math.pi * b * speed) if sink else 0.0
    rolled = max(1.0, roll_up * speed * b * b / max(gamma, 1.0))
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
    cut(nodes, fade, parts)


@jit
def lay_trail(
    s: Arr,
    calm: Arr,
    free: Arr,
    hist: Arr,
    k: int,
    dt: float,
    away: Arr,
    obs: Arr,
    src: Arr,
    sink: bool,
    roll_up: float,
    fade: float,
    meander: float,
    nodes: Arr,
    parts: Arr,
) -> None:
    """`note` tick k in the history, then `lie`."""
    note(s, src, calm, free, hist[k % hist.shape[0]])
    lie(hist, k, dt, away, obs, src, sink, roll_up, fade, meander, nodes, parts)


@jit
def trail_velocity(x: float, y: float, z: float, parts: Arr, gw: float, gt: float, src: Arr) -> V3:
    """Velocity [m/s, NED] at a point [m, NED from the cg of who sheds] of its four vortices of `parts`, the last of each to
    infinity; circulation [m^2/s] of wing and tail; core and ageing as in vortex.leg, the age that of a part's middle."""
    u = v = w = 0.0
    last = parts.shape[1] - 1
    nu4 = 4.0 * src[K_NU]
    for leg in range(4):
        core = src[(K_WING if leg < 2 else K_TAIL) + 4]
        core2, gamma = core * core, gw if leg < 2 else gt
        px, py, pz = x - parts[leg, 0, 0], y - parts[leg, 0, 1], z - parts[leg, 0, 2]
        p2 = px * px + py * py + pz * pz
        near = math.sqrt(p2 + 1e-18)
        for j in range(last + 1):
            dx, dy, dz, long = parts[leg, j, 3], parts[leg, j, 4], parts[leg, j, 5], parts[leg, j, 6]
            along = px * dx + py * dy + pz * dz
            h2 = max(0.0, p2 - along * along)
            rest = along - long
            if j < last:
                qx, qy, qz = x - parts[leg, j + 1, 0], y - parts[leg, j + 1, 1], z - parts[leg, j + 1, 2]
                p2 = qx * qx + qy * qy + qz * qz
                far = math.sqrt(p2 + 1e-18)
                over = near * far
                ends = along * far - rest * near
            else:
                qx, qy, qz, far = px, py, pz, near
                over = near
                ends = along + near
            f = gamma * parts[leg, j, 7] * ends / (over * (h2 + core2))
            old = nu4 * parts[leg, j, 8]
            if h2 < 40.0 * old:
                f *= 1.0 - math.exp(-h2 / old)
            u += f * (dy * pz - dz * py)
            v += f * (dz * px - dx * pz)
            w += f * (dx * py - dy * px)
            px, py, pz, near = qx, qy, qz, far
    return u, v, w


@jit
def trail_on_airframe(
    st: Arr,
    obs: Arr,
    src: Arr,
    parts: Arr,
    sr: Arr,
    points: Arr,
    weight: Arr,
    n_span: int,
    n_frame: int,
    wind: Arr,
    probe_wake: Arr,
) -> None:
    """vortex.wake_on_airframe with vortices that lie as `parts` say; the bound ones as there."""
    t00, t01, t02, t10, t11, t12, t20, t21, t22 = quat_dcm(st[0], st[1], st[2], st[3])
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(sr[0], sr[1], sr[2], sr[3])
    ox, oy, oz = sr[10] - st[10], sr[11] - st[11], sr[12] - st[12]
    gw, gt = source_strength(obs, src)
    for i in range(points.shape[0]):
        bx, by, bz = points[i, 0], points[i, 1], points[i, 2]
        dn = ox + c00 * bx + c01 * by + c02 * bz
        de = oy + c10 * bx + c11 * by + c12 * bz
        dd = oz + c20 * bx + c21 * by + c22 * bz
        un, ue, ud = trail_velocity(dn, de, dd, parts, gw, gt, src)
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
