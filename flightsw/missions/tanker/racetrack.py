"""Tanker racetrack: straight legs and level 180 degree turns at constant rate, with smooth entry and exit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from flightsw.kernels.rotations import wrap_pi
from flightsw.strict import IN_FLIGHT, Range
from flightsw.types import GuidanceCmd, NavState, SensorFrame, Text

INIT, LEG, TURN = 0, 10, 11


@dataclass(frozen=True)
class RacetrackParams:
    """Pattern geometry."""

    V_mps: Annotated[float, Range(1.0)] = 195.0  # within the limits of the aircraft
    alt_m: Annotated[float, Range(0.0, 12000.0)] = 7010.0
    first_leg_s: Annotated[float, Range(1.0, 7200.0), IN_FLIGHT] = 400.0
    leg_s: Annotated[float, Range(1.0, 7200.0), IN_FLIGHT] = 300.0
    turn_rate_degps: Annotated[float, Range(-3.0, 3.0)] = 1.7
    turn_accel_degps2: Annotated[float, Range(0.01)] = 0.15  # ramp of the commanded turn rate: about 2.6 deg/s of roll
    heading_gain: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = 0.04  # [1/s] heading hold on the legs
    V_accel_mps2: Annotated[float, Range(0.01, 5.0), IN_FLIGHT] = 0.15


class RacetrackGuidance:
    """Commands airspeed, altitude and turn rate."""

    def __init__(self, p: RacetrackParams) -> None:
        self.p = p
        self.phase = INIT
        self.t_phase_us = 0
        self.leg = 0
        self.V_target = p.V_mps
        self.V = p.V_mps
        self.psi_ref = (
            0.0  # heading of the current or coming leg: the one flown at engagement, then half a turn each time
        )
        self.psi_dot = 0.0
        self.texts: list[Text] = []
        self.out = GuidanceCmd(V=p.V_mps, alt_m=p.alt_m)
        self.reason = "waiting for navigation"

    def set_speed(self, V: float, lo: float, hi: float) -> tuple[bool, str]:
        """New commanded airspeed [m/s] within [lo, hi]: accepted?, reason if not."""
        if not lo <= V <= hi:
            return False, f"speed {V:g} m/s, allowed {lo:g} to {hi:g}"
        self.V_target = V
        return True, ""

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """Advance by dt [s]."""
        p = self.p
        if self.phase == INIT and nav.valid:
            self._enter(LEG, f.t_us, "navigation valid")
            self.V = nav.V
            self.psi_ref = nav.euler[0]
        t = (f.t_us - self.t_phase_us) * 1e-6
        rate = math.radians(p.turn_rate_degps)
        target = 0.0
        if self.phase == LEG:
            target = self._heading_hold(nav)
            if t >= (p.first_leg_s if self.leg == 0 else p.leg_s):
                self.psi_ref += math.copysign(math.pi, rate)
                self._enter(TURN, f.t_us, "racetrack turn")
        elif self.phase == TURN:
            # roll out early by the heading swept while the rate ramps down
            lead = self.psi_dot * self.psi_dot / (2.0 * math.radians(p.turn_accel_degps2))
            left = math.copysign(1.0, rate) * self._heading_left(nav)
            target = rate if left > lead else 0.0
            if left <= lead and abs(self.psi_dot) < 1e-4:
                self.leg += 1
                self._enter(LEG, f.t_us, "racetrack leg")
        a = math.radians(p.turn_accel_degps2) * dt
        self.psi_dot += min(max(target - self.psi_dot, -a), a)
        dv = p.V_accel_mps2 * dt
        self.V += min(max(self.V_target - self.V, -dv), dv)
        o = self.out
        o.phase, o.phase_t_s, o.reason = self.phase, t, self.reason
        o.V, o.alt_m, o.psi_dot = self.V, p.alt_m, self.psi_dot
        return o

    def _heading_left(self, nav: NavState) -> float:
        """Heading still to turn [rad]; within half a turn either way once under way."""
        d = self.psi_ref - nav.euler[0]
        # psi is unwrapped by the estimator, but a restart may shift it by whole turns
        return d - 2.0 * math.pi * round((d - math.copysign(math.pi / 2, self.p.turn_rate_degps)) / (2.0 * math.pi))

    def _heading_hold(self, nav: NavState) -> float:
        lim = math.radians(0.3)
        return min(max(self.p.heading_gain * wrap_pi(self.psi_ref - nav.euler[0]), -lim), lim)

    def _enter(self, phase: int, t_us: int, why: str) -> None:
        self.phase, self.t_phase_us, self.reason = phase, t_us, why
        self.texts.append(Text(6, f"{'turn' if phase == TURN else 'leg'}: {why}"[:50]))
