"""Run folder -> `run.rrd`: every series in one column-wise call, blueprint embedded.

Entity paths mirror the data path (truth, nav, guid, ctrl, timing, sensors, each with the aircraft's name); timelines
are sim_time and tick. This package and `ground.rrd.blueprint` are the only importers of rerun.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import rerun as rr

from flightsw.icd.geo import DEFAULT_ORIGIN, scales
from ground.columns import Columns, Table, load
from ground.folder import load_run
from ground.geometry import quat_euler
from ground.link.packets import AIRCRAFT, RECEIVER, health_words, phase_name
from ground.metrics import contact_error
from ground.rrd.blueprint import Plots, blueprint
from ground.rrd.palette import BOX, COLOR, NAV, PHASE_COLORS, TRUTH
from ground.rrd.scene3d import scene3d
from ground.rrd.sensors import sensors
from ground.rrd.series import AXIS, Sink
from ground.views.airdata.draw import airdata, airdata_tab, close_centre
from ground.views.airdata.read import has_airdata
from ground.views.gust.draw import convert_gust
from ground.views.gust.read import has_gust
from ground.views.joinup.draw import has_joinup, joinup, joinup_tab, until_joinup
from ground.views.joinup.draw import span as join_span
from ground.views.rendezvous.draw import rendezvous, rendezvous_map, rendezvous_tab
from ground.views.rendezvous.read import has_rendezvous
from ground.views.windshear.draw import convert_windshear
from ground.views.windshear.read import has_windshear

PERIOD_US = 100_000  # [us] series are thinned to 10 Hz, the rate of the telemetry; the truth comes faster


def convert(run: Path, out: Path | None = None, near: bool = False, tab: str = "") -> Path:
    """Write `run.rrd` of a run folder (or `out`) and return its path; `near`: first look at the boom; `tab`: the plots
    shown first.

    Raises LogError for what is no run folder or no log, NoTabError for an unknown tab, OSError if unwritable.
    """
    truth, tlm = load_run(run)
    end = max(truth.end_us, tlm.end_us)
    path = run / "run.rrd" if out is None else out
    if has_gust(tlm):
        return convert_gust(run, path, truth, tlm, tab)
    if has_windshear(tlm):
        return convert_windshear(run, path, truth, tlm, tab)
    name = run.resolve().name or "run"
    span = interest(tlm, end)
    extra = [airdata_tab(Plots(*span), close_centre(truth, tlm))] if has_airdata(tlm) else []
    first = []
    if has_rendezvous(tlm):
        extra.append(rendezvous_tab(Plots(*span)))
        if tlm.get(RECEIVER, "RELATIVE_STATE") is None:  # no station keeping to look at
            first, tab = [rendezvous_map(truth)], tab or "rendezvous"
    if has_joinup(tlm):
        span = join_span(tlm, end * 1e-6)
        extra.append(joinup_tab(Plots(*span)))
        tab = tab or "join-up"
        if has_rendezvous(tlm) and not near:
            first = [rendezvous_map(until_joinup(truth, tlm))]
    look = blueprint(name, *span, near, extra, tab, first)
    with path.open("wb"):  # a plain message for a read-only folder, before rerun starts
        pass
    sink = Sink(path, name, 0, end, look)
    for sysid, name in AIRCRAFT.items():
        _truth(sink, truth, sysid, name)
        _nav(sink, tlm, sysid, name)
        _mission(sink, tlm, sysid, name)
        _timing(sink, tlm, sysid, name)
    _relative(sink, truth, tlm)
    airdata(sink, run, truth, tlm)
    rendezvous(sink, truth, tlm)
    joinup(sink, truth, tlm)
    _failures(sink, run)
    scene3d(sink, truth, tlm)
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


def contact_time(tlm: Columns) -> float | None:
    """A time [s] worth a picture: the middle of the measured contact; None without contact."""
    status = tlm.get(RECEIVER, "MISSION_STATUS")
    t = status.t_us[status["measure"] != 0] if status is not None else []
    return float(t[len(t) // 2]) * 1e-6 if len(t) else None


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
            flags = [
                "MEASURING" if m else ("LATCHED" if k else "free")
                for m, k in zip(table["measure"], table["contact"], strict=True)
            ]
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
        states = [health_words(int(f)) for f in health["failed"]]
        sink.states(f"sensors/{name}/health", health.t_us, states, PHASE_COLORS)
        for key in ("bad_packets", "rejected"):
            sink.series(f"sensors/{name}/{key}", health.t_us, health[key], f"{name} {key}", COLOR[name], step=True)


def _phase_log(sink: Sink, table: Table, names: list[str], name: str) -> None:
    """Phase changes with their reason as text rows."""
    phase = table["phase"].astype(int)
    change = np.flatnonzero(np.diff(phase, prepend=-1) != 0)
    lines = [f"{name}: {names[k]} ({table['reason'][k].decode('utf-8', 'replace')})" for k in change]
    sink.columns(f"guid/{name}/phases", table.t_us[change], rr.TextLog.columns(text=lines, level=["INFO"] * len(lines)))


def _failures(sink: Sink, run: Path) -> None:
    """sensors/<name>/failures: what the plant was told to make fail, from RUN/plant.tlog, as text rows."""
    path = run / "plant.tlog"
    log = load(path) if path.exists() else Columns()
    for sysid, name in AIRCRAFT.items():
        text = log.get(sysid, "STATUSTEXT")
        if text is not None:
            lines = [f"{name} failure: {b.decode('utf-8', 'replace')}" for b in text["text"]]
            row = rr.TextLog.columns(text=lines, level=["WARN"] * len(lines))
            sink.columns(f"sensors/{name}/failures", text.t_us, row)


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
