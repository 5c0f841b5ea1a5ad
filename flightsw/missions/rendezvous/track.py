"""The tanker's side of the range-only estimator: TACAN replies and the crew's radar reading in, receiver in frame R out.

Own course and speed are those through the air (inertial velocity less the slowly varying wind), because the path of a turn
hangs on them and not on where the nose points. A reply is fused at the own position of its time of validity, and so is a bearing
or a position that comes at a rate of its own.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.frame import E_SIZE, OwnState, RendezvousFrame
from flightsw.missions.rendezvous.params import ESTIMATORS, NM, RendezvousNavParams
from flightsw.missions.rendezvous.range_rules import REFUSED, RESTARTED, STUCK, USED
from flightsw.missions.rendezvous.reports import RendezvousState
from flightsw.strict import Range
from flightsw.types import UPD_BEARING, UPD_POSITION, UPD_RADAR, UPD_TACAN, NavState, SensorFrame, Text

KEEP_S = 6.0  # [s] of own positions; an older reply is refused
WARNING, NOTICE, INFO = 4, 5, 6
VERDICTS = {  # what becomes of a range, where it is worth a word
    REFUSED: Text(NOTICE, "TACAN: range refused"),
    STUCK: Text(WARNING, "TACAN: range stands still, refused"),
    RESTARTED: Text(WARNING, "TACAN: first range was bad, started again"),
}


@dataclass(frozen=True)
class RendezvousFrameParams:
    """Where the rendezvous takes place."""

    north_m: float = 0.0
    east_m: float = 0.0
    heading_deg: float = 0.0  # of +x, towards the initial point

    def frame(self) -> RendezvousFrame:
        """The border to navigation axes."""
        return RendezvousFrame(self.north_m, self.east_m, math.radians(self.heading_deg))


@dataclass(frozen=True)
class TrackParams:
    """Estimator, and what surrounds it."""

    estimator: RendezvousNavParams = field(default_factory=RendezvousNavParams)
    frame: RendezvousFrameParams = field(default_factory=RendezvousFrameParams)
    y_hat_m: float = 0.0  # lateral position where nobody has a radar reading
    sigma_y_m: Annotated[float, Range(1.0)] = 6.149 * NM
    radar_wait_s: Annotated[float, Range(0.0, 600.0)] = 5.0  # for a reading, before the first range counts
    wind_tau_s: Annotated[float, Range(0.1)] = 20.0  # smoothing of the own wind estimate
    use_bearing: bool = True  # of a set that gives one
    use_link: bool = True  # the receiver's own position, where it sends it
    aid_every_s: Annotated[float, Range(0.0, 60.0)] = 1.0  # of those that come by themselves one in so long is fused
    lost_s: Annotated[float, Range(1.0)] = 35.0  # without a range: the crew is told


class Past(NamedTuple):
    """Where the tanker was."""

    t_us: int
    x: float  # [m, R]
    y: float
    heading: float  # [rad] clockwise from north


class ReceiverTrack:
    """Call `step` once per navigation step; `own` and `out` are then of the same instant."""

    def __init__(self, p: TrackParams) -> None:
        self.p = p
        self.frame = p.frame.frame()
        self.est = RangeEstimator(p.estimator)
        self.own = OwnState()
        self.out = RendezvousState(estimator=ESTIMATORS.index(p.estimator.estimator))
        self.texts: list[Text] = []
        self._past: deque[Past] = deque()
        self._wind: tuple[float, float] | None = None
        self._radar: tuple[float, float] | None = None
        self._t_us = self._since_us = -1
        self._aid_us = {UPD_BEARING: -(1 << 62), UPD_POSITION: -(1 << 62)}  # of the last fused that came by itself
        self._lost, self._alarm, self._verdict = False, False, USED
        self.closed = False  # the meeting is over: ranges are no longer fused, nor missed
        self._upper = np.triu_indices(E_SIZE)

    @property
    def ready(self) -> bool:
        """Whether there is an estimate to guide on."""
        return self.est.out.valid

    def step(self, f: SensorFrame, nav: NavState, updated: int) -> RendezvousState:
        """Advance to the frame's time; `updated`: bits of all frames since the last step."""
        if updated & UPD_RADAR:
            self._crew(f)
        dt = (f.t_us - self._t_us) * 1e-6 if self._t_us >= 0 else 0.0
        self.est.predict(dt)
        self._t_us = f.t_us
        if nav.valid:
            if self._since_us < 0:
                self._since_us = f.t_us
            self._own(f.t_us, nav, dt)
            if updated & UPD_TACAN and f.tacan_range_m is not None and not self.closed:
                self._reply(f)
            if self.ready and not self.closed:
                if updated & UPD_BEARING and self.p.use_bearing and self._due(UPD_BEARING, f.bearing_t_us):
                    self._aid(f, f.bearing_t_us, f.bearing, None)
                if updated & UPD_POSITION and self.p.use_link and self._due(UPD_POSITION, f.position_t_us):
                    self._aid(f, f.position_t_us, None, f.position)
        if not self.closed:
            self._watch(f)
        return self._publish(f)

    def exercise(self) -> None:
        """Fuse ranges, bearings and positions in an estimator of its own: the warm-up comes to the first range at most."""
        est, x = RangeEstimator(self.p.estimator), 50.0 * NM
        est.start(x, 0.0, 0.0, self.p.y_hat_m, self.p.sigma_y_m)
        for bearing, link in ((None, None), (0.0, None), (0.0, (x, 0.0)), (None, None)):
            est.predict(1.0)
            est.update(x, 0.0, 0.0, 0.0, bearing, link)

    def _crew(self, f: SensorFrame) -> None:
        if self.ready:
            self.texts.append(Text(NOTICE, "radar reading came after the first range"))
            return
        self._radar = (f.radar_y_m, f.radar_sigma_m)
        self.texts.append(Text(INFO, f"radar: {f.radar_y_m / NM:+.2f} NM off track"))

    def _own(self, t_us: int, nav: NavState, dt: float) -> None:
        o, fr = self.own, self.frame
        (wind_n, wind_e, _), (vel_n, vel_e, _), (north, east, _) = nav.wind_n, nav.vel_n, nav.pos_n
        heading, _, roll = nav.euler
        w = fr.vector_to_r(wind_n, wind_e)
        if self._wind is None:
            self._wind = w
        a = 1.0 - math.exp(-dt / self.p.wind_tau_s)
        wx, wy = (old + a * (new - old) for old, new in zip(self._wind, w, strict=True))
        self._wind = wx, wy
        vx, vy = fr.vector_to_r(vel_n, vel_e)
        o.x, o.y = fr.to_r(north, east)
        course = math.atan2(vy - wy, vx - wx)
        o.psi = course + 2.0 * math.pi * round((o.psi - course) / (2.0 * math.pi))
        o.speed = math.hypot(vx - wx, vy - wy)
        o.bank = fr.bank(roll)
        o.wind_x, o.wind_y = wx, wy
        self._past.append(Past(t_us, o.x, o.y, heading))
        while t_us - next(iter(self._past)).t_us > KEEP_S * 1e6:
            self._past.popleft()

    def _then(self, t_us: int) -> tuple[float, float, float] | None:
        """Own x, y [m] and heading [rad] at an earlier time; None: too long ago."""
        newer = None
        for p in reversed(self._past):
            if p.t_us <= t_us:
                if newer is None:
                    return p.x, p.y, p.heading
                s = (t_us - p.t_us) / (newer.t_us - p.t_us)
                return p.x + s * (newer.x - p.x), p.y + s * (newer.y - p.y), p.heading + s * (newer.heading - p.heading)
            newer = p
        return None

    def _reply(self, f: SensorFrame) -> None:
        """Fuse a range, and the bearing if there is one; the first one starts the estimator."""
        distance = f.tacan_range_m
        then = self._then(f.tacan_t_us)
        if then is None or distance is None:
            return
        x, y, heading = then
        age = max((f.t_us - f.tacan_t_us) * 1e-6, 0.0)
        los = None
        if f.tacan_bearing is not None and self.p.use_bearing:
            los = self.frame.line_of_sight(f.tacan_bearing, heading)
        if not self.ready:
            waited = f.t_us - self._since_us >= self.p.radar_wait_s * 1e6
            if self._radar is None and not waited:
                return
            self.est.set_wind(self.own.wind_x, self.own.wind_y)
            y_hat, sigma = self._radar or (self.p.y_hat_m, self.p.sigma_y_m)
            self.est.start(distance, x, y, y_hat, sigma)
            if not self.ready:
                return
            self.est.predict(age)
            if los is not None or f.tacan_link is not None:
                self.est.update(None, x, y, age, los, self._sent(f))
            self.texts.append(Text(INFO, f"TACAN: receiver at {distance / NM:.1f} NM"))
        else:
            self.est.set_wind(self.own.wind_x, self.own.wind_y)
            used = self.est.update(distance, x, y, age, los, self._sent(f))
            verdict = self.est.out.verdict
            if verdict != self._verdict and verdict in VERDICTS:  # told once while it lasts
                self.texts.append(VERDICTS[verdict])
            self._verdict = verdict
            self._warn()
            if not used:
                return
        o = self.out
        o.range_m, o.fix_us = distance, f.t_us
        w, at, _ = self.est.components()
        o.weights, o.xs, o.ys = (tuple(float(v) for v in a) for a in (w, *at.T))

    def _due(self, kind: int, t_us: int) -> bool:
        """Whether one of this time is to be fused; it is then the last."""
        if t_us - self._aid_us[kind] < self.p.aid_every_s * 1e6:
            return False
        self._aid_us[kind] = t_us
        return True

    def _aid(self, f: SensorFrame, t_us: int, bearing: float | None, position: tuple[float, float] | None) -> None:
        """Fuse a bearing or a position that came by itself, taken at t_us."""
        then = self._then(t_us)
        if then is None:
            return
        x, y, heading = then
        los = None if bearing is None else self.frame.line_of_sight(bearing, heading)
        link = None if position is None else self.frame.to_r(*position)
        self.est.update(None, x, y, max((f.t_us - t_us) * 1e-6, 0.0), los, link)
        self._warn()

    def _warn(self) -> None:
        before, now = self._alarm, self.est.out.alarm
        if now and not before:
            self.texts.append(Text(WARNING, "receiver not as planned: check course and speed"))
        elif before and not now:
            self.texts.append(Text(NOTICE, "receiver: ranges fit the estimate again"))
        self._alarm = now

    def _sent(self, f: SensorFrame) -> tuple[float, float] | None:
        """The receiver's own position [m] in R, where its data link sends one and it is used."""
        if f.tacan_link is None or not self.p.use_link:
            return None
        return self.frame.to_r(*f.tacan_link)

    def _watch(self, f: SensorFrame) -> None:
        lost = self.ready and f.t_us - self.out.fix_us > self.p.lost_s * 1e6
        if lost != self._lost:
            self.texts.append(Text(WARNING, "TACAN: no range") if lost else Text(NOTICE, "TACAN: range back"))
        self._lost = lost

    def _publish(self, f: SensorFrame) -> RendezvousState:
        o, e, fr, own = self.out, self.est.out, self.frame, self.own
        o.t_us, o.valid, o.reason = f.t_us, e.valid, e.reason
        o.mean = e.mean
        if e.valid:
            o.cov = tuple(float(v) for v in self.est.covariance[self._upper])
        o.own, o.bank = (own.x, own.y, own.psi), own.bank
        o.range_age_s = e.age_s if e.valid else 1e9
        o.innovation_m, o.nis, o.window_nis, o.window_drift = e.innovation_m, e.nis, e.window_nis, e.window_drift
        o.alarm, o.updates, o.refused = e.alarm, e.updates, e.refused
        o.frame = (fr.north_m, fr.east_m, fr.heading_rad)
        return o
