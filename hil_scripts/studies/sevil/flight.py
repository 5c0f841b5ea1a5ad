"""Kinematic flight from observation to contact behind a tanker, with the readings of three air-data probes in its wake.

Data source of the air-data studies (sevil.md sections 3.2, 8.3, 9.2). Every number of the air comes from the plant's
kernels, none from the onboard model; a mismatch is made by changing `PlantWake`. Frame F: origin tanker cg, x along the
tanker's air velocity, y right, z down. Reading order V1..3, beta1..3, alpha1..3; probes 0 nose, 1 left, 2 right tip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_scripts.studies.sevil.point_gusts import point_gusts
from hil_scripts.studies.sevil.probe_air import SPEC_PROBES, SPEC_WAKE, V3, Arr, PlantWake, plant_readings, span_wind
from sim_plant.kernels.layout import G0
from sim_plant.rng import generator
from sim_plant.wind.dryden import DrydenSeries

__all__ = [
    "SPEC_PROBES",
    "SPEC_WAKE",
    "AirFlight",
    "Conditions",
    "Fault",
    "PlantWake",
    "fly_air",
    "plant_readings",
    "table_faults",
]

RATE_HZ = 20.0
OBSERVATION: V3 = (-59.13, 56.33, 0.0)  # [m] in F
CONTACT: V3 = (-35.5, 0.0, 8.5)
LEG_NAMES = ("observation", "down", "lateral", "forward", "contact")
SHORT_LEGS = (60.0, 30.0, 80.0, 40.0, 120.0)  # [s] sevil.md 8.3
LONG_LEGS = (670.0, 30.0, 80.0, 40.0, 2180.0)  # [s] 3000 s run of sevil.md 9.2
WANDER_LINES, WANDER_HZ = 16, (0.02, 0.12)  # number and band of the sines of the wander


@dataclass(frozen=True)
class Fault:
    """One channel reads wrong by `size` + `rate` * (time since start), from start_s until before stop_s."""

    variable: int  # 0 V [m/s], 1 beta [rad], 2 alpha [rad]
    probe: int
    size: float
    start_s: float
    stop_s: float
    rate: float = 0.0  # [unit of the variable per s]

    @property
    def channel(self) -> int:
        """Column of the reading vector."""
        return 3 * self.variable + self.probe


@dataclass(frozen=True)
class Conditions:
    """What the flight meets and how good its instruments are; defaults: all disturbances of sevil.md 8.3."""

    legs_s: tuple[float, float, float, float, float] = SHORT_LEGS
    wake: PlantWake | None = SPEC_WAKE  # None: solo flight, no wake
    V_mps: float = 200.0
    observation_m: V3 = OBSERVATION  # the path leads from here
    contact_m: V3 = CONTACT  # to here
    probes_m: tuple[V3, ...] = SPEC_PROBES
    turbulence_mps: float = 0.39
    turbulence_L_m: float = 533.4
    separate_points: bool = False  # every probe meets the turbulence of its own place
    wind_mps: V3 = (2.0, 1.0, 0.5)  # steady, in F, unknown to the estimator
    wander_m: float = 0.15  # RMS per axis
    trim_alpha_deg: float = 3.0
    weathercock: float = 0.75  # [-] share of the sidewash angle followed in heading
    sigma: V3 = (math.sqrt(0.2), math.radians(math.sqrt(0.002)), math.radians(math.sqrt(0.002)))  # V, beta, alpha
    att_bias_deg: float = 0.1  # 1 sigma, constant, per angle
    att_noise_deg: float = 0.02
    x_sigma_m: float = 1.0  # constant error of the x given to the estimator
    acc_bias_mps2: float = 0.02
    acc_noise_mps2: float = 0.05
    gyro_noise_radps: float = 2e-4
    guess_sigma_m: float = 5.0  # first guess of y, z
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True)
class Motion:
    """A motion at 20 Hz: t [N] s; leg [N] index of LEG_NAMES; xi, xi_dot, acc [N,3] in F (acc = receiver minus tanker); att [N,3]
    psi, theta, phi [rad]; omega [N,3] body rates [rad/s]."""

    t: Arr
    leg: NDArray[np.int8]
    xi: Arr
    xi_dot: Arr
    acc: Arr
    att: Arr
    omega: Arr


@dataclass(frozen=True)
class AirFlight(Motion):
    """Air data along a true motion: air [N,k,3] wind besides the wake at each probe, F; clean [N,3k] readings without error.
    Measured: readings [N,3k] (noise and faults), faulty [N] mask of channels with a fault, att_m, omega_m, acc_m [N,3],
    x_m [N], guess [2] first guess of y, z [m]."""

    air: Arr
    clean: Arr
    readings: Arr
    faulty: NDArray[np.int64]
    att_m: Arr
    omega_m: Arr
    acc_m: Arr
    x_m: Arr
    guess: Arr


def table_faults(sign: float = 1.0) -> tuple[Fault, ...]:
    """The source's three faults (sevil.md section 4): V sensor 2 3 m/s, beta sensor 1 1 deg, alpha sensor 3 1 deg."""
    deg = math.radians(1.0)
    return (
        Fault(0, 1, 3.0 * sign, 500.0, 1500.0),
        Fault(1, 0, deg * sign, 1125.0, 2125.0),
        Fault(2, 2, deg * sign, 1750.0, 2750.0),
    )


