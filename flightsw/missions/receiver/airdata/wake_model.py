"""Onboard wake parameters, their kernel vector, and the wind an aircraft feels as a whole in the wake.

This set of parameters belongs to the onboard software and is separate from the plant's (scenario table [wind.wake]).
Defaults: sevil.md section 4 (KC-135R at 200 m/s, 7010 m).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit_own
from flightsw.kernels.rotations import dcm_from_euler, to_parent
from flightsw.missions.receiver.airdata import wake_kernel as k
from flightsw.strict import Range

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]
N_POINTS = 11  # stations of the span and of the fuselage in the effective wind


@dataclass(frozen=True)
class WakeParams:
    """What the receiver believes of its tanker's wake. Positions in F (see flightsw/missions/receiver/airdata/wake_kernel.py)."""

    mass_kg: Annotated[float, Range(1e3, 1e6)] = 1.2e5
    wing_span_m: Annotated[float, Range(1.0, 200.0)] = 39.88
    tail_span_m: Annotated[float, Range(1.0, 100.0)] = 12.27
    wing_m: Annotated[V3, Range(-100.0, 100.0)] = (0.0, 0.0, 0.0)  # bound vortex of the wing
    tail_m: Annotated[V3, Range(-100.0, 100.0)] = (-18.0, 0.0, -1.5)  # and of the tail
    core_wing_m: Annotated[float, Range(0.0, 10.0)] = 0.8
    core_tail_m: Annotated[float, Range(0.0, 10.0)] = 0.4
    nu_m2ps: Annotated[float, Range(0.0, 10.0)] = 0.06  # eddy viscosity
    tail_download_frac: Annotated[float, Range(-1.0, 1.0)] = 0.055  # download of the tail / weight


def wake_params_of(ac: Aircraft, mass_kg: float, base: WakeParams | None = None) -> WakeParams:
    """Wake parameters from a tanker's aircraft record and mass [kg]; cores, viscosity and download from `base`."""
    b = base or WakeParams()
    return WakeParams(
        mass_kg=mass_kg,
        wing_span_m=ac.geometry.b_m,
        tail_span_m=ac.wake.tail_span_m or b.tail_span_m,
        wing_m=ac.wake.wing_ac_m,
        tail_m=ac.wake.tail_ac_m,
        core_wing_m=b.core_wing_m,
        core_tail_m=b.core_tail_m,
        nu_m2ps=b.nu_m2ps,
        tail_download_frac=b.tail_download_frac,
    )


def wake_vector(p: WakeParams) -> Arr:
    """Wake vector [13] (layout WK_* of flightsw/missions/receiver/airdata/wake_kernel.py) of level unaccelerated flight.

    Wing lift = (1 + download) m g, tail lift = -download m g; vortex spacing pi/4 of the span (sevil.md section 3).
    For a vortex height error, shift WK_WING_Z and WK_TAIL_Z of a copy; the field is linear in the two lifts.
    """
    v = np.zeros(k.WK_SIZE)
    weight = p.mass_kg * G0
    v[k.WK_WING_X : k.WK_WING_Z + 1] = p.wing_m
    v[k.WK_WING_SPACING], v[k.WK_WING_CORE] = math.pi / 4.0 * p.wing_span_m, p.core_wing_m
    v[k.WK_WING_LIFT] = (1.0 + p.tail_download_frac) * weight
    v[k.WK_TAIL_X : k.WK_TAIL_Z + 1] = p.tail_m
    v[k.WK_TAIL_SPACING], v[k.WK_TAIL_CORE] = math.pi / 4.0 * p.tail_span_m, p.core_tail_m
    v[k.WK_TAIL_LIFT] = -p.tail_download_frac * weight
    v[k.WK_NU] = p.nu_m2ps
    return v


def circulation(wk: Arr, V: float, rho: float) -> tuple[float, float]:
    """Circulation [m^2/s] of wing and tail of a wake vector [13] at tanker airspeed V [m/s] and density rho [kg/m^3]."""
    return (
        float(wk[k.WK_WING_LIFT] / (rho * V * wk[k.WK_WING_SPACING])),
        float(wk[k.WK_TAIL_LIFT] / (rho * V * wk[k.WK_TAIL_SPACING])),
    )


EW_P, EW_Q, EW_R = 3, 4, 5  # effective wind [6]: three of wind [m/s, F], then rotation [rad/s]


@jit_own
def effective_wind(
    xi: np.ndarray,
    e: np.ndarray,
    V: float,
    rho: float,
    span: np.ndarray,
    fuselage: np.ndarray,
    wk: np.ndarray,
    kw: float,
    kt: float,
    out: np.ndarray,
) -> None:
    """out [6] <- the wind an aircraft at xi [m, F] feels as a whole: mean over the span [m/s, F], then p, q, r [rad/s].

    Erratum E15: the printed curl (Sevil 2013, equations 2.37-2.39) cancels in a vortex wake, which is irrotational, and
    doubles a rigid rotation. Used is the one gradient that loads the aircraft, as a least-squares slope:
    p = + slope of Wz over the span, q = - slope of Wz along the fuselage, r = + slope of Wy along the fuselage, with
    W and the slopes in own body axes. e [3] = (psi, theta, phi) of the own body relative to F [rad]; span, fuselage
    [n, 3] stations [m, body], the first spread along y, the second along x; V, rho, wk, kw, kt as in
    flightsw/kernels/wake.wake_wind.
    """
    C = np.empty(9)
    W = np.empty(3)
    at = np.empty(3)
    dcm_from_euler(e[0], e[1], e[2], C)
    for i in range(6):
        out[i] = 0.0
    for part in range(2):
        points = span if part == 0 else fuselage
        axis = 1 if part == 0 else 0
        n = points.shape[0]
        mean = 0.0
        for i in range(n):
            mean += points[i, axis]
        mean /= n
        square = 0.0
        sy = 0.0
        sz = 0.0
        for i in range(n):
            to_parent(C, points[i], at)
            k.wake_wind(xi[0] + at[0], xi[1] + at[1], xi[2] + at[2], wk, kw, kt, V, rho, W)
            d = points[i, axis] - mean
            square += d * d
            sy += d * (C[3] * W[0] + C[4] * W[1] + C[5] * W[2])
            sz += d * (C[6] * W[0] + C[7] * W[1] + C[8] * W[2])
            if part == 0:
                for j in range(3):
                    out[j] += W[j] / n
        if part == 0:
            out[EW_P] = sz / square
        else:
            out[EW_Q] = -sz / square
            out[EW_R] = sy / square


def stations(half_span_m: float = 5.4, nose_m: float = 6.0, tail_m: float = -7.0) -> tuple[Arr, Arr]:
    """Span and fuselage stations [11, 3] each (m, body) for `effective_wind`, evenly spaced; defaults: sevil.md 3.1."""
    span, fuselage = np.zeros((N_POINTS, 3)), np.zeros((N_POINTS, 3))
    span[:, 1] = np.linspace(-half_span_m, half_span_m, N_POINTS)
    fuselage[:, 0] = np.linspace(tail_m, nose_m, N_POINTS)
    return span, fuselage
