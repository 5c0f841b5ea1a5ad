"""Command `sil campaign`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from hil_scripts.launch import screen

EXIT_FAILED_RUNS = 1
EXIT_CONFIG = 2


def _list(console: Console, name: str | None) -> None:
    """The studies, or the cases of one. Raises CampaignError for an unknown one."""
    from hil_scripts.campaign.registry import find, listed

    if name is not None:
        for case in find(name).cases:
            console.print(case.name, soft_wrap=True, highlight=False, markup=False)
        return

    table = Table("study", "cases", "runs", "about", box=None, pad_edge=False)
    studies = listed()
    for s in studies.values():
        table.add_row(s.name, str(s.cases), str(s.runs), s.title)
    console.print(table if studies else "no studies")


def _names(incomplete: str) -> list[str]:
    """Study names for the shell's completion."""
    from hil_scripts.campaign.registry import listed

    return [n for n in listed() if n.startswith(incomplete)]


def campaign(
    name: Annotated[
        str | None,
        typer.Argument(help="Study; `sil campaign --list` shows them.", metavar="NAME", autocompletion=_names),
    ] = None,
    runs: Annotated[int | None, typer.Option(help="Runs per case (default: the study's).", min=1)] = None,
    cases: Annotated[str | None, typer.Option(help="Only these cases; * and ? fit any text.", metavar="A,B")] = None,
    seed: Annotated[int, typer.Option(help="Master seed; run i draws from (seed, study, i), alike in every case.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="Use the Dask cluster at this address.", metavar="tcp://HOST:PORT")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Local worker processes (default 2; 0: in this process).", min=0, max=256)
    ] = None,
    resume: Annotated[
        bool | None,
        typer.Option(
            "--resume/--fresh",
            help="A folder that exists is resumed if the code is the same. --resume: also if it changed. --fresh: start over.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Campaign folder (default: campaigns/NAME-SEED).")] = None,
    list_: Annotated[bool, typer.Option("--list", help="List the studies, or the cases of NAME.")] = False,
) -> None:
    """Make many runs of a study. Exit 0: all made; 1: some failed (recorded); 2: bad input or cluster lost; 130: Ctrl-C."""
    from hil_scripts.campaign.error import CampaignError
    from hil_scripts.launch import kernel_cache
    from hil_scripts.launch.procs import SINGLE_THREAD, StopFlag

    os.environ.update(SINGLE_THREAD)  # before numpy is imported, also in the workers
    console = screen.console()
    try:
        if list_ or name is None:
            if name is not None:  # its cases are counted by importing it
                kernel_cache.use()
            _list(console, name)
            raise typer.Exit(0 if list_ else EXIT_CONFIG)
        kernel_cache.use()
        from hil_scripts.campaign.engine import run_campaign
        from hil_scripts.campaign.registry import find
        from hil_scripts.launch import warmup

        if scheduler is not None and workers is not None:
            raise CampaignError("--workers is for local workers; a cluster at --scheduler has its own")
        study = find(name)
        wanted = [c.strip() for c in cases.split(",") if c.strip()] if cases is not None else None
        study.choose(wanted)
        with StopFlag() as stop:
            if scheduler is None and not warmup.warm(console, stop):
                raise typer.Exit(128 + stop.signum if stop else EXIT_FAILED_RUNS)
            done = run_campaign(
                study,
                runs,
                seed,
                out,
                scheduler,
                workers,
                resume is not False,
                cases=wanted,
                mixed_code=resume is True,
                stop=stop,
                console=console,
            )
    except CampaignError as e:
        screen.fail(e)
        raise typer.Exit(EXIT_CONFIG) from None
    text = f"{done.folder}: {done.rows} runs on record, {done.made} made now, {done.failed} failed"
    console.print(text, soft_wrap=True)
    if not done.complete:
        console.print("stopped; the same command goes on from here")
        raise typer.Exit(128 + stop.signum)
    raise typer.Exit(EXIT_FAILED_RUNS if done.failed else 0)