def _path(t: Arr, legs: tuple[float, ...], start: V3, end: V3) -> tuple[NDArray[np.int8], Arr, Arr, Arr]:
    """Leg index, position, velocity, acceleration of the nominal path: a quintic rest to rest on each moving leg."""
    ends = np.cumsum(legs)
    leg = np.minimum(np.searchsorted(ends, t, side="right"), len(legs) - 1).astype(np.int8)
    o, c = np.array(start), np.array(end)
    stops = np.array(
        [o, o, [o[0], o[1], c[2]], [o[0], c[1], c[2]], c, c]
    )  # place at the beginning of each leg, and end
    pos, vel, acc = (np.zeros((len(t), 3)) for _ in range(3))
    for i, T in enumerate(legs):
        m = leg == i
        s = np.clip((t[m] - (ends[i] - T)) / max(T, 1e-9), 0.0, 1.0)[:, None]
        d = stops[i + 1] - stops[i]
        pos[m] = stops[i] + d * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        if np.any(d) and np.any(m):
            vel[m] = d / T * 30.0 * s**2 * (1.0 - s) ** 2
            acc[m] = d / T**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return leg, pos, vel, acc


def _wander(t: Arr, rms: float, seed: int) -> tuple[Arr, Arr, Arr]:
    """Smooth random motion [N,3] of the given RMS per axis, with its exact first and second derivative."""
    g = generator(seed, "sevil.wander")
    pos, vel, acc = (np.zeros((len(t), 3)) for _ in range(3))
    for axis in range(3):
        w = 2.0 * math.pi * g.uniform(*WANDER_HZ, WANDER_LINES)
        ph = g.uniform(0.0, 2.0 * math.pi, WANDER_LINES)
        a = rms * math.sqrt(2.0 / WANDER_LINES)
        for wi, pi in zip(w, ph, strict=True):
            s, c = np.sin(wi * t + pi), np.cos(wi * t + pi)
            pos[:, axis] += a * s
            vel[:, axis] += a * wi * c
            acc[:, axis] -= a * wi * wi * s
    return pos, vel, acc


def _attitude(xi: Arr, acc: Arr, c: Conditions) -> tuple[Arr, Arr]:
    """Trim attitude [N,3] and body rates [N,3]: pitch follows the downwash, heading part of the sidewash, bank the lateral
    acceleration (sevil.md 8.3)."""
    w = span_wind(xi, c.wake) if c.wake is not None else np.zeros_like(xi)
    att = np.stack(
        [
            -c.weathercock * w[:, 1] / c.V_mps,
            math.radians(c.trim_alpha_deg) + w[:, 2] / c.V_mps,
            acc[:, 1] / G0,
        ],
        axis=1,
    )
    dot = np.gradient(att, 1.0 / RATE_HZ, axis=0)
    ct, st, cf, sf = np.cos(att[:, 1]), np.sin(att[:, 1]), np.cos(att[:, 2]), np.sin(att[:, 2])
    omega = np.stack(
        [dot[:, 2] - dot[:, 0] * st, dot[:, 1] * cf + dot[:, 0] * sf * ct, dot[:, 0] * cf * ct - dot[:, 1] * sf], axis=1
    )
    return att, omega


