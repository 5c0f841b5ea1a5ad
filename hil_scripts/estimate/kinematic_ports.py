"""Parameters, input and output of the wind estimator without an aerodynamic model (`hil_scripts.estimate.kinematic`)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.strict import Range

Pos = Annotated[float, Range(1e-12)]
NonNeg = Annotated[float, Range(0.0)]
Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class KinematicParams:
    """Tuning; process noise per sqrt(s), sensor values 1-sigma per sample. `probe_*` = 0 switches that probe state off."""

    q_wind: NonNeg = 1.2  # [m/s]
    q_force: NonNeg = 7.0  # [m/s^2]
    q_scale: NonNeg = 1e-4  # [-]
    q_offset: NonNeg = 1e-4  # [rad]
    r_V: Pos = 0.07  # [m/s]
    r_beta: Pos = 0.0035  # [rad]
    r_alpha: Pos = 0.0035  # [rad]
    r_vel: Pos = 0.01  # [m/s]
    r_att: NonNeg = 0.001  # [rad] change of the attitude error from sample to sample
    r_rate: NonNeg = 0.02  # [rad/s] body rates, where they stand in for the attitude
    probe_scale: NonNeg = 0.02  # [-] start 1-sigma of the airspeed scale error
    probe_beta: NonNeg = 0.015  # [rad]
    probe_alpha: NonNeg = 0.015  # [rad]
    # [-] of a probe error's prior variance the flight must take away before it is used (scale, beta, alpha); 1: never
    observed_share: Annotated[Vec3, Range(0.0, 1.0)] = (0.5, 0.5, 0.5)
    flow_sigma0: Pos = 0.1  # [rad] start 1-sigma of a flow angle that is not read
    bias_att: NonNeg = 0.005  # [rad] slow attitude error, not a state: added to the reported wind uncertainty
    bias_vel: NonNeg = 0.1  # [m/s] slow velocity error, likewise
    slow_s: Pos = 2.0  # [s] time constant of the slow wind in the probe-error matrix
    force_sigma0: Pos = 20.0  # [m/s^2]
    soft_gate: Pos = 3.0  # [-] innovation over its 1-sigma beyond which a measurement loses weight
    hard_gate: Pos = 6.0  # [-] and beyond which it is refused
    lockout_s: Pos = 0.5  # [s] refused for this long without a break: taken with less weight instead
    max_gap_s: Pos = 1.0  # [s] longer gap between inputs: start again
    min_airspeed: Pos = 3.0  # [m/s] below it the flow angles mean nothing


@dataclass(slots=True)
class KinematicInput:
    """One sample. euler (psi, theta, phi) [rad], w_b [rad/s] body, vel_n [m/s] NED, air (V [m/s], beta, alpha [rad]; one that
    is not a number was not read)."""

    t_us: int = 0
    euler: Vec3 = (0.0, 0.0, 0.0)
    w_b: Vec3 = (0.0, 0.0, 0.0)
    vel_n: Vec3 = (0.0, 0.0, 0.0)
    air: Vec3 = (0.0, 0.0, 0.0)
    att_ok: bool = True
    air_ok: bool = True
    vel_ok: bool = True


@dataclass(slots=True)
class KinematicState:
    """Estimate after a step. wind_sigma includes the slow errors that are no state; P [6,6] of wind and probe errors does not.
    A probe error that is `held` is at its prior: zero, with the start's sigma."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not started"
    air: Vec3 = (0.0, 0.0, 0.0)  # V [m/s], beta, alpha [rad]
    wind_n: Vec3 = (0.0, 0.0, 0.0)  # [m/s]
    wind_sigma: Vec3 = (0.0, 0.0, 0.0)  # [m/s]
    P: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    force_b: Vec3 = (0.0, 0.0, 0.0)  # [m/s^2]
    probe: Vec3 = (0.0, 0.0, 0.0)  # airspeed scale [-], beta, alpha offset [rad]
    probe_sigma: Vec3 = (0.0, 0.0, 0.0)
    probe_shown: Vec3 = (0.0, 0.0, 0.0)  # share of the prior's variance the flight has taken away
    probe_held: tuple[bool, bool, bool] = (True, True, True)  # the flight has not shown it: at its prior
    codes: tuple[int, ...] = ()  # offered this step: 0..2 V, beta, alpha; 3..5 velocity N, E, D
    innovation: np.ndarray = field(default_factory=lambda: np.zeros(6))  # in the order of `codes`, before gating
    innovation_sigma: np.ndarray = field(default_factory=lambda: np.zeros(6))
    whitened: np.ndarray = field(default_factory=lambda: np.zeros(6))  # unit white when the model is right
    log_likelihood: float = 0.0
    softened: int = 0  # measurements that lost weight, this step
    refused: int = 0  # and that were refused
