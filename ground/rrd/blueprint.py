"""What the viewer shows first: scene on the left, plots on the right, modes below. With `ground.rrd` the only importer
of rerun.
"""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

TRAIL_S = 30.0  # [s] length of trails behind the cursor
BOTH = ("tanker", "receiver")
SURFACES = ("aileron", "elevator", "rudder")
Span = tuple[float, float]
Point = tuple[float, float, float]


class Plots:
    """Makes the plots of one layout: all begin with the same time range [s] and share its zoom."""

    def __init__(self, start_s: float, end_s: float) -> None:
        at = rrb.TimeRangeBoundary.absolute
        window = rrb.TimeRange(start=at(seconds=start_s), end=at(seconds=end_s))
        self.time = rrb.TimeAxis(link=rrb.components.LinkAxis.Independent, view_range=window)

    def plot(self, name: str, contents: list[str], span: Span | None = None) -> rrb.TimeSeriesView:
        """A plot of the named entities; `span` fixes the first vertical range."""
        return rrb.TimeSeriesView(
            origin="/",
            contents=contents,
            name=name,
            axis_x=self.time,
            axis_y=rrb.ScalarAxis(range=span, zoom_lock=False) if span else None,
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        )

    def wind(self, aircraft: str) -> list[rrb.TimeSeriesView]:
        """Wind north, east, down: truth, estimate, 3-sigma limits."""
        kinds = ("nav/{}/wind_3sigma/{}", "truth/{}/wind/{}", "nav/{}/wind/{}")
        return [
            self.plot(f"{aircraft} wind {label} [m/s]", [k.format(aircraft, a) for k in kinds])
            for a, label in (("n", "north"), ("e", "east"), ("d", "down"))
        ]

    def overview(self) -> rrb.Vertical:
        """What to look at first."""
        error = self.plot(
            "station-keeping error, truth - command [m]",
            ["guid/receiver/box", *(f"guid/receiver/error/{a}" for a in "xyz")],
            (-2.5, 2.5),
        )
        return rrb.Vertical(error, *self.wind("receiver"), name="Overview", row_shares=[1.3, 1, 1, 1])

    def station(self) -> rrb.Vertical:
        """Station keeping in detail."""
        box = ["guid/receiver/box", "guid/receiver/target"]
        errors = [self.plot(f"error {a} [m]", [*box, f"guid/receiver/error/{a}"], (-2.5, 2.5)) for a in "xyz"]
        paths = [f"{k}/receiver/xi/{a}" for a in "xyz" for k in ("guid", "truth")]
        where = self.plot("relative position in tanker axes [m]", paths)
        return rrb.Vertical(*errors, where, name="Station keeping")

    def wind_tab(self) -> rrb.Horizontal:
        """Wind of both aircraft side by side."""
        return rrb.Horizontal(*(rrb.Vertical(*self.wind(a), name=a) for a in BOTH), name="Wind")

    def flight(self) -> rrb.Vertical:
        """Airspeed, altitude, attitude."""
        return rrb.Vertical(
            self.plot("true airspeed [m/s]", [*(f"truth/{a}/V" for a in BOTH), "guid/tanker/V"]),
            self.plot("altitude [m]", [*(f"truth/{a}/altitude" for a in BOTH), "guid/tanker/altitude"]),
            self.plot("bank [deg]", [f"truth/{a}/bank" for a in BOTH]),
            self.plot("pitch [deg]", [f"truth/{a}/pitch" for a in BOTH]),
            self.plot("mass [kg]", [f"truth/{a}/mass" for a in ("receiver",)]),
            name="Flight",
        )

    def controls(self) -> rrb.Vertical:
        """Surfaces, throttle, thrust."""
        surfaces = [
            self.plot(
                f"{a} surfaces, actual (bold) and commanded [deg]",
                [f"{k}/{s}" for k in (f"truth/{a}/controls", f"ctrl/{a}") for s in SURFACES],
            )
            for a in ("receiver", "tanker")
        ]
        throttle = self.plot("throttle [%]", [f"ctrl/{a}/throttle" for a in BOTH])
        thrust = self.plot("thrust [kN]", [f"truth/{a}/controls/thrust" for a in BOTH])
        return rrb.Vertical(*surfaces, throttle, thrust, name="Controls")

    def timing(self) -> rrb.Vertical:
        """Loop timing and the filter's own opinion of itself."""
        execution = [f"timing/{a}/exec_{k}" for a in BOTH for k in ("mean", "max")]
        lateness = [f"timing/{a}/late_{k}" for a in BOTH for k in ("p50", "p99", "max")]
        lost = [f"timing/{a}/{k}" for a in BOTH for k in ("slips", "telemetry_lost")]
        return rrb.Vertical(
            self.plot("execution time of a tick [us] (0 in lockstep)", execution),
            self.plot("wake-up lateness [us] (0 in lockstep)", lateness),
            self.plot("slips and lost telemetry packets", lost),
            self.plot("normalised innovation squared / dof", [f"nav/{a}/nis" for a in BOTH], (0.0, 4.0)),
            name="Timing and filter",
        )

    def sensors(self) -> rrb.Vertical:
        """What the onboard software was fed."""
        speed = [
            self.plot(
                f"{a} airspeed: probes, truth, estimate [m/s]",
                [f"{k}/{a}/V" for k in ("truth", "nav")] + [f"sensors/{a}/air/V"],
            )
            for a in BOTH
        ]
        force = [self.plot(f"{a} specific force [m/s2]", [f"sensors/{a}/imu/acc/**"]) for a in BOTH]
        rejected = [f"sensors/{a}/{k}" for a in BOTH for k in ("bad_packets", "rejected")]
        return rrb.Vertical(*speed, *force, self.plot("packets and samples rejected", rejected), name="Sensors")


