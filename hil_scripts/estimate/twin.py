"""Synthetic flights on the path of a log, with known wind and known probe errors: what the estimator is worth there.

Ground velocity and attitude are the log's, smoothed; wind, probe errors and sensor noise are drawn. Two kinds:

- exact: the filter's own model (random-walk wind, white velocity noise, true attitude), for consistency;
- like the log: wind that reverts to a mean, attitude and velocity with slow errors, an attitude that is corrected ten times a
  second, a gyro with a scale error. None of this is in the filter's model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from hil_scripts.estimate.columns import FlightLog
from hil_scripts.estimate.kinematic import KinematicParams

Array = np.ndarray


@dataclass(frozen=True)
class Twin:
    """A synthetic log with its truth: wind [n,3] NED, probe (scale, beta, alpha) [3]."""

    log: FlightLog
    wind: Array
    probe: Array


@dataclass(frozen=True)
class SlowErrors:
    """What a log has and the filter's model has not. 1-sigma and time constant of first-order processes."""

    wind_sigma: float = 1.9  # [m/s] about the mean; with wind_s it has the log's m/s per sqrt(s)
    wind_s: float = 5.0  # [s]
    att: float = 0.005  # [rad]
    att_s: float = 5.0  # [s]
    vel: float = 0.1  # [m/s]
    vel_s: float = 5.0  # [s]
    gyro_scale: float = 0.02  # [-]


def _reverting(rng: np.random.Generator, n: int, dt: float, sigma: float, tau: float) -> Array:
    """First-order Gauss-Markov sequences [n,3], stationary from the start."""
    c = float(np.exp(-dt / tau))
    w = rng.normal(size=(n, 3)) * sigma * np.sqrt(1.0 - c * c)
    x = np.empty((n, 3))
    x[0] = rng.normal(size=3) * sigma
    for k in range(1, n):
        x[k] = c * x[k - 1] + w[k]
    return x


def make(log: FlightLog, p: KinematicParams, seed: int, slow: SlowErrors | None = None, smooth_s: float = 0.3) -> Twin:
    """One synthetic flight of a log with both vanes; slow None: the exact kind. Same seed, same flight."""
    rng = np.random.default_rng([seed, 0 if slow is None else 1])
    n, dt = len(log), float(np.median(np.diff(log.t)))
    vel = gaussian_filter1d(log.vel_n, smooth_s / dt, axis=0)
    euler = gaussian_filter1d(np.unwrap(log.euler, axis=0), smooth_s / dt, axis=0)
    body = Rotation.from_euler("ZYX", euler)
    turn = (body[:-1].inv() * body[1:]).as_rotvec() / dt
    rate = np.concatenate([turn[:1], 0.5 * (turn[1:] + turn[:-1]), turn[-1:]])
    mean = np.array([-3.0, 12.0, 0.0]) if log.wind_n is None else log.wind_n.mean(axis=0)
    if slow is None:
        steps = rng.normal(size=(n, 3)) * p.q_wind * np.sqrt(dt)
        wind = mean + np.cumsum(steps, axis=0)
        wind -= wind.mean(axis=0) - mean  # a walk of 50 s would leave the range in which an aircraft of 15 m/s can fly
    else:
        wind = mean + _reverting(rng, n, dt, slow.wind_sigma, slow.wind_s)
    probe = rng.normal(size=3) * [p.probe_scale, p.probe_beta, p.probe_alpha]
    u = body.apply(vel - wind, inverse=True)
    V = np.linalg.norm(u, axis=1)
    air = np.stack(
        [V * (1.0 + probe[0]), np.arcsin(u[:, 1] / V) + probe[1], np.arctan2(u[:, 2], u[:, 0]) + probe[2]], -1
    )
    air = air + rng.normal(size=(n, 3)) * [p.r_V, p.r_beta, p.r_alpha]
    vel_m = vel + rng.normal(size=(n, 3)) * p.r_vel
    gyro = rate + rng.normal(size=(n, 3)) * 0.5 * p.r_rate
    if slow is not None:
        err = _reverting(rng, n, dt, slow.att, slow.att_s)
        hold = max(1, round(0.1 / dt))
        err = err[(np.arange(n) // hold) * hold]  # the attitude is corrected in steps
        euler = (body * Rotation.from_rotvec(err)).as_euler("ZYX")
        vel_m = vel_m + _reverting(rng, n, dt, slow.vel, slow.vel_s)
        gyro = gyro * (1.0 + slow.gyro_scale * rng.normal(size=3))
    twin = replace(
        log, name=f"twin {seed}", euler=euler, w_b=gyro, vel_n=vel_m, air=air, wind_n=wind, pos_n=None, stale={}
    )
    return Twin(twin, wind, probe)
