"""The small UAV ALEXIS in the vertical plane: motion, servos, wind, vane bias and instruments, one sample at a time.

`Alexis.step` takes the command computed from the previous sample and goes to the next one. Numbers of the aircraft: its file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Alexis as Record
from flightsw.aircraft import alexis
from flightsw.strict import Range
from sim_plant.aircraft.alexis import dynamics as ka
from sim_plant.kernels import layout as n
from sim_plant.rng import generator
from sim_plant.wind.planar import PlanarWind, wind_series

Arr = NDArray[np.float64]
RAD = math.pi / 180.0


@dataclass(frozen=True)
class AlexisServo:
    """Elevator and flap servos where they differ from the aircraft file, second order; the kernel's transition matrix is that of
    a damping below 1. `rate_degps`: of both surfaces."""

    wn_radps: Annotated[float | None, Range(1.0, 500.0)] = None
    zeta: Annotated[float | None, Range(0.05, 0.99)] = None
    rate_degps: Annotated[float | None, Range(1.0, 1e5)] = None
    elevator_deg: Annotated[float | None, Range(0.0, 60.0)] = None
    flap_deg: Annotated[float | None, Range(0.0, 60.0)] = None


@dataclass(frozen=True)
class AlexisSensors:
    """Standard deviation per sample; the vane's bias is a step and, with bias_walk, a random walk [deg per sqrt(s)]."""

    rate_degps: float = 0.6
    vane_deg: float = 0.5
    airspeed_mps: float = 0.35
    pitch_deg: float = 0.2
    height_m: float = 1.0
    ground_mps: float = 0.2
    vertical_mps2: float = 0.3
    ground_every: int = 10  # samples between two readings of ground speed
    bias_deg: float = 0.0
    bias_at_s: float = 0.0
    bias_walk: float = 0.0
    bias_start_deg: float = 0.0  # 1 sigma of a constant random part

    def sigmas(self) -> Arr:
        """Vector [7] in SI and radians."""
        deg = (self.rate_degps * RAD, self.vane_deg * RAD, self.airspeed_mps, self.pitch_deg * RAD)
        return np.array([*deg, self.height_m, self.ground_mps, self.vertical_mps2])


@dataclass(frozen=True)
class AlexisParams:
    """The aircraft as it is. Factors multiply aerodynamic forces and moments as a whole (1: the published aircraft)."""

    linear: bool = False
    aircraft: Record = field(default_factory=alexis)
    height_m: float = field(default_factory=lambda: alexis().trim.height_m)
    lift_factor: float = 1.0  # of everything that changes lift
    moment_factor: float = 1.0
    stall_deg: float | None = None  # incidence at which lift no longer grows, either sign; None: it always does
    direct: bool = False  # surfaces follow commands at once, without servo and delay
    servo: AlexisServo = field(default_factory=AlexisServo)
    sensors: AlexisSensors = field(default_factory=AlexisSensors)
    noise: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    # intensity of process noise on pitch rate, alpha_K, V_K, pitch, height [unit per sqrt(s)]

    @property
    def V_mps(self) -> float:
        """Trim airspeed [m/s]."""
        return self.aircraft.trim.V_mps

    def vector(self) -> Arr:
        """Parameter vector [NA] of the kernels."""
        a, ac = np.zeros(ka.NA), self.aircraft
        a[ka.A_V], a[ka.A_G] = ac.trim.V_mps, ac.trim.gravity_mps2
        lift, drag, pitch = ac.lift, ac.drag, ac.pitch
        a[ka.A_L0 : ka.A_LFLAP + 1] = lift.trim, lift.alpha, lift.q, lift.elevator, lift.flap
        a[ka.A_LALPHA : ka.A_LFLAP + 1] *= self.lift_factor
        a[ka.A_D0 : ka.A_DFLAP + 1] = drag.trim, drag.alpha, drag.q, drag.elevator, drag.flap
        a[ka.A_MRATE : ka.A_MFLAP + 1] = pitch.q, pitch.alpha, pitch.elevator, pitch.flap
        a[ka.A_MRATE : ka.A_MFLAP + 1] *= self.moment_factor
        a[ka.A_T0], a[ka.A_TSET] = ac.thrust.trim, ac.thrust.setting
        a[ka.A_LINEAR] = float(self.linear)
        a[ka.A_STALL] = math.inf if self.stall_deg is None else self.stall_deg * RAD
        return a


