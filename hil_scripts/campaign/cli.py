"""Command `sil campaign`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hil_scripts.launch import screen
from hil_scripts.shell import kernels

if TYPE_CHECKING:
    from rich.console import Console

    from hil_scripts.campaign.study import Study
    from hil_scripts.launch.procs import StopFlag

EXIT_FAILED_RUNS = 1
EXIT_CONFIG = 2
ALL, SMALL = "all", "small"


def _list(console: Console, name: str | None) -> None:
    """The studies, or the cases of one. Raises CampaignError for an unknown one."""
    from rich.table import Table

    from hil_scripts.campaign.registry import cases, listed

    if name is not None:
        kernels()  # a study of somebody else's package is imported to count its cases
        console.out("\n".join(cases(name)), highlight=False)
        return

    table = Table("study", "cases", "runs", "about", box=None, pad_edge=False)
    studies = listed()
    for s in studies.values():
        table.add_row(s.name, str(s.cases), str(s.runs), s.title)
    console.print(table if studies else "no studies")


def _names(incomplete: str) -> list[str]:
    """Study names for the shell's completion."""
    from hil_scripts.campaign.registry import listed

    return [n for n in (*listed(), ALL) if n.startswith(incomplete)]


def campaign(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Study; `sil campaign --list` shows them. `all`: every one, each in a folder of its own.",
            metavar="NAME",
            autocompletion=_names,
        ),
    ] = None,
    runs: Annotated[
        str | None,
        typer.Option(
            help="Runs per case (default: the study's). small: few, and few cases of a large study; all of them in an hour.",
            metavar="N|small",
        ),
    ] = None,
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
    out: Annotated[
        Path | None, typer.Option(help="Campaign folder (default: campaigns/NAME-SEED); of all: theirs are in it.")
    ] = None,
    list_: Annotated[bool, typer.Option("--list", help="List the studies, or the cases of NAME.")] = False,
) -> None:
    """Make many runs of a study. Exit 0: all made; 1: some failed (recorded); 2: bad input or cluster lost; 130: Ctrl-C."""
    from hil_scripts.campaign.error import CampaignError

    console = screen.console()
    try:
        if list_ or name is None:
            _list(console, name)
            raise typer.Exit(0 if list_ else EXIT_CONFIG)
        from hil_scripts.launch import kernel_cache
        from hil_scripts.launch.procs import SINGLE_THREAD, StopFlag

        os.environ.update(SINGLE_THREAD)  # before numpy is imported, also in the workers
        kernel_cache.use()
        from hil_scripts.campaign.registry import find, listed
        from hil_scripts.launch import warmup

        if scheduler is not None and workers is not None:
            raise CampaignError("--workers is for local workers; a cluster at --scheduler has its own")
        wanted = [c.strip() for c in cases.split(",") if c.strip()] if cases is not None else None
        if name == ALL and wanted is not None:
            raise CampaignError("--cases are those of one study")
        studies = [find(n) for n in (listed() if name == ALL else [name])]
        plans = [_plan(study, runs, wanted) for study in studies]
        with StopFlag() as stop:
            if scheduler is None and not warmup.warm(console, stop):
                raise typer.Exit(128 + stop.signum if stop else EXIT_FAILED_RUNS)
            failed = 0
            for study, (count, chosen) in zip(studies, plans, strict=True):
                folder = (out or Path("campaigns")) / f"{study.name}-{seed}" if name == ALL else out
                failed += _make(study, count, chosen, seed, folder, scheduler, workers, resume, stop, console)
    except CampaignError as e:
        screen.fail(e)
        raise typer.Exit(EXIT_CONFIG) from None
    raise typer.Exit(EXIT_FAILED_RUNS if failed else 0)


def _plan(study: Study, runs: str | None, cases: list[str] | None) -> tuple[int | None, list[str] | None]:
    """Runs per case, None for the study's, and cases. Raises CampaignError for a number that is none, and unknown cases."""
    from hil_scripts.campaign.error import CampaignError

    if runs is not None and runs != SMALL and not (runs.isdecimal() and int(runs) > 0):
        raise CampaignError(f"--runs {runs}: allowed a number from 1, {SMALL}")
    if runs == SMALL and cases is None:
        cases = list(study.small_cases) or None
    study.choose(cases)
    return None if runs is None else study.small_runs if runs == SMALL else int(runs), cases


def _make(
    study: Study, runs: int | None, cases: list[str] | None, seed: int, out: Path | None, scheduler: str | None,
    workers: int | None, resume: bool | None, stop: StopFlag, console: Console,
) -> int:  # fmt: skip
    """Make a study's missing runs and say so; returns how many on record failed. Raises typer.Exit when stopped."""
    from hil_scripts.campaign.engine import run_campaign

    done = run_campaign(
        study,
        runs,
        seed,
        out,
        scheduler,
        workers,
        resume is not False,
        cases=cases,
        mixed_code=resume is True,
        stop=stop,
        console=console,
    )
    text = f"{done.folder}: {done.rows} runs on record, {done.made} made now, {done.failed} failed"
    console.print(text, soft_wrap=True)
    if not done.complete:
        console.print("stopped; the same command goes on from here")
        raise typer.Exit(128 + stop.signum)
    return done.failed
