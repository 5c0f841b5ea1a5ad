"""Integrity of the relative position in Rerun: level, limit, error and sigma per axis, tests, a lane for each source."""

from __future__ import annotations

import rerun.blueprint as rrb

from ground.rrd.layout import Plots, Tab
from ground.rrd.palette import ALARM, BAND, BOX, CRAFTS, NAV, TRUTH, Color
from ground.rrd.series import Sink
from ground.run import Run
from ground.views.refueling.aircraft import RECEIVER
from ground.views.refueling.integrity import LIVE, MESSAGE, SAID, SOURCES, signals

ROOT = "nav/receiver/integrity"
LINES: dict[str, tuple[str, Color, float]] = {
    "error": ("size of the true error", TRUTH, 1.2),
    "sigma": ("1 sigma", BAND, 1.0),
    "pl": ("protection level", NAV, 1.6),
    "al": ("alert limit", ALARM, 1.4),
}
STATES: dict[str, Color] = {
    "in use": (55, 105, 70), LIVE: (70, 110, 150), "not live": (80, 84, 92), "excluded": (200, 60, 60),
    "undecided": (200, 150, 50),
}  # fmt: skip


def draw(sink: Sink, run: Run) -> None:
    """Send everything of this module; nothing for a run without the message."""
    for s in signals(run):
        key = s.path.removeprefix(f"nav/{run.names[RECEIVER]}/integrity/")
        if s.is_text:
            sink.states(f"{ROOT}/{key}", s.t_us, s.values.tolist(), STATES)
        elif key == "ratio":
            for i, source in enumerate(s.parts):
                sink.series(f"{ROOT}/ratio/{source}", s.t_us, s.values[:, i], SAID[source], CRAFTS[i], 1.2)
        elif key in LINES:
            label, color, width = LINES[key]
            for i, axis in enumerate(s.parts):
                sink.series(f"{ROOT}/{key}/{axis}", s.t_us, abs(s.values[:, i]), f"{axis} {label}", color, width)
    if run.tlm.get(RECEIVER, MESSAGE) is not None:
        sink.level(f"{ROOT}/threshold", (1.0, 1.0), "threshold", BOX)


def tab(p: Plots) -> Tab:
    """The tab "Integrity"."""
    axes = [p.plot(f"protection level {a} [m]", [f"{ROOT}/{k}/{a}" for k in LINES], (0.0, 4.0)) for a in "xyz"]
    tests = p.plot(
        "largest statistic / threshold", [f"{ROOT}/threshold", *(f"{ROOT}/ratio/{s}" for s in SOURCES)], (0.0, 3.0)
    )
    lanes = rrb.StateTimelineView(
        origin="/",
        contents=[f"{ROOT}/state/{s}" for s in SOURCES],
        name="Sources of the relative position",
        time_view=p.time,
    )
    return rrb.Vertical(*axes, tests, lanes, name="Integrity", row_shares=[1, 1, 1, 1, 1.7])
