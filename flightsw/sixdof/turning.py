"""Gyro and attitude reference against each other, and against what the surfaces make of the rates: which of the two is wrong.

A gyro whose readings stand still, or come late, takes the damping out of every law, and an aircraft breaks up within a second or
two; the estimator believes it, as its noise is small. A reference that stands still turns the horizon. Either alone looks
sound. What the reference turns beyond the gyro is white but for one of them being wrong; who is, the moments decide
(docs/sources/recovery.md 9).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import added, less
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.lateness import Lateness
from flightsw.sixdof.layout import X_BETA, X_PHI
from flightsw.sixdof.looks import Looks
from flightsw.sixdof.moments import Moments
from flightsw.types import HF_ATT, HF_IMU, UPD_ATT, UPD_IMU, ZERO3, Health, NavState, SensorFrame, Text, Vec3

WINDOWS_S = (0.3, 1.0)  # [s] a fast fault in the first, a slow one in the last
BEFORE_S = 0.5  # [s] before a window in which it has shown, a fault had not begun
TWICE = 2  # readings in a row beyond the limit: a reading that jumps back is the estimator's own to refuse
SLOW_S = 2.0  # [s] before that, in which the reference tells rates well enough
SHARE = 0.6  # [-] of the other's distance from the model within which one of two is right
CALM_S, AGAIN = 5.0, 4.0  # [s] until taken again, each time so much longer
TRY_S = 1.0  # [s] between tries of the moments
GAP_S = 0.3  # [s] without one of the two: begin anew
MODEL = 0.2  # [-] of a turn to and fro, by which the moments may miss it besides what is learnt
CLEAR = 9.0  # [-] difference of squares in sigmas of the model: odds of 90
LATELY = 3.0  # sigmas of the shortest window, of a gyro whose rates are none of the moments'
AGREE = (), ()  # about which axes they do not, over each window


class Turning:
    """One aircraft's. `step` at every mission step."""

    def __init__(self, ac: Aircraft, false_sigma: float, r_euler: float, r_rate: float) -> None:
        """false_sigma [-]: sigmas of disagreement that count; r_euler [rad], r_rate [rad/s]: scatter of one reading."""
        self.k, self.r_euler, self.r_rate = false_sigma, r_euler, r_rate
        self.texts: list[Text] = []
        self.moments_hold = True  # surfaces are where they are believed to be: without that nobody is accused
        self.out = 0  # HF_IMU or HF_ATT: who is left out
        self._outs = {HF_IMU: 0, HF_ATT: 0}  # how many times each has been
        self._jumped = False  # by its own rates' jumps
        self._by = 0  # and the other of them, if it is by that one's readings
        self._same, self._read = 0, (0.0,) * 4  # readings of the reference to the bit as the last one
        # [3] rad: the gyro is left out in this step; an estimate by it is off by that, come about in over_s [s]
        self.believed: Vec3 | None = None
        self.over_s = 1.0
        self._moments, self._lateness = Moments(ac, r_rate), Lateness()
        self._steps, self._rate2 = Looks(WINDOWS_S, false_sigma, r_euler, r_rate, self._moments), r_rate**2
        self._tried_s = 0.0
        self._t_us = self._fuel_us = 0
        self._begin()

    def _begin(self) -> None:
        self._steps.begin()
        self._turn, self._dt, self._count = ZERO3, 0.0, 0
        self._over = [0, 0]  # by window: looks beyond it in a row
        self._accused = [0, 0]  # clearly, by the look before: each begins by rates of its own, with noise
        self._said = dict.fromkeys((0, HF_IMU, HF_ATT), 0)
        self._moments.begin()
        self._calm_s = 0.0
        self._lateness.begin()

    def step(
        self, f: SensorFrame, u: np.ndarray, nav: NavState, updated: int, health: Health, dt: float
    ) -> tuple[int, Health]:
        """`updated` (UPD_*) and health without who is left out.

        f: frame; u [4]: mean controls since the last step (surfaces rad, thrust N); nav: the estimate of the last step, whose
        airspeed and flow the moments go by; dt [s] since the last step.
        """
        self.believed = None
        gap = self._t_us > 0 and f.t_us - self._t_us > 1.5e6 * dt
        self._t_us = f.t_us
        if f.fuel_t_us > self._fuel_us:
            self._fuel_us = f.fuel_t_us
            self._moments.weigh(f.fuel_kg)
        gyro = bool(updated & UPD_IMU and f.gyro_count and not health.failed & HF_IMU)
        if not gyro or not nav.valid or gap:  # over which nobody knows how the gyro turned
            self._begin()
        if self._by and health.failed & self._by:  # who has accused is wrong itself
            self.texts.append(Text(5, f"{NAMES[self.out]} used: {NAMES[self._by]} failed"))
            self.out = self._by = 0
        if gyro and nav.valid:
            self._follow(f, u, nav, bool(updated & UPD_ATT and not health.failed & HF_ATT), dt)
        if not self.out:
            return updated, health
        return updated & ~(UPD_IMU if self.out == HF_IMU else UPD_ATT), replace(health, failed=health.failed | self.out)

    def _follow(self, f: SensorFrame, u: np.ndarray, nav: NavState, fresh: bool, dt: float) -> None:
        """Turn on with the gyro; at a reading of the reference look how much more it has turned."""
        (x, y, z), (p, q, r) = self._turn, f.gyro_mean_b
        self._turn = (x + p * dt, y + q * dt, z + r * dt)
        self._dt += dt
        self._count += f.gyro_count
        steps = self._steps
        if not fresh:
            steps.turn(f.gyro_mean_b, dt)
            if self._dt > GAP_S:
                self._begin()
            return
        self._same = self._same + 1 if f.att_q_nb == self._read else 0
        self._read = f.att_q_nb
        known, age_s, flow = steps.known, (f.t_us - f.att_t_us) * 1e-6, (max(nav.V, 1.0), nav.beta, nav.alpha)
        sides = steps.take(
            f.gyro_mean_b, dt, f.att_q_nb, age_s, self._turn, self._dt, flow, -nav.pos_n[2], u, max(self._count, 1)
        )
        if known:
            self._judge(sides, self._dt)
        self._turn, self._dt, self._count = ZERO3, 0.0, 0

    def _judge(self, sides: int, dt: float) -> None:
        """Every window that is full; who is left out, and who is taken again. Of a step of dt [s]; sides (Moments.wild)."""
        steps = self._steps
        alarm = steps.axes != AGREE
        if alarm:
            for w, axes in enumerate(steps.axes):
                self._over[w] = self._over[w] + 1 if axes else 0
                if self._over[w] >= TWICE and not self.out and self.moments_hold:
                    self._who(w, axes)
                else:
                    self._accused[w] = 0
        else:
            self._over, self._accused = [0, 0], [0, 0]
        if sides == 2 or (sides == 1 and self._contradicted()):
            alarm = True
            if not self.out and self.moments_hold:
                self._leave_out(HF_IMU, steps.last, dt, "its rates jump")
                self._jumped = True
        self._exercise(dt, alarm)
        if not alarm and not self.out:
            steps.learn(dt)
            self._try(dt)
            if self._calm_s > WINDOWS_S[-1]:
                self._said = dict.fromkeys(self._said, 0)
        if not self.out or self._calm_s <= CALM_S * AGAIN ** (self._outs[self.out] - 1):
            return
        if not self._jumped or self._lateness.in_time(
            steps.scatter
        ):  # what jumps may come late, and agrees in calm flight
            self.texts.append(Text(5, f"{NAMES[self.out]} agrees again, used"))
            self.out = self._by = 0

    def _exercise(self, dt: float, alarm: bool) -> None:
        """For how long both have agreed, and how late the gyro has come where it may."""
        if alarm or self._calm_s == 0.0:
            self._lateness.begin()
        self._calm_s = 0.0 if alarm else self._calm_s + dt
        i = self._steps.first[0]
        if self.out and self._jumped and i > 0:
            faster = less(self._rates(len(self._steps) - 1), self._rates(i))
            more = less(self._steps[-1].more, self._steps[i].more)
            self._lateness.take(more, faster, self._rate2 / max(self._count, 1))

    def _rates(self, i: int) -> Vec3:
        """Mean rates [3] rad/s by the gyro in step i > 0."""
        step = self._steps[i]
        x, y, z = less(step.turn, self._steps[i - 1].turn)
        return x / step.dt, y / step.dt, z / step.dt

    def _contradicted(self) -> bool:
        """Whether the reference has not seen the gyro's last turns."""
        return any(abs(x) > LATELY * sigma for x, sigma in zip(*self.lately(), strict=True))

    @property
    def more(self) -> Vec3:
        """What `lately` says first."""
        return ZERO3 if self.out else self._steps.more

    def lately(self) -> tuple[Vec3, Vec3]:
        """Over the shortest window: by how much the reference has turned more than the gyro [rad], and one sigma of that; without
        a sigma where nobody knows."""
        began = self._steps.first[0]
        if began < 0 or self.out:
            return ZERO3, (math.inf, math.inf, math.inf)
        return self._steps.apart(began, max(self._count, 1))

    def _who(self, window: int, axes: tuple[int, ...]) -> None:
        """Leave out who turns otherwise about `axes` than the moments have it, from before the fault on, which has shown over
        that window; nobody if that is not clear.

        The moments go on from rates, and a fault that grows slowly is in those already: they begin once by the gyro's and
        once by what the reference has turned in the two seconds before, and both have to say the same, in two looks in a row,
        the one not named by half as many as the other since they disagree. A reference that repeats itself
        to the bit says nothing.
        """
        steps = self._steps
        began = steps.before(WINDOWS_S[window] + BEFORE_S)
        earlier = steps.before(steps[-1].t_s - steps[began].t_s + SLOW_S) if began > 0 else -1
        if earlier < 0:
            return
        first, last, ago = steps[began], steps[-1], steps[earlier]
        w = self._rates(began)
        (x, y, z), span = less(first.more, ago.more), first.t_s - ago.t_s
        gyro, more = less(last.turn, first.turn), less(last.more, first.more)
        size = less(last.size, first.size)
        said = {
            self._nearer(began, start, gyro, more, size, axes)
            for start in (w, added(w, (x / span, y / span, z / span)))
        }
        for who in said:
            self._said[who] += 1
        mine, other = self._said[HF_IMU], self._said[HF_ATT]
        before, self._accused[window] = self._accused[window], next(iter(said)) if len(said) == 1 else 0
        if not before or before != self._accused[window] or self._same or min(mine, other) >= 0.5 * max(mine, other):
            return
        deg = math.degrees(math.hypot(*more))
        self._leave_out(said.pop(), more, last.t_s - first.t_s, f"{deg:.1f} deg off, not by moments")
        self._by = HF_IMU + HF_ATT - self.out

    def _leave_out(self, who: int, more: Vec3, over_s: float, why: str) -> None:
        self.out, self._jumped = who, False
        self._outs[who] += 1
        if who == HF_IMU:
            self.believed, self.over_s = more, over_s
        self.texts.append(Text(4, f"{NAMES[who]} left out: {why}"[:50]))

    def _nearer(self, began: int, w: Vec3, gyro: Vec3, more: Vec3, size: Vec3, axes: tuple[int, ...]) -> int:
        """Who is further from the turn that the moments after step `began` make of rates w [3]: HF_IMU, HF_ATT, 0: not clear."""
        steps = self._steps
        model = steps.turned(began, w)
        share = (steps[-1].t_s - steps[began + 1].t_s) / (WINDOWS_S[-1] + BEFORE_S)
        off_gyro = off_att = 0.0
        for i in axes:
            of = 1.0 / (share * share * self._moments.miss[i] + (MODEL * size[i]) ** 2)
            off_gyro += of * (gyro[i] - model[i]) ** 2
            off_att += of * (gyro[i] + more[i] - model[i]) ** 2
        least, most = min(off_gyro, off_att), max(off_gyro, off_att)
        if least > CLEAR * len(axes) or most - least < CLEAR or least > SHARE**2 * most:
            return 0
        return HF_IMU if off_att < off_gyro else HF_ATT

    def _try(self, dt: float) -> None:
        """By how much the moments miss the turn, while nobody is wrong; dt [s] of the last step."""
        steps = self._steps
        if len(steps) < 3:
            return
        self._tried_s += dt
        if self._tried_s > TRY_S and (began := steps.before(WINDOWS_S[-1] + BEFORE_S)) > 0:
            turned = steps.turned(began, self._rates(began))
            self._moments.missed(less(less(steps[-1].turn, steps[began].turn), turned), self._tried_s)
            self._tried_s = 0.0


NAMES = {HF_IMU: "gyro", HF_ATT: "attitude"}


def compared(
    turning: Turning | None,
    core: TrustedCore,
    f: SensorFrame,
    u: np.ndarray,
    nav: NavState,
    updated: int,
    health: Health,
    dt: float,
) -> tuple[int, Health]:
    """Turning.step before the estimator `core` whose estimate of the last step is nav; that is opened by what it has believed."""
    if turning is None:
        return updated, health
    updated, health = turning.step(f, u, nav, updated, health, dt)
    if turning.believed is not None:
        x, y, z = turning.believed
        T = turning.over_s
        # one error: turned too far, at that rate, and half of it in the flow, which vanes measure besides
        core.widen(slice(X_BETA, X_PHI + 1), np.array([-0.5 * z, 0.5 * y, x / T, y / T, z / T, z, y, x]))
    return updated, health


def make_turning(ac: Aircraft, p: NavParams) -> Turning | None:
    """The one that [nav] asks for."""
    if p.gate.false_alarm == 0.0 or p.gate.turn_sigma == 0.0:
        return None
    return Turning(ac, p.gate.turn_sigma, p.r_euler, p.r_rate)
