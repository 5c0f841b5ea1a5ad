"""The source's rendezvous in plain numpy, all flights abreast: three-state filter, closed loop with gain k.

Written from the equations, not from the kernels: the yardstick of speed, and a check of the compiled loop, which must give
the same misses from the same normals. Rule A, unlimited roll rate, no wind, SI.
"""

from __future__ import annotations

import math
import time

import numpy as np

from flightsw.missions.rendezvous.params import KN, NM
from hil_scripts.studies.rivard import mc

Array = np.ndarray
V, G, SEP = 396.0 * KN, 9.80665, 2.0 * NM
TF, SF, SC = 455.0, 10.0 * KN, 6.0 * KN
TN, SN, SB = 3.6, 0.016 * NM, 0.1 * NM
QY = (500.0 * 0.3048) ** 2 / 600.0
A0, RE = 304.8, 3444.0 * NM


def _move(s: Array, dt: Array | float, z: Array) -> None:
    """Receiver rows s [8, n] by dt [s] with normals z [n, 4]."""
    r = np.asarray(dt) / TF
    a = np.exp(-r)
    ff = SF**2 * (1.0 - a * a)
    xf = SF**2 * TF * (1.0 - a) ** 2
    xx = 2.0 * SF**2 * TF**2 * (r - 2.0 * (1.0 - a) + 0.5 * (1.0 - a * a))
    e2 = np.sqrt(ff) * z[:, 0]
    s[0] += (-V + s[1]) * dt + TF * (1.0 - a) * s[2]
    s[0] += xf / ff * e2 + np.sqrt(np.maximum(xx - xf * xf / ff, 0.0)) * z[:, 1]
    s[2] = a * s[2] + e2
    s[3] += s[4] * dt + np.sqrt(QY * dt) * z[:, 2]
    c = np.exp(-np.asarray(dt) / TN)
    s[7] = c * s[7] + SN * np.sqrt(1.0 - c * c) * z[:, 3]


def _plan(x: Array, y: Array, psi: Array, f: Array, top: float, low: float) -> tuple[Array, Array, Array, Array, Array]:
    """Bank, limited, miss, time to go and heading left of turns from (x, y, psi) for estimates f (x, v, y)."""
    left = math.pi - psi
    num, den = V * V * (1.0 + np.cos(psi)), G * (f[2] - y)
    limited = (den <= 0.0) | (num >= den * math.tan(top))
    phi = np.where(limited, top, np.maximum(np.arctan(num / np.where(limited, 1.0, den)), low))
    r = V * V / (G * np.tan(phi))
    miss = f[0] + f[1] * left * r / V - SEP - (x - r * np.sin(psi))
    return phi, limited, miss, miss / (V * np.cos(psi) - f[1]), left


def _bank(phi: Array, limited: Array, miss: Array, left: Array, k: float, top: float) -> Array:
    """Closed-loop bank with the guard."""
    rc = V * V / (G * np.tan(phi)) + k * miss / left
    rmin = V * V / (G * math.tan(top))
    return np.where(limited | (rc < rmin), top, np.arctan(V * V / (G * np.maximum(rc, rmin))))


def _arc(x: Array, y: Array, psi: Array, phi: Array, dt: Array | float) -> None:
    """Fly circular arcs in place."""
    w = G * np.tan(phi) / V
    r = V / w
    new = psi + w * dt
    x += r * (np.sin(new) - np.sin(psi))
    y += r * (np.cos(psi) - np.cos(new))
    psi[:] = new


