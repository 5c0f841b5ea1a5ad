"""What a scenario may ask of this kind; entry point of `wakefield.aircraft`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import Aircraft
from sim_plant.aircraft.kind import Kind, Setup

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member


def _build(setup: Setup) -> Member:
    from sim_plant.aircraft.jsbsim.member import JsbsimMember

    return JsbsimMember(setup)


def _table() -> type:
    from sim_plant.aircraft.jsbsim.table import JsbsimTable

    return JsbsimTable


KIND = Kind(
    Aircraft,
    _build,
    _table,
    carries=("imu", "baro", "mag", "gnss", "att", "fuel"),
    surfaces=("aileron", "elevator", "rudder"),
    takes=("fuel_kg", "aero_error_frac"),
    mismatch=("mass", "inertia", "thrust", "lag", "servo"),
    formation=True,
    round_earth=True,
    any_density=True,
)
