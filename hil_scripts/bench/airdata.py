"""Time of one 20 Hz step of the receiver's air data (wake position, fault detection) in a flight behind the tanker."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from flightsw.missions.receiver.mission import ReceiverMission
from flightsw.types import SensorFrame
from hil_scripts.bench.row import Row
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve

FLIGHT_S = 20.0
DROP = 40  # steps of start-up


def step_us(flight_s: float = FLIGHT_S) -> tuple[float, float]:
    """Median and 99th percentile [us] of one air-data step, measured in `airdata` flown in this process for flight_s [s]."""
    took: list[float] = []
    with tempfile.TemporaryDirectory() as tmp:
        plan = resolve("airdata", 1, [], flight_s)
        flight = InProcess(plan, make_folder(plan, Path(tmp) / "run"))
        missions = [getattr(node.app, "mission", None) for node in flight.nodes]
        air = next(m.air for m in missions if isinstance(m, ReceiverMission) and m.air is not None)
        step = air.step

        def timed(*args: object) -> SensorFrame:
            """One step of the air data, its wall time [s] noted."""
            t0 = time.perf_counter()
            out = step(*args)  # type: ignore[arg-type]
            took.append(time.perf_counter() - t0)
            return out

        air.step = timed  # type: ignore[method-assign, assignment]
        for _ in range(round(flight_s * 100)):
            flight.tick()
        flight.close()
    us = np.array(took[DROP:]) * 1e6
    return float(np.median(us)), float(np.percentile(us, 99))


def rows() -> list[Row]:
    """Wake position and air-data fault detection per 20 Hz step, and the share of the 10 ms frame it runs in."""
    median, p99 = step_us()
    return [
        Row("airdata.step_us", "wake position and air-data FDI, one step", median, "us"),
        Row("airdata.step_p99_us", "99th percentile of the same", p99, "us"),
        Row("airdata.frame_share_pct", "share of the 10 ms frame it runs in", median / 100.0, "%"),
    ]