def _block(W: Array, case: mc.RivardCase) -> tuple[Array, Array]:
    """x_m, y_m [n] of the rendezvous whose receiver normals are W; NaN where unfinished."""
    n, dt, p = len(W), case.range_s, case.nav
    k, top, low = case.guid.gain, math.radians(case.guid.bank_max_deg), math.radians(case.guid.bank_min_deg)
    s = np.empty((8, n))
    start = (0.0, SC, SF, case.sigma_y_nm * NM, 0.55 * math.sqrt(2.0) * KN, 150.0 * 0.3048, SB, SN)
    for i, sig in enumerate(start):
        s[i] = sig * W[:, i - 1] if i else math.sqrt(case.range_nm**2 - case.offset_nm**2) * NM
    x, y, psi = np.zeros(n), np.full(n, -case.offset_nm * NM), np.zeros(n)
    turning, phi_c = np.zeros(n, bool), np.zeros(n)
    P = np.zeros((6, n))  # 11 12 13 22 23 33
    f = np.zeros((3, n))
    idx = np.arange(n)
    xm, ym = np.full(n, np.nan), np.full(n, np.nan)
    steps = (W.shape[1] - 8) // 4
    for j in range(steps - 1):
        z = W[idx, 8 + 4 * j : 12 + 4 * j]
        if j:
            _move(s, dt, z)
        h = np.sqrt((s[0] - x) ** 2 + (s[3] - y) ** 2)
        d = np.sqrt(h * h + (A0 + s[5] + RE * (1.0 - np.cos(h / RE))) ** 2) + s[6] + s[7]
        if j == 0:
            v, Y = (case.sigma_y_nm * NM) ** 2, -y
            X2 = d * d - Y * Y - p.altitude_separation_m**2
            X = np.sqrt(X2)
            f[0], f[1] = x + X, -V
            P[0] = (d * d * (SB**2 + SN**2) + Y * Y * v) / X2
            P[2], P[3], P[5] = -Y / X * v, SC**2 + SF**2, v
        else:
            f[0] += f[1] * dt
            P[0] += 2.0 * P[1] * dt + P[3] * dt**2 + p.ekf3_qx_m2ps3 * dt**3 / 3.0
            P[1] += P[3] * dt + p.ekf3_qx_m2ps3 * dt**2 / 2.0
            P[2] += P[4] * dt
            P[3] += p.ekf3_qx_m2ps3 * dt
            P[5] += p.ekf3_qy_m2ps * dt
            X, Y = f[0] - x, f[2] - y
            df = np.sqrt(X * X + Y * Y + p.altitude_separation_m**2)
            bc = 0.5 * ((1.0 / df - X * X / df**3) * P[0] + (1.0 / df - Y * Y / df**3) * P[5])
            h1, h3 = X / df, Y / df
            g = (P[0] * h1 + P[2] * h3, P[1] * h1 + P[4] * h3, P[2] * h1 + P[5] * h3)
            S = h1 * g[0] + h3 * g[2] + p.ekf3_r_m2
            nu = (d - df - bc) / S
            for i in range(3):
                f[i] += g[i] * nu
            for m, (a, b) in enumerate(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))):
                P[m] -= g[a] * g[b] / S
        phi, limited, miss, ttg, left = _plan(x, y, psi, f, top, low)
        ending = np.zeros(len(idx), bool)
        when = np.zeros(len(idx))
        was = turning.copy()
        if was.any():
            w = np.flatnonzero(was)
            phi_c[w] = _bank(phi[w], limited[w], miss[w], left[w], k, top)
            when[w] = left[w] * V / (G * np.tan(phi_c[w]))
            ending[w] = when[w] < dt
            go = w[~ending[w]]
            xs, ys, ps = x[go], y[go], psi[go]
            _arc(xs, ys, ps, phi_c[go], dt)
            x[go], y[go], psi[go] = xs, ys, ps
            go = w[ending[w]]
            xs, ys, ps = x[go], y[go], psi[go]
            _arc(xs, ys, ps, phi_c[go], when[go])
            x[go], y[go] = xs, ys
        straight = np.flatnonzero(~was & (ttg >= dt))
        x[straight] += V * dt
        begin = np.flatnonzero(~was & (ttg < dt))
        if len(begin):
            lead = np.maximum(ttg[begin], 0.0)
            ahead = np.array((f[0, begin] + f[1, begin] * lead, f[1, begin], f[2, begin]))
            xs, ys, ps = x[begin] + V * lead, y[begin], psi[begin]
            ph, li, mi, _, le = _plan(xs, ys, ps, ahead, top, low)
            phi_c[begin] = _bank(ph, li, mi, le, k, top)
            _arc(xs, ys, ps, phi_c[begin], dt - lead)
            x[begin], y[begin], psi[begin] = xs, ys, ps
            turning[begin] = True
        if ending.any():
            e = np.flatnonzero(ending)
            last = s[:, e].copy()
            _move(last, when[e], W[idx[e], 8 + 4 * (j + 1) : 12 + 4 * (j + 1)])
            xm[idx[e]], ym[idx[e]] = last[0] - SEP - x[e], last[3] - y[e]
            keep = ~ending
            s, P, f = s[:, keep], P[:, keep], f[:, keep]
            x, y, psi, turning, phi_c, idx = x[keep], y[keep], psi[keep], turning[keep], phi_c[keep], idx[keep]
            if not len(idx):
                break
    return xm, ym


