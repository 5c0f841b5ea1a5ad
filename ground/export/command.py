"""`ground export`: what goes into the files, and where they go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from ground.data import Run
from ground.export.sheets import Sheet, Text, sheets
from ground.reading.log import read

KINDS = ("parquet", "csv", "mcap", "ulog")
SUFFIX = {"mcap": ".mcap", "ulog": ".ulg"}  # the others are folders


class ExportError(ValueError):
    """Nothing to export, or nowhere to; the text names the argument and what is allowed."""


@dataclass(frozen=True)
class Content:
    """What is exported: title, tables, words, settings by name."""

    title: str
    sheets: Sequence[Sheet]
    texts: Sequence[Text] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)


def of_run(run: Run, only: Sequence[str] = (), raw: bool = False) -> Content:
    """A run's signals (those that fit a pattern of `only`; raw: every field of every message too), events, settings. Raises
    ExportError where no signal fits."""
    patterns = [run.path(p) for p in only] or ["*"]
    found = {s.path: s for p in patterns for s in run.find(p, raw)}
    if not found:
        raise ExportError(f"--only {' '.join(only)}: fits no signal; `ground signals` lists them")
    texts = [Text(round(e.t_s * 1e6), e.who, e.text, e.severity) for e in run.events()]
    return Content(run.title, sheets(found.values()), texts, run.keys)


def of_log(path: Path, only: Sequence[str] = ()) -> tuple[Content, str]:
    """A log of anybody, and what of it was damaged, in words. only: patterns of `<sheet>/<column>`. Raises LogError, ImportError,
    ExportError."""
    log = read(path)
    found = []
    for s in log.sheets:
        kept = {k: v for k, v in s.columns.items() if not only or any(fnmatchcase(f"{s.name}/{k}", p) for p in only)}
        if kept:
            found.append(Sheet(s.name, s.t_us, kept, s.units))
    if not found:
        raise ExportError(f"--only {' '.join(only)}: fits nothing; the log has {', '.join(s.name for s in log.sheets)}")
    return Content(log.title, found, log.texts), log.lost


def place(source: Path, to: str, out: Path | None) -> Path:
    """Where the export goes: `out`, else beside the logs. Raises ExportError for a format that there is not."""
    if to not in KINDS:
        raise ExportError(f"--to {to!r}: allowed: {', '.join(KINDS)}")
    if out is not None:
        return out
    if source.is_dir():
        return source / (f"run{SUFFIX[to]}" if to in SUFFIX else to)
    return source.with_name(source.name + SUFFIX[to] if to in SUFFIX else f"{source.name}.{to}")


def write(content: Content, path: Path, to: str) -> None:
    """Write it. Raises OSError; ImportError naming the extra that is missing."""
    if to == "mcap":
        from ground.export import mcap

        mcap.write(path, content.sheets, content.texts, content.title)
    elif to == "ulog":
        from ground.export import ulog

        ulog.write(path, content.sheets, content.texts, content.title, content.settings)
    else:
        from ground.export import files

        files.write(path, content.sheets, content.texts, to)
