"""What the straight lines of an aircraft's derivatives leave out: stall and compressibility (docs/sources/airframe.md)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit

Arr = NDArray[np.float64]
MACH_MOST = 0.95  # [-] the linear theory ends before the speed of sound


@jit
def beyond(alpha: float, tail: float, par: Arr) -> tuple[float, float, float]:
    """Lift coefficient of the wing, drag coefficient, and slope of the lift over that of the straight part, at an incidence [rad]
    outside the straight part; tail: lift coefficient of the elevator.

    A parabola to the top; from there to 90 deg the functions of Viterna and Corrigan, continuous in lift and drag (airframe.md
    1); behind that the plate's. The inverted wing is the mirror image with its own top.
    """
    side, a, edge = 1.0, alpha, par[n.P_STRAIGHT_HI]
    if alpha < par[n.P_STRAIGHT_LO]:
        side, a, edge = -1.0, -alpha, -par[n.P_STRAIGHT_LO]
    width, slope = par[n.P_ROUND_OFF], par[n.CL_ALPHA]
    peak = edge + width
    zero = side * par[n.CL0]
    if a <= peak:
        d = a - edge
        cl = side * (zero + slope * a - 0.5 * slope * d * d / width)
        return cl, par[n.CD0] + par[n.K_POLAR] * (cl + tail) * (cl + tail), 1.0 - d / width
    top = zero + slope * (peak - 0.5 * width)
    most = 1.11 + 0.018 * par[n.P_ASPECT]
    sp, cp = math.sin(peak), math.cos(peak)
    s, c = math.sin(a), math.cos(a)
    if c <= 0.0:
        return side * most * s * c, max(most * s * s, par[n.CD0]), (c * c - s * s) * most / slope
    cd_top = par[n.CD0] + par[n.K_POLAR] * (side * top + tail) * (side * top + tail)
    a2 = (top - most * sp * cp) * sp / (cp * cp)
    b2 = (cd_top - most * sp * sp) / cp
    cl = most * s * c + a2 * c * c / s
    rise = most * (c * c - s * s) - a2 * c * (1.0 / (s * s) + 1.0)
    return side * cl, most * s * s + b2 * c, rise / slope


@jit
def slope_factor(mach: float, par: Arr) -> float:
    """Forces of a wing at this Mach number over those at the reference one: Helmbold's lift slope with Prandtl and Glauert's
    beta^2 = 1 - M^2, swept (airframe.md 2)."""
    t2 = 1.0 / (par[n.P_SWEEP] * par[n.P_SWEEP]) - 1.0
    m, m0 = min(mach, MACH_MOST), par[n.P_MACH]
    aa = par[n.P_ASPECT] * par[n.P_ASPECT]
    return (2.0 + math.sqrt(4.0 + aa * (1.0 - m0 * m0 + t2))) / (2.0 + math.sqrt(4.0 + aa * (1.0 - m * m + t2)))


@jit
def wave_drag(mach: float, cl: float, par: Arr) -> float:
    """Drag coefficient of the shocks: Lock's fourth power above the critical Mach number of Korn's equation (airframe.md 3)."""
    c = par[n.P_SWEEP]
    diverges = par[n.P_TECH] / c - par[n.P_THICK] / (c * c) - 0.1 * abs(cl) / (c * c * c)
    over = mach - diverges + math.pow(0.1 / 80.0, 1.0 / 3.0)
    if over <= 0.0:
        return 0.0
    return 20.0 * over * over * over * over
