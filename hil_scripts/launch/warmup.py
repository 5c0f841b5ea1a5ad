"""Compile every kernel into the current cache: what a cold first start does visibly before it flies.

A list of kernels, then the onboard warm-up and a few simulated seconds of missions, which compile what the list lacks, in
processes of their own: one for each of two cores, each piece of work done by whoever comes to it first.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

from hil_scripts.launch import kernel_cache
from hil_scripts.launch.procs import Child, StopFlag, Supervisor, describe_exit
from hil_scripts.launch.runfolder import scenario_names

PROCESSES = 2
PLAIN_EVERY_S = 10.0  # [s] between lines where there is no terminal
CODE = """
import sys
from pathlib import Path
from hil_scripts.launch.inproc import fly_a_little
from hil_scripts.launch.kernel_list import SECONDS, compile_claimed
compile_claimed(Path(sys.argv[1]))
for scenario in sys.argv[2:]:
    try:
        (Path(sys.argv[1]) / scenario).touch(exist_ok=False)  # whoever comes first flies it
    except FileExistsError:
        continue
    fly_a_little(scenario, SECONDS)
"""


def warm(console: Console, stop: StopFlag, force: bool = False) -> bool:
    """Compile what is not compiled. True when all kernels are ready; shows how many are if there is work."""
    cache = kernel_cache.use()
    if kernel_cache.is_warm() and not force:
        return True
    t0 = time.monotonic()
    console.print("compiling numerical kernels (once after every change of their sources) ...")
    with tempfile.TemporaryDirectory(prefix="wakefield-") as claims, Supervisor() as sup:
        for k in range(PROCESSES):  # all scenarios together use every kernel
            sup.start(f"warm-up-{k + 1}", [sys.executable, "-c", CODE, claims, *scenario_names()])
        ended = _watch(sup, cache, console, stop)
        bad = [c for c in ended if c.popen.returncode != 0]
        if bad and not stop:
            text = [f"compiling failed, {describe_exit(bad[0].popen.returncode)}", *bad[0].tail]
            console.print("\n".join(text), style="red")
    if bad or stop:
        return False
    kernel_cache.mark_warm()
    console.print(f"{compiled(cache)} kernels ready in {time.monotonic() - t0:.1f} s")
    return True


def compiled(cache: Path) -> int:
    """Compiled kernels in a cache folder."""
    return sum(1 for _ in cache.rglob("*.nbc"))


def _watch(sup: Supervisor, cache: Path, console: Console, stop: StopFlag) -> list[Child]:
    """Show progress until all have ended, one has failed or a stop is asked for; those that have ended."""
    ended: list[Child] = []
    told = time.monotonic()
    with console.status("") as status:  # draws on a terminal only
        while sup.running() and not stop and all(c.popen.returncode == 0 for c in ended):
            sup.pump(0.2)
            ended += sup.newly_ended()
            status.update(f"{compiled(cache)} kernels compiled")
            if not console.is_terminal and time.monotonic() - told > PLAIN_EVERY_S:
                told = time.monotonic()
                console.print(f"{compiled(cache)} kernels compiled")
    return ended + sup.newly_ended()
