"""What the gust mission believes of its aircraft and its air: linear matrices and the vector of the nonlinear model.

The small UAV ALEXIS at 20 m/s and 100 m, longitudinal motion with Dryden turbulence and a vane bias (Hoffmann and Luckner
2010; appendix and equations (4)-(11)). Corrected against the print: E(V_K, alpha_W) is -10.36 (printed +10.36; every entry
of E is minus the aerodynamic entry of A beside it), and x1 is an auxiliary state, not the rate of alpha_W.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.aircraft import Controls
from flightsw.kernels import gust as k
from flightsw.models.gust_print import E_VK_ALPHAW_PRINTED, SEED_SIGMA_U, SEED_SIGMA_W
from flightsw.strict import Range

Array = np.ndarray

# rows q, alpha_K, V_K, Theta, H
A_AC = np.array(
    [
        [-10.5, -50.0, 0.0, 0.0, 0.0],
        [0.9, -11.0, -0.049, 0.0, 0.0],
        [-0.36, 10.37, -0.092, -9.81, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, -20.0, 0.0, 20.0, 0.0],
    ]
)
B_AC = np.array([[-134.0, 0.0, -8.0], [-1.0, 0.0, -4.0], [-0.09, 0.004, -0.3], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
E_AC = np.array([[50.0, 0.0], [11.0, 0.049], [-E_VK_ALPHAW_PRINTED, 0.092], [0.0, 0.0], [0.0, 0.0]])
F_AC = np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0], [0.0, 0.0], [0.0, 0.0]])


@dataclass(frozen=True)
class GustAircraft:
    """The nonlinear model's numbers, chosen so that its linearisation at trim is A_AC, B_AC, E_AC (forces per mass [m/s^2] per
    rad, moments per inertia [1/s^2] per rad). The flap column is an assumption: the source has no flap."""

    V0_mps: Annotated[float, Range(5.0, 100.0)] = 20.0
    H0_m: Annotated[float, Range(-500.0, 5000.0)] = 100.0
    gravity: Annotated[float, Range(9.7, 9.9)] = 9.81
    lift: tuple[float, float, float, float, float] = (9.81, 219.08, 2.0, 20.0, 80.0)  # trim, alpha, q, elevator, flap
    drag: tuple[float, float, float, float, float] = (0.92, -0.56, 0.36, 0.09, 0.3)
    thrust: tuple[float, float] = (0.92, 0.004)  # trim, per unit of throttle setting
    pitch: tuple[float, float, float, float] = (-10.5, -50.0, -134.0, -8.0)  # q [1/s], alpha, elevator, flap
    elevator_limit_rad: Annotated[float, Range(0.0, 1.0)] = math.radians(15.0)
    flap_limit_rad: Annotated[float, Range(0.0, 1.0)] = math.radians(20.0)
    servo_wn_radps: Annotated[float, Range(1.0, 500.0)] = 40.0
    servo_zeta: Annotated[float, Range(0.1, 2.0)] = 0.7
    servo_rate_radps: Annotated[float, Range(0.01, 100.0)] = math.radians(300.0)

    @staticmethod
    def of(c: Controls) -> GustAircraft:
        """The model with travel and servos of an aircraft file. Raises ValueError for what the model cannot hold."""
        return GustAircraft(
            elevator_limit_rad=math.radians(_travel("elevator_deg", c.elevator_deg)),
            flap_limit_rad=math.radians(_travel("flap_deg", c.flap_deg)),
            servo_wn_radps=c.servo_wn_radps,
            servo_zeta=c.servo_zeta,
            servo_rate_radps=math.radians(c.elevator_rate_degps),
        )


def _travel(name: str, pair: tuple[float, float]) -> float:
    if pair[0] != -pair[1]:
        raise ValueError(f"controls.{name} = {list(pair)}; allowed: the same travel up and down")
    return pair[1]


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
    """Vector [NP] of the kernels in flightsw.kernels.gust."""
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


def linear_model(ac: GustAircraft | None = None, t: Turbulence | None = None, *, E: Array = E_AC) -> LinearModel:
    """The printed matrices with flap, ground speed and a_z = V0 (q - d alpha_K/dt) appended; seed (10), (11).

    E [5,2] other than E_AC serves the study of the printed sign. Only speed and turbulence are taken from the arguments:
    the derivatives are the printed ones.
    """
    ac, t = ac or GustAircraft(), t or Turbulence()
    A, B, Br = np.zeros((9, 9)), np.zeros((9, 3)), np.zeros((9, 2))
    A[:3, :3], Br[:3] = dryden(ac.V0_mps, t)
    A[3:8, 1:3], A[3:8, 3:8], B[3:8] = E, A_AC, B_AC
    C, D = np.zeros((7, 9)), np.zeros((7, 3))
    C[:5, 1:3], C[:5, 3:8], C[k.Y_ALPHA, k.AB] = F_AC, np.eye(5), 1.0
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
