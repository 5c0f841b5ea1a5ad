"""The plant's wake at the probes of an aircraft that is moved, not flown: readings as functions of place and attitude.

Frame F: origin tanker cg, x along the tanker's air velocity, y right, z down. Reading order V1..k, beta1..k, alpha1..k.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.wind.vortex import K_NU, K_TAIL, K_TAIL_FRAC, K_WING, NK, wake_velocity

Arr = NDArray[np.float64]
V3 = tuple[float, float, float]

SPEC_PROBES: tuple[V3, ...] = ((6.0, 0.0, 0.0), (1.5, -5.4, 0.2), (1.5, 5.4, 0.2))  # [m] body (sevil.md section 4)
SPAN_POINTS, HALF_SPAN = 11, 5.4  # stations of the mean wind on the wing, half span [m] (sevil.md 3.1)


@dataclass(frozen=True)
class PlantWake:
    """The tanker that makes the wake, and its vortices; defaults of sevil.md section 4. Positions in F [m]."""

    mass_kg: float = 1.2e5
    wing_span_m: float = 39.88
    tail_span_m: float = 12.27
    wing_m: V3 = (0.0, 0.0, 0.0)
    tail_m: V3 = (-18.0, 0.0, -1.5)
    core_wing_m: float = 0.8
    core_tail_m: float = 0.4
    nu_m2ps: float = 0.06
    tail_download_frac: float = 0.055  # [-] of the weight; the wing carries 1 + this
    V_mps: float = 200.0
    rho: float = 0.58883  # [kg/m^3] ISA at 7010 m

    def vectors(self) -> tuple[Arr, Arr]:
        """Observation [NO] and wake source [NK] vectors of the plant's vortex kernels, tanker incidence zero."""
        obs, src = np.zeros(n.NO), np.zeros(NK)
        obs[n.O_V], obs[n.O_RHO], obs[n.O_MASS] = self.V_mps, self.rho, self.mass_kg
        obs[n.O_LIFT] = self.mass_kg * n.G0
        for at, pos, span, core in (
            (K_WING, self.wing_m, self.wing_span_m, self.core_wing_m),
            (K_TAIL, self.tail_m, self.tail_span_m, self.core_tail_m),
        ):
            src[at : at + 3], src[at + 3], src[at + 4] = pos, math.pi / 4.0 * span, core
        src[K_NU], src[K_TAIL_FRAC] = self.nu_m2ps, -self.tail_download_frac
        return obs, src


SPEC_WAKE = PlantWake()


@jit
def _probe_series(
    xi: Arr, xi_dot: Arr, att: Arr, omega: Arr, air: Arr, probes: Arr, V: float, obs: Arr, src: Arr, on: bool, out: Arr
) -> None:
    """Readings [N,3k] of k probes (sevil.md 3.2): u_i = C (v_F - W(P_i) - w_i) + omega x rho_i, V, asin v/V, atan2 w, u."""
    k = probes.shape[0]
    for i in range(xi.shape[0]):
        cs, ss = math.cos(att[i, 0]), math.sin(att[i, 0])
        ct, st = math.cos(att[i, 1]), math.sin(att[i, 1])
        cf, sf = math.cos(att[i, 2]), math.sin(att[i, 2])
        c00, c01, c02 = ct * cs, ct * ss, -st
        c10, c11, c12 = sf * st * cs - cf * ss, sf * st * ss + cf * cs, sf * ct
        c20, c21, c22 = cf * st * cs + sf * ss, cf * st * ss - sf * cs, cf * ct
        p, q, r = omega[i, 0], omega[i, 1], omega[i, 2]
        for j in range(k):
            a, b, c = probes[j, 0], probes[j, 1], probes[j, 2]
            vx, vy, vz = V + xi_dot[i, 0] - air[i, j, 0], xi_dot[i, 1] - air[i, j, 1], xi_dot[i, 2] - air[i, j, 2]
            if on:
                wx, wy, wz = wake_velocity(
                    xi[i, 0] + c00 * a + c10 * b + c20 * c,
                    xi[i, 1] + c01 * a + c11 * b + c21 * c,
                    xi[i, 2] + c02 * a + c12 * b + c22 * c,
                    obs,
                    src,
                )
                vx, vy, vz = vx - wx, vy - wy, vz - wz
            u = c00 * vx + c01 * vy + c02 * vz + q * c - r * b
            v = c10 * vx + c11 * vy + c12 * vz + r * a - p * c
            w = c20 * vx + c21 * vy + c22 * vz + p * b - q * a
            speed = math.sqrt(u * u + v * v + w * w)
            out[i, j], out[i, k + j], out[i, 2 * k + j] = speed, math.asin(v / speed), math.atan2(w, u)


@jit
def _span_wind(xi: Arr, half: float, count: int, obs: Arr, src: Arr, out: Arr) -> None:
    """Mean wake wind [N,3] over `count` points across the span at each place of xi [N,3]."""
    for i in range(xi.shape[0]):
        x = y = z = 0.0
        for j in range(count):
            a, b, c = wake_velocity(xi[i, 0], xi[i, 1] - half + 2.0 * half * j / (count - 1), xi[i, 2], obs, src)
            x, y, z = x + a, y + b, z + c
        out[i, 0], out[i, 1], out[i, 2] = x / count, y / count, z / count


def plant_readings(
    xi: Arr,
    att: Arr,
    *,
    xi_dot: Arr | None = None,
    omega: Arr | None = None,
    air: Arr | None = None,
    probes_m: tuple[V3, ...] = SPEC_PROBES,
    V_mps: float = 200.0,
    wake: PlantWake | None = PlantWake(),
) -> Arr:
    """Noise-free readings [N,3k] at places xi [N,3] (F) with attitude att [N,3] or [3] (psi, theta, phi relative to F).

    xi_dot [N,3] m/s in F; omega [N,3] rad/s in body axes; air: wind besides the wake, [3], [N,3] or [N,k,3] in F [m/s].
    Raises ValueError if shapes do not fit together.
    """
    xi = np.ascontiguousarray(np.atleast_2d(xi), dtype=np.float64)
    count, k = len(xi), len(probes_m)

    def rows(a: Arr | None) -> Arr:  # writable, whatever is given: one compiled kernel
        return np.array(np.broadcast_to(0.0 if a is None else a, (count, 3)), np.float64, order="C")

    w = np.zeros((count, k, 3))
    if air is not None:
        w[:] = air if np.ndim(air) in (1, 3) else np.asarray(air)[:, None, :]
    obs, src = (wake or SPEC_WAKE).vectors()
    out = np.empty((count, 3 * k))
    probes = np.array(probes_m, dtype=np.float64)
    _probe_series(xi, rows(xi_dot), rows(att), rows(omega), w, probes, V_mps, obs, src, wake is not None, out)
    return out


def span_wind(xi: Arr, wake: PlantWake) -> Arr:
    """Mean wake wind [N,3] in F [m/s] over the receiver's wing at places xi [N,3] (sevil.md 3.1: 11 points, +-5.4 m)."""
    xi = np.ascontiguousarray(np.atleast_2d(xi), dtype=np.float64)
    obs, src = wake.vectors()
    out = np.empty_like(xi)
    _span_wind(xi, HALF_SPAN, SPAN_POINTS, obs, src, out)
    return out
