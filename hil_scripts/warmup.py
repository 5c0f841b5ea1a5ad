"""Compile every kernel into the current cache: what a cold first start does visibly before it flies.

A few simulated seconds of missions that use every kernel do it, in a process of their own.
"""

from __future__ import annotations

import sys
import time

from rich.console import Console

from hil_scripts import kernel_cache
from hil_scripts.procs import StopFlag, Supervisor, describe_exit

SCENARIOS = ("refueling", "gust", "windshear")  # together they use every kernel
SECONDS = 4.0  # [s] simulated; long enough for every rate group, estimator start-up included
CODE = """
import sys
from hil_scripts.inproc import fly_a_little
for scenario in sys.argv[2:]:
    fly_a_little(scenario, float(sys.argv[1]))
"""


def warm(console: Console, stop: StopFlag, force: bool = False) -> bool:
    """Compile what is not compiled. True when all kernels are ready; prints what it does if there is work."""
    kernel_cache.use()
    if kernel_cache.is_warm() and not force:
        return True
    t0 = time.monotonic()
    console.print("compiling numerical kernels (once after every change of their sources) ...")
    ok = True
    with Supervisor() as sup:
        child = sup.start("warm-up", [sys.executable, "-c", CODE, str(SECONDS), *SCENARIOS])
        while not stop and not sup.wait([child], 0.2, stop):
            continue
        for c in sup.newly_ended():
            if c.popen.returncode != 0:
                ok = False
                text = [f"compiling failed, {describe_exit(c.popen.returncode)}", *c.tail]
                console.print("\n".join(text), style="red")
    if not ok or stop:
        return False
    kernel_cache.mark_warm()
    console.print(f"kernels ready in {time.monotonic() - t0:.1f} s")
    return True
