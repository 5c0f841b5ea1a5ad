"""Processor time of starts: a run to its first tick beside the least a program with compiled kernels needs, helps and lists, and
the picture file of a run. All in processes of their own, whose time others on the machine change little.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
from pathlib import Path

from hil_scripts.bench.row import Row

ROUNDS = 5  # alternated, so that a machine that slows down slows all
SCENARIO = "gust"
FLOOR = ("hil_scripts.bench.floor",)
FIRST_TICK = "hil_scripts.bench.first_tick"
SHORT = {  # what is said at once; beside it the module that says it
    "sil --help": "hil_scripts.sil", "sil run --help": "hil_scripts.sil", "sil campaign --list": "hil_scripts.sil",
    "ground --help": "ground", "ground convert --help": "ground", "ground report --help": "ground",
    "flightsw --help": "flightsw", "sim-plant --help": "sim_plant",
}  # fmt: skip


def cpu_s(*args: str) -> float:
    """Processor time [s] of `python -m args` and of all it starts. Raises RuntimeError if it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-m", *args], capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"{' '.join(args)}: exit code {done.returncode}\n{done.stdout[-1000:]}{done.stderr[-1000:]}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def rows(folder: Path, rounds: int = ROUNDS) -> list[Row]:
    """Starts, in an empty folder of the caller's. The first of each, which reads files nobody has read, is not counted."""
    took: dict[str, list[float]] = {"floor": [], "run": [], **{name: [] for name in SHORT}}
    for i in range(rounds + 1):
        took["floor"].append(cpu_s(*FLOOR))
        took["run"].append(cpu_s(FIRST_TICK, SCENARIO, str(folder / str(i))))
        for name, module in SHORT.items():
            took[name].append(cpu_s(module, *name.split()[1:]))
    counted = {name: times[1:] for name, times in took.items()}
    ratio = statistics.median(b / a for a, b in zip(counted["floor"], counted["run"], strict=True))
    short = {name: statistics.median(counted[name]) for name in SHORT}
    dearest = max(short, key=lambda name: short[name])
    return [
        Row("start.floor_s", "start of numpy, numba and one kernel", statistics.median(counted["floor"]), "s CPU"),
        Row("start.run_s", f"start of a run ({SCENARIO}) to its first tick", statistics.median(counted["run"]), "s CPU", "< 1.2"),
        Row("start.ratio_to_floor", "start of a run takes, times that of one kernel", ratio, "x", "<= 1.5"),
        Row("start.help_s", f"dearest of {len(SHORT)} helps and lists: {dearest}", short[dearest], "s CPU", "< 0.3"),
    ]  # fmt: skip


def picture_rows(run: Path, sim_s: float) -> list[Row]:
    """Drawing a run folder that was flown for sim_s [s]."""
    took, size = cpu_s("ground", "convert", str(run)), (run / "run.rrd").stat().st_size
    return [
        Row("rrd.cpu_s", f"picture file of {sim_s:.0f} s", took, "s CPU", "< 2.5 of 1000 s"),
        Row("rrd.size_mb", "its size", size / 1e6, "MB", "< 25 of 1000 s"),
    ]
