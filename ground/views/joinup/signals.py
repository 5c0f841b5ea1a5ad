"""A join-up's signals: distance, closure, height over the tanker, clearance of its wake; what was wanted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ground.columns import hold, match
from ground.run import Run
from ground.signals import Signal
from ground.views.joinup.figures import JOIN_UP, OBSERVATION, has_joinup, wake_clearance
from ground.views.refueling.aircraft import RECEIVER, TANKER

PERIOD_US = 500_000  # [us] a closure is the change of the distance over that
SOURCE = "join"


def signals(run: Run) -> Iterator[Signal]:
    """truth/<receiver>/join/{distance, height}; from the join-up to the observation position closure [m/s], in the join-up
    wake_clearance; guid/<receiver>/join/closure as wanted in it. Empty for a receiver that was not en route."""
    name, tlm = run.names.get(RECEIVER), run.tlm
    true, lead, status = (
        run.truth.get(RECEIVER, "TRUTH"),
        run.truth.get(TANKER, "TRUTH"),
        tlm.get(RECEIVER, "MISSION_STATUS"),
    )
    if name is None or true is None or status is None or lead is None or not has_joinup(tlm):
        return
    at = f"truth/{name}/join"
    distance = np.linalg.norm(true["xi"].astype(np.float64), axis=1)
    yield Signal(f"{at}/distance", true.t_us, distance, "m", source=SOURCE)
    d = Signal(f"{at}/closure", true.t_us, distance, "m/s", source=SOURCE).thinned(PERIOD_US)
    phase = hold(d.t_us, status.t_us, status["phase"])
    joined = (phase == JOIN_UP) | (phase == OBSERVATION)
    rate = -np.gradient(d.values, d.t_us * 1e-6) if len(d) > 1 else np.zeros(len(d))
    yield Signal(d.path, d.t_us[joined], rate[joined], d.unit, source=SOURCE)
    i, j = match(true.t_us, lead.t_us)
    both, other = true.pick(i), lead.pick(j)
    height = other["pos_n"][:, 2].astype(np.float64) - both["pos_n"][:, 2]
    yield Signal(f"{at}/height", both.t_us, height, "m", source=SOURCE)
    flown = hold(both.t_us, status.t_us, status["phase"]) == JOIN_UP
    clear = wake_clearance(both["xi"][flown].astype(np.float64), other["alpha"][flown].astype(np.float64))
    yield Signal(f"{at}/wake_clearance", both.t_us[flown], clear, "m", source=SOURCE)
    rel = tlm.get(RECEIVER, "RELATIVE_STATE")
    if rel is not None:
        w = rel.pick(hold(rel.t_us, status.t_us, status["phase"]) == JOIN_UP)
        yield Signal(f"guid/{name}/join/closure", w.t_us, w["cmd_vel"][:, 0].astype(np.float64), "m/s", source=SOURCE)
