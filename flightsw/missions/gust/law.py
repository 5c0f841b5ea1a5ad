"""Gust load alleviation: state feedback on the estimated motion and wind with flap and elevator; and a plain hold.

The regulator's model holds aircraft, Dryden wind, both servos, the delay of the command and a low-pass of a_z, so that the gain
asks of the surfaces what they can do in time. The wind states cannot be controlled; their columns are the feed-forward.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated

import numpy as np

from flightsw.kernels.sampled import sampled
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.model import GustAircraft, LinearModel, Turbulence, published
from flightsw.missions.gust.servo_bank.scaled import scaled_model
from flightsw.missions.gust.servos import Servos
from flightsw.sixdof.lqr import regulator
from flightsw.strict import IN_FLIGHT, Range
from flightsw.terms import Controlled, LawTerms, Output

Array = np.ndarray
NA = 8  # aircraft and wind states of the design: all but the vane's bias
POS_E, RATE_E, POS_F, RATE_F, LOW, LOW_DOT, NZ = NA, NA + 1, NA + 2, NA + 3, NA + 4, NA + 5, NA + 6
SURFACES = (k.ELEVATOR, k.FLAP)
DESIGNS = 1024  # kept; an aircraft with its servos and lifts in doubt has 75 of each law
LIFT_EDGE = 0.03  # by which another design must be nearer than the one flown
WIND = slice(0, 3)  # of the design state: x1, alpha_W, V_W


@dataclass(frozen=True)
class AlleviationParams:
    """Weights: each is the size at which a quantity costs as much as the others at theirs."""

    low_pass_hz: Annotated[float, Range(0.1, 20.0)] = 3.0
    speed: Annotated[float, Range(0.0, 500.0)] = 25.0  # [s/m] throttle setting per airspeed deviation
    throttle_limit: Annotated[float, Range(0.0, 1000.0)] = 100.0  # [-] either way from trim
    a_z: Annotated[float, Range(1e-3, 1e3)] = 1.0  # [m/s^2]
    a_z_low: Annotated[float, Range(1e-3, 1e3)] = 0.5  # [m/s^2] after the low-pass
    Theta: Annotated[float, Range(1e-4, 1e3)] = 0.1  # [rad]
    H: Annotated[float, Range(1e-3, 1e4)] = 5.0  # [m]
    V_K: Annotated[float, Range(1e-3, 1e4)] = 10.0  # [m/s]
    elevator: Annotated[float, Range(1e-4, 100.0)] = 0.2  # [rad] command
    flap: Annotated[float, Range(1e-4, 100.0)] = 0.3
    use_flap: bool = True
    feed_wind: bool = True  # False zeroes the wind columns and keeps the rest: a trap, for study
    wind_triangle: bool = True  # see `equivalent`; False only against a linear plant
    late_steps: Annotated[int, Range(0, 5)] = 1  # samples between computing a command and its reaching the servo


@dataclass(frozen=True)
class HoldParams:
    """Pitch and height hold from measurements."""

    q: Annotated[float, Range(0.0, 5.0), IN_FLIGHT] = 0.03  # [s]
    Theta: Annotated[float, Range(0.0, 20.0), IN_FLIGHT] = 0.4  # [-]
    H: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = 0.008  # [rad/m]
    limit_rad: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = math.radians(10.0)  # of the pitch asked for
    speed: Annotated[float, Range(0.0, 500.0), IN_FLIGHT] = 25.0  # [s/m] throttle setting per airspeed deviation
    throttle_limit: Annotated[float, Range(0.0, 1000.0), IN_FLIGHT] = 100.0  # [-] either way from trim


def plant_matrices(model: LinearModel, ac: GustAircraft, low_pass_hz: float) -> tuple[Array, Array, Array]:
    """A [14,14], B [14,2] of the design state (x1 .. H, elevator and flap position and rate, low-passed a_z and its rate) with
    the two servo commands as input, and the row of a_z [14]."""
    A, B = np.zeros((NZ, NZ)), np.zeros((NZ, 2))
    A[:NA, :NA] = model.A[:NA, :NA]
    wn, z = ac.servo_wn_radps, ac.servo_zeta
    row = np.zeros(NZ)
    row[:NA] = model.C[k.Y_AZ, :NA]
    for j, (c, at) in enumerate(zip(SURFACES, (POS_E, POS_F), strict=True)):
        A[:NA, at] = model.B[:NA, c]
        A[at, at + 1] = 1.0
        A[at + 1, at], A[at + 1, at + 1] = -wn * wn, -2.0 * z * wn
        B[at + 1, j] = wn * wn
        row[at] = model.D[k.Y_AZ, c]
    w = 2.0 * math.pi * low_pass_hz
    A[LOW, LOW_DOT] = 1.0
    A[LOW_DOT] = w * w * row
    A[LOW_DOT, LOW] -= w * w
    A[LOW_DOT, LOW_DOT] -= math.sqrt(2.0) * w
    return A, B, row


def alleviation_gain(p: AlleviationParams, model: LinearModel, ac: GustAircraft, dt: float) -> tuple[Array, float]:
    """Gain K [2, 14 + 2 late_steps] on (design state, commands under way, oldest first) and the closed loop's spectral radius.

    The cost is the integral of the weighted squares over each step, not their sample at its ends. Raises DesignError.
    """
    A, B, row = plant_matrices(model, ac, p.low_pass_hz)
    Q = np.outer(row, row) / p.a_z**2
    for i, size in ((LOW, p.a_z_low), (k.TH, p.Theta), (k.H, p.H), (k.VK, p.V_K)):
        Q[i, i] += 1.0 / size**2
    n, late = NZ, p.late_steps
    M, big = np.zeros((n + 2, n + 2)), np.zeros((n + 2, n + 2))
    M[:n, :n], M[:n, n:], big[:n, :n] = A, B, Q
    FT, _, cost = sampled(M.T, None, big, dt)
    F, size = FT.T, n + 2 * late
    Ad, Bd = np.zeros((size, size)), np.zeros((size, 2))
    Ad[:n, :n] = F[:n, :n]
    Qd, S = np.zeros((size, size)), np.zeros((size, 2))
    R = np.diag([1.0 / p.elevator**2, (1.0 / p.flap if p.use_flap else 1e4) ** 2]) * dt
    if late:
        Ad[:n, n : n + 2] = F[:n, n:]
        for i in range(1, late):
            Ad[n + 2 * i - 2 : n + 2 * i, n + 2 * i : n + 2 * i + 2] = np.eye(2)
        Bd[size - 2 :] = np.eye(2)
        Qd[: n + 2, : n + 2] = cost
    else:
        Bd[:n] = F[:n, n:]
        Qd[:n, :n], S[:n], R = cost[:n, :n], cost[:n, n:], R + cost[n:, n:]
    Qd += 1e-9 * np.eye(size)
    return regulator(Ad, Bd, Qd, R, S, "gust alleviation")


@lru_cache(DESIGNS)
def _designed(p: AlleviationParams, ac: GustAircraft, t: Turbulence, lift: float, dt: float) -> tuple[Array, float]:
    """`alleviation_gain` for a scale of lift, once in a process: aircraft alike and the runs of a campaign ask for the same.
    The gain is not to be written to."""
    K, radius = alleviation_gain(p, scaled_model(ac, t, lift), ac, dt)
    K.flags.writeable = False
    return K, radius


def equivalent(x: Array, V0: float, z: Array) -> None:
    """z [>=8] <- the deviations that give the linear model the incidence and lift the nonlinear wind triangle has at x [9].

    Lift at airspeed V_A is held by flap and incidence when they make up 1/Q - 1 of the weight, Q = (V_A/V0)^2: to first order
    -2 dV/V0, so the speed is entered as dV = V0/2 (1 - 1/Q). The wind's incidence is the angle it truly turns the air
    stream by. Without this the flap sinks the aircraft by the mean square of its speed error.
    """
    V, gamma = V0 + x[k.VK], x[k.TH] - x[k.AK]
    up, forward = V * math.sin(gamma) + V0 * x[k.AW], V * math.cos(gamma) - x[k.VW]
    VA = max(math.hypot(up, forward), 0.5 * V0)
    z[:NA] = x[:NA]
    z[k.X1] = x[k.X1] * V0 / VA
    z[k.AW] = math.atan2(up, forward) - gamma
    z[k.VK] = x[k.VW] + 0.5 * V0 * (1.0 - (V0 / VA) ** 2)


class GustAlleviation:
    """Commands for flap and elevator from the estimate; `step` once per sample, then send the result to GustServos."""

    def __init__(
        self, p: AlleviationParams | None = None, ac: GustAircraft | None = None, t: Turbulence | None = None,
        dt: float = 0.02, law: str = "alleviation", servos: Sequence[tuple[float, int]] = (),
        lifts: Sequence[float] = (0.0,),
    ) -> None:  # fmt: skip
        """dt [s]: sample period the gain is made for; law: its name in the record; servos: (bandwidth [rad/s], samples late) and
        lifts: scales of lift less one, ascending, that `fit` may ask for. Raises DesignError without a stabilising gain."""
        self.p, self.ac = p or AlleviationParams(), ac or published()
        t = t or Turbulence()
        own = self.ac.servo_wn_radps, self.p.late_steps, 0.0
        self._lifts = lifts
        wanted = {own: None, **{(wn, late, lift): None for wn, late in servos for lift in lifts}}
        designs, rows = {}, {}
        for wn, late, lift in wanted:
            q, a = replace(self.p, late_steps=late), replace(self.ac, servo_wn_radps=wn)
            K, radius = _designed(q, a, t, lift, dt)
            if not self.p.feed_wind:
                K = K.copy()
                K[:, WIND] = 0.0
            designs[wn, late, lift] = K, radius
            if lift not in rows:
                A, _, rows[lift] = plant_matrices(scaled_model(self.ac, t, lift), self.ac, self.p.low_pass_hz)
        self._gains, self._rows = {servo: K for servo, (K, _) in designs.items()}, rows
        self.K, self.radius = designs[own]
        self.late, self.lift, self._row = self.p.late_steps, 0.0, rows[0.0]
        i = slice(LOW, NZ)
        self._low_F, _, _ = sampled(A[i, i], None, None, dt)
        # input held at the mean of two samples: steady gain one
        self._low_G = (np.eye(2) - self._low_F)[:, 0]
        self._low = np.zeros(2)
        self._last = 0.0
        self._z = np.zeros(NZ + 2 * self.p.late_steps)
        self.command = np.zeros(3)
        self.a_z = 0.0  # [m/s^2] as the estimate has it
        outputs = (Output("elevator", "rad"), Output("flap", "rad"), Output("throttle", ""))
        controlled = (("load", "m/s^2"), ("pitch", "rad"), ("altitude", "m"), ("airspeed", "m/s"))
        self.terms = LawTerms(law, outputs, tuple(Controlled(*c) for c in controlled))

    def fit(self, wn_radps: float, late: int, lift: float) -> None:
        """Fly the gain of these servos and of the design nearest to a lift scale, less one, from the next step on. Raises
        KeyError for servos not named to the constructor."""
        near = min(self._lifts, key=lambda x: abs(x - lift))
        if abs(near - lift) + LIFT_EDGE > abs(self.lift - lift) and self.lift in self._lifts:
            near = self.lift
        K = self._gains[wn_radps, late, near]
        if K is not self.K:
            self.K, self.late, self.lift, self._row = K, late, near, self._rows[near]
            self._z = np.zeros(NZ + 2 * late)

    def reset(self) -> None:
        """Low-pass and commands at trim."""
        self._low[:] = 0.0
        self.command[:] = 0.0
        self._last = self.a_z = 0.0

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        return {"low": self._low.copy(), "command": self.command.copy(), "head": np.array([self._last, self.a_z])}

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state`."""
        self._low[:], self.command[:] = s["low"], s["command"]
        self._last, self.a_z = s["head"].tolist()

    def step(self, x: Array, servos: Servos) -> Array:
        """Command [3] (elevator [rad], throttle setting, flap [rad]) for the estimate x [9] and the servos as they now are.

        Limited to the travel; the returned array is reused. An x that is not finite gives trim.
        """
        if not np.isfinite(x).all():
            self.reset()
            self.terms.open()
            return self.command
        z = self._z
        z[:NA] = x[:NA]
        if self.p.wind_triangle:
            equivalent(x, self.ac.V0_mps, z)
        z[POS_E], z[RATE_E] = servos.now[k.ELEVATOR], servos.rate[k.ELEVATOR]
        z[POS_F], z[RATE_F] = servos.now[k.FLAP], servos.rate[k.FLAP]
        self.a_z = float(np.sum(self._row * z[:NZ]))
        drive = 0.5 * (self.a_z + self._last)
        a, b = self._low.tolist()
        for i, (of_a, of_b) in enumerate(self._low_F):
            self._low[i] = of_a * a + of_b * b + self._low_G[i] * drive
        self._last = self.a_z
        z[LOW:NZ] = self._low
        queue = servos.queue
        for i in range(self.late):
            z[NZ + 2 * i], z[NZ + 2 * i + 1] = queue[i, k.ELEVATOR], queue[i, k.FLAP]
        limit = (self.ac.elevator_limit_rad, self.ac.flap_limit_rad)
        for j, c in enumerate(SURFACES):
            u = -float(np.sum(self.K[j] * z))
            self.command[c] = min(max(u, -limit[j]), limit[j])
        if not self.p.use_flap:
            self.command[k.FLAP] = 0.0
        top = self.p.throttle_limit
        self.command[k.THROTTLE] = min(max(-self.p.speed * float(x[k.VK] - x[k.VW]), -top), top)
        self._tell(x)
        return self.command

    def _tell(self, x: Array) -> None:
        """Into the record what the command is made of: the wind's columns are the feed-forward."""
        t, z = self.terms, self._z
        for o, (j, c) in zip(t.outputs, enumerate(SURFACES), strict=False):
            wind = -float(np.sum(self.K[j, WIND] * z[WIND]))
            o.give(-float(np.sum(self.K[j, WIND.stop :] * z[WIND.stop :])), 0.0, wind, float(self.command[c]))
        slow = float(x[k.VK] - x[k.VW])
        *_, throttle = t.outputs
        throttle.give(-self.p.speed * slow, 0.0, 0.0, float(self.command[k.THROTTLE]))
        for q, error in zip(t.controlled, (self.a_z, float(x[k.TH]), float(x[k.H]), slow), strict=True):
            q.error = error
        t.closed = True


