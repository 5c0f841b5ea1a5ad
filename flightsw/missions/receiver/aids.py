"""Relative position without the relative sensor: the wake position from air data, and a calibrated difference of GNSS fixes.

The wake gives the two coordinates across the tanker's air path; GNSS positions of the two aircraft, compared with the relative
sensor while that is good, give all three for a while after it is lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.kernels.rotations import to_child, to_parent
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.refusal import GNSS_DIFF, REL_POS, REL_RATE, WAKE, Refusals
from flightsw.sixdof import witness
from flightsw.sixdof.estimator_core import EstimatorCore
from flightsw.sixdof.layout import M_POS, M_VEL, TK_RATE, TK_VEL
from flightsw.strict import Range
from flightsw.types import SensorFrame, Vec3

Pos = Annotated[float, Range(1e-6)]
WAKE_ROWS = 2  # of the wake position in one correction
STAND_IN_ROWS = 6  # of GNSS difference and closure rate, beside a relative sensor that is kept out
WILD = 20  # comparisons before one may be called wild, and wild ones in a row before they are believed
WILD_MPS = 2.5  # [m/s] comparison of velocities that must be a spike
CALIBRATE_S = 20.0  # [s] of the witness
WILD_SIGMA = 2.5  # [-] of r_gnss_m, which is several times the noise of one comparison


@dataclass(frozen=True)
class AidParams:
    """Weight of the aids and how long they may stand in."""

    fix_tau_s: Pos = 2.7  # [s] correlation time of the wake position's error: that of turbulence over the probes
    fix_sigma_max_m: Pos = 0.8  # [m] 1-sigma per axis of a wake position that may hold a station
    r_gnss_m: Pos = (
        2.0  # [m] per sample of the calibrated GNSS difference; its error is slow, hence more than its noise
    )
    calibrate_tau_s: Pos = 20.0  # [s]
    rel_stale_s: Pos = 0.2  # [s] age of the relative sensor beyond which the GNSS difference is used
    hold_max_s: Pos = 60.0  # [s] longest hold without the relative sensor
    link_hold_max_s: Pos = 30.0  # [s] longest hold without the data link
    velocity: bool = True  # the wake position is aided by the calibrated difference of inertial velocities
    r_velocity_mps: Pos = (
        0.3  # [m/s] of that per sample; the tanker's estimate errs over seconds, hence more than noise
    )
    velocity_tau_s: Pos = 30.0  # [s] of its calibration


class PositionAid:
    """Queues what stands in for the relative sensor, in tanker axes: wake position, GNSS difference, closure rate."""

    def __init__(self, p: AidParams) -> None:
        self.p = p
        self.offset = np.zeros(3)  # [m] NED: GNSS difference minus the relative sensor
        self.samples = self._wilds = 0
        self.gnss_us = self.fix_us = -1
        self._d, self._e = np.zeros(3), np.zeros(3)

    def reset(self) -> None:
        """Forget the calibration (the tanker's frame has changed)."""
        self.samples = self._wilds = 0
        self.offset[:] = 0.0

    def stale(self, age_s: float) -> bool:
        """Whether the relative sensor's last reading is too old to be alone: age_s [s]."""
        return age_s > self.p.rel_stale_s

    def gnss(
        self,
        core: EstimatorCore,
        f: SensorFrame,
        R_t: np.ndarray,
        tanker_pos: np.ndarray,
        rate: np.ndarray,
        fresh: bool,
    ) -> None:
        """Compare the GNSS difference with the relative sensor when that is `fresh`, else queue it as a measurement.

        R_t [9] NED to tanker body, tanker_pos [3] NED [m] at the GNSS sample, rate [3] modelled d(xi)/dt [m/s].
        """
        p = self.p
        if f.gnss_t_us == self.gnss_us or f.gnss_t_us <= 0:
            return
        dt = (f.gnss_t_us - self.gnss_us) * 1e-6 if self.gnss_us > 0 else 0.05
        self.gnss_us = f.gnss_t_us
        self._d[:] = f.gnss_pos_n
        self._d -= tanker_pos
        if fresh:
            to_parent(R_t, np.array(f.rel_pos_t), self._e)
            if self._wild(self._d - self._e - self.offset):
                return
            self.samples += 1
            gain = max(1.0 / self.samples, min(dt / p.calibrate_tau_s, 1.0))
            self.offset += gain * (self._d - self._e - self.offset)
        elif self.samples * dt > 1.0:
            self._d -= self.offset
            to_child(R_t, self._d, self._e)
            age = (f.t_us - f.gnss_t_us) * 1e-6
            for i in range(3):
                core.add(M_POS + i, float(self._e[i] + rate[i] * age), p.r_gnss_m, GNSS_DIFF)

    def _wild(self, residual: np.ndarray) -> bool:
        """Whether a comparison is so far off that one of both readings must be a spike; after WILD of them begin anew."""
        far = self.samples >= WILD and float(np.abs(residual).max()) > WILD_SIGMA * self.p.r_gnss_m
        self._wilds = self._wilds + 1 if far else 0
        if self._wilds > WILD:
            self.reset()
            return False
        return far

    def closure_rate(self, core: EstimatorCore, rate: Vec3) -> None:
        """Queue d(xi)/dt [m/s] of the calibrated difference of velocities (VelocityAid)."""
        for i in range(3):
            core.add(M_VEL + i, rate[i], self.p.r_velocity_mps, REL_RATE)

    def wake(self, core: EstimatorCore, fix: WakeFix, R_ft: np.ndarray, x_f: float) -> None:
        """Queue a new wake position; R_ft [9] tanker air-path axes F to tanker body axes, x_f [m] own x in F.

        Its error lasts for fix_tau_s, so each of the samples in that time carries a share of the information.
        """
        if not fix.valid or fix.t_us == self.fix_us:
            return
        dt = (fix.t_us - self.fix_us) * 1e-6 if self.fix_us > 0 else self.p.fix_tau_s
        self.fix_us = fix.t_us
        inflate = 1.0 / math.sqrt(math.tanh(0.5 * min(dt, self.p.fix_tau_s) / self.p.fix_tau_s))
        self._d[:] = x_f, fix.pos_f[1], fix.pos_f[2]
        to_child(R_ft, self._d, self._e)
        core.add(M_POS + 1, float(self._e[1]), math.sqrt(max(fix.cov_yy, 1e-4)) * inflate, WAKE)
        core.add(M_POS + 2, float(self._e[2]), math.sqrt(max(fix.cov_zz, 1e-4)) * inflate, WAKE)


class StationHold:
    """Whether the position is good although the relative sensor or the data link is silent, and for not too long."""

    def __init__(self, p: AidParams) -> None:
        self.p = p
        self._since_us = -1

    def good(self, fix: WakeFix | None) -> bool:
        """Whether the wake position is good enough to hold a station by."""
        s = self.p.fix_sigma_max_m
        return fix is not None and fix.valid and max(fix.cov_yy, fix.cov_zz) < s * s

    def step(self, t_us: int, link: bool, seen: bool, level: bool, fix: WakeFix | None) -> bool:
        """At t_us: link: the tanker is known; seen: by the relative sensor; level: its wings were when the link went; fix: wake
        position."""
        if link == seen:
            self._since_us = -1
            return False
        if self._since_us < 0:
            self._since_us = t_us
        held_s = (t_us - self._since_us) * 1e-6
        if link:
            return self.good(fix) and held_s < self.p.hold_max_s
        return level and held_s < self.p.link_hold_max_s


class GnssWitness:
    """The difference of both aircraft's GNSS fixes, freed of its lasting error by comparison with the relative sensor while that
    was in use: whom it bears out when sensor and estimate disagree."""

    def __init__(self, r_pos: float, drift: float) -> None:
        """r_pos [m] of one reading, drift [m/s] of the estimate once the sensor is out."""
        self.r_pos, self.drift = r_pos, drift
        self._sensor, self._estimate = np.zeros(3), np.zeros(3)  # [m] NED: witness less each, smoothed
        self.reset()

    def reset(self) -> None:
        """Forget the calibration."""
        self.offset = np.zeros(3)
        self.known_s = self.out_s = 0.0
        self.gnss_us = -1

    def step(self, difference: np.ndarray, seen: np.ndarray, estimate: np.ndarray, t_us: int, held: bool) -> None:
        """At GNSS time t_us: own fix less the tanker's position, reading and estimate of the relative position, all [3] NED [m];
        held: the sensor is kept out."""
        if t_us <= self.gnss_us:
            return
        dt = min((t_us - self.gnss_us) * 1e-6, 1.0) if self.gnss_us > 0 else 0.05
        self.gnss_us = t_us
        if not held:
            self.out_s = 0.0
            off = difference - seen - self.offset
            if self.known_s > 1.0 and float(np.abs(off).max()) > 6.0 * self.r_pos:
                return  # a spike of one of both
            self.known_s += dt
            self.offset += dt / min(self.known_s, CALIBRATE_S) * off
            return
        gain = 1.0 if self.out_s <= 0.0 else dt
        self.out_s += dt
        self._sensor += gain * (difference - self.offset - seen - self._sensor)
        self._estimate += gain * (difference - self.offset - estimate - self._estimate)

    def hear(self, gate: Refusals, f: SensorFrame, tk: np.ndarray, xi: np.ndarray, tanker_pos: np.ndarray) -> None:
        """Compare, and tell the gate while the relative sensor is kept out; tk [18] tanker now, xi [3] estimate [m],
        tanker_pos [3] NED [m] at the GNSS sample."""
        seen, estimate, held = np.empty(3), np.empty(3), gate.held(REL_POS)
        to_parent(tk, np.array(f.rel_pos_t), seen)
        to_parent(tk, xi, estimate)
        self.step(np.array(f.gnss_pos_n) - tanker_pos, seen, estimate, f.gnss_t_us, held)
        if held:
            gate.verdict[REL_POS] = self.verdict()

    def verdict(self) -> int:
        """AGAINST the sensor, FOR it or UNDECIDED."""
        if self.known_s < 2.0 or self.out_s < 0.5:
            return witness.UNDECIDED
        s = math.hypot(0.8 * self.r_pos, 2.0 * self.drift * self.out_s)
        return witness.verdict([(a / s, b / s) for a, b in zip(self._sensor, self._estimate, strict=True)])


def seen_velocity(f: SensorFrame, tk: np.ndarray, out: np.ndarray) -> None:
    """out [3] <- own velocity less the tanker's [m/s], NED, as the relative sensor shows it: d(xi)/dt + w_T x xi; tk [18]."""
    w, r, v = tk[TK_RATE], f.rel_pos_t, f.rel_vel_t
    d = np.array([v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]])
    to_parent(tk, d, out)


