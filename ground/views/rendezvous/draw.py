"""{nav, guid}/tanker/rendezvous/...: plan view of the rendezvous, its plots, their tab.

Plan view, north up [m]: both true tracks, the estimator's components (the banana: dots by weight), range ring of the last
TACAN reply, the turn as planned now, the point two miles ahead of the estimate that it aims at.
"""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from ground.columns import Columns, Table
from ground.rrd.layout import Layout, Look, Plots, past
from ground.rrd.outline import ABOVE, placed
from ground.rrd.palette import BACKGROUND, BOX, NAV, WHITE, Color
from ground.rrd.series import AXIS, Array, Sink
from ground.run import Run
from ground.views.refueling.aircraft import RECEIVER, TANKER
from ground.views.refueling.palette import COLOR
from ground.views.rendezvous.read import SEPARATION_M, TURN, errors, frame_of, to_plan
from ground.views.rendezvous.signals import DONE, NEVER_S, signals

ROOT, GUID = "nav/tanker/rendezvous", "guid/tanker/rendezvous"
MAP = f"{ROOT}/map"
FAINT = (90, 96, 106)
RING = (90, 150, 190)
LAG_US = 6_000_000  # [us] a cloud is drawn that long after its range at most
RING_HALF = np.radians(35.0)  # of the range ring drawn
PHASES: dict[str, Color] = {
    "RDV_APPROACH": (70, 120, 150),
    "RDV_TURN": (200, 150, 60),
    "RDV_ROLLOUT": (150, 160, 70),
    "RDV_LEG": (170, 120, 160),
}
MARGIN_M = 4000.0
SHAPE_M, SHAPE_US = 3000.0, 500_000  # [m] drawn as long, [us] as often
STATE_COLORS = {
    "approach": (70, 120, 150),
    "turn": (200, 150, 60),
    "roll-out": (150, 160, 70),
    "ahead": (60, 170, 80),
    "leg": (170, 120, 160),
}
ALARM_COLORS = {"as planned": (55, 105, 70), "NOT AS PLANNED": (220, 60, 50), "no estimate": (110, 110, 110)}
DEG = 180.0 / np.pi
# path of a signal -> label, colour, width, whether in steps, factor
LINES: dict[str, tuple[str, Color, float, bool, float]] = {
    f"{ROOT}/nees": ("NEES / 3 (x, v_x, y)", NAV, 1.5, False, 1.0),
    f"{ROOT}/window_nis": ("mean NIS of the window", BOX, 1.5, True, 1.0),
    f"{GUID}/time_to_go": ("time to go", COLOR["command"], 1.5, False, 1.0),
    f"{ROOT}/bank": ("bank (left +)", COLOR["tanker"], 1.5, False, DEG),
    f"{GUID}/bank": ("command", COLOR["command"], 1.0, False, DEG),
    f"{GUID}/miss": ("predicted", NAV, 1.5, False, 1.0),
    f"{ROOT}/range": ("slant range [km]", RING, 1.5, True, 1e-3),
}


def rendezvous(sink: Sink, run: Run) -> None:
    """Send everything of this module; nothing for a run without the messages."""
    tlm, state = run.tlm, run.tlm.get(TANKER, "RENDEZVOUS_STATE")
    if state is None:
        return
    _plots(sink, run, state)
    _shapes(sink, run.truth)
    good = state.pick(state["valid"] != 0)
    if not len(good):
        return
    frame = frame_of(state)
    far = np.array([[-2.0e4, 7.0e4], [0.0, 0.0]])
    line = to_plan(frame, far[0], far[1])
    sink.look(f"{MAP}/axis", rr.LineStrips2D([line], colors=[FAINT], radii=rr.Radius.ui_points(0.8)))
    point = rr.Points2D(
        [to_plan(frame, np.zeros(()), np.zeros(()))],
        colors=[WHITE],
        radii=rr.Radius.ui_points(4.0),
        labels=["control point"],
    )
    sink.look(f"{MAP}/control_point", point)
    cloud = tlm.get(TANKER, "RENDEZVOUS_CLOUD")
    if cloud is not None:
        _cloud(sink, cloud, frame)
    _ring(sink, good, frame)
    _plan(sink, good, frame)


def _shapes(sink: Sink, truth: Columns) -> None:
    """Both aircraft seen from above, larger than they are."""
    for sysid, name in ((TANKER, "tanker"), (RECEIVER, "receiver")):
        table = truth.get(sysid, "TRUTH")
        if table is None:
            continue
        d = table.decimated(SHAPE_US)
        at = np.stack([d["pos_n"][:, 1], -d["pos_n"][:, 0]], axis=1)
        nose = np.arctan2(d["vel_n"][:, 0], d["vel_n"][:, 1])
        look = rr.LineStrips2D.from_fields(colors=[COLOR[name]], radii=rr.Radius.ui_points(1.5))
        sink.look(f"truth/{name}/rendezvous/shape", look)
        sink.rows(f"truth/{name}/rendezvous/shape", d.t_us, rr.LineStrips2D, strips=placed(ABOVE, at, nose, SHAPE_M))


