"""Entities every run has, of each of its aircraft: the lines of its signals (ground.rrd.lines), tracks, texts, failures. What a
view has drawn stands.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr

from flightsw.icd.geo import DEFAULT_ORIGIN, scales
from ground.columns import Columns, Table
from ground.link.packets import phase_name
from ground.rrd.lines import lines
from ground.rrd.palette import CRAFTS, Color
from ground.rrd.series import Sink
from ground.rrd.terms import draw, laws_of
from ground.run import Run
from ground.signals import GROUPS

SENSORS = "sensors"  # of the groups of signals, the one read from the link logs


def flight(sink: Sink, run: Run, states: Mapping[str, Color]) -> None:
    """Signals of truth and telemetry, tracks, texts, failures; `states`: colours of phases and health."""
    for i, (sysid, name) in enumerate(run.names.items()):
        look = CRAFTS[i % len(CRAFTS)]
        lines(sink, run, sysid, name, look, states, [k for k in GROUPS if k != SENSORS])
        _tracks(sink, run.truth, sysid, name, look)
        _texts(sink, run.tlm, sysid, name)
        _lost(sink, run.tlm, sysid, name, look)
    _failures(sink, run)


def sensors(sink: Sink, run: Run, states: Mapping[str, Color]) -> None:
    """Health, and what the onboard software was fed."""
    for i, (sysid, name) in enumerate(run.names.items()):
        lines(sink, run, sysid, name, CRAFTS[i % len(CRAFTS)], states, [SENSORS])


def laws(sink: Sink, run: Run, states: Mapping[str, Color]) -> None:
    """What the control laws report."""
    draw(sink, laws_of(run))


COMMON = (flight, sensors, laws)  # all that every run has, in parts a live picture may draw in turn


def _tracks(sink: Sink, truth: Columns, sysid: int, name: str, look: Color) -> None:
    """truth/<name>/...: track and place on the map and in plan."""
    table = truth.get(sysid, "TRUTH")
    if table is None:
        return
    kn, ke = scales(DEFAULT_ORIGIN)
    slow = table.decimated(1_000_000)
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


def _texts(sink: Sink, tlm: Columns, sysid: int, name: str) -> None:
    """guid/<name>/phases and text: changes of phase with their reason, what it said."""
    table = tlm.get(sysid, "MISSION_STATUS")
    if table is not None:
        _phase_log(sink, table, [phase_name(int(p)) for p in table["phase"]], name)
    text = tlm.get(sysid, "STATUSTEXT")
    if text is not None:
        lines = [f"{name}: {b.decode('utf-8', 'replace')}" for b in text["text"]]
        level = ["ERROR" if s <= 3 else "WARN" if s == 4 else "INFO" for s in text["severity"]]
        sink.rows(f"guid/{name}/text", text.t_us, rr.TextLog, text=lines, level=level)


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


def _lost(sink: Sink, tlm: Columns, sysid: int, name: str, look: Color) -> None:
    """timing/<name>/telemetry_lost: packets missing by sequence, of the whole run."""
    if tlm.get(sysid, "LOOP_TIMING") is not None:
        path, lost = f"timing/{name}/telemetry_lost", float(tlm.dropped.get(sysid, 0))
        at = sink.ends(path)
        sink.series(path, at, np.full(len(at), lost), f"{name} telemetry lost", look)
