"""A run of the gust mission in Rerun: wind and bias estimates with 2-sigma bands against truth, load factor with and without
alleviation, commands, spectra.

truth/<aircraft>/gust/..., nav/<aircraft>/gust/..., ctrl/<aircraft>/..., guid/<aircraft>/law
"""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from scipy import signal

from ground.columns import thinned
from ground.geometry import quat_euler
from ground.rrd.layout import Layout, Look, Plots
from ground.rrd.outline import SIDE, placed
from ground.rrd.palette import ALARM, BACKGROUND, BAND, BOX, CRAFTS, NAV, TRUTH, WHITE, Color
from ground.rrd.series import Array, Sink
from ground.run import Run
from ground.views.gust.figures import pair
from ground.views.gust.read import ESTIMATORS, LAWS, GustFlight, flights, names
from ground.views.gust.signals import WANTED
from ground.whole import scenario

DEG = 180.0 / np.pi
G = 9.81
WEIGHTS: tuple[Color, ...] = (*CRAFTS[:2], BOX, ALARM)
SHOWN = {"alpha_w": ("deg", DEG), "v_w": ("m/s", 1.0), "bias": ("deg", DEG)}
SPECTRUM = "truth/spectrum"
SIDE_VIEW = "truth/side"
SIDE_US = 100_000  # [us] at 10 Hz
SHAPE_M, APART_M, ROOM_M = 3.0, 14.0, 8.0  # [m] drawn as long; one aircraft ahead of the other; above and below them
WAY, WAY_SCALE = 400, 0.06  # rows of the way behind an aircraft, and how much shorter than flown it is drawn
ARROW_M = 25.0  # [m per rad] of wind incidence
DECADES = (-1.0, 1.4)  # log10 of the frequencies [Hz] drawn
PSD = (-4.0, 2.0)  # log10 of the density [(m/s^2)^2/Hz]
STRETCH = 0.4  # a decade of density is drawn this high
STEP_US = 100_000  # [us] a difference needs the row behind
PASS_US = 2_000_000  # [us] the low-pass goes both ways
STATES: dict[str, Color] = {"GUST_HOLD": (120, 124, 132), "GUST_ALLEVIATION": (60, 150, 170)}


def draw(sink: Sink, run: Run) -> None:
    """Send everything of this module."""
    found = flights(run.folder, run.truth, run.tlm)
    for i, f in enumerate(found):
        _flight(sink, f, CRAFTS[i % len(CRAFTS)])
    _side(sink, found)
    _spectra(sink, found)


def _side(sink: Sink, found: list[GustFlight]) -> None:
    """Each aircraft from the side, one ahead of the other, its pitch and height as they are; its way behind it and, at the nose,
    the vertical wind: true and estimated."""
    for i, f in enumerate(found):
        at, few = f"{SIDE_VIEW}/{f.name}", thinned(f.t_us, SIDE_US)
        if not len(few):
            continue
        x0 = -i * APART_M
        up = -f.true["pos_n"][:, 2]
        here = np.stack([np.full(len(few), x0), -up[few]], axis=1)
        pitch = quat_euler(f.true["q_nb"][few])[:, 1]
        line = rr.Radius.ui_points(1.4)
        sink.look(f"{at}/shape", rr.LineStrips2D.from_fields(colors=[CRAFTS[i % len(CRAFTS)]], radii=line))
        sink.rows(f"{at}/shape", f.t_us[few], rr.LineStrips2D, strips=placed(SIDE, here, pitch, SHAPE_M))
        name = rr.Points2D.from_fields(
            colors=[WHITE], radii=rr.Radius.ui_points(0.0), labels=[f.name], show_labels=True
        )
        sink.look(f"{at}/name", name)
        sink.rows(f"{at}/name", f.t_us[few], rr.Points2D, positions=here + np.array([0.0, 0.3 * SHAPE_M]))
        behind = np.maximum(few[:, None] - np.arange(0, WAY, 5)[None, :], 0)
        back = (f.t[few][:, None] - f.t[behind]) * f.true["V"][few][:, None]
        way = np.stack([x0 - 0.5 * SHAPE_M - WAY_SCALE * back, -up[behind]], axis=-1).astype(np.float32)
        thin = rr.Radius.ui_points(1.0)
        sink.look(f"{at}/way", rr.LineStrips2D.from_fields(colors=[CRAFTS[i % len(CRAFTS)]], radii=thin))
        sink.rows(f"{at}/way", f.t_us[few], rr.LineStrips2D, strips=way)
        for key, angle, color, dx in (("wind", f.truth[:, 0], WHITE, 0.0), ("wind_estimate", f.est[:, 0], NAV, 0.25)):
            arrow = np.stack([np.zeros(len(few)), ARROW_M * angle[few]], axis=1).astype(np.float32)
            nose = (here + np.array([0.5 * SHAPE_M + 0.3 + dx, 0.0])).astype(np.float32)
            sink.look(f"{at}/{key}", rr.Arrows2D.from_fields(colors=[color], radii=rr.Radius.ui_points(2.0)))
            sink.rows(f"{at}/{key}", f.t_us[few], rr.Arrows2D, vectors=arrow, origins=nose)


