"""Independent monitor of the wind estimate: a kinematic filter that knows no lift, drag or thrust.

Accelerometers and pitch rate are inputs; height, ground speed, airspeed, incidence, pitch and climb rate are readings. What it
says of the wind cannot be wrong for want of an aerodynamic model, so a lasting difference from WindshearNav accuses the latter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.filters.covariance import chol_psd
from flightsw.filters.factory import make_filter
from flightsw.kernels.linalg import finite
from flightsw.kernels.sampled import multiply
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear import monitor_kernel as kk
from flightsw.missions.windshear.model import WindshearNoise, WindshearSensors, triple_integrator
from flightsw.strict import OneOf, Range

Array = np.ndarray
READ = (k.Y_H, k.Y_VG, k.Y_VA, k.Y_AL, k.Y_TH, k.Y_HD)  # channel of each kinematic reading
INPUT = (k.Y_XDD, k.Y_HDD, k.Y_Q)
NEEDED = tuple(c for c in range(k.NY) if c != k.Y_H)  # what the wind is made of


@dataclass(frozen=True)
class MonitorNoise:
    """Process noise as in WindshearNoise; this filter has two of its densities."""

    wind: Annotated[float, Range(0.0)] = WindshearNoise.wind
    h_m: Annotated[float, Range(0.0)] = WindshearNoise.h_m


@dataclass(frozen=True)
class MonitorParams:
    """Tuning of WindshearMonitor."""

    filter: Annotated[str, OneOf(("ekf", "ukf", "srckf", "srukf"))] = "ekf"
    sensors: WindshearSensors = field(default_factory=WindshearSensors)
    noise: MonitorNoise = field(default_factory=MonitorNoise)
    gravity_mps2: Annotated[float, Range(9.7, 9.9)] = 9.81
    disagree_sigma: Annotated[float, Range(1.0)] = 4.0  # of the two wind estimates' summed variance
    disagree_s: Annotated[float, Range(0.0)] = 2.0  # how long before it counts
    slack_mps: Annotated[float, Range(0.0, 20.0)] = 0.0  # difference that fixed errors of instruments may make
    held_s: Annotated[float, Range(0.0, 10.0)] = 0.1  # [s] an input or reading may be missing; then no opinion


class WindshearMonitor:
    """`step` once per sample, then `compare`. `x` [10] (monitor_kernel.py), `sigma` [10]."""

    def __init__(self, p: MonitorParams | None = None) -> None:
        """Raises ValueError for parameters no filter can run."""
        self.p = p = p or MonitorParams()
        self.f = make_filter(p.filter, kk.NK, kk.NZ, kk.NK)
        r = p.sensors.sigmas()
        self._r6, self._r_in = r[list(READ)].copy(), r[list(INPUT)].copy()
        self._codes = np.zeros(kk.NZ, dtype=np.int64)
        self._y, self._r, self._a, self._last = np.zeros(kk.NZ), np.zeros(kk.NZ), np.zeros(3), np.zeros(3)
        self._SQ, self._dt = np.zeros((kk.NK, kk.NK)), 0.0
        self.started = False
        self.nis = math.nan
        self._apart_s = 0.0
        self._missing_s = np.zeros(k.NY)

    @property
    def x(self) -> Array:
        """Estimate [10]."""
        return self.f.x

    @property
    def sigma(self) -> Array:
        """1-sigma [10]."""
        return np.array(self.f.sigmas())

    @property
    def F(self) -> float:
        """Hazard index of this filter's own wind."""
        x = self.f.x
        vx, vh = x[kk.K_VX] - x[kk.K_WX], x[kk.K_VH] - x[kk.K_WH]
        V = math.hypot(vx, vh)
        return float((x[kk.K_WXD] * vx + x[kk.K_WHD] * vh) / (V * self.p.gravity_mps2) - x[kk.K_WH] / V)

    def step(self, z: Array, ok: int, dt: float) -> bool:
        """One sample of readings z [9] (order of WindshearNav), `ok` its bits, dt [s] since the last; True when `x` is good.

        The inputs of a step are the mean of the readings at its ends; one that is missing keeps its last value, for held_s.
        Without one of the readings for longer the state drifts away from the wind: it starts anew when all are back.
        """
        for c in NEEDED:
            self._missing_s[c] = 0.0 if ok >> c & 1 and math.isfinite(z[c]) else self._missing_s[c] + dt
        gap = self._missing_s.max() > self.p.held_s
        self.started = self.started and not gap
        for i, c in enumerate(INPUT):
            now = float(z[c]) if ok >> c & 1 and math.isfinite(z[c]) else self._last[i]
            self._a[i], self._last[i] = 0.5 * (self._last[i] + now), now
        m = 0
        for i, c in enumerate(READ):
            if ok >> c & 1 and math.isfinite(z[c]):
                self._codes[m], self._y[m], self._r[m] = i, z[c], self._r6[i]
                m += 1
        f = self.f
        if not self.started:
            if gap or m < kk.NZ:
                return False
            self._begin()
        else:
            if not (dt > 0.0 and math.isfinite(dt)):
                return False
            self._noise(dt)
            f.draw()
            kk.propagate_kinematic(f.X, self._a, dt)
            f.SQ[:] = self._SQ
            f.recombine()
        if m > 0:
            f.draw()
            kk.measure_kinematic(f.X, self._codes, m, f.Y)
            self.nis = f.correct(self._y, self._r, m)
        self.started = finite(f.x)
        return self.started

    def compare(self, x: Array, sigma: Array, dt: float) -> bool:
        """True once the wind of the estimate x [15], sigma [15] has differed from this filter's for disagree_s on end."""
        own, s = self.f.x, self.f.sigmas()
        apart = False
        for i in range(2):
            d = max(abs(x[k.WX + i] - own[kk.K_WX + i]) - self.p.slack_mps, 0.0)
            var = sigma[k.WX + i] ** 2 + s[kk.K_WX + i] ** 2
            apart = apart or not d * d <= self.p.disagree_sigma**2 * var
        self._apart_s = self._apart_s + dt if self.started and apart else 0.0
        return self._apart_s > self.p.disagree_s

    def _begin(self) -> None:
        y, r = self._y, self._r6
        V, gamma = y[kk.Z_VA], y[kk.Z_TH] - y[kk.Z_AL]
        self.f.x[:] = (
            y[kk.Z_H], y[kk.Z_VG], y[kk.Z_HD], y[kk.Z_TH],
            y[kk.Z_VG] - V * math.cos(gamma), y[kk.Z_HD] - V * math.sin(gamma), 0.0, 0.0, 0.0, 0.0,
        )  # fmt: skip
        s = [10.0 * r[i] for i in (kk.Z_H, kk.Z_VG, kk.Z_HD, kk.Z_TH)]
        s += [10.0 * r[kk.Z_VG], 10.0 * V * r[kk.Z_AL], 1.0, 1.0, 0.3, 0.3]
        self.f.set_factor(np.diag(s))

    def _noise(self, dt: float) -> None:
        if dt == self._dt:
            return
        Q = np.zeros((kk.NK, kk.NK))
        var = np.square(self._r_in)
        drive = np.array([[0.0, 0.5 * dt * dt, 0.0], [dt, 0.0, 0.0], [0.0, dt, 0.0], [0.0, 0.0, dt]])
        Q[kk.MOTION, kk.MOTION] = multiply(drive * var, drive.T)
        Q[kk.K_H, kk.K_H] += self.p.noise.h_m**2 * dt
        W = triple_integrator(self.p.noise.wind**2, dt)
        for at in (kk.K_WX, kk.K_WH):
            rows = slice(at, at + 5, 2)
            Q[rows, rows] = W
        chol_psd(Q, kk.NK, self._SQ)
        self._dt = dt
