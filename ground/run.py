"""A run folder as data: its logs, its scenario, its aircraft by name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from ground.columns import Columns, LogError
from ground.columns import load as load_log
from ground.folder import LOGS, require
from ground.views.registry import usual_names
from ground.whole import scenario

GROUND = 255  # system id of ground stations
PLANT_LOG = "plant.tlog"


@dataclass(frozen=True, eq=False)
class Run:
    """A run folder with truth and telemetry loaded."""

    folder: Path
    truth: Columns
    tlm: Columns
    until_us: int | None = None  # as far as it is looked at

    @property
    def title(self) -> str:
        """Name of the folder."""
        return self.folder.resolve().name or "run"

    @property
    def end_us(self) -> int:
        """Latest sample time [us] of both logs, 0 if empty."""
        return max(self.truth.end_us, self.tlm.end_us)

    @cached_property
    def names(self) -> dict[int, str]:
        """Every aircraft of the logs by system id, ascending."""
        flown = {s for s, message in self.truth.tables if message == "TRUTH"}
        return names_of(self.folder, sorted(flown | set(self.tlm.sysids()) - {GROUND}))

    @cached_property
    def plant(self) -> Columns:
        """What the plant was told to make fail and said to it; empty without a log of it."""
        return self._log(PLANT_LOG)

    def link(self, name: str) -> Columns:
        """All that an aircraft's onboard software heard and said; empty without a log of it."""
        return self._log(link_log(name))

    def _log(self, name: str) -> Columns:
        path = self.folder / name
        log = load_log(path) if path.exists() else Columns()
        return log if self.until_us is None else log.until(self.until_us)

    def until(self, t_us: int) -> Run:
        """The run as it was in flight at a time [us]."""
        return replace(self, truth=self.truth.until(t_us), tlm=self.tlm.until(t_us), until_us=t_us)


def link_log(name: str) -> str:
    """File of an aircraft's link log in a run folder."""
    return f"link_{name}.tlog"


def names_of(folder: Path, sysids: Iterable[int]) -> dict[int, str]:
    """System id -> name: what the run's scenario calls it, else what its mission usually does, else "aircraft<id>"."""
    crafts = scenario(folder).get("aircraft", [])
    known = usual_names() | {int(a.get("sysid", 0)): str(a["name"]) for a in crafts if "name" in a}
    return {s: known.get(s, f"aircraft{s}") for s in sysids}


def load(folder: Path) -> Run:
    """A run folder. Raises LogError if it is none, a log is none, or the truth is no plant's."""
    require(folder)
    truth, tlm = (load_log(folder / name) for name in LOGS)
    if truth.packets and not any(name == "TRUTH" for _, name in truth.tables):
        found = ", ".join(str(s) for s in truth.sysids()) or "nobody known"
        raise LogError(
            f"{str(folder / LOGS[0])!r} is no plant's log: none of its {truth.packets} packets, of system {found}, is a TRUTH"
        )
    return Run(folder, truth, tlm)
