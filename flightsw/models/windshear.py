"""What the wind-shear mission believes of its aircraft, its instruments and the wind; and what guidance asks of control.

Corrected against the print (Jing et al. 2007): R and Q are in feet and degrees; the ninth output is the acceleration along x;
Q_f has three entries, one each for Va, gamma and alpha; (4) divides by Va; (8) holds w_x'. Aircraft: jing.md section 4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from flightsw.kernels import windshear as k
from flightsw.strict import OneOf, Range

Array = np.ndarray
FOOT = 0.3048
DEG = math.pi / 180.0
MODES = ("approach", "climb", "pitch", "open")


@dataclass(frozen=True)
class TwinJetModel:
    """Aircraft as the software knows it. lift_scale and drag_scale are its belief where they are not estimated."""

    mass_kg: Annotated[float, Range(1e4, 1e5)] = 38500.0
    area_m2: Annotated[float, Range(10.0, 500.0)] = 91.04
    chord_m: Annotated[float, Range(0.5, 20.0)] = 3.41
    inertia_kgm2: Annotated[float, Range(1e4, 1e8)] = 1.19e6
    rho_kgpm3: Annotated[float, Range(0.5, 1.5)] = 1.225
    gravity_mps2: Annotated[float, Range(9.7, 9.9)] = 9.81
    lift: tuple[float, float, float] = (0.875, 4.4, 0.2)  # C_L: zero incidence, per rad of alpha, per rad of elevator
    stall_rad: tuple[float, float] = (0.20, 0.23)  # end of the straight part, top of the curve
    drag: tuple[float, float, float] = (
        0.07925,
        0.043,
        1.5,
    )  # C_D: constant, C_L^2, square of alpha beyond the straight part
    pitch: tuple[float, float, float, float] = (0.045, -0.6, -27.0, -1.2)  # C_m: constant, alpha, q c/2V, elevator
    thrust_lag_s: Annotated[float, Range(0.1, 20.0)] = 2.0
    thrust_max_kN: Annotated[float, Range(10.0, 1000.0)] = 107.0  # at rest
    thrust_lapse_spm: Annotated[float, Range(0.0, 0.01)] = 0.002  # [s/m]
    thrust_idle: Annotated[float, Range(0.0, 0.5)] = 0.06  # share of the largest
    lift_scale: Annotated[float, Range(0.5, 2.0)] = 1.0
    drag_scale: Annotated[float, Range(0.5, 2.0)] = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.stall_rad[0] < self.stall_rad[1] < 0.6:
            raise ValueError(f"stall_rad = {self.stall_rad}; allowed: ascending, 0 to 0.6")


def parameter_vector(ac: TwinJetModel) -> Array:
    """Vector [NP] of flightsw.kernels.windshear."""
    p = np.zeros(k.NP)
    p[k.P_M], p[k.P_S], p[k.P_C], p[k.P_I] = ac.mass_kg, ac.area_m2, ac.chord_m, ac.inertia_kgm2
    p[k.P_RHO], p[k.P_G] = ac.rho_kgpm3, ac.gravity_mps2
    p[k.P_L0 : k.P_LE + 1], p[k.P_A1 : k.P_A2 + 1] = ac.lift, ac.stall_rad
    p[k.P_D0 : k.P_DS + 1], p[k.P_M0 : k.P_ME + 1] = ac.drag, ac.pitch
    p[k.P_TAU], p[k.P_T0], p[k.P_TV], p[k.P_TI] = ac.thrust_lag_s, ac.thrust_max_kN, ac.thrust_lapse_spm, ac.thrust_idle
    p[k.P_KL], p[k.P_KD] = ac.lift_scale, ac.drag_scale
    return p


@dataclass(frozen=True)
class WindshearSensors:
    """1-sigma per sample: seed (37) in SI and radians, in the order of the readings."""

    h_m: Annotated[float, Range(1e-6)] = 5.0 * FOOT
    Vg_mps: Annotated[float, Range(1e-6)] = 3.6 * FOOT
    Va_mps: Annotated[float, Range(1e-6)] = 1.7 * FOOT
    alpha_rad: Annotated[float, Range(1e-9)] = 0.5 * DEG
    theta_rad: Annotated[float, Range(1e-9)] = 0.05 * DEG
    q_radps: Annotated[float, Range(1e-9)] = 0.05 * DEG
    climb_mps: Annotated[float, Range(1e-6)] = 0.5 * FOOT
    accel_mps2: Annotated[float, Range(1e-6)] = 0.322 * FOOT  # both accelerations

    def sigmas(self) -> Array:
        """Vector [9]."""
        return np.array(
            [self.h_m, self.Vg_mps, self.Va_mps, self.alpha_rad, self.theta_rad, self.q_radps, self.climb_mps]
            + [self.accel_mps2] * 2
        )


@dataclass(frozen=True)
class WindshearNoise:
    """Process noise as densities per second (variance of the state grows by the square per second).

    fictitious_*: seed (46) as clarified, zero by default. wind: on the second rates of the wind, seed Q_c.
    """

    wind: Annotated[float, Range(0.0)] = 0.1 * FOOT
    x_m: Annotated[float, Range(0.0)] = 1e-3
    h_m: Annotated[float, Range(0.0)] = 1e-3
    q_radps: Annotated[float, Range(0.0)] = 0.02 * DEG
    thrust_kN: Annotated[float, Range(0.0)] = 0.5
    scale: Annotated[float, Range(0.0)] = 1e-3  # lift and drag scale, where they are states
    fictitious_Va: Annotated[float, Range(0.0)] = 0.0
    fictitious_gamma: Annotated[float, Range(0.0)] = 0.0
    fictitious_alpha: Annotated[float, Range(0.0)] = 0.0

    def with_fictitious(self, times: float = 1.0) -> WindshearNoise:
        """The same with Q_f of seed (46), one triple of it, `times` as large in variance."""
        speed, angle = math.sqrt(0.2 * times) * FOOT, math.sqrt(0.05 * times) * DEG
        return replace(self, fictitious_Va=speed, fictitious_gamma=angle, fictitious_alpha=angle)


def approach_trim(ac: TwinJetModel, V: float, gamma: float) -> tuple[float, float]:
    """Thrust [kN] and elevator [rad] of steady flight at airspeed V [m/s] on the air path gamma [rad], straight part of the
    lift curve; fixed-point iteration."""
    push, weight = 0.5 * ac.rho_kgpm3 * V * V * ac.area_m2, ac.mass_kg * ac.gravity_mps2
    alpha = elevator = thrust = 0.0
    for _ in range(30):
        lift = (weight * math.cos(gamma) - thrust * math.sin(alpha)) / (ac.lift_scale * push)
        alpha = (lift - ac.lift[0] - ac.lift[2] * elevator) / ac.lift[1]
        elevator = -(ac.pitch[0] + ac.pitch[1] * alpha) / ac.pitch[3]
        clean = ac.lift[0] + ac.lift[1] * alpha
        drag = ac.drag_scale * push * (ac.drag[0] + ac.drag[1] * clean * clean)
        thrust = (drag + weight * math.sin(gamma)) / math.cos(alpha)
    return thrust * 1e-3, elevator


def triple_integrator(density: float, dt: float) -> Array:
    """Covariance [3,3] that white noise of `density` [per s] on the last of three integrators adds to them in dt [s] (exact)."""
    a = np.array(
        [
            [dt**5 / 20.0, dt**4 / 8.0, dt**3 / 6.0],
            [dt**4 / 8.0, dt**3 / 3.0, dt**2 / 2.0],
            [dt**3 / 6.0, dt**2 / 2.0, dt],
        ]
    )
    return density * a


def process_covariance(n: WindshearNoise, states: int, dt: float) -> Array:
    """Covariance [states,states] (13 or 15) of the process noise of one step dt [s]."""
    Q = np.zeros((k.NX, k.NX))
    for i, s in (
        (k.X, n.x_m), (k.H, n.h_m), (k.VA, n.fictitious_Va), (k.GA, n.fictitious_gamma), (k.AL, n.fictitious_alpha),
        (k.Q, n.q_radps), (k.T, n.thrust_kN), (k.KL, n.scale), (k.KD, n.scale),
    ):  # fmt: skip
        Q[i, i] = s * s * dt
    W = triple_integrator(n.wind * n.wind, dt)
    for at in (k.WX, k.WH):
        rows = slice(at, at + 5, 2)
        Q[rows, rows] = W
    return Q[:states, :states]


@dataclass(frozen=True)
class PathDemand:
    """What guidance asks of control. mode "approach": climb rate and airspeed; "climb": climb rate at full thrust; "pitch": pitch
    at full thrust; "open": full thrust, elevator held. Incidence never above alpha_max_rad."""

    mode: Annotated[str, OneOf(MODES)] = "approach"
    climb_mps: float = 0.0
    speed_mps: float = 75.0
    pitch_rad: float = 0.0
    alpha_max_rad: float = 0.20