def _cloud(sink: Sink, cloud: Table, frame: Array) -> None:
    """Components by weight, all parts of one time together."""
    sink.look(f"{MAP}/cloud", rr.Points2D.from_fields(colors=[NAV]))
    at = cloud["time_usec"].astype(np.int64)
    clouds = np.unique(at)
    for t in clouds[sink.fresh(f"{MAP}/cloud", clouds, LAG_US)]:
        rows = cloud.pick((at == t) & (cloud.t_us < t + LAG_US))
        seen = {int(p): i for i, p in enumerate(rows["part"])}
        xs, ys, ws = [], [], []
        for i in seen.values():
            n = int(rows["count"][i])
            xs.append(rows["x"][i][:n])
            ys.append(rows["y"][i][:n])
            ws.append(rows["weight"][i][:n])
        if not xs:
            continue
        w = np.concatenate(ws).astype(np.float64)
        keep = w > 1e-4
        place = to_plan(frame, *(np.concatenate(a).astype(np.float64)[keep] for a in (xs, ys)))
        size = rr.Radius.ui_points(2.0 + 9.0 * np.sqrt(w[keep]))
        t_us = np.array([rows.t_us[0]])
        columns = rr.Points2D.columns(positions=place, radii=size).partition(lengths=[len(place)])
        sink.columns(f"{MAP}/cloud", t_us, columns)


def _ring(sink: Sink, good: Table, frame: Array) -> None:
    """Arc of the last range about where the tanker was then, towards the estimate."""
    new = np.flatnonzero(np.diff(good["updates"].astype(np.int64), prepend=0) != 0)
    d = good.pick(new)
    own, est = d["own"].astype(np.float64), d["est"].astype(np.float64)
    towards = np.arctan2(est[:, 2] - own[:, 1], est[:, 0] - own[:, 0])
    a = towards[:, None] + np.linspace(-RING_HALF, RING_HALF, 49)
    r = d["range"].astype(np.float64)[:, None]
    strips = to_plan(frame, own[:, :1] + r * np.cos(a), own[:, 1:2] + r * np.sin(a)).astype(np.float32)
    sink.look(f"{MAP}/ring", rr.LineStrips2D.from_fields(colors=[RING], radii=rr.Radius.ui_points(1.0)))
    sink.events(f"{MAP}/ring", good.t_us, new, rr.LineStrips2D, strips=strips)


