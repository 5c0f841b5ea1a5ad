"""truth/receiver/join/..., guid/receiver/join/...: the receiver's way to the tanker, its plots, their tab.

Side view and view from above in the tanker's axes over the last stretch, with the vortex cores of the wing; distance, closure
as flown and as wanted; heights.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from flightsw.aircraft import load_aircraft
from ground.columns import Columns, hold
from ground.rrd.layout import Layout, Look, Plots, past
from ground.rrd.outline import ABOVE, SIDE, placed
from ground.rrd.palette import BOX, NAV, Color
from ground.rrd.series import Sink
from ground.run import Run
from ground.views.joinup.figures import CONTACT, JOIN_UP, OBSERVATION, WAKE_OF, first_us
from ground.views.joinup.signals import PERIOD_US, signals
from ground.views.refueling.aircraft import RECEIVER
from ground.views.refueling.palette import COLOR
from ground.views.rendezvous.draw import rendezvous_map
from ground.views.rendezvous.read import has_rendezvous

ROOT = "truth/receiver/join"
TANKER_M, RECEIVER_M = 41.5, 13.2  # lengths
STRETCH_M = 450.0  # what the two views show
CORE = (230, 90, 90)
# the tanker and its name in full, and the stretch behind it [m]
ABOVE_M = rrb.VisualBounds2D(x_range=[-160.0, 240.0], y_range=[-50.0, STRETCH_M])
SIDE_M = rrb.VisualBounds2D(x_range=[-STRETCH_M, 75.0], y_range=[-60.0, 90.0])
# signal without the aircraft -> label, colour, how long a row may still change [us]
LINES: dict[str, tuple[str, Color, int]] = {
    "truth/join/distance": ("distance", COLOR["receiver"], 0),
    "truth/join/closure": ("closure", COLOR["receiver"], 2 * PERIOD_US),
    "guid/join/closure": ("wanted", BOX, 0),
    "truth/join/height": ("height over the tanker", NAV, 0),
}
PHASES: dict[str, Color] = {"ENROUTE": (80, 120, 110), "JOIN_UP": (190, 140, 70)}


def span(tlm: Columns, end_s: float) -> tuple[float, float]:
    """Time range [s] of the first look: until a minute after contact is reached."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    stop = first_us(status, CONTACT) if status is not None else None
    return 0.0, end_s if stop is None else min(stop * 1e-6 + 60.0, end_s)


def until_joinup(truth: Columns, tlm: Columns) -> Columns:
    """The part of the truth a plan of the rendezvous should show: up to the join-up."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    start = first_us(status, JOIN_UP) if status is not None else None
    return truth if start is None else truth.until(start)


def joinup(sink: Sink, run: Run) -> None:
    """Send everything of this module; nothing for a run without join-up."""
    made = {s.path.split("/", 2)[0] + "/" + s.path.split("/", 2)[2]: s.thinned(PERIOD_US) for s in signals(run)}
    for path, (label, color, settle_us) in LINES.items():
        if path in made:
            s, (top, key) = made[path], path.split("/", 1)
            sink.series(f"{top}/receiver/{key}", s.t_us, s.values, label, color, settle_us=settle_us)
    true, status = run.truth.get(RECEIVER, "TRUTH"), run.tlm.get(RECEIVER, "MISSION_STATUS")
    if not made or true is None or status is None:
        return
    d = true.decimated(PERIOD_US)
    phase = hold(d.t_us, status.t_us, status["phase"])
    _views(sink, d["xi"].astype(np.float64), d.t_us, (phase == JOIN_UP) | (phase == OBSERVATION))


@cache
def _span() -> float:
    return load_aircraft(WAKE_OF).geometry.b_m


def _views(sink: Sink, xi: np.ndarray, t_us: np.ndarray, joined: np.ndarray) -> None:
    """Path in the tanker's axes from above (forward up) and from behind (right, down)."""
    y = np.pi / 8.0 * _span()
    near = joined & (xi[:, 0] > -STRETCH_M)
    for name, a, b, signs in (("above", 1, 0, (1.0, -1.0)), ("side", 0, 2, (1.0, 1.0))):
        path = np.stack([signs[0] * xi[:, a], signs[1] * xi[:, b]], axis=1)
        at = f"{ROOT}/{name}"
        sink.trail(f"{at}/path", t_us[near], path[near], COLOR["receiver"])
        outline, nose = (ABOVE, 0.5 * np.pi) if name == "above" else (SIDE, 0.0)
        spot = rr.LineStrips2D.from_fields(
            colors=[COLOR["receiver"]], radii=rr.Radius.ui_points(1.5), labels=["receiver"]
        )
        sink.look(f"{at}/spot", spot)
        shapes = placed(outline, path[near], np.full(int(near.sum()), nose), RECEIVER_M)
        sink.rows(f"{at}/spot", t_us[near], rr.LineStrips2D, strips=shapes)
        own = placed(outline, np.zeros((1, 2)), np.array([nose]), TANKER_M)
        thick = rr.Radius.ui_points(1.8)
        sink.look(f"{at}/tanker", rr.LineStrips2D(own, colors=[COLOR["tanker"]], radii=thick, labels=["tanker"]))
        if name == "above":
            lines = [[[s * y, 0.0], [s * y, STRETCH_M]] for s in (-1.0, 1.0)]
        else:
            back = STRETCH_M * np.array([-np.cos(0.06), -np.sin(0.06)])
            lines = [[[0.0, 0.0], back.tolist()]]
        cores = rr.LineStrips2D(lines, colors=[CORE], radii=rr.Radius.ui_points(1.0))
        sink.look(f"{at}/cores", cores)


def layout(run: Run, look: Look) -> Layout:
    """The tab of this module, and the plan of the rendezvous it came from, if any, up to the join-up."""
    first = span(run.tlm, look.end_s)
    plan = (
        []
        if look.near or not has_rendezvous(run.tlm)
        else [rendezvous_map(Columns() if look.live else until_joinup(run.truth, run.tlm))]
    )
    return Layout(rank=3, tabs=[joinup_tab(look.plots(first))], scenes=plan, states=PHASES, span=first)


def joinup_tab(p: Plots) -> rrb.Vertical:
    """Plots and views of this module."""
    above, side = (
        rrb.Spatial2DView(
            origin="/", contents=[f"{ROOT}/{k}/**"], name=title, overrides=past(f"{ROOT}/{k}/path"), visual_bounds=seen
        )
        for k, title, seen in (
            ("above", "from above, tanker's axes [m]", ABOVE_M),
            ("side", "from the side [m]", SIDE_M),
        )
    )
    return rrb.Vertical(
        rrb.Horizontal(above, side, column_shares=[1.0, 1.6]),
        p.plot("distance to the tanker [m]", [f"{ROOT}/distance"]),
        p.plot("closure: flown, wanted [m/s]", [f"{ROOT}/closure", "guid/receiver/join/closure"], (-3.0, 20.0)),
        p.plot("height over the tanker [m]", [f"{ROOT}/height"]),
        p.plot("true airspeed [m/s]", ["truth/tanker/V", "truth/receiver/V"], (190.0, 220.0)),
        name="Join-up",
        row_shares=[1.7, 1, 1, 1, 1],
    )
