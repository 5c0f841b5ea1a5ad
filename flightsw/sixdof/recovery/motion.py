"""Whether an attitude reference still turns with the aircraft: by the gyro, with GNSS velocity to say which is wrong.

From sample to sample a reference that stands still is never far from the gyro; over seconds of a turn it is (recovery.md 8).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import dcm_from_quat, turn
from flightsw.types import IDENTITY_Q, Quat, Vec3

LENGTH_S, LEAST_S = 4.0, 1.0  # [s] a window begins anew at twice the first, by turns; judged from the second on
GATE, SHARE = math.radians(3.0), 0.05  # [rad] reference from gyro, and as a share of the angle turned through
LAG_S = 0.15  # [s] of the rate: latency and sampling
AHEAD, LEAST_MPS = 2.0, 1.5  # [-], [m/s] by which the reference's velocity must be worse than the gyro's
# [m/s] the gyro's velocity is off at most: accelerometers are of the same unit, and may be wrong with it
FITS_MPS = 1.5
# of a window's state: attitude [9], velocities gained [3] m/s NED by the gyro's and by the reference's; [s] since it was begun,
# below 0: it is not; [rad] turned through since
BY_GYRO, BY_REFERENCE, AGE, TURNED, STATE = 9, 12, 15, 16, 17
AGREES, AGREES_S = math.radians(5.0), 5.0  # [rad] from the gyro for so long [s]: taken again


@jit
def gain(R: np.ndarray, force: np.ndarray, dt: float, v: np.ndarray) -> None:
    """v [3] m/s NED <- dt [s] on with the specific force [3] m/s^2 in the body axes of R [9], and gravity."""
    for i in range(3):
        v[i] += dt * (R[i] * force[0] + R[3 + i] * force[1] + R[6 + i] * force[2] + (G0 if i == 2 else 0.0))


@jit
def angle(A: np.ndarray, B: np.ndarray) -> float:
    """Angle [rad] between two attitudes [9]."""
    trace = A[0] * B[0]
    for i in range(1, 9):
        trace += A[i] * B[i]
    cosine = 0.5 * (trace - 1.0)
    if cosine < -1.0:
        cosine = -1.0
    elif cosine > 1.0:
        cosine = 1.0
    return math.acos(cosine)


@jit_own
def from_reference(qw: float, qx: float, qy: float, qz: float, R: np.ndarray, own: np.ndarray) -> float:
    """R [9] <- parent to body of a unit quaternion; its angle [rad] from the attitude `own` [9]."""
    q = np.empty(4)
    q[0], q[1], q[2], q[3] = qw, qx, qy, qz
    dcm_from_quat(q, R)
    return angle(R, own)


@jit
def parts(off: float, rate: float, w: np.ndarray) -> bool:
    """Whether the reference, `off` [rad] from the gyro at a rate [rad/s], has parted from it over a window w [STATE]."""
    return w[AGE] >= LEAST_S and not off < GATE + SHARE * w[TURNED] + LAG_S * rate


@jit
def over(w: np.ndarray) -> bool:
    """Whether a window w [STATE] begins anew."""
    return w[AGE] < 0.0 or w[AGE] >= 2.0 * LENGTH_S


@jit_own
def carry(
    own: np.ndarray, known: bool, reference: np.ndarray, fresh: bool, qw: float, qx: float, qy: float, qz: float,
    first: np.ndarray, second: np.ndarray, p: float, q: float, r: float, x: float, y: float, z: float, rate: float, dt: float,
) -> tuple[float, bool]:  # fmt: skip
    """dt [s] on in place at rates p, q, r [rad/s], `rate` in all, and specific force x, y, z [m/s^2] in body axes: the attitude
    `own` [9] where it is known, the `reference` [9] <- the quaternion of a fresh reading, both windows [STATE] as far as they are
    begun. Angle [rad] of a fresh reading from `own`; whether a window has to be looked at for it."""
    force = np.empty(3)
    force[0], force[1], force[2] = x, y, z
    if known:
        turn(own, p, q, r, dt)
    off, due = 0.0, False
    if fresh:
        off = from_reference(qw, qx, qy, qz, reference, own)
    for k in range(2):
        w = first if k == 0 else second
        if w[AGE] >= 0.0:
            turn(w[:BY_GYRO], p, q, r, dt)
            gain(w[:BY_GYRO], force, dt, w[BY_GYRO:BY_REFERENCE])
            gain(reference, force, dt, w[BY_REFERENCE:AGE])
            w[AGE] += dt
            w[TURNED] += rate * dt
        if fresh and (over(w) or parts(angle(reference, w[:BY_GYRO]), rate, w)):
            due = True
    return off, due


class Window:
    """What gyro and reference make of attitude and velocity since they were last alike. `state` [STATE]: attitude NED to body by
    the gyro; velocity gained [m/s, NED] by either (`carry`)."""

    def __init__(self) -> None:
        self.state = np.zeros(STATE)
        self.state[AGE] = -1.0
        self._v0: Vec3 = (0.0, 0.0, 0.0)

    def begin(self, R: np.ndarray, v: Vec3, age_s: float) -> None:
        """Begin at attitude R [9] and GNSS velocity v [3] m/s, as if age_s [s] ago."""
        self._v0 = v
        self.state[:BY_GYRO] = R
        self.state[BY_GYRO:] = 0.0
        self.state[AGE] = age_s

    @property
    def age_s(self) -> float:
        """[s] since it was begun; below 0: it is not."""
        return self.state.item(AGE)

    def accuses(self, reference: np.ndarray, rate: float, v: Vec3) -> bool:
        """Whether the reference [9], at a rate [rad/s], is wrong by the GNSS velocity v [3] m/s."""
        if not parts(angle(reference, self.state[:BY_GYRO]), rate, self.state):
            return False
        gained = [a - b for a, b in zip(v, self._v0, strict=True)]
        own = math.dist(gained, self.state[BY_GYRO:BY_REFERENCE])
        return own < FITS_MPS and math.dist(gained, self.state[BY_REFERENCE:AGE]) > AHEAD * own + LEAST_MPS


class Motion:
    """Two windows by turns. `doubted`: the reference is not to be gone by; `R` [9] then, in the step it began: the attitude by
    the gyro."""

    def __init__(self) -> None:
        self.doubted = self.began = False
        self.R = np.zeros(9)
        self._windows = (Window(), Window())
        self.reference = np.zeros(9)  # NED to body, as last read
        self._agrees_s = 0.0

    def step(
        self, own: np.ndarray, known: bool, q: Quat | None, w: Vec3, rate: float, force: Vec3, v: Vec3 | None, dt: float
    ) -> float:  # fmt: skip
        """dt [s] after the last step: own [9], the attitude gone by, turns on where it is `known`; angle [rad] of a new sample of
        the reference from it.

        q [4]: that sample, NED to body, None without; w [3] rad/s, which is `rate` in all, force [3] m/s^2, body; v [3] m/s NED:
        a new sample of GNSS velocity, None without.
        """
        self.began = False
        first, second = self._windows
        off, due = carry(
            own, known, self.reference, q is not None, *(q or IDENTITY_Q), first.state, second.state, *w, *force, rate, dt
        )  # fmt: skip
        if q is None:
            return 0.0
        if self.doubted:
            self._agrees_s = self._agrees_s + dt if off < AGREES else 0.0
            if self._agrees_s >= AGREES_S:
                self.doubted = False
                self._forget()
        elif due and v is not None:
            self._judge(rate, v)
        return float(off)

    def _judge(self, rate: float, v: Vec3) -> None:
        reference, (first, second) = self.reference, self._windows
        for window in (second, first) if second.age_s > first.age_s else (first, second):
            if window.accuses(reference, rate, v):
                self.R[:] = window.state[:BY_GYRO]
                self.doubted = self.began = True
                self._agrees_s = 0.0
                return
        for window, other in ((first, second), (second, first)):
            if over(window.state):
                window.begin(reference, v, 0.0 if window.age_s >= 0.0 or other.age_s < 0.0 else LENGTH_S)

    def _forget(self) -> None:
        for window in self._windows:
            window.state[AGE] = -1.0
