"""What the wind-shear mission believes of its aircraft, its instruments and the wind; and what guidance asks of control.

Corrected against the print (Jing et al. 2007): R and Q are in feet and degrees; the ninth output is the acceleration along x;
Q_f has three entries, one each for Va, gamma and alpha; (4) divides by Va; (8) holds w_x'. Numbers of the aircraft: its file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from flightsw.aircraft import TwinJet
from flightsw.missions.windshear import dynamics as k
from flightsw.strict import OneOf, Range

Array = np.ndarray
FOOT = 0.3048
DEG = math.pi / 180.0
MODES = ("approach", "climb", "pitch", "open")


def parameter_vector(r: TwinJet, lift_scale: float = 1.0, drag_scale: float = 1.0) -> Array:
    """Vector [NP] of dynamics.py for a record; the scales of lift and drag hold where they are not states."""
    p = np.zeros(k.NP)
    p[k.P_M], p[k.P_S], p[k.P_C], p[k.P_I] = r.mass.kg, r.geometry.S_m2, r.geometry.c_m, r.inertia.Iyy_kgm2
    p[k.P_RHO], p[k.P_G] = r.air.rho_kgpm3, r.air.gravity_mps2
    p[k.P_L0], p[k.P_LA], p[k.P_LE] = r.lift.CL0, r.lift.CL_alpha, r.lift.CL_de
    p[k.P_A1], p[k.P_A2], p[k.P_FALL], p[k.P_FALL_RAD] = (
        r.lift.straight_rad, r.lift.top_rad, r.lift.fall, r.lift.fall_rad,
    )  # fmt: skip
    p[k.P_D0], p[k.P_DK], p[k.P_DS] = r.drag.CD0, r.drag.K, r.drag.beyond
    p[k.P_M0], p[k.P_MA], p[k.P_MQ], p[k.P_ME] = r.pitch.Cm0, r.pitch.Cm_alpha, r.pitch.Cm_q, r.pitch.Cm_de
    p[k.P_TAU], p[k.P_T0], p[k.P_TV], p[k.P_TI] = (
        r.engine.lag_s, r.engine.thrust_N / 1e3, r.engine.lapse_spm, r.engine.idle_frac,
    )  # fmt: skip
    p[k.P_KL], p[k.P_KD] = lift_scale, drag_scale
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


def approach_trim(
    r: TwinJet, V: float, gamma: float, lift_scale: float = 1.0, drag_scale: float = 1.0
) -> tuple[float, float]:
    """Thrust [kN] and elevator [rad] of steady flight at airspeed V [m/s] on the air path gamma [rad], straight part of the
    lift curve; fixed-point iteration."""
    push, weight = 0.5 * r.air.rho_kgpm3 * V * V * r.geometry.S_m2, r.mass.kg * r.air.gravity_mps2
    alpha = elevator = thrust = 0.0
    for _ in range(30):
        lift = (weight * math.cos(gamma) - thrust * math.sin(alpha)) / (lift_scale * push)
        alpha = (lift - r.lift.CL0 - r.lift.CL_de * elevator) / r.lift.CL_alpha
        elevator = -(r.pitch.Cm0 + r.pitch.Cm_alpha * alpha) / r.pitch.Cm_de
        cl = r.lift.CL0 + r.lift.CL_alpha * alpha + r.lift.CL_de * elevator
        drag = drag_scale * push * (r.drag.CD0 + r.drag.K * cl * cl)
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
    """Covariance [states,states] (13 or 15; those of 23: errors.with_errors) of the process noise of one step dt [s]."""
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
