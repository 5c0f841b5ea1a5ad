"""Station keeping of the receiver in Rerun: truth, estimate, command, error and its box; the boom's lane; scene and tabs."""

from __future__ import annotations

import rerun.blueprint as rrb

from ground.columns import Columns
from ground.link.packets import PHASES
from ground.rrd.layout import Layout, Look, Plots, Scene, past
from ground.rrd.palette import BACKGROUND, BOX, NAV, Color
from ground.rrd.series import AXIS, Sink
from ground.run import Run
from ground.views.refueling import integrity_draw
from ground.views.refueling.aircraft import NAMES, RECEIVER
from ground.views.refueling.integrity import MESSAGE
from ground.views.refueling.scene3d import scene3d
from ground.views.refueling.signals import signals

PERIOD_US = 100_000  # [us]
TRAIL_S = 30.0  # [s] length of trails behind the cursor
Point = tuple[float, float, float]
# eye and what it looks at [m], tanker's axes: near the boom, and far enough back for the observation position
NEAR = ((-54.0, -31.0, -9.0), (-19.0, 1.0, 3.0))
WIDE = ((-98.0, -20.0, -17.0), (-34.0, 20.0, 3.0))
STATES: dict[str, Color] = {
    "OBSERVATION": (70, 110, 170),
    "TO_PRECONTACT": (100, 140, 200),
    "PRECONTACT": (60, 150, 170),
    "TO_CONTACT": (220, 170, 60),
    "CONTACT": (60, 170, 80),
    "DISCONNECT": (200, 120, 60),
    "RETURN": (90, 120, 180),
    "BREAKAWAY": (210, 60, 60),
    "LEG": (70, 110, 150),
    "TURN": (170, 120, 60),
    "MEASURING": (50, 150, 70),
    "LATCHED": (120, 160, 60),
    "free": (80, 84, 92),
}
assert set(STATES) - {"MEASURING", "LATCHED", "free"} <= set(PHASES.values())


def draw(sink: Sink, run: Run) -> None:
    """Send everything of this module."""
    _relative(sink, run)
    _boom(sink, run.tlm)
    integrity_draw.draw(sink, run)
    scene3d(sink, run.truth, run.tlm)


def layout(run: Run, look: Look) -> Layout:
    """Formation and boom, overview and station keeping."""
    p = look.plots()
    scenes = [_scene("Formation (truth white, estimate orange)", WIDE), _scene("Boom", NEAR)]
    return Layout(
        rank=1,
        tabs=[overview(p), station(p), *([integrity_draw.tab(p)] if _has_integrity(run) else [])],
        scenes=scenes[::-1] if look.near else scenes,
        lanes=[f"guid/{NAMES[RECEIVER]}/boom"],
        states=STATES | integrity_draw.STATES,
    )


def _has_integrity(run: Run) -> bool:
    return run.tlm.get(RECEIVER, MESSAGE) is not None


def overview(p: Plots) -> rrb.Vertical:
    """What to look at first."""
    error = p.plot(
        "station-keeping error, truth - command [m]",
        ["guid/receiver/box", *(f"guid/receiver/error/{a}" for a in "xyz")],
        (-2.5, 2.5),
    )
    return rrb.Vertical(error, *p.wind("receiver"), name="Overview", row_shares=[1.3, 1, 1, 1])


def station(p: Plots) -> rrb.Vertical:
    """Station keeping in detail."""
    box = ["guid/receiver/box", "guid/receiver/target"]
    errors = [p.plot(f"error {a} [m]", [*box, f"guid/receiver/error/{a}"], (-2.5, 2.5)) for a in "xyz"]
    paths = [f"{k}/receiver/xi/{a}" for a in "xyz" for k in ("guid", "truth")]
    where = p.plot("relative position in tanker axes [m]", paths)
    return rrb.Vertical(*errors, where, name="Station keeping")


# path of a signal without the aircraft -> label, colour of each part, width
RELATIVE: dict[str, tuple[str, tuple[Color, ...], float]] = {
    "truth/xi": ("truth", AXIS, 1.5),
    "nav/xi": ("estimate", (NAV,) * 3, 1.0),
    "guid/xi": ("command", (BOX,) * 3, 1.0),
    "guid/error": ("error", AXIS, 1.5),
}


def _relative(sink: Sink, run: Run) -> None:
    """Station keeping of the receiver: truth, estimate, command, error and its box."""
    for s in signals(run):
        top, _, key = s.path.split("/", 2)
        label, colors, width = RELATIVE[f"{top}/{key}"]
        d = s if key == "error" else s.thinned(PERIOD_US)
        for i, axis in enumerate(s.parts):
            sink.series(f"{s.path}/{axis}", d.t_us, d.values[:, i], f"{axis} {label}", colors[i], width)
    sink.level("guid/receiver/box", (-2.0, 2.0), "box +-2 m", BOX)
    sink.level("guid/receiver/target", (-0.4, 0.4), "+-0.4 m", (110, 110, 90))


def _boom(sink: Sink, tlm: Columns) -> None:
    """The boom's lane: free, latched, measuring."""
    table = tlm.get(RECEIVER, "MISSION_STATUS")
    if table is None:
        return
    flags = [
        "MEASURING" if m else ("LATCHED" if k else "free")
        for m, k in zip(table["measure"], table["contact"], strict=True)
    ]
    sink.states(f"guid/{NAMES[RECEIVER]}/boom", table.t_us, flags, STATES)


def _scene(name: str, eye: tuple[Point, Point]) -> Scene:
    return rrb.Spatial3DView(
        origin="/",
        name=name,
        contents=[
            "truth/tanker/scene/**", "truth/receiver/scene/**", "truth/receiver/trail", "truth/tanker/boom/**",
            "truth/tanker/wind_arrow", "truth/receiver/wind_arrow", "nav/tanker/wind_arrow",
            "nav/receiver/wind_arrow", "guid/receiver/scene/**",
        ],
        overrides=past("truth/receiver/trail", seconds=TRAIL_S),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye[0],
            look_target=eye[1],
            eye_up=(0.0, 0.0, -1.0),
        ),
        line_grid=rrb.LineGrid3D(visible=False),
        background=rrb.Background(color=BACKGROUND),
    )  # fmt: skip
