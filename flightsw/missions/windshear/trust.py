"""Whether the estimate may be flown by: witnesses that are not the filter, readings that are missing, and what the filter says of
itself.

Three instruments tell the height: barometer, satellites, radio. One that differs from the other two is left out; where two agree
with each other and not with the estimate, the estimate is wrong. Wind: the kinematic monitor (monitor.py), which knows no
aerodynamics. On an approach an estimate that is not trusted is a reason to go around.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.estimator import NAMES, RADIO, START
from flightsw.missions.windshear.units import SATELLITES
from flightsw.strict import Range

Array = np.ndarray
HEIGHTS = ("barometer", "satellite height", "radio altimeter")
BARO, SATELLITE, RADIO_SET = range(3)
SET_S = 3.0  # [s] of both
OWN_SIGMA = 2.0  # of the estimate's own height, beside what an instrument may be wrong by
VITAL = (*START, k.Y_RA)  # readings whose absence is said


@dataclass(frozen=True)
class TrustParams:
    """[nav.trust]: when the estimate is no longer flown by. Tolerances are of fixed errors, not of noise."""

    on: bool = False
    baro_m: Annotated[float, Range(1.0)] = 10.0  # since the start, when it is set by the satellites
    baro_start_m: Annotated[float, Range(1.0)] = 100.0  # most it may be off then
    satellite_m: Annotated[float, Range(1.0)] = 12.0
    lift_frac: Annotated[float, Range(0.01, 1.0)] = 0.08  # airspeed as read against that of the lift, since the start
    radio_m: Annotated[float, Range(1.0)] = 6.0
    radio_frac: Annotated[float, Range(0.0, 0.5)] = 0.04
    held_s: Annotated[float, Range(0.0, 30.0)] = 1.0  # for which a witness must differ, or sigma exceed its limit
    missing_s: Annotated[float, Range(0.1, 30.0)] = 1.0  # without a reading: it is said
    wind_sigma_mps: Annotated[float, Range(0.1)] = 2.5  # largest of w_h; of w_x twice as much
    height_sigma_m: Annotated[float, Range(0.1)] = 30.0
    nis: Annotated[float, Range(1.0)] = 4.0  # per reading, over nis_s: the filter contradicts itself
    nis_s: Annotated[float, Range(0.1, 30.0)] = 1.0
    out_most: Annotated[int, Range(0, k.NZ)] = 1  # readings left out that the estimate can do without


class Trust:
    """`step` once per sample. `mask`: bits of readings to be left out; `why`: why the estimate is not trusted, "" while it is."""

    def __init__(self, p: TrustParams) -> None:
        self.p = p
        self.mask, self.why = 0, ""
        self.texts: list[str] = []
        self._h = [math.nan] * 3
        self._apart_s = [0.0] * 3  # each witness against the other two
        self._wrong_s = self._own_s = 0.0
        self._missing_s = dict.fromkeys(VITAL, 0.0)
        self._seen = 0
        self._nis = 1.0
        self._odd = -1
        self._baro_off_m, self._baro_s = 0.0, 0.0

    def step(
        self, z: Array, ok: int, satellite_m: float, x: Array, sigma: Array, nis: float, out: int, dt: float
    ) -> str:  # fmt: skip
        """`why` after one sample: readings z [10] with bits `ok`, height by satellite [m], NaN: none new; estimate x, sigma
        [>=15], NIS per reading, bits of the readings the filter leaves out."""
        p = self.p
        self._heights(z, ok, satellite_m, dt)
        h = float(x[k.H])
        missing = self._absent(ok, out, h, dt)
        # the estimate says itself how far off it may be: at the start it has the height of one instrument, which another that is
        # as wrong as it may be the other way does not contradict, nor the barometer that was set by that other
        room = OWN_SIGMA * float(sigma[k.H])
        against = [i for i in range(3) if self._fresh(i) and abs(self._h[i] - h) > self._tolerance(i, h) + room]
        agree = False
        if len(against) > 1:
            one, other, *_ = against
            agree = abs(self._h[one] - self._h[other]) <= self._tolerance(one, h) + self._tolerance(other, h)
        self._wrong_s = self._wrong_s + dt if agree else 0.0
        if math.isfinite(nis):
            self._nis += (nis - self._nis) * -math.expm1(-dt / p.nis_s)
        wide = sigma[k.WH] > p.wind_sigma_mps or sigma[k.WX] > 2.0 * p.wind_sigma_mps or sigma[k.H] > p.height_sigma_m
        self._own_s = self._own_s + dt if wide or self._nis > p.nis or out.bit_count() > p.out_most else 0.0
        vital = [c for c in missing if c != k.Y_RA and c != k.Y_H]
        if self._wrong_s > p.held_s:
            self.why = "height contradicted by two instruments"
        elif self._own_s > p.held_s:
            self.why = "estimate too uncertain" if wide else "readings contradict each other"
        elif vital:
            self.why = "without " + ", ".join(NAMES[c] for c in vital)
        else:
            self.why = ""
        return self.why

    def _fresh(self, i: int) -> bool:
        return math.isfinite(self._h[i])

    def _tolerance(self, i: int, h: float) -> float:
        p = self.p
        return (p.baro_m, p.satellite_m, p.radio_m + p.radio_frac * max(h, 0.0))[i]

    def _heights(self, z: Array, ok: int, satellite_m: float, dt: float) -> None:
        """The three witnesses as last read, and which of them differs from the other two."""
        h = self._h
        if ok >> k.Y_H & 1:
            if math.isfinite(satellite_m) and self._baro_s < SET_S:
                self._baro_s += dt
                off = min(max(float(z[k.Y_H]) - satellite_m, -self.p.baro_start_m), self.p.baro_start_m)
                self._baro_off_m += (off - self._baro_off_m) * min(dt / self._baro_s, 1.0)
            h[BARO] = float(z[k.Y_H]) - self._baro_off_m
        elif self._missing_s[k.Y_H] > self.p.missing_s:
            h[BARO] = math.nan
        if math.isfinite(satellite_m):
            h[SATELLITE] = satellite_m
        h[RADIO_SET] = float(z[k.Y_RA]) if ok & RADIO else (h[RADIO_SET] if self._missing_s[k.Y_RA] < 0.5 else math.nan)
        if not all(map(math.isfinite, h)):
            return
        for i in range(3):
            a, b = (j for j in range(3) if j != i)
            t = [self._tolerance(j, h[SATELLITE]) for j in range(3)]
            odd = abs(h[a] - h[b]) <= t[a] + t[b] and min(abs(h[i] - h[a]), abs(h[i] - h[b])) > t[i] + min(t[a], t[b])
            self._apart_s[i] = self._apart_s[i] + dt if odd else 0.0
        out = next((i for i in range(3) if self._apart_s[i] > self.p.held_s), -1)
        if out != self._odd:
            if out >= 0:
                self.texts.append(f"{HEIGHTS[out]} differs from the other two heights: left out")
            else:
                self.texts.append("heights agree again")
            self._odd = out
            self.mask = {BARO: 1 << k.Y_H, SATELLITE: SATELLITES, RADIO_SET: RADIO}.get(out, 0)

    def _absent(self, ok: int, out: int, h: float, dt: float) -> list[int]:
        """Channels without a reading that is used for missing_s that have had one; said when one is missed (the filter says what
        it leaves out, and the witnesses). The radio's range ends."""
        self._seen |= ok
        said, missing = out | self.mask, []
        for c in VITAL:
            was = self._missing_s[c]
            now = 0.0 if (ok & ~said) >> c & 1 else was + dt
            self._missing_s[c] = now
            if now <= self.p.missing_s or not self._seen >> c & 1 or (c == k.Y_RA and h > 600.0):
                continue
            missing.append(c)
            if was <= self.p.missing_s and not said >> c & 1:
                self.texts.append(f"no reading of {NAMES[c]}")
        return missing
