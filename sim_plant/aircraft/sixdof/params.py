"""Aircraft file -> flat parameter vector of the plant's kernels, with seeded errors of the true coefficients."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError
from sim_plant.aircraft.mismatch import Mismatch
from sim_plant.earth.model import EARTHS
from sim_plant.kernels import layout as n
from sim_plant.rng import generator

N_AERO = n.CN_DR - n.CL0 + 1


def stall_vector(ac: Aircraft) -> list[float]:
    """Entries P_STRAIGHT_HI .. P_ASPECT. Raises ConfigError for a top that lies before the end of the straight part."""
    g, a, stall = ac.geometry, ac.aero, ac.stall
    aspect = g.b_m * g.b_m / g.S_m2
    if stall is None:
        return [0.0, 0.0, 0.0, aspect]
    hi = math.radians(stall.straight_deg)
    width = 2.0 * ((stall.CL_max - a.CL0) / a.CL_alpha - hi)  # the parabola rises half as far as the line would
    lo = (stall.CL_min - a.CL0) / a.CL_alpha + 0.5 * width
    if not (width > 0.0 and lo < 0.0):
        least, most = a.CL0 + a.CL_alpha * hi, a.CL0 - a.CL_alpha * 0.5 * width
        raise ConfigError(
            f"aircraft {ac.meta.name}: stall.CL_max = {stall.CL_max:g}, CL_min = {stall.CL_min:g}: allowed: above {least:.3g}, "
            f"what the straight part ends at, and below {most:.3g}"
        )
    return [hi, lo, width, aspect]


def effects_vector(ac: Aircraft, full: bool) -> list[float]:
    """Entries P_MACH .. P_ARM: all zero but the engines' share unless the airframe is flown in full."""
    e, m, b = ac.engine, ac.mach, ac.balance
    mach = [m.reference, math.cos(math.radians(m.sweep_deg)), m.thickness, m.technology] if m and full else [0.0] * 4
    fuel = [b.fuel_x_m, b.fuel_kg] if b and full else [0.0, 0.0]
    return [*mach, e.below_m * full, *fuel, e.spool_idle_ps * full, e.spool_full_ps * full, 1.0, 0.0]


def parameter_vector(
    ac: Aircraft, earth: str = "flat", lat0_deg: float = 0.0, full: bool = False
) -> NDArray[np.float64]:
    """Parameter vector (kernels/layout.py) of an aircraft record, SI and radians, over the earth of this name, the map's
    origin at this latitude [deg]; full: with what derivatives at one point leave out. Raises ConfigError on uneven tables."""
    g, e, c, m, i = ac.geometry, ac.engine, ac.controls, ac.mass, ac.inertia
    aero = dataclasses.astuple(ac.aero)
    if len(aero) != N_AERO:
        raise ConfigError(f"aircraft {ac.meta.name}: {len(aero)} aerodynamic coefficients, the plant knows {N_AERO}")
    columns = [i.mass_kg, i.Ixx_kgm2, i.Iyy_kgm2, i.Izz_kgm2, i.Ixz_kgm2]
    if len({len(col) for col in columns}) != 1 or not i.mass_kg:
        raise ConfigError(f"aircraft {ac.meta.name}: inertia: all lists need the same length, at least 1")
    nm, nh = len(e.lapse_mach), len(e.lapse_h_m)
    if e.lapse == "table" and (nm < 2 or nh < 2 or len(e.lapse_frac) != nm or any(len(r) != nh for r in e.lapse_frac)):
        raise ConfigError(
            f"aircraft {ac.meta.name}: engine.lapse_frac needs {nm} rows (Mach) of {nh} values (altitude)"
        )
    deg = np.pi / 180.0
    surfaces = (c.aileron_deg, c.elevator_deg, c.rudder_deg)
    par = np.concatenate(
        [
            [g.S_m2, g.b_m, g.c_m],
            aero,
            [e.static_thrust_N, 1.0 if e.lapse == "table" else 0.0, e.idle_frac, e.tau_s, e.tsfc_kgpNs],
            np.array([s[0] for s in surfaces]) * deg,
            np.array([s[1] for s in surfaces]) * deg,
            np.array([c.aileron_rate_degps, c.elevator_rate_degps, c.rudder_rate_degps]) * deg,
            [c.servo_wn_radps, c.servo_zeta],
            [m.empty_kg, m.fuel_capacity_kg, m.max_kg],
            EARTHS[earth].vector(lat0_deg),
            stall_vector(ac),
            effects_vector(ac, full),
            [0.0, 0.0],  # no ascent: wind/warmth.py adds one
            [0.0],  # derivatives; a kind may add a series
            [len(i.mass_kg), nm, nh],
            *columns,
            e.lapse_mach,
            e.lapse_h_m,
            *e.lapse_frac,
        ]
    )
    return np.ascontiguousarray(par, dtype=np.float64)


def perturb(par: NDArray[np.float64], frac: float, seed: int, name: str) -> NDArray[np.float64]:
    """Copy of `par` with every aerodynamic coefficient multiplied by 1 + U(-frac, frac), drawn for (seed, name)."""
    out = par.copy()
    u = generator(seed, f"{name}.aero").uniform(-frac, frac, N_AERO) if frac > 0.0 else np.zeros(N_AERO)
    out[n.CL0 : n.CN_DR + 1] *= 1.0 + u
    return out


def mistaken(par: NDArray[np.float64], m: Mismatch) -> NDArray[np.float64]:
    """Copy of `par` with the aircraft flown off its file by the factors of `m`; mass is that of the aircraft without fuel."""
    out = par.copy()
    out[n.P_EMPTY] *= m.mass
    out[n.P_T0] *= m.thrust
    out[n.P_TAU] *= m.lag
    out[n.P_WN] *= m.servo
    k = int(out[n.P_NI])
    out[n.P_TABLES + k : n.P_TABLES + 5 * k] *= m.inertia
    return out
