"""A receiver without onboard software: a point that follows the stochastic truth model of Rivard (1982), section III.

Steady wind, no gusts. Its axes: x from the control point to where it comes from, y to the left of x seen from above.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.types import Vec3
from sim_plant.couplings import traffic_kernel as k
from sim_plant.couplings.base import Coupling
from sim_plant.couplings.traffic_config import Track, TrafficCfg
from sim_plant.kernels.rot import quat_dcm
from sim_plant.rng import BLOCK, generator
from sim_plant.truth import Truth


class Traffic(Coupling):
    """Its state and its own generators: "<name>.start" and "<name>.motion"."""

    lateral_read = True

    def __init__(self, cfg: TrafficCfg, track: Track, wind: tuple[float, float], seed: int, dt: float) -> None:
        """`wind` north, east [m/s] (towards) steady at its altitude; dt [s] step."""
        self.cfg, self.track, self.dt, self.t = cfg, track, dt, 0.0
        h = math.radians(track.heading_deg)
        self._c, self._s = math.cos(h), math.sin(h)
        wx, self.wy = self._c * wind[0] + self._s * wind[1], self._s * wind[0] - self._c * wind[1]
        self._wind = (wind[0], wind[1], 0.0)
        p = self.p = np.zeros(k.P_N)
        # it crabs so that its mean track is the planned one
        p[k.P_U] = -math.sqrt(cfg.V_mps**2 - self.wy**2) + wx
        p[k.P_SC], p[k.P_SF], p[k.P_TF] = cfg.velocity_sigma_mps, cfg.fluctuation_sigma_mps, cfg.fluctuation_tau_s
        p[k.P_SY0], p[k.P_SVY], p[k.P_QY] = cfg.y_sigma_m, cfg.drift_sigma_mps, cfg.walk_m2ps
        p[k.P_SA], p[k.P_TN], p[k.P_X0] = cfg.altitude_sigma_m, 1.0, cfg.x_m  # the set's errors belong to the set
        p[k.P_MT], p[k.P_MA], p[k.P_MR] = (
            cfg.manoeuvre_at_s,
            math.radians(cfg.turn_deg),
            math.radians(cfg.turn_rate_degps),
        )
        p[k.P_MV], p[k.P_MD], p[k.P_VR] = cfg.speed_change_mps, cfg.speed_accel_mps2, cfg.V_mps
        self.s = np.zeros(8)
        k.receiver_start(generator(seed, f"{cfg.name}.start").standard_normal(7), p, self.s)
        self.s[k.S_Y] += cfg.y_m
        self._rng = generator(seed, f"{cfg.name}.motion")
        self._z, self._at, self._wk = np.zeros(0), 0, np.zeros(13)

    def advance(self) -> None:
        """One step of dt."""
        if self._at == len(self._z):
            self._z, self._at = self._rng.standard_normal(4 * BLOCK), 0
        k.receiver_step(self.s, self.t, self.dt, self._z, self._at, self.p, self._wk)
        self._at += 4
        self.t += self.dt

    def _to_n(self, x: float, y: float) -> tuple[float, float]:
        return self._c * x + self._s * y, self._s * x - self._c * y

    @property
    def position(self) -> Vec3:
        """North, east, down [m]."""
        n, e = self._to_n(float(self.s[k.S_X]), float(self.s[k.S_Y]))
        return self.track.north_m + n, self.track.east_m + e, -(self.cfg.alt_m - float(self.s[k.S_AE]))

    @property
    def velocity(self) -> Vec3:
        """Over ground [m/s]; the random walk across track has none."""
        s, p = self.s, self.p
        vx, vy = float(p[k.P_U] + s[k.S_VC] + s[k.S_VF]), float(s[k.S_VY])
        since = self.t - float(p[k.P_MT])
        if since > 0.0:
            dv, a = float(p[k.P_MV]), float(p[k.P_MA])
            vx -= math.copysign(min(float(p[k.P_MD]) * since, abs(dv)), dv)
            turned = math.copysign(min(float(p[k.P_MR]) * since, abs(a)), a)
            vx += float(p[k.P_VR]) * (1.0 - math.cos(turned))
            vy -= float(p[k.P_VR]) * math.sin(turned)
        n, e = self._to_n(vx, vy)
        return n, e, 0.0

    @property
    def lateral_m(self) -> float:
        """Where the crew sees it [m]."""
        return self.cfg.y_m

    def others(self, own: Truth) -> list[tuple[int, Truth]]:
        """Its truth, for the log; xi from the aircraft `own` is the truth of, in that one's body axes."""
        attitude = np.array(quat_dcm(*own.q_nb)).reshape(3, 3).T
        pos, vel = self.position, self.velocity
        psi = math.atan2(vel[1] - self._wind[1], vel[0] - self._wind[0])
        xi = (attitude * (np.array(pos) - np.array(own.pos_n))).sum(axis=1)
        airspeed = math.hypot(vel[0] - self._wind[0], vel[1] - self._wind[1])
        zero = (0.0, 0.0, 0.0)
        truth = Truth(
            t_us=own.t_us, pos_n=pos, vel_n=vel, q_nb=(math.cos(0.5 * psi), 0.0, 0.0, math.sin(0.5 * psi)), w_b=zero,
            euler=(psi, 0.0, 0.0), acc_n=zero, wind_n=self._wind, wind_rot=zero, V=airspeed, beta=0.0, alpha=0.0,
            controls=(0.0, 0.0, 0.0, 0.0), thrust_available=0.0, xi=(float(xi[0]), float(xi[1]), float(xi[2])),
            xi_dot=zero, mass=0.0, fuel_kg=0.0, boom_elevation=0.0, boom_azimuth=0.0, boom_extension=0.0,
            contact=False, inside=False,
        )  # fmt: skip
        return [(self.cfg.sysid, truth)]
