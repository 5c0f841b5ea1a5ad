"""The gust mission's choice of estimator and readings, all behind the `step` of GustNav."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, Protocol

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import BASIC, GROUND, VERTICAL, GustEstimate, GustParams
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.load_watch import LoadWatchParams
from flightsw.missions.gust.model import GustAircraft, ProcessNoise, SensorNoise, Turbulence, linear_model, published
from flightsw.missions.gust.servo_bank.nav import ServoBankNav
from flightsw.missions.gust.servo_bank.params import ServoBankParams
from flightsw.missions.gust.validity import TrustParams
from flightsw.strict import OneOf, Range

Array = np.ndarray
ESTIMATORS = (
    "printed",
    "linear",
    "ekf",
    "ukf",
    "bank",
    "printed_joined",
    "servo_bank",
)  # index goes down in GUST_STATE


@dataclass(frozen=True)
class GustNavTable:
    """[nav] of a gust flight file. `scales` are the bank's turbulence intensities relative to [nav.turbulence], `scale` that of
    a single filter; `trust` says when the hold flies instead."""

    estimator: Annotated[str, OneOf(ESTIMATORS)] = "bank"
    scales: tuple[float, ...] = (0.01, 0.1, 0.3, 1.0)
    scale: Annotated[float, Range(1e-3, 10.0)] = 0.3
    dwell_s: Annotated[float, Range(0.1, 1e4)] = 20.0  # [s] mean stay in one intensity
    ground_speed: bool = True  # GNSS as sixth reading
    accelerometer: bool = True  # vertical specific force as seventh
    turbulence: Turbulence = field(default_factory=Turbulence)
    process: ProcessNoise = field(default_factory=ProcessNoise)
    sensors: SensorNoise = field(default_factory=SensorNoise)
    trust: TrustParams = field(default_factory=TrustParams)
    load_watch: LoadWatchParams = field(default_factory=LoadWatchParams)  # with the bank of servo models
    servo_slack_s: Annotated[float, Range(0.0, 0.1)] = 0.03  # [s] see GustParams; not of the bank of servo models
    servo_bank: ServoBankParams = field(default_factory=ServoBankParams)

    @property
    def channels(self) -> int:
        """Bits of the readings used."""
        return BASIC | (GROUND if self.ground_speed else 0) | (VERTICAL if self.accelerometer else 0)


class Estimator(Protocol):
    """What the mission asks of an estimator."""

    def step(self, y: Array, ok: int, u: Array, dt: float, u_now: Array | None = None) -> GustEstimate:
        """See GustNav.step."""

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore such a copy."""


class PrintedGain:
    """The source's constant gain with the answers of GustNav: no covariance, so sigmas are NaN and NIS is 0 of 0 readings."""

    def __init__(self, ac: GustAircraft, join: bool = False) -> None:
        """join: readings are joined by straight lines instead of held."""
        self.core = ConstantGainGust(model=linear_model(ac), V0_mps=ac.V0_mps, H0_m=ac.H0_m, join=join)
        self._H0 = ac.H0_m
        self._sigma = np.full(k.NX, math.nan)

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        return self.core.get_state()

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state`."""
        self.core.set_state(s)

    def step(self, y: Array, ok: int, u: Array, dt: float, u_now: Array | None = None) -> GustEstimate:
        """One sample, from the first one with all of the five printed readings on."""
        if not self.core.started and ok & BASIC != BASIC:
            return GustEstimate(
                False, "waits for the first readings", np.zeros(k.NX), self._sigma, math.nan, 0, 1.0, ()
            )
        if not self.core.started:  # aircraft as read, wind and bias none
            x0 = np.zeros(k.NX)
            x0[[k.Q, k.AK, k.TH, k.H]] = y[k.Y_Q], y[k.Y_ALPHA], y[k.Y_TH], y[k.Y_H] - self._H0
            self.core.start(x0)
        x = self.core.step(y, ok, u, dt)
        if not np.isfinite(x).all():
            self.core.started = False
            self.core.x[:] = 0.0
            return GustEstimate(False, "estimate not finite", np.zeros(k.NX), self._sigma, math.nan, 0, 1.0, ())
        used = sum(1 << c for c in range(5) if ok >> c & 1 and math.isfinite(y[c]))
        return GustEstimate(True, "", x.copy(), self._sigma, math.nan, 0, 1.0, (), used)


def make_gust_nav(p: GustNavTable, ac: GustAircraft | None = None) -> Estimator:
    """Estimator of a table. Raises ValueError for scales that make no bank."""
    ac = ac or published()
    if p.estimator.startswith("printed"):
        return PrintedGain(ac, join=p.estimator == "printed_joined")
    kind: dict[str, Any] = {"filter": p.estimator, "model": "nonlinear", "scales": (p.scale,)}
    if p.estimator == "linear":
        kind |= {"filter": "kalman", "model": "linear"}
    elif p.estimator in ("bank", "servo_bank"):
        kind |= {"filter": "ekf", "scales": p.scales}
    tuning = GustParams(
        aircraft=ac,
        turbulence=p.turbulence,
        process=p.process,
        sensors=p.sensors,
        dwell_s=p.dwell_s,
        servo_slack_s=p.servo_slack_s,
        **kind,
    )
    return ServoBankNav(tuning, p.servo_bank) if p.estimator == "servo_bank" else GustNav(tuning)
