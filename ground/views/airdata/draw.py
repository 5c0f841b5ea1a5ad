"""nav/receiver/fdi/... and nav/receiver/wake/...: fault detection and position from the air-data probes.

Portraits: the whitened parity vector of each variable over the square root of the threshold, so that the threshold is
the unit circle whatever its value; what lies far outside is drawn on the rim. Maps: air-path axes of the tanker seen
from behind, y right, z down [m].
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from ground.columns import Columns, Table, thinned
from ground.rrd.palette import BOX, NAV, WHITE, Color
from ground.rrd.series import AXIS, Array, Sink, packed
from ground.views.airdata.read import (
    DIRECTIONS,
    PROBES,
    VARIABLES,
    TruePosition,
    alarm_words,
    channel_words,
    ellipses,
    has_airdata,
    true_position,
    vortices,
)
from ground.views.airdata.signals import of_wake
from ground.views.refueling.aircraft import RECEIVER
from ground.views.refueling.palette import COLOR

FDI, WAKE = "nav/receiver/fdi", "nav/receiver/wake"
MAP, TRUE_MAP, TANKER_MAP = f"{WAKE}/map", "truth/receiver/wake_map", "truth/tanker/wake_map"
RIM = 3.0  # [-] threshold radii drawn
BOX_M = 1.0  # [m] half side of the box about the commanded position
PERIOD_US = 100_000  # [us]
RECENT_US = 500_000  # [us] a sample is current for
SILENT_US = 1_000_000  # [us] without a message: nothing is known
QUIET: Color = (120, 170, 130)
ALARM: Color = (240, 70, 60)
FAINT: Color = (90, 96, 106)
VORTEX: Color = (190, 120, 230)
STATE_COLORS: dict[str, Color] = {"quiet": (55, 105, 70), "none": (55, 105, 70), "valid": (55, 105, 70)}
STATE_COLORS |= {"not checked": (110, 110, 110)}


def airdata(sink: Sink, run: Path, truth: Columns, tlm: Columns) -> None:
    """Send everything of this module; nothing for a run without the messages."""
    if not has_airdata(tlm):
        return
    fdi, wake = tlm.get(RECEIVER, "FDI_STATUS"), tlm.get(RECEIVER, "WAKE_POSITION")
    if fdi is not None:
        _fdi(sink, fdi, wake, tlm.end_us)
    if wake is not None:
        true = true_position(truth)
        _series(sink, wake, true, tlm.end_us)
        _maps(sink, run, wake, true, tlm.get(RECEIVER, "RELATIVE_STATE"))


def _lane(sink: Sink, path: str, t_us: NDArray[np.int64], names: list[str]) -> None:
    """A lane of the state timeline: quiet states green, the others red."""
    look: Mapping[str, Color] = {n: STATE_COLORS.get(n, (200, 60, 60)) for n in set(names)}
    sink.states(path, t_us, names, look)


def current(t_us: NDArray[np.int64], table: Table) -> NDArray[np.bool_]:
    """Whether at times t_us the newest row of a table of samples with a validity is valid and its own sample recent."""
    at = np.searchsorted(table.t_us, t_us, side="right") - 1
    sample = table["time_usec"].astype(np.int64)[at]
    return (at >= 0) & (table["valid"][at] != 0) & (t_us - sample <= RECENT_US)


def _ends(t_us: NDArray[np.int64], names: list[str], end_us: int) -> tuple[NDArray[np.int64], list[str]]:
    """The rows of a lane, "no report" put in where none came for long, up to the end of the log."""
    gap = np.flatnonzero(np.diff(t_us, append=end_us) > SILENT_US)
    return np.insert(t_us, gap + 1, t_us[gap] + SILENT_US), np.insert(
        np.array(names, dtype=object), gap + 1, "no report"
    ).tolist()


def _fdi(sink: Sink, fdi: Table, wake: Table | None, end_us: int) -> None:
    """Portraits, statistic over threshold, lanes of alarms and exclusions. Quiet is only what was checked: by a current test
    against a current wake position."""
    t = fdi.t_us
    h = np.maximum(fdi["threshold"].astype(np.float64), 1e-9)
    fresh = t - fdi["time_usec"].astype(np.int64) <= RECENT_US
    valid = (fdi["valid"] != 0) & fresh
    checked = valid if wake is None else valid & current(t, wake)
    for i, (variable, color) in enumerate(zip(VARIABLES, AXIS, strict=True)):
        on = fdi["alarm"] >> i & 1 > 0
        ratio = fdi["gamma"][:, i] / h
        sink.series(f"{FDI}/ratio/{variable}", t[valid], ratio[valid], variable, color)
        mask = 7 << 3 * i
        names = [
            (alarm_words({"alarm": 1 << i, "isolated": int(a) & mask, "negative": int(b)}) if k else "quiet")
            if c or (k and f)
            else "not checked"
            for k, c, f, a, b in zip(on, checked, fresh, fdi["isolated"], fdi["negative"], strict=True)
        ]
        _lane(sink, f"{FDI}/alarm/{variable}", *_ends(t, names, end_us))
        _portrait(
            sink, f"{FDI}/portrait/{variable}", t[valid], fdi["residual"][valid, 2 * i : 2 * i + 2], h[valid], on[valid]
        )
    sink.level(f"{FDI}/limit", (1.0, 1.0), "threshold", BOX)
    names = [channel_words(int(m)) or "none" for m in fdi["excluded"]]
    _lane(sink, f"{FDI}/excluded", *_ends(t, names, end_us))


def _portrait(sink: Sink, path: str, t_us: NDArray[np.int64], residual: Array, h: Array, alarm: NDArray) -> None:
    """Parity vectors of one variable, the threshold circle, and where a high or low reading of each probe points."""
    flip = np.array([1.0, -1.0])  # a 2-D view's y points down
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rays = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1, keepdims=True) * flip
    lines = [circle, RIM * circle, *(np.array([-RIM * r, RIM * r]) for r in rays)]
    thin = rr.Radius.ui_points(1.0)
    look = rr.LineStrips2D(
        lines, colors=[BOX, FAINT, *[FAINT] * 3], radii=[rr.Radius.ui_points(2.0), thin, *[thin] * 3]
    )
    sink.look(f"{path}/frame", look)
    names = rr.Points2D(
        1.2 * RIM * rays,
        colors=[WHITE],
        radii=rr.Radius.ui_points(0.5),
        labels=[f"{p} +" for p in PROBES],
        show_labels=True,
    )
    sink.look(f"{path}/names", names)
    at = residual.astype(np.float64) * flip / np.sqrt(h)[:, None]
    far = np.linalg.norm(at, axis=1)
    at *= np.where(far > RIM, RIM / np.maximum(far, 1e-9), 1.0)[:, None]
    sink.look(f"{path}/vector", rr.Points2D.from_fields(radii=rr.Radius.ui_points(3.5)))
    hue = packed(np.where(alarm[:, None], ALARM, QUIET))
    sink.rows(f"{path}/vector", t_us, rr.Points2D, positions=at, colors=hue)


def _series(sink: Sink, wake: Table, true: TruePosition, end_us: int) -> None:
    """Error with 2 sigma, wake strength, vortex height, common wind, NIS, validity."""
    at = wake["time_usec"].astype(np.int64)
    known, place = true.at(at)
    use = known & (wake["valid"] != 0)
    t, error = at[use], wake["pos"][use].astype(np.float64) - place[use]
    band = tuple(c // 2 + 20 for c in NAV)
    for i, (axis, column) in enumerate((("y", 0), ("z", 2))):
        s2 = 2.0 * np.sqrt(np.maximum(wake["cov"][use, column].astype(np.float64), 0.0))
        sink.series(f"{WAKE}/error_2sigma/{axis}", t, np.stack([-s2, s2], axis=1), f"{axis} 2 sigma", band, 1.0)
        sink.series(f"{WAKE}/error/{axis}", t, error[:, i + 1], f"{axis} error", AXIS[i + 1], 1.6)
    made = {s.path.split("/", 2)[2]: s for s in of_wake(wake, "receiver")}
    scale, sigma, height, wind, nis = (made[f"wake/{k}"] for k in ("scale", "scale_sigma", "height", "wind", "nis"))
    for i, (name, color) in enumerate((("wing", NAV), ("tail", (40, 140, 145)))):
        k, s = scale.values[:, i], sigma.values[:, i]
        faint, both = tuple(c // 2 for c in color), np.stack([k - s, k + s], axis=1)
        sink.series(f"{WAKE}/scale_1sigma/{name}", scale.t_us, both, f"{name} 1 sigma", faint, 1.0)
        sink.series(f"{WAKE}/scale/{name}", scale.t_us, k, name, color)
    sink.series(f"{WAKE}/height", height.t_us, height.values, "vortices below model [m]", VORTEX)
    for i, axis in enumerate(wind.parts):
        sink.series(f"{WAKE}/wind/{axis}", wind.t_us, wind.values[:, i], f"common wind {axis}", AXIS[i], 1.0)
    sink.series(f"{WAKE}/nis", nis.t_us, nis.values, "NIS / dof", NAV, 1.0)
    reasons = [b.decode("utf-8", "replace") or "not valid" for b in wake["reason"]]
    good = current(wake.t_us, wake)
    names = [
        ("valid" if g else "no new sample") if v else r for v, g, r in zip(wake["valid"], good, reasons, strict=True)
    ]
    _lane(sink, f"{WAKE}/state", *_ends(wake.t_us, names, end_us))


def _maps(sink: Sink, run: Path, wake: Table, true: TruePosition, rel: Table | None) -> None:
    """Tanker with its vortices, truth, command, estimate with its 2-sigma ellipse, trails."""
    if sink.due(TANKER_MAP):
        _tanker(sink, run, float(true.alpha.mean()) if len(true.alpha) else 0.0)
    slot = thinned(true.t_us, PERIOD_US)
    place = true.pos[slot][:, 1:]
    _dot(sink, f"{TRUE_MAP}/position", true.t_us[slot], place, WHITE, 5.0)
    sink.trail(f"{TRUE_MAP}/trail", true.t_us[slot], place, tuple(c * 2 // 3 for c in WHITE), 1.0, gap_us=5 * PERIOD_US)
    if rel is not None:
        d = rel.decimated(PERIOD_US)
        d = d.pick(d.t_us <= (true.t_us[-1] if len(true.t_us) else d.t_us[-1:]))
        goal = true.turn(d.t_us, d["cmd_pos"].astype(np.float64))[:, 1:]
        _dot(sink, "guid/receiver/wake_map/commanded", d.t_us, goal, COLOR["command"], 4.0)
        box = rr.Boxes2D.from_fields(
            half_sizes=[[BOX_M, BOX_M]], radii=rr.Radius.ui_points(0.7), colors=[COLOR["command"]]
        )
        sink.look("guid/receiver/wake_map/box", box)
        sink.rows("guid/receiver/wake_map/box", d.t_us, rr.Boxes2D, centers=goal)
    good = wake["valid"] != 0
    d = wake.pick(good)
    yz = d["pos"][:, 1:].astype(np.float64)
    sink.trail(f"{MAP}/trail", d.t_us, yz, tuple(c * 2 // 3 for c in NAV), 1.0, gap_us=5 * PERIOD_US)
    shown = np.where(good[:, None], wake["pos"][:, 1:], np.float32(np.nan)).astype(np.float64)  # no dot while not valid
    _dot(sink, f"{MAP}/position", wake.t_us, shown, NAV, 5.0)
    sink.look(f"{MAP}/ellipse", rr.LineStrips2D.from_fields(radii=rr.Radius.ui_points(1.5), colors=[NAV]))
    rings = ellipses(yz, d["cov"]).astype(np.float32)
    sink.rows(f"{MAP}/ellipse", d.t_us, rr.LineStrips2D, strips=rings)


def _dot(sink: Sink, path: str, t_us: NDArray[np.int64], at: Array, color: tuple[int, ...], size: float) -> None:
    look = rr.Points2D.from_fields(radii=rr.Radius.ui_points(size), colors=[color])
    sink.look(path, look)
    sink.rows(path, t_us, rr.Points2D, positions=at)


def _tanker(sink: Sink, run: Path, alpha: float) -> None:
    """Surfaces, trailing vortices with their cores and sense of rotation, seen from behind."""
    v = vortices(run, alpha)
    if v is None:
        return
    wide, thin = rr.Radius.ui_points(3.0), rr.Radius.ui_points(1.2)
    sink.whole(f"{TANKER_MAP}/surfaces", rr.LineStrips2D([v.wing, v.tail], colors=[COLOR["tanker"]], radii=wide))
    angle = np.linspace(0.0, 2.0 * np.pi, 41)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    cores = [c + r * ring for c, r in zip(v.centre, v.core, strict=True)]
    sink.whole(f"{TANKER_MAP}/cores", rr.LineStrips2D(cores, colors=[VORTEX], radii=thin))
    dots = rr.Points2D(v.centre, colors=[VORTEX], radii=rr.Radius.ui_points(2.0))
    sink.whole(f"{TANKER_MAP}/vortices", dots)
    left, right = v.centre[:2][np.argsort(v.centre[:2, 0])]
    # names stand apart however small the view is: below the wing's, above the tail's
    at = np.stack([left + (0.0, 1.0), right + (0.0, 1.0), v.centre[2:].mean(axis=0) - (0.0, 9.0)])
    names = ["wing", "wing", "tail vortices"]
    text = rr.Points2D(at, colors=[VORTEX], radii=rr.Radius.ui_points(0.0), labels=names, show_labels=True)
    sink.whole(f"{TANKER_MAP}/names", text)
