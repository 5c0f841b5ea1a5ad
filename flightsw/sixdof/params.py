"""Aircraft record -> flat parameter vector of the onboard model kernels (float64), and mass properties against mass."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np

from flightsw.aircraft import Aircraft

# layout of the parameter vector
M, S, B, C, IX, IY, IZ, IXZ = range(8)
AERO = 8  # 26 derivatives in the field order of flightsw.aircraft.Aero
(
    CL0, CLA, CLAD, CLQ, CLDE, CD0, KI, CM0, CMA, CMAD, CMQ, CMDE, CYB, CYP, CYR, CYDR,
    CLB, CLP, CLR, CLDA, CLDR, CNB, CNP, CNR, CNDA, CNDR,
) = range(AERO, AERO + 26)  # fmt: skip
SIZE = AERO + 26


def parameter_vector(ac: Aircraft, mass_kg: float) -> np.ndarray:
    """Parameter vector [34] of `ac` at total mass [kg]: mass, S, b, c, inertia (body axes), 26 derivatives."""
    p = np.zeros(SIZE)
    p[S], p[B], p[C] = ac.geometry.S_m2, ac.geometry.b_m, ac.geometry.c_m
    p[AERO:] = astuple(ac.aero)
    set_mass(p, ac, mass_kg)
    return p


def set_mass(p: np.ndarray, ac: Aircraft, mass_kg: float) -> None:
    """Update mass and inertia of a parameter vector in place (inertia linear in mass between tabulated points)."""
    if p[M] == mass_kg:  # as most of the time: the gauge is read once a second
        return
    p[M] = mass_kg
    t = ac.inertia
    for k, col in ((IX, t.Ixx_kgm2), (IY, t.Iyy_kgm2), (IZ, t.Izz_kgm2), (IXZ, t.Ixz_kgm2)):
        p[k] = np.interp(mass_kg, t.mass_kg, col)
