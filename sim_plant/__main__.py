"""Command line of the plant: `sim-plant --scenario refueling --seed 1 --run-dir runs/x`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flightsw.cli import SigningKey, Unsigned, Version, make
from sim_plant.pace import SPEED_MAX

app = make()


@app.command()
def run(
    scenario: Annotated[str, typer.Option(help="scenario name or path of a TOML file")] = "refueling",
    seed: Annotated[int | None, typer.Option(min=0, help="random seed; default: the scenario's")] = None,
    run_dir: Annotated[Path | None, typer.Option(help="folder for truth.tlog and the resolved scenario.toml")] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="paced by the wall clock instead of lockstep")] = False,
    port_offset: Annotated[int, typer.Option(min=0, max=50000, help="added to every UDP port")] = 0,
    sets: Annotated[list[str] | None, typer.Option("--set", help="override a scenario key: noise.scale=2")] = None,
    external: Annotated[
        list[str] | None,
        typer.Option(help="aircraft flown by another computer: NAME=udp:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD"),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.0, max=SPEED_MAX, help="lockstep at so many times real time; 0: flat out")
    ] = 0.0,
    signing_key: SigningKey = None,
    unsigned: Unsigned = False,
    version: Version = False,
) -> None:
    """Fly a scenario: the world, its sensors and the radio, against one flightsw process per aircraft."""
    from sim_plant.program import Stop, fly  # slow to import (numba): not to show the help

    code = fly(
        scenario, seed, run_dir, realtime, port_offset, sets or [], Stop(), signing_key, unsigned, external, speed
    )  # fmt: skip
    raise typer.Exit(code)


def main() -> None:
    """Entry point of the `sim-plant` command."""
    app()


if __name__ == "__main__":
    main()
