"""Chapters every report has, and what they are written with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from ground.report import page as p
from ground.report.load import Campaign

Name = Callable[[str], str]
ACTORS = {"default": "our default", "printed": "as printed", "bound": "posterior Cramer-Rao bound"}


class Keeper(Protocol):
    """Takes a figure, gives back HTML."""

    def add(self, name: str, png: bytes, caption: str) -> str:
        """See build.Pictures."""


def plain(name: str) -> str:
    """A name as it is, without underscores; those all works share in words."""
    return ACTORS.get(name, name.replace("_", " "))


def everything(c: Campaign, label: Name = plain, case_label: Name = plain) -> str:
    """Every value of every case, folded away; actors and cases by the names a reader knows."""
    if not c.columns:
        return ""
    head = [("value", ""), *((case_label(x), "num") for x in c.cases)]
    rows = []
    last = ""
    for value in sorted(c.columns):
        actor, _, metric = value.partition(".")
        if actor != last:
            rows.append(p.group(label(actor), len(head)))
            last = actor
        rows.append(p.text(metric or value) + "".join(p.cell(c.stat(x, value)) for x in c.cases))
    return p.details(f"All {len(c.columns)} figures of all filters", p.table(head, rows))
