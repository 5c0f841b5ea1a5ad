"""The twin-jet transport: parameters, trimmed start, wind along its flight and instruments, one sample at a time.

`TwinJet.step` takes the controls computed from the present reading and goes to the next sample. Aircraft's numbers: its file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import TwinJet as Record
from flightsw.aircraft import twinjet
from sim_plant.aircraft.twinjet import dynamics as kt
from sim_plant.rng import generator
from sim_plant.wind.microburst import Microburst
from sim_plant.wind.planar import Gust, PlanarWind, wind_series

Arr = NDArray[np.float64]
RAD = math.pi / 180.0
FOOT = 0.3048
NT = 11


@dataclass(frozen=True)
class TwinJetSensors:
    """Standard deviation per sample; the source gives feet, feet per second and degrees."""

    height_m: float = 5.0 * FOOT
    ground_mps: float = 3.6 * FOOT
    air_mps: float = 1.7 * FOOT
    alpha_deg: float = 0.5
    pitch_deg: float = 0.05
    rate_degps: float = 0.05
    climb_mps: float = 0.5 * FOOT
    accel_mps2: float = 0.322 * FOOT

    def sigmas(self) -> Arr:
        """Vector [9] in SI and radians."""
        deg = (self.alpha_deg * RAD, self.pitch_deg * RAD, self.rate_degps * RAD)
        return np.array(
            [self.height_m, self.ground_mps, self.air_mps, *deg, self.climb_mps, self.accel_mps2, self.accel_mps2]
        )


@dataclass(frozen=True)
class TwinJetAir:
    """Downburst, turbulence (Dryden; standard deviation and scale length along x and up) and discrete gusts."""

    burst: Microburst = field(default_factory=lambda: Microburst(0.0))
    sigma_u_mps: float = 0.0
    sigma_w_mps: float = 0.0
    L_u_m: float = 260.0
    L_w_m: float = 100.0
    gusts: tuple[Gust, ...] = ()

    def series(self, V: float, count: int, dt: float, seed: int) -> Arr:
        """Gusts [count,2] (along x, up) [m/s] at ticks of dt [s], for flight at V [m/s]."""
        if not self.gusts and self.sigma_u_mps == self.sigma_w_mps == 0.0:
            return np.zeros((count, 2))
        w = PlanarWind(self.sigma_w_mps, self.sigma_u_mps, self.L_w_m, self.L_u_m, gusts=self.gusts)
        down_tail = wind_series(w, V, count, dt, seed)[0]
        return np.ascontiguousarray(np.stack([down_tail[:, 1], -down_tail[:, 0]], axis=1))


@dataclass(frozen=True)
class TwinJetParams:
    """The aircraft as it is, and where its approach begins. Factors multiply lift, drag and pitching moment."""

    lift_factor: float = 1.0
    drag_factor: float = 1.0
    moment_factor: float = 1.0
    x_m: float = -4500.0
    height_m: float = 350.0
    ground_mps: float = 75.0
    slope_deg: float = 3.0
    sensors: TwinJetSensors = field(default_factory=TwinJetSensors)
    aircraft: Record = field(default_factory=twinjet)

    def vector(self) -> Arr:
        """Parameter vector [NA] of the kernels."""
        a, ac = np.zeros(kt.NA), self.aircraft
        a[kt.A_MASS], a[kt.A_GRAV], a[kt.A_RHO] = ac.mass.kg, ac.air.gravity_mps2, ac.air.rho_kgpm3
        a[kt.A_AREA], a[kt.A_CHORD], a[kt.A_INERTIA] = ac.geometry.S_m2, ac.geometry.c_m, ac.inertia.Iyy_kgm2
        curve, drag, pitch, jets = ac.lift, ac.drag, ac.pitch, ac.engine
        a[kt.A_CL0], a[kt.A_CLA], a[kt.A_CLE] = curve.CL0, curve.CL_alpha, curve.CL_de
        a[kt.A_STALL], a[kt.A_PEAK], a[kt.A_FALL], a[kt.A_FALL_RAD] = (
            curve.straight_rad, curve.top_rad, curve.fall, curve.fall_rad,
        )  # fmt: skip
        a[kt.A_CD0], a[kt.A_CDK], a[kt.A_CDS] = drag.CD0, drag.K, drag.beyond
        a[kt.A_CM0], a[kt.A_CMA], a[kt.A_CMQ], a[kt.A_CME] = pitch.Cm0, pitch.Cm_alpha, pitch.Cm_q, pitch.Cm_de
        a[kt.A_LAG], a[kt.A_TMAX], a[kt.A_LAPSE], a[kt.A_IDLE] = (
            jets.lag_s,
            jets.thrust_N,
            jets.lapse_spm,
            jets.idle_frac,
        )
        return a


class TwinJet:
    """One flight of at most `duration_s`, sampled and integrated every dt [s].

    After construction and every step: `truth` [11] (kernels.twinjet.observe), `reading` [9]; `f` [7] is the plant's state.
    """

    def __init__(
        self, p: TwinJetParams, air: TwinJetAir, seed: int, duration_s: float, dt: float = 0.02,
        free: tuple[float, float] = (0.0, 0.0),
    ) -> None:  # fmt: skip
        """Trimmed on the slope in the wind of the start; free: that of the air mass [m/s], along x and up (see `breathe`).

        Raises ValueError for a duration below a sample or without trim."""
        self.samples = round(duration_s / dt) + 1
        if self.samples < 2 or not dt > 0.0:
            raise ValueError(f"duration_s = {duration_s}, dt = {dt}; allowed: a sample or more, > 0")
        self.p, self.dt = p, dt
        self.a, self.m = p.vector(), air.burst.vector()
        self._factors(p)
        self.gusts = air.series(p.ground_mps, self.samples + 1, dt, seed)
        self._noise = generator(seed, "twinjet.sensors").standard_normal((self.samples, kt.NR)) * p.sensors.sigmas()
        self.free = np.array(free)
        self._W = np.zeros((6, kt.NF))
        self._clean, self.reading, self.truth = np.zeros(kt.NR), np.zeros(kt.NR), np.zeros(NT)
        self.f, self.controls = np.zeros(kt.NF), np.zeros(2)
        self.k = 0
        self._trim()
        self._observe()

    def _factors(self, p: TwinJetParams) -> None:
        """Factors of all lift coefficients and what they add up to, of the moment's; drag keeps its own build-up."""
        a = self.a
        a[[kt.A_CL0, kt.A_CLA, kt.A_CLE]] *= p.lift_factor
        a[[kt.A_CD0, kt.A_CDS]] *= p.drag_factor
        a[kt.A_CDK] *= p.drag_factor / p.lift_factor**2
        a[[kt.A_CM0, kt.A_CMA, kt.A_CMQ, kt.A_CME]] *= p.moment_factor

    def _trim(self) -> None:
        """Steady flight on the slope in the start's steady wind: incidence, thrust and elevator without accelerations."""
        from scipy.optimize import root  # slow to import: only where something is trimmed

        p, f, u, W = self.p, self.f, self.controls, self._W
        climb = -p.ground_mps * math.tan(p.slope_deg * RAD)
        f[: kt.F_PITCH] = p.x_m, p.height_m, p.ground_mps, climb
        gx, gh = self.gusts[0] + self.free

        def out_of_balance(v: Arr) -> list[float]:
            f[kt.F_PITCH], f[kt.F_THRUST], u[0], u[1] = v[0], 1e5 * v[1], 1e5 * v[1], v[2]
            kt.rates(f, u, gx, gh, self.a, self.m, W[5], W[0])
            return [float(W[0, kt.F_VX]), float(W[0, kt.F_VH]), 10.0 * float(W[0, kt.F_RATE])]

        found = root(out_of_balance, np.array([0.0, 0.4, 0.0]), tol=1e-12)
        if np.abs(out_of_balance(found.x)).max() > 1e-6:
            raise ValueError(f"no steady flight at {p.ground_mps} m/s over the ground, {p.height_m} m: {found.message}")

    def breathe(self, along: float, up: float) -> None:
        """Wind of the air mass [m/s] at this sample and until the next, on top of downburst, turbulence and gusts of its own. Not
        in the truth's rates of the wind."""
        if self.free[0] != along or self.free[1] != up:
            self.free[:] = along, up
            self._observe()

    def step(self, u: Arr) -> None:
        """Go to the next sample with controls u [2] (thrust command [N], elevator [rad]) in force meanwhile."""
        if self.k + 1 >= self.samples:
            raise ValueError(f"flight of {self.samples} samples is over")
        self.controls[:] = u
        g0, g1 = self.gusts[self.k] + self.free, self.gusts[self.k + 1] + self.free
        kt.advance(self.f, self.controls, g0, g1, self.dt, self.a, self.m, self._W)
        self.k += 1
        self._observe()

    def _observe(self) -> None:
        k = self.k
        slope = (self.gusts[k + 1] - self.gusts[k]) / self.dt
        kt.observe(
            self.f, self.controls, self.gusts[k] + self.free, slope, self.a, self.m, self._W, self._clean, self.truth
        )
        self.reading[:] = self._clean + self._noise[k]
