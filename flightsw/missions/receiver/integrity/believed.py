"""How large the bank believes each error of a source to be, and how long it lasts."""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.receiver.integrity.layout import (
    AB,
    AT,
    BOOM,
    FW,
    GNSS,
    GV,
    OB,
    OW,
    RC,
    REL,
    RS,
    RV,
    G,
)
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.types import Vec3


class Believed:
    """Variance `var` [n] and correlation time `tau` [n] s of every error state; what does not decay has an infinite one."""

    def __init__(self, p: IntegrityParams, boom: tuple[float, float], n: int) -> None:
        """boom: its length [m], over which its angles err, and elevation [rad] in contact; n: NB, or NB_WAKE with the wake
        position."""
        self.p = p
        self.boom = fixed_of_boom(p, *boom)
        var, tau = np.zeros(n), np.full(n, math.inf)
        own = 1.0 + p.gnss_blocked * p.gnss_blocked  # the tanker's, and the receiver's below it
        var[RS], tau[RS] = p.rel_slow_m**2, p.rel_tau_s
        var[RV], tau[RV] = p.rel_vel_slow_mps**2, p.rel_tau_s
        h, v = p.gnss_slow_m
        var[G], tau[G] = (own * h * h, own * h * h, own * v * v), p.gnss_tau_s
        var[GV], tau[GV] = 2.0 * p.gnss_vel_slow_mps**2, p.gnss_tau_s
        var[AT], tau[AT] = p.att_rad**2, p.att_tau_s
        var[AB], tau[AB] = p.accel_slow**2, p.accel_tau_s
        var[FW], tau[FW] = p.wake_fast_m**2, p.wake_fast_tau_s
        self.var, self.tau = var, tau

    def fixed(self, xi: Vec3) -> np.ndarray:
        """Variance [3] of the relative sensor's constant error at xi [m]: offset, boresight, share of the range."""
        p, out = self.p, np.zeros(3)
        for i, x in enumerate(xi):
            across = sum(y * y for y in xi) - x * x
            out[i] = p.rel_const_m**2 + p.rel_boresight_rad**2 * across + (p.rel_scale * x) ** 2
        return out

    def wake(self, lasting: np.ndarray) -> None:
        """Lasting error of the wake position's rows: variances [2] m^2, which come with them."""
        self.var[OW] = lasting

    def at(self, i: int, xi: Vec3) -> float:
        """Variance of error state i at xi [m], before anything is learnt of it."""
        if RC.start <= i < RC.stop:
            return float(self.fixed(xi)[i - RC.start])
        return float(self.boom[i - OB.start] if OB.start <= i < OB.stop else self.var[i])

    def alone(self, source: int, xi: Vec3) -> float:
        """Variance [m^2] of the position by one source at xi [m], nothing learnt of its errors: the worst axis."""
        if source == REL:
            return float((self.var[RS] + self.fixed(xi)).max())
        if source == GNSS:
            return float(self.var[G].max())
        return float(self.boom.max()) if source == BOOM else math.inf  # the wake position says nothing of one axis


def fixed_of_boom(p: IntegrityParams, length_m: float, elevation_rad: float) -> np.ndarray:
    """Variance [3] m^2 of the boom's fixed error in tanker axes: extension along it, elevation and azimuth across it."""
    c, s = math.cos(elevation_rad), math.sin(elevation_rad)
    along, across = p.boom_ext_const_m**2, (p.boom_angle_const_rad * length_m) ** 2
    return np.array([c * c * along + s * s * across, c * c * across, s * s * along + c * c * across])
