"""What watches over the estimate and the engines of the windshear mission, and what it has to say."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.engine_out import EngineOutParams, EngineWatch
from flightsw.missions.windshear.errors import ErrorParams
from flightsw.missions.windshear.estimator import WindshearEstimate, WindshearNav
from flightsw.missions.windshear.lift_witness import LiftWitness
from flightsw.missions.windshear.reports import WindshearErrors, WindshearState
from flightsw.missions.windshear.trust import Trust, TrustParams
from flightsw.missions.windshear.units import SATELLITES, kept_out
from flightsw.types import HF_ENGINE, HF_NAV, Text

Array = np.ndarray
LIKE_AN_ENGINE = [k.Y_VG, k.Y_VA, k.Y_AL, k.Y_TH, k.Y_Q, k.Y_HD]  # readings that, wrong, look like one that is out


class Supervision:
    """`step` once per sample after the estimate. `engine_out`; `why` the estimate is not trusted, "" while it is."""

    def __init__(self, trust: TrustParams, engine: EngineOutParams, errors: ErrorParams | None, par: Array) -> None:
        """errors: of the filter that has such states; None: another. par [NP] (dynamics.py): the aircraft as believed."""
        self.lift = LiftWitness(trust.lift_frac, trust.held_s, par)
        self.engines = EngineWatch(engine)
        self.trust = Trust(trust)
        self.why = ""
        self.accused = False
        late = errors.late_samples if errors is not None else 0
        self._late = late
        self._benched = 0  # bits of readings the estimator keeps out
        self._before: deque[Array] = deque(maxlen=late + 1)
        self._texts: list[Text] = []

    @property
    def engine_out(self) -> bool:
        """Whether an engine is."""
        return self.engines.out

    @property
    def mask(self) -> int:
        """Bits of readings the estimator is not to be given."""
        return self.trust.mask | (kept_out(self._benched) if self.trust.p.on else 0)

    @property
    def sound(self) -> int:
        """Bits of readings that nothing speaks against, for witnesses beside the estimator."""
        return ~(kept_out(self._benched) | self._benched) if self.trust.p.on else ~0

    @property
    def faults(self) -> int:
        """HF_* of what is wrong by this."""
        return (HF_ENGINE if self.engines.out else 0) | (HF_NAV if self.why else 0)

    def in_force(self, now: Array) -> Array:
        """Controls [2] that were in force when the readings were taken: as many samples ago as these are late."""
        if not self._late:
            return now
        self._before.append(now.copy())
        return next(iter(self._before))  # the oldest

    def step(
        self, z: Array, ok: int, satellite_m: float, e: WindshearEstimate, accused: bool, commanded_kN: float,
        refused: Array, dt: float,
    ) -> bool:  # fmt: skip
        """One sample, as Trust.step; accused: the monitor's wind differs; refused [10]: the estimator's
        memory of refusals, negative for a channel it keeps out. Whether trust has just gone."""
        self._benched = sum(1 << c for c in np.flatnonzero(refused < 0.0).tolist())
        if self._benched & SATELLITES:
            satellite_m = math.nan
        if accused and not self.accused:
            self._texts.append(Text(4, "wind of estimator and monitor differ"))
        self.accused = accused
        if e.valid:
            doubt = self.trust.p.on and (bool(refused[LIKE_AN_ENGINE].any()) or self.lift.apart > 0.5)
            self._engines(e, commanded_kN, doubt, dt)
        if not (self.trust.p.on and e.valid):
            return False
        nis = e.nis / e.channels if e.channels > 0 else math.nan
        why = self.trust.step(z, ok, satellite_m, e.x, e.sigma, nis, self._benched, dt)
        why = why or ("monitor sees another wind" if accused else "")
        odd = self.lift.step(z, ok, float(e.x[k.T]), dt)
        why = why or ("airspeed and incidence contradict the lift" if odd else "")
        self._texts += [Text(4, text) for text in self.trust.texts]
        self.trust.texts = []
        lost = bool(why) and not self.why
        if lost:
            self._texts.append(Text(3, f"estimate not trusted: {why}"))
        elif self.why and not why:
            self._texts.append(Text(5, "estimate trusted again"))
        self.why = why
        return lost

    def _engines(self, e: WindshearEstimate, commanded_kN: float, doubt: bool, dt: float) -> None:
        was = self.engines.out
        out = self.engines.step(e.x, e.sigma, commanded_kN, dt, doubt)
        if out and not was:
            self._texts.append(Text(2, f"engine out: {round(100.0 * float(e.x[k.K_T]))} % of the thrust commanded"))
        elif was and not out:
            self._texts.append(Text(5, "engine back"))

    def report(self, s: WindshearState, nav: WindshearNav) -> WindshearErrors:
        """What goes down beside the state s of the filter with error states."""
        known = slice(k.NX, k.L_VA)
        est, sigma = tuple(nav.x[known].tolist()), tuple(nav.sigma[known].tolist())
        return WindshearErrors(s.t_us, est, sigma, self.engine_out, bool(self.why), self.mask, s.valid)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self._texts = self._texts, []
        return out
