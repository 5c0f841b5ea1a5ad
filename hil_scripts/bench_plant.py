"""One aircraft-step of the plant (wind, wake, sensors, servos, forces, integration) against one run() of JSBSim."""

from __future__ import annotations

import time

import numpy as np

from sim_plant.scenario import load_scenario
from sim_plant.world import World


def plant_step_us(ticks: int = 3000, seed: int = 1) -> float:
    """Microseconds per aircraft and tick of the refuelling world, median of ten batches."""
    world = World(load_scenario("refueling"), seed)
    n = len(world.vehicles)
    cmds = [world.trim_cmd(i) for i in range(n)]

    def batch(count: int) -> float:
        t0 = time.perf_counter()
        for _ in range(count):
            world.sense()
            world.step(list(cmds))
        return (time.perf_counter() - t0) / count / n

    batch(100)
    return float(np.median([batch(ticks // 10) for _ in range(10)])) * 1e6


def jsbsim_run_us(steps: int = 6000) -> float:
    """Microseconds of JSBSim's FGFDMExec.run() for its Boeing 737 in flight at 120 Hz, median of ten batches.

    Raises RuntimeError when JSBSim cannot load or initialise the aircraft.
    """
    import jsbsim

    jsbsim.FGJSBBase().debug_lvl = 0
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    if not fdm.load_model("737"):
        raise RuntimeError("JSBSim cannot load its 737")
    fdm["ic/h-sl-ft"] = 23000.0
    fdm["ic/vc-kts"] = 280.0
    fdm["propulsion/set-running"] = -1
    if not fdm.run_ic():
        raise RuntimeError("JSBSim cannot initialise its 737")

    def batch(count: int) -> float:
        t0 = time.perf_counter()
        for _ in range(count):
            fdm.run()
        return (time.perf_counter() - t0) / count

    batch(100)
    return float(np.median([batch(steps // 10) for _ in range(10)])) * 1e6
