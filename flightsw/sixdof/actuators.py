"""What the onboard software believes its actuators are doing: delayed second-order servos and a lagged engine.

The estimator needs the deflections that act, not the ones it asked for: holding the old value over a step leaves rate
errors of order 0.01 rad/s on the receiver.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import GAMMA, R_AIR, temperature
from flightsw.kernels.jit import jit

SUBSTEPS = 4


@jit
def servo_step(
    pos: np.ndarray, rate: np.ndarray, cmd: np.ndarray, lim: np.ndarray, wn: float, zeta: float, dt: float
) -> None:
    """Advance three servos by dt [s] in place: pos, rate, cmd [3] in rad; lim [3,3] lower, upper [rad], rate limit [rad/s]."""
    h = dt / SUBSTEPS
    for _ in range(SUBSTEPS):
        for i in range(3):
            acc = wn * wn * (cmd[i] - pos[i]) - 2.0 * zeta * wn * rate[i]
            v = rate[i] + h * acc
            v = min(max(v, -lim[i, 2]), lim[i, 2])
            p = pos[i] + h * v
            if p < lim[i, 0] or p > lim[i, 1]:
                p = min(max(p, lim[i, 0]), lim[i, 1])
                v = 0.0
            pos[i] = p
            rate[i] = v


@jit
def actuators_step(
    fifo: np.ndarray, new: np.ndarray, pos: np.ndarray, rate: np.ndarray, thrust: np.ndarray, total: np.ndarray,
    lim: np.ndarray, wn: float, zeta: float, tau: float, dt: float,
) -> None:  # fmt: skip
    """One tick of the command pipeline fifo [k,4] (oldest first, `new` [4] enters), servos and engine lag, in place.

    total [4] accumulates the mean deflection and thrust over the tick (trapezoid).
    """
    k = fifo.shape[0]
    for j in range(4):
        for i in range(k - 1):
            fifo[i, j] = fifo[i + 1, j]
        fifo[k - 1, j] = new[j]
    for j in range(3):
        total[j] += 0.5 * pos[j]
    total[3] += 0.5 * thrust[0]
    servo_step(pos, rate, fifo[0], lim, wn, zeta, dt)
    thrust[0] = fifo[0, 3] + (thrust[0] - fifo[0, 3]) * math.exp(-dt / tau)
    for j in range(3):
        total[j] += 0.5 * pos[j]
    total[3] += 0.5 * thrust[0]


def surface_limits(ac: Aircraft) -> np.ndarray:
    """Limits [3,3] of aileron, elevator, rudder: lower, upper [rad], rate [rad/s]."""
    c = ac.controls
    rows = [
        (*c.aileron_deg, c.aileron_rate_degps),
        (*c.elevator_deg, c.elevator_rate_degps),
        (*c.rudder_deg, c.rudder_rate_degps),
    ]
    return np.radians(np.array(rows))


def thrust_available(ac: Aircraft, h_m: float, V: float) -> float:
    """Thrust [N] at full throttle at altitude h [m] and airspeed V [m/s] (lapse law of the aircraft file)."""
    e = ac.engine
    t = temperature(h_m)
    mach = V / math.sqrt(GAMMA * R_AIR * t)  # as sound_speed, which would ask for it again
    if e.lapse == "bypass":
        sigma = math.pow(t / 288.15, 4.2558797)  # density ratio, troposphere
        return e.static_thrust_N * (0.568 + 0.25 * (1.2 - mach) ** 3) * math.pow(sigma, 0.6)
    i = max(bisect_right(e.lapse_mach, mach) - 1, 0)
    rows = e.lapse_frac[i : i + 2]  # of the Mach numbers about it
    return e.static_thrust_N * between(mach, e.lapse_mach[i : i + 2], [between(h_m, e.lapse_h_m, row) for row in rows])


def between(x: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """ys [n] at x in a straight line between the points xs [n], ascending; outside of them as at the end. As np.interp, to the
    bit, which takes longer to look at its arguments."""
    if math.isnan(x):
        return x
    i = bisect_right(xs, x) - 1
    if i < 0 or i >= len(xs) - 1:
        return ys[max(i, 0)]
    return (ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i]) * (x - xs[i]) + ys[i]


class ActuatorModel:
    """Onboard copy of servo and engine dynamics, driven by the commands that were sent."""

    def __init__(self, ac: Aircraft, delay_ticks: int) -> None:
        """`delay_ticks` base ticks pass between sending a command and its reaching the actuators."""
        self.ac = ac
        self.lim = surface_limits(ac)
        self._servo = ac.controls.servo_wn_radps, ac.controls.servo_zeta, ac.engine.tau_s
        self.pos = np.zeros(3)
        self.rate = np.zeros(3)
        self._thrust = np.zeros(1)
        self._fifo = np.zeros((delay_ticks + 1, 4))
        self._sum = np.zeros(4)
        self._n = 0
        self.mean = np.zeros(4)

    def reset(self, surfaces: np.ndarray, thrust: float) -> None:
        """Start from given deflections [3] rad and thrust [N]."""
        self.pos[:] = surfaces
        self.rate[:] = 0.0
        self._thrust[0] = thrust
        self._fifo[:, :3] = surfaces
        self._fifo[:, 3] = thrust
        self.mean[:3] = surfaces
        self.mean[3] = thrust

    def step(self, u: np.ndarray, dt: float) -> None:
        """One base tick of dt [s] with the command u [4] sent at its start (surfaces [rad], thrust [N])."""
        actuators_step(self._fifo, u, self.pos, self.rate, self._thrust, self._sum, self.lim, *self._servo, dt)
        self._n += 1

    @property
    def thrust(self) -> float:
        """Thrust [N] the engines are taken to give."""
        return float(self._thrust[0])

    def take_mean(self) -> np.ndarray:
        """Mean deflections and thrust [4] since the last call (the value that acted over the estimator's step)."""
        if self._n:
            n = self._n
            self.mean[:] = [x / n for x in self._sum.tolist()]  # quicker than numpy looks at an integer
            self._sum[:] = 0.0
            self._n = 0
        return self.mean
