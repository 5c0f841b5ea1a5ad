"""The last readings of an attitude reference beside the gyro, in one array, and what is asked of them at every reading
(turning.py, docs/sources/recovery.md 9)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import density
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, rotate_dcm, turn
from flightsw.sixdof.forces import moment_rates
from flightsw.sixdof.moments import JUMP, LACK, LASTING, LEARN_S, LEAST_WILD, WILD, WORK, Moments, Step, learn
from flightsw.types import ZERO3, Quat, Vec3

KEPT = 512  # steps: more than the longest window and what is before it, at 100 Hz
BIAS, SCALE = 2e-3, 0.02  # [rad/s] change of a gyro's bias, [-] of a turn: scale, misalignment, sampling
LEAST = 0.1  # [-] of nav.r_euler: no reference scatters less
# columns, as the fields of moments.Step
MORE, TURN, SIZE, TIME, LONG, SPEED, BETA, ALPHA, RHO, CONTROLS = 0, 3, 6, 9, 10, 11, 12, 13, 14, 15
WIDTH = CONTROLS + 4
# what is looked by: windows [2] s; sigmas that count; variance of one of the gyro's rates [rad^2/s^2], of a reading of the
# reference, as learnt, and at least [rad^2]; 2.0, a power that is not known to the compiler: the product of a number with itself
# is another in its last digit
WINDOWS, SIGMAS, RATE2, SCATTER, SCATTER_LEAST, TWO, SETTINGS = 0, 2, 3, 4, 5, 6, 7
# what `looked` finds: by how much the reference has turned more than the gyro in the last step [3] rad, and over the first window
# [3] rad, 0 while that is not full; to which side the gyro's rate about each axis goes as no moments do [3] (-1, 0, 1)
LAST, APART, SIDES, OUT = 0, 3, 6, 9
AXES_OF = tuple(tuple(i for i in range(3) if mask >> i & 1) for mask in range(8))


@jit_own
def beyond(
    R: np.ndarray, dt: float, p: float, q: float, r: float, qw: float, qx: float, qy: float, qz: float, age: float
) -> tuple[float, float, float]:
    """Turn [rad] of the reference qw, qx, qy, qz, carried on by the rates p, q, r [rad/s] for its age [s], beyond the attitude R
    [9] NED to body, by the gyro `dt` [s] ago; R <- that of the reference now."""
    a, S, w, T, E = np.empty(4), np.empty(9), np.empty(3), np.empty(9), np.empty(9)
    a[0], a[1], a[2], a[3] = qw, qx, qy, qz
    w[0], w[1], w[2] = p, q, r
    turn(R, p, q, r, dt)
    dcm_from_quat(a, S)
    rotate_dcm(S, w, age, T)
    mul33_t(T, R, E)  # I - [more x]
    for i in range(9):
        R[i] = T[i]
    return 0.5 * (E[5] - E[7]), 0.5 * (E[6] - E[2]), 0.5 * (E[1] - E[3])


@jit
def before(ring: np.ndarray, n: int, T: float) -> int:
    """Index, from the oldest kept, of the latest of n steps in the ring [KEPT,WIDTH] T [s] before the last; -1: none."""
    kept = ring.shape[0]
    k, i = (n - 1) % kept, min(n, kept) - 1
    then = ring[k, TIME] - T + 1e-6
    while i >= 0 and ring[k, TIME] > then:
        i -= 1
        k = k - 1 if k > 0 else kept - 1
    return i


@jit
def apart(
    ring: np.ndarray, n: int, i: int, c: np.ndarray, count: int
) -> tuple[float, float, float, float, float, float]:
    """By how much the reference has turned more than the gyro between step i and the last of n [rad], and one sigma of that; c
    [SETTINGS]; count: of the gyro's rates in a step."""
    kept, two = ring.shape[0], c[TWO]
    now, then = ring[(n - 1) % kept], ring[(n - min(n, kept) + i) % kept]
    span = now[TIME] - then[TIME]
    white = 2.0 * c[SCATTER] + c[RATE2] * span * now[LONG] / count + math.pow(BIAS * span, two)
    return (
        now[MORE] - then[MORE],
        now[MORE + 1] - then[MORE + 1],
        now[MORE + 2] - then[MORE + 2],
        math.sqrt(white + math.pow(SCALE * (now[SIZE] - then[SIZE]), two)),
        math.sqrt(white + math.pow(SCALE * (now[SIZE + 1] - then[SIZE + 1]), two)),
        math.sqrt(white + math.pow(SCALE * (now[SIZE + 2] - then[SIZE + 2]), two)),
    )


