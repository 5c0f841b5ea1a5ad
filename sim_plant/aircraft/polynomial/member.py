"""A rigid-body aircraft flown by coefficients that are a series in incidence and deflections."""

from __future__ import annotations

import numpy as np

from sim_plant.aircraft.kind import Setup
from sim_plant.aircraft.polynomial.table import PolynomialTable
from sim_plant.aircraft.sixdof.member import SixDofMember
from sim_plant.aircraft.sixdof.series import ALPHA_REF, STABILIZER
from sim_plant.kernels import layout as n
from sim_plant.rng import generator

N_COEFFICIENTS = STABILIZER  # those before the stabilizer and the thrust line


class PolynomialMember(SixDofMember):
    """The aircraft of a file with the coefficients of the scenario's table in the place of the file's derivatives."""

    def __init__(self, setup: Setup) -> None:
        """Raises ConfigError for a table that lacks a coefficient, and as SixDofMember."""
        super().__init__(setup)
        block = setup.table(PolynomialTable).vector()
        wrong, most = np.ones(len(block)), setup.cfg.aero_error_frac
        if most > 0.0:
            wrong[:N_COEFFICIENTS] += generator(setup.seed, f"{setup.cfg.name}.polynomial").uniform(
                -most, most, N_COEFFICIENTS
            )
        wrong[ALPHA_REF] = 1.0  # where the parabola begins is no coefficient
        block *= wrong
        self.par = np.concatenate([self.par, block])
        self.par[n.P_SERIES] = len(self.par) - len(block)
