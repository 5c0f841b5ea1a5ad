"""What JSBSim's models do not say and an aircraft file must: where the wing lets go, between which airspeeds it flies level."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hil_scripts.identify.bench import Bench, Point
from hil_scripts.identify.engines import Engines
from sim_plant.kernels.layout import G0

ALPHA_SHARE, LIFT_SHARE = 0.8, 0.6  # of the incidence and of the lift at the top: what steady flight may use
MACH_MAX = 0.82
STEP_MPS = 1.0


@dataclass(frozen=True)
class Flown:
    """Top of the lift curve [-] and its incidence [rad], and the airspeeds [m/s] of level flight."""

    CL_max: float
    alpha_top: float
    V_min_mps: float
    V_max_mps: float


def flown(bench: Bench, engines: Engines, trim: Point) -> Flown:
    """Of a model at its condition. The least airspeed keeps LIFT_SHARE of the top lift; at the greatest, thrust is drag."""
    lift = [(bench.read(replace(trim, alpha=a)).CL, a) for a in np.radians(np.arange(2.0, 40.0, 0.25))]
    top, at = max(lift)
    weight = bench.mass_kg * G0
    v_min = math.sqrt(2.0 * weight / (bench.rho * bench.S_m2 * LIFT_SHARE * top))
    v = trim.V
    while v < MACH_MAX * bench.sound_mps and _drag(bench, trim, v) < engines.thrust(
        bench.c.height_m, v / bench.sound_mps, 1.0
    ):
        v += STEP_MPS
    return Flown(float(top), float(at), v_min, v - STEP_MPS)


def _drag(bench: Bench, trim: Point, V: float) -> float:
    """Drag [N] of level flight at an airspeed, the elevator that of the trim."""
    qs = 0.5 * bench.rho * V * V * bench.S_m2
    lo, hi = -0.2, 0.4
    for _ in range(25):
        mid = 0.5 * (lo + hi)
        low = bench.read(replace(trim, V=V, alpha=mid)).CL * qs < bench.mass_kg * G0
        lo, hi = (mid, hi) if low else (lo, mid)
    return bench.read(replace(trim, V=V, alpha=lo)).CD * qs
