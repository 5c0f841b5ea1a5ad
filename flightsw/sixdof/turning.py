"""Gyro and attitude reference against each other, and against what the surfaces make of the rates: which of the two is wrong.

A gyro whose readings stand still, or come late, takes the damping out of every law, and an aircraft breaks up within a second or
two; the estimator believes it, as its noise is small. A reference that stands still turns the horizon. Either alone looks
sound. What the reference turns beyond the gyro is white but for one of them being wrong; who is, the moments decide
(docs/sources/recovery.md 9).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import density
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, rotate_dcm
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import X_BETA, X_PHI
from flightsw.sixdof.motion import moment_rates
from flightsw.sixdof.params import parameter_vector, set_mass
from flightsw.types import HF_ATT, HF_IMU, UPD_ATT, UPD_IMU, Health, NavState, SensorFrame, Text

WINDOWS_S = (0.3, 1.0)  # [s] a fast fault in the first, a slow one in the last
BEFORE_S = 0.5  # [s] before a window in which it has shown, a fault had not begun
BIAS, SCALE = 2e-3, 0.02  # [rad/s] change of a gyro's bias, [-] of a turn: scale, misalignment, sampling
TWICE = 2  # readings in a row beyond the limit: a reading that jumps back is the estimator's own to refuse
SHARE = 0.6  # [-] of the other's distance from the model within which one of two is right
LEARN_S, MOMENT_S, CALM_S = 20.0, 20.0, 5.0  # [s] for the reference's scatter; for lasting moments; until taken again
GAP_S = 0.3  # [s] without one of the two: begin anew
LEAST = 0.1  # [-] of nav.r_euler: no reference scatters less


@dataclass(slots=True)
class _Step:
    """Between two readings of the reference: its turn beyond the gyro's [3] rad, the gyro's turn [3] rad, time [s], and what the
    moments need: V, beta, alpha, rho, controls [4]."""

    more: np.ndarray
    turn: np.ndarray
    dt: float
    V: float
    beta: float
    alpha: float
    rho: float
    u: np.ndarray


class Turning:
    """One aircraft's. `step` at every mission step."""

    def __init__(self, ac: Aircraft, false_sigma: float, r_euler: float, r_rate: float) -> None:
        """false_sigma [-]: sigmas of disagreement that count; r_euler [rad], r_rate [rad/s]: scatter of one reading."""
        self.ac, self.k, self.r_euler, self.r_rate = ac, false_sigma, r_euler, r_rate
        self.texts: list[Text] = []
        self.out = 0  # HF_IMU or HF_ATT: who is left out
        self.believed: np.ndarray | None = (
            None  # [3] rad: in this step the gyro is left out; an estimate by it is off by that,
        )
        self.over_s = 1.0  # [s] in this time
        self._P = parameter_vector(ac, ac.mass.empty_kg + ac.mass.default_fuel_kg)
        self._R, self._turned, self._seen = np.zeros(9), np.zeros(9), np.zeros(9)
        self._moments = np.zeros(3)  # [rad/s^2] what the model lacks
        self._learnt_s = 0.0
        self._fm = np.zeros(9)
        self._scatter = r_euler**2
        self._begin()

    def _begin(self) -> None:
        self._steps: deque[_Step] = deque(maxlen=200)
        self._known = False
        self._turn, self._time, self._count = np.zeros(3), 0.0, 0
        self._over = dict.fromkeys(WINDOWS_S, 0)
        self._calm_s = 0.0

    def step(
        self, f: SensorFrame, u: np.ndarray, nav: NavState, updated: int, health: Health, dt: float
    ) -> tuple[int, Health]:
        """`updated` (UPD_*) and health without who is left out.

        f: frame; u [4]: mean controls since the last step (surfaces rad, thrust N); nav: the estimate of the last step, whose
        airspeed and flow the moments go by; dt [s] since the last step.
        """
        self.believed = None
        if f.fuel_t_us > 0:
            set_mass(self._P, self.ac, self.ac.mass.empty_kg + f.fuel_kg)
        gyro = bool(updated & UPD_IMU and f.gyro_count and not health.failed & HF_IMU)
        if not gyro:
            self._begin()
        elif nav.valid:
            self._follow(f, u, nav, bool(updated & UPD_ATT and not health.failed & HF_ATT), dt)
        if not self.out:
            return updated, health
        return updated & ~(UPD_IMU if self.out == HF_IMU else UPD_ATT), replace(health, failed=health.failed | self.out)

    def _follow(self, f: SensorFrame, u: np.ndarray, nav: NavState, fresh: bool, dt: float) -> None:
        """Turn on with the gyro; at a reading of the reference look how much more it has turned."""
        w = np.array(f.gyro_mean_b)
        self._turn += w * dt
        self._time += dt
        self._count += f.gyro_count
        if self._known:
            rotate_dcm(self._R, w, dt, self._turned)
            self._R, self._turned = self._turned, self._R
        if not fresh:
            if self._time > GAP_S:
                self._begin()
            return
        dcm_from_quat(np.array(f.att_q_nb), self._seen)
        rotate_dcm(self._seen, w, (f.t_us - f.att_t_us) * 1e-6, self._turned)
        if self._known:
            E = np.zeros(9)
            mul33_t(self._turned, self._R, E)  # I - [more x]
            more = 0.5 * np.array([E[5] - E[7], E[6] - E[2], E[1] - E[3]])
            rho = density(-nav.pos_n[2])
            s = _Step(more, self._turn.copy(), self._time, max(nav.V, 1.0), nav.beta, nav.alpha, rho, u.copy())
            self._steps.append(s)
            self._judge(s)
        self._known = True
        self._R[:] = self._turned
        self._turn[:] = 0.0
        self._time, self._count = 0.0, 0

    def _judge(self, s: _Step) -> None:
        """Every window that is full; who is left out, and who is taken again."""
        alarm, told = False, False
        for T in WINDOWS_S:
            steps = self._window(T)
            if not steps:
                continue
            more = np.sum([x.more for x in steps], axis=0)
            turn = np.sum([np.abs(x.turn) for x in steps], axis=0)
            span = sum(x.dt for x in steps)
            white = 2.0 * self._scatter + self.r_rate**2 * span * s.dt / max(self._count, 1)
            limit = self.k * np.sqrt(white + (BIAS * span) ** 2 + (SCALE * turn) ** 2)
            axes = np.abs(more) > limit
            beyond = bool(axes.any())
            self._over[T] = self._over[T] + 1 if beyond else 0
            alarm = alarm or beyond
            if self._over[T] >= TWICE and not told and not self.out:
                told = self._who(self._window(T + BEFORE_S), axes)
        self._calm_s = 0.0 if alarm else self._calm_s + s.dt
        if not alarm and not self.out:
            self._learn(s)
        if self.out and self._calm_s > CALM_S:
            self.texts.append(Text(5, f"{NAMES[self.out]} agrees again, used"))
            self.out = 0

    def _window(self, T: float) -> list[_Step]:
        """The latest steps that fill T [s], the latest first; none: there are not as many yet."""
        out, span = [], 0.0
        for x in reversed(self._steps):
            out.append(x)
            span += x.dt
            if span >= T - 1e-6:
                return out
        return []

    def _who(self, steps: list[_Step], axes: np.ndarray) -> bool:
        """Leave out who turns otherwise about `axes` [3] (bool) than the moments have it, from rates of before the fault; whether
        it is clear."""
        if not steps:
            return False
        oldest_first = steps[::-1]
        w = oldest_first[0].turn / oldest_first[0].dt
        model, gyro, more = np.zeros(3), np.zeros(3), np.zeros(3)
        for x in oldest_first[1:]:
            w = w + (self._rates(x, w) + self._moments) * x.dt
            model += w * x.dt
            gyro += x.turn
            more += x.more
        off = (gyro - model)[axes], (gyro + more - model)[axes]
        off_gyro, off_att = (math.hypot(*x.tolist()) for x in off)
        if min(off_gyro, off_att) > SHARE * max(off_gyro, off_att):
            return False
        self.out = HF_IMU if off_att < off_gyro else HF_ATT
        if self.out == HF_IMU:
            self.believed, self.over_s = more, sum(x.dt for x in oldest_first[1:])
        deg = math.degrees(math.hypot(*more.tolist()))
        self.texts.append(Text(4, f"{NAMES[self.out]} left out: {deg:.1f} deg off, not by moments"[:50]))
        return True

    def _rates(self, x: _Step, w: np.ndarray) -> np.ndarray:
        """Angular acceleration [3] rad/s^2 of the model at rates w [3]."""
        return np.array(moment_rates(x.V, x.beta, x.alpha, w, x.u, x.rho, self._P, self._fm))

    def _learn(self, s: _Step) -> None:
        """The scatter of the reference, and lasting moments the model lacks."""
        if len(self._steps) < 2:
            return
        before = self._steps[-2]
        gain = min(s.dt / LEARN_S, 1.0)
        each = math.hypot(*s.more.tolist()) ** 2 / 6.0  # of one axis of one of two readings
        floor = (LEAST * self.r_euler) ** 2
        self._scatter = max(self._scatter + gain * (each - self._scatter), floor)
        w0, w1 = before.turn / before.dt, s.turn / s.dt
        lacks = (w1 - w0) / s.dt - self._rates(s, w0)
        self._learnt_s += s.dt
        self._moments += s.dt / min(self._learnt_s, MOMENT_S) * (lacks - self._moments)


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
        x, y, z = turning.believed.tolist()
        rates = turning.believed / turning.over_s
        # one error: turned too far, at that rate, and half of it in the flow, which vanes measure besides
        core.widen(slice(X_BETA, X_PHI + 1), np.array([-0.5 * z, 0.5 * y, *rates, z, y, x]))
    return updated, health


def make_turning(ac: Aircraft, p: NavParams) -> Turning | None:
    """The one that [nav] asks for."""
    if p.gate.false_alarm == 0.0 or p.gate.turn_sigma == 0.0:
        return None
    return Turning(ac, p.gate.turn_sigma, p.r_euler, p.r_rate)
