"""Commands `ground report NAME`: one per published work, alike but for what they report on.

No postponed annotations here: those of the commands are made of the table's texts.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from flightsw.cli import make

ABOUT = "Reports on campaigns as one HTML page with figures."
# name -> (module below ground.report with a function <name>_report, campaigns, what the page shows)
REPORTS = {
    "lee": ("build", "lee, lee_colour, ...", "The dissertation's experiments: printed claim, printed method, our default."),
    "sevil": ("sevil_build", "sevil, sevil_static, ...", "Air-data position and fault detection: printed, reproduced, ours."),
    "rivard": ("rivard_build", "rivard, rivard_6dof", "Rendezvous by range alone: printed, reproduced, improved."),
    "hoffmann": ("hoffmann_build", "hoffmann, hoffmann_gains, ...", "Wind felt by a small UAV: printed gain, ours, alleviation."),
    "jing": ("jing_build", "jing, jing_escape, ...", "A jet in a microburst: filters, wrong model, escape laws, survival."),
}  # fmt: skip

app = make(ABOUT, no_args_is_help=True)


@app.callback()
def _reports() -> None:
    """Reports on campaigns as one HTML page with figures."""


def _add(name: str, module: str, campaigns: str, about: str) -> None:
    def report(
        runs: Annotated[
            list[Path], typer.Argument(help=f"campaign folders of `sil campaign` {campaigns}", metavar="RUNS...")
        ],
        out: Annotated[Path, typer.Option("--out", help=f"folder for {name}.html and the PNG figures")] = Path(
            f"report-{name}"
        ),
    ) -> None:
        """Build the page and print its path."""
        from ground.report.load import ReportError

        build = getattr(import_module(f"ground.report.{module}"), f"{name}_report")
        try:
            page = build(runs, out)
        except ReportError as e:
            print(f"ground: {e}", file=sys.stderr)
            raise typer.Exit(2) from None
        print(page)

    app.command(name, help=about)(report)


for _name, _row in REPORTS.items():
    _add(_name, *_row)