def run_numpy(case: mc.RivardCase, n: int, seed: int = mc.SEED, chunk: int = 32) -> tuple[Array, float]:
    """x_m, y_m [n, 2] of rendezvous 0 ... n-1, and the wall time [s]; `chunk` blocks of 256 flown abreast.

    Only the source's setting: three-state filter, cross-track or closed loop, rule A, no wind, unlimited roll; ValueError
    otherwise.
    """
    plain = case.but(guid_gain=3.0, guid_law="closed_loop")
    if plain != mc.RivardCase():
        raise ValueError("run_numpy: only the default setting with another gain is written in plain numpy")
    if case.guid.law == "cross_track":
        case = case.but(guid_gain=0.0)
    began = time.perf_counter()
    out = np.full((n, 2), np.nan)
    blocks = -(-n // mc.BLOCK)
    for b0 in range(0, blocks, chunk):
        ids = range(b0, min(b0 + chunk, blocks))
        W = np.concatenate([mc.draw(case, seed, b)[0] for b in ids])
        lo = b0 * mc.BLOCK
        W = W[: n - lo]
        part = np.stack(_block(W, case), axis=1)
        slow = np.flatnonzero(np.isnan(part[:, 0]))
        if len(slow):
            rows = [mc.draw(case, seed, b0 + i // mc.BLOCK, True)[0][i % mc.BLOCK] for i in slow.tolist()]
            part[slow] = np.stack(_block(np.array(rows), case), axis=1)
        out[lo : lo + len(W)] = part
    return out, time.perf_counter() - began


def bench(n: int = 100_000, seed: int = mc.SEED) -> dict[str, float]:
    """Seconds for n seed-filter rendezvous compiled and in plain numpy, in this process; ratios of wall and CPU time."""
    case = mc.RivardCase()
    mc.run_case(case, 2 * mc.BLOCK)  # compile, warm up
    run_numpy(case, 2 * mc.BLOCK)
    c0 = time.process_time()
    one = mc.run_case(case, n, seed, workers=1, samples=False)
    c1 = time.process_time()
    two = mc.run_case(case, n, seed, workers=2, samples=False)
    c2 = time.process_time()
    rows, wall = run_numpy(case, n, seed)
    c3 = time.process_time()
    apart = np.abs(rows - two.rows[:, 2:4])
    return {
        "n": float(n),
        "compiled.one_thread_s": one.wall_s,
        "compiled.two_threads_s": two.wall_s,
        "compiled.cpu_s": c1 - c0,
        "numpy_s": wall,
        "numpy.cpu_s": c3 - c2,
        "ratio.one_thread": wall / one.wall_s,
        "ratio.two_threads": wall / two.wall_s,
        "ratio.cpu": (c3 - c2) / (c1 - c0),
        "median_difference_m": float(np.nanmedian(apart)),
        "largest_difference_m": float(np.nanmax(apart)),
    }
