"""One aircraft-step of the plant (wind, wake, sensors, servos, forces, integration) against one run() of JSBSim.

Batches alternate, so that other load on the machine falls on both alike.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from sim_plant.scenario import load_scenario
from sim_plant.world import World

BATCHES = 10
PLANT = "plant"
AIR = "air"  # the plant with every model of the air on
EVERYTHING = "everything"  # and with sensors of a grade
DYNAMICS = "dynamics"  # the same without sensors, which JSBSim's aircraft do not have either
AIRCRAFT = ("737", "B747")  # the 737 as shipped polls input sockets in every run(); the B747 has none

EVERY_AIR = {
    "wind.dryden.sigma_mps": 0.0,
    "wind.dryden.level": "moderate",
    "wind.dryden.model": "von_karman",
    "wind.dryden.over": "field",
    "wind.wake.path": "flown",
    "wind.wake.meander": 1.0,
    "wind.wake.edr_m2ps3": 1e-3,
    "wind.bow.source": "receiver",
    "wind.density": "sounding",
}
GRADED = {"sensors.tanker.grade": "tactical", "sensors.receiver.grade": "tactical"}


def step_us(batch_steps: int = 400) -> dict[str, float]:
    """Microseconds per step, median of alternating batches: `plant`, `air`, `everything`, `dynamics` per aircraft and tick,
    JSBSim's aircraft by name.

    Raises RuntimeError when JSBSim cannot load, initialise or trim an aircraft.
    """
    steppers = {
        PLANT: _plant(),
        AIR: _plant(sets=EVERY_AIR),
        EVERYTHING: _plant(sets=EVERY_AIR | GRADED),
        DYNAMICS: _plant(sensors=False),
        **{name: _jsbsim(name) for name in AIRCRAFT},
    }
    taken: dict[str, list[float]] = {name: [] for name in steppers}
    for batch in range(BATCHES + 1):
        for name, (step, per_step) in steppers.items():
            t0 = time.perf_counter()
            for _ in range(batch_steps):
                step()
            if batch:  # the first is warm-up
                taken[name].append((time.perf_counter() - t0) / batch_steps / per_step)
    return {name: float(np.median(t)) * 1e6 for name, t in taken.items()}


def _plant(seed: int = 1, sensors: bool = True, sets: dict[str, Any] | None = None) -> tuple[Callable[[], Any], int]:
    """One tick of the refuelling world in trim, and how many aircraft that is."""
    world = World(load_scenario("refueling", sets), seed)
    cmds = [world.trim_cmd(i) for i in range(len(world.members))]
    if not sensors:
        for m in world.members:
            m.bank.empty()

    def step() -> None:
        world.sense()
        world.step(cmds)

    return step, len(cmds)


def _jsbsim(name: str) -> tuple[Callable[[], Any], int]:
    """run() of a JSBSim aircraft in trimmed flight at 23,000 ft and 280 knots."""
    import jsbsim

    jsbsim.FGJSBBase().debug_lvl = 0
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    if not fdm.load_model(name):
        raise RuntimeError(f"JSBSim cannot load its {name}")
    fdm["ic/h-sl-ft"] = 23000.0
    fdm["ic/vc-kts"] = 280.0
    fdm["propulsion/set-running"] = -1
    if not fdm.run_ic():
        raise RuntimeError(f"JSBSim cannot initialise its {name}")
    fdm["simulation/do_simple_trim"] = 0  # full longitudinal; raises if there is none
    return fdm.run, 1
