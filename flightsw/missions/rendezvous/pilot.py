"""Bank-angle autopilot of the rendezvous: from the guidance's bank and speed to turn rate and airspeed of the control law.

The control law follows a commanded turn rate some time later. The guidance is therefore given the tanker and the receiver as
they will be when a command of now takes effect: own motion under the bank already commanded, `response_s` ahead. Its plan
then sees an aircraft that rolls at the rate limit, and nothing else.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from flightsw.missions.rendezvous import turn_law as kg
from flightsw.missions.rendezvous.guidance import (
    LAWS,
    PHASES,
    OwnState,
    RendezvousCommand,
    RendezvousGuidance,
    RendezvousGuidanceParams,
)
from flightsw.missions.rendezvous.reports import RendezvousState
from flightsw.strict import Range
from flightsw.terms import RATE, Controlled, LawTerms, Output


@dataclass(frozen=True)
class PilotParams:
    """Limits of what is commanded and the measured response of the aircraft to it."""

    guidance: RendezvousGuidanceParams = field(default_factory=RendezvousGuidanceParams)
    roll_rate_degps: Annotated[float, Range(0.5, 20.0)] = 5.0  # of the commanded bank
    speed_rate_mps2: Annotated[float, Range(0.01, 2.0)] = 0.257  # of the commanded airspeed (0.5 kn/s)
    response_s: Annotated[float, Range(0.0, 5.0)] = 1.8  # from commanded to actual bank


class RendezvousPilot:
    """`bank` [rad, left positive] and `V` [m/s] are the rate-limited commands, `psi_dot` [rad/s, clockwise] what they mean."""

    def __init__(self, p: PilotParams) -> None:
        self.p = p
        self.guid = RendezvousGuidance(p.guidance)
        self.bank, self.psi_dot = 0.0, 0.0
        self.V = p.guidance.speed_mps
        outputs = (Output("bank", "rad"), Output("airspeed", "m/s"), Output("turn_rate", "rad/s"))
        self.terms = LawTerms("pilot", outputs, (Controlled("miss_along", "m"), Controlled("miss_across", "m")))
        self._given: deque[tuple[float, float]] = deque()  # bank commanded, for how long: not yet effective

    @property
    def phase(self) -> str:
        """approach, turn, rollout, leg, done."""
        return self.guid.out.phase

    def step(
        self,
        own: OwnState,
        mean: tuple[float, float, float, float] | None,
        range_m: float,
        dt: float,
        covariance: np.ndarray | None = None,
        follow: bool = False,
        sided: bool = False,
    ) -> RendezvousCommand:
        """Advance by dt [s]; `mean`: estimate of the receiver, None before the first range (wings level); `covariance`,
        `follow`, `sided` as of RendezvousGuidance.step."""
        p, c = self.p, self.guid.out
        if mean is not None:
            ahead = self._ahead(own)
            T = sum(h for _, h in self._given)
            x, vx, y, vy = mean
            there = (x + vx * T, vx, y + vy * T, vy)
            c = self.guid.step(ahead, there, range_m, dt, covariance, follow, sided)
        goal, speed = (c.bank, c.speed) if mean is not None else (0.0, p.guidance.speed_mps)
        d = math.radians(p.roll_rate_degps) * dt
        self.bank += min(max(goal - self.bank, -d), d)
        d = p.speed_rate_mps2 * dt
        self.V += min(max(speed - self.V, -d), d)
        self.psi_dot = -p.guidance.gravity_mps2 * math.tan(self.bank) / max(own.speed, 50.0)
        self._tell(goal, speed, c)
        self._given.append((self.bank, dt))
        while len(self._given) > 1 and sum(h for _, h in self._given) > p.response_s + 0.5 * dt:
            self._given.popleft()
        if p.response_s <= 0.0:
            self._given.clear()
        return c

    def _tell(self, goal: float, speed: float, c: RendezvousCommand) -> None:
        """Into the record: the guidance's bank and airspeed, what the limits of their rates keep back, the predicted misses."""
        t = self.terms
        for o, asked, sent in zip(
            t.outputs, (goal, speed, self.psi_dot), (self.bank, self.V, self.psi_dot), strict=True
        ):
            o.give(0.0, 0.0, asked, sent, RATE)
        for q, error in zip(t.controlled, (c.miss_x_m, c.miss_y_m), strict=True):
            q.error = error
        t.closed = True

    def _ahead(self, own: OwnState) -> OwnState:
        """Own state when a command of now takes effect."""
        x, y, psi, v = own.x, own.y, own.psi, max(own.speed, 50.0)
        g = self.p.guidance.gravity_mps2
        for bank, h in self._given:
            turn = g * math.tan(bank) / v * h
            x += (v * math.cos(psi + 0.5 * turn) + own.wind_x) * h
            y += (v * math.sin(psi + 0.5 * turn) + own.wind_y) * h
            psi += turn
        return replace(own, x=x, y=y, psi=psi, bank=self.bank)

    def follow(self, V: float, psi_dot: float, own: OwnState) -> None:
        """Somebody else commands: keep `V`, `psi_dot` and the bank they mean in step with it."""
        self.V, self.psi_dot = V, psi_dot
        self.bank = -math.atan(psi_dot * own.speed / self.p.guidance.gravity_mps2)
        self.terms.open()

    def report(self, o: RendezvousState) -> None:
        """Write command and plan into the telemetry record."""
        c, gs = self.guid.out, self.guid.gs
        o.bank_cmd, o.speed_cmd = self.bank, self.V
        o.time_to_go_s, o.turn_time_s = c.time_to_go_s, c.turn_time_s
        o.miss, o.limited, o.final_psi = (c.miss_x_m, c.miss_y_m), c.limited, c.final_psi
        o.radii = (float(gs[kg.G_R1]), float(gs[kg.G_R2])) if c.phase == "turn" else (0.0, 0.0)
        o.law, o.phase = LAWS.index(self.p.guidance.law), PHASES.index(c.phase)