def _flight(sink: Sink, f: GustFlight, color: Color) -> None:
    """Estimates against truth, loads, commands of one aircraft."""
    name, t = f.name, f.t_us
    for i, (key, _) in enumerate(WANTED):
        unit, factor = SHOWN[key]
        sink.series(f"truth/{name}/gust/{key}", t, f.truth[:, i] * factor, f"{key} truth [{unit}]", TRUTH, 1.0)
        m = f.valid
        est, s2 = f.est[m, i] * factor, 2.0 * f.sigma[m, i] * factor
        sink.series(f"nav/{name}/gust/{key}", t[m], est, f"{key} estimate", NAV, 2.4)
        some = np.isfinite(s2)
        band = np.stack([est - s2, est + s2], axis=1)[some]
        sink.series(f"nav/{name}/gust/{key}_2sigma", t[m][some], band, "2 sigma", BAND, 1.0)
        sink.series(
            f"nav/{name}/gust/{key}_error", t[m], est - f.truth[m, i] * factor, f"{name} {key} error", color, 1.0
        )
    sink.series(f"truth/{name}/n_z", t, 1.0 + f.a_z / G, f"{name} n_z", color, 1.0, settle_us=STEP_US)
    sink.series(f"truth/{name}/n_z_low", t, 1.0 + f.low() / G, f"{name} n_z below 2 Hz", color, 2.0, settle_us=PASS_US)
    sink.series(f"truth/{name}/height", t, -f.true["pos_n"][:, 2], f"{name} height", color)
    sink.series(f"truth/{name}/V", t, f.true["V"], f"{name} airspeed", color)
    sink.series(f"truth/{name}/alpha", t, f.true["alpha"] * DEG, f"{name} alpha", color)
    for key, slot in (("elevator", 1), ("flap", 0)):
        sink.series(f"ctrl/{name}/{key}", t, f.state[key] * DEG, f"{name} {key} command", color, 1.0)
        sink.series(f"truth/{name}/{key}", t, f.true["controls"][:, slot] * DEG, f"{name} {key}", color, 1.6)
    for j in range(f.state["weight"].shape[1]):
        if np.any(f.state["weight"][:, j] > 0.0):
            sink.series(f"nav/{name}/gust/weight/{j}", t, f.state["weight"][:, j], f"filter {j + 1}", WEIGHTS[j], 1.4)
    sink.series(f"nav/{name}/gust/scale", t, f.state["scale"], f"{name} intensity / expected", color, 1.4)
    ratio = f.state["nis"] / np.maximum(f.state["channels"], 1)
    sink.series(f"nav/{name}/nis", t, ratio, f"{name} NIS / dof", color, 1.0)
    words = [
        f"{ESTIMATORS.get(int(e), '?')}, {LAWS.get(int(k), '?')}"
        for e, k in zip(f.state["estimator"], f.law, strict=True)
    ]
    sink.states(f"guid/{name}/law", t, words, dict.fromkeys(words, color))


def _point(hz: NDArray[np.float64], density: Array) -> Array:
    """Points [N,2] of a spectrum in the drawing: decades to the right, density up (a 2-D view's y points down)."""
    p = np.clip(np.log10(np.maximum(density, 1e-12)), *PSD)
    return np.stack([np.log10(hz), -STRETCH * p], axis=1)


