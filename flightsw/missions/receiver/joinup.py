"""Receiver's way to the tanker: along its own track until the tanker has rolled out ahead, then join up by sight.

En route: constant airspeed and altitude on a ground track, 305 m below the tanker's level. Join-up: relative velocity wanted
as a function of relative position. Closure falls with the gap as under constant deceleration, so that it can be flown
with a small thrust margin and never overshoots; the aim lies behind, below and to the right, the side of the observation
position. The receiver climbs only to the right of the wake and stays back until it is there.

Relative quantities are in the tanker's heading axes H: x forward along its nose, y right, z down, level; origin its cg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from flightsw.kernels.rotations import wrap_pi
from flightsw.missions.receiver.join_guard import Guard, follow, in_turning_axes
from flightsw.plugins import EVERY_KEY, OursOr
from flightsw.strict import ConfigError, Range
from flightsw.terms import HELD, INTEGRAL, RATE, Controlled, LawTerms, Output
from flightsw.types import ZERO3, GuidanceCmd, NavState, Text, Vec3

INIT, ENROUTE, JOIN_UP = 0, 20, 21  # WKF_PHASE
NAMES = {INIT: "init", ENROUTE: "en route", JOIN_UP: "join-up"}

TURN_TAU_S = 2.0  # [s] smoothing of the tanker's turn rate
LOST_MPS = 3.0  # [m/s] slower than a tanker that is out of sight

Pos = Annotated[float, Range(1e-9)]


@dataclass(frozen=True)
class JoinUpParams:
    """Track [m, deg], speeds [m/s], positions in H [m] and limits."""

    track_deg: float = 0.0  # course over ground en route, clockwise from north
    track_point_m: tuple[float, float] = (0.0, 0.0)  # north, east of a point on it: the control point
    V_mps: Pos = 200.0  # airspeed en route
    alt_m: Pos = 6705.0
    separation_m: Pos = 305.0  # below the tanker until it may climb
    # when join-up begins
    seen_s: Pos = 2.0  # the tanker has been in sight and has flown straight for so long
    level_rate_degps: Pos = 0.3  # turn rate below which it flies straight
    heading_max_deg: Pos = 20.0  # difference of headings
    lost_s: Pos = 3.0  # out of sight for so long: back to the track and down
    # closure
    aim_m: Vec3 = (-80.0, 65.0, 5.0)
    v_max_mps: Pos = 15.0
    v_slow_mps: Pos = 1.5  # closure that turns from square root to proportional; with a_close the gain near the aim
    a_close_mps2: Pos = 0.1
    v_back_mps: Pos = 8.0  # falling back from ahead of the aim
    # where it may climb and close: right of the wake and nearly at the tanker's level
    stay_back_m: float = -350.0  # x held until it may close
    corridor_y_m: Pos = 40.0  # least y
    corridor_z_m: Pos = 120.0  # most z
    wake_z_m: Pos = 140.0  # least z left of the corridor
    climb_slope: Pos = 0.18  # z per gap
    climb_gap_m: Pos = 100.0  # gap at which the aim's height is reached
    # lateral and vertical
    k_y_ps: Pos = 0.03  # wanted lateral speed per offset
    k_int_ps2: Annotated[float, Range(0.0)] = 5e-4  # the same per integral of the offset: gyro biases turn the aircraft
    int_max_mps: Pos = 2.5
    int_band_m: Pos = 100.0  # offsets that are integrated
    vy_max_mps: Pos = 8.0
    vy_track_mps: Pos = 25.0  # en route
    k_psi_ps: Pos = 0.3  # turn rate per heading error
    turn_max_degps: Pos = 1.5
    turn_accel_degps2: Pos = 0.3
    climb_max_mps: Pos = 4.0
    k_alt_ps: Pos = 0.2
    V_min_mps: Pos = 170.0
    V_max_mps: Pos = 225.0
    V_accel_mps2: Pos = 0.4
    wind_tau_s: Pos = 5.0  # smoothing of the own wind estimate for the speed command
    # a tanker that turns, and the distance kept whatever it does
    turning_degps: Pos = 0.6  # smoothed turn rate beyond which the tanker counts as turning
    follow_m: Pos = 600.0  # beyond this distance it is followed at the vertical separation, nearer the place is held
    follow_turn_degps: Pos = 1.8  # own turn rate then
    keep_out_m: Pos = 75.0  # path of the next seconds nearer than this: give way
    clear_m: Pos = 250.0  # until it opens beyond this
    # hand-over to station keeping: inside this distance of the tanker, near the line to the aim, not closing faster
    handover_m: Pos = 125.0
    handover_error_m: Pos = 20.0
    handover_closure_mps: Pos = 4.0
    path: Annotated[str, OursOr(("join_up",))] = "join_up"  # a JoinPath, made from (this table)

    def __post_init__(self) -> None:
        """Raises ConfigError for positions that contradict each other."""
        x, y, z = self.aim_m
        if not self.stay_back_m < x < 0.0:
            raise ConfigError(f"join.aim_m[0] = {x:g}: allowed: behind the tanker, between {self.stay_back_m:g} and 0")
        if y <= self.corridor_y_m or not 0.0 <= z < self.corridor_z_m < self.wake_z_m < self.separation_m:
            raise ConfigError(
                f"join.aim_m = {list(self.aim_m)}: allowed: y > corridor_y_m, 0 <= z < corridor_z_m < wake_z_m < separation_m"
            )


@dataclass(slots=True)
class Sight:
    """The tanker as seen from the receiver, in H."""

    seen: bool = False  # fresh relative sensor and data link
    pos: Vec3 = ZERO3  # [m] own minus tanker
    vel: Vec3 = ZERO3  # [m/s] own minus tanker
    vel_n: Vec3 = ZERO3  # [m/s] of the tanker, NED
    psi: float = 0.0  # [rad] heading of the tanker
    turn_rate: float = 0.0  # [rad/s] of the tanker


def closure(gap: float, p: JoinUpParams) -> float:
    """Wanted closure [m/s] at `gap` [m] behind the aim; negative ahead of it.

    sqrt(v0^2 + 2 a g) - v0: constant deceleration a far out, proportional with a / v0 near the aim, no corner between.
    """
    v0, a = p.v_slow_mps, p.a_close_mps2
    if gap < 0.0:
        return max(a / v0 * gap, -p.v_back_mps)
    return min(math.sqrt(v0 * v0 + 2.0 * a * gap) - v0, p.v_max_mps)


def may_close(pos: Vec3, p: JoinUpParams) -> bool:
    """Whether the receiver is right of the wake and nearly at the tanker's level."""
    return pos[1] >= p.corridor_y_m and pos[2] <= p.corridor_z_m


