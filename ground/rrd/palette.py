"""Colours [r, g, b] of plots and scene, chosen once: truth and estimate look the same everywhere."""

from __future__ import annotations

Color = tuple[int, int, int]
TRUTH: Color = (235, 235, 235)
NAV: Color = (255, 150, 50)
BOX: Color = (240, 210, 70)
COMMAND: Color = (240, 90, 220)
CRAFTS: tuple[Color, ...] = (
    (120, 190, 255),
    (120, 230, 140),
    (240, 160, 120),
    (200, 170, 255),
)  # aircraft in their order
STATES: dict[str, Color] = {  # of lanes, whatever is flown; a layout adds those of its mission
    "INIT": (110, 110, 110),
    "HOLD": (140, 120, 170),
    "DEGRADED": (200, 60, 90),
    "ok": (55, 105, 70),
}
