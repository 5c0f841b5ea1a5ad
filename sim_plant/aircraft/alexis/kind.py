"""What a scenario may ask of this kind; entry point of `wakefield.aircraft`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import Alexis
from sim_plant.aircraft.kind import Kind, Setup

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member


def _build(setup: Setup) -> Member:
    from sim_plant.aircraft.alexis.member import AlexisMember

    return AlexisMember(setup)


def _table() -> type:
    from sim_plant.aircraft.alexis.member import AlexisTable

    return AlexisTable


# the flap stands in the aileron's place
KIND = Kind(Alexis, _build, _table, surfaces=("aileron", "elevator"))
