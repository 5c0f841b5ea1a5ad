"""Entities every run has, of each of its aircraft: truth, estimate, mission, timing, failures. What a view has drawn stands.

Paths mirror the data path (truth, nav, guid, ctrl, timing, sensors, each with the aircraft's name).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr

from flightsw.icd.geo import DEFAULT_ORIGIN, scales
from ground.columns import Columns, Table
from ground.geometry import quat_euler
from ground.link.packets import health_words, phase_name
from ground.rrd.palette import BAND, BOX, CRAFTS, NAV, TRUTH, Color
from ground.rrd.series import AXIS, Sink
from ground.run import Run

PERIOD_US = 100_000  # [us] series are thinned to 10 Hz, the rate of the telemetry; the truth comes faster


def common(sink: Sink, run: Run, states: Mapping[str, Color]) -> None:
    """Send everything of this module; `states`: colours of phases and health."""
    for i, (sysid, name) in enumerate(run.names.items()):
        look = CRAFTS[i % len(CRAFTS)]
        _truth(sink, run.truth, sysid, name, look)
        _nav(sink, run.tlm, sysid, name, look)
        _mission(sink, run.tlm, sysid, name, look, states)
        _timing(sink, run.tlm, sysid, name, look)
    _failures(sink, run)


def _truth(sink: Sink, truth: Columns, sysid: int, name: str, look: Color) -> None:
    """truth/<name>/...: air data, attitude, wind, controls, mass, track on the map."""
    table = truth.get(sysid, "TRUTH")
    if table is None:
        return
    d = table.decimated(PERIOD_US)
    t, c = d.t_us, TRUTH
    for i, axis in enumerate("ned"):
        sink.series(f"truth/{name}/wind/{axis}", t, d["wind_n"][:, i], "truth", c, 1.0)
    euler = np.degrees(quat_euler(d["q_nb"]))
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
    sink.trail(f"truth/{name}/track", slow.t_us, geo, look, kind=rr.GeoLineStrings)
    sink.look(f"truth/{name}/position", rr.GeoPoints.from_fields(radii=rr.Radius.ui_points(6.0), colors=[look]))
    sink.rows(f"truth/{name}/position", slow.t_us, rr.GeoPoints, positions=geo)
    plan = np.stack([slow["pos_n"][:, 1], -slow["pos_n"][:, 0]], axis=1)  # north up: the 2-D view's y points down
    sink.trail(f"truth/{name}/plan/track", slow.t_us, plan, look, 1.2)
    spot = rr.Points2D.from_fields(radii=rr.Radius.ui_points(6.0), colors=[look], labels=[name])
    sink.look(f"truth/{name}/plan/position", spot)
    sink.rows(f"truth/{name}/plan/position", slow.t_us, rr.Points2D, positions=plan)


def _nav(sink: Sink, tlm: Columns, sysid: int, name: str, look: Color) -> None:
    """nav/<name>/...: estimates with 3-sigma limits, innovation."""
    table = tlm.get(sysid, "NAV_STATE")
    if table is None:
        return
    d = table.pick(table["valid"] != 0).decimated(PERIOD_US)
    t, c = d.t_us, NAV
    for i, axis in enumerate("ned"):
        w, s3 = d["wind"][:, i].astype(np.float64), 3.0 * d["wind_sigma"][:, i]
        sink.series(f"nav/{name}/wind/{axis}", t, w, "estimate", c, 2.4)
        sink.series(f"nav/{name}/wind_3sigma/{axis}", t, np.stack([w - s3, w + s3], axis=1), "3 sigma", BAND, 1.0)
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
    sink.series(f"nav/{name}/nis", t, ratio, f"{name} NIS / dof", look)


def _mission(sink: Sink, tlm: Columns, sysid: int, name: str, look: Color, states: Mapping[str, Color]) -> None:
    """guid/<name>/... phase, references; ctrl/<name>/... commands; sensors/<name>/health; texts."""
    table = tlm.get(sysid, "MISSION_STATUS")
    if table is not None:
        t = table.t_us
        names = [phase_name(int(p)) for p in table["phase"]]
        sink.states(f"guid/{name}/phase", t, names, states)
        _phase_log(sink, table, names, name)
        d = table.decimated(PERIOD_US)
        for i, key in enumerate(("aileron", "elevator", "rudder")):
            sink.series(f"ctrl/{name}/{key}", d.t_us, np.degrees(d[key]), f"{key} command", AXIS[i], 1.0)
        sink.series(f"ctrl/{name}/throttle", d.t_us, 100.0 * d["throttle"], f"{name} throttle", look)
        if np.any(d["cmd_V"] > 0):
            sink.series(f"guid/{name}/V", d.t_us, d["cmd_V"], f"{name} V command", BOX, 1.0, step=True)
            sink.series(f"guid/{name}/altitude", d.t_us, d["cmd_alt"], f"{name} altitude command", BOX, 1.0, step=True)
    text = tlm.get(sysid, "STATUSTEXT")
    if text is not None:
        lines = [f"{name}: {b.decode('utf-8', 'replace')}" for b in text["text"]]
        level = ["ERROR" if s <= 3 else "WARN" if s == 4 else "INFO" for s in text["severity"]]
        sink.rows(f"guid/{name}/text", text.t_us, rr.TextLog, text=lines, level=level)
    health = tlm.get(sysid, "HEALTH_STATUS")
    if health is not None:
        words = [health_words(int(f)) for f in health["failed"]]
        sink.states(f"sensors/{name}/health", health.t_us, words, states)
        for key in ("bad_packets", "rejected"):
            sink.series(f"sensors/{name}/{key}", health.t_us, health[key], f"{name} {key}", look, step=True)


def _phase_log(sink: Sink, table: Table, names: list[str], name: str) -> None:
    """Phase changes with their reason as text rows."""
    phase = table["phase"].astype(int)
    change = np.flatnonzero(np.diff(phase, prepend=-1) != 0)
    lines = [f"{name}: {names[k]} ({table['reason'][k].decode('utf-8', 'replace')})" for k in change]
    sink.events(f"guid/{name}/phases", table.t_us, change, rr.TextLog, text=lines, level=["INFO"] * len(lines))


def _failures(sink: Sink, run: Run) -> None:
    """sensors/<name>/failures: what the plant was told to make fail, from its log, as text rows."""
    for sysid, name in run.names.items():
        text = run.plant.get(sysid, "STATUSTEXT")
        if text is not None:
            lines = [f"{name} failure: {b.decode('utf-8', 'replace')}" for b in text["text"]]
            sink.rows(f"sensors/{name}/failures", text.t_us, rr.TextLog, text=lines, level=["WARN"] * len(lines))


def _timing(sink: Sink, tlm: Columns, sysid: int, name: str, look: Color) -> None:
    """timing/<name>/...: execution time, lateness, slips."""
    table = tlm.get(sysid, "LOOP_TIMING")
    if table is None:
        return
    for key in ("exec_mean", "exec_max", "late_p50", "late_p99", "late_max", "slips"):
        label = f"{name} {key}" + ("" if key == "slips" else " us")
        bright = tuple(int(v * (0.75 if key.endswith(("max", "p50")) else 1.0)) for v in look)
        sink.series(f"timing/{name}/{key}", table.t_us, table[key], label, bright, step=key == "slips")
    path, lost = f"timing/{name}/telemetry_lost", float(tlm.dropped.get(sysid, 0))
    at = sink.ends(path)
    sink.series(path, at, np.full(len(at), lost), f"{name} telemetry lost", look)
