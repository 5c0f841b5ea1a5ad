"""Onboard atmosphere against the published standard (aircraft-data.md section 8) and against the plant's own."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from flightsw.aircraft import load_aircraft
from flightsw.kernels.atmosphere import GAMMA, P0, calibrated_airspeed, density, pressure, sound_speed, temperature
from flightsw.sixdof.actuators import thrust_available
from sim_plant.aircraft.sixdof.params import parameter_vector
from sim_plant.aircraft.sixdof.propulsion import thrust_available as plant_thrust
from sim_plant.kernels.atmosphere import isa

repeatable = settings(deadline=None, derandomize=True)  # no timed verdicts, the same examples every run
# US Standard Atmosphere 1976, geopotential height [m]: T [K], rho [kg/m^3], a [m/s]
TABLE = [
    (0.0, 288.15, 1.2250, 340.29),
    (6096.0, 248.53, 0.6527, 316.03),
    (7010.0, 242.59, 0.5888, 312.23),
    (7620.0, 238.62, 0.5489, 309.67),
    (11000.0, 216.65, 0.36392, 295.07),
    (12192.0, 216.65, 0.3016, 295.07),
    (20000.0, 216.65, 0.08803, 295.07),
]


@pytest.mark.parametrize("row", TABLE, ids=lambda r: f"{r[0]:.0f} m")
def test_the_published_table_is_met_to_its_last_figure(row: tuple[float, ...]) -> None:
    h, t, rho, a = row
    assert abs(temperature(h) - t) < 0.0051
    assert abs(density(h) - rho) < 5.1e-5
    assert abs(sound_speed(h) - a) < 0.0051


@repeatable
@given(st.floats(0.0, 20000.0))
def test_the_plant_has_the_same_atmosphere(h: float) -> None:
    """Written twice on purpose; the two differ by the last digit of the gas constant only (287.053, 287.05287)."""
    t, _, rho, a = isa(h)
    assert abs(temperature(h) / t - 1) < 1e-12
    assert abs(density(h) / rho - 1) < 2e-6
    assert abs(sound_speed(h) / a - 1) < 1e-6


@repeatable
@given(st.floats(0.0, 19999.0), st.floats(0.1, 1.0))
def test_density_falls_with_height_without_a_step(h: float, dh: float) -> None:
    assert density(h + dh) < density(h)
    assert density(h + dh) / density(h) - 1 > -2e-4 * dh


KT = 1852.0 / 3600.0  # [m/s]


@pytest.mark.parametrize(
    ("h_ft", "mach", "tas_kt", "cas_kt"),
    [
        (0.0, 1.0, 661.47, 661.47),  # the speed of sound at sea level, by which CAS is defined
        (10_000.0, None, 250.0, 216.1),  # computers of the E6B kind
        (35_000.0, 0.80, 461.1, 271.9),  # cruise tables of jet transports: M 0.80 at FL350 is 272 KCAS
    ],
)
def test_calibrated_airspeed_is_the_published_one(
    h_ft: float, mach: float | None, tas_kt: float, cas_kt: float
) -> None:
    h = 0.3048 * h_ft
    V = tas_kt * KT if mach is None else mach * sound_speed(h)
    assert pytest.approx(tas_kt, abs=0.06) == V / KT
    assert calibrated_airspeed(V, h) / KT == pytest.approx(cas_kt, abs=0.06)


@settings(repeatable, max_examples=25)
@given(st.floats(15.0, 290.0), st.floats(0.0, 15000.0))
def test_calibrated_airspeed_is_what_a_pitot_tube_at_sea_level_would_make_of_the_same_pressure(
    V: float, h: float
) -> None:
    """Bernoulli's integral of dp / rho from static to impact pressure, taken numerically, both ways: no closed form."""

    def speed(q: float, p: float, rho: float) -> float:
        work, _ = quad(lambda x: 1.0 / (rho * (x / p) ** (1.0 / GAMMA)), p, p + q, epsrel=1e-11)
        return (2.0 * work) ** 0.5

    p, rho = pressure(h), density(h)
    impact = brentq(lambda q: speed(q, p, rho) - V, 1e-3, 4.0 * p, xtol=1e-9)
    assert calibrated_airspeed(V, h) == pytest.approx(speed(impact, P0, density(0.0)), rel=1e-7)
    assert calibrated_airspeed(V, 0.0) == pytest.approx(V, rel=1e-12)
    equivalent = V * (rho / density(0.0)) ** 0.5
    assert equivalent * (1.0 - 1e-9) <= calibrated_airspeed(V, h) <= V * (1.0 + 1e-9)


@repeatable
@given(st.sampled_from(["kc135r", "learjet24"]), st.floats(1000.0, 10900.0), st.floats(60.0, 250.0))
def test_thrust_available_is_the_plants(name: str, h: float, V: float) -> None:
    """The throttle is a fraction of this figure on both sides of the link: a difference would be a steady thrust
    error.
    """
    ac = load_aircraft(name)
    _, _, rho, a = isa(h)
    assert abs(thrust_available(ac, h, V) / plant_thrust(h, V / a, rho, parameter_vector(ac)) - 1) < 1e-5


def test_thrust_available_at_the_refuelling_point_is_the_published_figure() -> None:
    """154 kN at 7010 m, M 0.62 (aircraft-data.md 2.3); 0.486 of static at M 0.6 (1.3)."""
    a = sound_speed(7010.0)
    assert thrust_available(load_aircraft("kc135r"), 7010.0, 0.62 * a) == pytest.approx(154e3, rel=0.01)
    assert thrust_available(load_aircraft("learjet24"), 7010.0, 0.6 * a) == pytest.approx(12.8e3, rel=0.01)
