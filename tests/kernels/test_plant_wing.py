"""The wing beyond the straight line, and compressibility, against closed forms."""

from __future__ import annotations

import math

import pytest

from flightsw.aircraft import load_aircraft
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.wing import beyond, slope_factor, wave_drag
from sim_plant.kernels import layout as n


@pytest.mark.parametrize("name", ["learjet24", "kc135r"])
def test_lift_has_its_top_where_the_file_says_and_the_stall_is_continuous(name: str) -> None:
    ac = load_aircraft(name)
    par = parameter_vector(ac)
    assert ac.stall is not None
    edge, peak = par[n.P_STRAIGHT_HI], par[n.P_STRAIGHT_HI] + par[n.P_ROUND_OFF]
    assert beyond(peak, 0.0, par)[0] == pytest.approx(ac.stall.CL_max, rel=1e-9)
    low = par[n.P_STRAIGHT_LO] - par[n.P_ROUND_OFF]
    assert beyond(low, 0.0, par)[0] == pytest.approx(ac.stall.CL_min, rel=1e-9)
    at = beyond(edge + 1e-9, 0.0, par)
    assert at[0] == pytest.approx(ac.aero.CL0 + ac.aero.CL_alpha * edge, abs=1e-7) and at[2] == pytest.approx(
        1.0, abs=1e-6
    )
    for x in (peak, math.pi / 2.0):
        here, there = beyond(x - 1e-9, 0.02, par), beyond(x + 1e-9, 0.02, par)
        assert here[:2] == pytest.approx(there[:2], abs=1e-6)
    # Viterna and Corrigan: the plate's drag at 90 deg by the aspect ratio, and no lift
    cl, cd, _ = beyond(math.pi / 2.0 - 1e-9, 0.0, par)
    assert (cl, cd) == pytest.approx((0.0, 1.11 + 0.018 * ac.geometry.b_m**2 / ac.geometry.S_m2), abs=1e-6)
    for x in (edge + 0.02, peak + 0.1, 1.0):  # the slope it tells is that of its lift
        d = (beyond(x + 1e-6, 0.0, par)[0] - beyond(x - 1e-6, 0.0, par)[0]) / 2e-6
        assert beyond(x, 0.0, par)[2] == pytest.approx(d / ac.aero.CL_alpha, rel=1e-4)


def test_compressibility_is_helmbolds_and_tends_to_prandtl_and_glauerts() -> None:
    par = parameter_vector(load_aircraft("kc135r"), full=True)
    assert slope_factor(par[n.P_MACH], par) == 1.0
    a, t = par[n.P_ASPECT], math.tan(math.radians(35.0))

    def slope(m: float) -> float:
        b2 = 1.0 - m * m
        return 2.0 * math.pi * a / (2.0 + math.sqrt(4.0 + a * a * b2 * (1.0 + t * t / b2)))

    assert slope_factor(0.8, par) == pytest.approx(slope(0.8) / slope(0.62), rel=1e-9)
    par[n.P_ASPECT], par[n.P_SWEEP] = 1e6, 1.0
    assert slope_factor(0.8, par) == pytest.approx(math.sqrt((1.0 - 0.62**2) / (1.0 - 0.8**2)), rel=1e-5)


def test_drag_rises_by_a_tenth_per_mach_where_korn_says() -> None:
    par = parameter_vector(load_aircraft("kc135r"), full=True)
    c = math.cos(math.radians(35.0))
    diverges = 0.87 / c - 0.12 / c**2 - 0.45 / (10.0 * c**3)
    d = (wave_drag(diverges + 1e-6, 0.45, par) - wave_drag(diverges - 1e-6, 0.45, par)) / 2e-6
    assert d == pytest.approx(0.1, rel=1e-5)  # the definition of drag divergence: dCD/dM = 0.1
    assert wave_drag(0.62, 0.45, par) == 0.0
