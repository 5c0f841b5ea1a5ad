"""Receiver position by Algorithm 11 or 15 of Sevil (2013) in flight: the print's method as a baseline beside the filter.

A moving mean of the readings, contours of one wake map at them, and where they cross. No motion, no wind, no attitude but the
map's. Where the contours give no place there is none: nothing is held.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft
from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata.contour.algorithms import ALGORITHMS, NONE, decide, locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.intersect import im1, im2
from flightsw.missions.receiver.airdata.contour.params import ALGORITHM, ContourParams
from flightsw.missions.receiver.airdata.contour.wake_map import load_map
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.strict import ConfigError
from flightsw.types import Vec3

Arr = NDArray[np.float64]
SAME_M = 0.1  # [m] a probe of the map may be off the aircraft's


class ContourPosition:
    """Position estimator of one aircraft: one answer per set of readings."""

    def __init__(self, ac: Aircraft, method: str, p: ContourParams) -> None:
        """The map is read here and never again. Raises ConfigError if there is none of that name, or if it is one of other
        probes than `ac` has."""
        self.p, self.algorithm = p, ALGORITHMS[ALGORITHM[method]]
        self.cut = Contours(load_map(p.map))
        m = self.cut.map
        own = tuple(q.position_m for q in ac.probe)
        if len(own) != 3 or max(math.dist(a, b) for a, b in zip(own, m.spec.probes_m, strict=True)) > SAME_M:
            raise ConfigError(
                f"airdata.position.contours.map = {p.map!r}: probes at {m.spec.probes_m}; allowed: a map of {ac.meta.model}'s,"
                f" {own}"
            )
        self._y, self._z = (float(m.y[0]), float(m.y[-1])), (float(m.z[0]), float(m.z[-1]))
        self._last: deque[tuple[list[float], int]] = deque(maxlen=p.window)
        self.fix = WakeFix()

    def reset(self) -> None:
        """Forget the readings so far."""
        self._last.clear()

    def step(self, t_us: int, readings: Arr, use: int, x: Arr, xd: Arr) -> WakeFix:
        """Position at t_us [us] by the readings [9] (V of each probe, beta, alpha) of the mask `use`; x [3] m, xd [3] m/s, F:
        relative estimate, of which the fix has x, and y and z say whether the map is the one to ask. Never raises."""
        self._last.append((readings.tolist(), use))
        if not self._within(x):
            return self.without(t_us, x, xd, "outside the map")
        at = locate(self.algorithm, self.cut, self.mean(use), self.p.epsilon_m)
        if at is None:
            return self.without(t_us, x, xd, "contours do not meet")
        s_y, s_z = self.p.sigma_m
        none = self.without(t_us, x, xd, "")
        self.fix = replace(none, valid=True, pos_f=(none.pos_f[0], *at), cov_yy=s_y * s_y, cov_zz=s_z * s_z)
        return self.fix

    def without(self, t_us: int, x: Arr, xd: Arr, why: str) -> WakeFix:
        """No position at t_us [us], and why."""
        along, speed = float(x[kp.AX_X]), float(xd[kp.AX_X])
        nowhere: Vec3 = along, math.nan, math.nan
        self.fix = WakeFix(t_us=t_us, reason=why, pos_f=nowhere, vel_f=(speed, math.nan, math.nan))
        return self.fix

    def mean(self, use: int) -> list[float]:
        """Readings [9], each the mean over the window of what could be used of it; NaN, which has no contour, where it cannot be
        now."""
        out = []
        for c in range(9):
            good = [y[c] for y, mask in self._last if mask >> c & 1] if use >> c & 1 else []
            out.append(math.fsum(good) / len(good) if good else math.nan)
        return out

    def _within(self, x: Arr) -> bool:
        far = self.p.outside_m
        places = ((float(x[kp.AX_Y]), self._y), (float(x[kp.AX_Z]), self._z))
        return all(lo - far <= at <= hi + far for at, (lo, hi) in places)

    def exercise(self) -> None:
        """Run everything a step may call on the readings of a node, so that no first use takes longer."""
        m = self.cut.map
        here = m.readings[:, len(m.z) // 2, len(m.y) // 2]
        locate(self.algorithm, self.cut, here, self.p.epsilon_m)
        line = self.cut.lines(kp.R_ALPHA, float(here[kp.R_ALPHA]))
        im2(im1(line, line), NONE)
        decide(self.algorithm, np.zeros((2, 2)), NONE, self.p.epsilon_m)

    def get_state(self) -> dict[str, object]:
        """Copy of the state."""
        return {"last": [(list(y), use) for y, use in self._last], "fix": replace(self.fix)}

    def set_state(self, s: dict[str, object]) -> None:
        """Restore what `get_state` returned."""
        last, fix = s["last"], s["fix"]
        assert isinstance(last, list) and isinstance(fix, WakeFix)
        self._last = deque(((list(y), use) for y, use in last), maxlen=self.p.window)
        self.fix = replace(fix)
