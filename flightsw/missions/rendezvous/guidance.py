"""Rendezvous guidance: from the estimate of the receiver to bank and speed commands. Frame R, SI, bank positive left.

chart: the present method, 30 deg from a slant range read off a chart. cross_track: bank that ends on the receiver's track.
closed_loop: the same plus gain k on the along-track miss (Rivard 1982, section V), guarded against negative radii. two_arc:
both misses by two radii. Offset steering before the turn, speed trim in it and roll compensation are parameters of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.missions.rendezvous import meeting as km
from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous import turn_law as kg
from flightsw.missions.rendezvous.frame import E_SIZE, OwnState
from flightsw.strict import OneOf, Range

NM = 1852.0
KN = 1852.0 / 3600.0
LAWS = ("chart", "cross_track", "closed_loop", "two_arc")
PHASES = ("approach", "turn", "rollout", "done", "leg")  # leg: between rollout and done


@dataclass(frozen=True)
class MeetingParams:
    """What surrounds the turn: sides, course followed, announcements, leg. Off: the turn alone, as printed."""

    on: bool = False
    both_sides: bool = True  # the turn is flown from the side the tanker stands on
    box_x_m: Annotated[float, Range(100.0)] = 1.0 * NM  # a rendezvous ends within this of its place
    box_y_m: Annotated[float, Range(100.0)] = 0.5 * NM
    announce: Annotated[float, Range(0.1, 2.0)] = 0.85  # share of the box beyond which a miss is announced
    announce_sigma: Annotated[float, Range(0.0, 6.0)] = (
        2.0  # of the estimate, on top, for what is announced before the turn
    )
    announce_ahead_s: Annotated[float, Range(0.0, 120.0)] = 10.0  # before the turn its end is judged
    hold_s: Annotated[float, Range(0.0, 60.0)] = 15.0  # before the turn the heading is held
    speed_margin_mps: Annotated[float, Range(0.0, 100.0)] = 5.0 * KN  # beyond the trim: announced
    speed_sigma: Annotated[float, Range(0.0, 6.0)] = (
        0.0  # of the receiver's speed, in place of that with a bearing or a data link; 0: that
    )
    wind_sigma_mps: Annotated[float, Range(0.0, 50.0)] = (
        0.0  # of the own wind, per axis: the receiver's airspeed is its speed over ground less that; with speed_sigma
    )
    leg_s: Annotated[float, Range(0.0, 900.0)] = 300.0  # longest leg back to the track; 0: none
    leg_sided_s: Annotated[float, Range(0.0, 900.0)] = 0.0  # with a bearing or a data link, while it gains; 0: leg_s
    leg_sided_share: Annotated[float, Range(0.1, 1.0)] = 1.0  # of leg_from and leg_to that counts then
    leg_angle_deg: Annotated[float, Range(1.0, 45.0)] = 26.0
    leg_gain_radpm: Annotated[float, Range(0.0)] = 0.25 / NM
    leg_tau_s: Annotated[float, Range(1.0)] = 60.0  # over which a miss along track is flown off
    leg_from: Annotated[float, Range(0.0, 1.0)] = 0.5  # share of the box from which on a leg is flown
    leg_to: Annotated[float, Range(0.01, 1.0)] = 0.3  # and at which it is over
    straight: bool = False  # a late turn, and a leg that is behind, go straight to the place at full trim
    straight_again: bool = False  # also from the arc onto the track, where an estimate that has changed asks for it
    doubt: bool = False  # announcements of a receiver off its plan allow for its course and the mirror image of ranges


def meeting_vector(p: MeetingParams) -> np.ndarray:
    """Parameter vector mp of missions/rendezvous/meeting.py."""
    m = np.zeros(kv.MP_N)
    m[kv.MP_SIDES], m[kv.MP_BOX_X], m[kv.MP_BOX_Y] = 1.0 if p.both_sides else 0.0, p.box_x_m, p.box_y_m
    m[kv.MP_EDGE], m[kv.MP_AHEAD], m[kv.MP_SPEED] = p.announce, p.announce_ahead_s, p.speed_margin_mps
    m[kv.MP_HOLD], m[kv.MP_SURE] = p.hold_s, p.announce_sigma
    m[kv.MP_LEG_SIDED], m[kv.MP_SPEED_SURE] = p.leg_sided_s, p.speed_sigma
    m[kv.MP_LEG_SHARE], m[kv.MP_AGAIN] = p.leg_sided_share, float(p.straight_again)
    m[kv.MP_WIND] = p.wind_sigma_mps
    m[kv.MP_LEG], m[kv.MP_LEG_ANGLE], m[kv.MP_LEG_GAIN] = p.leg_s, math.radians(p.leg_angle_deg), p.leg_gain_radpm
    m[kv.MP_LEG_TAU], m[kv.MP_LEG_FROM], m[kv.MP_LEG_TO] = p.leg_tau_s, p.leg_from, p.leg_to
    m[kv.MP_STRAIGHT], m[kv.MP_DOUBT] = float(p.straight), float(p.doubt)
    return m


@dataclass(frozen=True)
class RendezvousGuidanceParams:
    """Law and limits of the rendezvous turn."""

    law: Annotated[str, OneOf(LAWS)] = "two_arc"
    gain: Annotated[float, Range(0.0, 20.0)] = 3.0  # k of the closed loop
    guard: bool = True  # radius below the least one means full bank; off: as printed
    bank_max_deg: Annotated[float, Range(5.0, 45.0)] = 30.0
    bank_min_deg: Annotated[float, Range(0.01, 10.0)] = 1.0
    speed_mps: Annotated[float, Range(50.0, 350.0)] = 396.0 * KN  # true airspeed of the tanker
    separation_m: Annotated[float, Range(0.0)] = 2.0 * NM  # ahead of the receiver at roll-out
    roll_rate_degps: Annotated[float, Range(0.0, 60.0)] = 5.0  # the turn plan counts on; 0: none
    lead_s: Annotated[float, Range(-30.0, 60.0)] = 0.0  # turn this much before the time to go is zero
    chart_range_m: Annotated[float, Range(0.0)] = 17.0 * NM
    steer: bool = True  # to the offset, before the turn
    offset_m: Annotated[float, Range(0.0)] = 10.0 * NM
    offset_bank_deg: Annotated[float, Range(0.0, 45.0)] = (
        0.0  # offset of a half turn at this bank in the own wind; 0: offset_m
    )
    steer_gain_radpm: Annotated[float, Range(0.0)] = 0.25 / NM
    steer_heading_deg: Annotated[float, Range(0.0, 60.0)] = 30.0
    steer_bank_deg: Annotated[float, Range(1.0, 30.0)] = 25.0
    heading_gain_1ps: Annotated[float, Range(0.01, 1.0)] = 0.2
    trim_mps: Annotated[float, Range(0.0, 30.0)] = 20.0 * KN  # 0: no speed trim
    trim_tau_s: Annotated[float, Range(1.0)] = 20.0
    near_rad: Annotated[float, Range(0.0, 1.0)] = 0.15  # cross-track law in the last of the turn
    smooth_1prad: Annotated[float, Range(0.0)] = 0.01  # dislike of unequal arcs
    weave_deg: Annotated[float, Range(0.0, 45.0)] = 0.0  # heading weave of the approach
    weave_half_period_s: Annotated[float, Range(5.0)] = 30.0
    gravity_mps2: Annotated[float, Range(9.0, 10.0)] = 9.80665
    meeting: MeetingParams = field(default_factory=MeetingParams)


def guidance_vector(p: RendezvousGuidanceParams) -> np.ndarray:
    """Parameter vector gp of missions/rendezvous/turn_law.py."""
    g = np.zeros(kg.GP_N)
    g[kg.GP_LAW], g[kg.GP_K], g[kg.GP_GUARD] = LAWS.index(p.law), p.gain, 1.0 if p.guard else 0.0
    g[kg.GP_BANK_MAX], g[kg.GP_BANK_MIN] = math.radians(p.bank_max_deg), math.radians(p.bank_min_deg)
    g[kg.GP_V], g[kg.GP_SEP], g[kg.GP_G] = p.speed_mps, p.separation_m, p.gravity_mps2
    g[kg.GP_ROLL], g[kg.GP_LEAD], g[kg.GP_CHART] = math.radians(p.roll_rate_degps), p.lead_s, p.chart_range_m
    g[kg.GP_STEER], g[kg.GP_OFFSET], g[kg.GP_STEER_GAIN] = 1.0 if p.steer else 0.0, p.offset_m, p.steer_gain_radpm
    g[kg.GP_STEER_MAX], g[kg.GP_STEER_BANK] = math.radians(p.steer_heading_deg), math.radians(p.steer_bank_deg)
    g[kg.GP_HEADING_GAIN], g[kg.GP_TRIM], g[kg.GP_TRIM_TAU] = p.heading_gain_1ps, p.trim_mps, p.trim_tau_s
    g[kg.GP_NEAR], g[kg.GP_SMOOTH] = p.near_rad, p.smooth_1prad
    g[kg.GP_OFFSET_BANK] = math.radians(p.offset_bank_deg)
    m = p.meeting
    if m.on and m.leg_s > 0.0:
        g[kg.GP_JOIN], g[kg.GP_JOIN_FROM] = math.tan(0.5 * math.radians(m.leg_angle_deg)), m.leg_from * m.box_y_m
    g[kg.GP_WEAVE], g[kg.GP_WEAVE_HALF] = math.radians(p.weave_deg), p.weave_half_period_s
    return g


@dataclass(slots=True)
class RendezvousCommand:
    """Output of the guidance. Frame R."""

    phase: str = "approach"
    bank: float = 0.0  # [rad] left positive
    speed: float = 0.0  # [m/s] true airspeed
    time_to_go_s: float = kg.NEVER  # to the start of the turn
    turn_time_s: float = 0.0  # length of the turn from now
    miss_x_m: float = 0.0  # predicted at roll-out, positive: tanker too far ahead
    miss_y_m: float = 0.0  # receiver's y minus tanker's
    limited: bool = False  # the bank limit keeps the tanker off the receiver's track
    final_psi: float = math.pi  # [rad]
    announced: int = 0  # SAY_* (missions/rendezvous/meeting.py) of this step
    mirrored: bool = False  # the turn is flown to the right
    wait_s: float = kg.NEVER  # until the next phase is due; 1e9: not known to come


class RendezvousGuidance:
    """Steps at any rate; 2 Hz is enough, and the turn starts within one step of the right moment."""

    def __init__(self, p: RendezvousGuidanceParams) -> None:
        self.p = p
        self.gp = guidance_vector(p)
        self.gs = np.zeros(kg.G_N)
        self.mp, self.ms = meeting_vector(p.meeting), np.zeros(kv.M_N)
        self._own, self._other = np.zeros((2, 8)), np.zeros((2, 4))
        self._o, self._r, self._t, self._radii = np.zeros(8), np.zeros(4), np.zeros(kt.T_N), np.zeros(2)
        self._known = np.zeros((E_SIZE, E_SIZE))
        self.out = RendezvousCommand()
        self.reset()

    def reset(self) -> None:
        """Back to the approach."""
        kg.guidance_reset(self.gs, self.gp)
        km.meeting_reset(self.ms)
        self.out = RendezvousCommand(speed=self.p.speed_mps)

    def step(
        self,
        own: OwnState,
        mean: tuple[float, float, float, float],
        range_m: float,
        dt: float,
        covariance: np.ndarray | None = None,
        follow: bool = False,
        sided: bool = False,
    ) -> RendezvousCommand:
        """Advance by dt [s]: own state, estimate (x, v_x, y, v_y over ground), last measured slant range [m] (inf: none yet).

        covariance [4,4] of the estimate (None: known), follow: the receiver has left its plan, its own course counts, sided: not
        by ranges alone (all three: `meeting` only).
        Not to be called before the estimate is valid. A number that is not finite leaves the last command standing.
        """
        sine = min(max(own.wind_y / self.p.speed_mps, -0.99), 0.99) if math.isfinite(own.wind_y) else 0.0
        delta = math.asin(sine)  # drift correction on the refuelling track
        values = (own.x, own.y, own.psi, own.bank, own.speed, own.wind_x, own.wind_y, delta)
        c = self.out
        if not all(map(math.isfinite, (*values, *mean))) or own.speed < 1.0:
            self.gs[kg.G_TIME] += dt
            return c
        self._o[:] = values
        self._r[:] = mean
        g, chi, side = self.gs, 0.0, 1.0
        if self.p.meeting.on:
            (o2, o3), (r2, r3) = self._own, self._other
            P4 = self._known if covariance is None else covariance
            c.announced = int(
                km.meeting_step(
                    self.ms, g, self._o, self._r, P4, follow, sided, range_m, dt, self.gp, self.mp, self._t, self._radii,
                    o2, r2, o3, r3,
                )
            )  # fmt: skip
            side, chi, delta = float(self.ms[kv.M_SIDE]), float(self.ms[kv.M_CHI]), float(o2[kt.O_DELTA])
        else:
            kg.guidance_step(g, self._o, self._r, range_m, dt, self.gp, self._t, self._radii)
        c.phase, c.bank, c.speed = PHASES[int(g[kg.G_PHASE])], float(g[kg.G_BANK]), float(g[kg.G_V])
        c.time_to_go_s, c.turn_time_s = float(g[kg.G_TTG]), float(g[kg.G_TURN_TIME])
        c.miss_x_m, c.miss_y_m, c.limited = float(g[kg.G_XM]), float(g[kg.G_YM]), bool(g[kg.G_LIMITED] > 0.0)
        c.mirrored, c.wait_s = side < 0.0, float(g[kg.G_WAIT])
        c.final_psi = chi + side * (math.pi + delta)
        return c

    def get_state(self) -> np.ndarray:
        """Copy of the state [23]: turn law and meeting."""
        return np.concatenate((self.gs, self.ms))

    def set_state(self, s: np.ndarray) -> None:
        """Restore a copy made by `get_state`."""
        self.gs[:], self.ms[:] = s[: kg.G_N], s[kg.G_N :]