def turbulence(count: int, c: Conditions, seed: int) -> Arr:
    """Turbulence [count, k, 3] (F, m/s) at the probes: Dryden, exactly discretised; the same at all unless separate_points."""
    k = len(c.probes_m)
    if c.turbulence_mps <= 0.0:
        return np.zeros((count, k, 3))
    dt = 1.0 / RATE_HZ
    if c.separate_points:
        return point_gusts(seed, c.V_mps, c.turbulence_L_m, c.turbulence_mps, dt, np.array(c.probes_m), count)
    series = DrydenSeries(seed, "sevil.turbulence", c.V_mps, c.turbulence_L_m, c.turbulence_mps, dt)
    rows = np.empty((0, 3))
    while len(rows) < count:
        rows = np.vstack([rows, series.advance()])
    return np.repeat(rows[:count, None, :], k, axis=1)


def inject(t: Arr, readings: Arr, faults: tuple[Fault, ...]) -> NDArray[np.int64]:
    """Add the faults to readings [N,9] in place; returns the mask of faulty channels [N] (bit = column)."""
    mask = np.zeros(len(t), dtype=np.int64)
    for f in faults:
        m = (t >= f.start_s) & (t < f.stop_s)
        readings[m, f.channel] += f.size + f.rate * (t[m] - f.start_s)
        mask[m] |= 1 << f.channel
    return mask


def _kinematic(c: Conditions, seed: int) -> tuple[Arr, NDArray[np.int8], Arr, Arr, Arr, Arr, Arr]:
    t = np.arange(round(sum(c.legs_s) * RATE_HZ)) / RATE_HZ
    leg, xi, xi_dot, acc = _path(t, c.legs_s, c.observation_m, c.contact_m)
    for target, extra in zip((xi, xi_dot, acc), _wander(t, c.wander_m, seed), strict=True):
        target += extra
    return t, leg, xi, xi_dot, acc, *_attitude(xi, acc, c)


def fly_air(c: Conditions, seed: int, motion: Motion | None = None) -> AirFlight:
    """Fly the legs of `c` with the randomness of `seed`, or along a motion; every error source draws from its own generator."""
    seed = seed % 2**31
    if motion is None:
        t, leg, xi, xi_dot, acc, att, omega = _kinematic(c, seed)
    else:
        t, leg, xi, xi_dot = motion.t, motion.leg, motion.xi, motion.xi_dot
        acc, att, omega = motion.acc, motion.att, motion.omega
    air = turbulence(len(t), c, seed) + np.array(c.wind_mps)
    clean = plant_readings(
        xi, att, xi_dot=xi_dot, omega=omega, air=air, probes_m=c.probes_m, V_mps=c.V_mps, wake=c.wake
    )
    k = len(c.probes_m)
    readings = clean + generator(seed, "sevil.noise").standard_normal(clean.shape) * np.repeat(c.sigma, k)
    faulty = inject(t, readings, c.faults)
    g = generator(seed, "sevil.attitude")
    att_m = att + np.radians(c.att_bias_deg * g.standard_normal(3) + c.att_noise_deg * g.standard_normal(att.shape))
    g = generator(seed, "sevil.accelerometer")
    acc_m = acc + c.acc_bias_mps2 * g.standard_normal(3) + c.acc_noise_mps2 * g.standard_normal(acc.shape)
    omega_m = omega + c.gyro_noise_radps * generator(seed, "sevil.gyro").standard_normal(omega.shape)
    g = generator(seed, "sevil.start")
    x_m = xi[:, 0] + c.x_sigma_m * g.standard_normal()
    guess = xi[0, 1:] + c.guess_sigma_m * g.standard_normal(2)
    return AirFlight(
        t, leg, xi, xi_dot, acc, att, omega, air, clean, readings, faulty, att_m, omega_m, acc_m, x_m, guess
    )
