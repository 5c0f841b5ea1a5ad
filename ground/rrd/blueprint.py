"""What the viewer shows first: scenes on the left, plots on the right, modes below. Views give scenes, tabs and lanes of their
missions; the tabs made here every run has.
"""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

from ground.rrd.layout import Layout, Look, Plots, Tab, past
from ground.rrd.terms import Law, controller_tab

LANE = 0.3  # share of a lane in the height, where the scenes have 4
LONG_S = 120.0  # [s] runs up to here are played slower
SURFACES = ("aileron", "elevator", "rudder")


class NoTabError(ValueError):
    """No such tab; the text lists those there are."""


def wind_tab(p: Plots, names: Sequence[str]) -> rrb.Horizontal:
    """Wind of the aircraft side by side."""
    return rrb.Horizontal(*(rrb.Vertical(*p.wind(a), name=a) for a in names), name="Wind")


def flight_tab(p: Plots, names: Sequence[str]) -> rrb.Vertical:
    """Airspeed, altitude, attitude, mass."""
    return rrb.Vertical(
        p.plot("true airspeed [m/s]", [f"{k}/{a}/V" for k in ("truth", "guid") for a in names]),
        p.plot("altitude [m]", [f"{k}/{a}/altitude" for k in ("truth", "guid") for a in names]),
        p.plot("bank [deg]", [f"truth/{a}/bank" for a in names]),
        p.plot("pitch [deg]", [f"truth/{a}/pitch" for a in names]),
        rrb.Horizontal(*(p.plot(f"{a} mass [kg]", [f"truth/{a}/mass"]) for a in names)),
        name="Flight",
    )


def controls_tab(p: Plots, names: Sequence[str]) -> rrb.Vertical:
    """Surfaces, throttle, thrust."""
    surfaces = [
        p.plot(
            f"{a} surfaces, actual (bold) and commanded [deg]",
            [f"{k}/{s}" for k in (f"truth/{a}/controls", f"ctrl/{a}") for s in SURFACES],
        )
        for a in names
    ]
    throttle = p.plot("throttle [%]", [f"ctrl/{a}/throttle" for a in names])
    thrust = p.plot("thrust [kN]", [f"truth/{a}/controls/thrust" for a in names])
    return rrb.Vertical(*surfaces, throttle, thrust, name="Controls")


def timing_tab(p: Plots, names: Sequence[str]) -> rrb.Vertical:
    """Loop timing and the filter's own opinion of itself."""
    execution = [f"timing/{a}/exec_{k}" for a in names for k in ("mean", "max")]
    lateness = [f"timing/{a}/late_{k}" for a in names for k in ("p50", "p99", "max")]
    lost = [f"timing/{a}/{k}" for a in names for k in ("slips", "telemetry_lost")]
    return rrb.Vertical(
        p.plot("execution time of a tick [us] (0 in lockstep)", execution),
        p.plot("wake-up lateness [us] (0 in lockstep)", lateness),
        p.plot("slips and lost telemetry packets", lost),
        p.plot("normalised innovation squared / dof", [f"nav/{a}/nis" for a in names], (0.0, 4.0)),
        name="Timing and filter",
    )


def sensors_tab(p: Plots, names: Sequence[str]) -> rrb.Vertical:
    """What the onboard software was fed."""
    speed = [
        p.plot(
            f"{a} airspeed: probes, truth, estimate [m/s]",
            [f"{k}/{a}/V" for k in ("truth", "nav")] + [f"sensors/{a}/air/V"],
        )
        for a in names
    ]
    force = [p.plot(f"{a} specific force [m/s2]", [f"sensors/{a}/imu/acc/**"]) for a in names]
    rejected = [f"sensors/{a}/{k}" for a in names for k in ("bad_packets", "rejected")]
    return rrb.Vertical(*speed, *force, p.plot("packets and samples rejected", rejected), name="Sensors")


def common_tabs(p: Plots, names: Sequence[str], estimating: Sequence[str], laws: Sequence[Law]) -> list[Tab]:
    """The tabs every run has; wind of those aircraft that publish an estimate of it, laws of those that report them."""
    tabs: list[Tab] = [flight_tab(p, names), controls_tab(p, names)]
    tabs += [controller_tab(p, laws)] if laws else []
    tabs += [timing_tab(p, names), sensors_tab(p, names)]
    return ([wind_tab(p, estimating)] if estimating else []) + tabs


