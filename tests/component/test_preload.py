"""With a deadline ahead no kernel is loaded in flight: numba would do so at its first call."""

from __future__ import annotations

import subprocess
import sys

# kernels that other tests have used cannot be unloaded: a process of its own
FLOWN = """
import tempfile
from pathlib import Path
from numba.core.dispatcher import Dispatcher
from flightsw.preload import preload
from hil_scripts.launch import kernel_cache
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve
kernel_cache.use()
compile_, seen = Dispatcher.compile, []
Dispatcher.compile = lambda kernel, sig: (seen.append(kernel.py_func.__qualname__), compile_(kernel, sig))[1]
with tempfile.TemporaryDirectory() as tmp:
    plan = resolve("refueling", 1, [], 10.0)
    flight = InProcess(plan, make_folder(plan, Path(tmp) / "run"))
    for node in flight.nodes:
        node.app.warmup()
    assert preload("flightsw") > 50 and preload("sim_plant") > 0
    seen.clear()
    for _ in range(300):
        flight.tick()
    print(*sorted(set(seen)))
"""


def test_every_kernel_is_there_before_the_first_tick() -> None:
    r = subprocess.run([sys.executable, "-c", FLOWN], capture_output=True, text=True, timeout=300, check=False)
    assert r.returncode == 0, r.stderr
    assert r.stdout.split() == []
