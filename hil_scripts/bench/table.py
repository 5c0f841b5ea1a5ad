"""`sil bench`: how fast everything is on this machine, in one table. Nothing here is a test: it measures and prints."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from statistics import median
from types import FunctionType
from typing import Any

from rich.console import Console
from rich.table import Table

from flightsw import plugins
from hil_scripts.bench import filters as bench_filters
from hil_scripts.bench import link as bench_link
from hil_scripts.bench import plant as bench_plant
from hil_scripts.bench import realtime as bench_realtime
from hil_scripts.bench import start as bench_start
from hil_scripts.bench.realtime import Paced
from hil_scripts.bench.row import Row
from hil_scripts.launch import ports

TICK_HZ = 100
REALTIME_S = 60.0
PING_TICKS = 8_000
ROUNDS = 15  # of the lockstep mission against bare sockets
RUN_TIMEOUT_S = 900.0


class BenchError(RuntimeError):
    """A measurement could not be made; the text says which and why."""


SCENARIO = "refueling"  # several aircraft and a data link: the most a tick has to do


def fly(folder: Path, duration_s: float, *flags: str) -> dict[str, Any]:
    """Run SCENARIO for `duration_s` in a process of its own; its summary. Raises BenchError."""
    offset = ports.free_offset({1: "aircraft 1", 2: "aircraft 2"}, range(2000, 2500, 20))
    args = ["run", SCENARIO, "--no-rrd", "--duration", str(duration_s), "--out", str(folder), *flags]
    args += [] if "--in-process" in flags else ["--port-offset", str(offset)]
    cmd = [sys.executable, "-m", "hil_scripts.sil", *args]
    r = subprocess.run(cmd, capture_output=True, text=True, timeout=RUN_TIMEOUT_S + duration_s, check=False)
    try:
        summary = json.loads((folder / "summary.json").read_text())
    except (OSError, ValueError):
        raise BenchError(
            f"sil {' '.join(args)}: exit code {r.returncode}\n{r.stdout[-2000:]}{r.stderr[-2000:]}"
        ) from None
    if summary.get("run.outcome") != "completed":
        raise BenchError(f"sil {' '.join(args)}: exit code {r.returncode}\n{r.stdout[-2000:]}{r.stderr[-2000:]}")
    return dict(summary)


def measure(
    folder: Path, duration_s: float, realtime_s: float, say: Callable[[str], None]
) -> tuple[list[Row], list[Paced]]:
    """All rows, and real time at every rate (none if realtime_s is 0). Raises BenchError."""
    rows: list[Row] = []
    say(
        f"lockstep mission, separate processes, and bare sockets with the same datagrams, by turns, {duration_s:.0f} s simulated"
    )
    multi, bare = [], []
    for k in range(
        ROUNDS
    ):  # where the system puts the processes changes either by a factor of two from one to the next
        run = folder / f"multi{k}"
        multi.append(float(fly(run, duration_s)["run.sim_s_per_wall_s"]))
        sizes = [bench_link.measure_sizes(p) for p in sorted(run.glob("link_*.tlog"))]
        bare.append(bench_link.ping_pong(sizes, PING_TICKS) / TICK_HZ)
    times = median(bare) / median(multi)
    rows += [
        Row("lockstep.sim_s_per_wall_s", "lockstep mission, four processes", median(multi), "s/s", ">= 10, goal 20"),
        Row("lockstep.slowest", f"the slowest of {ROUNDS}", min(multi), "s/s"),
        Row("lockstep.fastest", f"the fastest of {ROUNDS}", max(multi), "s/s"),
        Row("bare.sim_s_per_wall_s", "bare sockets, same datagrams and bytes", median(bare), "s/s"),
        Row("bare.slowest", f"the slowest of {ROUNDS}", min(bare), "s/s"),
        Row("bare.fastest", f"the fastest of {ROUNDS}", max(bare), "s/s"),
        Row("lockstep.ratio_to_bare", "lockstep mission takes, times bare sockets, medians", times, "x", "<= 4.5"),
    ]
    say("the same in one process")
    single = float(fly(folder / "single", duration_s, "--in-process")["run.sim_s_per_wall_s"])
    rows.append(Row("in_process.sim_s_per_wall_s", "same in process, no sockets", single, "s/s", ">= 25, goal 60"))
    say("starts, and the picture file of that mission")
    rows += bench_start.rows(folder / "start") + bench_start.picture_rows(folder / "multi0", duration_s)
    say("estimator and plant")
    rows += filter_rows() + plant_rows()
    for name in plugins.declared(plugins.BENCHES):
        say(name)
        rows += plugins.part(plugins.BENCHES, name, FunctionType, plugins.BENCHES)()
    return rows, bench_realtime.measure(fly, SCENARIO, folder, realtime_s, say) if realtime_s > 0 else []


def filter_rows() -> list[Row]:
    """SR-UKF step against filterpy's UKF."""
    ours, theirs = bench_filters.step_us(), bench_filters.filterpy_step_us()
    slow = bench_filters.filterpy_python_model_us()
    return [
        Row("srukf.step_us", "SR-UKF step, 15 states, 15 measurements", ours, "us"),
        Row("filterpy.step_us", "filterpy UKF step, our compiled model", theirs, "us"),
        Row("filterpy.python_model_step_us", "filterpy UKF step, the model in plain Python", slow, "us"),
        Row("srukf.speedup", "SR-UKF faster, same compiled model", theirs / ours, "x", ">= 30"),
        Row("srukf.speedup_python_model", "SR-UKF faster, model in plain Python", slow / ours, "x", ">= 30"),
        *family_rows(),
    ]


