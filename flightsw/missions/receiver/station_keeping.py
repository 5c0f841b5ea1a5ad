"""Receiver station keeping: gain-scheduled LQR with integral action on inertial relative motion.

Design state: xi_dot (3), w_rel (3), psi, theta, phi relative (3), xi (3), servo position (3), servo rate (3), thrust (1),
integral of xi error (3),
previous commands (4 per started period of delay). Airspeed, sideslip and incidence are eliminated through
xi_dot = R^T u_a + R_BTI (W - v_T) + S(w_T) xi, so that a gust does not look like a closure-rate error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.linalg import solve
from flightsw.kernels.rotations import less
from flightsw.kernels.sampled import multiply
from flightsw.plugins import EVERY_KEY, OursOr, made, refuse_ignored
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.command import (
    ControlCore,
    Four,
    Node3,
    NonNeg,
    ScheduleParams,
    design_mass,
    lqr_terms,
    thrust_unit,
)
from flightsw.sixdof.layout import EULER, POS
from flightsw.sixdof.lqr import ENGINE, OLD, SERVO, SERVO_RATE, Design, DesignError, augment, design
from flightsw.sixdof.lqr import INTEGRALS as BEHIND
from flightsw.sixdof.schedule import GainSchedule, blended
from flightsw.sixdof.trim import linearise_relative, trim_free, trim_relative
from flightsw.strict import ConfigError, Range
from flightsw.terms import LawTerms, Scheduled
from flightsw.types import GuidanceCmd, NavState

N = 12  # rigid design states
INTEGRALS = slice(N + BEHIND, N + OLD)  # of the design state
THRUST_UNIT, SOFT_UNIT = (3500.0, 5300.0), (2500.0, 5300.0)  # [N] of the Learjet at [kg]
CONTROLLED = (("ahead", "m"), ("right", "m"), ("below", "m"))  # xi, tanker body axes
VEL = slice(0, 3)  # [m/s] d(xi)/dt, in the place of V, beta, alpha; the rest as in the state


@dataclass(frozen=True)
class ReceiverCtrlParams:
    """Bryson weights: the size of each deviation that counts as one unit."""

    schedule: ScheduleParams
    tanker_mass_kg: NonNeg = 0.0  # 0: that of the tanker's file, empty and its usual fuel
    xi_m: Node3 = (-35.5, 0.0, 8.5)
    w_vel_mps: Node3 = (1.0, 1.0, 1.0)
    w_rate_radps: Node3 = (0.3, 0.3, 0.3)
    w_euler_rad: Node3 = (0.3, 0.3, 0.3)
    w_pos_m: Node3 = (0.6, 0.6, 0.6)
    w_int_ms: Node3 = (1.5, 1.5, 1.5)
    w_input: Four = (0.106, 0.0707, 0.106, 0.0)  # thrust [N]; 0: in proportion to the weight
    int_limit_ms: Node3 = (30.0, 20.0, 20.0)
    # of the position error the law is given: no more bank and pull than for that
    pos_limit_m: Node3 = (20.0, 20.0, 20.0)
    # a softer law for poor sensing, blended in as the scatter of the estimated position goes from the first to the second: a
    # lasting error does not shake the aircraft
    soft_sigma_m: tuple[float, float] = (0.14, 0.19)
    soft_pos_m: Node3 = (1.0, 1.0, 1.0)
    soft_int_ms: Node3 = (3.0, 3.0, 3.0)
    soft_input: Four = (0.075, 0.05, 0.075, 0.0)
    condition_tau_s: Annotated[float, Range(0.01)] = 1.0  # smoothing of the scheduling variables
    law: Annotated[str, OursOr(("station_keeping",))] = (
        "station_keeping"  # a StationKeepingLaw, made from (aircraft, tanker, this table, period)
    )


def sized(ac: Aircraft, tanker: Aircraft, p: ReceiverCtrlParams) -> ReceiverCtrlParams:
    """`p` with what it leaves to the aircraft filled in: masses, thrust. Raises ConfigError for a mass not theirs."""
    mass = design_mass(ac, p.schedule.mass_kg, "ctrl.schedule.mass_kg")
    return replace(
        p,
        schedule=replace(p.schedule, mass_kg=mass),
        tanker_mass_kg=design_mass(tanker, p.tanker_mass_kg, "ctrl.tanker_mass_kg"),
        w_input=thrust_unit(p.w_input, mass, THRUST_UNIT),
        soft_input=thrust_unit(p.soft_input, mass, SOFT_UNIT),
    )


@runtime_checkable
class StationKeepingLaw(Protocol):
    """What holds the receiver at a place relative to the tanker. A pure step, as all algorithms."""

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""

    def step(
        self, nav: NavState, cmd: GuidanceCmd, act: ActuatorModel, psi_dot_t: float, V_t: float, h_m: float, dt: float
    ) -> tuple[np.ndarray, float]:
        """Command (surfaces [rad] and thrust [N] [4], throttle 0..1) towards cmd.rel_pos_t, dt [s] later. psi_dot_t [rad/s],
        V_t [m/s]: tanker turn rate and airspeed; h_m altitude [m]."""

    def trim_command(self, V_t: float, h_m: float) -> tuple[np.ndarray, float]:
        """The same for straight flight, before navigation is valid."""


class ReceiverControl:
    """Holds xi at the commanded position in the tanker's frame."""

    obeys = EVERY_KEY

    def __init__(self, ac: Aircraft, tanker: Aircraft, p: ReceiverCtrlParams, dt_s: float) -> None:
        """Designs the six nominal laws for control period dt_s. Raises ConfigError, TrimError or DesignError."""
        self.p = p = sized(ac, tanker, p)
        s = p.schedule
        terms = lqr_terms("station_keeping", CONTROLLED, s, Scheduled("softness", "", 0.0, 1.0))
        self.core = ControlCore(ac, terms, np.array(p.int_limit_ms))
        self.nodes = tuple(float(np.radians(v)) for v in s.psi_dot_degps)
        if not 0.0 < p.soft_sigma_m[0] < p.soft_sigma_m[1]:
            raise ConfigError(f"ctrl.soft_sigma_m = {list(p.soft_sigma_m)}: allowed: 0 < first < second")
        tight = (p.w_pos_m, p.w_int_ms, p.w_input)
        soft = (p.soft_pos_m, p.soft_int_ms, p.soft_input)
        self.sched, self.soft = (
            GainSchedule(
                [self._design(ac, tanker, yd, V, dt_s, w) for yd in self.nodes for V in s.V_mps], self.nodes, s.V_mps
            )
            for w in (tight, soft)
        )
        self.softness = 0.0  # share of the soft law
        self.z, self.off = np.zeros(self.sched.nz), np.zeros(self.sched.nz)
        self.core.u_old = np.zeros(((self.sched.nz - N - OLD) // 4, 4))
        self._err = np.zeros(3)
        self._cond = 0.0, float(np.mean(s.V_mps))  # [rad/s], [m/s] of the tanker, smoothed

    def _design(
        self, ac: Aircraft, tanker: Aircraft, yd: float, V: float, dt_s: float, weights: tuple[Node3, Node3, Four]
    ) -> Design:
        p, s = self.p, self.p.schedule
        w_pos, w_int, w_input = weights
        tt = trim_free(tanker, p.tanker_mass_kg, s.h_m, V, yd)
        t = trim_relative(ac, s.mass_kg, tt, np.array(p.xi_m))
        A, B, Cv = linearise_relative(ac, s.mass_kg, tt, t)
        # coordinates [xi_dot, w_rel, euler, xi] from [V, beta, alpha, w_rel, euler, xi]: constant at a trim
        M = np.eye(N)
        M[VEL] = Cv[:, :N]
        Mi = np.eye(N)
        if not solve(M.copy(), Mi):
            raise DesignError(f"receiver at {V:g} m/s: motion relative to the tanker does not show in the air data")
        A12, B12 = multiply(multiply(M, A[:N, :N]), Mi), multiply(M, B[:N])
        C = np.zeros((3, N))
        C[:, POS] = np.eye(3)
        Aa, Ba = augment(A12, B12, C, np.zeros((3, 4)), ac)
        scale = [*p.w_vel_mps, *p.w_rate_radps, *p.w_euler_rad, *w_pos, *[1e3] * 6, 1e6, *w_int]
        q = 1.0 / np.square(scale)
        z0 = np.zeros(len(scale))
        z0[EULER] = t.x[EULER]
        z0[N + SERVO : N + SERVO_RATE], z0[N + ENGINE] = t.u[:3], t.u[3]
        r = 1.0 / np.square(w_input)
        return design(Aa, Ba, dt_s, s.delay_s, q, r, z0, t.u, f"receiver at {V:g} m/s, {yd:.4f} rad/s")

    def step(
        self, nav: NavState, cmd: GuidanceCmd, act: ActuatorModel, psi_dot_t: float, V_t: float, h_m: float, dt: float
    ) -> tuple[np.ndarray, float]:
        """Command (u [4], throttle). psi_dot_t [rad/s], V_t [m/s]: tanker turn rate and airspeed; h_m altitude [m]."""
        c, z = self.core, self.z
        a = dt / (self.p.condition_tau_s + dt)
        known = math.isfinite(psi_dot_t) and math.isfinite(V_t)
        if not c.started and known:
            self._cond = psi_dot_t, V_t
        psi_dot, V = self._cond
        if known:
            psi_dot, V = self._cond = psi_dot + a * (psi_dot_t - psi_dot), V + a * (V_t - V)
        lo, hi = self.p.soft_sigma_m
        want = min(max((max(nav.scatter) - lo) / (hi - lo), 0.0), 1.0)
        if not c.started:
            self.softness = want  # poor sensing must not meet the tight law first
            c.u_old[:] = act.pos[0], act.pos[1], act.pos[2], act.thrust
            c.started = True
        ahead, right, below = less(nav.rel_pos_t, cmd.rel_pos_t)
        x, y, h = self.p.pos_limit_m
        err = min(max(ahead, -x), x), min(max(right, -y), y), min(max(below, -h), h)
        self._err[:] = err
        z[:N] = *less(nav.rel_vel_t, cmd.rel_vel_t), *nav.rel_w_b, *nav.rel_euler, *err
        u, parts = c.close(self.sched, self._cond, z, self.off, N, self._err, act, dt)
        self.softness += a * (want - self.softness)
        if self.softness > 1e-3:
            blended(
                psi_dot, V, *self.soft.tables(), z, self.off, INTEGRALS.start, INTEGRALS.stop, self.softness, u, parts
            )  # fmt: skip
        c.terms.stand(psi_dot, V, self.softness)
        return c.limit(u, h_m, nav.V, parts)

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.core.saturated

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""
        return self.core.terms

    def trim_command(self, V_t: float, h_m: float) -> tuple[np.ndarray, float]:
        """Open-loop trim for straight flight while navigation is not yet valid."""
        self.sched.set_condition(0.0, V_t)
        self.core.terms.stand(0.0, V_t, 0.0)
        return self.core.limit(self.sched.trim_command(), h_m, V_t)


OURS = {"station_keeping": ReceiverControl}
BESIDE = ("schedule.V_mps", "schedule.h_m")  # keys the mission reads itself


def make_station_keeping(
    ac: Aircraft, tanker: Aircraft, p: ReceiverCtrlParams, dt_s: float, default: ReceiverCtrlParams
) -> StationKeepingLaw:
    """The law p.law names, for control period dt_s; default: the table where nobody sets a key. Raises ConfigError, TrimError or
    DesignError."""
    mine = sized(ac, tanker, p)
    law = made(OURS, StationKeepingLaw, p.law, "ctrl.law", ac, tanker, mine, dt_s)  # type: ignore[type-abstract]
    # thrust weights that say what the aircraft has without them are not set
    kg = mine.schedule.mass_kg
    usual, soft = thrust_unit(default.w_input, kg, THRUST_UNIT), thrust_unit(default.soft_input, kg, SOFT_UNIT)
    set_here = replace(p, w_input=mine.w_input, soft_input=mine.soft_input)
    refuse_ignored("ctrl.law", p.law, (*BESIDE, *law.obeys), set_here, replace(default, w_input=usual, soft_input=soft))
    return law
