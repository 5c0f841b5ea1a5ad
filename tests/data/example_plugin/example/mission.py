"""Cruise of a light aircraft: readings -> wind by the triangle -> course, altitude and airspeed held.

20 Hz. MAV_CMD_USER_5, param1: another course [deg].
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from example.law import CruiseLaw, LawParams
from example.wind import TriangleWind, WindParams
from flightsw.aircraft import Aircraft
from flightsw.envelope import Envelope
from flightsw.kernels.rotations import euler_from_dcm, vec3, wrap_pi
from flightsw.missions.base import Mission, MissionSpec, Order, Packets, Reports, report
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.strict import Range
from flightsw.terms import Laws
from flightsw.types import (
    ACCEPTED,
    DENIED,
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    UPD_AIR,
    UPD_GNSS,
    UPD_IMU,
    Command,
    GuidanceCmd,
    Health,
    NavState,
    SensorFrame,
    Text,
)  # fmt: skip

MAV_CMD_USER_5, INIT, CRUISE = 31014, 0, 200  # of dialect.xml


@dataclass(frozen=True)
class CruiseParams:
    """[guid]: what is flown."""

    V_mps: Annotated[float, Range(30.0, 80.0)] = 53.6
    alt_m: Annotated[float, Range(0.0, 5000.0)] = 600.0
    course_deg: Annotated[float, Range(0.0, 360.0)] = 90.0


@dataclass(frozen=True)
class MissionParams:
    """Tables of the flight file."""

    nav: WindParams = field(default_factory=WindParams)
    ctrl: LawParams = field(default_factory=LawParams)
    guid: CruiseParams = field(default_factory=CruiseParams)


@dataclass(slots=True)
class WindState:
    """What EXAMPLE_WIND carries."""

    t_us: int
    wind: tuple[float, float, float]
    sigma: tuple[float, float, float]
    course_error: float
    valid: bool


def wind_values(s: WindState) -> Packets:
    """Fields of EXAMPLE_WIND, in the order of the wire."""
    return _one((s.t_us, *s.wind, *s.sigma, s.course_error, 1 if s.valid else 0))


def _one(row: tuple[float | int | bytes, ...]) -> Iterator[tuple[float | int | bytes, ...]]:
    yield row


class CruiseMission(Mission[ActuatorModel]):
    """Components of the mission and their order."""

    watch = HF_IMU | HF_AIR | HF_ATT | HF_GNSS

    def __init__(self, ac: Aircraft, p: MissionParams, period_s: float) -> None:
        """Raises ConfigError for a speed beyond the aircraft's, TrimError."""
        Envelope(ac).speed("guid.V_mps", p.guid.V_mps)
        self.p, self.air = p.guid, TriangleWind(p.nav)
        self.law = CruiseLaw(ac, p.ctrl, p.guid.V_mps, p.guid.alt_m)
        self.cruise = (p.guid.V_mps, p.guid.alt_m)
        self.course = math.radians(p.guid.course_deg)
        self.guid = GuidanceCmd(V=p.guid.V_mps, alt_m=p.guid.alt_m, reason="settling")
        self.nav = NavState()
        self._e, self._started_us = np.zeros(3), -1
        self._state: WindState | None = None
        self._texts: list[Text] = []

    def step(
        self, f: SensorFrame, act: ActuatorModel, updated: int, health: Health, dt: float
    ) -> tuple[NavState, GuidanceCmd, np.ndarray, float]:
        """See Mission."""
        self.air.step(f, updated & ~health.failed, dt)
        nav, g = self._navigate(f, updated), self.guid
        north, east, _ = nav.vel_n
        error = wrap_pi(math.atan2(east, north) - self.course)
        if nav.valid:
            if self._started_us < 0:
                self._started_us = f.t_us
                self._texts.append(Text(6, "on course"))
            g.phase, g.phase_t_s, g.reason = CRUISE, (f.t_us - self._started_us) * 1e-6, "on course"
            u = self.law.step(nav, self.p.V_mps, self.p.alt_m, error, dt)
        else:
            g.reason = nav.reason
            u = self.law.u
        wind, sigma = vec3(self.air.wind), vec3(self.air.sigma)
        self._state = WindState(f.t_us, wind, sigma, error, self.air.valid)
        return nav, g, u, float(u[3]) / self.law.most

    def _navigate(self, f: SensorFrame, updated: int) -> NavState:
        n, a = self.nav, self.air
        n.t_us, n.valid, n.reason = f.t_us, a.valid, a.reason
        if updated & UPD_GNSS:
            n.pos_n, n.vel_n = f.gnss_pos_n, f.gnss_vel_n
        if updated & UPD_AIR:
            n.V, n.alpha, n.beta = f.air_V[0], f.air_alpha[0], f.air_beta[0]
        if updated & UPD_IMU:
            n.w_b = f.gyro_mean_b
        euler_from_dcm(a.C, self._e)
        n.euler, n.q_nb = vec3(self._e), f.att_q_nb
        n.wind_n, n.wind_sigma, n.wind_valid = vec3(a.wind), vec3(a.sigma), a.valid
        n.pos_sigma, n.att_sigma = (3.0, 3.0, 4.0), (0.02, 0.01, 0.01)
        return n

    @property
    def saturated(self) -> bool:
        """See Mission."""
        return self.law.saturated

    @property
    def laws(self) -> Laws:
        """See Mission."""
        return (self.law.terms,)

    @property
    def reports(self) -> Reports:
        """See Mission."""
        return {} if self._state is None else {WindState: self._state}

    def first_command(self) -> np.ndarray:
        """See Mission."""
        return self.law.trim.u

    def obey(self, c: Command) -> tuple[int, str]:
        """Another course."""
        if not 0.0 <= c.params[0] <= 360.0:
            return DENIED, f"course {c.params[0]:g}: allowed 0 to 360 deg"
        self.course = math.radians(c.params[0])
        self._texts.append(Text(6, f"course {c.params[0]:.0f}"))
        return ACCEPTED, ""

    def texts(self) -> list[Text]:
        """See Mission."""
        out, self._texts = self._texts, []
        return out


SPEC = MissionSpec(
    "example_cruise",
    MissionParams,
    Aircraft,
    "sixdof",
    CruiseMission,
    ActuatorModel,
    phases=(INIT, CRUISE),
    orders=(Order(MAV_CMD_USER_5, "course", frozenset((INIT, CRUISE))),),
    reports=(report("EXAMPLE_WIND", WindState, wind_values, rate_hz=10.0),),
)
