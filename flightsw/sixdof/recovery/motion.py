"""Whether an attitude reference still turns with the aircraft: by the gyro, with GNSS velocity to say which is wrong.

From sample to sample a reference that stands still is never far from the gyro; over seconds of a turn it is (recovery.md 8).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit, jit_own
from flightsw.kernels.rotations import turn
from flightsw.types import Vec3

LENGTH_S, LEAST_S = 4.0, 1.0  # [s] a window begins anew at twice the first, by turns; judged from the second on
GATE, SHARE = math.radians(3.0), 0.05  # [rad] reference from gyro, and as a share of the angle turned through
LAG_S = 0.15  # [s] of the rate: latency and sampling
AHEAD, LEAST_MPS = 2.0, 1.5  # [-], [m/s] by which the reference's velocity must be worse than the gyro's
# [m/s] the gyro's velocity is off at most: accelerometers are of the same unit, and may be wrong with it
FITS_MPS = 1.5
AGREES, AGREES_S = math.radians(5.0), 5.0  # [rad] from the gyro for so long [s]: taken again


@jit
def gain(R: np.ndarray, force: np.ndarray, dt: float, v: np.ndarray) -> None:
    """v [3] m/s NED <- dt [s] on with the specific force [3] m/s^2 in the body axes of R [9], and gravity."""
    for i in range(3):
        v[i] += dt * (R[i] * force[0] + R[3 + i] * force[1] + R[6 + i] * force[2] + (G0 if i == 2 else 0.0))


@jit_own
def carry(
    R: np.ndarray, by_gyro: np.ndarray, by_reference: np.ndarray, reference: np.ndarray,
    p: float, q: float, r: float, x: float, y: float, z: float, dt: float,
) -> None:  # fmt: skip
    """R [9], by the gyro, and the velocities [3] m/s NED gained by it and by the reference [9], dt [s] on in place: rates p, q, r
    [rad/s], specific force x, y, z [m/s^2] in body axes."""
    force = np.empty(3)
    force[0], force[1], force[2] = x, y, z
    turn(R, p, q, r, dt)
    gain(R, force, dt, by_gyro)
    gain(reference, force, dt, by_reference)


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


class Window:
    """What gyro and reference make of attitude and velocity since they were last alike. R [9]: NED to body by the gyro; velocity
    gained [m/s, NED] by either."""

    def __init__(self) -> None:
        self.age_s = -1.0  # < 0: not begun
        self.R = np.zeros(9)
        self.turned = 0.0  # [rad]
        self.by_gyro, self.by_reference = np.zeros(3), np.zeros(3)
        self._v0: Vec3 = (0.0, 0.0, 0.0)

    def begin(self, R: np.ndarray, v: Vec3, age_s: float) -> None:
        """Begin at attitude R [9] and GNSS velocity v [3] m/s, as if age_s [s] ago."""
        self.age_s, self.turned, self._v0 = age_s, 0.0, v
        self.R[:] = R
        self.by_gyro[:] = self.by_reference[:] = 0.0

    def carry(self, w: Vec3, rate: float, force: Vec3, reference: np.ndarray, dt: float) -> None:
        """dt [s] on: w [3] rad/s, which is `rate` in all, specific force [3] m/s^2 body, reference [9]."""
        carry(self.R, self.by_gyro, self.by_reference, reference, *w, *force, dt)
        self.age_s += dt
        self.turned += rate * dt

    def accuses(self, off: float, rate: float, v: Vec3) -> bool:
        """Whether the reference, `off` [rad] from the gyro at a rate [rad/s], is wrong by the GNSS velocity v [3] m/s."""
        if self.age_s < LEAST_S or off < GATE + SHARE * self.turned + LAG_S * rate:
            return False
        gained = [a - b for a, b in zip(v, self._v0, strict=True)]
        own = math.dist(gained, self.by_gyro)
        return own < FITS_MPS and math.dist(gained, self.by_reference) > AHEAD * own + LEAST_MPS


class Motion:
    """Two windows by turns. `doubted`: the reference is not to be gone by; `R` [9] then, in the step it began: the attitude by
    the gyro."""

    def __init__(self) -> None:
        self.doubted = self.began = False
        self.R = np.zeros(9)
        self._windows = (Window(), Window())
        self._reference = np.zeros(9)
        self._have = False
        self._agrees_s = 0.0

    def step(
        self, reference: np.ndarray | None, own: np.ndarray, w: Vec3, force: Vec3, v: Vec3 | None, dt: float
    ) -> None:  # fmt: skip
        """dt [s] after the last step.

        reference [9]: a new sample, None without; own [9]: the attitude gone by; w [3] rad/s, force [3] m/s^2, body; v [3] m/s
        NED: a new sample of GNSS velocity, None without.
        """
        self.began = False
        if reference is not None:
            self._reference[:] = reference
            self._have = True
        if not self._have:
            return
        rate = math.hypot(*w)
        for window in self._windows:
            if window.age_s >= 0.0:
                window.carry(w, rate, force, self._reference, dt)
        if reference is None:
            return
        if self.doubted:
            self._agrees_s = self._agrees_s + dt if angle(reference, own) < AGREES else 0.0
            if self._agrees_s >= AGREES_S:
                self.doubted = False
                self._forget()
        elif v is not None:
            self._judge(reference, rate, v)

    def _judge(self, reference: np.ndarray, rate: float, v: Vec3) -> None:
        first, second = self._windows
        for window in (second, first) if second.age_s > first.age_s else (first, second):
            if window.age_s >= LEAST_S and window.accuses(angle(reference, window.R), rate, v):
                self.R[:] = window.R
                self.doubted = self.began = True
                self._agrees_s = 0.0
                return
        for window, other in ((first, second), (second, first)):
            if window.age_s < 0.0 or window.age_s >= 2.0 * LENGTH_S:
                window.begin(reference, v, 0.0 if window.age_s >= 0.0 or other.age_s < 0.0 else LENGTH_S)

    def _forget(self) -> None:
        for window in self._windows:
            window.age_s = -1.0
