"""`python -m hil_scripts.bench.first_tick SCENARIO FOLDER`: `sil run SCENARIO --in-process --out FOLDER`, ended before the first
tick. A program by itself: the command it starts has the bench among its commands."""

from __future__ import annotations

import os
import sys
from typing import Any, NoReturn

from hil_scripts import sil


def to_first_tick(scenario: str, folder: str) -> NoReturn:
    """Start a run as the command does, and end the process where its first tick would begin."""
    fly = sil._fly

    def watched(*args: Any) -> int:
        from sim_plant.server import PlantServer

        PlantServer.begin_tick = lambda _: os._exit(0)  # type: ignore[assignment, method-assign]
        return fly(*args)

    sil._fly = watched  # type: ignore[assignment]
    sys.argv = ["sil", "run", scenario, "--in-process", "--seed", "1", "--out", folder]
    sil.main()
    raise SystemExit("ended without a tick")


if __name__ == "__main__":
    to_first_tick(*sys.argv[1:3])
