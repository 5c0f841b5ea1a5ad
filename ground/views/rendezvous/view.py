"""The rendezvous by TACAN as a view."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ground.columns import Columns
from ground.run import Run
from ground.views.base import Figures, View
from ground.views.refueling.aircraft import RECEIVER, TANKER
from ground.views.rendezvous.read import TURN, has_rendezvous, rendezvous_metrics
from ground.views.rendezvous.signals import signals

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal


class Rendezvous(View):
    """The tanker meets its receiver by range alone."""

    memory_s = 20.0  # the parts of a cloud come one by one
    own_time = frozenset({"RENDEZVOUS_STATE", "RENDEZVOUS_CLOUD"})

    def finds(self, tlm: Columns) -> bool:
        """RENDEZVOUS_STATE."""
        return has_rendezvous(tlm)

    def figures(self, run: Run) -> Figures:
        """rendezvous.*."""
        return rendezvous_metrics(run.folder, run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.rendezvous.signals."""
        return list(signals(run))

    def moment(self, run: Run) -> float | None:
        """Half-way through the turn, if that is all there is to see."""
        if run.tlm.get(RECEIVER, "RELATIVE_STATE") is not None:
            return None
        state = run.tlm.get(TANKER, "RENDEZVOUS_STATE")
        turn = state.t_s[state["phase"] == TURN] if state is not None else []
        return float(turn[len(turn) // 2]) if len(turn) else None

    def layout(self, run: Run, look: Look) -> Layout:
        """The tab Rendezvous; the plan where there is no station keeping to look at."""
        from ground.views.rendezvous.draw import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Plan and plots."""
        from ground.views.rendezvous.draw import rendezvous

        rendezvous(sink, run)


VIEW = Rendezvous()
