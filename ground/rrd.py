"""Run folder -> `run.rrd`: every series in one column-wise call, blueprint embedded.

Entity paths mirror the data path (truth, nav, guid, ctrl, timing, sensors, each with the aircraft's name); timelines are
sim_time and tick. The 3-D scene lives in the tanker's body axes (x forward, y right, z down): its parts are the
entities named .../scene/... . With `ground.blueprint` the only importer of rerun.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flightsw.aircraft import load_aircraft
from flightsw.icd.geo import DEFAULT_ORIGIN, scales
from ground import scene
from ground.blueprint import blueprint
from ground.columns import Columns, Table, hold, load
from ground.geometry import quat_conj, quat_euler, quat_mul, quat_rotate
from ground.metrics import contact_error
from ground.packets import AIRCRAFT, RECEIVER, TANKER, phase_name
from ground.palette import BOX, COLOR, NAV, PHASE_COLORS, TRUTH

APPLICATION = "wakefield"
PERIOD_US = 50_000  # [us] series are thinned to 20 Hz: more cannot be seen and the truth comes at 100 Hz
SCENE_US = 100_000  # [us] 3-D scene at 10 Hz
ARROW = 0.8  # [m per m/s] length of wind arrows
TICK_US = 10_000  # [us] base tick
BOOM_REACH_M = 12.0  # beyond the retracted length the operator does not point at the receiver
Array = NDArray[np.float64]


class Sink:
    """One recording: `series` and friends send whole columns on both timelines."""

    def __init__(self, path: Path, start_us: int, end_us: int, look: object) -> None:
        self.rec = rr.RecordingStream(APPLICATION, recording_id=path.parent.resolve().name or "run")
        self.rec.save(str(path), default_blueprint=look)  # type: ignore[arg-type]
        self.start_us, self.end_us = start_us, end_us

    def times(self, t_us: NDArray[np.int64]) -> list[rr.TimeColumn]:
        """Both time columns of rows at t_us [us]."""
        return [
            rr.TimeColumn("sim_time", duration=t_us * 1e-6),
            rr.TimeColumn("tick", sequence=t_us // TICK_US),
        ]

    def columns(self, path: str, t_us: NDArray[np.int64], columns: object) -> None:
        """Any archetype's columns."""
        if len(t_us):
            self.rec.send_columns(path, indexes=self.times(t_us), columns=columns)  # type: ignore[arg-type]

    def series(
        self,
        path: str,
        t_us: NDArray[np.int64],
        values: Array,
        name: str,
        color: Sequence[int],
        width: float = 1.5,
        step: bool = False,
    ) -> None:
        """One line (values (n,)) or several lines of one style (values (n,k)) of a plot."""
        values = np.asarray(values, dtype=np.float64)
        k = 1 if values.ndim == 1 else values.shape[1]
        style = rr.SeriesLines(
            colors=[color] * k,
            widths=[width] * k,
            names=[name] * k,
            interpolation_mode=rr.components.InterpolationMode.StepAfter if step else None,
            aggregation_policy=rr.components.AggregationPolicy.MinMax,
        )
        self.rec.log(path, style, static=True)
        scalars = rr.Scalars.columns(scalars=values.ravel())
        self.columns(path, t_us, scalars if k == 1 else scalars.partition(lengths=[k] * len(values)))

    def level(self, path: str, values: Sequence[float], name: str, color: Sequence[int]) -> None:
        """Horizontal lines over the whole run."""
        ends = np.array([self.start_us, self.end_us], dtype=np.int64)
        self.series(path, ends, np.array([values, values], dtype=np.float64), name, color, 1.0)

    def states(self, path: str, t_us: NDArray[np.int64], names: list[str], colors: dict[str, Sequence[int]]) -> None:
        """A lane of the state timeline: a row where the state changes."""
        if not names:
            return
        labels = np.array(names)
        change = np.flatnonzero(np.concatenate([[True], labels[1:] != labels[:-1]]))
        used = list(dict.fromkeys(labels[change].tolist()))
        look = rr.StateConfiguration(values=used, colors=[colors.get(u, (120, 120, 120)) for u in used])
        self.rec.log(path, look, static=True)
        self.columns(path, t_us[change], rr.StateChange.columns(state=labels[change].tolist()))

    def close(self) -> None:
        """Write everything out."""
        self.rec.flush()
        self.rec.disconnect()


