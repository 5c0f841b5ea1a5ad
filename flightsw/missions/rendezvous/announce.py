"""What the tanker tells its crew and the ground about a meeting that will not end in place, in words."""

from __future__ import annotations

from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous.guidance import RendezvousCommand
from flightsw.types import Text

NM = 1852.0
WARNING, NOTICE = 4, 5


def announcements(c: RendezvousCommand) -> list[Text]:
    """Texts of what a command announces (SAY_*), misses as predicted or reached; nothing for 0."""
    said, x, y = c.announced, c.miss_x_m / NM, c.miss_y_m / NM
    out = []
    if said & kv.SAY_FAR:
        out.append(Text(WARNING, f"rendezvous out of reach, {x:+.1f} {y:+.1f} NM"))
    elif said & kv.SAY_LEG:
        out.append(Text(NOTICE, f"turn ends off the track, {x:+.1f} {y:+.1f} NM: leg"))
    if said & kv.SAY_SPEED:
        out.append(Text(WARNING, "receiver's speed beyond the tanker's"))
    if said & kv.SAY_MISSED:
        out.append(Text(WARNING, f"rendezvous missed by {x:+.2f} {y:+.2f} NM"))
    return out
