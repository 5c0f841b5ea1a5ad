"""Tuning of the gust estimators, the readings they take and the estimate they give."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw import plugins
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.model import GustAircraft, ProcessNoise, SensorNoise, Turbulence, published
from flightsw.missions.gust.servo_bank.params import ServosFound
from flightsw.strict import OneOf, Range

Array = np.ndarray
BASIC = 0b0011111  # q, alpha, V_A, Theta, H
GROUND = 1 << k.Y_GROUND
VERTICAL = 1 << k.Y_AZ
SCALES_MOST = 4


@dataclass(frozen=True)
class GustParams:
    """Tuning of GustNav. `scales` are turbulence intensities relative to `turbulence`: one is a single filter, more a bank."""

    filter: Annotated[str, plugins.PartOf(plugins.ESTIMATORS)] = "ekf"
    model: Annotated[str, OneOf(("nonlinear", "linear"))] = "nonlinear"
    aircraft: GustAircraft = field(default_factory=published)
    turbulence: Turbulence = field(default_factory=Turbulence)
    process: ProcessNoise = field(default_factory=ProcessNoise)
    sensors: SensorNoise = field(default_factory=SensorNoise)
    scales: tuple[float, ...] = (0.3,)
    dwell_s: Annotated[float, Range(0.1, 1e4)] = 20.0  # [s] mean stay in one intensity
    mix: bool = True  # interacting bank; False: every filter keeps to itself and the weights forget
    # a surface is where it is believed to within its rate times this [s]
    servo_slack_s: Annotated[float, Range(0.0, 0.1)] = 0.03
    channel_gate: Annotated[float, Range(1.0)] = 6.0  # sigma of its innovation above which one reading is refused
    channels_most: Annotated[int, Range(1, k.NY)] = 2  # out at once; beyond, the filter is in doubt
    refused_max: Annotated[int, Range(1, 10000)] = 25  # samples refused whole in a row before a restart
    start_q_radps: Annotated[float, Range(1e-6, 10.0)] = 0.02  # 1-sigma at the first sample, about the first readings
    start_alpha_rad: Annotated[float, Range(1e-6, 1.0)] = 0.02
    start_V_mps: Annotated[float, Range(1e-6, 50.0)] = 1.0
    start_bias_rad: Annotated[float, Range(1e-9, 1.0)] = math.radians(1.0)

    def __post_init__(self) -> None:
        if not self.scales or not all(math.isfinite(s) and s > 0.0 for s in self.scales):
            raise ValueError(f"scales = {self.scales}; allowed: one or more numbers > 0")
        if len(self.scales) > SCALES_MOST:
            raise ValueError(f"{len(self.scales)} scales; allowed: up to {SCALES_MOST} (what GUST_STATE carries)")
        if list(self.scales) != sorted(self.scales):
            raise ValueError(f"scales = {self.scales}; allowed: ascending (neighbours are neighbours in the bank)")


@dataclass(frozen=True)
class GustEstimate:
    """x [9] and its 1-sigma [9] (dynamics.py), NIS of the step over `channels` readings, intensity relative to the
    expected turbulence and the bank's probabilities; `used`: bits of the readings that corrected, `refused`: how many the gate
    left out. Not valid: x is trim and `reason` says why."""

    valid: bool
    reason: str
    x: Array
    sigma: Array
    nis: float
    channels: int
    scale: float
    probabilities: tuple[float, ...]
    used: int = 0
    refused: int = 0
    servos: ServosFound | None = None  # of a bank of servo models

    @property
    def alpha_W(self) -> float:
        """Incidence taken away by the wind [rad], > 0 in sinking air."""
        return float(self.x[k.AW])

    @property
    def V_W(self) -> float:
        """Tail wind [m/s]."""
        return float(self.x[k.VW])
