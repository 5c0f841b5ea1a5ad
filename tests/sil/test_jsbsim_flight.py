"""The whole software flies aircraft in JSBSim as it flies the plant's own: the first seconds of the refuelling, noise and all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve
from sim_plant.kernels import layout as n

SECONDS = 20.0
MODELS = ["plant.aircraft.tanker.model=jsbsim", "plant.aircraft.receiver.model=jsbsim"]


def places(folder: Path, sets: list[str]) -> np.ndarray:
    """Position of both aircraft every second [k,2,3]."""
    plan = resolve("refueling", 5, sets, SECONDS)
    flight, out = InProcess(plan, make_folder(plan, folder)), []
    while not flight.server.done:
        flight.tick()
        if flight.server.tick % 100 == 0:
            out.append([m.s[n.S_P : n.S_P + 3].copy() for m in flight.server.world.members])
    flight.finish()
    return np.array(out)


def test_it_is_the_same_flight(tmp_path: Path) -> None:
    own, other = places(tmp_path / "own", []), places(tmp_path / "jsbsim", MODELS)
    assert own.shape == (round(SECONDS), 2, 3)
    assert np.abs(own - other).max() < 0.02
    relative = (own[:, 1] - own[:, 0]) - (other[:, 1] - other[:, 0])
    assert np.abs(relative).max() < 0.01
