"""Tanker racetrack: straight legs and level 180 degree turns at constant rate, with smooth entry and exit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

from flightsw.kernels.rotations import wrap_pi
from flightsw.plugins import EVERY_KEY, OursOr, made, refuse_ignored
from flightsw.strict import IN_FLIGHT, Range
from flightsw.types import ZERO3, GuidanceCmd, NavState, SensorFrame, Text, Vec3

INIT, LEG, TURN = 0, 10, 11


@dataclass(frozen=True)
class RacetrackParams:
    """Pattern geometry."""

    V_mps: Annotated[float, Range(1.0)] = 195.0  # within the limits of the aircraft
    alt_m: Annotated[float, Range(0.0, 12000.0)] = 7010.0
    first_leg_s: Annotated[float, Range(1.0, 1e6), IN_FLIGHT] = 400.0
    leg_s: Annotated[float, Range(1.0, 1e6), IN_FLIGHT] = 300.0
    turn_rate_degps: Annotated[float, Range(-3.0, 3.0)] = 1.7
    turn_accel_degps2: Annotated[float, Range(0.01)] = 0.15  # ramp of the commanded turn rate: about 2.6 deg/s of roll
    heading_gain: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = 0.04  # [1/s] heading hold on the legs
    V_accel_mps2: Annotated[float, Range(0.01, 5.0), IN_FLIGHT] = 0.15
    path: Annotated[str, OursOr(("racetrack",))] = "racetrack"  # a PathGuidance, made from (this table)


@runtime_checkable
class PathGuidance(Protocol):
    """What commands airspeed, altitude and turn rate of an aircraft on its own. A pure step, as all algorithms. `V` [m/s]:
    airspeed commanded now; `texts`: messages, which the mission takes away."""

    V: float
    texts: list[Text]

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """The command dt [s] after the last. Its phase is one of WKF_PHASE, 0 until navigation has been valid."""

    def set_speed(self, V: float, lo: float, hi: float) -> tuple[bool, str]:
        """New airspeed [m/s], allowed within [lo, hi]: accepted?, reason if not."""

    def take_over(self, psi: float, V: float, psi_dot: float) -> None:
        """Go on from a heading [rad], an airspeed [m/s] and a turn rate [rad/s] that another guidance has flown."""

    def use(self, p: RacetrackParams) -> None:
        """Fly by these parameters from now on."""

    def route(self) -> tuple[Vec3, ...]:
        """Places [m, NED] it flies by next; none: it does not fly by any."""


class RacetrackGuidance:
    """Commands airspeed, altitude and turn rate."""

    obeys = EVERY_KEY

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
        self._start_n: Vec3 = ZERO3  # where the present or last leg began
        self._wind_n: Vec3 = ZERO3

    def set_speed(self, V: float, lo: float, hi: float) -> tuple[bool, str]:
        """New commanded airspeed [m/s] within [lo, hi]: accepted?, reason if not."""
        if not lo <= V <= hi:
            return False, f"speed {V:g} m/s, allowed {lo:g} to {hi:g}"
        self.V_target = V
        return True, ""

    def take_over(self, psi: float, V: float, psi_dot: float) -> None:
        """Go on from a heading [rad], an airspeed [m/s] and a turn rate [rad/s] that another guidance has flown."""
        self.psi_ref, self.V, self.psi_dot = psi, V, psi_dot

    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """Advance by dt [s]."""
        p = self.p
        if self.phase == INIT and nav.valid:
            self._enter(LEG, f.t_us, "navigation valid")
            self.V = nav.V
            self.psi_ref = nav.euler[0]
            self._start_n = nav.pos_n
        self._wind_n = nav.wind_n
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
                self._start_n = nav.pos_n
                self._enter(LEG, f.t_us, "racetrack leg")
        a = math.radians(p.turn_accel_degps2) * dt
        self.psi_dot += min(max(target - self.psi_dot, -a), a)
        dv = p.V_accel_mps2 * dt
        self.V += min(max(self.V_target - self.V, -dv), dv)
        o = self.out
        o.phase, o.phase_t_s, o.reason = self.phase, t, self.reason
        o.V, o.alt_m, o.psi_dot = self.V, p.alt_m, self.psi_dot
        return o

    def use(self, p: RacetrackParams) -> None:
        """Fly by these parameters from now on."""
        self.p = p

    def route(self) -> tuple[Vec3, ...]:
        """The pattern around the present or last leg in the present wind [m, NED]: its start and end, the start and the end of
        the leg opposite, and where the turn after that comes out. () before it has begun."""
        if self.phase == INIT:
            return ()
        p, side = self.p, math.copysign(1.0, self.p.turn_rate_degps)
        # at psi_ref, that of the coming leg, while it turns
        psi = self.psi_ref - (side * math.pi if self.phase == TURN else 0.0)
        c, s = math.cos(psi), math.sin(psi)
        rate = math.radians(abs(p.turn_rate_degps))
        turn_s, across = (math.pi / rate, 2.0 * self.V / rate) if rate > 0.0 else (0.0, 0.0)
        n, e = self._start_n[:2]
        out: list[Vec3] = [(n, e, -p.alt_m)]
        # along the leg, across in the turn, back, across again: seconds, then metres through the air
        leg_s = p.first_leg_s if self.leg == 0 else p.leg_s
        for seconds, along, right in (
            (leg_s, self.V * leg_s, 0.0), (turn_s, 0.0, side * across), (p.leg_s, -self.V * p.leg_s, 0.0),
            (turn_s, 0.0, -side * across),
        ):  # fmt: skip
            n += c * along - s * right + self._wind_n[0] * seconds
            e += s * along + c * right + self._wind_n[1] * seconds
            out.append((n, e, -p.alt_m))
        return tuple(out)

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


OURS = {"racetrack": RacetrackGuidance}
BESIDE = ("V_mps", "alt_m", "turn_rate_degps")  # keys the missions read themselves


def make_path(p: RacetrackParams) -> PathGuidance:
    """The guidance p.path names. Raises ConfigError."""
    path = made(OURS, PathGuidance, p.path, "guid.path", p)  # type: ignore[type-abstract]
    refuse_ignored("guid.path", p.path, (*BESIDE, *path.obeys), p)
    return path


def use_path(path: PathGuidance, p: RacetrackParams) -> None:
    """Fly by these parameters from now on. Raises ConfigError for a key the path does not obey."""
    refuse_ignored("guid.path", p.path, (*BESIDE, *path.obeys), p)
    path.use(p)
