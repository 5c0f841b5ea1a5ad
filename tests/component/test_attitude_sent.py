"""The attitude the tanker of tactical sensors sends in moderate turbulence: what turns with it is taken for distance."""

from __future__ import annotations

import math

import numpy as np

from ground.link.packets import IDS
from hil_scripts.studies.grades.estimates import packets
from hil_scripts.studies.grades.setting import Timetable, settings
from hil_scripts.studies.integrity.flight import LOOK_HZ, TANKER
from hil_scripts.studies.integrity.snapshot import Flying
from sim_plant.truth import truth_of

SLOW_S = 5.0  # [s] the reference's own errors, a tenth of a degree, last longer


def sent(*changes: str) -> np.ndarray:
    """Errors [rad] of psi, theta, phi as sent and true psi, theta, phi [6,n], each less its mean over SLOW_S, from 10 to 45 s."""
    flight = Flying("refueling", 1, (*settings("tactical", 2.1, Timetable(), guarded=True), *changes))
    world, true, rows = flight.server.world, {}, []
    while flight.t_s < 45.0:
        if world.tick % (world.rate_hz // LOOK_HZ) == 0:
            world.sense()
            true[world.t_us] = truth_of(world.members[TANKER], world.t_us).euler
        _, telemetry = flight.tick()
        for _, m in packets(telemetry[TANKER], (IDS["NAV_STATE"],)):
            e = true.get(m["time_usec"])
            if e is not None and m["valid"] and flight.t_s > 10.0:
                off = (math.remainder(m[k] - x, math.tau) for k, x in zip(("psi", "theta", "phi"), e, strict=True))
                rows.append((m["time_usec"] * 1e-6, *off, *e))
    a = np.array(rows).T
    n = 2 * round(0.5 * SLOW_S / float(np.median(np.diff(a[0])))) + 1
    return np.array([c[n // 2 : -(n // 2)] - np.convolve(c, np.full(n, 1.0 / n), "valid") for c in a[1:]])


def test_it_neither_lags_nor_follows_the_model() -> None:
    """Off by less than 0.4 mrad beside the lasting errors; pitch, of which each hundredth in phase with the motion is 0.35 m
    along for the bank (separation.md 7), to three hundredths."""
    psi, theta, phi, _, pitch, _ = sent()
    assert all(float(np.sqrt(np.mean(x**2))) < 4e-4 for x in (psi, theta, phi)) and np.std(pitch) > 2e-3
    assert abs(float(theta @ pitch / (pitch @ pitch))) < 0.03
