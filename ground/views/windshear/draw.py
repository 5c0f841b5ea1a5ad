"""A run of the windshear mission in Rerun: flight path in the vertical plane over the downburst's wind, wind estimate with
2-sigma bands against truth, hazard index with its thresholds.

scene/<aircraft>/..., truth/<aircraft>/..., nav/<aircraft>/..., guid/<aircraft>/...
"""

from __future__ import annotations

import numpy as np
import rerun as rr

from ground.columns import thinned
from ground.link.packets import phase_name
from ground.rrd.outline import SIDE, placed
from ground.rrd.palette import ALARM, BAND, COMMAND, NAV, TRUTH, WHITE, Color
from ground.rrd.series import Sink
from ground.run import Run
from ground.views.windshear.look import SCENE, STATES, STRETCH, extent
from ground.views.windshear.read import (
    ABORT,
    ACCUSED,
    AL,
    CAUTION,
    ESTIMATORS,
    GA,
    KD,
    KL,
    LAWS,
    VA,
    WH,
    WX,
    H,
    T,
    WindshearFlight,
    X,
    flights,
)

DEG = 180.0 / np.pi
MONITOR: Color = (110, 140, 190)
AMBER: Color = (190, 130, 20)
HEAD: tuple[int, int, int] = (70, 150, 235)
TAIL: tuple[int, int, int] = (235, 95, 75)
GRID: Color = (80, 86, 98)
PER_MPS = 11.0  # [m] of the scene along x, one m/s of an arrow
SHAPE_M, UPRIGHT = 620.0, 2.0  # [m] drawn as long; height of the shape, less than `STRETCH` would make it
PERIOD_US = 100_000  # [us] the scene at 10 Hz
STEP_US = 100_000  # [us] a difference needs the row behind
STEP_X, LEVELS = 250.0, (15.0, 50.0, 100.0, 170.0, 250.0, 340.0)


def draw(sink: Sink, run: Run) -> None:
    """Send everything of this module."""
    for f in flights(run.folder, run.truth, run.tlm):
        _scene(sink, f)
        _wind(sink, f)
        _hazard(sink, f)
        _flight(sink, f)


