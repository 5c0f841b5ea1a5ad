"""What all commands of `sil` have: how they end on bad input, the machine's kernels, options and completion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hil_scripts.launch import screen

EXIT_CONFIG = 2

Json = Annotated[bool, typer.Option("--json", help="JSON on stdout; words for people go to stderr.")]
RunDir = Annotated[Path, typer.Argument(help="A run folder as left by `sil run`.", metavar="RUN")]


def fail(text: str) -> typer.Exit:
    screen.fail(text)
    return typer.Exit(EXIT_CONFIG)


def kernels() -> None:
    """Use this machine's compiled kernels; a folder of them that cannot be trusted is named."""
    from hil_scripts.launch import kernel_cache

    try:
        kernel_cache.use()
    except OSError as e:
        raise fail(str(e)) from None


def scenario_names(incomplete: str) -> list[str]:
    """Scenario names for the shell's completion."""
    from hil_scripts.launch import runfolder

    return [n for n in runfolder.scenario_names() if n.startswith(incomplete)]
