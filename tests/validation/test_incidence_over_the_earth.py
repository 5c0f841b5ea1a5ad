"""The plant's rate of incidence, on which lift and moment depend, is the rate at which its incidence changes, over any earth."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from sim_plant.aircraft.sixdof.aero import loads
from sim_plant.earth.model import EARTHS
from sim_plant.kernels import layout as n
from tests.validation.test_equations_of_motion import (
    along,
    dcm_bn,
    flow,
    plant_parameters,
    plant_rates,
    plant_state,
    random_case,
)

STRAIGHT = {
    "flat": 1e-9,
    "wgs84": 6e-7,
}  # [rad/s]; the deflection of the vertical, up to 7e-5 m/s^2, is in the motion alone
ALPHADOT = 11  # of aero.Load


@pytest.mark.parametrize("earth", STRAIGHT)
@pytest.mark.parametrize("name", ["kc135r", "learjet24"])
def test_the_rate_of_incidence_is_what_the_motion_makes(earth: str, name: str) -> None:
    ac = load_aircraft(name)
    par = plant_parameters(ac)
    par[n.P_ROUND : n.P_MAP_E + 1] = EARTHS[earth].vector(47.0)
    rng = np.random.default_rng(5)
    for _ in range(20):
        x, u = random_case(rng, name)
        w = np.concatenate((rng.uniform(-15.0, 15.0, 3), rng.uniform(-0.05, 0.05, 3)))
        s = plant_state(x, u, w[:3], 0.5 * ac.mass.fuel_capacity_kg)
        d = plant_rates(s, u, w, par)

        def incidence(h: float, s=s, d=d, w=w) -> float:  # type: ignore[no-untyped-def]
            y = s[: n.N_RIGID] + h * d
            return float(flow(dcm_bn(y[0:4]) @ (y[n.S_V : n.S_V + 3] - w[:3]))[2])

        mass = float(par[n.P_EMPTY] + s[n.S_FUEL])
        said = loads(s, u[0], u[1], u[2], w, mass, par)[ALPHADOT]
        assert said == pytest.approx(along(incidence, 1e-3), abs=STRAIGHT[earth])