def turn_path(row: NDArray, steps: int = 60) -> Array:
    """Planned path (n,2) in the rendezvous frame from one RENDEZVOUS_STATE: straight to the turn, then one or two arcs.

    Through the air as if it did not move. Where no radii are sent the one arc has the length the time of the turn gives.
    """
    x, y, psi = (float(v) for v in row["own"])
    v, left = float(row["cmd_speed"]), float(row["final_psi"]) - psi
    points = [(x, y)]
    ttg = float(row["time_to_go"])
    if row["phase"] == 0 and 0.0 < ttg < NEVER_S:
        x, y = x + v * ttg * np.cos(psi), y + v * ttg * np.sin(psi)
        points.append((x, y))
    if left <= 0.0:
        return np.array(points)
    one = v * float(row["turn_time"]) / left
    radii = [float(r) for r in row["radius"]] if row["radius"][0] > 0.0 and row["phase"] == TURN else [one, one]
    for r in radii:
        for _ in range(steps // 2):
            d = left / steps
            chord = 2.0 * r * np.sin(0.5 * d)
            x, y = x + chord * np.cos(psi + 0.5 * d), y + chord * np.sin(psi + 0.5 * d)
            psi += d
            points.append((x, y))
    return np.array(points)


def _plan(sink: Sink, good: Table, frame: Array) -> None:
    """Planned turn, mean of the estimate, the point ahead of it."""
    done = good["phase"] >= DONE
    line = rr.LineStrips2D.from_fields(colors=[COLOR["command"]], radii=rr.Radius.ui_points(1.5))
    sink.look(f"{MAP}/turn", line)
    turning = np.flatnonzero(~done | (np.diff(done, prepend=done[:1]) != 0))  # and none from when it has turned
    strips = []
    for k in turning:
        p = np.zeros((2, 2)) if done[k] else turn_path(good.rows[k])
        strips.append((p if done[k] else to_plan(frame, p[:, 0], p[:, 1])).astype(np.float32))
    sink.events(f"{MAP}/turn", good.t_us, turning, rr.LineStrips2D, strips=strips)
    est = good["est"].astype(np.float64)
    for name, color, size, shift in (("mean", NAV, 5.0, 0.0), ("goal", COLOR["command"], 3.5, SEPARATION_M)):
        look = rr.Points2D.from_fields(colors=[color], radii=rr.Radius.ui_points(size))
        sink.look(f"{MAP}/{name}", look)
        at = to_plan(frame, est[:, 0] - shift, est[:, 2])
        sink.rows(f"{MAP}/{name}", good.t_us, rr.Points2D, positions=at)


def _plots(sink: Sink, run: Run, state: Table) -> None:
    """Errors with 2 sigma, consistency, time to go, bank, predicted miss, lanes."""
    t, e, P = errors(run.truth, state)
    for k, axis, color in ((0, "x", AXIS[0]), (2, "y", AXIS[1])):
        s2 = 2.0 * np.sqrt(np.maximum(P[:, k, k], 0.0))
        band = tuple(c // 2 + 20 for c in color)
        sink.series(f"{ROOT}/error_2sigma/{axis}", t, np.stack([-s2, s2], axis=1), f"{axis} 2 sigma", band, 1.0)
        sink.series(f"{ROOT}/error/{axis}", t, e[:, k], f"{axis} error", color, 1.6)
    s2 = 2.0 * np.sqrt(np.maximum(P[:, 1, 1], 0.0))
    sink.series(f"{ROOT}/error_2sigma/vx", t, np.stack([-s2, s2], axis=1), "v_x 2 sigma", FAINT, 1.0)
    sink.series(f"{ROOT}/error/vx", t, e[:, 1], "v_x error", NAV)
    made = {s.path.replace(f"/{run.names[TANKER]}/", "/tanker/"): s for s in signals(run)}
    for path, (label, color, width, step, factor) in LINES.items():
        s = made[path]
        for i, axis in enumerate(s.parts or ("",)):
            values = factor * (s.values[:, i] if s.parts else s.values)
            own = AXIS[i] if s.parts else color
            sink.series(f"{path}/{axis}".rstrip("/"), s.t_us, values, f"{axis} {label}".strip(), own, width, step)
    for path, colors in ((f"{GUID}/phase", STATE_COLORS), (f"{ROOT}/alarm", ALARM_COLORS)):
        sink.states(path, made[path].t_us, made[path].values.tolist(), colors)


# --- layout -----------------------------------------------------------------------------------------------------------
def rendezvous_map(truth: Columns) -> rrb.Spatial2DView:
    """Plan view with bounds about the tracks."""
    points = []
    for sysid in truth.sysids():
        table = truth.get(sysid, "TRUTH")
        if table is not None:
            points.append(np.stack([table["pos_n"][:, 1], -table["pos_n"][:, 0]], axis=1))
    bounds = None
    if points:
        every = np.concatenate(points)
        (x0, y0), (x1, y1) = (every.min(axis=0) - MARGIN_M).tolist(), (every.max(axis=0) + MARGIN_M).tolist()
        bounds = rrb.VisualBounds2D(x_range=[x0, x1], y_range=[y0, y1])
    return rrb.Spatial2DView(
        origin="/",
        name="Rendezvous, plan, north up [m]: truth blue and green, estimate orange, plan magenta",
        contents=[
            *(f"truth/{a}/{k}" for a in ("tanker", "receiver") for k in ("plan/track", "rendezvous/shape")),
            f"{MAP}/**",
        ],
        overrides=past("truth/tanker/plan/track", "truth/receiver/plan/track"),
        visual_bounds=bounds,
        background=rrb.Background(color=BACKGROUND),
    )


def layout(run: Run, look: Look) -> Layout:
    """The tab of this module; it leads, with the plan, where there is no station keeping to look at."""
    alone = run.tlm.get(RECEIVER, "RELATIVE_STATE") is None
    return Layout(
        rank=2 if alone else 0,
        tabs=[rendezvous_tab(look.plots())],
        scenes=[rendezvous_map(Columns() if look.live else run.truth)] if alone else [],
        states=PHASES,
    )


def rendezvous_tab(p: Plots) -> rrb.Vertical:
    """The tab "Rendezvous"."""
    lanes = rrb.StateTimelineView(
        origin="/", contents=[f"{GUID}/phase", f"{ROOT}/alarm"], name="Phase, innovation test", time_view=p.time
    )
    error = [f"{ROOT}/{k}/{a}" for a in "xy" for k in ("error_2sigma", "error")]
    plots = rrb.Grid(
        p.plot("estimate - truth, 2 sigma [m]", error, (-4000.0, 4000.0)),
        p.plot("closing velocity error [m/s]", [f"{ROOT}/error_2sigma/vx", f"{ROOT}/error/vx"], (-15.0, 15.0)),
        p.plot("bank, left positive [deg]", [f"{ROOT}/bank", f"{GUID}/bank"]),
        p.plot("airspeed [m/s]", ["truth/tanker/V", "guid/tanker/V"]),
        p.plot("predicted miss at roll-out [m]", [f"{GUID}/miss/x", f"{GUID}/miss/y"]),
        p.plot("NEES / 3, mean NIS of the window", [f"{ROOT}/nees", f"{ROOT}/window_nis"], (0.0, 5.0)),
        grid_columns=2,
    )
    return rrb.Vertical(lanes, plots, name="Rendezvous", row_shares=[1.3, 6.0])
