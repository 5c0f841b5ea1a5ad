"""What the command lines of all programs have in common: `-h`, `--version`, completion, help in which [m/s] stays [m/s], and
status lines."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer


def make(text: str = "", no_args_is_help: bool = False) -> typer.Typer:
    """An empty program with the help `text`."""
    return typer.Typer(
        help=text,
        no_args_is_help=no_args_is_help,
        context_settings={"help_option_names": ["-h", "--help"]},
        rich_markup_mode=None,  # markup takes [m/s] for a style and drops it
        pretty_exceptions_enable=False,
    )


def _show(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"wakefield {version('wakefield')}")
        raise typer.Exit


Version = Annotated[bool, typer.Option("--version", callback=_show, is_eager=True, help="Show the version and exit.")]


SigningKey = Annotated[
    Path | None,
    typer.Option(
        "--signing-key",
        help="File with the key of signed links (`ground key` makes one): unsigned packets are refused.",
    ),
]
Unsigned = Annotated[bool, typer.Option("--unsigned", help="Let anybody speak, also on an address others can reach.")]


def tell(text: str) -> None:
    """One line for people on stderr; a reader that went away, or a full disk behind it, must not keep a log from being closed."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        return


def report(record: dict[str, Any]) -> bool:
    """One JSON line on stdout for the launcher. False if nobody reads it any more: the launcher was killed."""
    try:
        print(json.dumps(record), flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # closing it at exit is then no error either
        return False
    return True
