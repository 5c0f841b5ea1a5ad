"""What the gust mission believes of its aircraft and its air: linear matrices and the vector of the nonlinear model.

Longitudinal motion of a small UAV with Dryden turbulence and a vane bias (Hoffmann and Luckner 2010; appendix and equations
(4)-(11)); the aircraft's numbers are those of its file. Corrected against the print: x1 is an auxiliary state, not the rate of
alpha_W.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np

from flightsw.aircraft import Alexis, alexis
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.printed import SEED_SIGMA_U, SEED_SIGMA_W
from flightsw.strict import Range

Array = np.ndarray

F_AC = np.array(
    [[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0], [0.0, 0.0], [0.0, 0.0]]
)  # q, alpha, V_A, Theta, H of alpha_W, V_W


@dataclass(frozen=True)
class GustAircraft:
    """The numbers of an aircraft file in the units of the kernels: forces per mass [m/s^2] per rad, moments per inertia [1/s^2]
    per rad. The nonlinear ones are chosen so that their linearisation at trim is A, B, E [5,5], [5,3], [5,2] (rows q, alpha_K,
    V_K, Theta, H), which are the source's but for the flap column: it has no flap."""

    V0_mps: float
    H0_m: float
    gravity: float
    lift: tuple[float, float, float, float, float]  # trim, alpha, q, elevator, flap
    drag: tuple[float, float, float, float, float]
    thrust: tuple[float, float]  # trim, per unit of throttle setting
    pitch: tuple[float, float, float, float]  # q [1/s], alpha, elevator, flap
    A: tuple[tuple[float, ...], ...]
    B: tuple[tuple[float, ...], ...]
    E: tuple[tuple[float, ...], ...]
    elevator_limit_rad: float
    flap_limit_rad: float
    servo_wn_radps: float
    servo_zeta: float
    elevator_rate_radps: float
    flap_rate_radps: float
    alpha_max_rad: float  # incidence up to which the model is one of this aircraft

    @staticmethod
    def of(ac: Alexis) -> GustAircraft:
        """The numbers of a record."""
        c, t, lift, drag, pitch = ac.controls, ac.trim, ac.lift, ac.drag, ac.pitch
        (_, elevator), (_, flap) = c.elevator_deg, c.flap_deg
        return GustAircraft(
            t.V_mps, t.height_m, t.gravity_mps2,
            (lift.trim, lift.alpha, lift.q, lift.elevator, lift.flap),
            (drag.trim, drag.alpha, drag.q, drag.elevator, drag.flap),
            (ac.thrust.trim, ac.thrust.setting),
            (pitch.q, pitch.alpha, pitch.elevator, pitch.flap),
            ac.linear.A, ac.linear.B, ac.linear.E,
            math.radians(elevator), math.radians(flap), c.servo_wn_radps, c.servo_zeta,
            math.radians(c.elevator_rate_degps), math.radians(c.flap_rate_degps),
            math.radians(ac.limits.alpha_max_deg),
        )  # fmt: skip


@lru_cache(maxsize=1)
def published() -> GustAircraft:
    """The aircraft as published."""
    return GustAircraft.of(alexis())


@dataclass(frozen=True)
class Turbulence:
    """Dryden turbulence as the filter expects it (stationary standard deviations and scale lengths)."""

    L_w_m: Annotated[float, Range(1.0, 5000.0)] = 93.0
    L_u_m: Annotated[float, Range(1.0, 5000.0)] = 100.0
    sigma_w_mps: Annotated[float, Range(0.0, 50.0)] = SEED_SIGMA_W
    sigma_u_mps: Annotated[float, Range(0.0, 50.0)] = SEED_SIGMA_U


@dataclass(frozen=True)
class LinearModel:
    """dx/dt = A x + B u + B_r r, y = C x + D u: A [9,9], B [9,3], Br [9,2], C [7,9], D [7,3]; rows 0..4 as printed."""

    A: Array
    B: Array
    Br: Array
    C: Array
    D: Array


