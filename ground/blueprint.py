"""What the viewer shows first: scene on the left, plots on the right, modes below. With `ground.rrd` the only importer
of rerun.
"""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

TRAIL_S = 30.0  # [s] length of trails behind the cursor
LEGEND = rrb.PlotLegend(corner=rrb.Corner2D.RightTop)


def _plot(name: str, contents: list[str], span: tuple[float, float] | None = None) -> rrb.TimeSeriesView:
    """A plot of the named entities; `span` fixes the first vertical range."""
    axis = rrb.ScalarAxis(range=span, zoom_lock=False) if span else None
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name, axis_y=axis, plot_legend=LEGEND)


def _wind(aircraft: str) -> list[rrb.TimeSeriesView]:
    """Wind north, east, down: truth, estimate, 3-sigma limits."""
    return [
        _plot(
            f"{aircraft} wind {label} [m/s]",
            [f"nav/{aircraft}/wind_3sigma/{a}", f"truth/{aircraft}/wind/{a}", f"nav/{aircraft}/wind/{a}"],
        )
        for a, label in (("n", "north"), ("e", "east"), ("d", "down"))
    ]


def _flight() -> rrb.Vertical:
    both = ("tanker", "receiver")
    return rrb.Vertical(
        _plot("true airspeed [m/s]", [f"truth/{a}/V" for a in both] + ["guid/tanker/V"]),
        _plot("altitude [m]", [f"truth/{a}/altitude" for a in both] + ["guid/tanker/altitude"]),
        _plot("bank [deg]", [f"truth/{a}/bank" for a in both]),
        _plot("pitch [deg]", [f"truth/{a}/pitch" for a in both]),
        name="Flight",
    )


def _controls() -> rrb.Vertical:
    views = [
        _plot(f"{a} surfaces, actual and commanded [deg]", [f"truth/{a}/controls/{s}" for s in SURFACES] + [f"ctrl/{a}/{s}" for s in SURFACES])
        for a in ("receiver", "tanker")
    ]
    throttle = _plot("throttle [%]", ["ctrl/tanker/throttle", "ctrl/receiver/throttle"])
    thrust = _plot("thrust [kN]", ["truth/tanker/controls/thrust", "truth/receiver/controls/thrust"])
    return rrb.Vertical(*views, throttle, thrust, name="Controls")


SURFACES = ("aileron", "elevator", "rudder")


def _station() -> rrb.Vertical:
    box = ["guid/receiver/box", "guid/receiver/target"]
    errors = [
        _plot(f"station-keeping error {a} [m]", [*box, f"guid/receiver/error/{a}"], (-2.5, 2.5)) for a in "xyz"
    ]
    where = _plot(
        "relative position in tanker axes [m]",
        [f"{k}/receiver/xi/{a}" for a in "xyz" for k in ("guid", "truth")],
    )
    return rrb.Vertical(*errors, where, name="Station keeping")


def _timing() -> rrb.Vertical:
    both = ("tanker", "receiver")
    return rrb.Vertical(
        _plot("execution time of a tick [us] (0 in lockstep)", [f"timing/{a}/exec_{k}" for a in both for k in ("mean", "max")]),
        _plot("wake-up lateness [us]", [f"timing/{a}/late_{k}" for a in both for k in ("p50", "p99", "max")]),
        _plot("slips and lost telemetry", [f"timing/{a}/{k}" for a in both for k in ("slips", "telemetry_lost")]),
        _plot("normalised innovation squared / dof", [f"nav/{a}/nis" for a in both], (0.0, 4.0)),
        name="Timing and filter",
    )


def _scene() -> rrb.Spatial3DView:
    window = rrb.VisibleTimeRange(
        "sim_time",
        start=rrb.TimeRangeBoundary.cursor_relative(seconds=-TRAIL_S),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    trail = rrb.VisibleTimeRanges([window])
    return rrb.Spatial3DView(
        origin="/",
        name="Tanker's frame: truth white, estimate orange, command magenta",
        contents=[
            "truth/tanker/scene/**", "truth/receiver/scene/**", "truth/receiver/trail", "truth/tanker/boom/**",
            "truth/tanker/wind_arrow", "truth/receiver/wind_arrow", "nav/tanker/wind_arrow",
            "nav/receiver/wind_arrow", "guid/receiver/scene/**",
        ],
        overrides={"truth/receiver/trail": trail},
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=(-62.0, -40.0, -14.0),
            look_target=(-21.0, 2.0, 3.0),
            eye_up=(0.0, 0.0, -1.0),
        ),
        line_grid=rrb.LineGrid3D(visible=False),
        background=rrb.Background(color=(24, 30, 40)),
    )  # fmt: skip


def blueprint(name: str, start_s: float, end_s: float) -> rrb.Blueprint:
    """Layout of a run; [start_s, end_s] is selected on the timeline."""
    both = ("tanker", "receiver")
    states = rrb.StateTimelineView(
        origin="/",
        contents=["guid/tanker/phase", "guid/receiver/phase", "guid/receiver/boom", "sensors/tanker/health", "sensors/receiver/health"],
        name="Phases and health",
    )
    log = rrb.TextLogView(origin="/", contents=[f"guid/{a}/{k}" for a in both for k in ("text", "phases")], name="Messages")
    plan = rrb.Spatial2DView(origin="/", contents=[f"truth/{a}/plan/**" for a in both], name="Plan, north up [m]")
    world = rrb.MapView(
        origin="/", contents=[f"truth/{a}/{k}" for a in both for k in ("track", "position")], name="Map", zoom=9.0
    )
    left = rrb.Vertical(
        rrb.Tabs(_scene(), plan, world, active_tab=0, name="Scene"),
        rrb.Tabs(states, log, active_tab=0, name="Modes"),
        row_shares=[4, 1.35],
    )
    wind = rrb.Vertical(*_wind("receiver"), *_wind("tanker")[:], name="Wind")
    sensors = _sensors()
    overview = rrb.Vertical(
        *[_plot(f"station-keeping error {a} [m]", ["guid/receiver/box", f"guid/receiver/error/{a}"], (-2.5, 2.5)) for a in "xyz"],
        *_wind("receiver"),
        name="Overview",
    )
    right = rrb.Tabs(
        overview, _station(), wind, _flight(), _controls(), _timing(), sensors, active_tab=0, name="Plots"
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[1.25, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline="sim_time",
            playback_speed=5.0,
            play_state="paused",
            time_selection=rr.encodings.AbsoluteTimeRange(int(start_s * 1e9), int(end_s * 1e9)),
        ),
        auto_views=False,
        auto_layout=False,
    )


def _sensors() -> rrb.Vertical:
    both = ("tanker", "receiver")
    return rrb.Vertical(
        *[_plot(f"{a} airspeed probes [m/s]", [f"sensors/{a}/air/V", f"truth/{a}/V", f"nav/{a}/V"]) for a in both],
        *[_plot(f"{a} specific force [m/s2]", [f"sensors/{a}/imu/acc/**"]) for a in both],
        _plot("packets and samples rejected", [f"sensors/{a}/{k}" for a in both for k in ("bad_packets", "rejected")]),
        name="Sensors",
    )
