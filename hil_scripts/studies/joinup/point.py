"""The join-up's own guidance on a point mass behind a point-mass tanker that may turn."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from flightsw.missions.receiver.guidances import make_join_path
from flightsw.missions.receiver.joinup import JoinUpGuidance, JoinUpParams, Sight
from flightsw.types import NavState

DT = 0.1
H_TANKER = 7010.0
ROLL_S = 3.0  # lag of the tanker's turn rate


@dataclass
class PointJoin:
    """A receiver of first-order lags behind a tanker, both in one wind. The tanker turns right at `turn_radps` from `turn_at_s`
    for `turn_s`; its turn rate is known to `rate_noise` [rad/s], white."""

    x: float = -3704.0  # own minus tanker, tanker heading axes [m]
    y: float = 0.0
    z: float = 305.0
    V: float = 200.0
    V_tanker: float = 195.0
    psi_tanker: float = 0.4
    wind: tuple[float, float] = (30.0, -12.0)
    heading_error: float = 0.0
    rate_bias: float = 0.0  # [rad/s] between the turn rate commanded and flown: gyro biases of both aircraft
    p: JoinUpParams = field(default_factory=JoinUpParams)
    turn_at_s: float = math.inf
    turn_radps: float = 0.0
    turn_s: float = 0.0
    rate_noise: float = 0.0
    rng: np.random.Generator | None = None

    def __post_init__(self) -> None:
        made = make_join_path(self.p)
        assert isinstance(made, JoinUpGuidance)
        self.g = made
        self.psi = self.psi_tanker + self.heading_error
        self.h, self.psi_dot = H_TANKER - self.z, 0.0
        self.t_us = 0
        self.seen = True
        self.turn_rate = 0.0
        c, s = math.cos(self.psi_tanker), math.sin(self.psi_tanker)
        self.origin = (1e4, -2e4)  # of the tanker
        self.pos = (1e4 + (c * self.x - s * self.y), -2e4 + (s * self.x + c * self.y))
        self.track: list[tuple[float, float, float, float]] = []

    def _turn_tanker(self) -> float:
        """Move its heading on; the turn rate as the receiver hears it."""
        t = self.t_us * 1e-6
        goal = self.turn_radps if self.turn_at_s <= t < self.turn_at_s + self.turn_s else 0.0
        self.turn_rate += (goal - self.turn_rate) / ROLL_S * DT
        self.psi_tanker += self.turn_rate * DT
        return self.turn_rate + (self.rate_noise * float(self.rng.standard_normal()) if self.rng is not None else 0.0)

    def step(self) -> None:
        """One step of DT."""
        heard = self._turn_tanker() if math.isfinite(self.turn_at_s) else self.turn_rate
        wn, we = self.wind
        c, s = math.cos(self.psi_tanker), math.sin(self.psi_tanker)
        v = (self.V * math.cos(self.psi) + wn, self.V * math.sin(self.psi) + we)
        vt = (self.V_tanker * c + wn, self.V_tanker * s + we)
        (n, e), (n0, e0) = self.pos, self.origin
        d, dv = (n - n0, e - e0), (v[0] - vt[0], v[1] - vt[1])
        self.x, self.y, self.z = c * d[0] + s * d[1], c * d[1] - s * d[0], H_TANKER - self.h
        nav = NavState(valid=True, V=self.V, euler=(self.psi, 0.0, 0.0), wind_n=(wn, we, 0.0))
        nav.pos_n, nav.vel_n = (n, e, -self.h), (*v, 0.0)
        sight = Sight(
            self.seen, (self.x, self.y, self.z), (c * dv[0] + s * dv[1], c * dv[1] - s * dv[0], 0.0),
            (*vt, 0.0), self.psi_tanker, heard,
        )  # fmt: skip
        o = self.g.step(self.t_us, nav, sight, DT)
        self.t_us += round(DT * 1e6)
        self.V += min(max((o.V - self.V) / 3.0, -0.8), 0.8) * DT
        self.psi_dot += (o.psi_dot + self.rate_bias - self.psi_dot) / 1.5 * DT
        self.psi += self.psi_dot * DT
        self.h += (o.alt_m - self.h) / 2.0 * DT
        self.pos, self.origin = (n + v[0] * DT, e + v[1] * DT), (n0 + vt[0] * DT, e0 + vt[1] * DT)
        self.track.append((self.x, self.y, self.z, sight.vel[0]))

    def fly(self, seconds: float, *, stop_when_ready: bool = False) -> np.ndarray:
        """Track [N,4] after `seconds`: x, y, z [m] in H, closing along x [m/s]."""
        for _ in range(round(seconds / DT)):
            self.step()
            if stop_when_ready and self.g.ready:
                break
        return np.array(self.track)
