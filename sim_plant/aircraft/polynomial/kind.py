"""What a scenario may ask of this kind; entry point of `wakefield.aircraft`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import Aircraft
from sim_plant.aircraft.kind import Kind, Setup

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member


def _build(setup: Setup) -> Member:
    from sim_plant.aircraft.polynomial.member import PolynomialMember

    return PolynomialMember(setup)


def _table() -> type:
    from sim_plant.aircraft.polynomial.table import PolynomialTable

    return PolynomialTable


KIND = Kind(
    Aircraft,
    _build,
    _table,
    carries=("imu", "baro", "mag", "gnss", "att", "fuel"),
    surfaces=("aileron", "elevator", "rudder"),
    takes=("fuel_kg", "aero_error_frac", "upset"),
    mismatch=("mass", "inertia", "thrust", "lag", "servo"),
    formation=True,
    any_density=True,
)
