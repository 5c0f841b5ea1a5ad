"""Tanker autopilot: gain-scheduled LQR with integral action on airspeed, altitude and turn rate (Lee 2011, section 2.5).

Design state: V, beta, alpha, p, q, r, theta, phi, z, servo position (3), servo rate (3), thrust (1), integrals of V, z
and psi_dot error, previous commands (4 per started period of delay). Heading and horizontal position are left out: they
are not in the cost, and undamped states outside it leave the Riccati equation without a solution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Protocol, runtime_checkable

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.plugins import EVERY_KEY, OursOr, made, refuse_ignored
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.command import (
    ControlCore,
    Four,
    Node3,
    Pos,
    ScheduleParams,
    design_mass,
    lqr_terms,
    thrust_unit,
)
from flightsw.sixdof.layout import X_ALPHA, X_BETA, X_P, X_PHI, X_PSI, X_Q, X_R, X_THETA, X_V, X_Z
from flightsw.sixdof.lqr import ENGINE, OLD, SERVO, SERVO_RATE, Design, augment, design
from flightsw.sixdof.lqr import INTEGRALS as BEHIND
from flightsw.sixdof.schedule import GainSchedule
from flightsw.sixdof.trim import linearise_free, trim_free
from flightsw.terms import LawTerms
from flightsw.types import GuidanceCmd, NavState

# states of the free model that are controlled: what a design vector begins with
KEEP = [X_V, X_BETA, X_ALPHA, X_P, X_Q, X_R, X_THETA, X_PHI, X_Z]
Z_V, Z_BETA, Z_ALPHA, Z_THETA, Z_PHI, Z_ALT = 0, 1, 2, 6, 7, 8  # [m/s] error, [rad], [m] error
N = len(KEEP)
INTEGRALS = slice(N + BEHIND, N + OLD)  # of the design state
THRUST_UNIT = (2.0e4, 119e3)  # [N] of the KC-135R at [kg]
CONTROLLED = (("airspeed", "m/s"), ("altitude", "m"), ("turn_rate", "rad/s"))


@dataclass(frozen=True)
class TankerCtrlParams:
    """Bryson weights: the size of each deviation that counts as one unit."""

    schedule: ScheduleParams
    w_air: Node3 = (1.0, 0.03, 0.05)  # V [m/s], beta, alpha [rad]
    w_rate_radps: Node3 = (0.05, 0.05, 0.05)
    w_att_rad: tuple[float, float] = (0.05, 0.1)  # theta, phi
    w_alt_m: Pos = 5.0
    w_int: Node3 = (10.0, 30.0, 0.03)  # V [m], z [m s], psi [rad]
    w_input: Four = (0.1, 0.1, 0.1, 0.0)  # thrust [N]; 0: in proportion to the weight
    int_limit: Node3 = (100.0, 300.0, 0.5)
    law: Annotated[str, OursOr(("autopilot",))] = (
        "autopilot"  # an AutopilotLaw, made from (aircraft, this table, period)
    )


def sized(ac: Aircraft, p: TankerCtrlParams, table: str = "ctrl") -> TankerCtrlParams:
    """`p` with what it leaves to the aircraft filled in: mass, thrust. Raises ConfigError for a mass it cannot have."""
    mass = design_mass(ac, p.schedule.mass_kg, f"{table}.schedule.mass_kg")
    return replace(p, schedule=replace(p.schedule, mass_kg=mass), w_input=thrust_unit(p.w_input, mass, THRUST_UNIT))


@runtime_checkable
class AutopilotLaw(Protocol):
    """What flies an aircraft by airspeed, altitude and turn rate. A pure step, as all algorithms."""

    @property
    def obeys(self) -> tuple[str, ...]:
        """Keys of the table it reads, EVERY_KEY all; any other is refused unless it is as by default."""

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""

    def step(self, nav: NavState, cmd: GuidanceCmd, act: ActuatorModel, dt: float) -> tuple[np.ndarray, float]:
        """Command (surfaces [rad] and thrust [N] [4], throttle 0..1) towards cmd.V, cmd.alt_m, cmd.psi_dot, dt [s] later."""

    def trim_command(self, V: float, h_m: float) -> tuple[np.ndarray, float]:
        """The same for straight flight at V [m/s], h_m [m], before navigation is valid."""


class TankerControl:
    """Flies commanded airspeed, altitude and turn rate."""

    obeys = EVERY_KEY

    def __init__(self, ac: Aircraft, p: TankerCtrlParams, dt_s: float) -> None:
        """Designs the six nominal laws for control period dt_s. Raises ConfigError, TrimError or DesignError."""
        self.p = p = sized(ac, p)
        s = p.schedule
        self.core = ControlCore(ac, lqr_terms("autopilot", CONTROLLED, s), np.array(p.int_limit))
        self.nodes = tuple(float(np.radians(v)) for v in s.psi_dot_degps)
        designs = [self._design(ac, yd, V, dt_s) for yd in self.nodes for V in s.V_mps]
        self.sched = GainSchedule(designs, self.nodes, s.V_mps)
        self.z, self.off = np.zeros(self.sched.nz), np.zeros(self.sched.nz)
        self.core.u_old = np.zeros(((self.sched.nz - N - OLD) // 4, 4))
        self._err = np.zeros(3)

    def _design(self, ac: Aircraft, yd: float, V: float, dt_s: float) -> Design:
        p, s = self.p, self.p.schedule
        t = trim_free(ac, s.mass_kg, s.h_m, V, yd)
        A, B = linearise_free(ac, s.mass_kg, t)
        Ak, Bk = A[np.ix_(KEEP, KEEP)], B[KEEP]
        C = np.zeros((3, N))
        C[0, Z_V] = 1.0
        C[1, Z_ALT] = 1.0
        C[2] = A[X_PSI, KEEP]  # psi_dot
        Aa, Ba = augment(Ak, Bk, C, np.zeros((3, 4)), ac)
        scale = [*p.w_air, *p.w_rate_radps, *p.w_att_rad, p.w_alt_m, *[1e3] * 6, 1e6, *p.w_int]
        z0 = np.zeros(len(scale))
        z0[:N] = t.x[KEEP]
        z0[Z_V] = z0[Z_ALT] = 0.0  # airspeed and altitude enter as errors to the command
        z0[N + SERVO : N + SERVO_RATE], z0[N + ENGINE] = t.u[:3], t.u[3]
        r = 1.0 / np.square(p.w_input)
        return design(
            Aa, Ba, dt_s, s.delay_s, 1.0 / np.square(scale), r, z0, t.u, f"tanker at {V:g} m/s, {yd:.4f} rad/s"
        )

    def step(self, nav: NavState, cmd: GuidanceCmd, act: ActuatorModel, dt: float) -> tuple[np.ndarray, float]:
        """Command (u [4], throttle) towards cmd.V [m/s], cmd.alt_m [m], cmd.psi_dot [rad/s]."""
        c, z = self.core, self.z
        c.terms.stand(cmd.psi_dot, cmd.V)
        if not c.started:
            c.u_old[:] = act.pos[0], act.pos[1], act.pos[2], act.thrust
            c.started = True
        _, theta, phi = nav.euler
        h = -nav.pos_n[2]
        psi_dot = (nav.w_b[1] * math.sin(phi) + nav.w_b[2] * math.cos(phi)) / math.cos(theta)
        faster, higher = nav.V - cmd.V, cmd.alt_m - h
        self._err[:] = faster, higher, psi_dot - cmd.psi_dot
        z[:N] = faster, nav.beta, nav.alpha, *nav.w_b, theta, phi, higher  # as KEEP has them
        u, parts = c.close(self.sched, (cmd.psi_dot, cmd.V), z, self.off, N, self._err, act, dt)
        return c.limit(u, h, nav.V, parts)

    def _schedule(self, psi_dot: float, V: float) -> None:
        self.sched.set_condition(psi_dot, V)
        self.core.terms.stand(psi_dot, V)

    @property
    def saturated(self) -> bool:
        """Whether a command sits at its limit."""
        return self.core.saturated

    @property
    def terms(self) -> LawTerms:
        """What the last command is made of."""
        return self.core.terms

    def trim_command(self, V: float, h_m: float) -> tuple[np.ndarray, float]:
        """Open-loop trim for straight flight while navigation is not yet valid."""
        self._schedule(0.0, V)
        return self.core.limit(self.sched.trim_command(), h_m, V)


OURS = {"autopilot": TankerControl}


def make_autopilot(
    ac: Aircraft, p: TankerCtrlParams, dt_s: float, table: str, default: TankerCtrlParams
) -> AutopilotLaw:
    """The law p.law names, for control period dt_s; table: name of the TOML table p is, default: what it is where nobody sets a
    key. Raises ConfigError, TrimError or DesignError."""
    place = f"{table}.law"
    mine = sized(ac, p, table)
    law = made(OURS, AutopilotLaw, p.law, place, ac, mine, dt_s)  # type: ignore[type-abstract]
    # a thrust weight that says what the aircraft has without it is not set
    usual = thrust_unit(default.w_input, mine.schedule.mass_kg, THRUST_UNIT)
    refuse_ignored(place, p.law, law.obeys, replace(p, w_input=mine.w_input), replace(default, w_input=usual))
    return law