class Alexis:
    """One flight of `duration_s` sampled every dt [s], with `ticks` integration steps between two samples.

    After construction and after every step: `truth` [9] (x1, alpha_W, V_W, q, alpha_K, V_K, Theta, H, vane bias; deviations
    from trim), `reading` [7] and `fresh`, the bit mask of its channels; `vertical` [ticks] is a_z at the ticks passed.
    """

    def __init__(
        self, p: AlexisParams, wind: PlanarWind, seed: int, duration_s: float, dt: float = 0.02, ticks: int = 4,
        free: tuple[float, float] = (0.0, 0.0),
    ) -> None:  # fmt: skip
        """free: wind of the air mass at the start [m/s], down and ahead, beside that of `wind` (see `breathe`).

        Raises ValueError for a duration below one sample or fewer than one tick."""
        self.samples = round(duration_s / dt) + 1
        if self.samples < 2 or ticks < 1:
            raise ValueError(f"duration_s = {duration_s}, dt = {dt}, ticks = {ticks}; allowed: a sample or more, >= 1")
        self.p, self.dt, self.ticks, self.h = p, dt, ticks, dt / ticks
        self.a = p.vector()
        count = (self.samples - 1) * ticks + 1
        self.wind, self._aux = wind_series(wind, p.V_mps, count, self.h, seed)
        self.free = np.array(free)
        self.f = np.array([p.V_mps + free[1], 0.0, 0.0, 0.0, p.height_m])
        self._servo_state, self._servo_command, self._servo = self._servos(p.servo, p.aircraft)
        self._kick = self._process_noise(count - 1, seed)
        self._bias = self._vane_bias(seed)
        sigma = p.sensors.sigmas()
        self._noise = generator(seed, "alexis.sensors").standard_normal((self.samples, ka.NR)) * sigma
        self._W = np.zeros((8, ka.NR))
        self._clean = np.zeros(ka.NR)
        self._controls = np.zeros(3)
        self.command = np.zeros(3)
        self.vertical = np.zeros(ticks)
        self.k = 0
        self.truth, self.reading, self.fresh = np.zeros(9), np.zeros(ka.NR), 0
        self._observe()

    @staticmethod
    def _servos(s: AlexisServo, ac: Record) -> tuple[Arr, Arr, Arr]:
        c = ac.controls

        def pick(own: float | None, of_file: float) -> float:
            return of_file if own is None else own

        par = np.zeros(n.P_TABLES)
        lim = np.array([pick(s.elevator_deg, c.elevator_deg[1]), pick(s.flap_deg, c.flap_deg[1]), 1.0]) * RAD
        par[n.P_LO : n.P_LO + 3], par[n.P_HI : n.P_HI + 3] = -lim, lim
        par[n.P_RATE] = pick(s.rate_degps, c.elevator_rate_degps) * RAD
        par[n.P_RATE + 1] = pick(s.rate_degps, c.flap_rate_degps) * RAD
        par[n.P_RATE + 2] = par[n.P_RATE]  # a third slot nothing moves
        par[n.P_WN], par[n.P_ZETA] = pick(s.wn_radps, c.servo_wn_radps), pick(s.zeta, c.servo_zeta)
        return np.zeros(n.NS), np.zeros(n.NC), par

    def _process_noise(self, count: int, seed: int) -> Arr:
        q = np.array(self.p.noise)
        if not q.any():
            return np.zeros((count, ka.NF))
        rate, alpha, speed, pitch, height = (
            generator(seed, "alexis.process").standard_normal((count, 5)) * q * math.sqrt(self.h)
        ).T
        return np.ascontiguousarray(np.stack([speed, self.p.V_mps * (pitch - alpha), pitch, rate, height], axis=1))

    def _vane_bias(self, seed: int) -> Arr:
        s = self.p.sensors
        g = generator(seed, "alexis.vane")
        walk = np.cumsum(g.standard_normal(self.samples)) * s.bias_walk * RAD * math.sqrt(self.dt)
        t = np.arange(self.samples) * self.dt
        return walk + s.bias_start_deg * RAD * g.standard_normal() + np.where(t >= s.bias_at_s, s.bias_deg * RAD, 0.0)

    def place(self, rate: float, alpha_K: float, V_K: float, pitch: float, height: float) -> None:
        """Put the aircraft at deviations from trim [rad/s, rad, m/s, rad, m] before the first step, and read the instruments."""
        V = self.p.V_mps + V_K
        path = pitch - alpha_K
        if self.p.linear:
            self.f[:2] = V, self.p.V_mps * path
        else:
            self.f[:2] = V * math.cos(path), V * math.sin(path)
        self.f[2:] = pitch, rate, self.p.height_m + height
        self._observe()

    @property
    def surfaces(self) -> tuple[float, float]:
        """Elevator and flap [rad] as they are."""
        if self.p.direct:
            return float(self.command[0]), float(self.command[2])
        return float(self._servo_state[n.S_SURF]), float(self._servo_state[n.S_SURF + 1])

    @property
    def air(self) -> Arr:
        """Wind [2] at this sample: down, tail [m/s]."""
        return np.asarray(self.wind[self.k * self.ticks] + self.free)

    def breathe(self, down: float, ahead: float) -> None:
        """Wind of the air mass [m/s] at this sample and until the next, on top of the turbulence and gusts of its own."""
        if self.free[0] != down or self.free[1] != ahead:
            self.free[:] = down, ahead
            self._observe()

    @property
    def specific_force(self) -> tuple[float, float]:
        """What an accelerometer reads without error at this sample: body forward and body down [m/s^2]."""
        o, pitch = self._W[4], float(self.f[ka.F_PITCH])
        if self.p.linear:
            return float(o[0]) + self.a[ka.A_G] * pitch, -float(o[1])
        return float(o[0]) * math.cos(pitch) + float(o[1]) * math.sin(pitch), -float(o[5])

    def freeze(self, elevator: bool, flap: bool) -> None:
        """Jam surfaces where they are, or let them go again."""
        self._servo_command[n.C_JAM], self._servo_command[n.C_JAM + 1] = float(elevator), float(flap)

    def step(self, command: Arr) -> None:
        """Go to the next sample with `command` [3] (elevator [rad], throttle setting, flap [rad]) in force meanwhile."""
        if self.k + 1 >= self.samples:
            raise ValueError(f"flight of {self.samples} samples is over")
        self.command[:] = command
        i = self.k * self.ticks
        wind = self.wind[i : i + self.ticks + 1]
        ka.advance(
            self.f, self._servo_state, self._servo, self._servo_command, self.command, self.p.direct,
            wind + self.free if self.free.any() else wind, self._kick[i : i + self.ticks], self.a, self.h, self._W, self.vertical,
        )  # fmt: skip
        self.k += 1
        self._observe()

    def _observe(self) -> None:
        c, k, V0 = self._controls, self.k, self.p.V_mps
        c[0], c[2] = self.surfaces
        c[1] = self.command[1]
        w = self.air
        ka.readings(self.f, w, c, self.a, self._W[4], self._clean)
        self.reading[:] = self._clean + self._noise[k]
        self.reading[ka.R_VANE] += self._bias[k]
        self.fresh = (1 << ka.NR) - 1
        if k % self.p.sensors.ground_every:
            self.fresh &= ~(1 << ka.R_GROUND)
        vx, vup, pitch, rate, height = self.f
        path, speed = (vup / V0, vx) if self.p.linear else (math.atan2(vup, vx), math.hypot(vx, vup))
        self.truth[:] = (
            self._aux[k * self.ticks], w[0] / V0, w[1], rate, pitch - path, speed - V0, pitch,
            height - self.p.height_m, self._bias[k],
        )  # fmt: skip
