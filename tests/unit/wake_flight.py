"""Runs the wake-position filter over a kinematic flight whose readings come from the plant's wake."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from flightsw.aircraft import Aircraft, Probe, load_aircraft
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_filter import WakePosition
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from hil_scripts.studies.sevil.flight import SPEC_PROBES, AirFlight

CONTACT = 4
Hook = Callable[[WakePosition, int], None]
AC: Aircraft = replace(load_aircraft("learjet24"), probe=tuple(Probe(f"p{i}", q) for i, q in enumerate(SPEC_PROBES)))


@dataclass
class Track:
    """Errors [N,2] m, covariances [N,2,2], NIS [N], valid [N], reasons, factors [N,2], the filter at the end."""

    error: np.ndarray
    cov: np.ndarray
    nis: np.ndarray
    valid: np.ndarray
    reason: list[str]
    scale: np.ndarray
    est: WakePosition

    @property
    def radial(self) -> np.ndarray:
        return np.hypot(*self.error.T)


def predict(est: WakePosition, d: AirFlight, i: int) -> None:
    a, w, c = (tuple(row[i].tolist()) for row in (d.att_m, d.omega_m, d.acc_m))
    est.predict(round(d.t[i] * 1e6), a, w, c, float(d.x_m[i]), 1.0, 200.0, 0.58883, 0.05 if i else 0.0)


def track(
    d: AirFlight,
    params: WakePositionParams | None = None,
    seeded: bool = True,
    before: Hook | None = None,
    aid: Hook | None = None,
    mask: int = 0b111111111,
    part: slice = slice(None),
    est: WakePosition | None = None,
    seed_sigma: float = 5.0,
) -> Track:
    """`before` is called ahead of each prediction, `aid` between prediction and correction."""
    est = est or WakePosition(AC, params or WakePositionParams(), WakeParams())
    if seeded:
        est.seed(float(d.guess[0]), float(d.guess[1]), seed_sigma)
    steps = range(*part.indices(len(d.t)))
    t, x, att, omega, acc = (a.tolist() for a in (d.t, d.x_m, d.att_m, d.omega_m, d.acc_m))
    at, cov, nis, valid, scale, reason = [], [], [], [], [], []
    for i in steps:
        if before:
            before(est, i)
        dt = 0.05 if i else 0.0
        est.predict(round(t[i] * 1e6), tuple(att[i]), tuple(omega[i]), tuple(acc[i]), x[i], 1.0, 200.0, 0.58883, dt)
        if aid:
            aid(est, i)
        fix = est.update(d.readings[i], mask)
        at.append(fix.pos_f[1:])
        cov.append(((fix.cov_yy, fix.cov_yz), (fix.cov_yz, fix.cov_zz)))
        nis.append(fix.nis)
        valid.append(fix.valid)
        scale.append(fix.scale)
        reason.append(fix.reason)
    error = np.array(at) - d.xi[part, 1:]
    return Track(error, np.array(cov), np.array(nis), np.array(valid), reason, np.array(scale), est)
