"""Fault detection and wake position from air data as a view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ground.columns import Columns
from ground.run import Run
from ground.views.airdata.figures import airdata_metrics
from ground.views.airdata.read import NOT_CHECKED, alarm_words, fdi_words, has_airdata, wake_words
from ground.views.airdata.signals import signals
from ground.views.base import NOT_CURRENT, Figures, Heard, View, Words
from ground.views.refueling.aircraft import RECEIVER

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink
    from ground.signals import Signal

GAP_US = 1_000_000  # [us] between two alarms
OLD_S = 3.0  # [s] a wake position older than that is none to judge readings by
LOUD = ("ALARM", "EXCLUDED", NOT_CHECKED)


class Airdata(View):
    """What the probes say of themselves and of the place in the wake."""

    tab = "Air data"
    own_time = frozenset({"FDI_STATUS", "WAKE_POSITION"})
    alarms = {"FDI_STATUS": alarm_words}

    def finds(self, tlm: Columns) -> bool:
        """FDI_STATUS or WAKE_POSITION."""
        return has_airdata(tlm)

    def figures(self, run: Run) -> Figures:
        """airdata.*."""
        return airdata_metrics(run.truth, run.tlm)

    def signals(self, run: Run) -> list[Signal]:
        """See ground.views.airdata.signals."""
        return list(signals(run))

    def moment(self, run: Run) -> float | None:
        """In the middle of the first alarm."""
        fdi = run.tlm.get(RECEIVER, "FDI_STATUS")
        on = np.flatnonzero(fdi["alarm"] != 0) if fdi is not None else np.empty(0)
        if fdi is None or not len(on):
            return None
        ends = np.flatnonzero(np.diff(fdi.t_us[on]) >= GAP_US)
        return float(fdi.t_s[on[(int(ends[0]) if len(ends) else len(on) - 1) // 2]])

    def layout(self, run: Run, look: Look) -> Layout:
        """The tab Air data."""
        from ground.views.airdata.look import layout

        return layout(run, look)

    def draw(self, sink: Sink, run: Run) -> None:
        """Portraits, maps, lanes."""
        from ground.views.airdata.draw import airdata

        airdata(sink, run.folder, run.truth, run.tlm)

    def words(self, heard: Heard) -> list[Words]:
        """Fault detection and the wake position it rests on."""
        fdi, wake = heard.get("FDI_STATUS"), heard.get("WAKE_POSITION")
        out = []
        if fdi:
            late = wake is not None and heard.age_s("WAKE_POSITION") > OLD_S
            text = fdi_words(fdi, {"valid": 0, "reason": NOT_CURRENT} if late else wake)
            last = heard.alarm("FDI_STATUS")
            if last and not fdi["alarm"]:
                text += f"; last alarm {(heard.t_us - last[1]) * 1e-6:.0f} s ago: {last[0]}"
            out.append(Words("air data", "FDI_STATUS", text, any(word in text for word in LOUD)))
        if wake:
            out.append(Words("in wake", "WAKE_POSITION", wake_words(wake)))
        return out


VIEW = Airdata()
