"""Where the receiver is from the tanker, in the tanker's axes: truth, estimate, command, error of station keeping."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ground.run import Run
from ground.signals import XYZ, Signal
from ground.views.refueling.aircraft import RECEIVER
from ground.views.refueling.figures import contact_error


def signals(run: Run) -> Iterator[Signal]:
    """{truth, nav, guid}/<receiver>/xi, guid/<receiver>/error: [m], x forward, y right, z down."""
    name = run.names.get(RECEIVER)
    true, rel = run.truth.get(RECEIVER, "TRUTH"), run.tlm.get(RECEIVER, "RELATIVE_STATE")
    if name is None or rel is None:
        return
    if true is not None:
        yield Signal(f"truth/{name}/xi", true.t_us, true["xi"], "m", XYZ, "TRUTH")
    d = rel.pick(rel["valid"] != 0)
    for top, key in (("nav", "pos"), ("guid", "cmd_pos")):
        yield Signal(f"{top}/{name}/xi", d.t_us, d[key].astype(np.float64), "m", XYZ, "RELATIVE_STATE")
    t_us, error = contact_error(run.truth, run.tlm)
    if len(t_us):
        yield Signal(f"guid/{name}/error", t_us, error, "m", XYZ, "station_keeping")
