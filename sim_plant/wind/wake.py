"""Wake set-up: the vortices one aircraft sheds, and the points over which another one feels them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from sim_plant.wind import vortex as k

Arr = NDArray[np.float64]
N_SPAN = 9
WING_SHARE = 0.8  # [-] share of the wing in the mean wind; fuselage nose and tail carry the rest


@dataclass(frozen=True)
class Exposure:
    """Where an aircraft feels a wake: points [m, 3] (body), weights [n_frame, 3], number of wing stations, of airframe points,
    span [m]."""

    points: Arr
    weight: Arr
    n_span: int
    n_frame: int
    span_m: float


def source_vector(ac: Aircraft, core_wing_m: float, core_tail_m: float, nu_m2ps: float, tail_lift_frac: float) -> Arr:
    """Wake source vector (wind/vortex.py) of an aircraft: vortex span pi/4 of wing and tail span, cores [m]."""
    v = np.zeros(k.NK)
    v[k.K_WING : k.K_WING + 3] = ac.wake.wing_ac_m
    v[k.K_WING + 3], v[k.K_WING + 4] = math.pi / 4.0 * ac.geometry.b_m, core_wing_m
    v[k.K_TAIL : k.K_TAIL + 3] = ac.wake.tail_ac_m
    # an aircraft file without a tail span gets a third of the wing span: the tail term stays finite
    v[k.K_TAIL + 3] = math.pi / 4.0 * (ac.wake.tail_span_m or ac.geometry.b_m / 3.0)
    v[k.K_TAIL + 4], v[k.K_NU], v[k.K_TAIL_FRAC] = core_tail_m, nu_m2ps, tail_lift_frac
    return v


def bow_vector(ac: Aircraft, core_m: float, radius_m: float) -> Arr:
    """Source vector of an aircraft's bow wave: all lift on its wing, its body a Rankine oval as long as the longest bar of its
    file; radius_m: 0 = that bar's. Raises ValueError without a bar along the body, or with one as thick as it is long."""
    bars = [b for b in ac.structure.bars if b[0] != b[3]]
    if not bars:
        raise ValueError("no bar along the body in its [structure]")
    x0, _, z0, x1, _, z1, r = max(bars, key=lambda b: abs(b[0] - b[3]))
    half, mid = 0.5 * abs(x0 - x1) + r, 0.5 * (x0 + x1)
    v = source_vector(ac, core_m, core_m, 0.0, 0.0)
    v[k.K_BODY], a = oval(half, radius_m or r)
    v[k.K_BODY + 1 :] = mid + a, mid - a, 0.5 * (z0 + z1)
    return v


def oval(half_m: float, radius_m: float) -> tuple[float, float]:
    """Rankine oval of this half length and radius [m]: flux over speed [m^2], and place +-a [m] of source and sink.

    (l^2 - a^2)^2 = l r^2 sqrt(r^2 + a^2), flux pi r^2 sqrt(1 + (r/a)^2) V (Milne-Thomson, Theoretical Hydrodynamics, 5th ed.,
    15.24). Raises ValueError unless it is longer than thick.
    """
    if not 0.0 < radius_m < 0.9 * half_m:
        raise ValueError(f"radius {radius_m:g} m; allowed: above 0, below {0.9 * half_m:g}")
    lo, hi = 0.0, half_m  # the difference of the sides falls
    for _ in range(60):
        a = 0.5 * (lo + hi)
        over = (half_m**2 - a * a) ** 2 > half_m * radius_m**2 * math.sqrt(radius_m**2 + a * a)
        lo, hi = (a, hi) if over else (lo, a)
    return math.pi * radius_m**2 * math.sqrt(1.0 + (radius_m / a) ** 2), a


def airframe_points(ac: Aircraft, probes: Arr) -> Exposure:
    """Exposure of an aircraft with air-data probes at `probes` [m, body].

    Nine stations across the span at the middles of equal strips, elliptic weight, at the wing's aerodynamic centre;
    nose, cg and tail stations on the fuselage axis (off it, the field's change with height would enter the slope
    along x); then the probes. Weight columns: mean, slope against y, slope against x (see
    vortex.wake_on_airframe).
    """
    y = (np.arange(N_SPAN) + 0.5) / N_SPAN * ac.geometry.b_m - 0.5 * ac.geometry.b_m
    ell = np.sqrt(1.0 - (2.0 * y / ac.geometry.b_m) ** 2)
    ell /= ell.sum()
    wing = np.array(ac.wake.wing_ac_m)[None, :] + np.stack([0 * y, y, 0 * y], axis=1)
    frame = np.array([(ac.wake.nose_m[0], 0.0, 0.0), (0.0, 0.0, 0.0), (ac.wake.tail_ac_m[0], 0.0, 0.0)])
    n_frame = N_SPAN + len(frame)
    weight = np.zeros((n_frame, 3))
    weight[:N_SPAN, 0] = WING_SHARE * ell
    weight[N_SPAN, 0] = weight[n_frame - 1, 0] = 0.5 * (1.0 - WING_SHARE)
    weight[:N_SPAN, 1] = ell * y / np.sum(ell * y * y)
    x = frame[:, 0] - frame[:, 0].mean()
    weight[N_SPAN:, 2] = x / np.sum(x * x)
    return Exposure(np.ascontiguousarray(np.vstack([wing, frame, probes])), weight, N_SPAN, n_frame, ac.geometry.b_m)
