"""The orders a mission's spec tabulates by phase (docs/reference/commands.md), against what the flying mission answers."""

from __future__ import annotations

import copy

import pytest

from flightsw.app import FlightApp
from flightsw.icd.dialect import HOUSE
from flightsw.missions.base import AnySpec, Order, find_mission
from flightsw.missions.gust.mission import ALLEVIATION, GustMission
from flightsw.missions.receiver import refuel
from flightsw.missions.receiver.en_route import JoinMission
from flightsw.missions.receiver.mission import ReceiverMission
from flightsw.missions.rendezvous.mission import RendezvousMission
from flightsw.missions.tanker.mission import TankerMission
from flightsw.missions.tanker.racetrack import LEG, TURN
from flightsw.missions.windshear.guidance import PHASES
from flightsw.missions.windshear.mission import FIRST_PHASE, WindshearMission
from flightsw.plugins import MISSIONS, ours
from flightsw.types import ACCEPTED, UNSUPPORTED, Command, SensorFrame
from tests.sil.conftest import Flown

FLOWN = {  # mission -> scenario, aircraft
    "tanker": ("refueling", "tanker"), "receiver": ("refueling", "receiver"),
    "rendezvous": ("rendezvous_to_contact", "tanker"), "receiver_rendezvous": ("rendezvous_to_contact", "receiver"),
    "gust": ("gust", "alexis"), "windshear": ("windshear", "twinjet"),
}  # fmt: skip
WHERE = {refuel.OBSERVATION: "observation_m", refuel.PRECONTACT: "precontact_m", refuel.TO_CONTACT: "contact_m",
         refuel.CONTACT: "contact_m", refuel.DISCONNECT: "contact_m"}  # fmt: skip


def command(o: Order) -> Command:
    params = [0.0] * 7
    if o.word == "speed":
        params[1:3] = 195.0, -1.0
    if o.value is not None:
        params[0] = float(o.value)
    return Command(o.command, tuple(params), 255, 190)


def accepted(o: Order, phase: int) -> bool:
    """What the table says of aircraft that name no law of somebody else."""
    return phase in o.phases and o.word != "other"


def place(mission: object, phase: int) -> None:
    """Put a flying mission into a phase, all well in it."""
    if isinstance(mission, JoinMission):
        mission.joined = phase in refuel.UNDER_WAY
        if not mission.joined:
            mission.guid.phase = phase
            return
        mission = mission.refuel
    if isinstance(mission, ReceiverMission):
        g = mission.guid
        g.phase, g.blind, g.error_m = phase, "", 0.0
        g.pos = getattr(g.p, WHERE.get(phase, "behind_m"))
    elif isinstance(mission, RendezvousMission):
        mission.joined = phase in (LEG, TURN)
        mission.out.phase = phase
    elif isinstance(mission, TankerMission):
        mission.guid.phase = phase  # type: ignore[attr-defined]
    elif isinstance(mission, GustMission):
        mission.guid.phase = phase
        mission.ctrl.flying = int(phase == ALLEVIATION)
    else:
        assert isinstance(mission, WindshearMission)
        mission.guid.phase = phase
        mission.guidance.phase = PHASES[max(phase - FIRST_PHASE, 0)]


@pytest.fixture(params=FLOWN)
def flying(request: pytest.FixtureRequest, flown: Flown) -> tuple[AnySpec, FlightApp]:
    scenario, name = FLOWN[request.param]
    _, flight = flown(scenario)
    app = next(n.app for n in flight.nodes if n.cfg.app.name == name)
    assert isinstance(app, FlightApp) and app.spec.name == request.param
    return app.spec, app


def test_every_mission_is_asked() -> None:
    assert set(FLOWN) == set(ours(MISSIONS))
    for name in FLOWN:
        spec = find_mission(name, "test")
        assert set(spec.phases) <= set(HOUSE.enums["WKF_PHASE"]) and spec.phases[0] == 0
        assert all(o.phases <= set(spec.phases) for o in spec.orders)
        assert (
            len({(o.command, o.value) for o in spec.orders}) == len({o.word for o in spec.orders}) == len(spec.orders)
        )


def test_the_aircraft_in_flight_answers_as_the_table_says(flying: tuple[AnySpec, FlightApp]) -> None:
    spec, app = flying
    phase = app.guid.phase
    assert phase in spec.phases and phase != 0
    for o in spec.orders:
        frame = SensorFrame(t_us=app.nav.t_us, commands=[command(o)])
        _, snap = copy.deepcopy(app).tick(frame, 0.01)
        (ack,) = snap.acks
        assert (ack.result == ACCEPTED) == accepted(o, phase), (o.word, ack)
        assert ack.result != UNSUPPORTED


def test_in_every_phase_the_mission_answers_as_the_table_says(flying: tuple[AnySpec, FlightApp]) -> None:
    spec, app = flying
    wrong = []
    for phase in spec.phases:
        for o in spec.orders:
            mission = copy.deepcopy(app.mission)
            place(mission, phase)
            result, why = mission.obey(command(o))
            if (result == ACCEPTED) != accepted(o, phase):
                wrong.append((phase, o.word, result, why))
    assert wrong == []
