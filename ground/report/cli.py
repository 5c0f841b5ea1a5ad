"""Commands `ground report ...`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(
    no_args_is_help=True, add_completion=False, help="Reports on campaigns as one HTML page with figures."
)


@app.callback()
def _reports() -> None:
    """Reports on campaigns as one HTML page with figures."""


@app.command()
def lee(
    runs: Annotated[
        list[Path], typer.Argument(help="campaign folders of `sil campaign lee`, lee_colour, ...", metavar="RUNS...")
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for lee.html and the PNG figures")] = Path("report-lee"),
) -> None:
    """The dissertation's experiments as tables and pictures: printed claim, printed method, our default."""
    from ground.report.build import lee_report
    from ground.report.load import ReportError

    try:
        page = lee_report(runs, out)
    except ReportError as e:
        print(f"ground: {e}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(page)


@app.command()
def sevil(
    runs: Annotated[
        list[Path],
        typer.Argument(help="campaign folders of `sil campaign sevil`, sevil_static, ...", metavar="RUNS..."),
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for sevil.html and the PNG figures")] = Path(
        "report-sevil"
    ),
) -> None:
    """Air-data position and fault detection as tables and pictures: printed result, printed method, ours."""
    from ground.report.load import ReportError
    from ground.report.sevil_build import sevil_report

    try:
        page = sevil_report(runs, out)
    except ReportError as e:
        print(f"ground: {e}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(page)


@app.command()
def rivard(
    runs: Annotated[
        list[Path], typer.Argument(help="campaign folders of `sil campaign rivard` and others", metavar="RUNS...")
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for rivard.html and the PNG figures")] = Path(
        "report-rivard"
    ),
) -> None:
    """Rendezvous by range alone as tables and pictures: printed, reproduced, improved."""
    from ground.report.load import ReportError
    from ground.report.rivard_build import rivard_report

    try:
        page = rivard_report(runs, out)
    except ReportError as e:
        print(f"ground: {e}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(page)


@app.command()
def hoffmann(
    runs: Annotated[
        list[Path],
        typer.Argument(help="campaign folders of `sil campaign hoffmann`, hoffmann_gains, ...", metavar="RUNS..."),
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for hoffmann.html and the PNG figures")] = Path(
        "report-hoffmann"
    ),
) -> None:
    """Wind felt by the small UAV as tables and pictures: printed gain, printed method, ours, alleviation."""
    from ground.report.hoffmann_build import hoffmann_report
    from ground.report.load import ReportError

    try:
        page = hoffmann_report(runs, out)
    except ReportError as e:
        print(f"ground: {e}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(page)


@app.command()
def jing(
    runs: Annotated[
        list[Path],
        typer.Argument(help="campaign folders of `sil campaign jing`, jing_escape, ...", metavar="RUNS..."),
    ],
    out: Annotated[Path, typer.Option("--out", help="folder for jing.html and the PNG figures")] = Path("report-jing"),
) -> None:
    """The jet transport in a microburst as tables and pictures: filters, wrong aerodynamics, escape laws, survival."""
    from ground.report.jing_build import jing_report
    from ground.report.load import ReportError

    try:
        page = jing_report(runs, out)
    except ReportError as e:
        print(f"ground: {e}", file=sys.stderr)
        raise typer.Exit(1) from None
    print(page)