def wanted(pos: Vec3, p: JoinUpParams) -> tuple[float, float, float]:
    """Wanted closure [m/s], lateral speed [m/s] and z [m] at a relative position in H."""
    x, y, _ = pos
    hold = p.aim_m[0] if may_close(pos, p) else p.stay_back_m
    vx = closure(hold - x, p)
    vy = min(max(p.k_y_ps * (p.aim_m[1] - y), -p.vy_max_mps), p.vy_max_mps)
    gap = p.aim_m[0] - x
    z = p.aim_m[2] + p.climb_slope * max(gap - p.climb_gap_m, 0.0)
    if y < p.corridor_y_m:
        z = max(z, p.wake_z_m)
    if gap < -0.5 * abs(p.aim_m[0]):  # nearly abeam or ahead: vertical separation until it has fallen back
        z = p.separation_m
    return vx, vy, min(z, p.separation_m)


class JoinUpGuidance:
    """Commands airspeed, altitude and turn rate; `ready` once station keeping may take over."""

    obeys = EVERY_KEY

    def __init__(self, p: JoinUpParams) -> None:
        self.p = p
        self.phase = INIT
        self.t_phase_us = 0
        self.reason = "waiting for navigation"
        self.texts: list[Text] = []
        self.out = GuidanceCmd(V=p.V_mps, alt_m=p.alt_m)
        self.V, self.alt, self.psi_dot = p.V_mps, p.alt_m, 0.0
        self.ready = False
        outputs = (
            ("closure", "m/s"),
            ("lateral_speed", "m/s"),
            ("airspeed", "m/s"),
            ("altitude", "m"),
            ("turn_rate", "rad/s"),
        )
        errors = (Controlled("ahead", "m"), Controlled("right", "m"), Controlled("below", "m"))
        self.terms = LawTerms("join_up", tuple(Output(*q) for q in outputs), errors)
        self._straight_s = self._lost_s = 0.0
        self._turn = 0.0
        self._vy_int = 0.0
        self._wind = [0.0, 0.0]
        self._V_track = p.V_mps  # airspeed en route; slower than the tanker once it has been lost from sight
        self._V_tanker = p.V_mps
        self.turning = False
        self.guard = Guard(p.keep_out_m, p.clear_m)

    def step(self, t_us: int, nav: NavState, s: Sight, dt: float) -> GuidanceCmd:
        """Advance by dt [s]."""
        p = self.p
        self.terms.open()
        if nav.valid:
            if self.phase == INIT:
                self.V, self.alt = nav.V, -nav.pos_n[2]
                self._wind = [nav.wind_n[0], nav.wind_n[1]]
                self._enter(ENROUTE, t_us, "navigation valid")
            self._rules(t_us, nav, s, dt)
            a = dt / (p.wind_tau_s + dt)
            for i in (0, 1):
                self._wind[i] += a * (nav.wind_n[i] - self._wind[i])
            if self.phase == ENROUTE:
                self._along_track(nav, dt)
            elif s.seen:
                self._towards_tanker(nav, s, dt)
            else:  # a short gap: fly straight on
                self._command(self.V, self.alt, 0.0, 0.0, dt)
        o = self.out
        o.phase, o.phase_t_s, o.reason = self.phase, (t_us - self.t_phase_us) * 1e-6, self.reason
        o.V, o.alt_m, o.psi_dot = self.V, self.alt, self.psi_dot
        return o

    def _rules(self, t_us: int, nav: NavState, s: Sight, dt: float) -> None:
        """Join-up starts and ends, and is ready, by rule."""
        p = self.p
        self._turn += dt / (TURN_TAU_S + dt) * (s.turn_rate - self._turn) if s.seen else -self._turn
        self._tell_turn(s.seen and abs(self._turn) > math.radians(p.turning_degps))
        straight = s.seen and abs(self._turn) < math.radians(p.level_rate_degps)
        self._straight_s = self._straight_s + dt if straight else 0.0
        self._lost_s = 0.0 if s.seen else self._lost_s + dt
        if self.phase == ENROUTE:
            same_way = abs(wrap_pi(s.psi - nav.euler[0])) < math.radians(p.heading_max_deg)
            if self._straight_s >= p.seen_s and same_way:
                self._enter(JOIN_UP, t_us, f"tanker in sight, {-s.pos[0]:.0f} m ahead")
        elif self.phase == JOIN_UP and self._lost_s > p.lost_s:
            self._V_track = min(p.V_mps, max(self._V_tanker - LOST_MPS, p.V_min_mps))
            self._enter(ENROUTE, t_us, "tanker out of sight")
        self.ready = self.phase == JOIN_UP and not self.guard.active and self._near(s)

    def _tell_turn(self, turning: bool) -> None:
        if turning != self.turning and self.phase == JOIN_UP:
            self.texts.append(
                Text(5, "tanker turns: closing stopped" if turning else "tanker straight: closing goes on")
            )
        self.turning = turning

    def _by_rule(self, pos: Vec3, vx: float, vy: float, z: float) -> tuple[float, float, float]:
        """Wanted relative speeds and height beside a tanker that turns: far it is followed, near the place is held."""
        p, far = self.p, math.hypot(*pos)
        if far > p.follow_m:
            vx, vy = follow(pos, -p.stay_back_m, closure(max(far + p.stay_back_m, 0.0), p))
            return vx, vy, p.separation_m
        hold = min(pos[0], p.aim_m[0]) if may_close(pos, p) else p.stay_back_m
        return *in_turning_axes((min(vx, closure(hold - pos[0], p)), vy), pos, self._turn), z

    def _give_way(self, pos: Vec3) -> tuple[float, float, float]:
        p = self.p
        return -p.v_back_mps, math.copysign(p.vy_max_mps, pos[1]), p.separation_m

    def _near(self, s: Sight) -> bool:
        p = self.p
        _, _, z = wanted(s.pos, p)
        beside = max(abs(s.pos[1] - p.aim_m[1]), abs(s.pos[2] - z))
        slow = max(map(abs, s.vel)) < p.handover_closure_mps
        steady = self._straight_s >= p.seen_s
        return steady and math.hypot(*s.pos) < p.handover_m and beside < p.handover_error_m and slow

    def _along_track(self, nav: NavState, dt: float) -> None:
        p = self.p
        c, s = math.cos(math.radians(p.track_deg)), math.sin(math.radians(p.track_deg))
        n, e = nav.pos_n[0] - p.track_point_m[0], nav.pos_n[1] - p.track_point_m[1]
        vy = min(max(-p.k_y_ps * (c * e - s * n), -p.vy_track_mps), p.vy_track_mps)
        rate = p.k_psi_ps * (vy - (c * nav.vel_n[1] - s * nav.vel_n[0])) / nav.V
        self.terms.outputs[1].give(-p.k_y_ps * (c * e - s * n), 0.0, 0.0, vy)
        self.out.rel_pos_t = self.out.rel_vel_t = ZERO3
        self._command(self._V_track, p.alt_m, rate, 0.0, dt)

    def _towards_tanker(self, nav: NavState, s: Sight, dt: float) -> None:
        p = self.p
        vx, vy, z = wanted(s.pos, p)
        off = p.aim_m[1] - s.pos[1]
        if abs(off) < p.int_band_m:
            self._vy_int = min(max(self._vy_int + p.k_int_ps2 * off * dt, -p.int_max_mps), p.int_max_mps)
            vy += self._vy_int
        if self.turning:
            vx, vy, z = self._by_rule(s.pos, vx, vy, z)
        before = self.guard.active
        if self.guard.step(s.pos, s.vel, nav.V * (self.psi_dot - self._turn)):
            vx, vy, z = self._give_way(s.pos)
        if self.guard.active != before:
            self.texts.append(
                Text(4, "too near the tanker: giving way") if not before else Text(5, "clear of the tanker")
            )
        self._tell(s.pos, vx, vy, z, abs(off) < p.int_band_m)
        c, sn = math.cos(s.psi), math.sin(s.psi)
        self._V_tanker = math.hypot(s.vel_n[0] - self._wind[0], s.vel_n[1] - self._wind[1])
        # airspeed that gives the wanted ground velocity in the own wind
        north = s.vel_n[0] + c * vx - sn * vy - self._wind[0]
        east = s.vel_n[1] + sn * vx + c * vy - self._wind[1]
        rate = self._turn + p.k_psi_ps * (vy - s.vel[1]) / nav.V
        self.out.rel_pos_t, self.out.rel_vel_t = p.aim_m, (vx, vy, 0.0)
        self._command(math.hypot(north, east), -nav.pos_n[2] + s.pos[2] - z, rate, self._turn, dt)

    def _tell(self, pos: Vec3, vx: float, vy: float, z: float, integrated: bool) -> None:
        """Into the record: place in H and the relative speeds wanted there."""
        p, t = self.p, self.terms
        t.outputs[0].give(vx, 0.0, 0.0, vx)
        t.outputs[1].give(p.k_y_ps * (p.aim_m[1] - pos[1]), self._vy_int if integrated else 0.0, 0.0, vy)
        for q, error in zip(t.controlled, (pos[0] - p.aim_m[0], pos[1] - p.aim_m[1], pos[2] - z), strict=True):
            q.error = error
        bound = INTEGRAL if abs(self._vy_int) >= p.int_max_mps else 0
        t.controlled[1].limits = bound if integrated else HELD

    def _command(self, V: float, alt: float, rate: float, forward: float, dt: float) -> None:
        """Move the references towards V [m/s], alt [m], rate [rad/s] (`forward` of it the tanker's own) within limits."""
        p, asked = self.p, (V, alt, rate)
        most = p.follow_turn_degps if self.turning else p.turn_max_degps
        V = min(max(V, p.V_min_mps), p.V_max_mps)
        dv = p.V_accel_mps2 * dt
        self.V += min(max(V - self.V, -dv), dv)
        self.alt += min(max(p.k_alt_ps * (alt - self.alt), -p.climb_max_mps), p.climb_max_mps) * dt
        top, da = math.radians(most), math.radians(p.turn_accel_degps2) * dt
        rate = min(max(rate, -top), top)
        self.psi_dot += min(max(rate - self.psi_dot, -da), da)
        _, _, airspeed, altitude, turn = self.terms.outputs
        airspeed.give(0.0, 0.0, asked[0], self.V, RATE if asked[0] == V else 0)
        altitude.give(0.0, 0.0, alt, self.alt, RATE)
        turn.give(asked[2] - forward, 0.0, forward, self.psi_dot, RATE if asked[2] == rate else 0)
        self.terms.closed = True

    def _enter(self, phase: int, t_us: int, why: str) -> None:
        self.phase, self.t_phase_us, self.reason = phase, t_us, why
        self.texts.append(Text(6, f"{NAMES[phase]}: {why}"[:50]))
