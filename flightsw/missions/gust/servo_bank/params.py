"""Tuning of the bank of servo models, and what it found."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from flightsw.missions.gust.servo_bank.vane import VaneJumpParams
from flightsw.strict import Range

AGE_MAX = 10  # [samples] from a command to its servo, of the oldest model
MODELS_MAX = 32


@dataclass(frozen=True)
class ServoBankParams:
    """[nav.servo_bank]. Every bandwidth comes with every delay; a delay counts beyond that of the link."""

    wn_radps: tuple[float, ...] = (20.0, 28.0, 40.0, 56.0, 80.0)  # of elevator and flap servos alike
    extra_samples: tuple[int, ...] = (0, 1, 2)
    forget_s: Annotated[float, Range(0.5, 1e3)] = 8.0  # memory of the log-likelihoods
    lead: Annotated[float, Range(0.0, 100.0)] = 4.0  # log-likelihood by which another model must lead to take over
    wait_s: Annotated[float, Range(0.0, 60.0)] = 3.0  # [s] of readings before what was found is steered by
    # [s] bandwidth's and delay's lag together above which the hold flies: the law then gains too little and shakes more
    lag_most_s: Annotated[float, Range(0.0, 10.0)] = 0.095
    lift_start: Annotated[float, Range(1e-6, 1.0)] = 0.1  # 1-sigma of the lift scale at the start
    lift_walk: Annotated[float, Range(0.0, 1.0)] = 1e-2  # [1/sqrt(s)]
    lift_designs: tuple[float, ...] = (
        -0.25,
        -0.125,
        0.0,
        0.125,
        0.25,
    )  # lift scales less one that have a gain of their own
    V_bias_start_mps: Annotated[float, Range(1e-6, 20.0)] = 1.5  # of the airspeed sensor
    V_bias_walk: Annotated[float, Range(0.0, 10.0)] = 0.2  # [m/s/sqrt(s)]; 0.02 takes half a flight to follow a step
    vane: VaneJumpParams = field(default_factory=VaneJumpParams)
    # [s] see GustParams; above 0 R depends on the model's own surface rate, and the likelihood then prefers slow servos
    servo_slack_s: Annotated[float, Range(0.0, 0.1)] = 0.0

    def __post_init__(self) -> None:
        """Raises ValueError for no model, too many, or numbers that make none."""
        if not self.wn_radps or not all(math.isfinite(w) and 1.0 <= w <= 500.0 for w in self.wn_radps):
            raise ValueError(f"wn_radps = {self.wn_radps}; allowed: one or more numbers from 1 to 500")
        if not self.extra_samples or not all(0 <= e <= AGE_MAX for e in self.extra_samples):
            raise ValueError(f"extra_samples = {self.extra_samples}; allowed: one or more whole numbers 0 to {AGE_MAX}")
        if list(self.wn_radps) != sorted(set(self.wn_radps)) or list(self.extra_samples) != sorted(
            set(self.extra_samples)
        ):
            raise ValueError(
                f"wn_radps = {self.wn_radps}, extra_samples = {self.extra_samples}; allowed: ascending, each once"
            )
        if list(self.lift_designs) != sorted(set(self.lift_designs)) or not all(
            abs(x) <= 0.5 for x in self.lift_designs
        ):
            raise ValueError(f"lift_designs = {self.lift_designs}; allowed: ascending numbers from -0.5 to 0.5")
        if 0.0 not in self.lift_designs:
            raise ValueError(f"lift_designs = {self.lift_designs}; allowed: with 0, the aircraft file's own")
        if len(self.wn_radps) * len(self.extra_samples) > MODELS_MAX:
            raise ValueError(
                f"{len(self.wn_radps)} bandwidths x {len(self.extra_samples)} delays; allowed: up to {MODELS_MAX} models"
            )

    @property
    def models(self) -> tuple[tuple[float, int], ...]:
        """(bandwidth [rad/s], samples beyond the link's) of every model."""
        return tuple((w, e) for e in self.extra_samples for w in self.wn_radps)


@dataclass(frozen=True)
class ServosFound:
    """Servo model believed: bandwidth [rad/s], samples from a command to its servo, log-likelihood by which it leads the next
    best, whether that has been looked at for long enough; lift scale less one and airspeed bias [m/s] with their 1-sigma;
    log-likelihood by which the models that lag by more than lag_most_s lead the others."""

    wn_radps: float
    late: int
    lead: float
    settled: bool
    lift: float
    lift_sigma: float
    V_bias: float
    V_bias_sigma: float
    slow_by: float
