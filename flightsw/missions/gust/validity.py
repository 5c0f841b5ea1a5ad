"""Whether a gust estimate is good enough to steer by: fresh readings, small sigmas, innovations as they should be.

A filter on the model of a sound aircraft stays finite when a surface jams or its air data is gone; it only stops being true.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import GustEstimate
from flightsw.strict import IN_FLIGHT, Range

DISAGREE = "readings disagree with the model"
STALL = "incidence passes the model"
UNCERTAIN = "estimate too uncertain"
NAMES = ("q", "alpha", "V_A", "Theta", "H")  # bits 0 to 4 of GustEstimate.used


@dataclass(frozen=True)
class TrustParams:
    """Limits beyond which the hold flies instead."""

    age_s: Annotated[float, Range(0.02, 60.0), IN_FLIGHT] = (
        1.0  # of the oldest of the five basic readings that corrected
    )
    alpha_W_sigma_rad: Annotated[float, Range(1e-4, 1.0), IN_FLIGHT] = 0.035
    H_sigma_m: Annotated[float, Range(0.01, 1000.0), IN_FLIGHT] = 5.0
    nis: Annotated[float, Range(1.0, 100.0), IN_FLIGHT] = 1.25  # NIS per reading, low-passed
    nis_s: Annotated[float, Range(0.02, 60.0), IN_FLIGHT] = 3.0
    # the same in half a second, for what jams: 1.35 is the most that flights on sound servos reach
    nis_fast: Annotated[float, Range(1.0, 100.0), IN_FLIGHT] = 1.45
    nis_fast_s: Annotated[float, Range(0.02, 60.0), IN_FLIGHT] = 0.5
    # incidence, as a share of the aircraft file's largest
    incidence: Annotated[float, Range(0.1, 100.0), IN_FLIGHT] = 1.0
    refused: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = (
        0.1  # share of readings refused by the gate, low-passed likewise
    )
    back_s: Annotated[float, Range(0.0, 60.0), IN_FLIGHT] = 1.0  # all well for this long before it is trusted (again)
    grave_s: Annotated[float, Range(0.0, 600.0), IN_FLIGHT] = (
        15.0  # and this much longer after a restart or a disagreement
    )


class Trust:
    """`step` once per sample; `ok` is the last verdict and `reason` why not."""

    def __init__(self, p: TrustParams | None = None, alpha_max_rad: float = math.inf) -> None:
        """Trusts an estimate once it has settled. alpha_max_rad: incidence [rad] up to which there is a model."""
        self.p, self._alpha_max = p or TrustParams(), alpha_max_rad
        self._fast, self._alpha = 1.0, 0.0
        self.ok, self.reason = True, ""
        self._age = [0.0] * len(NAMES)
        self._nis, self._refused, self._well_s, self._begun = 1.0, 0.0, math.inf, False

    def step(self, e: GustEstimate, dt: float, alpha: float = 0.0) -> bool:
        """Judge the estimate of this sample, dt [s] after the last one, and its incidence alpha [rad]. Without covariance (NaN)
        only ages and incidence count."""
        p = self.p
        for c in range(len(NAMES)):
            self._age[c] = 0.0 if e.used >> c & 1 else self._age[c] + dt
        share = -math.expm1(-dt / p.nis_s)
        if math.isfinite(e.nis) and e.channels > 0:
            nis = min(e.nis / e.channels, 100.0)
            self._nis += share * (nis - self._nis)
            self._fast += -math.expm1(-dt / p.nis_fast_s) * (nis - self._fast)
        self._alpha = abs(alpha)
        self._refused += share * (e.refused / max(e.refused + e.channels, 1) - self._refused)
        if not (e.valid or self._begun):  # before the first estimate there is nothing to lose
            self._age = [0.0] * len(NAMES)
            return self.ok
        self._begun = True
        why = self._doubt(e) if e.valid else e.reason
        # a jam makes the filter start anew and look well for a while, again and again
        grave = why == DISAGREE or not e.valid
        self._well_s = (-p.grave_s if grave else min(self._well_s, 0.0)) if why else self._well_s + dt
        self.ok = self._well_s >= p.back_s if not self.ok else not why
        self.reason = why or ("" if self.ok else "settles")
        return self.ok

    def _doubt(self, e: GustEstimate) -> str:
        p = self.p
        old = [n for n, age in zip(NAMES, self._age, strict=True) if age > p.age_s]
        if old:
            return "no good " + ", ".join(old)
        if e.sigma[k.AW] > p.alpha_W_sigma_rad or e.sigma[k.H] > p.H_sigma_m:  # never of NaN: no covariance
            return UNCERTAIN
        if self._alpha > p.incidence * self._alpha_max:
            return STALL
        if self._nis > p.nis or self._fast > p.nis_fast or self._refused > p.refused:
            return DISAGREE
        return ""
