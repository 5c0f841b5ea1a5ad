"""The gust mission as a view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flightsw.icd.dialect import VALUES
from ground.columns import Columns
from ground.run import Run
from ground.views.base import Command, Figures, Value, View
from ground.views.gust.figures import gust_metrics
from ground.views.gust.read import LAWS, flights, has_gust
from ground.views.gust.signals import signals

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal


class Gust(View):
    """Wind, vane bias, loads of a small UAV."""

    memory_s = 60.0  # spectra are made of a minute
    own_time = frozenset({"GUST_STATE"})
    commands = (Command("law", VALUES["MAV_CMD_USER_2"], ("gust",), value=Value(0, 0.0, choices=LAWS)),)

    def finds(self, tlm: Columns) -> bool:
        """GUST_STATE."""
        return has_gust(tlm)

    def judges(self, tlm: Columns) -> frozenset[int]:
        """Its own aircraft: they estimate what happens in the vertical plane."""
        return frozenset(s for s, message in tlm.tables if message == "GUST_STATE")

    def figures(self, run: Run) -> Figures:
        """gust.*."""
        return gust_metrics(run.folder, run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.gust.signals."""
        return list(signals(run))

    def moment(self, run: Run) -> float | None:
        """When the strongest gust blows."""
        found = flights(run.folder, run.truth, run.tlm)
        return float(found[0].t[int(np.argmax(np.abs(found[0].truth[:, 0])))]) if found else None

    def layout(self, run: Run, look: Look) -> Layout:
        """Spectra; tabs Gust, Loads, Filter."""
        from ground.views.gust.draw import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Estimates against truth, loads, commands, spectra."""
        from ground.views.gust.draw import draw

        draw(sink, run)


VIEW = Gust()
