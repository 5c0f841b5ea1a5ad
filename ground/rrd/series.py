"""One recording being written: whole columns on both timelines, styles logged once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from flightsw.plugins import VIEWS
from flightsw.strict import ConfigError

APPLICATION = "wakefield"
TICK_US = 10_000  # [us] base tick
AXIS = ((232, 92, 80), (96, 190, 110), (90, 150, 240))  # colours of x, y, z and the like
Array = NDArray[np.float64]


class Sink:
    """One recording: `series` and friends send whole columns on both timelines."""

    def __init__(self, path: Path, name: str, start_us: int, end_us: int, look: object, tick_us: int = TICK_US) -> None:
        self.rec = rr.RecordingStream(APPLICATION, recording_id=name)
        self.rec.save(str(path), default_blueprint=look)  # type: ignore[arg-type]
        self.start_us, self.end_us, self.tick_us = start_us, end_us, tick_us
        self._drawn: set[str] = set()
        self._standing: frozenset[str] = frozenset()

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

    def times(self, t_us: NDArray[np.int64]) -> list[rr.TimeColumn]:
        """Both time columns of rows at t_us [us]."""
        return [
            rr.TimeColumn("sim_time", duration=t_us * 1e-6),
            rr.TimeColumn("tick", sequence=t_us // self.tick_us),
        ]

    def columns(self, path: str, t_us: NDArray[np.int64], columns: object) -> None:
        """Any archetype's columns."""
        if len(t_us):
            self.rec.send_columns(path, indexes=self.times(t_us), columns=columns)  # type: ignore[arg-type]

    def series(
        self,
        path: str,
        t_us: NDArray[np.int64],
        values: Array,
        name: str,
        color: Sequence[int],
        width: float = 1.5,
        step: bool = False,
    ) -> None:
        """One line (values (n,)) or several lines of one style (values (n,k)) of a plot."""
        if not self._free(path):
            return
        values = np.asarray(values, dtype=np.float64)
        k = 1 if values.ndim == 1 else values.shape[1]
        style = rr.SeriesLines(
            colors=[color] * k,
            widths=[width] * k,
            names=[name] * k,
            interpolation_mode=rr.components.InterpolationMode.StepAfter if step else None,
            aggregation_policy=rr.components.AggregationPolicy.MinMax,
        )
        self.rec.log(path, style, static=True)
        scalars = rr.Scalars.columns(scalars=values.ravel())
        self.columns(path, t_us, scalars if k == 1 else scalars.partition(lengths=[k] * len(values)))

    def marks(self, path: str, t_us: NDArray[np.int64], values: Array, name: str, color: Sequence[int]) -> None:
        """Single points of a plot, not joined: where something was the case."""
        if not self._free(path):
            return
        style = rr.SeriesPoints(colors=[color], markers="circle", names=[name], marker_sizes=[3.0])
        self.rec.log(path, style, static=True)
        self.columns(path, t_us, rr.Scalars.columns(scalars=np.asarray(values, dtype=np.float64)))

    def level(self, path: str, values: Sequence[float], name: str, color: Sequence[int]) -> None:
        """Horizontal lines over the whole run."""
        ends = np.array([self.start_us, self.end_us], dtype=np.int64)
        self.series(path, ends, np.array([values, values], dtype=np.float64), name, color, 1.0)

    def states(self, path: str, t_us: NDArray[np.int64], names: list[str], colors: Mapping[str, Sequence[int]]) -> None:
        """A lane of the state timeline: a row where the state changes."""
        if not names or not self._free(path):
            return
        labels = np.array(names)
        change = np.flatnonzero(np.concatenate([[True], labels[1:] != labels[:-1]]))
        used = list(dict.fromkeys(labels[change].tolist()))
        look = rr.StateConfiguration(values=used, colors=[colors.get(u, (120, 120, 120)) for u in used])
        self.rec.log(path, look, static=True)
        self.columns(path, t_us[change], rr.StateChange.columns(state=labels[change].tolist()))

    def close(self) -> None:
        """Write everything out."""
        self.rec.flush()
        self.rec.disconnect()
