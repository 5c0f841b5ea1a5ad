"""The 3-D scene in the tanker's body axes (x forward, y right, z down): aircraft, boom and envelope, trail, commanded
position, wind arrows.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flightsw.aircraft import Boom, load_aircraft
from ground.columns import Columns, Table, hold, thinned
from ground.geometry import quat_conj, quat_mul, quat_rotate
from ground.rrd.palette import NAV, WHITE
from ground.rrd.series import Array, Sink, packed
from ground.views.refueling import scene
from ground.views.refueling.aircraft import RECEIVER, TANKER
from ground.views.refueling.palette import COLOR

SCENE_US = 100_000  # [us] 10 Hz
ARROW = 0.5  # [m per m/s] length of wind arrows
BOOM_REACH_M = 12.0  # beyond the retracted length the operator does not point at the receiver


def scene3d(sink: Sink, truth: Columns, tlm: Columns) -> None:
    """The 3-D view in the tanker's body axes."""
    tanker, receiver = truth.get(TANKER, "TRUTH"), truth.get(RECEIVER, "TRUTH")
    if tanker is None or receiver is None:
        return
    sink.look("/", rr.ViewCoordinates.FRD)
    for name, make in (("tanker", scene.tanker_mesh), ("receiver", scene.receiver_mesh)):
        if not sink.new(f"truth/{name}/scene/body"):
            continue
        mesh = make()
        shape = rr.Mesh3D(vertex_positions=mesh.vertices, vertex_normals=mesh.normals, vertex_colors=mesh.colors)
        sink.look(f"truth/{name}/scene/body", shape)
    _, it, ir = np.intersect1d(tanker.t_us, receiver.t_us, return_indices=True)
    both = thinned(tanker.t_us[it], SCENE_US)
    tk, rv = tanker.pick(it[both]), receiver.pick(ir[both])
    t, to_body = tk.t_us, quat_conj(tk["q_nb"])
    q = quat_mul(to_body, rv["q_nb"])
    pose = {"translation": rv["xi"], "quaternion": np.roll(q, -1, axis=1)}
    sink.rows("truth/receiver/scene", t, rr.Transform3D, **pose)
    sink.trail("truth/receiver/trail", t, rv["xi"], COLOR["receiver"])
    _boom(sink, t, rv)
    _wind_arrows(sink, tlm, t, to_body, tk, rv)
    rel = tlm.get(RECEIVER, "RELATIVE_STATE")
    if rel is not None:
        d = rel.decimated(SCENE_US)
        look = rr.Points3D.from_fields(radii=[0.35], colors=[COLOR["command"]])
        sink.look("guid/receiver/scene/commanded", look)
        sink.rows("guid/receiver/scene/commanded", d.t_us, rr.Points3D, positions=d["cmd_pos"])


@cache
def _shape() -> Boom | None:
    return load_aircraft("kc135r").boom


def _boom(sink: Sink, t: NDArray[np.int64], rv: Table) -> None:
    """Envelope, fixed and telescoping tube; the tube points at the receptacle when it is near, else it trails."""
    boom = _shape()
    if boom is None:
        return
    lines = scene.envelope_lines(boom)
    edge = rr.LineStrips3D(lines, radii=rr.Radius.ui_points(1.0), colors=[COLOR["envelope"]])
    sink.look("truth/tanker/boom/envelope", edge)
    near = np.abs(rv["boom_extension"]) < BOOM_REACH_M
    el = np.where(near, np.clip(rv["boom_elevation"], *np.radians(boom.elevation_deg)), np.radians(-30.0))
    az = np.where(near, np.clip(rv["boom_azimuth"], *np.radians(boom.azimuth_deg)), 0.0)
    ext = np.where(near, np.clip(rv["boom_extension"], 0.0, boom.extension_m[1]), boom.extension_m[0])
    ext = np.where(rv["contact"] != 0, ext, np.minimum(ext, 0.5 * sum(boom.extension_m)))
    fixed, tele = scene.boom_strips(boom, el, az, ext)
    contact, inside = (rv[k] != 0 for k in ("contact", "inside"))
    hue = [
        COLOR["latched"] if c else COLOR["inside"] if i else COLOR["boom"] for c, i in zip(contact, inside, strict=True)
    ]
    sink.look("truth/tanker/boom/fixed", rr.LineStrips3D.from_fields(radii=[0.33], colors=[COLOR["boom"]]))
    sink.rows("truth/tanker/boom/fixed", t, rr.LineStrips3D, strips=fixed.astype(np.float32))
    sink.look("truth/tanker/boom/nozzle", rr.LineStrips3D.from_fields(radii=[0.16]))
    sink.rows(
        "truth/tanker/boom/nozzle",
        t,
        rr.LineStrips3D,
        strips=tele.astype(np.float32),
        colors=packed(np.array(hue).reshape(-1, 3)),
    )


def _wind_arrows(sink: Sink, tlm: Columns, t: NDArray[np.int64], to_body: Array, tk: Table, rv: Table) -> None:
    """Wind at both aircraft, truth and estimate, in the tanker's body axes, beginning above each aircraft."""
    for sysid, name, true, at in ((TANKER, "tanker", tk, 0.0 * rv["xi"]), (RECEIVER, "receiver", rv, rv["xi"])):
        origin = at + np.array([0.0, 0.0, -4.0 if sysid == TANKER else -3.0])
        nav = tlm.get(sysid, "NAV_STATE")
        vectors = [("truth", WHITE, true["wind_n"].astype(np.float64))]
        if nav is not None:
            held = np.stack([hold(t, nav.t_us, nav["wind"][:, i].astype(np.float64)) for i in range(3)], axis=1)
            vectors.append(("nav", NAV, held))
        for kind, color, wind in vectors:
            path = f"{kind}/{name}/wind_arrow"
            sink.look(path, rr.Arrows3D.from_fields(radii=[0.16], colors=[color]))
            body = ARROW * quat_rotate(to_body, wind)
            start = origin - np.array([0.0, 0.0, 0.7 if kind == "truth" else 0.0])  # side by side, not one in the other
            sink.rows(path, t, rr.Arrows3D, vectors=body, origins=start)