class GustHold:
    """Pitch and height hold from pitch rate, pitch and height deviations: the comparison, and what flies without an estimate."""

    def __init__(self, p: HoldParams | None = None, ac: GustAircraft | None = None) -> None:
        self.p, self.ac = p or HoldParams(), ac or published()
        self.command = np.zeros(3)
        outputs = (Output("elevator", "rad"), Output("throttle", ""), Output("pitch", "rad"))
        controlled = (("pitch", "rad"), ("altitude", "m"), ("airspeed", "m/s"))
        self.terms = LawTerms("hold", outputs, tuple(Controlled(*c) for c in controlled))

    def step(self, q: float, Theta: float, dH: float, dV: float = 0.0) -> Array:
        """Command [3] for pitch rate [rad/s], pitch [rad], height [m] and airspeed [m/s], deviations from trim (array reused).

        A deviation that is not finite is taken for none: without height it holds the pitch.
        """
        q, Theta, dH, dV = (v if math.isfinite(v) else 0.0 for v in (q, Theta, dH, dV))
        p, e = self.p, self.ac.elevator_limit_rad
        ask = min(max(-p.H * dH, -p.limit_rad), p.limit_rad)
        u = p.q * q + p.Theta * (Theta - ask)
        self.command[k.ELEVATOR] = min(max(u, -e), e)
        t, top = -p.speed * dV, p.throttle_limit
        self.command[k.THROTTLE] = min(max(t, -top), top)
        elevator, throttle, pitch = self.terms.outputs
        elevator.give(u, 0.0, 0.0, float(self.command[k.ELEVATOR]))
        throttle.give(t, 0.0, 0.0, float(self.command[k.THROTTLE]))
        pitch.give(-p.H * dH, 0.0, 0.0, ask)
        for c, error in zip(self.terms.controlled, (Theta - ask, dH, dV), strict=True):
            c.error = error
        self.terms.closed = True
        return self.command
