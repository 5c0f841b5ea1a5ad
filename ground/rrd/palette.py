"""Colours [r, g, b] of plots and scene, chosen once: truth and estimate look the same everywhere."""

from __future__ import annotations

Color = tuple[int, int, int]
TRUTH: Color = (235, 235, 235)
NAV: Color = (255, 150, 50)
BOX: Color = (240, 210, 70)
COLOR: dict[str, Color] = {
    "tanker": (120, 190, 255),
    "receiver": (120, 230, 140),
    "command": (240, 90, 220),
    "envelope": (60, 190, 190),
    "boom": (150, 150, 155),
    "inside": (245, 200, 60),
    "latched": (70, 230, 90),
}
PHASE_COLORS: dict[str, Color] = {
    "INIT": (110, 110, 110),
    "OBSERVATION": (70, 110, 170),
    "TO_PRECONTACT": (100, 140, 200),
    "PRECONTACT": (60, 150, 170),
    "TO_CONTACT": (220, 170, 60),
    "CONTACT": (60, 170, 80),
    "DISCONNECT": (200, 120, 60),
    "RETURN": (90, 120, 180),
    "BREAKAWAY": (210, 60, 60),
    "HOLD": (140, 120, 170),
    "LEG": (70, 110, 150),
    "TURN": (170, 120, 60),
    "DEGRADED": (200, 60, 90),
    "ENROUTE": (80, 120, 110),
    "JOIN_UP": (190, 140, 70),
    "RDV_APPROACH": (70, 120, 150),
    "RDV_TURN": (200, 150, 60),
    "RDV_ROLLOUT": (150, 160, 70),
    "GUST_HOLD": (120, 124, 132),
    "GUST_ALLEVIATION": (60, 150, 170),
    "WS_APPROACH": (70, 120, 150),
    "WS_CAUTION": (220, 170, 60),
    "WS_ESCAPE": (210, 60, 60),
    "WS_CLEAR": (60, 170, 80),
    "MEASURING": (50, 150, 70),
    "LATCHED": (120, 160, 60),
    "free": (80, 84, 92),
    "ok": (55, 105, 70),
    "SAT": (150, 130, 50),
}
