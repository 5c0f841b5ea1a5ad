"""`from ground import Run`: a run folder as arrays, tables and words.

run = Run("runs/x")
t, wind, unit = run["uav/nav/wind"]
both = run.align("uav/nav/wind", "uav/truth/wind")
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.strict import near
from ground.align import GAP_US, Aligned, align
from ground.columns import Columns
from ground.happenings import Event, happened
from ground.run import Run as Folder
from ground.run import load
from ground.signals import GROUPS, WAYS, Signal, fields
from ground.tree import by_name, flatten
from ground.views import registry
from ground.whole import scenario, toml

MESSAGE, LINK = "message", "link"  # groups of fields as they were on the wire


@dataclass(frozen=True)
class Listed:
    """What a signal is, without its samples."""

    path: str
    unit: str
    rate_hz: float
    count: int
    parts: tuple[str, ...] = ()


class Listing(list[Listed]):
    """Signals of a run; printed as a table."""

    def __repr__(self) -> str:
        wide = max((len(s.path) for s in self), default=0)
        return "\n".join(
            f"{s.path:{wide}}  {s.unit:8} {s.rate_hz:8.4g} Hz {s.count:8d}  {' '.join(s.parts)}".rstrip() for s in self
        )


@dataclass(frozen=True, eq=False)
class Together:
    """Signals brought to the same times. t [N] s; `[path]` values [N] or [N,k]; units by path; left_out: by path, how many times
    of the first signal have no value of this one near enough."""

    signals: dict[str, Signal]
    left_out: dict[str, int]

    def __getitem__(self, path: str) -> NDArray:
        return self.signals[path].values

    @property
    def t(self) -> NDArray[np.float64]:
        """Sample times [N] s."""
        return next(iter(self.signals.values())).t

    @property
    def units(self) -> dict[str, str]:
        """Unit of each."""
        return {path: s.unit for path, s in self.signals.items()}

    def __len__(self) -> int:
        return len(self.t)


class Run(Folder):
    """A run folder as data. Raises LogError for what is no run folder or no log."""

    def __init__(self, folder: Path | str) -> None:
        found = load(Path(folder))
        super().__init__(found.folder, found.truth, found.tlm)
        self.__dict__["_made"] = {}
        self.__dict__["_links"] = {}

    def __repr__(self) -> str:
        return f"Run({str(self.folder)!r}): {', '.join(self.names.values())}, {self.end_us * 1e-6:g} s"

    def keep(self, what: object) -> None:
        """Hold something as long as this run is held: the temporary folder it lies in."""
        self.__dict__["_kept"] = what

    def link(self, name: str) -> Columns:
        """All that an aircraft's onboard software heard and said, read once; empty without a log of it."""
        kept: dict[str, Columns] = self.__dict__["_links"]
        if name not in kept:
            kept[name] = super().link(name)
        return kept[name]

    # --- signals ------------------------------------------------------------------------------------------------------
    def _group(self, top: str, name: str) -> dict[str, Signal]:
        """Signals `<top>/<name>/...` by path, made when they are first asked for."""
        made: dict[tuple[str, str], dict[str, Signal]] = self.__dict__["_made"]
        if (top, name) not in made:
            sysid = next(s for s, n in self.names.items() if n == name)
            found: list[Signal] = []
            if top == MESSAGE:
                for log in (self.truth, self.tlm, self.plant):
                    found += fields(log, (sysid,), f"{top}/{name}")
            elif top == LINK:
                log = self.link(name)
                for number, way in WAYS.items():
                    found += fields(log, log.sysids(), f"{top}/{name}/{way}", number)
            else:
                own = [s for s in self._of_views if s.path.startswith(f"{top}/{name}/")]
                taken = {s.path for s in own}
                build = GROUPS.get(top)
                found = own + [s for s in (build(self, sysid, name) if build else ()) if s.path not in taken]
            made[top, name] = {s.path: s for s in found}
        return made[top, name]

    @cached_property
    def _of_views(self) -> list[Signal]:
        return [s for view in registry.found(self.tlm).values() for s in view.signals(self)]

    def _groups(self, raw: bool) -> Iterator[dict[str, Signal]]:
        for top in (*GROUPS, *((MESSAGE, LINK) if raw else ())):
            for name in self.names.values():
                yield self._group(top, name)

    def find(self, pattern: str = "*", raw: bool = False) -> list[Signal]:
        """Signals whose path fits a pattern of the shell (`*/wind*`), in their order; `raw`: also every field of every
        message, as it was on the wire (the link logs' too)."""
        return [s for group in self._groups(raw) for s in group.values() if fnmatchcase(s.path, pattern)]

    def signals(self, pattern: str = "*", raw: bool = False) -> Listing:
        """Path, unit, rate and number of samples of what `find` finds."""
        return Listing(Listed(s.path, s.unit, s.rate_hz, len(s), s.parts) for s in self.find(pattern, raw))

    def path(self, text: str) -> str:
        """The path meant: the aircraft may come first (`uav/nav/wind`)."""
        first, _, rest = text.strip("/").partition("/")
        top, slash, key = rest.partition("/")
        return f"{top}/{first}/{key}" if slash and first in self.names.values() else text.strip("/")

    def __getitem__(self, text: str) -> Signal:
        """A signal, or a part of one, by its path. Raises KeyError naming what is near."""
        path = self.path(text)
        top, _, rest = path.partition("/")
        name = rest.partition("/")[0]
        tops = (*GROUPS, MESSAGE, LINK)
        if top not in tops or name not in self.names.values():
            crafts = ", ".join(self.names.values())
            raise KeyError(f"{text!r}: a path begins with {', '.join(tops)} and an aircraft: {crafts}")
        group = self._group(top, name)
        if path in group:
            return group[path]
        whole, _, part = path.rpartition("/")
        if whole in group and part in group[whole].parts:
            return group[whole].part(part)
        raise KeyError(f"{text!r}: no such signal; {top}/{name} has {len(group)}{near(path, list(group))}")

    # --- together -----------------------------------------------------------------------------------------------------
    def align(self, first: str, *others: str, gap_s: float = GAP_US * 1e-6) -> Together:
        """Signals at the times of the first; without others, its truth. Between samples at most `gap_s` apart values are
        interpolated: angles the short way round, attitudes as rotations; words and whole numbers are those of the sample before.
        Times that one of them does not reach are left out and counted. Raises KeyError."""
        lead = self[first]
        if not others:
            top, _, rest = lead.path.partition("/")
            if top == "truth":
                raise KeyError(f"{first!r} is truth itself: name what to bring to its times")
            others = (f"truth/{rest}",)
        found = {first: lead} | {path: self[path] for path in others}
        fits = {path: align(s.t_us, lead.t_us, round(gap_s * 1e6)) for path, s in found.items()}
        common = np.arange(len(lead))
        for fit in fits.values():
            common = np.intersect1d(common, fit.at, assume_unique=True)
        out = {p: _at(found[p], fits[p], np.searchsorted(fits[p].at, common), lead.t_us[common]) for p in found}
        return Together(out, {path: fits[path].left_out for path in found if path != first})

    def frame(self, *paths: str, kind: str = "pandas", gap_s: float = GAP_US * 1e-6) -> Any:
        """A table: one signal, or several at the times of the first (`align`); a column for each part, times `t` [s] as the index
        (pandas) or the first column (polars). Raises KeyError; ImportError naming the extra of this project that is missing."""
        from ground.frames import frame

        if not paths:
            raise KeyError("frame: name at least one signal")
        if len(paths) == 1:
            one = self[paths[0]]
            return frame(one.t, one.columns(), kind)
        both = self.align(*paths, gap_s=gap_s)
        columns: dict[str, NDArray] = {}
        for s in both.signals.values():
            columns |= s.columns()
        return frame(both.t, columns, kind)

    # --- words --------------------------------------------------------------------------------------------------------
    def events(self, *kinds: str) -> list[Event]:
        """What happened, by time; `kinds`: only phase, text, command, answer, failure, planned (an event of the scenario)."""
        return [e for e in happened(self) if not kinds or e.kind in kinds]

    def texts(self) -> list[Event]:
        """What the aircraft said in words."""
        return self.events("text")

    def commands(self) -> list[Event]:
        """What was commanded, and the answers."""
        return self.events("command", "answer")

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Figures of the run: summary.json, or computed from the logs where there is none."""
        path = self.folder / "summary.json"
        if path.exists():
            return dict(json.loads(path.read_text()))
        from ground.metrics import compute

        return dict(compute(self.folder))

    def compare(self, other: Run) -> dict[str, tuple[Any, Any]]:
        """Settings and figures of this run and of another that differ, by name; None where one has none. What only the clock on
        the wall decides is left out."""
        mine, its = self.keys | self.summary, other.keys | other.summary
        differ = {k: (mine.get(k), its.get(k)) for k in sorted(mine.keys() | its.keys()) if mine.get(k) != its.get(k)}
        return {k: v for k, v in differ.items() if not k.startswith("run.sim_s_per_wall_s")}

    @cached_property
    def scenario(self) -> dict[str, Any]:
        """The scenario as it was flown; {} without one."""
        return deepcopy(scenario(self.folder))

    @cached_property
    def keys(self) -> dict[str, Any]:
        """Every setting by the name `sil run --set` has for it: plant.<key>, <aircraft>.<key>."""
        out = flatten(by_name(self.scenario), "plant.")
        for name in self.names.values():
            out |= flatten(toml(self.folder / f"flight_{name}.toml"), f"{name}.")
        return out


def _at(s: Signal, fit: Aligned, rows: NDArray[np.intp], t_us: NDArray[np.int64]) -> Signal:
    """A signal at times t_us, which are `rows` of a fit."""
    picked = Aligned(fit.at[rows], fit.left[rows], fit.share[rows], fit.left_out)
    if s.is_quaternion:
        values = picked.quaternions(s.values)
    elif s.values.dtype.kind == "f":
        values = picked.of(s.values, angle=s.unit == "rad")
    else:
        values = s.values[picked.left]
    return Signal(s.path, t_us, values, s.unit, s.parts, s.source)
