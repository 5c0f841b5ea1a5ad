"""The last readings of an attitude reference beside the gyro, in one array, and what is asked of them at every reading
(turning.py, docs/sources/recovery.md 9)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import density
from flightsw.kernels.jit import jit, jit_own
from flightsw.sixdof.forces import moment_rates
from flightsw.sixdof.moments import LEAST_WILD, WILD, Moments, Step
from flightsw.types import ZERO3, Vec3

KEPT = 512  # steps: more than the longest window and what is before it, at 100 Hz
BIAS, SCALE = 2e-3, 0.02  # [rad/s] change of a gyro's bias, [-] of a turn: scale, misalignment, sampling
TWO = 2.0  # power that is not known to the compiler: the product of a number with itself is another in its last digit
# columns, as the fields of moments.Step
MORE, TURN, SIZE, TIME, LONG, SPEED, BETA, ALPHA, RHO, CONTROLS = 0, 3, 6, 9, 10, 11, 12, 13, 14, 15
WIDTH = CONTROLS + 4
# what `looked` finds: by how much the reference has turned more than the gyro over the first window [3] rad, 0 while it is not
# full; to which side the gyro's rate about each axis goes as no moments do [3] (-1, 0, 1)
APART, SIDES, OUT = 0, 3, 6
AXES_OF = tuple(tuple(i for i in range(3) if mask >> i & 1) for mask in range(8))


@jit
def before(ring: np.ndarray, n: int, T: float) -> int:
    """Index, from the oldest kept, of the latest of n steps in the ring [KEPT,WIDTH] T [s] before the last; -1: none."""
    kept = ring.shape[0]
    then = ring[(n - 1) % kept, TIME] - T + 1e-6
    count = min(n, kept)
    i = count - 1
    while i >= 0 and ring[(n - count + i) % kept, TIME] > then:
        i -= 1
    return i


@jit
def apart(
    ring: np.ndarray, n: int, i: int, scatter: float, rate2: float, count: int, two: float
) -> tuple[float, float, float, float, float, float]:
    """By how much the reference has turned more than the gyro between step i and the last of n [rad], and one sigma of that.

    scatter [rad^2]: variance of a reading of the reference, rate2 [rad^2/s^2] of one of the gyro's rates, of which a step has
    `count`; two: 2.0.
    """
    kept = ring.shape[0]
    now, then = ring[(n - 1) % kept], ring[(n - min(n, kept) + i) % kept]
    span = now[TIME] - then[TIME]
    white = 2.0 * scatter + rate2 * span * now[LONG] / count + math.pow(BIAS * span, two)
    return (
        now[MORE] - then[MORE],
        now[MORE + 1] - then[MORE + 1],
        now[MORE + 2] - then[MORE + 2],
        math.sqrt(white + math.pow(SCALE * (now[SIZE] - then[SIZE]), two)),
        math.sqrt(white + math.pow(SCALE * (now[SIZE + 1] - then[SIZE + 1]), two)),
        math.sqrt(white + math.pow(SCALE * (now[SIZE + 2] - then[SIZE + 2]), two)),
    )


@jit_own
def looked(
    ring: np.ndarray, n: int, mx: float, my: float, mz: float, tx: float, ty: float, tz: float, dt: float,
    V: float, beta: float, alpha: float, h: float, u: np.ndarray, windows: np.ndarray, k: float, scatter: float, rate2: float,
    count: int, two: float, P: np.ndarray, lasting: np.ndarray, jump: np.ndarray, lack: np.ndarray, fm: np.ndarray,
    out: np.ndarray,
) -> tuple[int, int, int]:  # fmt: skip
    """Step n of the `ring` [KEPT,WIDTH] <- a reading, `dt` [s] after the last: the reference has turned (mx, my, mz) [rad] more
    than the gyro, that (tx, ty, tz); V [m/s], beta, alpha [rad], h [m], controls u [4] of now. out [OUT] <- what is found;
    index of each window's first step (-1: not full), and the axes beyond it: of the first in bits 0 to 2, of the last in 3 to 5.

    windows [2] s; k [-] sigmas that count; scatter, rate2, count, two as `apart`; P, lasting, jump, lack [3], fm as Moments has
    them: lack [3] <- angular acceleration [rad/s^2] that its model misses of this step.
    """
    kept = ring.shape[0]
    s, old = ring[n % kept], ring[(n - 1) % kept]
    s[MORE], s[MORE + 1], s[MORE + 2] = mx, my, mz
    s[TURN], s[TURN + 1], s[TURN + 2] = tx, ty, tz
    s[SIZE], s[SIZE + 1], s[SIZE + 2] = abs(tx), abs(ty), abs(tz)
    s[TIME] = dt
    if n > 0:
        for i in range(LONG):
            s[i] += old[i]
    s[LONG], s[SPEED], s[BETA], s[ALPHA], s[RHO] = dt, V, beta, alpha, density(h)
    for i in range(4):
        s[CONTROLS + i] = u[i]
    n += 1
    for i in range(OUT):
        out[i] = 0.0
    axes, before_first, before_last = 0, before(ring, n, windows[0]), before(ring, n, windows[1])
    for w in range(2):
        first = before_first if w == 0 else before_last
        if first >= 0:
            x, y, z, a, b, c = apart(ring, n, first, scatter, rate2, count, two)
            if w == 0:
                out[APART], out[APART + 1], out[APART + 2] = x, y, z
            axes |= (1 if abs(x) > k * a else 0) << 3 * w
            axes |= (2 if abs(y) > k * b else 0) << 3 * w
            axes |= (4 if abs(z) > k * c else 0) << 3 * w
    if n > 2:
        a0, b0 = ring[(n - 3) % kept], ring[(n - 2) % kept]
        w0 = np.empty(3)
        for i in range(3):
            w0[i] = (b0[TURN + i] - a0[TURN + i]) / b0[LONG]
        p, q, r = moment_rates(V, beta, alpha, w0, s[CONTROLS:], s[RHO], P, fm)
        lack[0] = ((s[TURN] - b0[TURN]) / dt - w0[0]) / dt - p
        lack[1] = ((s[TURN + 1] - b0[TURN + 1]) / dt - w0[1]) / dt - q
        lack[2] = ((s[TURN + 2] - b0[TURN + 2]) / dt - w0[2]) / dt - r
        for i in range(3):
            off = lack[i] - lasting[i]
            if off * off > max(WILD * WILD * jump[i], LEAST_WILD * LEAST_WILD):
                out[SIDES + i] = math.copysign(1.0, off)
    return before_first, before_last, axes


@jit_own
def turned(
    ring: np.ndarray, n: int, i: int, p: float, q: float, r: float, P: np.ndarray, lasting: np.ndarray, fm: np.ndarray
) -> tuple[float, float, float]:
    """The turn [rad] that the moments of the steps after step i, to the last of n, make of rates p, q, r [rad/s]: by Euler's
    equation, step by step. ring [KEPT,WIDTH]; P, lasting [3] rad/s^2, fm [9] as Moments has them."""
    kept, w = ring.shape[0], np.empty(3)
    w[0], w[1], w[2] = p, q, r
    x = y = z = 0.0
    for k in range(n - min(n, kept) + i + 1, n):
        s = ring[k % kept]
        dt = s[LONG]
        a, b, c = moment_rates(s[SPEED], s[BETA], s[ALPHA], w, s[CONTROLS:], s[RHO], P, fm)
        w[0] += (a + lasting[0]) * dt
        w[1] += (b + lasting[1]) * dt
        w[2] += (c + lasting[2]) * dt
        x += w[0] * dt
        y += w[1] * dt
        z += w[2] * dt
    return x, y, z


class Looks:
    """Steps since the comparison began, and the moments they are judged by."""

    def __init__(self, windows_s: tuple[float, float], k: float, moments: Moments) -> None:
        """windows_s [s]: in which reference and gyro are compared; k [-]: sigmas that count."""
        self.k, self.moments = k, moments
        self._windows, self._ring, self._out = np.array(windows_s), np.zeros((KEPT, WIDTH)), np.zeros(OUT)
        self.n = 0
        self.first = -1, -1  # index of each window's first step, -1: it is not full
        self.axes: tuple[tuple[int, ...], tuple[int, ...]] = (), ()  # about which they disagree over each window
        self.more = (
            ZERO3  # [rad] the reference has turned more than the gyro over the first window, 0 while it is not full
        )

    def __len__(self) -> int:
        """Steps that are kept."""
        return min(self.n, KEPT)

    def begin(self) -> None:
        """Nothing has been read."""
        self.n, self.more = 0, ZERO3

    def take(
        self, more: Vec3, turned: Vec3, dt: float, flow: Vec3, h: float, u: np.ndarray, scatter: float, rate2: float, count: int
    ) -> int:  # fmt: skip
        """A step of dt [s]; flow: V [m/s], beta, alpha [rad]; the rest as `looked`. On how many sides the gyro's rates go as no
        moments do (Moments.wild)."""
        m = self.moments
        first, last, axes = looked(
            self._ring, self.n, *more, *turned, dt, *flow, h, u, self._windows, self.k, scatter, rate2, count, TWO, m.P,
            m.lasting, m.jump, m.lack, m.fm, self._out,
        )  # fmt: skip
        self.n += 1
        self.first, self.axes = (first, last), (AXES_OF[axes & 7], AXES_OF[axes >> 3])
        a, b, c, x, y, z = self._out.tolist()
        self.more = a, b, c
        return m.wild((x, y, z)) if self.n > 2 else 0

    def before(self, T: float) -> int:
        """Index of the latest step T [s] before the last one; -1: there is none yet."""
        return int(before(self._ring, self.n, T))

    def apart(self, i: int, scatter: float, rate2: float, count: int) -> tuple[Vec3, Vec3]:
        """As the function, of step i and the last."""
        x, y, z, a, b, c = apart(self._ring, self.n, i, scatter, rate2, count, TWO)
        return (x, y, z), (a, b, c)

    def __getitem__(self, i: int) -> Step:
        """Step i from the oldest that is kept, or from the end for i < 0."""
        row = self._ring[(self.n - len(self) + i) % KEPT if i >= 0 else (self.n + i) % KEPT]
        a, b, c, x, y, z, sx, sy, sz, t, dt = row[:SPEED].tolist()
        return Step((a, b, c), (x, y, z), (sx, sy, sz), t, dt)

    def turned(self, i: int, w: Vec3) -> Vec3:
        """As the function, of the steps after step i and rates w [3] rad/s in that."""
        m = self.moments
        x, y, z = turned(self._ring, self.n, i, *w, m.P, m.lasting, m.fm)
        return x, y, z
