"""[aircraft.plant] of an aircraft whose coefficients are a series in incidence and deflections."""

from __future__ import annotations

import dataclasses
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
        v = dataclasses.asdict(self)
        return np.array([math.radians(v[k]) if k.endswith("_deg") else v[k] for k in ORDER])


ORDER = (
    "CD0", "CD_alpha", "CD_alpha2", "CD_de", "CD_de2", "CD_ds", "CD_ds2", "CS0", "CS_beta", "CS_da", "CS_dr",
    "CL0", "CL_alpha", "CL_alpha2", "alpha_ref_deg", "CL_q", "CL_de", "CL_ds", "Cl0", "Cl_da", "Cl_dr", "Cl_beta", "Cl_p", "Cl_r",
    "Cm0", "Cm_alpha", "Cm_de", "Cm_q", "Cm_ds", "Cn0", "Cn_da", "Cn_dr", "Cn_beta", "Cn_p", "Cn_r",
    "stabilizer_deg", "thrust_up_deg", "thrust_aft_m", "thrust_right_m", "thrust_below_m",
)  # fmt: skip
