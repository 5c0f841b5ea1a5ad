"""A random upset: attitude uniform over all rotations, rates, airspeed, and a flow that fits load factor and airspeed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flightsw.aircraft import Aircraft
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.layout import G0
from sim_plant.kernels.rot import euler_from_quat

RATE_DEGPS = 30.0  # about each axis, either way
SPEED = (0.8, 1.1)  # [-] of the airspeed of the trim, within the limits of the aircraft's file
BETA_DEG = 5.0
V3 = tuple[float, float, float]


@dataclass(frozen=True)
class Drawn:
    """Keys of `start.upset`."""

    attitude_deg: V3
    rates_degps: V3
    V_mps: float
    alpha_deg: float
    beta_deg: float

    def settings(self, aircraft: str) -> tuple[str, ...]:
        """Of the scenario."""
        at = f"plant.aircraft.{aircraft}.start.upset"
        return (
            f"{at}.attitude_deg={list(self.attitude_deg)}", f"{at}.rates_degps={list(self.rates_degps)}",
            f"{at}.V_mps={self.V_mps}", f"{at}.alpha_deg={self.alpha_deg}", f"{at}.beta_deg={self.beta_deg}",
        )  # fmt: skip


def rotation(u: np.ndarray) -> tuple[float, float, float, float]:
    """Unit quaternion, uniform over all rotations for u [3] uniform in 0..1 (Shoemake 1992)."""
    a, b = math.sqrt(1.0 - u[0]), math.sqrt(u[0])
    s, t = 2.0 * math.pi * u[1], 2.0 * math.pi * u[2]
    return b * math.cos(t), a * math.sin(s), a * math.cos(s), b * math.sin(t)


def draw(ac: Aircraft, V_mps: float, h_m: float, load_g: tuple[float, float], stalled: bool, seed: int) -> Drawn:
    """The upset of a seed, of an aircraft trimmed at V_mps and h_m. load_g: range of the lift over the weight it starts with;
    stalled: instead deep in the stall, at 1 to 2 times the file's largest incidence and the lowest airspeed."""
    rng = np.random.default_rng(seed)
    psi, theta, phi = (math.degrees(x) for x in euler_from_quat(*rotation(rng.uniform(size=3))))
    p, q, r = rng.uniform(-RATE_DEGPS, RATE_DEGPS, 3)
    lo, hi = max(SPEED[0] * V_mps, ac.limits.V_min_mps), min(SPEED[1] * V_mps, ac.limits.V_max_mps)
    V, load, beta = rng.uniform(lo, hi), rng.uniform(*load_g), rng.uniform(-BETA_DEG, BETA_DEG)
    if stalled:
        V, alpha = lo, ac.limits.alpha_max_deg * rng.uniform(1.0, 2.0)
    else:
        mass = ac.mass.empty_kg + ac.mass.default_fuel_kg
        lift = load * mass * G0 / (0.5 * isa(h_m)[2] * V * V * ac.geometry.S_m2)
        alpha = math.degrees((lift - ac.aero.CL0) / ac.aero.CL_alpha)
    return Drawn((psi, theta, phi), (float(p), float(q), float(r)), float(V), float(alpha), float(beta))
