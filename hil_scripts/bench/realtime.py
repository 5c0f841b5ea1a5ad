"""Real time: slips, execution and lateness of the wake-up of every aircraft, beside loops that only sleep.

`python -m hil_scripts.bench.realtime HZ SECONDS` is one of those: what the machine makes of a deadline nobody works for.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from flightsw.icd import wire
from flightsw.icd.tlog import read
from flightsw.priority import realtime_priority
from flightsw.process.clock import RealtimeClock
from hil_scripts.launch.runfolder import resolve

RATES_HZ = (100, 400)
LOOPS = 3  # that only sleep: as many as a run of two aircraft has programs with deadlines
LATE = {"late_p50": "late p50", "late_p99": "p99", "late_p999": "p99.9", "late_max": "max"}
COLUMNS = {"ticks": "ticks", "slips": "slips", "exec_mean": "exec mean", "exec_max": "max", **LATE}


@dataclass(frozen=True)
class Paced:
    """One rate: LOOP_TIMING of every aircraft, with `sysid`, and of the loops that only sleep [us]."""

    rate_hz: int
    aircraft: list[dict[str, Any]]
    asleep: list[dict[str, Any]]


def measure(
    fly: Callable[..., Any], scenario: str, folder: Path, seconds: float, say: Callable[[str], None]
) -> list[Paced]:
    """`fly(folder, seconds, *flags)` a scenario at every rate. Raises what `fly` does."""
    out = []
    for hz in RATES_HZ:
        say(f"real time, {seconds:.0f} s at {hz} Hz, and loops that only sleep")
        owners = ["plant.clock", *(f"{f.name}.app" for f in resolve(scenario, 1, [], seconds).flights)]
        fly(folder / str(hz), seconds, "--realtime", *(f"--set={o}.base_rate_hz={hz}" for o in owners))
        out.append(Paced(hz, loop_timing(folder / str(hz) / "tlm.tlog"), sleepers(hz, seconds)))
    return out


def sleepers(hz: int, seconds: float) -> list[dict[str, Any]]:
    """LOOPS processes side by side that only sleep, with the priority the programs ask for. Raises CalledProcessError."""
    cmd = [sys.executable, "-m", "hil_scripts.bench.realtime", str(hz), str(seconds)]
    running = [subprocess.Popen(cmd, stdout=subprocess.PIPE, text=True) for _ in range(LOOPS)]
    said = [p.communicate()[0] for p in running]
    for p in running:
        if p.returncode:
            raise subprocess.CalledProcessError(p.returncode, cmd)
    return [json.loads(s) for s in said]


def _sleep(hz: int, seconds: float) -> dict[str, float]:
    clock, slips = RealtimeClock(1_000_000 // hz), 0
    late: list[int] = []
    realtime_priority()
    clock.start()
    while len(late) + slips < hz * seconds:
        slips += clock.wait_tick() - 1
        late.append(clock.late_us)
    figures = [float(np.quantile(late, q)) for q in (0.5, 0.99, 0.999, 1.0)]
    return {"ticks": len(late), "slips": slips} | dict(zip(LATE, figures, strict=True))


def loop_timing(log: Path) -> list[dict[str, Any]]:
    """Last LOOP_TIMING of every aircraft in a telemetry log, as flat dicts with `sysid`."""
    last: dict[int, dict[str, Any]] = {}
    for _t, _link, packet in read(log):
        if wire.message_id(packet) != wire.BY_NAME["LOOP_TIMING"].id:
            continue
        for spec, values, sysid, *_ in wire.split(packet, wire.SPECS, wire.Counters()):
            last[sysid] = {"sysid": sysid, **spec.to_dict(values)}
    return [last[k] for k in sorted(last)]


def show(console: Console, paced: list[Paced]) -> None:
    """Print a table of every rate."""
    for p in paced:
        t = Table(
            title=f"real time at {p.rate_hz} Hz; execution and lateness of the wake-up [us]", title_justify="left"
        )
        for head in ("", *COLUMNS.values()):
            t.add_column(head, justify="right", no_wrap=not head)
        named = [(f"aircraft {r['sysid']}", r) for r in p.aircraft] + [("asleep", r) for r in p.asleep]
        for name, row in named:
            t.add_row(name, *(f"{row[k]:.0f}" if k in row else "" for k in COLUMNS))
        console.print(t)


if __name__ == "__main__":
    print(json.dumps(_sleep(int(sys.argv[1]), float(sys.argv[2]))))