def family_rows() -> list[Row]:
    """Every filter of the family on the same 15-state problem: compiled, and as plain Python."""
    rows = []
    for kind in ("srukf", "srukf_printed", "ukf", "ukf_augmented", "ekf", "srckf"):
        fast, slow = bench_filters.step_us(kind), bench_filters.python_step_us(kind)
        rows.append(Row(f"filter.{kind}.step_us", f"{kind}, compiled", fast, "us"))
        rows.append(Row(f"filter.{kind}.python_step_us", f"{kind}, not compiled", slow, "us"))
    return rows


def plant_rows() -> list[Row]:
    """Plant step against JSBSim."""
    us = bench_plant.step_us()
    ours, dynamics = us[bench_plant.PLANT], us[bench_plant.DYNAMICS]
    with_sockets, bare = (us[k] for k in bench_plant.AIRCRAFT)
    air, everything = us[bench_plant.AIR], us[bench_plant.EVERYTHING]
    return [
        Row("plant.dynamics_step_us", "plant, one aircraft, one tick, no sensors", dynamics, "us"),
        Row("plant.aircraft_step_us", "plant, one aircraft, one tick, sensors included", ours, "us"),
        Row("plant.air_step_us", "the same, every model of the air on", air, "us"),
        Row("plant.air_ratio", "every model of the air on takes, times the scenario's", air / ours, "x"),
        Row("plant.everything_ratio", "with tactical sensors of both aircraft besides", everything / ours, "x"),
        Row("jsbsim.run_us", "JSBSim run(), Boeing 737 (polls its input sockets)", with_sockets, "us"),
        Row("jsbsim.b747_run_us", "JSBSim run(), Boeing 747 (has none)", bare, "us"),
        Row(
            "plant.ratio_to_jsbsim",
            "plant without sensors takes, times JSBSim 737",
            dynamics / with_sockets,
            "x",
            "<= 1",
        ),
        Row(
            "plant.sensors_ratio_to_jsbsim",
            "plant with sensors takes, times JSBSim 737",
            ours / with_sockets,
            "x",
            "<= 1",
        ),
        # half as much again as the plant took before it had these models (1.76 by this measure)
        Row(
            "plant.everything_ratio_to_jsbsim",
            "plant with everything on takes, times JSBSim 737",
            everything / with_sockets,
            "x",
            "<= 2.64",
        ),
    ]


def show(console: Console, rows: list[Row], paced: list[Paced]) -> None:
    """Print the tables."""
    t = Table(title="sil bench", title_justify="left")
    t.add_column("measured", overflow="fold")
    t.add_column("value", justify="right", no_wrap=True, min_width=9)
    t.add_column("unit", no_wrap=True)
    t.add_column("wanted", no_wrap=True, min_width=7)
    for r in rows:
        t.add_row(r.what, f"{r.value:.2f}" if r.value < 100 else f"{r.value:.0f}", r.unit, r.goal)
    console.print(t)
    bench_realtime.show(console, paced)


def as_json(rows: list[Row], paced: list[Paced]) -> str:
    """The same as JSON text."""
    return json.dumps({"rows": [asdict(r) for r in rows], "realtime": [asdict(p) for p in paced]}, indent=2)
