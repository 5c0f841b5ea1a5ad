"""A receiver's way to its tanker as a view."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ground.columns import Columns
from ground.run import Run
from ground.views.base import Figures, View
from ground.views.joinup.figures import has_joinup, join_metrics
from ground.views.joinup.signals import signals

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal


class Joinup(View):
    """From en route to the observation position."""

    def finds(self, tlm: Columns) -> bool:
        """A receiver that was en route."""
        return has_joinup(tlm)

    def figures(self, run: Run) -> Figures:
        """join.*, fuel.*."""
        return join_metrics(run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.joinup.signals."""
        return list(signals(run))

    def moment(self, run: Run) -> float | None:
        """On the last stretch, the tanker ahead and in sight."""
        from ground.views.joinup.figures import half_way_s

        return half_way_s(run.truth, run.tlm)

    def layout(self, run: Run, look: Look) -> Layout:
        """The tab Join-up, and the plan of a rendezvous up to there."""
        from ground.views.joinup.draw import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Distance, closure, the last stretch."""
        from ground.views.joinup.draw import joinup

        joinup(sink, run)


VIEW = Joinup()
