"""What both control laws share: parameters, command limits, integrators with anti-windup."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.jit import jit
from flightsw.sixdof.actuators import ActuatorModel, surface_limits, thrust_available
from flightsw.sixdof.schedule import GainSchedule, closed, integrated
from flightsw.strict import ConfigError, Range
from flightsw.terms import Controlled, LawTerms, Output, Scheduled

Pos = Annotated[float, Range(1e-9)]
NonNeg = Annotated[float, Range(0.0)]
Node3 = tuple[float, float, float]
Four = tuple[float, float, float, float]


@dataclass(frozen=True)
class ScheduleParams:
    """Nodes and timing of a gain schedule."""

    psi_dot_degps: Node3 = (-1.7, 0.0, 1.7)
    V_mps: tuple[float, float] = (180.0, 200.0)
    h_m: Pos = 7010.0
    mass_kg: NonNeg = 0.0  # 0: that of the aircraft file, empty and its usual fuel
    delay_s: Annotated[float, Range(0.0, 0.25)] = 0.015  # command to actuator, design value


def design_mass(ac: Aircraft, mass_kg: float, key: str) -> float:
    """Mass [kg] a law is designed for: `mass_kg`, or for 0 what the aircraft's file usually starts with.

    Raises ConfigError naming `key` for a mass the aircraft cannot have: a law for 120 t finds a trim of a 40 t aircraft that no
    wing flies at."""
    m = ac.mass
    if mass_kg == 0.0:
        return m.empty_kg + m.default_fuel_kg
    if not m.empty_kg <= mass_kg <= m.max_kg:
        raise ConfigError(
            f"{key} = {mass_kg:g}: allowed for {ac.meta.name}: {m.empty_kg:g} to {m.max_kg:g} kg, or 0 for "
            f"{m.empty_kg + m.default_fuel_kg:g} kg of its file"
        )
    return mass_kg


def thrust_unit(w: Four, mass_kg: float, unit: tuple[float, float]) -> Four:
    """Bryson weights of the inputs, surfaces [rad] and thrust [N], a thrust of 0 replaced by that of unit = (N, kg of the
    aircraft it is right for) in proportion to mass_kg: the same deviation accelerates every aircraft alike."""
    return w if w[3] != 0.0 else (*w[:3], unit[0] * (mass_kg / unit[1]))


def lqr_terms(law: str, controlled: tuple[tuple[str, str], ...], s: ScheduleParams, *more: Scheduled) -> LawTerms:
    """Record of a scheduled law that commands surfaces and thrust; controlled: name and unit of what has an integral."""
    outputs = (*(Output(n, "rad") for n in ("aileron", "elevator", "rudder")), Output("thrust", "N"))
    low, _, high = (math.radians(v) for v in s.psi_dot_degps)
    nodes = (Scheduled("turn_rate", "rad/s", low, high), Scheduled("airspeed", "m/s", *s.V_mps))
    return LawTerms(law, outputs, tuple(Controlled(*c) for c in controlled), (*nodes, *more))


@jit
def cut(u: np.ndarray, lim: np.ndarray, idle: float, full: float, old: np.ndarray) -> int:
    """Command u [4] (surfaces [rad], thrust [N]) <- within lim [3,3] (lower, upper, rate) and idle to full thrust, and the newest
    of the commands old [k,4]. 1 where something was cut, -1 where u is not finite: then all is left as it is."""
    for i in range(4):
        if not math.isfinite(u[i]):
            return -1
    out = 0
    for i in range(4):
        lo, hi = (lim[i, 0], lim[i, 1]) if i < 3 else (idle, full)
        if u[i] < lo:
            u[i], out = lo, 1
        elif u[i] > hi:
            u[i], out = hi, 1
    for k in range(old.shape[0] - 1, 0, -1):
        for i in range(4):
            old[k, i] = old[k - 1, i]
    for i in range(4):
        old[0, i] = u[i]
    return out


class ControlCore:
    """Command assembly: previous command, integrals, saturation. `terms`: what the command is made of."""

    def __init__(self, ac: Aircraft, terms: LawTerms, int_limit: np.ndarray) -> None:
        """terms: with one controlled quantity for each integral. `u_old` [k,4], newest first, is sized by the law once its design
        tells how many old commands it needs."""
        self.ac = ac
        self._lim = surface_limits(ac)
        self.u_old = np.zeros((1, 4))
        self.terms = terms
        self.e = np.zeros(len(terms.controlled))
        self.int_limit = int_limit
        self.saturated = False
        self.started = False
        self._held, self._known = np.zeros(len(self.e)), np.zeros(len(self.e))  # of the integrals

    def integrate(self, err: np.ndarray, dt: float) -> None:
        """Advance the integrals by err [n] * dt, clamped, and held while the command sits at a limit and would wind up."""
        integrated(err, dt, self.saturated, self.int_limit, self.e, self._held, self._known)
        self._tell_integrals(err)

    def close(
        self, s: GainSchedule, at: tuple[float, float], z: np.ndarray, off: np.ndarray, n: int, err: np.ndarray,
        act: ActuatorModel, dt: float,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Command u [4] and its parts [3,4] (arrays reused) of a schedule at turn rate [rad/s] and airspeed [m/s], for n rigid
        entries of the design state z; the others are filled here, the integrals advanced as in `integrate`."""
        closed(
            *at, *s.tables(), z, off, n, act.pos, act.rate, act.thrust, self.u_old, err, dt, self.saturated, self.int_limit,
            self.e, self._held, self._known,
        )  # fmt: skip
        self._tell_integrals(err)
        return s.u, s.parts

    def _tell_integrals(self, err: np.ndarray) -> None:
        rows = (self.terms.controlled, err.tolist(), self.e.tolist(), self._held.tolist(), self._known.tolist())
        for c, off, e, limits, known in zip(*rows, strict=True):
            c.integral, c.limits = e, int(limits)
            if known:
                c.error = off

    def limit(self, u: np.ndarray, h_m: float, V: float, parts: np.ndarray | None = None) -> tuple[np.ndarray, float]:
        """Clip u [4] (surfaces [rad], thrust [N]) to the actuators; returns (u, throttle 0..1). Sets `saturated` and `terms`.

        parts [3,4]: feedback, integral and feed-forward u was made of; None: it is a trim, made of feed-forward alone.
        Throttle is NaN when anything that went in is not finite.
        """
        asked, out = u.tolist(), -1
        if math.isfinite(h_m) and math.isfinite(V):
            avail = thrust_available(self.ac, h_m, V)
            out = cut(u, self._lim, self.ac.engine.idle_frac * avail, avail, self.u_old)
        if out < 0:
            self.terms.open()
            return u, math.nan  # the guard replaces it; the previous command and its memory stay
        self.saturated = out > 0
        self._tell(asked, u.tolist(), parts)
        return u, float(u[3] / avail)

    def _tell(self, asked: list[float], u: list[float], parts: np.ndarray | None) -> None:
        """Into the record what u [4] is made of, that was `asked`; parts as in `limit`."""
        t = self.terms
        if parts is None:
            t.open()
        t.closed = parts is not None
        rows = [[0.0] * 4, [0.0] * 4, asked] if parts is None else parts.tolist()
        for o, feedback, integral, forward, sent in zip(t.outputs, *rows, u, strict=True):
            o.give(feedback, integral, forward, sent)
