"""Second opinion on a wake-position filter: is there another place that explains the readings much better?

The readings have several basins (vortices, few channels). A filter that began in a wrong one stays: its NIS is normal, as
turbulence, slow wind and circulations take up what does not fit.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_fix import MlFix
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.missions.receiver.airdata.wake_start import StartUp

Arr = NDArray[np.float64]


class Watch:
    """Means of watch_s, a maximum-likelihood search in each, and a comparison with where the filter was meanwhile."""

    def __init__(self, probes: Arr, params: WakePositionParams, wake: WakeParams) -> None:
        """probes [3,3] [m, body]."""
        self.p = params
        s = max(params.watch_s, 0.1)
        self.start = StartUp(probes, replace(params, start_min_s=s, start_max_s=s), wake)
        self._at = np.zeros(3)  # sum of y, z and number of samples
        self.strikes = 0

    def reset(self) -> None:
        """Begin anew."""
        self.start.reset()
        self._at[:] = 0.0
        self.strikes = 0

    def look(self, y: Arr, ok: NDArray[np.int64], frame: Arr, pos: Arr, var: float) -> MlFix | None:
        """One step: readings y [9], flags ok [9], frame [11], the filter's position pos [2] with radial variance var [m^2].
        A place the filter should be at instead, moved on with it since; else None. Circulations are searched for from their
        priors: the filter's own are part of what would be wrong."""
        p, s = self.p, self.start
        if not s.searching:
            self._at += *pos, 1.0
        n = s.samples
        fix = s.collect(y, ok, frame)
        if fix is None:
            if s.samples < n:  # it gave up: nothing there that fits, or not well enough known
                self._at[:] = 0.0
            return None
        sum_y, sum_z, count = self._at
        my, mz = sum_y / count, sum_z / count
        cost = s.ml.cost_near(my, mz, max(1.0, math.sqrt(var)))
        there_y, there_z = fix.pos
        away = math.hypot(there_y - my, there_z - mz)
        far = away > p.watch_min_m and away * away > 16.0 * (var + fix.sigma_m**2)
        self.strikes = self.strikes + 1 if far and cost - fix.cost > p.watch_cost else 0
        strikes = self.strikes
        s.reset()
        self._at[:] = 0.0
        if strikes < p.watch_strikes:
            return None
        self.strikes = 0
        y, z = pos.tolist()
        return replace(fix, pos=(float(there_y + y - my), float(there_z + z - mz)))

    def get_state(self) -> dict[str, object]:
        """Copy of the state."""
        return {"start": self.start.get_state(), "at": self._at.copy(), "strikes": self.strikes}

    def set_state(self, s: object) -> None:
        """Restore what `get_state` returned."""
        assert isinstance(s, dict)
        self.start.set_state(s["start"])
        self._at[:], self.strikes = s["at"], s["strikes"]