def convert(run: Path) -> Path:
    """Write `run.rrd` of a run folder and return its path. Raises LogError for a missing log, OSError if unwritable."""
    truth, tlm = load(run / "truth.tlog"), load(run / "tlm.tlog")
    end = max(truth.end_us, tlm.end_us)
    path = run / "run.rrd"
    with path.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    sink = Sink(path, 0, end, blueprint(run.resolve().name, *interest(tlm, end)))
    for sysid, name in AIRCRAFT.items():
        _truth(sink, truth, sysid, name)
        _nav(sink, tlm, sysid, name)
        _mission(sink, tlm, sysid, name)
        _timing(sink, tlm, sysid, name)
    _relative(sink, truth, tlm)
    _scene(sink, truth, tlm)
    from ground.rrd_sensors import sensors  # optional part: only if the links were logged

    sensors(sink, run)
    sink.close()
    return path


def interest(tlm: Columns, end_us: int) -> tuple[float, float]:
    """Time range [s] the first look should show: the contact phase with a margin, else the whole run."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    if status is not None:
        t = status.t_us[status["measure"] != 0]
        if len(t):
            return max(0.0, t[0] * 1e-6 - 60.0), min(end_us * 1e-6, t[-1] * 1e-6 + 30.0)
    return 0.0, end_us * 1e-6


def _truth(sink: Sink, truth: Columns, sysid: int, name: str) -> None:
    """truth/<name>/...: air data, attitude, wind, controls, mass, track on the map."""
    table = truth.get(sysid, "TRUTH")
    if table is None:
        return
    d = table.decimated(PERIOD_US)
    t, c = d.t_us, TRUTH
    for i, axis in enumerate("ned"):
        sink.series(f"truth/{name}/wind/{axis}", t, d["wind_n"][:, i], "truth", c, 1.2)
    euler = np.degrees(quat_euler(d["q_nb"]))
    look = COLOR[name]
    for key, value in (
        ("V", d["V"]),
        ("altitude", -d["pos_n"][:, 2]),
        ("bank", euler[:, 2]),
        ("pitch", euler[:, 1]),
        ("heading", euler[:, 0]),
        ("alpha", np.degrees(d["alpha"])),
        ("beta", np.degrees(d["beta"])),
        ("mass", d["mass"]),
    ):
        sink.series(f"truth/{name}/{key}", t, value, f"{name} {key}", look)
    for i, key in enumerate(("aileron", "elevator", "rudder")):
        sink.series(f"truth/{name}/controls/{key}", t, np.degrees(d["controls"][:, i]), f"{key}", AXIS[i])
    sink.series(f"truth/{name}/controls/thrust", t, d["controls"][:, 3] * 1e-3, f"{name} thrust", look)
    kn, ke = scales(DEFAULT_ORIGIN)
    slow = d.decimated(1_000_000)
    lat, lon = DEFAULT_ORIGIN.lat_deg + slow["pos_n"][:, 0] / kn, DEFAULT_ORIGIN.lon_deg + slow["pos_n"][:, 1] / ke
    geo = np.stack([lat, lon], axis=1)
    line = rr.GeoLineStrings(lat_lon=[geo], radii=rr.Radius.ui_points(1.5), colors=[look])
    sink.rec.log(f"truth/{name}/track", line, static=True)
    dot = rr.GeoPoints.from_fields(radii=rr.Radius.ui_points(6.0), colors=[look])
    sink.rec.log(f"truth/{name}/position", dot, static=True)
    sink.columns(f"truth/{name}/position", slow.t_us, rr.GeoPoints.columns(positions=geo))
    plan = np.stack([slow["pos_n"][:, 1], -slow["pos_n"][:, 0]], axis=1)  # north up: the 2-D view's y points down
    strip = rr.LineStrips2D([plan], radii=rr.Radius.ui_points(1.2), colors=[look])
    sink.rec.log(f"truth/{name}/plan/track", strip, static=True)
    spot = rr.Points2D.from_fields(radii=rr.Radius.ui_points(6.0), colors=[look], labels=[name])
    sink.rec.log(f"truth/{name}/plan/position", spot, static=True)
    sink.columns(f"truth/{name}/plan/position", slow.t_us, rr.Points2D.columns(positions=plan))


AXIS = ((232, 92, 80), (96, 190, 110), (90, 150, 240))  # x, y, z and the like


def _nav(sink: Sink, tlm: Columns, sysid: int, name: str) -> None:
    """nav/<name>/...: estimates with 3-sigma limits, innovation."""
    table = tlm.get(sysid, "NAV_STATE")
    if table is None:
        return
    d = table.pick(table["valid"] != 0).decimated(PERIOD_US)
    t, c = d.t_us, NAV
    band = (c[0] // 2 + 40, c[1] // 2 + 40, c[2] // 2 + 40)
    for i, axis in enumerate("ned"):
        w, s3 = d["wind"][:, i].astype(np.float64), 3.0 * d["wind_sigma"][:, i]
        sink.series(f"nav/{name}/wind/{axis}", t, w, "estimate", c, 1.8)
        sink.series(f"nav/{name}/wind_3sigma/{axis}", t, np.stack([w - s3, w + s3], axis=1), "3 sigma", band, 1.0)
    for key, value in (
        ("V", d["V"]),
        ("alpha", np.degrees(d["alpha"])),
        ("beta", np.degrees(d["beta"])),
        ("bank", np.degrees(d["phi"])),
        ("pitch", np.degrees(d["theta"])),
        ("heading", np.degrees(np.angle(np.exp(1j * d["psi"].astype(np.float64))))),
    ):
        sink.series(f"nav/{name}/{key}", t, value, f"{name} {key} estimate", c, 1.0)
    ratio = d["nis"] / np.maximum(d["nis_dof"], 1)
    sink.series(f"nav/{name}/nis", t, ratio, f"{name} NIS / dof", COLOR[name])


def _mission(sink: Sink, tlm: Columns, sysid: int, name: str) -> None:
    """guid/<name>/... phase, references; ctrl/<name>/... commands; sensors/<name>/health; texts."""
    table = tlm.get(sysid, "MISSION_STATUS")
    if table is not None:
        t = table.t_us
        names = [phase_name(int(p)) for p in table["phase"]]
        sink.states(f"guid/{name}/phase", t, names, PHASE_COLORS)
        if sysid == RECEIVER:
            flags = ["MEASURING" if m else ("LATCHED" if k else "free") for m, k in zip(table["measure"], table["contact"], strict=True)]
            sink.states(f"guid/{name}/boom", t, flags, PHASE_COLORS)
        _phase_log(sink, table, names, name)
        d = table.decimated(PERIOD_US)
        for i, key in enumerate(("aileron", "elevator", "rudder")):
            sink.series(f"ctrl/{name}/{key}", d.t_us, np.degrees(d[key]), f"{key} command", AXIS[i], 1.0)
        sink.series(f"ctrl/{name}/throttle", d.t_us, 100.0 * d["throttle"], f"{name} throttle", COLOR[name])
        if np.any(d["cmd_V"] > 0):
            sink.series(f"guid/{name}/V", d.t_us, d["cmd_V"], f"{name} V command", BOX, 1.0, step=True)
            sink.series(f"guid/{name}/altitude", d.t_us, d["cmd_alt"], f"{name} altitude command", BOX, 1.0, step=True)
    text = tlm.get(sysid, "STATUSTEXT")
    if text is not None:
        lines = [f"{name}: {b.decode('utf-8', 'replace')}" for b in text["text"]]
        level = ["ERROR" if s <= 3 else "WARN" if s == 4 else "INFO" for s in text["severity"]]
        sink.columns(f"guid/{name}/text", text.t_us, rr.TextLog.columns(text=lines, level=level))
    health = tlm.get(sysid, "HEALTH_STATUS")
    if health is not None:
        states = ["healthy" if f == 0 else f"failed {int(f):#x}" for f in health["failed"]]
        sink.states(f"sensors/{name}/health", health.t_us, states, PHASE_COLORS)
        for key in ("bad_packets", "rejected"):
            sink.series(f"sensors/{name}/{key}", health.t_us, health[key], f"{name} {key}", COLOR[name], step=True)


def _phase_log(sink: Sink, table: Table, names: list[str], name: str) -> None:
    """Phase changes with their reason as text rows."""
    phase = table["phase"].astype(int)
    change = np.flatnonzero(np.diff(phase, prepend=-1) != 0)
    lines = [f"{name}: {names[k]} ({table['reason'][k].decode('utf-8', 'replace')})" for k in change]
    sink.columns(f"guid/{name}/phases", table.t_us[change], rr.TextLog.columns(text=lines, level=["INFO"] * len(lines)))


def _timing(sink: Sink, tlm: Columns, sysid: int, name: str) -> None:
    """timing/<name>/...: execution time, lateness, slips."""
    table = tlm.get(sysid, "LOOP_TIMING")
    if table is None:
        return
    for key in ("exec_mean", "exec_max", "late_p50", "late_p99", "late_max", "slips"):
        label = f"{name} {key}" + ("" if key == "slips" else " us")
        bright = tuple(int(v * (0.6 if key.endswith(("max", "p50")) else 1.0)) for v in COLOR[name])
        sink.series(f"timing/{name}/{key}", table.t_us, table[key], label, bright, step=key == "slips")
    at = np.array([sink.start_us, sink.end_us])
    lost = float(tlm.dropped.get(sysid, 0))
    sink.series(f"timing/{name}/telemetry_lost", at, np.array([lost, lost]), f"{name} telemetry lost", COLOR[name])


def _relative(sink: Sink, truth: Columns, tlm: Columns) -> None:
    """Station keeping of the receiver: truth, estimate, command, error and its box."""
    t_us, error = contact_error(truth, tlm)
    for i, axis in enumerate("xyz"):
        sink.series(f"guid/receiver/error/{axis}", t_us, error[:, i], f"{axis} error", AXIS[i], 1.5)
    sink.level("guid/receiver/box", (-2.0, 2.0), "box +-2 m", BOX)
    sink.level("guid/receiver/target", (-0.4, 0.4), "+-0.4 m", (110, 110, 90))
    true, rel = truth.get(RECEIVER, "TRUTH"), tlm.get(RECEIVER, "RELATIVE_STATE")
    if true is not None:
        d = true.decimated(PERIOD_US)
        for i, axis in enumerate("xyz"):
            sink.series(f"truth/receiver/xi/{axis}", d.t_us, d["xi"][:, i], f"{axis} truth", AXIS[i])
    if rel is not None:
        d = rel.pick(rel["valid"] != 0).decimated(PERIOD_US)
        for i, axis in enumerate("xyz"):
            sink.series(f"nav/receiver/xi/{axis}", d.t_us, d["pos"][:, i], f"{axis} estimate", NAV, 1.0)
            sink.series(f"guid/receiver/xi/{axis}", d.t_us, d["cmd_pos"][:, i], f"{axis} command", BOX, 1.0)


def _scene(sink: Sink, truth: Columns, tlm: Columns) -> None:
    """The 3-D view in the tanker's body axes."""
    tanker, receiver = truth.get(TANKER, "TRUTH"), truth.get(RECEIVER, "TRUTH")
    if tanker is None or receiver is None:
        return
    sink.rec.log("/", rr.ViewCoordinates.FRD, static=True)
    for name, mesh in (("tanker", scene.tanker_mesh()), ("receiver", scene.receiver_mesh())):
        shape = rr.Mesh3D(vertex_positions=mesh.vertices, vertex_normals=mesh.normals, vertex_colors=mesh.colors)
        sink.rec.log(f"truth/{name}/scene/body", shape, static=True)
    _, it, ir = np.intersect1d(tanker.t_us, receiver.t_us, return_indices=True)
    both = np.flatnonzero(np.diff(tanker.t_us[it] // SCENE_US, prepend=-1) != 0)
    tk, rv = tanker.pick(it[both]), receiver.pick(ir[both])
    t, to_body = tk.t_us, quat_conj(tk["q_nb"])
    q = quat_mul(to_body, rv["q_nb"])
    pose = rr.Transform3D.columns(translation=rv["xi"], quaternion=np.roll(q, -1, axis=1))
    sink.columns("truth/receiver/scene", t, pose)
    _trail(sink, "truth/receiver/trail", t, rv["xi"])
    _boom(sink, t, rv)
    _wind_arrows(sink, tlm, t, to_body, tk, rv)
    rel = tlm.get(RECEIVER, "RELATIVE_STATE")
    if rel is not None:
        d = rel.decimated(SCENE_US)
        look = rr.Points3D.from_fields(radii=[0.35], colors=[COLOR["command"]])
        sink.rec.log("guid/receiver/scene/commanded", look, static=True)
        sink.columns("guid/receiver/scene/commanded", d.t_us, rr.Points3D.columns(positions=d["cmd_pos"]))


def _trail(sink: Sink, path: str, t: NDArray[np.int64], xi: Array) -> None:
    """Receiver path as short segments; the view's visible history joins them to a trail."""
    if len(xi) < 2:
        return
    segments = np.stack([xi[:-1], xi[1:]], axis=1).astype(np.float32)
    look = rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.5), colors=[COLOR["receiver"]])
    sink.rec.log(path, look, static=True)
    sink.columns(path, t[1:], rr.LineStrips3D.columns(strips=segments))


