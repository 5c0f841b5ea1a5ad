"""Cases of several campaigns by kind: a report gathers each chapter from every folder it is given."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ground.report import figures as f
from ground.report import page as p
from ground.report.chapters import Keeper
from ground.report.load import Campaign, Stat


@dataclass(frozen=True)
class CaseOf:
    """One case of one campaign."""

    campaign: Campaign
    name: str
    names: Mapping[str, str] = field(default_factory=dict)  # for the reader, of those that do not speak for themselves

    @property
    def params(self) -> dict[str, Any]:
        """Its parameters."""
        return dict(self.campaign.meta["cases"][self.name])

    def stat(self, value: str) -> Stat:
        """See Campaign.stat."""
        return self.campaign.stat(self.name, value)

    def bar(self, value: str) -> f.Bar:
        """See Campaign.bar."""
        return self.campaign.bar(self.name, value)

    def traces(self) -> dict[str, Any]:
        """Arrays of its first run."""
        return self.campaign.traces(self.name)

    @property
    def label(self) -> str:
        """Its name for the reader, without the kind in front."""
        kind = str(self.params.get("kind", ""))
        name = re.sub(rf"^{kind}_", "", self.name) if kind else self.name
        return self.names.get(name, name.replace("_", " "))


class Cases:
    """All cases of the campaigns, in the order of the campaigns."""

    def __init__(self, campaigns: Sequence[Campaign], pictures: Keeper, names: Mapping[str, str] | None = None) -> None:
        self.all = [CaseOf(c, name, names or {}) for c in campaigns for name in c.cases]
        self.pictures = pictures

    def kind(self, *kinds: str) -> list[CaseOf]:
        """Cases of a kind; of two with one name the first counts."""
        found: dict[str, CaseOf] = {}
        for c in self.all:
            if c.params.get("kind") in kinds:
                found.setdefault(c.name, c)
        return list(found.values())

    def full(self, kind: str) -> list[CaseOf]:
        """Cases of a kind; those of the table study, named after the kind, only where no campaign holds the full set."""
        mine = self.kind(kind)
        return [c for c in mine if not c.name.startswith(f"{kind}_")] or mine

    def named(self, name: str) -> CaseOf | None:
        """The case of that name, None if there is none."""
        return next((c for c in self.all if c.name == name), None)

    def family(self, prefix: str, kind: str) -> list[tuple[float, CaseOf]]:
        """Cases called `<prefix>_<number>` of a kind by their number."""
        out = []
        for c in self.kind(kind):
            head, _, tail = c.name.rpartition("_")
            if head == prefix:
                try:
                    out.append((float(tail), c))
                except ValueError:
                    continue
        return sorted(out, key=lambda x: x[0])


def sweep_points(cases: Sequence[tuple[float, CaseOf]], actors: Sequence[str], value: str) -> dict[str, list[f.Point]]:
    """Series of `value` against the number in the cases' names, one per actor."""
    out: dict[str, list[f.Point]] = {}
    for a in actors:
        for x, c in cases:
            s = c.stat(f"{a}.{value}")
            if s.value is not None or s.why:
                out.setdefault(a, []).append(f.Point(x, math.nan if s.value is None else s.value, s.lo, s.hi))
    return out


def matrix(cases: Sequence[CaseOf], columns: Sequence[tuple[str, str]], head: str = "case", note: str = "") -> str:
    """A table with one row per case and one column per (heading, value); columns no case has are left out."""
    columns = [(h, v) for h, v in columns if any(c.stat(v).value is not None or c.stat(v).why for c in cases)]
    rows = [p.text(c.label, "name") + "".join(p.cell(c.stat(v)) for _, v in columns) for c in cases]
    return p.table([(head, ""), *((h, "num") for h, _ in columns)], rows, note)
