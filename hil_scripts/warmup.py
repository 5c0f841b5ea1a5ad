"""Compile every kernel into the current cache: what a cold first start does visibly before it flies.

The modules that own kernels know how to warm them; this only calls them, one process per program, in parallel.
"""

from __future__ import annotations

import sys
import time

from rich.console import Console

from hil_scripts import kernel_cache
from hil_scripts.procs import StopFlag, Supervisor, describe_exit

WARMERS = {
    "flightsw": "from flightsw.app import warmup; warmup()",
    "sim-plant": "from sim_plant.world import warmup; warmup()",
}


def warm(console: Console, stop: StopFlag, force: bool = False) -> bool:
    """Compile what is not compiled. True when all kernels are ready; prints what it does if there is work."""
    kernel_cache.use()
    if kernel_cache.is_warm() and not force:
        return True
    t0 = time.monotonic()
    console.print("compiling numerical kernels (once after every change of their sources) ...", highlight=False)
    ok = True
    with Supervisor() as sup:
        kids = [sup.start(name, [sys.executable, "-c", code]) for name, code in WARMERS.items()]
        while not stop and not sup.wait(kids, 0.2, stop):
            continue
        for c in sup.newly_ended():
            if c.popen.returncode != 0:
                ok = False
                text = [f"{c.name}: compiling failed, {describe_exit(c.popen.returncode)}", *c.tail]
                console.print("\n".join(text), style="red", markup=False, highlight=False)
    if not ok or stop:
        return False
    kernel_cache.mark_warm()
    console.print(f"kernels ready in {time.monotonic() - t0:.1f} s", highlight=False)
    return True
