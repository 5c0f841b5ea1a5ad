"""Does alleviation pay? The load measured against the load the hold would feel in the same air.

An aircraft of the mind flies the hold in the wind that is estimated, with the servos of the aircraft file and the lift found. It
is told the wind, not its own path: what the alleviation does to the real aircraft does not reach it. The errors of its
instruments are those of the real ones as the estimate has them. What the estimate cannot resolve of the wind is missing in its
load and added by its variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.estimate import GustEstimate
from flightsw.missions.gust.law import GustHold
from flightsw.missions.gust.model import GustAircraft, Turbulence, parameter_vector
from flightsw.missions.gust.servo_bank import states as st
from flightsw.missions.gust.servos import GustServos
from flightsw.strict import IN_FLIGHT, Range

Array = np.ndarray
FOUND = slice(None, g.NX)
MUCH = "more load than the hold"
DOUBLINGS = 6  # of the time on the hold, at most


@dataclass(frozen=True)
class LoadWatchParams:
    """[nav.load_watch]"""

    # RMS of the load measured over that of the hold of the mind above which the hold flies; the hold flown has 0.87 to 0.92
    ratio: Annotated[float, Range(0.1, 100.0), IN_FLIGHT] = 1.1
    window_s: Annotated[float, Range(0.5, 600.0), IN_FLIGHT] = 15.0  # memory of the mean squares
    settle_s: Annotated[float, Range(0.0, 600.0), IN_FLIGHT] = 8.0  # of alleviation before it is judged
    back_s: Annotated[float, Range(0.0, 3600.0), IN_FLIGHT] = 20.0  # on the hold then; twice as long every time


class LoadWatch:
    """`step` once per sample; `ok`: alleviation may fly."""

    def __init__(
        self, p: LoadWatchParams, ac: GustAircraft, t: Turbulence, hold: GustHold, sigma: float, late: int
    ) -> None:
        """hold: one of the flight's own gains, for this alone; sigma [m/s^2] of the accelerometer; late: samples of the link."""
        self.p, self._ac, self._hold = p, ac, hold
        self._servos = GustServos(ac, late_steps=late)
        self._par = parameter_vector(ac, t)
        self._sigma2 = sigma * sigma
        self._z, self._y = np.zeros(st.NZ), np.zeros(g.NY)
        self._W, self._a = np.zeros((g.W_N, st.NZ)), np.zeros(g.AIR_N)
        self._measured = self._would = 0.0  # mean squares [m^2/s^4]
        self._flown_s = self._active_s = self._wait_s = 0.0
        self._times = 0

    @property
    def ratio(self) -> float:
        """RMS of the load measured over that of the hold; NaN before there is one."""
        return math.sqrt(max(self._measured, 0.0) / self._would) if self._would > 0.0 else math.nan

    @property
    def ok(self) -> bool:
        """Whether alleviation may fly."""
        return self._wait_s <= 0.0

    def step(self, e: GustEstimate, y: Array, unresolved: float, alleviates: bool, dt: float) -> None:
        """One sample: estimate, readings y [7], variance of a_z [m^2/s^4] that the estimate leaves open, whether alleviation has
        flown since the last one, dt [s]. An estimate without servos, or none, changes nothing."""
        if e.servos is None or not e.valid or not e.servos.settled:
            return
        z, off = self._z, self._y
        if self._flown_s == 0.0:
            z[FOUND] = e.x
        z[g.FELT], z[g.X1], z[st.LIFT] = e.x[g.FELT], e.x[g.X1], e.servos.lift
        st.instruments(z, self._servos.now, self._par, self._a, off)
        self._flown_s += dt
        share = -math.expm1(-dt / min(self._flown_s, self.p.window_s))
        self._would += share * (float(off[g.Y_AZ]) ** 2 + unresolved - self._would)
        if e.used >> g.Y_AZ & 1:
            self._measured += share * (float(y[g.Y_AZ]) ** 2 - self._sigma2 - self._measured)
        for c, i, trim in ((g.Y_Q, g.Q, 0.0), (g.Y_TH, g.TH, 0.0), (g.Y_H, g.H, self._ac.H0_m)):
            if e.used >> c & 1:
                off[c] += y[c] - trim - e.x[i]
        self._servos.send(self._hold.step(*(float(off[c]) for c in (g.Y_Q, g.Y_TH, g.Y_H, g.Y_VA))))
        self._servos.step(dt)
        st.propagate(z, self._servos.mean, self._par, dt, self._W)
        self._judge(alleviates, dt)

    def _judge(self, alleviates: bool, dt: float) -> None:
        self._wait_s = max(self._wait_s - dt, 0.0)
        self._active_s = self._active_s + dt if alleviates else 0.0
        if self._active_s >= self.p.settle_s and self.ratio > self.p.ratio:
            self._wait_s = self.p.back_s * 2.0 ** min(self._times, DOUBLINGS)
            self._times += 1