def _spectra(sink: Sink, found: list[GustFlight]) -> None:
    """Power density of a_z of every aircraft over frequency, both logarithmic, with a grid of decades."""
    if not sink.due(SPECTRUM):
        return
    lines, labels, at = [], [], []
    for d in (-1, 0, 1):
        lines.append(np.array([[d, -STRETCH * PSD[0]], [d, -STRETCH * PSD[1]]]))
        labels.append(f"{10.0**d:g} Hz")
        at.append((float(d) + 0.02, -STRETCH * PSD[0] + 0.12))
    for d in range(int(PSD[0]), int(PSD[1]) + 1, 2):
        lines.append(np.array([[DECADES[0], -STRETCH * d], [DECADES[1], -STRETCH * d]]))
        labels.append(f"1e{d}")
        at.append((DECADES[0] - 0.12, -STRETCH * float(d)))
    thin = rr.Radius.ui_points(0.8)
    sink.look(f"{SPECTRUM}/grid", rr.LineStrips2D(lines, colors=[(80, 86, 98)], radii=thin))
    for i, f in enumerate(found):
        if len(f.t_us) < 256:
            continue
        rate = 1e6 / float(np.median(np.diff(f.t_us)))
        hz, density = signal.welch(f.a_z[f.t >= 2.0], rate, nperseg=min(512, len(f.t_us) // 4))
        keep = (hz > 10.0 ** DECADES[0]) & (hz < 10.0 ** DECADES[1])
        strip = _point(hz[keep], density[keep])
        color = CRAFTS[i % len(CRAFTS)]
        curve = rr.LineStrips2D([strip], colors=[color], radii=rr.Radius.ui_points(1.8))
        sink.whole(f"{SPECTRUM}/{f.name}", curve)
        labels.append(f.name)
        at.append((float(strip[1, 0]) + 0.35, float(strip[1, 1]) - 0.12 + 0.24 * i))
    spots = rr.Points2D(at, colors=[(200, 204, 212)], radii=rr.Radius.ui_points(0.0), labels=labels, show_labels=True)
    sink.whole(f"{SPECTRUM}/labels", spots)


def layout(run: Run, look: Look) -> Layout:
    """Spectra, and the tabs Gust, Loads, Filter."""
    found = flights(run.folder, run.truth, run.tlm)
    aircraft, end_s = list(names(run.folder, run.tlm).values()), look.end_s
    p = look.plots((0.0, end_s))
    near = look.plots(
        (end_s * 0.62, end_s * 0.95) if end_s > 20.0 else (0.0, end_s)
    )  # where single gusts can be told apart
    both = pair(found)
    lead = both[0].name if both else aircraft[0] if aircraft else ""
    order = [lead, *(a for a in aircraft if a != lead)]

    def estimate(at: Plots, name: str, key: str, label: str, span: tuple[float, float]) -> rrb.TimeSeriesView:
        kinds = [f"nav/{name}/gust/{{0}}_2sigma", f"truth/{name}/gust/{{0}}", f"nav/{name}/gust/{{0}}"]
        return at.plot(f"{name}: {label}", [k.format(key) for k in kinds], span)

    n_z, low = ([f"truth/{a}/{k}" for a in reversed(order)] for k in ("n_z", "n_z_low"))
    tabs = [
        rrb.Vertical(
            estimate(near, lead, "alpha_w", "alpha_W [deg], 2 sigma", (-11.0, 11.0)),
            estimate(near, lead, "v_w", "V_W [m/s], 2 sigma", (-5.0, 5.0)),
            near.plot("load factor below 2 Hz [-]", low),
            estimate(p, lead, "bias", "vane bias [deg], 2 sigma", (-0.8, 2.2)),
            name="Gust",
            row_shares=[1.2, 1.2, 1.2, 1],
        ),
        rrb.Vertical(
            p.plot("load factor [-]", n_z),
            p.plot("load factor below 2 Hz [-]", low),
            p.plot("flap, actual [deg]", [f"truth/{a}/flap" for a in order]),
            p.plot("elevator, actual [deg]", [f"truth/{a}/elevator" for a in order]),
            p.plot("height [m]", [f"truth/{a}/height" for a in order]),
            p.plot("incidence [deg]", [f"truth/{a}/alpha" for a in order]),
            name="Loads",
        ),
        rrb.Vertical(
            p.plot("normalised innovation squared / dof", [f"nav/{a}/nis" for a in order], (0.0, 4.0)),
            p.plot(f"{lead}: weights of the bank", [f"nav/{lead}/gust/weight/**"], (0.0, 1.0)),
            p.plot("turbulence intensity / expected", [f"nav/{a}/gust/scale" for a in order]),
            *(p.plot(f"error of {k} [{u}]", [f"nav/{a}/gust/{k}_error" for a in order]) for k, (u, _) in SHOWN.items()),
            name="Filter",
        ),
    ]  # fmt: skip
    y_range = [-STRETCH * PSD[1] - 0.1, -STRETCH * PSD[0] + 0.3]
    spectra = rrb.Spatial2DView(
        origin="/",
        contents=[f"{SPECTRUM}/**"],
        name="a_z: density [(m/s2)2/Hz] over frequency [Hz]",
        visual_bounds=rrb.VisualBounds2D(x_range=[DECADES[0] - 0.25, DECADES[1]], y_range=y_range),
        background=rrb.Background(color=BACKGROUND),
    )
    lanes = [f"guid/{a}/law" for a in order]
    start = [
        -float(a["start"]["pos_n_m"][2])
        for a in scenario(run.folder).get("aircraft", [])
        if "pos_n_m" in a.get("start", {})
    ]
    heights = np.concatenate([np.array(start or [0.0]), *(-f.true["pos_n"][:, 2] for f in found)])
    down, up = ROOM_M - float(heights.min()), -ROOM_M - float(heights.max())
    side = rrb.Spatial2DView(
        origin="/",
        contents=[f"{SIDE_VIEW}/**"],
        name="From the side: pitch, height, vertical wind (truth white, estimate orange)",
        visual_bounds=rrb.VisualBounds2D(x_range=[-APART_M * len(aircraft), 6.0], y_range=[up, down]),
        background=rrb.Background(color=BACKGROUND),
    )
    return Layout(rank=1, tabs=tabs, scenes=[side, spectra], lanes=lanes, states=STATES, span=(0.0, end_s))
