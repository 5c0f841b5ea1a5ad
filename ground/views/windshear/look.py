"""Layout of a windshear run: the vertical plane along the top, plots and modes below it."""

from __future__ import annotations

import numpy as np
import rerun.blueprint as rrb

from ground.rrd.layout import Layout, Look, Plots, past
from ground.rrd.palette import BACKGROUND, Color
from ground.run import Run
from ground.views.windshear.read import H, WindshearFlight, X, flights, names

SCENE = "scene"
STRETCH = 6.0  # heights are drawn this much larger than distances
STATES: dict[str, Color] = {
    "WS_APPROACH": (70, 120, 150),
    "WS_CAUTION": (220, 170, 60),
    "WS_ESCAPE": (210, 60, 60),
    "WS_CLEAR": (60, 170, 80),
}
USUAL_M = (-4500.0, 4500.0)  # [m] along the runway
HIGH = 380.0  # [m] shown at least to here


def layout(run: Run, look: Look) -> Layout:
    """The vertical plane, and the tabs Windshear, Flight, Filter."""
    found = flights(run.folder, run.truth, run.tlm)
    aircraft, end_s = list(names(run.folder, run.tlm).values()), look.end_s
    p = look.plots((0.0, end_s))
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
            rrb.Vertical(
                p.plot("height [m]", [f"{k}/{one}/height" for k in ("truth", "nav")] + [f"nav/{one}/radio_height"]),
                _pair(p, one, "airspeed", "airspeed [m/s]"),
            ),
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
            ),
            name="Filter",
        ),
    ]
    lanes = [k.format(a) for a in aircraft for k in ("guid/{}/alert", "guid/{}/law")]
    return Layout(1, tabs, [_plane(found)], lanes, STATES, (0.0, end_s), wide=True)


def _wind(p: Plots, name: str, key: str, word: str) -> rrb.TimeSeriesView:
    return p.plot(f"{word} [m/s], 2 sigma", [f"nav/{name}/{key}_2sigma", f"truth/{name}/{key}", f"nav/{name}/{key}"])


def _error(p: Plots, name: str, key: str, word: str) -> rrb.TimeSeriesView:
    at = f"nav/{name}/{key}_error"
    return p.plot(f"{word}: estimate less truth [m/s], 2 sigma", [f"{at}_2sigma", at], (-1.2, 1.2))


def _hazard(name: str, key: str, threshold: str) -> list[str]:
    return [f"truth/{name}/F_{key}", f"nav/{name}/F_{key}", f"guid/{name}/{threshold}_F"]


def _pair(p: Plots, name: str, key: str, title: str) -> rrb.TimeSeriesView:
    return p.plot(title, [f"truth/{name}/{key}", f"nav/{name}/{key}"])


def extent(found: list[WindshearFlight]) -> tuple[float, float]:
    """From where to where [m] the ground is drawn: `USUAL_M`, and what the flights go beyond it."""
    x = np.concatenate([np.array(USUAL_M), *(f.true[:, X] for f in found)])
    return float(x.min()), float(x.max())


def _plane(found: list[WindshearFlight]) -> rrb.Spatial2DView:
    x = extent(found)
    top = max(HIGH, *(float(f.true[:, H].max()) + 20.0 for f in found)) if found else HIGH
    bounds = rrb.VisualBounds2D(x_range=[x[0] - 350.0, x[1] + 150.0], y_range=[-STRETCH * top, STRETCH * 45.0])
    return rrb.Spatial2DView(
        origin="/",
        contents=[f"{SCENE}/**"],
        name=f"vertical plane, heights {STRETCH:g} times; blue: head wind, red: tail wind; path by phase, orange: estimate",
        overrides=past(*(f"{SCENE}/{f.name}/{k}" for f in found for k in ("path", "estimate"))),
        visual_bounds=bounds,
        background=rrb.Background(color=BACKGROUND),
    )