# eye and what it looks at [m], tanker's axes: near the boom, and far enough back for the observation position
NEAR = ((-54.0, -31.0, -9.0), (-19.0, 1.0, 3.0))
WIDE = ((-98.0, -20.0, -17.0), (-34.0, 20.0, 3.0))


def _scene(name: str, eye: tuple[Point, Point]) -> rrb.Spatial3DView:
    window = rrb.VisibleTimeRange(
        "sim_time",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-TRAIL_S),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    trail = rrb.VisibleTimeRanges([window])
    return rrb.Spatial3DView(
        origin="/",
        name=name,
        contents=[
            "truth/tanker/scene/**", "truth/receiver/scene/**", "truth/receiver/trail", "truth/tanker/boom/**",
            "truth/tanker/wind_arrow", "truth/receiver/wind_arrow", "nav/tanker/wind_arrow",
            "nav/receiver/wind_arrow", "guid/receiver/scene/**",
        ],
        overrides={"truth/receiver/trail": trail},
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=eye[0],
            look_target=eye[1],
            eye_up=(0.0, 0.0, -1.0),
        ),
        line_grid=rrb.LineGrid3D(visible=False),
        background=rrb.Background(color=(24, 30, 40)),
    )  # fmt: skip


class NoTabError(ValueError):
    """No such tab; the text lists those there are."""


def _number(tabs: list[rrb.Vertical | rrb.Horizontal], wanted: str) -> int:
    """Index of the tab of that name, case ignored; "" the first. Raises NoTabError."""
    names = [str(t.name) for t in tabs]
    found = [i for i, n in enumerate(names) if n.lower() == wanted.lower() or not wanted]
    if not found:
        raise NoTabError(f"no tab {wanted!r} in this run; there are: {', '.join(names)}")
    return found[0]


def blueprint(
    name: str,
    start_s: float,
    end_s: float,
    near: bool = False,
    extra: Sequence[rrb.Vertical | rrb.Horizontal] = (),
    tab: str = "",
    first: Sequence[rrb.Spatial2DView] = (),
) -> rrb.Blueprint:
    """Layout of a run; plots begin with [start_s, end_s], selected on the timeline. `near`: the eye near the boom;
    `extra`: more tabs of plots; `tab`: the tab of plots shown first; `first`: views before the scene, the first of them
    shown. Raises NoTabError for a tab that is not there."""
    states = rrb.StateTimelineView(
        origin="/",
        contents=[
            "guid/tanker/phase", "guid/receiver/phase", "guid/receiver/boom", "sensors/tanker/health",
            "sensors/receiver/health",
        ],
        name="Phases and health",
        time_view=Plots(start_s, end_s).time,
    )  # fmt: skip
    texts = [k.format(a) for a in BOTH for k in ("guid/{}/text", "guid/{}/phases", "sensors/{}/failures")]
    log = rrb.TextLogView(origin="/", contents=texts, name="Messages")
    plan = rrb.Spatial2DView(origin="/", contents=[f"truth/{a}/plan/**" for a in BOTH], name="Plan, north up [m]")
    tracks = [f"truth/{a}/{k}" for a in BOTH for k in ("track", "position")]
    world = rrb.MapView(origin="/", contents=tracks, name="Map", zoom=9.0)
    left = rrb.Vertical(
        rrb.Tabs(
            *first,
            _scene("Formation (truth white, estimate orange)", WIDE),
            _scene("Boom", NEAR),
            plan,
            world,
            active_tab=1 if near and not first else 0,
            name="Scene",
        ),
        rrb.Tabs(states, log, active_tab=0, name="Modes"),
        row_shares=[4, 1.5],
    )
    p = Plots(start_s, end_s)
    tabs = [p.overview(), p.station(), p.wind_tab(), p.flight(), p.controls(), p.timing(), p.sensors(), *extra]
    right = rrb.Tabs(*tabs, active_tab=_number(tabs, tab), name=f"Plots of {name}")
    selected = rr.encodings.AbsoluteTimeRange(int(start_s * 1e9), int(end_s * 1e9))
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[1.2, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline="sim_time",
            playback_speed=5.0,
            play_state="paused",
            time_selection=selected,
        ),
        auto_views=False,
        auto_layout=False,
    )
