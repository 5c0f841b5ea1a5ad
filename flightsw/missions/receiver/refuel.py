"""Receiver phase machine for aerial refuelling: observation, pre-contact, contact, disconnect, return, breakaway, hold.

Commanded from the ground; leaves contact by its own rule when the relative solution, the data link or the station error is
not good enough, or the boom has let go (latch.py). An order whose way cannot be flown is refused and nothing changes. All
positions are xi, the receiver's centre of gravity in tanker body axes [m]. Approach is down, across well below the trailing
vortices, then forward and up between them: never through a tip vortex.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.latch import UNSTEADY, Latch
from flightsw.missions.receiver.path import Quintic, duration
from flightsw.plugins import EVERY_KEY, OursOr
from flightsw.strict import IN_FLIGHT, ConfigError, Range
from flightsw.types import ZERO3, GuidanceCmd, NavState, SensorFrame, Text, Vec3

INIT, OBSERVATION, TO_PRECONTACT, PRECONTACT, TO_CONTACT, CONTACT, DISCONNECT, RETURN, BREAKAWAY, HOLD = range(10)
NAMES = (
    "init", "observation", "to pre-contact", "pre-contact", "closing", "contact", "disconnect", "return", "breakaway", "hold",
)  # fmt: skip

ACTIONS = {1: "hold", 2: "precontact", 3: "contact", 4: "disconnect", 5: "breakaway", 6: "observation"}

UNDER_WAY = frozenset(range(OBSERVATION, HOLD + 1))
FROM = {  # action -> phases in which it is accepted
    "hold": UNDER_WAY, "precontact": frozenset((OBSERVATION, HOLD, RETURN)), "contact": frozenset((PRECONTACT,)),
    "disconnect": frozenset((CONTACT, TO_CONTACT)), "breakaway": UNDER_WAY,
    "observation": frozenset((PRECONTACT, TO_PRECONTACT, BREAKAWAY, HOLD)),
}  # fmt: skip
TAKES = {  # what it takes besides
    **dict.fromkeys(
        ("precontact", "contact", "observation"), "navigation that is current, the aircraft at its station, a free way"
    ),
    "contact": "the same, and a boom that reaches",
}

CRITICAL, WARNING, INFO = 2, 4, 6  # MAV_SEVERITY
JOINED_US, NEAR_M = 1_000_000, 300.0  # begun later than this the flight was under way; [m] from the tanker
WAYPOINTS = ("observation_m", "low_m", "behind_m", "precontact_m", "contact_m", "breakaway_m")

Leg = tuple[Vec3, float]  # way-point [m], largest speed [m/s]
Speed = Annotated[float, Range(1e-6, 20.0), IN_FLIGHT]
Time = Annotated[float, Range(1e-6, 3600.0), IN_FLIGHT]
Error = Annotated[float, Range(1e-6, 1000.0), IN_FLIGHT]


@dataclass(frozen=True)
class RefuelParams:
    """Way-points [m], speeds [m/s] and limits of the refuelling procedure."""

    observation_m: Vec3 = (-59.13, 56.33, 0.0)
    low_m: Vec3 = (-60.0, 56.33, 26.0)
    behind_m: Vec3 = (-60.0, 0.0, 26.0)
    precontact_m: Vec3 = (-47.0, 0.0, 12.5)
    contact_m: Vec3 = (-35.5, 0.0, 8.5)
    breakaway_m: Vec3 = (-100.0, 0.0, 60.0)
    v_transfer_mps: Speed = 1.5
    v_join_mps: Speed = 1.5  # first leg, from where navigation became valid to observation
    v_climb_mps: Speed = 0.8
    v_close_mps: Speed = 0.5
    v_breakaway_mps: Speed = 4.0
    settle_s: Time = 10.0  # in contact before samples count for station keeping
    ready_error_m: Error = 1.0  # station error that lets the next segment or closure start
    track_error_m: Error = 4.0  # the reference waits while the error exceeds this
    contact_error_max_m: Error = 3.0  # breakaway beyond this while closing or in contact
    rel_age_max_s: Time = 2.0
    peer_age_max_s: Time = 1.0
    boom_open_s: Time = 0.5  # the boom says so long that it has let go: contact is lost
    boom_make_s: Time = 30.0  # in the contact position without contact
    # by the own estimate the receptacle is so far inside the boom's envelope for so long before the latch is closed
    boom_margin_m: Annotated[float, Range(0.0, 10.0), IN_FLIGHT] = 0.3
    boom_steady_s: Time = 2.0
    path: Annotated[str, OursOr(("refuelling",))] = "refuelling"  # a RefuelPath, made from (this table, surroundings)


class RefuelGuidance:
    """Reference of the station-keeping law and the phase it belongs to."""

    obeys = EVERY_KEY

    def __init__(self, p: RefuelParams, around: Surroundings | None = None) -> None:
        """`around`: where the tanker is and its boom reaches (None: not known, nothing is checked against it).

        Raises ConfigError for a way-point inside the tanker and a contact point out of the boom's reach.
        """
        self.p, self.around = p, around
        for key in WAYPOINTS if around is not None else ():
            point: Vec3 = getattr(p, key)
            why = around.blocked([point]) if around is not None else ""
            if not why and key == "contact_m" and around is not None and around.boom is not None:
                why = around.out_of_reach(point, p.boom_margin_m)
            if why:
                raise ConfigError(f"guid.{key} = {list(point)}: {why}")
        self.phase = INIT
        self.t_phase_us = 0
        self.t_us = 0
        self.queue: list[Leg] = []
        self.seg: Quintic | None = None
        self.seg_t = 0.0
        self.pos: Vec3 = p.observation_m
        self.vel: Vec3 = ZERO3
        self.reason = "waiting for navigation"
        self.texts: list[Text] = []
        self.out = GuidanceCmd()
        self.blind = self.reason  # why there is nothing to fly on, "" if there is
        self.doubt = ""  # why the position does not serve the phase
        self.error_m = math.inf  # from the reference
        self._bad_s = 0.0
        self.latch = Latch(around)
        self._began_us = -1

    def handed_over(self) -> None:
        """Another half of the mission has led here: its first step is no start of the computer in flight."""
        self._began_us = 0

    # --- commands -------------------------------------------------------------------------------------------------
    def command(self, action: int) -> tuple[bool, str]:
        """Ground action 1..6 (hold, precontact, contact, disconnect, breakaway, observation): accepted?, reason if not."""
        name = ACTIONS.get(action)
        ph, p = self.phase, self.p
        if name is None:
            return False, f"action {action} unknown, allowed 1 to 6"
        if ph == INIT:
            return False, "navigation not valid yet"
        if name == "hold":
            self._stop()
        elif name == "breakaway":
            self._breakaway("commanded")
        elif name == "precontact":
            if ph not in FROM[name]:
                return False, f"pre-contact is not allowed from {NAMES[ph]}"
            return self._order(TO_PRECONTACT, self._to_precontact(), p.track_error_m)
        elif name == "contact":
            if ph not in FROM[name]:
                return False, f"contact is only allowed from pre-contact, not from {NAMES[ph]}"
            if self.around is not None and (why := self.around.out_of_reach(p.contact_m, p.boom_margin_m)):
                return False, f"contact: {why}"
            return self._order(TO_CONTACT, [(p.contact_m, p.v_close_mps)], p.contact_error_max_m)
        elif name == "disconnect":
            if ph not in FROM[name]:
                return False, f"nothing to disconnect in {NAMES[ph]}"
            self._back_off("commanded")
        else:
            if ph not in FROM[name]:
                return False, f"return to observation is not allowed from {NAMES[ph]}"
            legs = [(p.behind_m, p.v_climb_mps), (p.low_m, p.v_transfer_mps), (p.observation_m, p.v_transfer_mps)]
            return self._order(RETURN, legs, p.track_error_m)
        return True, ""

    def _order(self, phase: int, legs: list[Leg], error_max_m: float) -> tuple[bool, str]:
        """Begin a phase that leads somewhere, if its way can be flown: accepted?, reason if not."""
        what = NAMES[phase]
        if self.blind or self.doubt:
            return False, f"{what}: {self.blind or self.doubt}"
        if not self.error_m <= error_max_m:
            return False, f"{what}: station error {self.error_m:.1f} m, allowed {error_max_m:g}"
        if self.around is not None and (why := self.around.blocked([self.pos, *(p for p, _ in legs)])):
            return False, f"{what}: the way from here is {why}"
        self._enter(phase, "commanded")
        self._fly(legs)
        return True, ""

    # --- one step -------------------------------------------------------------------------------------------------
    def step(self, f: SensorFrame, nav: NavState, dt: float) -> GuidanceCmd:
        """Advance by dt [s] and return the reference."""
        self.t_us = f.t_us
        if self._began_us < 0:
            self._began_us = f.t_us
        err = self.error_m = math.dist(nav.rel_pos_t, self.pos)
        self.blind = self._nothing_to_fly_on(nav)
        self.doubt = nav.rel_doubt
        if self.phase == INIT:
            self._wait_for_navigation(nav)
        else:
            self._watch(err, dt)
            self._feel(f, nav, dt)
            self._advance(nav, err, dt)
        o = self.out
        o.phase = self.phase
        o.phase_t_s = (f.t_us - self.t_phase_us) * 1e-6
        o.reason = self.reason
        o.rel_pos_t, o.rel_vel_t = self.pos, self.vel
        o.latch = self.phase in (TO_CONTACT, CONTACT) and self.latch.asked
        o.measure = self.phase == CONTACT and f.boom_contact and o.phase_t_s >= self.p.settle_s
        return o

    def _wait_for_navigation(self, nav: NavState) -> None:
        self.reason = nav.reason
        if not (nav.valid and nav.rel_valid):
            return
        # start from where the aircraft is: no step in the reference
        self.pos, self.vel = nav.rel_pos_t, nav.rel_vel_t
        if self._began_us > JOINED_US and math.hypot(*nav.rel_pos_t) < NEAR_M:
            # the computer was started again in flight: what it was about to do here nobody knows, and the way to observation may
            # lead through the tanker's wake or height
            self.recapture(nav, "begun in flight close to the tanker")
            return
        self._enter(OBSERVATION, "navigation valid")
        self._fly([(self.p.observation_m, self.p.v_join_mps)], t_min=8.0)

    def _nothing_to_fly_on(self, nav: NavState) -> str:
        if not nav.valid:
            return f"navigation invalid: {nav.reason}"
        if nav.peer_age_s > self.p.peer_age_max_s and not nav.rel_held:
            return f"tanker data link silent for {nav.peer_age_s:.1f} s"
        if nav.rel_age_s > self.p.rel_age_max_s and not nav.rel_held:
            return f"relative sensor silent for {nav.rel_age_s:.1f} s"
        return ""

    def _watch(self, err: float, dt: float) -> None:
        """Leave the boom by rule: relative solution, data link or station error not good enough."""
        near = self.phase not in (OBSERVATION, BREAKAWAY)
        if not near:
            self._bad_s = 0.0
            return
        if self.blind or self.doubt:
            self._breakaway(self.blind or self.doubt)
            return
        tight = self.phase in (TO_CONTACT, CONTACT)
        self._bad_s = self._bad_s + dt if tight and err > self.p.contact_error_max_m else 0.0
        if self._bad_s > 0.5:
            self._breakaway(f"station error {err:.1f} m")

    def _feel(self, f: SensorFrame, nav: NavState, dt: float) -> None:
        """Work the latch, and leave the boom by rule when there is no contact: lost, or not made where it should be."""
        if self.phase not in (TO_CONTACT, CONTACT):
            self.latch.open()
            return
        why = self.latch.step(f, nav, self.at_rest, self.p, dt)
        if why:
            self._back_off(why, severity=WARNING)
        elif self.latch.waits and self.reason != UNSTEADY:
            self.reason = UNSTEADY
            self.texts.append(Text(INFO, f"{NAMES[self.phase]}: {UNSTEADY}"))

    def _advance(self, nav: NavState, err: float, dt: float) -> None:
        if self.seg is not None:
            moving = err < self.p.track_error_m or self.phase == BREAKAWAY
            if moving:
                self.seg_t += dt
            self.pos, self.vel = self.seg.at(self.seg_t)
            if not moving:  # the reference waits for the aircraft
                self.vel = ZERO3
            if self.seg_t < self.seg.T:
                return
            self.seg = None
        if self.queue:
            if err < self.p.ready_error_m or self.phase == BREAKAWAY:
                self._next()
            return
        if err > self.p.ready_error_m:
            return
        done = {TO_PRECONTACT: PRECONTACT, TO_CONTACT: CONTACT, DISCONNECT: PRECONTACT, RETURN: OBSERVATION}
        if self.phase == TO_CONTACT and not self.latch.made:
            return
        if self.phase in done:
            self._enter(done[self.phase], "reached")

    @property
    def at_rest(self) -> bool:
        """Whether the path of the phase has been flown to its end."""
        return self.seg is None and not self.queue

    def places(self) -> tuple[Vec3, ...]:
        """Way-points [m, tanker body axes]: observation, low, behind, pre-contact, contact."""
        p = self.p
        return p.observation_m, p.low_m, p.behind_m, p.precontact_m, p.contact_m

    def use(self, p: RefuelParams) -> None:
        """Fly by these parameters from now on."""
        self.p = p

    def recapture(self, nav: NavState, why: str = "navigation restarted") -> None:
        """After a loss of navigation or in an upset: take the present position as reference and leave the boom from there; what
        of the present velocity leads up or ahead, to the tanker, is stopped and not slowed down along the way."""
        vx, vy, vz = nav.rel_vel_t
        self.pos, self.vel = nav.rel_pos_t, (min(vx, 0.0), vy, max(vz, 0.0))
        self.phase = HOLD
        self._breakaway(why)

    # --- helpers --------------------------------------------------------------------------------------------------
    def _enter(self, phase: int, why: str, severity: int = INFO) -> None:
        self.phase = phase
        self.t_phase_us = self.t_us
        self.reason = why
        self._bad_s = 0.0
        self.texts.append(Text(severity, f"{NAMES[phase]}: {why}"))

    def _fly(self, legs: list[Leg], t_min: float = 4.0) -> None:
        self.queue = list(legs)
        self._next(t_min)

    def _next(self, t_min: float = 4.0) -> None:
        target, v = self.queue.pop(0)
        self.seg = Quintic(self.pos, self.vel, target, duration(self.pos, target, v, t_min))
        self.seg_t = 0.0

    def _to_precontact(self) -> list[Leg]:
        p = self.p
        legs = [(p.precontact_m, p.v_climb_mps)]
        if abs(self.pos[1]) > 5.0 or self.pos[2] < p.precontact_m[2] - 5.0:
            across = (p.behind_m, p.v_transfer_mps)
            if self.pos[2] < p.low_m[2] - 5.0:
                legs = [((p.low_m[0], self.pos[1], p.low_m[2]), p.v_transfer_mps), across, *legs]
            else:
                legs = [across, *legs]
        return legs

    def _stop(self) -> None:
        T = 5.0
        target = tuple(x + 0.4 * v * T for x, v in zip(self.pos, self.vel, strict=True))
        self._enter(HOLD, "commanded")
        self.queue = []
        self.seg = Quintic(self.pos, self.vel, (target[0], target[1], target[2]), T)
        self.seg_t = 0.0

    def _back_off(self, why: str, severity: int = INFO) -> None:
        self._enter(DISCONNECT, why, severity)
        self._fly([(self.p.precontact_m, self.p.v_close_mps)])

    def _breakaway(self, why: str) -> None:
        if self.phase == BREAKAWAY:
            return
        self._enter(BREAKAWAY, why, CRITICAL)
        # straight back and down from here: laterally fixed, so that it never crosses a vortex
        p, y = self.p, self.pos[1]
        self._fly([((p.breakaway_m[0], y if abs(y) > 5.0 else p.breakaway_m[1], p.breakaway_m[2]), p.v_breakaway_mps)])