class VelocityAid:
    """Own GNSS velocity less the tanker's transmitted one, freed of its lasting error by comparison with the relative sensor."""

    def __init__(self, p: AidParams) -> None:
        self.p = p
        self.offset = np.zeros(3)  # [m/s] NED
        self.known_s, self._wilds = 0.0, 0  # [s] of comparison so far; spikes in a row
        self.gnss_us = -1
        self._d, self._e = np.zeros(3), np.zeros(3)

    def reset(self) -> None:
        """Forget the calibration."""
        self.known_s, self._wilds = 0.0, 0
        self.offset[:] = 0.0

    def step(self, f: SensorFrame, tk: np.ndarray, seen: bool, out: np.ndarray) -> bool:
        """out [3] <- velocity [m/s] less the tanker's, tanker axes, at the GNSS sample of `f`; whether it is new and calibrated.

        tk [18] tanker at that time (see PeerTracker.stage); seen: the relative sensor of `f` is new and good.
        """
        if f.gnss_t_us <= self.gnss_us:
            return False
        dt = min((f.gnss_t_us - self.gnss_us) * 1e-6, 0.2) if self.gnss_us > 0 else 0.05
        self.gnss_us = f.gnss_t_us
        self._d[:] = f.gnss_vel_n
        self._d -= tk[TK_VEL]
        if seen:
            seen_velocity(f, tk, self._e)
            wild = self.known_s > 1.0 and float(np.abs(self._d - self._e - self.offset).max()) > WILD_MPS
            self._wilds = self._wilds + 1 if wild else 0
            if self._wilds > WILD:
                self.reset()
            elif wild:
                return False
            self.known_s += dt
            self.offset += dt / min(self.known_s, self.p.velocity_tau_s) * (self._d - self._e - self.offset)
        self._d -= self.offset
        to_child(tk, self._d, out)
        return self.known_s > 1.0
