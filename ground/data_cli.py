"""`ground signals`, `ground export`: a run's, or a log's, data on the command line."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, NoReturn

import typer

Source = Annotated[
    Path, typer.Argument(help="run folder, or a log: .tlog, ULog, DataFlash .bin, CSV", metavar="RUN|LOG")
]


def fail(message: object, code: int = 2) -> NoReturn:
    """One line on stderr, non-zero exit."""
    print(f"ground: {message}", file=sys.stderr)
    raise typer.Exit(code)


def signals(
    run: Annotated[Path, typer.Argument(help="run folder")],
    pattern: Annotated[str, typer.Argument(help="of paths, as a shell has it")] = "*",
    raw: Annotated[bool, typer.Option("--raw", help="also every field of every message as it was on the wire")] = False,
    json_: Annotated[bool, typer.Option("--json", help="JSON on stdout")] = False,
) -> None:
    """What a run holds: paths, units, rates, samples."""
    from ground.columns import LogError
    from ground.data import Run

    try:
        found = Run(run).signals(pattern, raw)
    except LogError as exc:
        fail(exc)
    print(json.dumps([asdict(s) for s in found], indent=1) if json_ else found)


def export(
    source: Source,
    to: Annotated[str, typer.Option("--to", help="parquet, csv (a folder), mcap (Foxglove), ulog (PlotJuggler)")],
    out: Annotated[Path | None, typer.Option("--out", help="file or folder (default: beside the logs)")] = None,
    only: Annotated[list[str] | None, typer.Option("--only", help="signals that fit this pattern, repeatable")] = None,
    raw: Annotated[bool, typer.Option("--raw", help="also every field of every message as it was on the wire")] = False,
) -> None:
    """Write a run, or somebody's log, for other people's tools; prints where."""
    from ground.columns import LogError
    from ground.data import Run
    from ground.export.command import ExportError, of_log, of_run, place, write

    try:
        path = place(source, to, out)
        if source.is_file():
            content, lost = of_log(source, only or ())
            if lost:
                print(f"ground: {source}: left out: {lost}", file=sys.stderr)
        else:
            content = of_run(Run(source), only or (), raw)
        write(content, path, to)
    except (LogError, ExportError, ImportError) as exc:
        fail(exc)
    except OSError as exc:
        fail(exc, 1)
    print(path)


def draw_log(source: Path, out: Path | None = None) -> Path:
    """Draw somebody's log as a Rerun recording beside it. Raises LogError, ImportError, OSError."""
    from ground.reading.log import read
    from ground.rrd.sheets import draw

    log, path = read(source), out or source.with_name(source.name + ".rrd")
    if log.lost:
        print(f"ground: {source}: left out: {log.lost}", file=sys.stderr)
    draw(log, path)
    return path