@jit
def written(
    ring: np.ndarray, n: int, more: np.ndarray, tx: float, ty: float, tz: float, dt: float, V: float, beta: float,
    alpha: float, h: float, u: np.ndarray,
) -> None:  # fmt: skip
    """Step n of the `ring` [KEPT,WIDTH] <- a reading, `dt` [s] after the last: the reference has turned `more` [3] rad than the
    gyro, that (tx, ty, tz); V [m/s], beta, alpha [rad], h [m], controls u [4] of now."""
    s, old = ring[n % ring.shape[0]], ring[(n - 1) % ring.shape[0]]
    s[MORE], s[MORE + 1], s[MORE + 2] = more[0], more[1], more[2]
    s[TURN], s[TURN + 1], s[TURN + 2] = tx, ty, tz
    s[SIZE], s[SIZE + 1], s[SIZE + 2] = abs(tx), abs(ty), abs(tz)
    s[TIME] = dt
    if n > 0:
        for i in range(LONG):
            s[i] += old[i]
    s[LONG], s[SPEED], s[BETA], s[ALPHA], s[RHO] = dt, V, beta, alpha, density(h)
    for i in range(4):
        s[CONTROLS + i] = u[i]


@jit_own
def lacking(ring: np.ndarray, n: int, P: np.ndarray, m: np.ndarray, sides: np.ndarray) -> None:
    """Into m [LEARNT] (moments.py) what its model, P, lacks of the last of n steps; sides [3] <- where that is too much."""
    kept, w0 = ring.shape[0], np.empty(3)
    a, b, s = ring[(n - 3) % kept], ring[(n - 2) % kept], ring[(n - 1) % kept]
    for i in range(3):
        w0[i] = (b[TURN + i] - a[TURN + i]) / b[LONG]
    rates, dt = moment_rates(s[SPEED], s[BETA], s[ALPHA], w0, s[CONTROLS:], s[RHO], P, m[WORK:]), s[LONG]
    for i in range(3):
        m[LACK + i] = ((s[TURN + i] - b[TURN + i]) / dt - w0[i]) / dt - rates[i]
        off = m[LACK + i] - m[LASTING + i]
        if off * off > max(WILD * WILD * m[JUMP + i], LEAST_WILD * LEAST_WILD):
            sides[i] = math.copysign(1.0, off)


@jit_own
def looked(
    ring: np.ndarray, n: int, R: np.ndarray, ago: float, p: float, q: float, r: float, qw: float, qx: float, qy: float,
    qz: float, age: float, tx: float, ty: float, tz: float, dt: float, V: float, beta: float, alpha: float, h: float,
    u: np.ndarray, c: np.ndarray, count: int, P: np.ndarray, m: np.ndarray, out: np.ndarray,
) -> tuple[int, int, int]:  # fmt: skip
    """A reading of the reference, whose turn `beyond` the gyro is `written` as step n; nothing of the kind for n < 0, the first.
    Index of each window's first step (-1: not full), and the axes beyond it: of the first in bits 0 to 2, of the last in 3 to 5;
    out [OUT] <- what is found. R, ago [s], p, q, r, qw, qx, qy, qz, age as `beyond`, c [SETTINGS], count as `apart`, P, m as
    `lacking`."""
    for i in range(OUT):
        out[i] = 0.0
    out[LAST], out[LAST + 1], out[LAST + 2] = beyond(R, ago, p, q, r, qw, qx, qy, qz, age)
    if n < 0:
        return -1, -1, 0
    written(ring, n, out[LAST:APART], tx, ty, tz, dt, V, beta, alpha, h, u)
    n += 1
    axes, first, last = 0, before(ring, n, c[WINDOWS]), before(ring, n, c[WINDOWS + 1])
    for w in range(2):
        began = first if w == 0 else last
        if began >= 0:
            x, y, z, a, b, d = apart(ring, n, began, c, count)
            if w == 0:
                out[APART], out[APART + 1], out[APART + 2] = x, y, z
            axes |= (1 if abs(x) > c[SIGMAS] * a else 0) << 3 * w
            axes |= (2 if abs(y) > c[SIGMAS] * b else 0) << 3 * w
            axes |= (4 if abs(z) > c[SIGMAS] * d else 0) << 3 * w
    if n > 2:
        lacking(ring, n, P, m, out[SIDES:])
    return first, last, axes


@jit
def learnt(x: float, y: float, z: float, share: float, c: np.ndarray, gain: float, m: np.ndarray) -> None:
    """The reference's scatter in c [SETTINGS] <- by a share [-] that of two readings between which it has turned x, y, z [rad]
    more than the gyro, of one axis; and moments.learn."""
    two = c[TWO]
    each = (math.pow(x, two) + math.pow(y, two) + math.pow(z, two)) / 6.0
    scatter = c[SCATTER] + share * (each - c[SCATTER])
    c[SCATTER] = scatter if scatter > c[SCATTER_LEAST] else c[SCATTER_LEAST]
    learn(m, gain)


