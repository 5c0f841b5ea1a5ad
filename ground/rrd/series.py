"""One picture being made: whole columns on both timelines, styles sent once. A recording gets all rows of a run in one call; a
live picture the same calls over and over, each with the last stretch of the run, and sends what is new of it (ground.rrd.flow).
Lines of plots wait for others of their entity (ground.rrd.joined) until `join`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flightsw.plugins import VIEWS
from flightsw.strict import ConfigError
from ground.rrd.joined import Waiting, line_look

APPLICATION = "wakefield"
TICK_US = 10_000  # [us] base tick
AXIS = ((222, 84, 72), (70, 165, 90), (76, 136, 226))  # colours of x, y, z and the like
GREY = (125, 125, 130)  # of a state without a colour
Array = NDArray[np.float64]
Times = NDArray[np.int64]
Rows = NDArray[np.intp]


def packed(colors: NDArray) -> NDArray[np.uint32]:
    """Colours (n,3) as the numbers a column of them has."""
    r, g, b = np.asarray(colors).astype(np.uint32).T
    return r << 24 | g << 16 | b << 8 | 255


class Sink:
    """Where series and shapes go: a recording. `lines`: paths of the lines that have rows."""

    def __init__(self, rec: rr.RecordingStream, start_us: int, end_us: int, tick_us: int = TICK_US) -> None:
        self.rec = rec
        self.start_us, self.end_us, self.tick_us = start_us, end_us, tick_us
        self.lines: set[str] = set()
        self._waiting = Waiting()
        self._drawn: set[str] = set()
        self._standing: frozenset[str] = frozenset()

    @classmethod
    def recording(cls, name: str, start_us: int, end_us: int, tick_us: int = TICK_US) -> Sink:
        """A recording `name` that is held until `write`."""
        return cls(rr.RecordingStream(APPLICATION, recording_id=name), start_us, end_us, tick_us)

    def write(self, path: Path, screen: object = None) -> None:
        """Write it to a file, behind the blueprint it opens with."""
        self.join()
        self.rec.save(str(path), default_blueprint=screen)  # type: ignore[arg-type]
        self.rec.flush()
        self.rec.disconnect()

    def at(self, path: str) -> str:
        """The path in the recording."""
        return path

    def stand(self) -> None:
        """From here on, series and states of a path that is drawn already are left out: what a view drew stands."""
        self._standing = frozenset(self._drawn)

    def _free(self, path: str) -> bool:
        """Whether a path is to be drawn now. Raises ConfigError for one that two views draw."""
        if path in self._standing:
            return False
        if path in self._drawn:
            raise ConfigError(f"{VIEWS}: {path} is drawn twice")
        self._drawn.add(path)
        return True

    # --- what a live picture does otherwise ---------------------------------------------------------------------------
    def _plotted(self, path: str) -> bool:
        """Whether a path of a plot is to be drawn now: if it is free, in a live picture also when plots have their turn."""
        return self._free(path)

    def fresh(self, path: str, t_us: Times, settle_us: int = 0) -> Rows:
        """Which rows at t_us [us] (ascending) of a path are to be sent: here all. In a live picture those not looked at before;
        `settle_us`: newer ones than that wait, since what is still to come changes them."""
        return np.arange(len(t_us))

    def due(self, path: str) -> bool:
        """Whether to make now what is made of the whole run so far: here always, in a live picture every few seconds."""
        return True

    def new(self, path: str) -> bool:
        """Whether the look of a path is still to be sent: ask before making one that is dear."""
        return True

    def begun(self, path: str) -> None:
        """The look of a path is on its way: it is not `new` any more, which a recording does not ask twice."""

    def look(self, path: str, shape: rr.AsComponents) -> None:
        """What does not change during a run."""
        self.rec.log(self.at(path), shape, static=True)

    def whole(self, path: str, shape: rr.AsComponents) -> None:
        """A shape made of the whole run so far, behind `due`."""
        self.rec.log(self.at(path), shape, static=True)

    def ends(self, path: str) -> Times:
        """Times [us] of the rows of what is known for the run as a whole."""
        return np.array([self.start_us, self.end_us], dtype=np.int64)

    # --- what is drawn ------------------------------------------------------------------------------------------------
    def times(self, t_us: Times) -> list[rr.TimeColumn]:
        """Both time columns of rows at t_us [us]."""
        return [
            rr.TimeColumn("sim_time", duration=(1000 * t_us).astype("m8[ns]")),
            rr.TimeColumn("tick", sequence=t_us // self.tick_us),
        ]

    def columns(self, path: str, t_us: Times, columns: object) -> None:
        """Columns of an archetype as they are, of rows that are `fresh`."""
        if len(t_us):
            self.rec.send_columns(self.at(path), indexes=self.times(t_us), columns=columns)  # type: ignore[arg-type]

    def rows(self, path: str, t_us: Times, kind: Any, **values: Sequence[object] | NDArray) -> None:
        """Rows of an archetype: one value of each of its components at every time t_us [us], ascending."""
        new = self.fresh(path, t_us)
        if len(new):
            picked = {k: v[new] if isinstance(v, np.ndarray) else [v[int(i)] for i in new] for k, v in values.items()}
            self.columns(path, t_us[new], kind.columns(**picked))

    def events(self, path: str, t_us: Times, at: Rows, kind: Any, **values: Sequence[object] | NDArray) -> None:
        """Rows of an archetype at few of the times looked at: those with numbers `at`."""
        new = np.flatnonzero(np.isin(at, self.fresh(path, t_us)))
        if len(new):
            self.columns(path, t_us[at[new]], kind.columns(**{k: [v[int(i)] for i in new] for k, v in values.items()}))

    def trail(
        self,
        path: str,
        t_us: Times,
        points: Array,
        color: Sequence[int] | Sequence[Sequence[int]],
        width: float = 1.5,
        kind: type | None = None,
        gap_us: int | None = None,
    ) -> None:
        """A path through points (n,2) or (n,3) as short segments, each at the time of its end, which a view with `past` of
        ground.rrd.layout shows as a line. `color`: of all, or of each point. Broken where times are `gap_us` or more apart."""
        if len(t_us) < 2:
            return
        shape: Any = kind or (rr.LineStrips2D if points.shape[1] == 2 else rr.LineStrips3D)
        name = "line_strings" if shape is rr.GeoLineStrings else "strips"
        to = 1 + np.flatnonzero(np.diff(t_us) < gap_us) if gap_us else np.arange(1, len(t_us))
        strips = np.stack([points[to - 1], points[to]], axis=1)
        values: dict[str, NDArray] = {name: strips if shape is rr.GeoLineStrings else strips.astype(np.float32)}
        own = isinstance(color[0], Sequence)
        if own:
            values["colors"] = packed(np.array(color, dtype=np.uint32)[to])
        if self.new(path):
            self.look(path, shape.from_fields(radii=rr.Radius.ui_points(width), colors=None if own else [color]))
        self.rows(path, t_us[to], shape, **values)

    def series(
        self,
        path: str,
        t_us: Times,
        values: Array,
        name: str,
        color: Sequence[int],
        width: float = 1.5,
        step: bool = False,
        settle_us: int = 0,
    ) -> None:
        """One line (values (n,)) or several lines of one style (values (n,k)) of a plot, sent by `join`."""
        if not self._plotted(path):
            return
        values = np.asarray(values, dtype=np.float64)
        k = 1 if values.ndim == 1 else values.shape[1]
        new = self.fresh(path, t_us, settle_us)
        if self.new(path):
            self.begun(path)
            self._waiting.dress(path, line_look(path, name, color, width, step, k))
        if len(new):
            self._waiting.add(path, t_us[new], values[new])
            self.lines.add(self.at(path))

    def join(self) -> None:
        """Send looks and rows of lines, those of one entity together."""
        for entity, looks in self._waiting.looks():
            self.rec.log(self.at(entity), looks, static=True)
        for entity, t_us, columns in self._waiting.take():
            self.columns(entity, t_us, columns)

    def marks(self, path: str, t_us: Times, values: Array, name: str, color: Sequence[int]) -> None:
        """Single points of a plot, not joined: where something was the case."""
        if not self._plotted(path):
            return
        if self.new(path):
            self.look(path, rr.SeriesPoints(colors=[color], markers="circle", names=[name], marker_sizes=[3.0]))
        self.rows(path, t_us, rr.Scalars, scalars=np.asarray(values, dtype=np.float64))

    def level(self, path: str, values: Sequence[float], name: str, color: Sequence[int]) -> None:
        """Horizontal lines over the whole run."""
        ends = self.ends(path)
        self.series(path, ends, np.tile(np.array(values, dtype=np.float64), (len(ends), 1)), name, color, 1.0)

    def states(self, path: str, t_us: Times, names: list[str], colors: Mapping[str, Sequence[int]]) -> None:
        """A lane of the state timeline: a row where the state changes."""
        if not names or not self._free(path):
            return
        labels = np.array(names)
        change = np.flatnonzero(np.concatenate([[True], labels[1:] != labels[:-1]]))
        self.legend(path, {u: colors.get(u, GREY) for u in dict.fromkeys(labels[change].tolist())})
        self.events(path, t_us, change, rr.StateChange, state=labels[change].tolist())

    def legend(self, path: str, colors: Mapping[str, Sequence[int]]) -> None:
        """States of a lane and their colours."""
        self.look(path, rr.StateConfiguration(values=list(colors), colors=list(colors.values())))
