"""What the onboard software believes its actuators are doing: delayed second-order servos and a lagged engine.

The estimator needs the deflections that act, not the ones it asked for: holding the old value over a step leaves rate
errors of order 0.01 rad/s on the receiver.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import sound_speed, temperature
from flightsw.kernels.jit import jit

SUBSTEPS = 4


@jit
def servo_step(pos: np.ndarray, rate: np.ndarray, cmd: np.ndarray, lim: np.ndarray, wn: float, zeta: float, dt: float) -> None:
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
    mach = V / sound_speed(h_m)
    if e.lapse == "bypass":
        t = temperature(h_m)
        sigma = math.pow(t / 288.15, 4.2558797)  # density ratio, troposphere
        return e.static_thrust_N * (0.568 + 0.25 * (1.2 - mach) ** 3) * math.pow(sigma, 0.6)
    by_mach = [float(np.interp(h_m, e.lapse_h_m, row)) for row in e.lapse_frac]
    return e.static_thrust_N * float(np.interp(mach, e.lapse_mach, by_mach))


class ActuatorModel:
    """Onboard copy of servo and engine dynamics, driven by the commands that were sent."""

    def __init__(self, ac: Aircraft, delay_ticks: int) -> None:
        """`delay_ticks` base ticks pass between sending a command and its reaching the actuators."""
        self.ac = ac
        self.lim = surface_limits(ac)
        self.pos = np.zeros(3)
        self.rate = np.zeros(3)
        self.thrust = 0.0
        self._fifo = np.zeros((delay_ticks + 1, 4))
        self._primed = False
        self._sum = np.zeros(4)
        self._n = 0
        self.mean = np.zeros(4)

    def reset(self, surfaces: np.ndarray, thrust: float) -> None:
        """Start from given deflections [3] rad and thrust [N]."""
        self.pos[:] = surfaces
        self.rate[:] = 0.0
        self.thrust = thrust
        self._fifo[:, :3] = surfaces
        self._fifo[:, 3] = thrust
        self.mean[:3] = surfaces
        self.mean[3] = thrust
        self._primed = True

    def step(self, aileron: float, elevator: float, rudder: float, thrust_cmd: float, dt: float) -> None:
        """One base tick of dt [s] with the command sent at its start (surfaces [rad], thrust [N])."""
        f = self._fifo
        f[:-1] = f[1:]
        f[-1, 0], f[-1, 1], f[-1, 2], f[-1, 3] = aileron, elevator, rudder, thrust_cmd
        if not self._primed:
            self.reset(f[-1, :3].copy(), thrust_cmd)
        c = self.ac.controls
        before = self.pos.copy()
        servo_step(self.pos, self.rate, f[0], self.lim, c.servo_wn_radps, c.servo_zeta, dt)
        t0 = self.thrust
        self.thrust = f[0, 3] + (t0 - f[0, 3]) * math.exp(-dt / self.ac.engine.tau_s)
        self._sum[:3] += 0.5 * (before + self.pos)
        self._sum[3] += 0.5 * (t0 + self.thrust)
        self._n += 1

    def take_mean(self) -> np.ndarray:
        """Mean deflections and thrust [4] since the last call (the value that acted over the estimator's step)."""
        if self._n:
            np.divide(self._sum, self._n, out=self.mean)
            self._sum[:] = 0.0
            self._n = 0
        return self.mean