def _number(tabs: Sequence[Tab], wanted: str) -> int:
    """Index of the tab of that name, case ignored; "" the first. Raises NoTabError."""
    names = [str(t.name) for t in tabs]
    found = [i for i, n in enumerate(names) if n.lower() == wanted.lower() or not wanted]
    if not found:
        raise NoTabError(f"no tab {wanted!r} in this run; there are: {', '.join(names)}")
    return found[0]


def _modes(p: Plots, names: Sequence[str], layouts: Sequence[Layout], roots: Sequence[str]) -> rrb.Tabs:
    """Lanes of phases, of what the views add, and of health; messages."""
    lanes = [f"guid/{a}/phase" for a in names] + [lane for v in layouts for lane in v.lanes]
    lanes += [f"sensors/{a}/health" for a in names]
    lanes = [f"{k}{lane}" for lane in lanes for k in roots]
    states = rrb.StateTimelineView(origin="/", contents=lanes, name="Phases and health", time_view=p.time)
    texts = [
        root + k.format(a)
        for root in roots
        for a in names
        for k in ("guid/{}/text", "guid/{}/phases", "sensors/{}/failures")
    ]
    log = rrb.TextLogView(origin="/", contents=texts, name="Messages")
    return rrb.Tabs(states, log, active_tab=0, name="Modes")


def blueprint(
    title: str,
    names: Sequence[str],
    estimating: Sequence[str],
    laws: Sequence[Law],
    look: Look,
    layouts: Sequence[Layout],
    tab: str = "",
    first: Sequence[Tab] = (),
) -> rrb.Blueprint:
    """Layout of a run of these aircraft, `estimating` those that publish a wind, `laws` what they report, with what the views
    show; `tab`: the tab shown first; `first`: tabs before all others. Raises NoTabError for a tab that is not there."""
    ranked = sorted(layouts, key=lambda v: -v.rank)
    lead, others = (ranked[0], ranked[1:]) if ranked else (Layout(), [])
    start_s, end_s = lead.span or look.span
    p = look.plots((start_s, end_s))
    extra = [t for v in others for t in v.tabs]
    own = {str(t.name) for t in (*lead.tabs, *extra)}
    common = [t for t in common_tabs(p, names, estimating, laws) if str(t.name) not in own]
    tabs = [*first, *lead.tabs, *common, *extra]
    roots = ["", *([f"{look.other}/"] if look.other else [])]
    plan = rrb.Spatial2DView(
        origin="/",
        contents=[f"{k}truth/{a}/plan/**" for k in roots for a in names],
        name="Plan, north up [m]",
        overrides=past(*(f"{k}truth/{a}/plan/track" for k in roots for a in names)),
    )
    tracks = [f"truth/{a}/{k}" for a in names for k in ("track", "position")]
    world = rrb.MapView(origin="/", contents=tracks, name="Map", zoom=9.0, overrides=past(*tracks[::2]))
    scenes = rrb.Tabs(*(s for v in ranked for s in v.scenes), plan, world, active_tab=0, name="Scene")
    plots = rrb.Tabs(*tabs, active_tab=_number(tabs, tab), name=f"Plots of {title}")
    modes, lanes = _modes(p, names, ranked, roots), 2 * len(names) + sum(len(v.lanes) for v in ranked)
    if lead.wide:
        whole: Tab = rrb.Vertical(scenes, plots, modes, row_shares=[5, 6, 2.6])
    else:
        whole = rrb.Horizontal(
            rrb.Vertical(scenes, modes, row_shares=[4, max(1.5, LANE * lanes)]), plots, column_shares=[1.2, 1]
        )
    return rrb.Blueprint(
        whole,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline="sim_time",
            playback_speed=5.0 if look.end_s > LONG_S else 2.0,
            play_state="following" if look.live else "paused",
            time_selection=None if look.live else rr.encodings.AbsoluteTimeRange(int(start_s * 1e9), int(end_s * 1e9)),
        ),
        auto_views=False,
        auto_layout=False,
    )
