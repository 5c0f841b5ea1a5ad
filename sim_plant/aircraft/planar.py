"""What aircraft that fly in a vertical plane along a fixed heading have in common."""

from __future__ import annotations

import math

from sim_plant.aircraft.base import Arr, Member
from sim_plant.aircraft.kind import Setup
from sim_plant.kernels import layout as n
from sim_plant.wind.field import AirMass


class Planar(Member):
    """Flight in a vertical plane. Subclasses write `view.s`, `view.o` and `wind` in observe().

    The cross component of `free` acts by sideslip: side force carries the plane of flight along (`side_*`).
    """

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.psi = math.radians(self.cfg.start.psi_deg)
        self.ahead = math.cos(self.psi), math.sin(self.psi)
        self.side_m, self.side_mps = 0.0, 0.0  # to the right
        # ticks a series of its own wind has to last
        self.ticks = round(setup.sc.meta.duration_s * setup.sc.clock.base_rate_hz) + 1

    def meet(self, air: AirMass) -> tuple[float, float, float]:
        """Wind of the air mass at the start, ahead, to the right, down [m/s]: it starts without sideslip."""
        self.free[:] = *air.steady(-self.cfg.start.pos_n_m[2]), 0.0
        ahead, self.side_mps, down = self.along(self.free)
        return ahead, self.side_mps, down

    def track(self) -> tuple[float, float]:
        """The heading: without sideslip to speak of the air-relative track."""
        return self.ahead

    def along(self, v: Arr) -> tuple[float, float, float]:
        """A vector [3] NED as components ahead, to the right, down."""
        (c, e), (north, east, down) = self.ahead, v.tolist()
        return c * north + e * east, c * east - e * north, down

    def level(self, ahead: float, right: float) -> tuple[float, float]:
        """The way back: north and east of components ahead and to the right."""
        c, e = self.ahead
        if right == 0.0:  # keeps the sign of a zero
            return c * ahead, e * ahead
        return c * ahead - e * right, e * ahead + c * right

    def attitude(self, pitch: float, rate: float, forward: float, up: float) -> None:
        """Attitude, rates and velocity over the ground into the view: pitch [rad], its rate [rad/s], forward and up [m/s]."""
        s = self.view.s
        ch, cp = math.cos(0.5 * self.psi), math.cos(0.5 * pitch)
        sh, sp = math.sin(0.5 * self.psi), math.sin(0.5 * pitch)
        s[n.S_Q : n.S_Q + 4] = ch * cp, -sh * sp, ch * sp, sh * cp
        s[n.S_W : n.S_W + 3] = 0.0, rate, 0.0
        s[n.S_V : n.S_V + 3] = *self.level(forward, self.side_mps), -up
        self.view.o[n.O_EULER : n.O_EULER + 3] = self.psi, pitch, 0.0

    def flow(self, airspeed: float, alpha: float, slope: float) -> float:
        """Airspeed, incidence and sideslip into the view, at all probes those of the centre of gravity; returns the side
        acceleration [m/s^2]. airspeed [m/s], alpha [rad]: in the plane; slope: side force per mass at it [m/s^2 per rad]."""
        o, across = self.view.o, self.side_mps - self.along(self.free)[1]
        V = math.hypot(airspeed, across)
        beta = math.asin(across / V)
        o[n.O_V], o[n.O_ALPHA], o[n.O_BETA] = V, alpha, beta
        for i in range(len(self.probes)):
            o[n.O_PROBE + 3 * i : n.O_PROBE + 3 * i + 3] = V, alpha, beta
        self._side_tau = airspeed / -slope if slope else math.inf  # [s] the cross wind takes it along
        return slope * beta + 0.0  # no minus zero

    def carry(self) -> None:
        """Sideways motion over the tick, cross wind held: exact for the time constant of `flow`."""
        cross = self.along(self.free)[1]
        if self.side_mps == cross == 0.0:
            return
        before = self.side_mps
        self.side_mps += (cross - before) * -math.expm1(-self.dt_s / self._side_tau)
        self.side_m += 0.5 * (before + self.side_mps) * self.dt_s
