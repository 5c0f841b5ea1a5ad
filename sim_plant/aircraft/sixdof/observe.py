"""What instruments fixed to one aircraft would read without error: specific force, flow, probes, field."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.aircraft.sixdof.eom import inertia
from sim_plant.aircraft.sixdof.propulsion import thrust_available
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.earth import air_height, rigid_rates
from sim_plant.kernels.jit import jit
from sim_plant.kernels.rot import euler_from_quat, quat_dcm

Arr = NDArray[np.float64]


@jit
def seen(s: Arr, free: Arr, mag_n: Arr, probes: Arr, probe_wake: Arr, out: Arr) -> None:
    """The part of `observe` that motion alone gives, whatever forces made it: attitude, field, probes."""
    out[n.O_EULER], out[n.O_EULER + 1], out[n.O_EULER + 2] = euler_from_quat(s[0], s[1], s[2], s[3])
    c00, c01, c02, c10, c11, c12, c20, c21, c22 = quat_dcm(s[0], s[1], s[2], s[3])
    out[n.O_MAG] = c00 * mag_n[0] + c10 * mag_n[1] + c20 * mag_n[2]
    out[n.O_MAG + 1] = c01 * mag_n[0] + c11 * mag_n[1] + c21 * mag_n[2]
    out[n.O_MAG + 2] = c02 * mag_n[0] + c12 * mag_n[1] + c22 * mag_n[2]
    p, q, r = s[n.S_W], s[n.S_W + 1], s[n.S_W + 2]
    for i in range(probes.shape[0]):
        an = s[n.S_V] - free[0] - probe_wake[i, 0]
        ae = s[n.S_V + 1] - free[1] - probe_wake[i, 1]
        ad = s[n.S_V + 2] - free[2] - probe_wake[i, 2]
        x, y, z = probes[i, 0], probes[i, 1], probes[i, 2]
        u = c00 * an + c10 * ae + c20 * ad + q * z - r * y
        v = c01 * an + c11 * ae + c21 * ad + r * x - p * z
        ww = c02 * an + c12 * ae + c22 * ad + p * y - q * x
        speed = math.sqrt(u * u + v * v + ww * ww)
        out[n.O_PROBE + 3 * i] = speed
        out[n.O_PROBE + 3 * i + 1] = math.atan2(ww, u)
        out[n.O_PROBE + 3 * i + 2] = math.asin(v / max(speed, 1e-6))


@jit
def observe(s: Arr, w: Arr, free: Arr, par: Arr, mag_n: Arr, probes: Arr, probe_wake: Arr, k: Arr, out: Arr) -> None:
    """Fill `out` [NO] (layout.py) from state `s` and effective wind `w`.

    Specific force and acceleration at the cg [m/s^2], angular acceleration [rad/s^2], V, beta, alpha against the
    effective wind, lift and drag [N], rho, static pressure, mass, field in body axes [gauss], thrust available [N],
    psi, theta, phi. Probe i at probes[i] [m, body]: flow velocity C_bn (v_n - free - probe_wake[i]) + w_b x r_i; the
    effective rotational wind is not added: the wake velocity at the probe already holds it. `k` [N_RIGID] is work
    space.
    """
    mass = par[n.P_EMPTY] + s[n.S_FUEL]
    da, de, dr = s[n.S_SURF], s[n.S_SURF + 1], s[n.S_SURF + 2]
    fx, fy, fz, mx, my, mz, v_air, beta, alpha, lift, drag, _, rho, a = loads(s, da, de, dr, w, mass, par)
    ixx, iyy, izz, ixz = inertia(mass, par)
    rigid_rates(s, fx, fy, fz, mx, my, mz, mass, ixx, iyy, izz, ixz, par, k)
    out[0], out[1], out[2] = fx / mass, fy / mass, fz / mass
    out[n.O_V], out[n.O_BETA], out[n.O_ALPHA] = v_air, beta, alpha
    out[n.O_LIFT], out[n.O_DRAG], out[n.O_RHO], out[n.O_MASS] = lift, drag, rho, mass
    h = air_height(-s[n.S_P + 2], par)
    _, out[n.O_PRESS], _, _ = isa(h)
    out[n.O_AVAIL] = thrust_available(h, v_air / a, rho, par)
    for i in range(3):
        out[n.O_ACC + i] = k[n.S_V + i]
        out[n.O_WDOT + i] = k[n.S_W + i]
    seen(s, free, mag_n, probes, probe_wake, out)


@jit
def look(
    s: Arr,
    w: Arr,
    free: Arr,
    par: Arr,
    mag_n: Arr,
    probes: Arr,
    probe_wake: Arr,
    k: Arr,
    out: Arr,
    bounds: Arr,
    held: Arr,
) -> bool:
    """`observe`, the state it is made from kept in `held` [NS]; whether all is within `bounds` [NB], none of which may be NaN."""
    observe(s, w, free, par, mag_n, probes, probe_wake, k, out)
    finite = True
    for i in range(n.NS):
        held[i] = s[i]
        finite &= s[i] - s[i] == 0.0  # as math.isfinite, which is called
    load, rate = -out[2] / n.G0, max(abs(s[n.S_W]), abs(s[n.S_W + 1]), abs(s[n.S_W + 2]))
    return (
        finite
        and bounds[n.B_LOAD] <= load <= bounds[n.B_LOAD + 1]
        and out[n.O_V] <= bounds[n.B_V]
        and -s[n.S_P + 2] >= bounds[n.B_HEIGHT]
        and abs(out[n.O_EULER + 1]) <= bounds[n.B_PITCH]
        and abs(out[n.O_EULER + 2]) <= bounds[n.B_BANK]
        and abs(out[n.O_ALPHA]) <= bounds[n.B_ALPHA]
        and rate <= bounds[n.B_RATE]
    )
