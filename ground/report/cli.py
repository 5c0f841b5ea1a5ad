"""Commands `ground report NAME`: one per published work, alike but for what they report on.

No postponed annotations here: those of the command are made of the report's texts.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from flightsw.cli import make
from flightsw.plugins import declared, part
from flightsw.strict import ConfigError
from ground.report.base import GROUP, Report

ABOUT = "Reports on campaigns as one HTML page with figures."


class Works(TyperGroup):
    """The reports that are installed, looked up when the command is run."""

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Names of the works."""
        return list(declared(GROUP))

    def get_command(self, ctx: typer.Context, name: str):  # type: ignore[no-untyped-def, override]  # click's own class
        """The command of a work, None for an unknown one."""
        if name not in declared(GROUP):
            return None
        try:
            return typer.main.get_command(_one(name, part(GROUP, name, Report, GROUP)))
        except ConfigError as e:
            print(f"ground: {e}", file=sys.stderr)
            raise typer.Exit(2) from None


def _one(name: str, report: Report) -> typer.Typer:
    one = typer.Typer(add_completion=False, rich_markup_mode=None)  # as part of a program

    @one.command(name, help=report.about, context_settings=app.info.context_settings)
    def build(
        runs: Annotated[
            list[Path],
            typer.Argument(help=f"campaign folders of `sil campaign` {report.campaigns}", metavar="RUNS..."),
        ],
        out: Annotated[Path, typer.Option("--out", help=f"folder for {name}.html and the PNG figures")] = Path(
            f"report-{name}"
        ),
    ) -> None:
        """Build the page and print its path."""
        from ground.report.load import ReportError

        try:
            page = report.build(runs, out)
        except ReportError as e:
            print(f"ground: {e}", file=sys.stderr)
            raise typer.Exit(2) from None
        print(page)

    return one


app = make(ABOUT, no_args_is_help=True)
app.info.cls = Works


@app.callback()
def _reports() -> None:
    """Reports on campaigns as one HTML page with figures."""
