"""What is left untrimmed in the fault matrix: surfaces whose moment at the stop nothing else in the aircraft file bears
(recovery.md section 11). Balances of the file's own derivatives, at rest in rates."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_aircraft
from sim_plant.failures.actuators import FLOAT

AIRCRAFT = ("learjet24", "kc135r")
MISTAKEN = 0.1  # share by which the derivatives of the guarded moments are wrong


def rudder_against(ac: Aircraft, aileron: float) -> float:
    """Largest rolling moment against that of the ailerons' which sideslip makes where the rudder balances it in yaw [-]."""
    c = ac.aero
    best = 0.0
    for r in np.radians(np.linspace(*ac.controls.rudder_deg, 121)):
        beta = -(c.Cn_dr * r + c.Cn_da * aileron) / c.Cn_beta
        best = max(best, -math.copysign(1.0, c.Cl_da * aileron) * (c.Cl_beta * beta + c.Cl_dr * r))
    return best


@pytest.mark.parametrize("name", AIRCRAFT)
@pytest.mark.parametrize("side", (0, 1))
def test_ailerons_at_their_stop_roll_more_than_the_whole_rudder(name: str, side: int) -> None:
    ac = load_aircraft(name)
    assert isinstance(ac, Aircraft)
    stop = math.radians(ac.controls.aileron_deg[side])
    assert rudder_against(ac, stop) < abs(ac.aero.Cl_da * stop)
    assert rudder_against(ac, math.radians(5.0) * math.copysign(1.0, stop)) > abs(ac.aero.Cl_da * math.radians(5.0))


@pytest.mark.parametrize("name", AIRCRAFT)
@pytest.mark.parametrize("side", (0, 1))
def test_an_elevator_at_its_stop_trims_beyond_the_files_incidence(name: str, side: int) -> None:
    ac = load_aircraft(name)
    assert isinstance(ac, Aircraft)
    c, stop = ac.aero, math.radians(ac.controls.elevator_deg[side])
    alpha = -(c.Cm0 + c.Cm_de * stop) / c.Cm_alpha
    lift = c.CL0 + c.CL_alpha * alpha + c.CL_de * stop
    assert abs(alpha) > math.radians(ac.limits.alpha_max_deg) or lift < 0.0


def test_a_free_elevator_leaves_the_receiver_neutral_within_what_its_file_is_wrong_by() -> None:
    ac = load_aircraft("learjet24")
    assert isinstance(ac, Aircraft)
    c = ac.aero
    free = c.Cm_alpha - FLOAT * c.Cm_de
    assert c.Cm_alpha < free < 0.0
    assert abs(free) < MISTAKEN * math.hypot(c.Cm_alpha, FLOAT * c.Cm_de)