def _boom(sink: Sink, t: NDArray[np.int64], rv: Table) -> None:
    """Envelope, fixed and telescoping tube; the tube points at the receptacle when it is near, else it trails."""
    boom = load_aircraft("kc135r").boom
    if boom is None:
        return
    lines = scene.envelope_lines(boom)
    edge = rr.LineStrips3D(lines, radii=rr.Radius.ui_points(1.0), colors=[COLOR["envelope"]])
    sink.rec.log("truth/tanker/boom/envelope", edge, static=True)
    near = np.abs(rv["boom_extension"]) < BOOM_REACH_M
    el = np.where(near, np.clip(rv["boom_elevation"], *np.radians(boom.elevation_deg)), np.radians(-30.0))
    az = np.where(near, np.clip(rv["boom_azimuth"], *np.radians(boom.azimuth_deg)), 0.0)
    ext = np.where(near, np.clip(rv["boom_extension"], 0.0, boom.extension_m[1]), boom.extension_m[0])
    ext = np.where(rv["contact"] != 0, ext, np.minimum(ext, 0.5 * sum(boom.extension_m)))
    fixed, tele = scene.boom_strips(boom, el, az, ext)
    contact, inside = (rv[k] != 0 for k in ("contact", "inside"))
    hue = [COLOR["latched"] if c else COLOR["inside"] if i else COLOR["boom"] for c, i in zip(contact, inside, strict=True)]
    sink.rec.log("truth/tanker/boom/fixed", rr.LineStrips3D.from_fields(radii=[0.33], colors=[COLOR["boom"]]), static=True)
    sink.columns("truth/tanker/boom/fixed", t, rr.LineStrips3D.columns(strips=fixed.astype(np.float32)))
    sink.rec.log("truth/tanker/boom/nozzle", rr.LineStrips3D.from_fields(radii=[0.16]), static=True)
    packed = np.array([(r << 24) | (g << 16) | (b << 8) | 255 for r, g, b in hue], dtype=np.uint32)
    sink.columns("truth/tanker/boom/nozzle", t, rr.LineStrips3D.columns(strips=tele.astype(np.float32), colors=packed))


def _wind_arrows(sink: Sink, tlm: Columns, t: NDArray[np.int64], to_body: Array, tk: Table, rv: Table) -> None:
    """Wind at both aircraft, truth and estimate, in the tanker's body axes, beginning above each aircraft."""
    for sysid, name, true, at in ((TANKER, "tanker", tk, 0.0 * rv["xi"]), (RECEIVER, "receiver", rv, rv["xi"])):
        origin = at + np.array([0.0, 0.0, -4.0 if sysid == TANKER else -3.0])
        nav = tlm.get(sysid, "NAV_STATE")
        vectors = [("truth", TRUTH, true["wind_n"].astype(np.float64))]
        if nav is not None:
            held = np.stack([hold(t, nav.t_us, nav["wind"][:, i].astype(np.float64)) for i in range(3)], axis=1)
            vectors.append(("nav", NAV, held))
        for kind, color, wind in vectors:
            path = f"{kind}/{name}/wind_arrow"
            sink.rec.log(path, rr.Arrows3D.from_fields(radii=[0.14], colors=[color]), static=True)
            body = ARROW * quat_rotate(to_body, wind)
            sink.columns(path, t, rr.Arrows3D.columns(vectors=body, origins=origin))
