"""Colours of the two aircraft, the boom and the command."""

from __future__ import annotations

from ground.rrd.palette import COMMAND, CRAFTS, Color

COLOR: dict[str, Color] = {
    "tanker": CRAFTS[0],
    "receiver": CRAFTS[1],
    "command": COMMAND,
    "envelope": (60, 190, 190),
    "boom": (150, 150, 155),
    "inside": (245, 200, 60),
    "latched": (70, 230, 90),
}
