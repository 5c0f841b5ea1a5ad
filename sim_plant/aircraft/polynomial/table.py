"""[aircraft.plant] of an aircraft whose coefficients are a series in incidence and deflections."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import Range

Angle = Annotated[float, Range(-30.0, 30.0)]
Arm = Annotated[float, Range(-30.0, 30.0)]


@dataclass(frozen=True)
class PolynomialTable:
    """Coefficients of Lee (2.20), (2.26) (docs/sources/lee.md), per radian, rates by b/2V and c/2V, all in body axes but drag,
    side force (positive to the left) and lift; Cl, Cn: roll, yaw. They take the place of those of the aircraft file, whose
    geometry, engine, servos and mass stay. da, de, dr: deflections; ds: the stabilizer, fixed at `stabilizer_deg`."""

    CD0: float
    CL_alpha: float
    Cm_alpha: float
    Cm_de: float
    CS_beta: float
    Cl_da: float
    Cl_p: float
    Cn_beta: float
    Cn_dr: float
    Cn_r: float
    CD_alpha: float = 0.0
    CD_alpha2: float = 0.0
    CD_de: float = 0.0
    CD_de2: float = 0.0
    CD_ds: float = 0.0
    CD_ds2: float = 0.0
    CS0: float = 0.0
    CS_da: float = 0.0
    CS_dr: float = 0.0
    CL0: float = 0.0
    CL_alpha2: float = 0.0
    alpha_ref_deg: Angle = 0.0
    CL_q: float = 0.0
    CL_de: float = 0.0
    CL_ds: float = 0.0
    Cl0: float = 0.0
    Cl_dr: float = 0.0
    Cl_beta: float = 0.0
    Cl_r: float = 0.0
    Cm0: float = 0.0
    Cm_q: float = 0.0
    Cm_ds: float = 0.0
    Cn0: float = 0.0
    Cn_da: float = 0.0
    Cn_p: float = 0.0
    stabilizer_deg: Angle = 0.0
    thrust_up_deg: Angle = 0.0
    thrust_aft_m: Arm = 0.0
    thrust_right_m: Arm = 0.0
    thrust_below_m: Arm = 0.0

    def vector(self) -> NDArray[np.float64]:
        """The block of sim_plant/aircraft/sixdof/series.py, [40], SI and radians."""
        t, rad = self, math.radians
        return np.array([
            t.CD0, t.CD_alpha, t.CD_alpha2, t.CD_de, t.CD_de2, t.CD_ds, t.CD_ds2, t.CS0, t.CS_beta, t.CS_da, t.CS_dr,
            t.CL0, t.CL_alpha, t.CL_alpha2, rad(t.alpha_ref_deg), t.CL_q, t.CL_de, t.CL_ds,
            t.Cl0, t.Cl_da, t.Cl_dr, t.Cl_beta, t.Cl_p, t.Cl_r, t.Cm0, t.Cm_alpha, t.Cm_de, t.Cm_q, t.Cm_ds,
            t.Cn0, t.Cn_da, t.Cn_dr, t.Cn_beta, t.Cn_p, t.Cn_r,
            rad(t.stabilizer_deg), rad(t.thrust_up_deg), t.thrust_aft_m, t.thrust_right_m, t.thrust_below_m,
        ])  # fmt: skip
