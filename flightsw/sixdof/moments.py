"""What the controls make of an aircraft's rates, and how well that is known: the witness between gyro and attitude reference
(docs/sources/recovery.md 9)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.jit import jit
from flightsw.sixdof.params import parameter_vector, set_mass
from flightsw.types import ZERO3, Vec3

LEARN_S = 20.0  # [s]
WILD, LEAST_WILD, MOST = 6.0, 1.0, 3  # [-], [rad/s^2] of the gyro's jumps; in so many of one step more
FAR = 16.0  # [-] of the scatter's variance: what is further off counts as that
SQRT_2, JUMP_S = math.sqrt(2.0), 0.05  # [s] between two readings of the reference, until learnt
MISS, LEAST_MISS = 0.01, 0.001  # [rad] by which the moments miss the turn of the longest window, until learnt; at least


# what is learnt, by axis: what the model lacks [rad/s^2], the scatter about that [rad^2/s^4], what it lacks of the last step; and
# work space of its moments [9]
LASTING, JUMP, LACK, WORK, LEARNT = 0, 3, 6, 9, 18


@jit
def learn(m: np.ndarray, gain: float) -> None:
    """What is lasting in m [LEARNT] <- by a share `gain` what is lacking now, and the scatter <- the square of how far that is
    from the lasting."""
    for i in range(3):
        off = m[LACK + i] - m[LASTING + i]
        m[LASTING + i] += gain * off
        # a gyro that begins to jump does not get used to that before it has been found out
        square = off * off
        if FAR * m[JUMP + i] < square:
            square = FAR * m[JUMP + i]
        m[JUMP + i] += gain * (square - m[JUMP + i])


@dataclass(slots=True)
class Step:
    """At a reading of the reference: sums since the beginning of its turn beyond the gyro's, of the gyro's and of that without
    sign [rad], time [s]; and the length of the step before it alone [s]."""

    more: Vec3
    turn: Vec3
    size: Vec3
    t_s: float
    dt: float


class Moments:
    """One aircraft's, by its model."""

    def __init__(self, ac: Aircraft, r_rate: float) -> None:
        """r_rate [rad/s]: scatter of one reading of the gyro."""
        self.ac = ac
        self.miss = [MISS**2] * 3  # [rad^2] by which Looks.turned is off, of the longest window
        self.P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self.m = np.zeros(LEARNT)
        self.m[JUMP:LACK] = (SQRT_2 * r_rate / JUMP_S) ** 2
        self._learnt_s = 0.0
        self.begin()

    def begin(self) -> None:
        """Anew after a gap; what is learnt stays."""
        self._wild: deque[Vec3] = deque(maxlen=MOST + 1)  # per axis -1, 0, +1: beyond, and to which side

    def weigh(self, fuel_kg: float) -> None:
        """The fuel on board [kg]."""
        set_mass(self.P, self.ac, self.ac.mass.empty_kg + fuel_kg)

    def wild(self, sides: Vec3) -> int:
        """On how many sides the gyro's rates go as no moments do: most of the last steps beyond what they scatter by. 2: to and
        fro; 1: to one, as those of an aircraft whose surface runs away do too. sides: of the last step, per axis -1, 0 or 1."""
        self._wild.append(sides)
        if len(self._wild) - self._wild.count(ZERO3) < MOST:
            return 0
        axes = [set(axis) for axis in zip(*self._wild, strict=True)]
        return 2 if any({-1, 1} <= axis for axis in axes) else 1

    def share(self, dt: float) -> float:
        """By which `learn` takes in a step of dt [s] that `wild` was asked of."""
        self._learnt_s += dt
        return dt / min(self._learnt_s, LEARN_S)

    def missed(self, by: Vec3, dt: float) -> None:
        """Looks.turned was off by so much [rad], which stands for dt [s]."""
        gain = min(dt / LEARN_S, 1.0)
        for i, x in enumerate(by):
            self.miss[i] += gain * (max(x * x, LEAST_MISS**2) - self.miss[i])
