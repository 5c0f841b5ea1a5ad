"""A run of the gust mission in Rerun: wind and bias estimates with 2-sigma bands against truth, load factor with and without
alleviation, commands, spectra. No tanker and no receiver here, so the layout is its own.

truth/<aircraft>/gust/..., nav/<aircraft>/gust/..., ctrl/<aircraft>/..., guid/<aircraft>/..., timing/<aircraft>/...
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray
from scipy import signal

from ground.columns import Columns
from ground.link.packets import health_words, phase_name
from ground.rrd.blueprint import NoTabError, Plots
from ground.rrd.palette import NAV, PHASE_COLORS, TRUTH, Color
from ground.rrd.series import Array, Sink
from ground.views.gust.figures import pair
from ground.views.gust.read import ESTIMATORS, LAWS, GustFlight, flights, names

DEG = 180.0 / np.pi
G = 9.81
SHADES: tuple[Color, ...] = ((90, 200, 255), (170, 170, 180), (120, 230, 140), (240, 160, 120))
BAND: Color = (150, 100, 50)
WEIGHTS: tuple[Color, ...] = ((90, 150, 240), (96, 190, 110), (240, 190, 70), (232, 92, 80))
WANTED = (("alpha_w", "deg", DEG), ("v_w", "m/s", 1.0), ("bias", "deg", DEG))
SPECTRUM = "truth/spectrum"
DECADES = (-1.0, 1.4)  # log10 of the frequencies [Hz] drawn
PSD = (-4.0, 2.0)  # log10 of the density [(m/s^2)^2/Hz]
STRETCH = 0.4  # a decade of density is drawn this high
NOTHING_S = 0.1


def convert_gust(run: Path, path: Path, truth: Columns, tlm: Columns, tab: str = "") -> Path:
    """Write the recording of a gust run to `path`. Raises NoTabError for an unknown tab, OSError if unwritable."""
    found = flights(run, truth, tlm)
    known = names(run, tlm)
    end = max(truth.end_us, tlm.end_us, int(NOTHING_S * 1e6))
    look = gust_blueprint(run.resolve().name or "run", list(known.values()), end * 1e-6, found, tab)
    with path.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    step = int(np.median(np.diff(found[0].t_us))) if found else 20_000
    sink = Sink(path, run.resolve().name or "run", 0, end, look, step)
    for i, f in enumerate(found):
        _flight(sink, f, SHADES[i % len(SHADES)])
    for i, (sysid, name) in enumerate(known.items()):
        _housekeeping(sink, tlm, sysid, name, SHADES[i % len(SHADES)])
    _spectra(sink, found)
    sink.close()
    return path


def _flight(sink: Sink, f: GustFlight, color: Color) -> None:
    """Estimates against truth, loads, commands of one aircraft."""
    name, t = f.name, f.t_us
    for i, (key, unit, factor) in enumerate(WANTED):
        sink.series(f"truth/{name}/gust/{key}", t, f.truth[:, i] * factor, f"{key} truth [{unit}]", TRUTH, 1.4)
        m = f.valid
        est, s2 = f.est[m, i] * factor, 2.0 * f.sigma[m, i] * factor
        sink.series(f"nav/{name}/gust/{key}", t[m], est, f"{key} estimate", NAV, 1.4)
        some = np.isfinite(s2)
        band = np.stack([est - s2, est + s2], axis=1)[some]
        sink.series(f"nav/{name}/gust/{key}_2sigma", t[m][some], band, "2 sigma", BAND, 1.0)
        sink.series(
            f"nav/{name}/gust/{key}_error", t[m], est - f.truth[m, i] * factor, f"{name} {key} error", color, 1.0
        )
    sink.series(f"truth/{name}/n_z", t, 1.0 + f.a_z / G, f"{name} n_z", color, 1.0)
    sink.series(f"truth/{name}/n_z_low", t, 1.0 + f.low() / G, f"{name} n_z below 2 Hz", color, 2.0)
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


def _housekeeping(sink: Sink, tlm: Columns, sysid: int, name: str, color: Color) -> None:
    """Phase, health, texts, timing of one aircraft."""
    status, health = tlm.get(sysid, "MISSION_STATUS"), tlm.get(sysid, "HEALTH_STATUS")
    text, timing = tlm.get(sysid, "STATUSTEXT"), tlm.get(sysid, "LOOP_TIMING")
    if status is not None:
        sink.states(f"guid/{name}/phase", status.t_us, [phase_name(int(p)) for p in status["phase"]], PHASE_COLORS)
    if health is not None:
        sink.states(
            f"sensors/{name}/health", health.t_us, [health_words(int(b)) for b in health["failed"]], PHASE_COLORS
        )
    if text is not None:
        lines = [f"{name}: {b.decode('utf-8', 'replace')}" for b in text["text"]]
        level = ["ERROR" if s <= 3 else "WARN" if s == 4 else "INFO" for s in text["severity"]]
        sink.columns(f"guid/{name}/text", text.t_us, rr.TextLog.columns(text=lines, level=level))
    if timing is not None:
        for key in ("exec_mean", "exec_max", "late_p50", "late_p99", "slips"):
            sink.series(f"timing/{name}/{key}", timing.t_us, timing[key], f"{name} {key}", color, step=key == "slips")


def _point(hz: NDArray[np.float64], density: Array) -> Array:
    """Points [N,2] of a spectrum in the drawing: decades to the right, density up (a 2-D view's y points down)."""
    p = np.clip(np.log10(np.maximum(density, 1e-12)), *PSD)
    return np.stack([np.log10(hz), -STRETCH * p], axis=1)


def _spectra(sink: Sink, found: list[GustFlight]) -> None:
    """Power density of a_z of every aircraft over frequency, both logarithmic, with a grid of decades."""
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
    sink.rec.log(f"{SPECTRUM}/grid", rr.LineStrips2D(lines, colors=[(80, 86, 98)], radii=thin), static=True)
    for i, f in enumerate(found):
        if len(f.t_us) < 256:
            continue
        rate = 1e6 / float(np.median(np.diff(f.t_us)))
        hz, density = signal.welch(f.a_z[f.t >= 2.0], rate, nperseg=min(512, len(f.t_us) // 4))
        keep = (hz > 10.0 ** DECADES[0]) & (hz < 10.0 ** DECADES[1])
        strip = _point(hz[keep], density[keep])
        color = SHADES[i % len(SHADES)]
        curve = rr.LineStrips2D([strip], colors=[color], radii=rr.Radius.ui_points(1.8))
        sink.rec.log(f"{SPECTRUM}/{f.name}", curve, static=True)
        labels.append(f.name)
        at.append((float(strip[1, 0]) + 0.35, float(strip[1, 1]) - 0.12 + 0.24 * i))
    spots = rr.Points2D(at, colors=[(200, 204, 212)], radii=rr.Radius.ui_points(0.0), labels=labels, show_labels=True)
    sink.rec.log(f"{SPECTRUM}/labels", spots, static=True)


def gust_blueprint(
    title: str, aircraft: list[str], end_s: float, found: list[GustFlight], tab: str = ""
) -> rrb.Blueprint:
    """Layout of a gust run: spectra and modes on the left, plots on the right. Raises NoTabError for an unknown tab."""
    p = Plots(0.0, end_s)
    near = Plots(
        *((end_s * 0.62, end_s * 0.95) if end_s > 20.0 else (0.0, end_s))
    )  # where single gusts can be told apart
    both = pair(found)
    lead = both[0].name if both else aircraft[0] if aircraft else ""
    order = [lead, *(a for a in aircraft if a != lead)]

    def estimate(at: Plots, name: str, key: str, label: str, span: tuple[float, float]) -> rrb.TimeSeriesView:
        kinds = [f"nav/{name}/gust/{{0}}_2sigma", f"truth/{name}/gust/{{0}}", f"nav/{name}/gust/{{0}}"]
        return at.plot(f"{name}: {label}", [k.format(key) for k in kinds], span)

    n_z, low = ([f"truth/{a}/{k}" for a in reversed(order)] for k in ("n_z", "n_z_low"))
    execution, lateness = (
        [f"timing/{a}/{k}" for a in order for k in keys]
        for keys in (("exec_mean", "exec_max"), ("late_p50", "late_p99"))
    )
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
            name="Loads",
        ),
        rrb.Vertical(
            p.plot("normalised innovation squared / dof", [f"nav/{a}/nis" for a in order], (0.0, 4.0)),
            p.plot(f"{lead}: weights of the bank", [f"nav/{lead}/gust/weight/**"], (0.0, 1.0)),
            p.plot("turbulence intensity / expected", [f"nav/{a}/gust/scale" for a in order]),
            *(p.plot(f"error of {k} [{u}]", [f"nav/{a}/gust/{k}_error" for a in order]) for k, u, _ in WANTED),
            name="Filter",
        ),
        rrb.Vertical(
            p.plot("airspeed [m/s]", [f"truth/{a}/V" for a in order]),
            p.plot("incidence [deg]", [f"truth/{a}/alpha" for a in order]),
            p.plot("execution time of a tick [us] (0 in lockstep)", execution),
            p.plot("wake-up lateness [us] (0 in lockstep)", lateness),
            name="Flight and timing",
        ),
    ]  # fmt: skip
    labels = [str(t.name) for t in tabs]
    active = [i for i, n in enumerate(labels) if n.lower() == tab.lower() or not tab]
    if not active:
        raise NoTabError(f"no tab {tab!r} in this run; there are: {', '.join(labels)}")
    lanes = [k.format(a) for a in order for k in ("guid/{}/law", "guid/{}/phase", "sensors/{}/health")]
    top, bottom = -STRETCH * PSD[1] - 0.1, -STRETCH * PSD[0] + 0.3
    left = rrb.Vertical(
        rrb.Spatial2DView(
            origin="/",
            contents=[f"{SPECTRUM}/**"],
            name="a_z: density [(m/s2)2/Hz] over frequency [Hz]",
            visual_bounds=rrb.VisualBounds2D(x_range=[DECADES[0] - 0.25, DECADES[1]], y_range=[top, bottom]),
            background=rrb.Background(color=(24, 30, 40)),
        ),
        rrb.Tabs(
            rrb.StateTimelineView(origin="/", contents=lanes, name="Law, phase, health", time_view=p.time),
            rrb.TextLogView(origin="/", contents=[f"guid/{a}/text" for a in order], name="Messages"),
            active_tab=0,
            name="Modes",
        ),
        row_shares=[3, 2],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, rrb.Tabs(*tabs, active_tab=active[0], name=f"Plots of {title}"), column_shares=[1, 1.7]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline="sim_time", playback_speed=2.0, play_state="paused"),
        auto_views=False,
        auto_layout=False,
    )