@jit_own
def turned(
    ring: np.ndarray, n: int, i: int, p: float, q: float, r: float, P: np.ndarray, m: np.ndarray
) -> tuple[float, float, float]:
    """The turn [rad] that the moments of the steps after step i, to the last of n, make of rates p, q, r [rad/s]: by Euler's
    equation, step by step. ring [KEPT,WIDTH]; P, m [LEARNT] as Moments has them."""
    kept, w = ring.shape[0], np.empty(3)
    w[0], w[1], w[2] = p, q, r
    x = y = z = 0.0
    for k in range(n - min(n, kept) + i + 1, n):
        s = ring[k % kept]
        dt = s[LONG]
        a, b, c = moment_rates(s[SPEED], s[BETA], s[ALPHA], w, s[CONTROLS:], s[RHO], P, m[WORK:])
        w[0] += (a + m[LASTING]) * dt
        w[1] += (b + m[LASTING + 1]) * dt
        w[2] += (c + m[LASTING + 2]) * dt
        x += w[0] * dt
        y += w[1] * dt
        z += w[2] * dt
    return x, y, z


class Looks:
    """Steps since the comparison began, and the moments they are judged by."""

    def __init__(
        self, windows_s: tuple[float, float], k: float, r_euler: float, r_rate: float, moments: Moments
    ) -> None:
        """windows_s [s]: in which reference and gyro are compared; k [-]: sigmas that count; r_euler [rad], r_rate [rad/s]:
        scatter of one reading."""
        self.moments = moments
        self._c = np.array([*windows_s, k, r_rate**2, r_euler**2, (LEAST * r_euler) ** 2, 2.0])
        self._ring, self._out, self._R = np.zeros((KEPT, WIDTH)), np.zeros(OUT), np.zeros(9)
        self.begin()

    def __len__(self) -> int:
        """Steps that are kept."""
        return min(self.n, KEPT)

    def begin(self) -> None:
        """Nothing has been read."""
        self.known = False  # a reading to compare the next with
        self.n = 0
        self.first = -1, -1  # index of each window's first step, -1: it is not full
        self.axes: tuple[tuple[int, ...], tuple[int, ...]] = (), ()  # about which they disagree over each window
        # [rad] the reference has turned more than the gyro in the last step, and over the first window, 0 while it is not full
        self.last = self.more = ZERO3

    @property
    def scatter(self) -> float:
        """Variance [rad^2] of a reading of the reference."""
        return self._c.item(SCATTER)

    def turn(self, w: Vec3, dt: float) -> None:
        """Go on with the gyro alone: rates w [3] rad/s for dt [s]."""
        if self.known:
            turn(self._R, *w, dt)

    def take(
        self, w: Vec3, ago: float, q: Quat, age: float, turned: Vec3, dt: float, flow: Vec3, h: float, u: np.ndarray, count: int
    ) -> int:  # fmt: skip
        """A reading q [4] of the reference, NED to body, age [s] old, after dt [s] in which the gyro has `turned` [3] rad; w [3]
        rad/s: its rates of the last `ago` [s]; flow: V [m/s], beta, alpha [rad]; h [m]; u [4] controls; count as `apart`. On how
        many sides the gyro's rates go as no moments do (Moments.wild)."""
        m = self.moments
        first, last, axes = looked(
            self._ring, self.n if self.known else -1, self._R, ago, *w, *q, age, *turned, dt, *flow, h, u, self._c, count,
            m.P, m.m, self._out,
        )  # fmt: skip
        if not self.known:
            self.known = True
            return 0
        self.n += 1
        self.first, self.axes = (first, last), (AXES_OF[axes & 7], AXES_OF[axes >> 3])
        mx, my, mz, ax, ay, az, sx, sy, sz = self._out.tolist()
        self.last, self.more = (mx, my, mz), (ax, ay, az)
        return m.wild((sx, sy, sz)) if self.n > 2 else 0

    def learn(self, dt: float) -> None:
        """From the last step, dt [s] long: the reference's scatter, what the moments lack, and the gyro's scatter."""
        if self.n > 2:
            learnt(*self.last, min(dt / LEARN_S, 1.0), self._c, self.moments.share(dt), self.moments.m)

    def before(self, T: float) -> int:
        """Index of the latest step T [s] before the last one; -1: there is none yet."""
        return int(before(self._ring, self.n, T))

    def apart(self, i: int, count: int) -> tuple[Vec3, Vec3]:
        """As the function, of step i and the last."""
        x, y, z, a, b, c = apart(self._ring, self.n, i, self._c, count)
        return (x, y, z), (a, b, c)

    def __getitem__(self, i: int) -> Step:
        """Step i from the oldest that is kept, or from the end for i < 0."""
        row = self._ring[(self.n - len(self) + i) % KEPT if i >= 0 else (self.n + i) % KEPT]
        a, b, c, x, y, z, sx, sy, sz, t, dt = row[:SPEED].tolist()
        return Step((a, b, c), (x, y, z), (sx, sy, sz), t, dt)

    def turned(self, i: int, w: Vec3) -> Vec3:
        """As the function, of the steps after step i and rates w [3] rad/s in that."""
        m = self.moments
        x, y, z = turned(self._ring, self.n, i, *w, m.P, m.m)
        return x, y, z
