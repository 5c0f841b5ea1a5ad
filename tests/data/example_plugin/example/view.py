"""The example on the ground: figures, a tab, a line on the monitor, a command."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flightsw.icd.dialect import VALUES
from ground.align import align
from ground.columns import Columns
from ground.run import Run
from ground.views.base import Command, Figures, Heard, Value, View, Words

if TYPE_CHECKING:
    from ground.rrd.layout import Layout, Look
    from ground.rrd.series import Sink

MESSAGE = "EXAMPLE_WIND"
SETTLE_S = 20.0  # from where the errors count
AXES = ("n", "e", "d")
BLUE, GREY = (80, 150, 230), (150, 150, 150)


class Cruise(View):
    """Wind by the triangle and the course held in it."""

    own_time = frozenset({MESSAGE})
    commands = (Command("course", VALUES["MAV_CMD_USER_5"], ("example_cruise",), value=Value(0, 180.0, "deg")),)

    def finds(self, tlm: Columns) -> bool:
        """EXAMPLE_WIND of anybody."""
        return any(name == MESSAGE for _, name in tlm.tables)

    def figures(self, run: Run) -> Figures:
        """example.<aircraft>.*: error of the wind per axis against its own sigma, and of the course."""
        out: Figures = {}
        for sysid, name in run.names.items():
            w, truth = run.tlm.get(sysid, MESSAGE), run.truth.get(sysid, "TRUTH")
            if w is None or truth is None:
                continue
            a = align(truth.t_us, w.t_us)
            rows = w.t_us[a.at] >= SETTLE_S * 1e6
            e = (w["wind"][a.at] - a.of(truth["wind_n"]))[rows]
            sigma, off = w["sigma"][a.at][rows], w["course_error"][a.at][rows]
            at = f"example.{name}"
            out[f"{at}.samples"] = len(e)
            for i, axis in enumerate(AXES):
                out[f"{at}.wind_rms_mps.{axis}"] = float(np.sqrt(np.mean(e[:, i] ** 2))) if len(e) else None
            out[f"{at}.wind_inside_3sigma_pct"] = (
                float(100.0 * (np.abs(e) < 3.0 * sigma).all(axis=1).mean()) if len(e) else None
            )
            out[f"{at}.course_median_deg"] = float(np.degrees(np.median(np.abs(off)))) if len(off) else None
        return out

    def layout(self, run: Run, look: Look) -> Layout:
        """The tab Triangle."""
        import rerun.blueprint as rrb

        from ground.rrd.layout import Layout, Plots

        plots = Plots(*look.span)
        rows = []
        for name in run.names.values():
            for axis, label in zip(AXES, ("north", "east", "down"), strict=True):
                paths = [f"{top}/{name}/triangle/{axis}" for top in ("truth", "nav")]
                rows.append(plots.plot(f"{name} wind {label} [m/s]", paths))
            rows.append(plots.plot(f"{name} course error [deg]", [f"guid/{name}/course_error"]))
        return Layout(1, [rrb.Vertical(*rows, name="Triangle")])

    def draw(self, sink: Sink, run: Run) -> None:
        """Wind as measured and as it is; the course's error."""
        for sysid, name in run.names.items():
            w, truth = run.tlm.get(sysid, MESSAGE), run.truth.get(sysid, "TRUTH")
            if w is None:
                continue
            for i, axis in enumerate(AXES):
                if truth is not None:
                    sink.series(f"truth/{name}/triangle/{axis}", truth.t_us, truth["wind_n"][:, i], "true", GREY)
                sink.series(f"nav/{name}/triangle/{axis}", w.t_us, w["wind"][:, i], "triangle", BLUE)
            sink.series(f"guid/{name}/course_error", w.t_us, np.degrees(w["course_error"]), "course error", BLUE)

    def words(self, heard: Heard) -> list[Words]:
        """Wind by the triangle."""
        w = heard.get(MESSAGE)
        if w is None:
            return []
        north, east, _ = w["wind"]
        text = f"{np.hypot(north, east):.1f} m/s from {np.degrees(np.arctan2(-east, -north)) % 360.0:.0f} deg"
        return [Words("triangle", MESSAGE, text if w["valid"] else "not valid", bad=not w["valid"])]


VIEW = Cruise()
