"""The series of an aircraft file: its derivatives about one incidence and elevator, as a table of a scenario.

python -m sim_plant.aircraft.polynomial.of learjet24 --alpha-deg 5 --elevator-deg -2
"""

from __future__ import annotations

import argparse
import dataclasses
import math

import numpy as np

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.aircraft.polynomial.table import PolynomialTable


def polynomial_of(ac: Aircraft, alpha: float, de: float) -> PolynomialTable:
    """The table for incidence `alpha` and elevator `de` [rad]. The polar K CL^2 of the drag is multiplied out, its product of
    incidence and elevator by the tangent there; moments are turned from stability to body axes there. Incidence rate and the
    side force of the rates have no place in the form and are left out. Source: lee.md (2.20), (2.26)."""
    a, c, s = ac.aero, math.cos(alpha), math.sin(alpha)
    cross = 2.0 * a.K * a.CL_alpha * a.CL_de
    turn = np.array([[c, s], [-s, c]])  # (p, r) in body axes to stability axes
    static = turn.T @ [[a.Cl_beta, a.Cl_da, a.Cl_dr], [a.Cn_beta, a.Cn_da, a.Cn_dr]]
    damping = turn.T @ np.array([[a.Cl_p, a.Cl_r], [a.Cn_p, a.Cn_r]]) @ turn
    roll, yaw = static.tolist()
    (Cl_p, Cl_r), (Cn_p, Cn_r) = damping.tolist()
    return PolynomialTable(
        CD0=a.CD0 + a.K * a.CL0**2 - cross * alpha * de,
        CD_alpha=2.0 * a.K * a.CL0 * a.CL_alpha + cross * de,
        CD_alpha2=a.K * a.CL_alpha**2,
        CD_de=2.0 * a.K * a.CL0 * a.CL_de + cross * alpha,
        CD_de2=a.K * a.CL_de**2,
        CS_beta=-a.CY_beta, CS_dr=-a.CY_dr,
        CL0=a.CL0, CL_alpha=a.CL_alpha, CL_q=a.CL_q, CL_de=a.CL_de,
        Cm0=a.Cm0, Cm_alpha=a.Cm_alpha, Cm_de=a.Cm_de, Cm_q=a.Cm_q,
        Cl_beta=roll[0], Cl_da=roll[1], Cl_dr=roll[2], Cl_p=Cl_p, Cl_r=Cl_r,
        Cn_beta=yaw[0], Cn_da=yaw[1], Cn_dr=yaw[2], Cn_p=Cn_p, Cn_r=Cn_r,
    )  # fmt: skip


def main() -> None:
    """Print the table of an aircraft file."""
    p = argparse.ArgumentParser(
        prog="python -m sim_plant.aircraft.polynomial.of", description=(__doc__ or "").splitlines()[0]
    )
    p.add_argument("file", help="aircraft file, as in a scenario")
    p.add_argument("--alpha-deg", type=float, default=0.0, help="incidence of the tangent")
    p.add_argument("--elevator-deg", type=float, default=0.0, help="elevator of the tangent")
    a = p.parse_args()
    table = polynomial_of(load_aircraft(a.file), math.radians(a.alpha_deg), math.radians(a.elevator_deg))
    print('model = "polynomial"\n[aircraft.plant]')
    for key, value in dataclasses.asdict(table).items():
        if value != 0.0:
            print(f"{key} = {value:.9g}")


if __name__ == "__main__":
    main()
