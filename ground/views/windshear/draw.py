"""A run of the windshear mission in Rerun: flight path in the vertical plane over the downburst's wind, wind estimate with
2-sigma bands against truth, hazard index with its thresholds.

scene/<aircraft>/..., truth/<aircraft>/..., nav/<aircraft>/..., guid/<aircraft>/...
"""

from __future__ import annotations

import numpy as np
import rerun as rr

from ground.columns import thinned
from ground.link.packets import phase_name
from ground.rrd.lines import SHOWN
from ground.rrd.outline import SIDE, placed
from ground.rrd.palette import ALARM, BAND, COMMAND, NAV, TRUTH, WHITE, Color
from ground.rrd.series import Array, Sink
from ground.run import Run
from ground.signals import Signal
from ground.views.windshear.look import SCENE, STATES, STRETCH, extent
from ground.views.windshear.read import (
    AL,
    GA,
    WH,
    WX,
    H,
    WindshearFlight,
    X,
    flights,
)
from ground.views.windshear.signals import of_flight, radio_heights

DEG = SHOWN["rad"]
Made = dict[str, Signal]  # by path
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
        made = {s.path: s for s in of_flight(f)}
        _scene(sink, f)
        _wind(sink, f, made)
        _hazard(sink, f, made)
        _flight(sink, f, made)
    for s in radio_heights(run):
        _line(sink, s, "height by radio", COMMAND, 0.8)


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


def _wind(sink: Sink, f: WindshearFlight, made: Made) -> None:
    name = f.name
    for key, word in (("w_x", "tail wind"), ("w_h", "updraught")):
        est, sigma, true = (made[k.format(name, key)] for k in ("nav/{}/{}", "nav/{}/{}_sigma", "truth/{}/{}"))
        s2, error = 2.0 * sigma.values, est.values - true.values[f.valid]
        _line(sink, made[f"nav/{name}/{key}_monitor"], f"{word}, monitor", MONITOR)
        _band(sink, f"{est.path}_2sigma", est, s2, "2 sigma")
        _line(sink, true, f"{word} truth", TRUTH)
        _line(sink, est, f"{word} estimate", NAV, 2.4)
        sink.series(f"{est.path}_error", est.t_us, error, f"error of {key}", NAV, 1.0)
        sink.series(f"{est.path}_error_2sigma", est.t_us, np.stack([-s2, s2], axis=1), "2 sigma", BAND, 1.0)
    for key, color in (("lift", NAV), ("drag", AMBER)):
        scale, sigma = made[f"nav/{name}/scale/{key}"], made[f"nav/{name}/scale/{key}_sigma"]
        _line(sink, scale, f"scale of {key}", color, 1.6)
        _band(sink, f"{scale.path}_2sigma", scale, 2.0 * sigma.values, f"{key}, 2 sigma")
    _line(sink, made[f"nav/{name}/turbulence"], "white steps of the wind [m/s/sqrt(s)]", NAV, 1.5)
    _line(sink, made[f"nav/{name}/nis"], "NIS / reading", NAV, 0.8)


def _hazard(sink: Sink, f: WindshearFlight, made: Made) -> None:
    name, th = f.name, f.thresholds
    for key, tau in (("quick", th["caution_s"]), ("slow", th["abort_s"])):
        _line(sink, made[f"truth/{name}/F_{key}"], f"F truth, {tau:g} s", TRUTH, settle_us=STEP_US)
        _line(sink, made[f"nav/{name}/F_{key}"], f"F estimate, {tau:g} s", NAV, 2.4)
    _line(sink, made[f"nav/{name}/F_monitor"], "F of the monitor", MONITOR)
    sink.level(f"guid/{name}/caution_F", [th["caution_F"]], "caution", AMBER)
    sink.level(f"guid/{name}/abort_F", [th["abort_F"]], "abort", ALARM)
    colors = {"abort": ALARM, "caution": AMBER, "monitor differs": MONITOR, "none": GRID}
    alert, law = made[f"guid/{name}/alert"], made[f"guid/{name}/law"]
    sink.states(alert.path, alert.t_us, alert.values.tolist(), colors)
    sink.states(law.path, law.t_us, law.values.tolist(), dict.fromkeys(law.values.tolist(), (70, 110, 150)))


def _flight(sink: Sink, f: WindshearFlight, made: Made) -> None:
    name = f.name
    for key in ("height", "airspeed", "path", "thrust"):
        _line(sink, made[f"truth/{name}/{key}"], f"{key} truth", TRUTH)
        _line(sink, made[f"nav/{name}/{key}"], f"{key} estimate", NAV, 2.4)
    sink.series(f"truth/{name}/alpha", f.t_us, f.true[:, AL] * DEG, "alpha truth", TRUTH, 1.0)
    sink.series(f"nav/{name}/alpha", f.t_us[f.valid], f.x[f.valid, AL] * DEG, "alpha estimate", NAV, 2.4)
    for key in ("thrust", "elevator"):
        _line(sink, made[f"ctrl/{name}/{key}"], f"{key} command", COMMAND)
    _line(sink, made[f"guid/{name}/climb"], "climb rate demanded", COMMAND, 1.2)
    _line(sink, made[f"truth/{name}/climb"], "climb rate truth", TRUTH, 1.2)


def _line(sink: Sink, s: Signal, label: str, color: Color, width: float = 1.0, settle_us: int = 0) -> None:
    """A signal as a line, in degrees and kN."""
    sink.series(s.path, s.t_us, SHOWN.get(s.unit, 1.0) * s.values, label, color, width, settle_us=settle_us)


def _band(sink: Sink, path: str, s: Signal, half: Array, label: str) -> None:
    """The band about a signal."""
    sink.series(path, s.t_us, np.stack([s.values - half, s.values + half], axis=1), label, BAND, 1.0)
