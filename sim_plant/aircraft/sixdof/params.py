"""Aircraft file -> flat parameter vector of the plant's kernels, with seeded errors of the true coefficients."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.strict import ConfigError
from sim_plant.earth.model import EARTHS
from sim_plant.kernels import layout as n
from sim_plant.rng import generator

N_AERO = n.CN_DR - n.CL0 + 1


def parameter_vector(ac: Aircraft, earth: str = "flat", lat0_deg: float = 0.0) -> NDArray[np.float64]:
    """Parameter vector (kernels/layout.py) of an aircraft record, SI and radians, over the earth of this name, the map's
    origin at this latitude [deg]. Raises ConfigError on uneven tables."""
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
