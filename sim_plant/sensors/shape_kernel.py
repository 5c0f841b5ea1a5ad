"""What a sensor makes of the quantity it measures: place, bearings that rub, lag, scale, misalignment, quantisation. Compiled.

Vanes whose bearings rub: a vane stays in its bearing until the air's torque on it overcomes the friction. The torque of the air
about the pivot is q S l C' (a - z), a the direction of the air, z the vane's; Coulomb friction M holds it while
|a - z| < M / (q S l C'). The term `friction` is M / (S l C') [rad Pa], so that the angle is friction / q: what does not show at
195 m/s does at 20. Vanes settle within a sample (their own lag follows), and so z is a kept within the angle to both sides: play.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.jit import jit

Arr = NDArray[np.float64]
# rows of the work array, column by column of the reading: lag y' = a y + b0 t' + b1 t; step of the output; friction of a bearing;
# sign of what is measured; y, t and bearing of the last sample; shares of the sky (shared.py) and of its gradients, and the
# sky before and after now, each at the origin and its change to the north and east; scale and misalignment from NWORK on
W_A, W_B0, W_B1, W_QUANTUM, W_FRICTION, W_SIGN, W_Y, W_T, W_Z, W_COMMON, W_GRADIENT, W_SKY, NWORK = *range(12), 17
# lever: arm [3, m], period [s], body rates of the last sample [3, rad/s] (NaN: none), NaN before the first sample
L_LAST, L_FRESH, NLEVER = 4, 7, 8
NODE_US = 1_000_000  # [us] between values of the sky, linear in between
SHAPES, LEVER_ACC, LEVER_GNSS, RUBS, SKY = 1, 2, 4, 8, 16  # bits of `how`
# a sensor of a store (rows.py): its work array, its lever, its error rows one below the other; as whole numbers the form of its
# reading (bank_kernel.py), its columns, `how`, the next error row, whose it is in a store of several aircraft, `at`
WIDTH = 3 * n.MAX_PROBES
LEVER, HEAD = NWORK + WIDTH, NWORK + WIDTH + 1
K_FORM, K_WIDTH, K_HOW, K_NEXT, K_OWNER, K_AT = 0, 1, 2, 3, 4, 5


@jit
def entry(s: Arr, o: Arr, r: Arr, k: int) -> float:
    """Entry k of state `s` [NS], observation `o` [NO] and relative motion `r` [NR] one after the other; -1: 0."""
    if k >= n.NS + n.NO:
        return r[k - n.NS - n.NO]
    if k >= n.NS:
        return o[k - n.NS]
    return s[k] if k >= 0 else 0.0


@jit
def told(
    s: Arr,
    o: Arr,
    r: Arr,
    rows: Arr,
    i: int,
    at: NDArray[np.int64],
    work: Arr,
    lever: Arr,
    how: int,
    past: float,
    out: Arr,
) -> None:
    """Write into `out` [m] what must be added to the measured row t [m] so that the reading is Q(mat y + e).

    Column c measures `entry` at[c]. e = rows[i] [m] and, by the bits `how`, the sky's at the share `past` of the way from the
    one before to the one after, and the lever arm's part; y: t, held in a vane's bearing,
    through the lag; Q rounds to multiples of the step (0: not). `work` [NWORK + m, m] and `lever` [NLEVER] as above; both
    remember the sample. Columns beyond m are left alone.
    """
    e, m = rows[i], at.shape[0]
    if how & SKY:
        for c in range(m):
            if work[W_COMMON, c] > 0.0 or work[W_GRADIENT, c] > 0.0:
                e[c] += sky(work, c, past, s[n.S_P], s[n.S_P + 1])
    if how & LEVER_ACC:
        lever_acc(s[n.S_W : n.S_W + 3], lever, e)
    elif how & LEVER_GNSS:
        lever_gnss(s, lever, e)
    if not how & SHAPES:
        for c in range(m):
            out[c] = e[c]
        return
    fresh = math.isnan(lever[L_FRESH])
    lever[L_FRESH] = 1.0
    for c in range(m):
        out[c] = work[W_SIGN, c] * entry(s, o, r, at[c])
    if how & RUBS:
        held(isa(-s[n.S_P + 2])[2], fresh, work, out)
    for c in range(m):
        z = work[W_Z, c] if how & RUBS and work[W_FRICTION, c] > 0.0 else out[c]
        if fresh:
            work[W_Y, c] = z
        else:
            work[W_Y, c] = work[W_A, c] * work[W_Y, c] + work[W_B0, c] * z + work[W_B1, c] * work[W_T, c]
        work[W_T, c] = z
    for c in range(m):
        x, q, z = e[c], work[W_QUANTUM, c], work[W_T, c]
        for j in range(m):
            x += work[NWORK + c, j] * work[W_Y, j]
        if q > 0.0:
            x = q * math.floor(x / q + 0.5)
        out[c] = x - out[c]


@jit
def sky(work: Arr, c: int, past: float, north: float, east: float) -> float:
    """Error [m] that all who are near share, in column c at a place [m]."""
    a, b = work[W_SKY : W_SKY + 3, c], work[W_SKY + 3 : W_SKY + 6, c]
    at, dn, de = a[0] + past * (b[0] - a[0]), a[1] + past * (b[1] - a[1]), a[2] + past * (b[2] - a[2])
    return work[W_COMMON, c] * at + work[W_GRADIENT, c] * (dn * north + de * east)


@jit
def held(rho: float, fresh: bool, work: Arr, t: Arr) -> None:
    """Move the vanes' bearings work[W_Z] to the air data `t` [m] (V, alpha, beta of probe 0, of probe 1, ...) in air of density
    rho [kg/m^3]. The first sample finds them settled."""
    for c in range(t.shape[0]):
        friction = work[W_FRICTION, c]
        if friction <= 0.0:
            continue
        v, a = t[c - c % 3], t[c]
        q, z = 0.5 * rho * v**2, a if fresh else work[W_Z, c]
        if q * abs(a - z) > friction:
            z = a + (friction / q if z > a else -friction / q)
        work[W_Z, c] = z


@jit
def lever_acc(w: Arr, lever: Arr, row: Arr) -> None:
    """Add to row[3:6] the specific force at r = lever[:3] [m] from the cg over that at it: w' x r + w x (w x r) [m/s^2].

    w [3, rad/s] of this sample; w' is its difference from the last one's over the period.
    """
    d0 = d1 = d2 = 0.0
    period, last = lever[3], lever[L_LAST : L_LAST + 3]
    if not math.isnan(last[0]):
        d0, d1, d2 = (w[0] - last[0]) / period, (w[1] - last[1]) / period, (w[2] - last[2]) / period
    last[0], last[1], last[2] = w[0], w[1], w[2]
    r0, r1, r2 = lever[0], lever[1], lever[2]
    u0, u1, u2 = w[1] * r2 - w[2] * r1, w[2] * r0 - w[0] * r2, w[0] * r1 - w[1] * r0
    row[3] += d1 * r2 - d2 * r1 + w[1] * u2 - w[2] * u1
    row[4] += d2 * r0 - d0 * r2 + w[2] * u0 - w[0] * u2
    row[5] += d0 * r1 - d1 * r0 + w[0] * u1 - w[1] * u0


@jit
def lever_gnss(s: Arr, r: Arr, row: Arr) -> None:
    """Add position C r [m] and velocity C (w x r) [m/s] of an antenna at r[:3] [m], body axes, to row[0:3] and row[3:6].

    s [NS]: quaternion q_nb and body rates [rad/s] first; C turns body to NED.
    """
    q0, q1, q2, q3 = s[0], s[1], s[2], s[3]
    for k in range(2):
        x, y, z = r[0], r[1], r[2]
        if k == 1:
            x, y, z = s[5] * r[2] - s[6] * r[1], s[6] * r[0] - s[4] * r[2], s[4] * r[1] - s[5] * r[0]
        row[3 * k] += (
            (1.0 - 2.0 * (q2 * q2 + q3 * q3)) * x + 2.0 * (q1 * q2 - q0 * q3) * y + 2.0 * (q1 * q3 + q0 * q2) * z
        )
        row[3 * k + 1] += (
            2.0 * (q1 * q2 + q0 * q3) * x + (1.0 - 2.0 * (q1 * q1 + q3 * q3)) * y + 2.0 * (q2 * q3 - q0 * q1) * z
        )
        row[3 * k + 2] += (
            2.0 * (q1 * q3 - q0 * q2) * x + 2.0 * (q2 * q3 + q0 * q1) * y + (1.0 - 2.0 * (q1 * q1 + q2 * q2)) * z
        )
