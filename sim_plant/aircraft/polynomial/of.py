"""The series of an aircraft file: its derivatives about one incidence and elevator, as a table of a scenario.

python -m sim_plant.aircraft.polynomial.of learjet24 --alpha-deg 5 --elevator-deg -2
"""

from __future__ import annotations

import argparse
import dataclasses
import math

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.aircraft.polynomial.table import PolynomialTable


def polynomial_of(ac: Aircraft, alpha: float, de: float) -> PolynomialTable:
    """The table for incidence `alpha` and elevator `de` [rad]. The polar K CL^2 of the drag is multiplied out, its product of
    incidence and elevator by the tangent there; moments are turned from stability to body axes there. Incidence rate and the
    side force of the rates have no place in the form and are left out. Source: lee.md (2.20), (2.26)."""
    a, c, s = ac.aero, math.cos(alpha), math.sin(alpha)
    cross = 2.0 * a.K * a.CL_alpha * a.CL_de
    # moments in body axes of those in stability axes, and of rates p, r in body axes
    Cl_beta, Cn_beta = c * a.Cl_beta - s * a.Cn_beta, s * a.Cl_beta + c * a.Cn_beta
    Cl_da, Cn_da = c * a.Cl_da - s * a.Cn_da, s * a.Cl_da + c * a.Cn_da
    Cl_dr, Cn_dr = c * a.Cl_dr - s * a.Cn_dr, s * a.Cl_dr + c * a.Cn_dr
    l_p, l_r = c * a.Cl_p - s * a.Cl_r, s * a.Cl_p + c * a.Cl_r
    n_p, n_r = c * a.Cn_p - s * a.Cn_r, s * a.Cn_p + c * a.Cn_r
    Cl_p, Cl_r, Cn_p, Cn_r = c * l_p - s * n_p, c * l_r - s * n_r, s * l_p + c * n_p, s * l_r + c * n_r
    return PolynomialTable(
        CD0=a.CD0 + a.K * a.CL0**2 - cross * alpha * de,
        CD_alpha=2.0 * a.K * a.CL0 * a.CL_alpha + cross * de,
        CD_alpha2=a.K * a.CL_alpha**2,
        CD_de=2.0 * a.K * a.CL0 * a.CL_de + cross * alpha,
        CD_de2=a.K * a.CL_de**2,
        CS_beta=-a.CY_beta, CS_dr=-a.CY_dr,
        CL0=a.CL0, CL_alpha=a.CL_alpha, CL_q=a.CL_q, CL_de=a.CL_de,
        Cm0=a.Cm0, Cm_alpha=a.Cm_alpha, Cm_de=a.Cm_de, Cm_q=a.Cm_q,
        Cl_beta=Cl_beta, Cl_da=Cl_da, Cl_dr=Cl_dr, Cl_p=Cl_p, Cl_r=Cl_r,
        Cn_beta=Cn_beta, Cn_da=Cn_da, Cn_dr=Cn_dr, Cn_p=Cn_p, Cn_r=Cn_r,
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
