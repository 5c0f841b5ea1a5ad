"""The windshear mission as a view."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flightsw.icd.dialect import VALUES
from ground.columns import Columns
from ground.run import Run
from ground.views.base import Command, Figures, Value, View
from ground.views.windshear.figures import windshear_metrics
from ground.views.windshear.read import LAWS, flights, has_windshear
from ground.views.windshear.signals import signals

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal

JET = 5  # usual system id


class Windshear(View):
    """Wind and hazard index of a jet on approach, and how it escapes."""

    memory_s = 30.0  # the slow low-pass of the hazard index
    own_time = frozenset({"WINDSHEAR_STATE"})
    commands = (
        Command("law", VALUES["MAV_CMD_USER_3"], ("windshear",), value=Value(0, 0.0, choices=LAWS)),
        Command("go-around", VALUES["MAV_CMD_DO_GO_AROUND"], ("windshear",), JET),
    )

    def finds(self, tlm: Columns) -> bool:
        """WINDSHEAR_STATE."""
        return has_windshear(tlm)

    def judges(self, tlm: Columns) -> frozenset[int]:
        """Its own aircraft: they estimate what happens in the vertical plane."""
        return frozenset(s for s, message in tlm.tables if message == "WINDSHEAR_STATE")

    def figures(self, run: Run) -> Figures:
        """windshear.*."""
        return windshear_metrics(run.folder, run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.windshear.signals."""
        return list(signals(run))

    def moment(self, run: Run) -> float | None:
        """Some seconds into the escape."""
        found = [f for f in flights(run.folder, run.truth, run.tlm) if f.abort >= 0]
        return float(found[0].t[found[0].abort]) + 8.0 if found else None

    def layout(self, run: Run, look: Look) -> Layout:
        """The vertical plane; tabs Windshear, Flight, Filter."""
        from ground.views.windshear.look import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Scene, wind, hazard index, flight."""
        from ground.views.windshear.draw import draw

        draw(sink, run)


VIEW = Windshear()
