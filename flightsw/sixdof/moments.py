"""What the controls make of an aircraft's rates, and how well that is known: the witness between gyro and attitude reference
(docs/sources/recovery.md 9)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import added, less
from flightsw.sixdof.forces import moment_rates
from flightsw.sixdof.params import parameter_vector, set_mass
from flightsw.types import Vec3

LEARN_S = 20.0  # [s]
WILD, LEAST_WILD, MOST = 6.0, 1.0, 3  # [-], [rad/s^2] of the gyro's jumps; in so many of one step more
FAR = 16.0  # [-] of the scatter's variance: what is further off counts as that
SQRT_2, JUMP_S = math.sqrt(2.0), 0.05  # [s] between two readings of the reference, until learnt
MISS, LEAST_MISS = 0.01, 0.001  # [rad] by which the moments miss the turn of the longest window, until learnt; at least


@dataclass(slots=True)
class Step:
    """At a reading of the reference: sums since the beginning of its turn beyond the gyro's, of the gyro's and of that without
    sign [rad], time [s]; and of the step before it alone what the moments need: dt [s], V, beta, alpha, rho, controls [4]."""

    more: Vec3
    turn: Vec3
    size: Vec3
    t_s: float
    dt: float
    V: float
    beta: float
    alpha: float
    rho: float
    u: np.ndarray


class Moments:
    """One aircraft's, by its model."""

    def __init__(self, ac: Aircraft, r_rate: float) -> None:
        """r_rate [rad/s]: scatter of one reading of the gyro."""
        self.ac = ac
        self.miss = [MISS**2] * 3  # [rad^2] by which `turned` is off, of the longest window
        self._P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._lasting = [0.0, 0.0, 0.0]  # [rad/s^2] what the model lacks
        self._lack = [0.0, 0.0, 0.0]  # the same of the last step
        self._jump = [(SQRT_2 * r_rate / JUMP_S) ** 2] * 3  # [rad^2/s^4] its scatter about that
        self._learnt_s = 0.0
        self._fm = np.zeros(9)
        self.begin()

    def begin(self) -> None:
        """Anew after a gap; what is learnt stays."""
        self._wild: deque[tuple[int, ...]] = deque(maxlen=MOST + 1)  # per axis -1, 0, +1: beyond, and to which side

    def weigh(self, fuel_kg: float) -> None:
        """The fuel on board [kg]."""
        set_mass(self._P, self.ac, self.ac.mass.empty_kg + fuel_kg)

    def turned(self, steps: list[Step], w: np.ndarray) -> Vec3:
        """The turn [rad] that the moments of `steps` make of rates w [3]: Euler's equation, step by step."""
        turn = (0.0, 0.0, 0.0)
        for x in steps:
            w = w + (np.array(self._rates(x, w)) + self._lasting) * x.dt
            turn = added(turn, (w[0] * x.dt, w[1] * x.dt, w[2] * x.dt))
        return turn

    def _rates(self, x: Step, w: np.ndarray) -> Vec3:
        return moment_rates(x.V, x.beta, x.alpha, w, x.u, x.rho, self._P, self._fm)  # type: ignore[no-any-return]

    def wild(self, a: Step, b: Step, s: Step) -> int:
        """On how many sides the gyro's rates go as no moments do: most of the last steps beyond what they scatter by. 2: to and
        fro; 1: to one, as those of an aircraft whose surface runs away do too. a, b, s: three steps in a row, the last is new."""
        w0 = [x / b.dt for x in less(b.turn, a.turn)]
        model = self._rates(s, np.array(w0))
        for i, turn in enumerate(less(s.turn, b.turn)):
            self._lack[i] = (turn / s.dt - w0[i]) / s.dt - model[i]
        sides = []
        for x, m, y in zip(self._lack, self._lasting, self._jump, strict=True):
            off = x - m
            sides.append(int(math.copysign(1.0, off)) if off * off > max(WILD**2 * y, LEAST_WILD**2) else 0)
        self._wild.append(tuple(sides))
        if sum(map(any, self._wild)) < MOST:
            return 0
        axes = [set(axis) for axis in zip(*self._wild, strict=True)]
        return 2 if any({-1, 1} <= axis for axis in axes) else 1

    def learn(self, dt: float) -> None:
        """From the step `wild` was asked of, dt [s] long: lasting moments the model lacks, and the gyro's scatter."""
        self._learnt_s += dt
        gain = dt / min(self._learnt_s, LEARN_S)
        for i, x in enumerate(self._lack):
            off = x - self._lasting[i]
            self._lasting[i] += gain * off
            # a gyro that begins to jump does not get used to that before it has been found out
            self._jump[i] += gain * (min(off * off, FAR * self._jump[i]) - self._jump[i])

    def missed(self, by: Vec3, dt: float) -> None:
        """`turned` was off by so much [rad], which stands for dt [s]."""
        gain = min(dt / LEARN_S, 1.0)
        for i, x in enumerate(by):
            self.miss[i] += gain * (max(x * x, LEAST_MISS**2) - self.miss[i])
