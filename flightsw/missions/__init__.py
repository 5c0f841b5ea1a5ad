"""What each aircraft flies: one page per mission, read these first."""

from __future__ import annotations

from flightsw.missions.receiver import ReceiverMission
from flightsw.missions.tanker import TankerMission

MISSIONS = {"tanker": TankerMission, "receiver": ReceiverMission}