def parameter_vector(ac: GustAircraft, t: Turbulence) -> Array:
    """Vector [NP] of the kernels in flightsw.missions.gust.dynamics."""
    p = np.zeros(k.NP)
    p[k.P_V0], p[k.P_G] = ac.V0_mps, ac.gravity
    p[k.P_WW], p[k.P_WU] = ac.V0_mps / t.L_w_m, ac.V0_mps / t.L_u_m
    p[k.P_L0 : k.P_L0 + 5], p[k.P_D0 : k.P_D0 + 5] = ac.lift, ac.drag
    p[k.P_T0 : k.P_T0 + 2], p[k.P_MQ : k.P_MQ + 4] = ac.thrust, ac.pitch
    return p


def dryden(V0: float, t: Turbulence) -> tuple[Array, Array]:
    """A_Dry [3,3], B_Dry [3,2] of x1, alpha_W, V_W: observer form of F_w, F_u, seed (7)-(9), at speed V0 [m/s].

    Stationary standard deviations are sigma_w / V0 and sigma_u.
    """
    ww, wu, s = V0 / t.L_w_m, V0 / t.L_u_m, t.sigma_w_mps / V0
    A = np.array([[0.0, -ww * ww, 0.0], [1.0, -2.0 * ww, 0.0], [0.0, 0.0, -wu]])
    B = np.array([[s * ww**1.5, 0.0], [s * math.sqrt(3.0 * ww), 0.0], [0.0, t.sigma_u_mps * math.sqrt(2.0 * wu)]])
    return A, B


def linear_model(ac: GustAircraft | None = None, t: Turbulence | None = None, *, E: Array | None = None) -> LinearModel:
    """The aircraft's linear matrices with ground speed and a_z = V0 (q - d alpha_K/dt) appended; seed (10), (11).

    E [5,2] other than the aircraft's serves the study of the printed sign.
    """
    ac, t = ac or published(), t or Turbulence()
    A, B, Br = np.zeros((k.NX, k.NX)), np.zeros((k.NX, k.NU)), np.zeros((k.NX, 2))
    A[k.WIND, k.WIND], Br[k.WIND] = dryden(ac.V0_mps, t)
    A[k.AIRCRAFT, k.FELT], A[k.AIRCRAFT, k.AIRCRAFT], B[k.AIRCRAFT] = ac.E if E is None else E, ac.A, ac.B
    C, D = np.zeros((k.NY, k.NX)), np.zeros((k.NY, k.NU))
    C[k.PRINTED, k.FELT], C[k.PRINTED, k.AIRCRAFT], C[k.Y_ALPHA, k.AB] = F_AC, np.eye(5), 1.0
    C[k.Y_GROUND, k.VK] = 1.0
    C[k.Y_AZ] = -ac.V0_mps * A[k.AK]
    C[k.Y_AZ, k.Q] += ac.V0_mps
    D[k.Y_AZ] = -ac.V0_mps * B[k.AK]
    return LinearModel(A, B, Br, C, D)


@dataclass(frozen=True)
class ProcessNoise:
    """Noise intensities beside the turbulence [unit of the state per sqrt(s)]: what model error the filter allows for."""

    q: float = 1e-2
    alpha_K: float = 1e-3
    V_K: float = 1e-2
    Theta: float = 1e-4
    H: float = 1e-2
    bias: float = math.radians(0.2)

    def intensity(self) -> Array:
        """Diagonal intensity [9,9]; nothing on the wind states."""
        return np.diag(np.square([0.0, 0.0, 0.0, self.q, self.alpha_K, self.V_K, self.Theta, self.H, self.bias]))


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviation per sample of q [rad/s], alpha [rad], V_A [m/s], Theta [rad], H [m], ground speed [m/s], a_z [m/s^2]."""

    q: float = math.radians(0.6)
    alpha: float = math.radians(0.5)
    V_A: float = 0.35
    Theta: float = math.radians(0.2)
    H: float = 1.0
    ground: float = 0.2
    a_z: float = 0.3

    def sigmas(self) -> Array:
        """Vector [7]."""
        return np.array([self.q, self.alpha, self.V_A, self.Theta, self.H, self.ground, self.a_z])