def _at(x: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Points [N,2] of the scene: x to the right, height up and stretched (a 2-D view's y points down)."""
    return np.stack([x, -STRETCH * h], axis=1)


def _scene(sink: Sink, f: WindshearFlight) -> None:
    """Downburst as arrows, ground, slope, flight path by phase, estimate of it, and the aircraft with the wind it meets."""
    at, thin = f"{SCENE}/{f.name}", rr.Radius.ui_points(0.8)
    x0, x1 = extent([f])
    ticks = np.arange(np.ceil(x0 / 1000.0), np.floor(x1 / 1000.0) + 1.0) * 1000.0
    lines = [_at(np.array([x0, x1]), np.full(2, h)) for h in (0.0, 100.0, 200.0, 300.0)]
    sink.look(f"{at}/grid", rr.LineStrips2D(lines, colors=[(140, 120, 90), GRID, GRID, GRID], radii=thin))
    labels = [f"{x / 1000.0:g} km" for x in ticks] + ["100 m", "200 m", "300 m"]
    spots = np.vstack(
        [_at(ticks, np.full(len(ticks), -4.0)), _at(np.full(3, x0 - 150.0), np.array([100.0, 200.0, 300.0]))]
    )
    words = rr.Points2D(
        spots, colors=[(200, 204, 212)], radii=rr.Radius.ui_points(0.0), labels=labels, show_labels=True
    )
    sink.look(f"{at}/labels", words)
    if f.burst.outflow_mps > 0.0:
        gx, gh = (g.ravel() for g in np.meshgrid(np.arange(x0, x1, STEP_X), np.array(LEVELS)))
        along, up = f.burst.wind(gx, gh)
        near = np.hypot(along, up) > 0.7
        share = np.clip(0.5 + 0.5 * along[near] / f.burst.outflow_mps, 0.0, 1.0)[:, None]
        shade = (np.array(HEAD) * (1.0 - share) + np.array(TAIL) * share).astype(np.uint8)
        arrows = np.stack([along[near], -up[near]], axis=1) * PER_MPS
        sink.look(
            f"{at}/burst",
            rr.Arrows2D(vectors=arrows, origins=_at(gx[near], gh[near]), colors=shade, radii=rr.Radius.ui_points(1.0)),
        )
    few = thinned(f.t_us, PERIOD_US)
    t_us, here = f.t_us[few], _at(f.true[few, X], f.true[few, H])
    sink.trail(f"{at}/path", t_us, here, [STATES.get(phase_name(int(p)), WHITE) for p in f.phase[few]], 2.2)
    good = few[f.valid[few]]
    sink.trail(f"{at}/estimate", f.t_us[good], _at(f.x[good, X], f.x[good, H]), NAV, 0.8)
    sink.look(f"{at}/aircraft", rr.LineStrips2D.from_fields(colors=[WHITE], radii=rr.Radius.ui_points(1.2)))
    pitch = f.true[few, GA] + f.true[few, AL]
    sink.rows(f"{at}/aircraft", t_us, rr.LineStrips2D, strips=placed(SIDE, here, pitch, SHAPE_M, UPRIGHT))
    for key, who, color in (("wind", f.true, WHITE), ("wind_estimate", f.x, NAV)):
        sink.look(f"{at}/{key}", rr.Arrows2D.from_fields(colors=[color], radii=rr.Radius.ui_points(1.6)))
        v = np.stack([who[few, WX], -who[few, WH]], axis=1).astype(np.float32) * np.float32(2.0 * PER_MPS)
        sink.rows(f"{at}/{key}", t_us, rr.Arrows2D, vectors=v, origins=here.astype(np.float32))


def _wind(sink: Sink, f: WindshearFlight) -> None:
    name, t, m = f.name, f.t_us, f.valid
    for key, column, word in (("w_x", WX, "tail wind"), ("w_h", WH, "updraught")):
        est, s2 = f.x[m, column], 2.0 * f.sigma[m, column]
        other = f.state["wind_monitor"][:, column - WX].astype(np.float64)
        good = np.isfinite(other)
        band = np.stack([est - s2, est + s2], axis=1)
        sink.series(f"nav/{name}/{key}_monitor", t[good], other[good], f"{word}, monitor", MONITOR, 1.0)
        sink.series(f"nav/{name}/{key}_2sigma", t[m], band, "2 sigma", BAND, 1.0)
        sink.series(f"truth/{name}/{key}", t, f.true[:, column], f"{word} truth", TRUTH, 1.0)
        sink.series(f"nav/{name}/{key}", t[m], est, f"{word} estimate", NAV, 2.4)
        sink.series(f"nav/{name}/{key}_error", t[m], est - f.true[m, column], f"error of {key}", NAV, 1.0)
        sink.series(f"nav/{name}/{key}_error_2sigma", t[m], np.stack([-s2, s2], axis=1), "2 sigma", BAND, 1.0)
    for key, column, color in (("lift", KL, NAV), ("drag", KD, AMBER)):
        band = np.stack([f.x[m, column] + k * f.sigma[m, column] for k in (-2.0, 2.0)], axis=1)
        sink.series(f"nav/{name}/scale/{key}", t[m], f.x[m, column], f"scale of {key}", color, 1.6)
        sink.series(f"nav/{name}/scale/{key}_2sigma", t[m], band, f"{key}, 2 sigma", BAND, 1.0)
    sink.series(f"nav/{name}/turbulence", t, f.state["turbulence"], "white steps of the wind [m/s/sqrt(s)]", NAV)
    ratio = f.state["nis"] / np.maximum(f.state["channels"], 1)
    sink.series(f"nav/{name}/nis", t, ratio, "NIS / reading", NAV, 0.8)


def _hazard(sink: Sink, f: WindshearFlight) -> None:
    name, t, th = f.name, f.t_us, f.thresholds
    sink.series(
        f"truth/{name}/F_quick",
        t,
        f.low(th["caution_s"]),
        f"F truth, {th['caution_s']:g} s",
        TRUTH,
        1.0,
        settle_us=STEP_US,
    )
    sink.series(f"nav/{name}/F_quick", t, f.state["quick"], f"F estimate, {th['caution_s']:g} s", NAV, 2.4)
    sink.series(
        f"truth/{name}/F_slow", t, f.low(th["abort_s"]), f"F truth, {th['abort_s']:g} s", TRUTH, 1.0, settle_us=STEP_US
    )
    sink.series(f"nav/{name}/F_slow", t, f.state["slow"], f"F estimate, {th['abort_s']:g} s", NAV, 2.4)
    monitor = f.state["hazard_monitor"].astype(np.float64)
    good = np.isfinite(monitor)
    sink.series(f"nav/{name}/F_monitor", t[good], monitor[good], "F of the monitor", MONITOR, 1.0)
    sink.level(f"guid/{name}/caution_F", [th["caution_F"]], "caution", AMBER)
    sink.level(f"guid/{name}/abort_F", [th["abort_F"]], "abort", ALARM)
    alert = f.state["alert"]
    words = np.select(
        [(alert & ABORT) > 0, (alert & CAUTION) > 0, (alert & ACCUSED) > 0],
        ["abort", "caution", "monitor differs"],
        "none",
    )
    colors = {"abort": ALARM, "caution": AMBER, "monitor differs": MONITOR, "none": GRID}
    sink.states(f"guid/{name}/alert", t, words.tolist(), colors)


def _flight(sink: Sink, f: WindshearFlight) -> None:
    name, t, m = f.name, f.t_us, f.valid
    for key, values, est, factor in (
        ("height", f.true[:, H], f.x[:, H], 1.0),
        ("airspeed", f.true[:, VA], f.x[:, VA], 1.0),
        ("alpha", f.true[:, AL], f.x[:, AL], DEG),
        ("path", f.true[:, GA], f.x[:, GA], DEG),
        ("thrust", f.true[:, T], f.x[:, T], 1.0),
    ):
        sink.series(f"truth/{name}/{key}", t, values * factor, f"{key} truth", TRUTH, 1.0)
        sink.series(f"nav/{name}/{key}", t[m], est[m] * factor, f"{key} estimate", NAV, 2.4)
    sink.series(f"ctrl/{name}/thrust", t, f.state["thrust"], "thrust command", COMMAND, 1.0)
    sink.series(f"ctrl/{name}/elevator", t, f.state["elevator"] * DEG, "elevator command", COMMAND, 1.0)
    sink.series(f"guid/{name}/climb", t, f.state["climb"], "climb rate demanded", COMMAND, 1.2)
    climb = f.true[:, VA] * np.sin(f.true[:, GA]) + f.true[:, WH]
    sink.series(f"truth/{name}/climb", t, climb, "climb rate truth", TRUTH, 1.2)
    law = [
        f"{ESTIMATORS.get(int(e), '?')} {int(n)}, {LAWS.get(int(k), '?')}"
        for e, n, k in zip(f.state["estimator"], f.state["states"], f.state["law"], strict=True)
    ]
    sink.states(f"guid/{name}/law", t, law, dict.fromkeys(law, (70, 110, 150)))
