"""What a scenario may ask of this kind; entry point of `wakefield.aircraft`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import Aircraft
from sim_plant.aircraft.kind import Kind, Setup

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member
    from sim_plant.flown import Flown, Scene


def _build(setup: Setup) -> Member:
    from sim_plant.aircraft.sixdof.member import SixDofMember

    return SixDofMember(setup)


def _together(scene: Scene) -> Flown | None:
    from sim_plant.aircraft.sixdof.together import together

    return together(scene)


KIND = Kind(
    Aircraft,
    _build,
    carries=("imu", "baro", "mag", "gnss", "att", "fuel"),
    surfaces=("aileron", "elevator", "rudder"),
    takes=("fuel_kg", "aero_error_frac", "airframe", "upset"),
    mismatch=("mass", "inertia", "thrust", "lag", "servo"),
    formation=True,
    round_earth=True,
    any_density=True,
    together=_together,
)
