"""The sink of a run that goes on: every row of a path is sent once, styles once, plots when it is their turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr

from ground.rrd.series import Rows, Sink, Times

EVERY = 20  # batches between what is made of the whole run so far


class Live(Sink):
    """A picture of a run that goes on. Call `begin` before every batch."""

    def __init__(self, rec: rr.RecordingStream, tick: int) -> None:
        super().__init__(rec, 0, 0, tick)
        self.sent = 0  # rows
        self._batch = 0
        self._seen: dict[str, int] = {}
        self._looks: set[str] = set()
        self._legends: dict[str, dict[str, Sequence[int]]] = {}
        self._due: dict[str, int] = {}
        self._last = False
        self._plots = True

    def begin(self, end_us: int, last: bool = False, plots: bool = True) -> None:
        """The next batch, of a run that has come to end_us [us]; `last`: nothing is waited for; `plots`: else scenes alone."""
        self.end_us, self._last, self._plots = end_us, last, plots
        self._batch += 1
        self._drawn.clear()
        self._standing = frozenset()

    def _plotted(self, path: str) -> bool:
        """Sent when plots are."""
        return self._free(path) and self._plots

    def stand(self) -> None:
        """From here on plots are sent: what follows is drawn only in its turn."""
        super().stand()
        self._plots = True

    def fresh(self, path: str, t_us: Times, settle_us: int = 0) -> Rows:
        """Rows behind those looked at before."""
        if not len(t_us):
            return np.arange(0)
        until = t_us[-1] - (0 if self._last else settle_us)
        new = np.flatnonzero((t_us > self._seen.get(path, -1)) & (t_us <= until))
        if len(new):
            self._seen[path] = int(t_us[new[-1]])
        return new

    def due(self, path: str) -> bool:
        """Every `EVERY` batches."""
        due = self._last or self._batch - self._due.get(path, -EVERY) >= EVERY
        if due:
            self._due[path] = self._batch
        return due

    def ends(self, path: str) -> Times:
        """The beginning once, then now and again the time that is reached."""
        if path not in self._seen:
            return np.array([0, max(self.end_us, 1)], dtype=np.int64)
        return np.array([self.end_us] if self.due(path) else [], dtype=np.int64)

    def new(self, path: str) -> bool:
        """Whether its look has not been sent."""
        return path not in self._looks

    def begun(self, path: str) -> None:
        """Remembered."""
        self._looks.add(path)

    def look(self, path: str, shape: rr.AsComponents) -> None:
        """Sent once."""
        if path not in self._looks:
            self.begun(path)
            super().look(path, shape)

    def whole(self, path: str, shape: rr.AsComponents) -> None:
        """A row at the time that is reached: only the last of it is shown."""
        self.rec.set_time("sim_time", duration=self.end_us * 1e-6)
        self.rec.set_time("tick", sequence=self.end_us // self.tick_us)
        self.rec.log(path, shape)
        self.rec.reset_time()

    def legend(self, path: str, colors: Mapping[str, Sequence[int]]) -> None:
        """Sent again with every state not met before."""
        known = self._legends.setdefault(path, {})
        if colors.keys() - known.keys():
            known.update(colors)
            self._looks.discard(path)
            super().legend(path, known)

    def columns(self, path: str, t_us: Times, columns: object) -> None:
        """Sent and counted."""
        self.sent += len(t_us)
        super().columns(path, t_us, columns)
