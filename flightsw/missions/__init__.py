"""What each aircraft flies: one page per mission, read these first."""

from __future__ import annotations

from flightsw.missions.base import Mission
from flightsw.missions.gust import GustMission
from flightsw.missions.join import JoinMission
from flightsw.missions.receiver import ReceiverMission
from flightsw.missions.rendezvous import RendezvousMission
from flightsw.missions.tanker import TankerMission
from flightsw.missions.windshear import WindshearMission

MISSIONS: dict[str, type[Mission]] = {
    "tanker": TankerMission,
    "receiver": ReceiverMission,
    "rendezvous": RendezvousMission,
    "receiver_rendezvous": JoinMission,
    "gust": GustMission,
    "windshear": WindshearMission,
}
