"""A level flight with a turn, in a wind and with sensors drawn from the model the wind estimate believes, without the plant.

Attitude is of a coordinated turn. Readings are exact but for the errors drawn; fixes and air data come late, by their stamps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from flightsw.sixdof.windcal.filter import WindCalibrator
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, NavState, SensorFrame
from sim_plant.sensors.onboard import turned

G = 9.80665  # [m/s^2]
V, RATE = 195.0, math.radians(1.7)  # [m/s], [rad/s]
WIND = np.array([12.0, -28.0, 0.0])  # [m/s]
GNSS_LAG, AIR_LAG = 2, 1  # [steps] a fix and a reading are old
FIELDS = UPD_AIR | UPD_ATT | UPD_GNSS | UPD_IMU


def dcm(psi: float, theta: float, phi: float) -> np.ndarray:
    """Body to NED [3,3] of 3-2-1 angles."""
    (a, s), (c, t), (e, f) = ((math.cos(x), math.sin(x)) for x in (psi, theta, phi))
    z, y, x = [[a, -s, 0], [s, a, 0], [0, 0, 1]], [[c, 0, t], [0, 1, 0], [-t, 0, c]], [[1, 0, 0], [0, e, -f], [0, f, e]]
    return np.array(z) @ np.array(y) @ np.array(x)


def quaternion(psi: float, theta: float, phi: float) -> list[float]:
    """Body to NED of 3-2-1 angles, scalar first."""
    (a, s), (c, t), (e, f) = ((math.cos(x / 2), math.sin(x / 2)) for x in (psi, theta, phi))
    return [e * c * a + f * t * s, f * c * a - e * t * s, e * t * a + f * c * s, e * c * s - f * t * a]


@dataclass
class Errors:
    """What is added to the truth, per step [n] or [n,k]; zero unless drawn."""

    n: int
    scale: float = 0.0
    air: np.ndarray = field(init=False)  # [n,3] V, beta, alpha
    att: np.ndarray = field(init=False)  # [n,3]
    vel: np.ndarray = field(init=False)  # [n,3]
    wind: np.ndarray = field(init=False)  # [n,3] NED besides the mean
    wake: np.ndarray = field(init=False)  # [n,3] own body axes

    def __post_init__(self) -> None:
        self.air, self.att, self.vel, self.wind, self.wake = (np.zeros((self.n, 3)) for _ in range(5))


def markov(r: np.random.Generator, n: int, k: int, sigma: float, tau: float, dt: float) -> np.ndarray:
    """[n,k] first-order Gauss-Markov, stationary."""
    f = math.exp(-dt / tau)
    w = r.normal(size=(n, k)) * sigma
    w[1:] *= math.sqrt(1.0 - f * f)
    for i in range(1, n):
        w[i] += f * w[i - 1]
    return w


def drawn(p: WindCalParams, seed: int, n: int, dt: float, probes: int, behind: bool) -> Errors:
    """Errors from what p believes."""
    r, e, s = np.random.default_rng(seed), Errors(n), 1.0 / math.sqrt(probes)
    e.scale = p.V_scale * s * r.normal()
    e.air[:, :1] = p.V_offset_mps * s * r.normal() + markov(r, n, 1, p.V_gm_mps * s, p.V_gm_tau_s, dt)
    e.air[:, :1] += r.normal(size=(n, 1)) * p.V_white_mps * s
    for k in (1, 2):
        e.air[:, k] = p.vane_offset * s * r.normal() + markov(r, n, 1, p.vane_gm * s, p.vane_gm_tau_s, dt)[:, 0]
        e.air[:, k] += r.normal(size=n) * p.vane_white * s
    e.att[:] = p.att_constant * r.normal(size=3) + markov(r, n, 3, p.att_gm, p.att_gm_tau_s, dt)
    e.att += r.normal(size=(n, 3)) * p.att_white
    e.vel[:] = markov(r, n, 3, p.vel_mps, p.vel_tau_s, dt) + r.normal(size=(n, 3)) * p.vel_white_mps
    e.wind[:, :2] = np.cumsum(r.normal(size=(n, 2)), axis=0) * p.slow_q_mps * math.sqrt(dt)
    e.wind[:, 2] = markov(r, n, 1, p.slow_down_mps, p.slow_down_tau_s, dt)[:, 0]
    e.wind += markov(r, n, 3, p.gust_mps, p.gust_L_m / V, dt)
    if behind:
        e.wake[:, :2] = markov(r, n, 2, p.wake_side_mps, p.wake_side_tau_s, dt)
        e.wake[:, 2] = markov(r, n, 1, p.wake_down_mps, p.wake_down_tau_s, dt)[:, 0]
    return e


@dataclass
class Step:
    """State of things after a step."""

    t: float
    turned: float  # [rad]
    error: np.ndarray  # [3] of the wind, NED
    cov: np.ndarray  # [3,3]
    nav: NavState


def fly(c: WindCalibrator, e: Errors, dt: float, turn_s: float, probes: int = 1, alpha: float = 0.05) -> Iterator[Step]:
    """Straight until turn_s [s], then a turn; one Step each dt [s]. Rolls in within two seconds."""
    f, nav, past = SensorFrame(gyro_count=1), NavState(valid=True), []
    psi, before = 0.0, np.zeros(3)
    for i in range(e.n):
        t = i * dt
        share = min(max((t - turn_s) / 2.0, 0.0), 1.0)
        psi += RATE * share * dt
        phi = math.atan(V * RATE * share / G)
        C = dcm(psi, alpha, phi)
        w = WIND + e.wind[i] + C @ e.wake[i]
        # along the heading through the mean wind, so that gusts are felt
        v = V * np.array([math.cos(psi), math.sin(psi), 0.0]) + WIND
        u = C.T @ (v - w)
        a = C @ dcm(e.att[i, 2], e.att[i, 1], e.att[i, 0])
        speed = float(np.linalg.norm(u))
        z = np.array([(1.0 + e.scale) * speed, math.asin(u[1] / speed), math.atan2(u[2], u[0])]) + e.air[i]
        past.append((t, z, v + e.vel[i]))
        f.t_us = f.att_t_us = round(t * 1e6)
        f.att_q_nb = turned(quaternion(psi, alpha, phi), e.att[i].tolist())
        # mean specific force of the interval just flown, in the axes the estimate turns it with
        g = a.T @ ((v - before) / dt - np.array([0.0, 0.0, G])) if i else np.zeros(3)
        f.acc_mean_b, before = tuple(g.tolist()), v
        g_t, _, g_v = past[max(i - GNSS_LAG, 0)]
        a_t, a_z, _ = past[max(i - AIR_LAG, 0)]
        f.gnss_t_us, f.gnss_vel_n = round(g_t * 1e6), tuple(g_v.tolist())
        f.air_t_us = round(a_t * 1e6)
        c.step(f, FIELDS, a_z.copy(), probes)
        nav.t_us = f.t_us
        c.publish(nav)
        yield Step(t, psi, np.array(nav.wind_n) - w, c.cov, nav)
