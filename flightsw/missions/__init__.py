"""What each aircraft flies: one page per mission, read these first."""

from __future__ import annotations

from flightsw.missions.receiver import ReceiverMission
from flightsw.missions.tanker import TankerMission

MISSIONS: dict[str, type[TankerMission] | type[ReceiverMission]] = {
    "tanker": TankerMission,
    "receiver": ReceiverMission,
}
