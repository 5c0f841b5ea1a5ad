"""A run that is drawn as it flies: `ground live` beside it, fed by the recorder and by the logs, heard of only if it ends."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from rich.console import Console

from flightsw.icd.link import WATCH_PORT
from hil_scripts.launch.procs import Child, Supervisor


class Where(Enum):
    """Where it is drawn."""

    VIEWER = "--rerun"
    BROWSER = "--web"


def forwarding(where: Where | None, port_offset: int) -> list[str]:
    """What the recorder is told."""
    return [] if where is None else ["--forward", f"127.0.0.1:{WATCH_PORT + port_offset}"]


def start(
    sup: Supervisor, where: Where | None, run: Path, console: Console, links: Sequence[str] | None = None
) -> Child | None:
    """Start the picture; its address goes to the console. `links`: options of the programs that send telemetry (offset of their
    ports, key), None: nobody sends any, it is read from its log."""
    if where is None:
        return None

    def on_message(message: dict[str, Any]) -> None:
        for said in (message.get("page"), message.get("text")):
            if said:
                console.print(f"watch: {said}", soft_wrap=True)

    argv = [sys.executable, "-m", "ground", "live", where.value, "--run", str(run)]
    argv += [] if links is None else ["--port", str(WATCH_PORT), *links]
    return sup.start("watch", argv, on_message)
