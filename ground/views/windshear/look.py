"""Layout of a windshear run: the vertical plane along the top, plots and modes below it."""

from __future__ import annotations

import numpy as np
import rerun.blueprint as rrb

from ground.rrd.blueprint import NoTabError, Plots
from ground.views.windshear.read import H, WindshearFlight, X

SCENE = "scene"
STRETCH = 6.0  # heights are drawn this much larger than distances
HIGH = 380.0  # [m] shown at least to here


def windshear_blueprint(
    title: str, aircraft: list[str], end_s: float, found: list[WindshearFlight], tab: str = ""
) -> rrb.Blueprint:
    """Blueprint of the run of these aircraft, `end_s` [s] long. Raises NoTabError for an unknown tab."""
    p = Plots(0.0, end_s)
    one = found[0].name if found else aircraft[0] if aircraft else ""
    tabs = [
        rrb.Horizontal(
            rrb.Vertical(_wind(p, one, "w_x", "tail wind"), _wind(p, one, "w_h", "updraught")),
            rrb.Vertical(*(_error(p, one, key, word) for key, word in (("w_x", "tail wind"), ("w_h", "updraught")))),
            rrb.Vertical(
                p.plot("F for the caution and its threshold [-]", _hazard(one, "quick", "caution"), (-0.3, 0.55)),
                p.plot("F for the abort and its threshold [-]", _hazard(one, "slow", "abort"), (-0.3, 0.55)),
            ),
            name="Windshear",
        ),
        rrb.Horizontal(
            rrb.Vertical(_pair(p, one, "height", "height [m]"), _pair(p, one, "airspeed", "airspeed [m/s]")),
            rrb.Vertical(_pair(p, one, "alpha", "incidence [deg]"), _pair(p, one, "path", "air-path angle [deg]")),
            rrb.Vertical(
                p.plot("thrust [kN]", [f"truth/{one}/thrust", f"nav/{one}/thrust", f"ctrl/{one}/thrust"]),
                p.plot("climb rate [m/s]", [f"truth/{one}/climb", f"guid/{one}/climb"]),
            ),
            name="Flight",
        ),
        rrb.Horizontal(
            rrb.Vertical(
                p.plot("scales of lift and drag, 2 sigma [-]", [f"nav/{one}/scale/**"], (0.85, 1.15)),
                p.plot("turbulence as learnt", [f"nav/{one}/turbulence"]),
                p.plot("normalised innovation squared / reading", [f"nav/{one}/nis"], (0.0, 4.0)),
            ),
            rrb.Vertical(
                *(
                    p.plot(f"{k}: monitor, truth [m/s]", [f"nav/{one}/{k}_monitor", f"truth/{one}/{k}"])
                    for k in ("w_x", "w_h")
                ),
                p.plot(
                    "execution time of a tick [us] (0 in lockstep)",
                    [f"timing/{one}/exec_mean", f"timing/{one}/exec_max"],
                ),
            ),
            name="Filter and timing",
        ),
    ]
    labels = [str(t.name) for t in tabs]
    active = [i for i, n in enumerate(labels) if n.lower() == tab.lower() or not tab]
    if not active:
        raise NoTabError(f"no tab {tab!r} in this run; there are: {', '.join(labels)}")
    lanes = [
        k.format(a) for a in aircraft for k in ("guid/{}/phase", "guid/{}/alert", "guid/{}/law", "sensors/{}/health")
    ]
    modes = rrb.Tabs(
        rrb.StateTimelineView(origin="/", contents=lanes, name="Phase, alert, law, health", time_view=p.time),
        rrb.TextLogView(origin="/", contents=[f"guid/{a}/text" for a in aircraft], name="Messages"),
        active_tab=0,
        name="Modes",
    )
    plots = rrb.Tabs(*tabs, active_tab=active[0], name=f"Plots of {title}")
    return rrb.Blueprint(
        rrb.Vertical(_plane(found), plots, modes, row_shares=[5, 6, 2.6]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="sim_time", playback_speed=2.0, play_state="paused"),
        auto_views=False,
        auto_layout=False,
    )


def _wind(p: Plots, name: str, key: str, word: str) -> rrb.TimeSeriesView:
    return p.plot(f"{word} [m/s], 2 sigma", [f"nav/{name}/{key}_2sigma", f"truth/{name}/{key}", f"nav/{name}/{key}"])


def _error(p: Plots, name: str, key: str, word: str) -> rrb.TimeSeriesView:
    at = f"nav/{name}/{key}_error"
    return p.plot(f"{word}: estimate less truth [m/s], 2 sigma", [f"{at}_2sigma", at], (-1.2, 1.2))


def _hazard(name: str, key: str, threshold: str) -> list[str]:
    return [f"truth/{name}/F_{key}", f"nav/{name}/F_{key}", f"guid/{name}/{threshold}_F"]


def _pair(p: Plots, name: str, key: str, title: str) -> rrb.TimeSeriesView:
    return p.plot(title, [f"truth/{name}/{key}", f"nav/{name}/{key}"])


def _plane(found: list[WindshearFlight]) -> rrb.Spatial2DView:
    x = np.concatenate([f.true[:, X] for f in found]) if found else np.array([-4500.0, 4500.0])
    top = max(HIGH, *(float(f.true[:, H].max()) + 20.0 for f in found)) if found else HIGH
    bounds = rrb.VisualBounds2D(
        x_range=[float(x.min()) - 350.0, float(x.max()) + 150.0], y_range=[-STRETCH * top, STRETCH * 45.0]
    )
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"{SCENE}/**"],
        name=f"vertical plane, heights {STRETCH:g} times; blue: head wind, red: tail wind; path by phase, orange: estimate",
        visual_bounds=bounds,
        background=rrb.Background(color=(24, 30, 40)),
    )
