"""What each aircraft flies: one page per mission, read these first."""

from __future__ import annotations

from flightsw.missions.base import Mission
from flightsw.missions.gust.mission import GustMission
from flightsw.missions.receiver.en_route import JoinMission
from flightsw.missions.receiver.mission import ReceiverMission
from flightsw.missions.rendezvous.mission import RendezvousMission
from flightsw.missions.tanker.mission import TankerMission
from flightsw.missions.windshear.mission import WindshearMission

MISSIONS: dict[str, type[Mission]] = {
    "tanker": TankerMission,
    "receiver": ReceiverMission,
    "rendezvous": RendezvousMission,
    "receiver_rendezvous": JoinMission,
    "gust": GustMission,
    "windshear": WindshearMission,
}
