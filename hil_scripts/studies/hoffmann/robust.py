"""The gust mission's own software on an aircraft that is not the one it believes in: servos, delay, moments, lift."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

import flightsw
from flightsw.app import FlightApp
from flightsw.missions.gust.mission import GustMission
from flightsw.missions.gust.model import published
from flightsw.missions.gust.servos import GustServos
from flightsw.process.config import load_flight
from flightsw.types import UPD_AIR, UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, SensorFrame, Snapshot
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.hoffmann.loop import LOOP, Arr, compared
from sim_plant.aircraft.alexis import dynamics as ka
from sim_plant.aircraft.alexis.flight import Alexis

# the estimator that takes its servos as the aircraft file has them, and its trust
BEFORE: dict[str, Any] = {"estimator": "bank", "trust.nis_fast": 100.0, "trust.incidence": 100.0}
EVERY = UPD_IMU | UPD_AIR | UPD_ATT | UPD_BARO
FLIGHT_FILE = Path(flightsw.__file__).parent / "params" / "gust.toml"


class Onboard:
    """The onboard software of the flight file `gust`, with changes to its [nav] table, as a pilot; `snap`: what it said."""

    def __init__(self, nav: dict[str, Any]) -> None:
        flight = load_flight(FLIGHT_FILE, {f"nav.{key}": value for key, value in nav.items()})
        c = flight.app
        self.app = FlightApp(
            c.mission, c.aircraft, flight.tables, base_rate_hz=c.base_rate_hz, mission_rate_hz=c.mission_rate_hz,
            link_delay_ticks=flight.link.delay_ticks, where=str(FLIGHT_FILE),
        )  # fmt: skip
        m = self.app.mission
        assert isinstance(m, GustMission)
        self.mission = m
        self.snap: Snapshot | None = None
        self._f = SensorFrame(air_mask=1)
        self._command = np.zeros(3)

    def __call__(self, a: Alexis, servos: GustServos) -> Arr:
        """Command [3] of a sample."""
        y, f = a.reading, self._f
        f.t_us = round(a.k * a.dt * 1e6)
        f.updated = EVERY | (UPD_GNSS if a.fresh >> ka.R_GROUND & 1 else 0)
        f.gyro_b, f.acc_b = (
            (0.0, float(y[ka.R_RATE]), 0.0),
            (0.0, 0.0, -float(y[ka.R_VERTICAL]) - self.mission.ac.gravity),
        )
        f.air_V, f.air_alpha = (float(y[ka.R_AIRSPEED]),), (float(y[ka.R_VANE]),)
        f.air_beta = (1e-3 * (-1.0) ** a.k,)  # nobody's sideslip, but a probe that repeats itself counts as stuck
        half = 0.5 * float(y[ka.R_PITCH])
        f.att_q_nb, f.baro_alt_m = (math.cos(half), 0.0, math.sin(half), 0.0), float(y[ka.R_HEIGHT])
        f.gnss_vel_n = (float(y[ka.R_GROUND]), 0.0, 0.0)
        f.gnss_t_us = f.air_t_us = f.att_t_us = f.t_us
        cmd, self.snap = self.app.tick(f, a.dt if a.k else 0.0)
        self._command[:] = cmd.elevator, (cmd.throttle - 0.5) * self.mission.span, cmd.flap
        return self._command


def mission(**nav: Any) -> Onboard:
    """The onboard software of the flight file `gust`, with changes `nav` to its [nav] table."""
    return Onboard(nav)


def run_robustness(case: Case, seed: int) -> RunResult:
    """The mission with and without accelerometer and the hold in the same gusts on the aircraft of the case."""
    pilots = {
        name: mission(**BEFORE, accelerometer=on) for name, on in (("accelerometer", True), ("no_accelerometer", False))
    }
    return compared(case.params, seed, published(), pilots)


OFF = LOOP | {"linear": False}
STUDY = Study(
    name="hoffmann_robustness",
    title="Gust load alleviation on another aircraft than believed",
    purpose="a_z of the mission's software, with and without accelerometer, against the hold on the same aircraft",
    cases=(
        Case("as_believed", OFF),
        *(Case(f"servo_{wn:g}", OFF | {"servo_wn_radps": wn}) for wn in (30.0, 55.0, 80.0)),
        Case("one_sample_later", OFF | {"extra_late_samples": 1}),
        *(Case(f"moment_{x:.0f}pct", OFF | {"moment_factor": 0.01 * x}) for x in (80.0, 120.0)),
        *(Case(f"lift_{x:.0f}pct", OFF | {"lift_factor": 0.01 * x}) for x in (90.0, 110.0)),
    ),
    run=run_robustness,
    default_runs=16,
)
