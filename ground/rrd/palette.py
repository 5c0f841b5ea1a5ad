"""Colours [r, g, b] of plots and scenes, chosen once: truth and estimate look the same everywhere. All but `WHITE` can be told
from the background of the viewer's dark theme and of its light one; `WHITE` is for scenes with a `BACKGROUND` of their own.
"""

from __future__ import annotations

Color = tuple[int, int, int]
TRUTH: Color = (140, 146, 154)
NAV: Color = (232, 112, 20)
BAND: Color = (156, 100, 50)  # limits about an estimate
BOX: Color = (178, 138, 10)
COMMAND: Color = (214, 70, 196)
ALARM: Color = (214, 80, 70)
CRAFTS: tuple[Color, ...] = (
    (50, 130, 220),
    (30, 150, 80),
    (200, 90, 110),
    (150, 110, 225),
)  # aircraft in their order
STATES: dict[str, Color] = {  # of lanes, whatever is flown; a layout adds those of its mission
    "INIT": (110, 110, 110),
    "HOLD": (140, 120, 170),
    "DEGRADED": (200, 60, 90),
    "ok": (55, 105, 70),
}
BACKGROUND: Color = (24, 30, 40)
WHITE: Color = (235, 235, 235)
