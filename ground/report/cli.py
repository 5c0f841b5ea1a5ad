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
ALL = "all"


class Works(TyperGroup):
    """The reports that are installed, looked up when the command is run."""

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Names of the works."""
        return [*declared(GROUP), ALL]

    def get_command(self, ctx: typer.Context, name: str):  # type: ignore[no-untyped-def, override]  # click's own class
        """The command of a work, None for an unknown one."""
        if name == ALL:
            return typer.main.get_command(_all())
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


def _all() -> typer.Typer:
    every = typer.Typer(add_completion=False, rich_markup_mode=None)  # as part of a program

    @every.command(
        ALL,
        help="Every page there are campaigns for, each in a folder of its own.",
        context_settings=app.info.context_settings,
    )
    def build(
        runs: Annotated[
            list[Path],
            typer.Argument(help="campaign folders, or folders of them (`sil campaign all`)", metavar="RUNS..."),
        ],
        out: Annotated[Path, typer.Option("--out", help="folder for the pages' folders")] = Path("reports"),
    ) -> None:
        """Build the pages and print their paths, and which campaigns no page reads."""
        from ground.report.load import ReportError, load

        try:
            studies = {folder: load(folder).study for folder in _campaigns(runs)}
            unread = set(studies.values())
            for name in declared(GROUP):
                report = part(GROUP, name, Report, GROUP)
                mine = [folder for folder, study in studies.items() if report.reads(study)]
                unread -= {studies[folder] for folder in mine}
                if mine:
                    print(report.build(mine, out / name))
        except (ReportError, ConfigError) as e:
            print(f"ground: {e}", file=sys.stderr)
            raise typer.Exit(2) from None
        if unread:
            print(f"no page reads: {', '.join(sorted(unread))}")

    return every


def _campaigns(folders: list[Path]) -> list[Path]:
    """The campaign folders among these and directly in them, as named where nothing looks like one."""
    found = [m.parent for f in folders for m in sorted([*f.glob("summary.json"), *f.glob("*/summary.json")])]
    return found or folders


app = make(ABOUT, no_args_is_help=True)
app.info.cls = Works


@app.callback()
def _reports() -> None:
    """Reports on campaigns as one HTML page with figures."""
