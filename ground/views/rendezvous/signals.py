"""The rendezvous's signals: where the tanker believes its receiver to be, in the frame of the rendezvous (x from the control
point to the initial point, y to the left of it), and what it makes of that."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ground.run import Run
from ground.signals import Signal
from ground.views.refueling.aircraft import TANKER
from ground.views.rendezvous.read import covariances, errors, nees3

SOURCE = "rendezvous"
STATES = ("approach", "turn", "roll-out", "ahead", "leg")
DONE = 3  # WKF_RDV_PHASE
NEVER_S = 1e6
PLAN, MOVING = [0, 2], [1, 3]  # of est: x, y; v_x, v_y
XY = ("x", "y")


def signals(run: Run) -> Iterator[Signal]:
    """{truth, nav}/<tanker>/rendezvous/{position, velocity} of the receiver, nav's <key>_sigma, nees (of x, v_x, y, over 3),
    range, nis, window_nis, alarm; bank; guid's phase, time_to_go (before the turn), bank and miss (until it is over)."""
    name, state = run.names.get(TANKER), run.tlm.get(TANKER, "RENDEZVOUS_STATE")
    if name is None or state is None:
        return
    nav, guid, true = (f"{top}/{name}/rendezvous" for top in ("nav", "guid", "truth"))
    good = state.pick(state["valid"] != 0)
    est, sigma = good["est"].astype(np.float64), np.sqrt(np.einsum("nii->ni", covariances(good["cov"])).clip(0.0))
    t_us, error, cov = errors(run.truth, state)
    known = est[np.searchsorted(good.t_us, t_us)] - error
    for key, columns, unit in (("position", PLAN, "m"), ("velocity", MOVING, "m/s")):
        yield Signal(f"{nav}/{key}", good.t_us, est[:, columns], unit, XY, SOURCE)
        yield Signal(f"{nav}/{key}_sigma", good.t_us, sigma[:, columns], unit, XY, SOURCE)
        yield Signal(f"{true}/{key}", t_us, known[:, columns], unit, XY, SOURCE)
    yield Signal(f"{nav}/nees", t_us, nees3(error, cov), source=SOURCE)
    for key, unit in (("range", "m"), ("nis", ""), ("window_nis", ""), ("bank", "rad")):
        yield Signal(f"{nav}/{key}", good.t_us, good[key].astype(np.float64), unit, source=SOURCE)
    before = good.pick((good["phase"] == 0) & (good["time_to_go"] < NEVER_S))
    yield Signal(f"{guid}/time_to_go", before.t_us, before["time_to_go"].astype(np.float64), "s", source=SOURCE)
    left = good.pick(good["phase"] < DONE)
    yield Signal(f"{guid}/bank", left.t_us, left["cmd_bank"].astype(np.float64), "rad", source=SOURCE)
    yield Signal(f"{guid}/miss", left.t_us, left["miss"].astype(np.float64), "m", XY, SOURCE)
    phases = np.array([STATES[min(int(p), len(STATES) - 1)] for p in state["phase"]], dtype=object)
    yield Signal(f"{guid}/phase", state.t_us, phases, source=SOURCE)
    words = np.select([state["valid"] == 0, state["alarm"] != 0], ["no estimate", "NOT AS PLANNED"], "as planned")
    yield Signal(f"{nav}/alarm", state.t_us, words.astype(object), source=SOURCE)
