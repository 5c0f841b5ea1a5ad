"""Start-up of the wake-position estimator: mean of readings, then a search for the position spread over steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_fix import MlFix
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.missions.receiver.airdata.wake_search import WakeMl

Arr = NDArray[np.float64]
COMPLETE = 0.8  # [-] share of the samples a channel must be there for its mean to be used


class StartUp:
    """Collects readings and frames for start_min_s, searches; if position or basin is unsure, for twice as long."""

    def __init__(self, probes: Arr, params: WakePositionParams, wake: WakeParams) -> None:
        """probes [3,3] [m, body]. Raises ValueError for another shape."""
        p = self.p = params
        on = 1.0 if p.scales else 0.0
        ml = replace(
            p.start,
            sigma_V=p.sigma_V,
            sigma_angle=max(p.sigma_beta, p.sigma_alpha),
            fixed_V=p.offset_V,
            fixed_angle=p.offset_flow,
            scale_wing_sigma=on * p.scale_wing_sigma,
            scale_tail_sigma=on * p.scale_tail_sigma,
        )
        self.ml = WakeMl(probes, ml, wake)
        self._sum, self._count, self._frame = np.zeros(9), np.zeros(9), np.zeros(kp.G_SIZE)
        self.scale: tuple[float, float, float, float] | None = None  # circulation factors known from before, and sigmas
        self.reset()

    def reset(self) -> None:
        """Begin a new collection."""
        self._sum[:], self._count[:], self._frame[:] = 0.0, 0.0, 0.0
        self.samples = 0
        self.duration_s = 0.0
        self.want_s = self.p.start_min_s
        self.searching = self.scanned = False
        self.reason = "collecting air data"

    def elapsed(self, dt: float) -> None:
        """Time [s] passes."""
        if self.samples:
            self.duration_s += dt

    def collect(self, readings: Arr, ok: NDArray[np.int64], frame: Arr) -> MlFix | None:
        """Add one set of readings [9] with flags [9] in a frame [11]; the position once it is found, else None."""
        for c in range(9):
            if ok[c]:
                self._sum[c] += readings[c]
                self._count[c] += 1.0
        self._frame += frame
        self.samples += 1
        if self.searching:
            if not self.scanned:
                self.scanned = self.ml.advance(self.p.start_nodes)
                return None
            return self._decide() if self.ml.follow() else None
        if self.duration_s >= self.want_s:
            n = self.samples
            mask = sum(1 << c for c in range(9) if self._count[c] >= COMPLETE * n)
            mean = self._sum / np.maximum(self._count, 1.0)
            self.ml.begin(mean, self._frame / n, n, mask, scale=self.scale)
            self.searching, self.scanned = True, False
        return None

    def _decide(self) -> MlFix | None:
        fix = self.ml.finish()
        self.searching = False
        last = self.want_s >= self.p.start_max_s
        if fix is not None and fix.inside:
            # 99.9 % of chi-square, by Wilson and Hilferty's cube
            d = max(fix.dof, 1)
            fits = fix.cost < d * (1.0 - 2.0 / (9.0 * d) + 3.09 * (2.0 / (9.0 * d)) ** 0.5) ** 3
            sure = fix.sigma_m < self.p.start_sigma_m and fits
            if sure and (last or not fix.rivals):
                return fix
            why = "position ambiguous" if sure else "readings do not fit the wake model"
            if fits and not sure:
                why = "position not observable here"
        else:
            why = "no position found in the search region"
        if last:
            self.reset()
        else:
            self.want_s = min(2.0 * self.want_s, self.p.start_max_s)
        self.reason = why
        return None

    def get_state(self) -> dict[str, object]:
        """Copy of the state."""
        return {
            "arrays": [a.copy() for a in (self._sum, self._count, self._frame)],
            "flags": (
                self.samples,
                self.duration_s,
                self.want_s,
                self.reason,
                self.scale,
                self.searching,
                self.scanned,
            ),
            "ml": self.ml.get_state(),
        }

    def set_state(self, s: object) -> None:
        """Restore what `get_state` returned."""
        assert isinstance(s, dict)
        for own, a in zip((self._sum, self._count, self._frame), s["arrays"], strict=True):
            own[:] = a
        self.samples, self.duration_s, self.want_s, self.reason, self.scale, self.searching, self.scanned = s["flags"]
        self.ml.set_state(s["ml"])
