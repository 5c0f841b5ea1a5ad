"""What a scenario may ask of this kind; entry point of `wakefield.aircraft`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.aircraft import TwinJet
from sim_plant.aircraft.kind import Kind, Setup

if TYPE_CHECKING:
    from sim_plant.aircraft.base import Member


def _build(setup: Setup) -> Member:
    from sim_plant.aircraft.twinjet.member import TwinJetMember

    return TwinJetMember(setup)


def _table() -> type:
    from sim_plant.aircraft.twinjet.member import TwinJetTable

    return TwinJetTable


KIND = Kind(
    TwinJet, _build, _table, carries=("imu", "baro", "gnss", "att", "radalt"), surfaces=("elevator",),
    mismatch=("mass", "inertia", "thrust", "lag"),
)  # fmt: skip
