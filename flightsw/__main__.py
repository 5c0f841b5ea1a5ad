"""Command `flightsw`: one onboard process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flightsw.cli import SigningKey, Unsigned, Version, make

app = make()


@app.command()
def run(
    config: Annotated[Path, typer.Option(help="Flight file (TOML).")],
    run_dir: Annotated[Path, typer.Option(help="Folder for link_<name>.tlog; must exist.")],
    sysid: Annotated[int, typer.Option(help="MAVLink system id; 0: the file's.")] = 0,
    sets: Annotated[list[str], typer.Option("--set", help="Override, key=value; repeatable.")] = [],  # noqa: B006
    link: Annotated[
        str,
        typer.Option(
            help="The plant's link: udp:HOST[:PORT] or tcp:HOST:PORT to listen on, or serial:DEVICE:BAUD (default: the file's)."
        ),
    ] = "",
    realtime: Annotated[bool, typer.Option(help="Run against the wall clock instead of in lockstep.")] = False,
    port_offset: Annotated[int, typer.Option(help="Added to every port, for parallel runs.")] = 0,
    signing_key: SigningKey = None,
    unsigned: Unsigned = False,
    version: Version = False,
) -> None:
    """Fly one aircraft."""
    from flightsw.process.program import fly  # slow to import (numba): not to show the help

    raise typer.Exit(fly(config, run_dir, sysid or None, sets, realtime, port_offset, signing_key, unsigned, link))


def main() -> None:
    """Entry point of the command."""
    app()


if __name__ == "__main__":
    main()
