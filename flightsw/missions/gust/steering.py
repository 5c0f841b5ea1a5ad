"""Whether the estimate of the gust mission steers, and what is said of it: trust, servos identified, alleviation that pays."""

from __future__ import annotations

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import GustEstimate
from flightsw.missions.gust.estimators import GustNavTable
from flightsw.missions.gust.law import GustHold, HoldParams
from flightsw.missions.gust.load_watch import MUCH, LoadWatch
from flightsw.missions.gust.model import GustAircraft, parameter_vector
from flightsw.missions.gust.servo_bank.params import ServosFound
from flightsw.missions.gust.validity import DISAGREE, STALL, Trust
from flightsw.types import Text

Array = np.ndarray
(NONE, NO_ESTIMATE, IDENTIFIES, READINGS, DISAGREES, INCIDENCE, LOAD, SERVOS) = range(8)  # WKF_GUST_DOUBT
SLOW = "servos too slow and late"
DOUBTS = {DISAGREE: DISAGREES, STALL: INCIDENCE, "settles": NO_ESTIMATE}


class Steering:
    """Per sample: `trusts`, with a bank of servo models `weigh`, then `by` and `why`."""

    def __init__(self, nav: GustNavTable, hold: HoldParams, ac: GustAircraft, late: int) -> None:
        """late: samples between a command and its servo, of the link."""
        self._nav, self._ac = nav, ac
        self._own_hold = GustHold(hold, ac)  # that of the load watch
        self.trust = Trust(nav.trust, ac.alpha_max_rad)
        self.late(late)
        self._found: ServosFound | None = None  # last told
        self._lags = False
        self._par, self._a = parameter_vector(ac, nav.turbulence), np.zeros(k.AIR_N)
        self._texts: list[Text] = []

    def late(self, late: int) -> None:
        """The link has become so many samples long."""
        nav = self._nav
        self.load = LoadWatch(nav.load_watch, self._ac, nav.turbulence, self._own_hold, nav.sensors.a_z, late)

    def adopt(self, nav: GustNavTable, hold: HoldParams) -> None:
        """Changed parameters from this sample on."""
        self._nav, self.trust.p, self.load.p, self._own_hold.p = nav, nav.trust, nav.load_watch, hold

    def trusts(self, est: GustEstimate, dt: float) -> None:
        """Judge the estimate of this sample, dt [s] after the last one."""
        trusted = self.trust.ok
        if self.trust.step(est, dt, self._incidence(est)) is not trusted and est.valid:
            again = Text(6, "estimate trusted again")
            self._texts.append(again if self.trust.ok else Text(4, f"hold: {self.trust.reason}"))

    def weigh(self, est: GustEstimate, y: Array, unresolved: float, alleviates: bool, dt: float) -> None:
        """Servos found and whether alleviation pays; arguments as LoadWatch.step."""
        now, was = est.servos, self._found
        if now is not None and now.settled and (was is None or (was.wn_radps, was.late) != (now.wn_radps, now.late)):
            self._texts.append(Text(6, f"servos {now.wn_radps:g} rad/s, {now.late} samples late"))
            self._found = now
        # a model in force may be behind another by less than it takes to change: that alone says nothing of how slow they are
        if now is not None and now.settled and abs(now.slow_by) > self._nav.servo_bank.lead:
            lags = now.slow_by > 0.0
            if lags is not self._lags:
                self._texts.append(Text(4, f"hold: {SLOW}") if lags else Text(6, "servos fast enough"))
            self._lags = lags
        paid = self.load.ok
        self.load.step(est, y, unresolved, alleviates, dt)
        if paid is not self.load.ok:
            self._texts.append(Text(4, f"hold: {MUCH}") if paid else Text(6, "alleviates again"))

    def by(self, est: GustEstimate) -> bool:
        """Whether the estimate steers: valid, trusted, its servos identified and fast enough, and alleviation no dearer than the
        hold."""
        found = est.servos is None or (est.servos.settled and self.load.ok and not self._lags)
        return est.valid and self.trust.ok and found

    def why(self, est: GustEstimate) -> tuple[int, str]:
        """WKF_GUST_DOUBT and words for what keeps the estimate from steering."""
        if not est.valid:
            return NO_ESTIMATE, est.reason
        if not self.trust.ok:
            return DOUBTS.get(self.trust.reason, READINGS), self.trust.reason
        if est.servos is not None and not est.servos.settled:
            return IDENTIFIES, "finds out about the servos"
        if self._lags:
            return SERVOS, SLOW
        return (NONE, "") if self.load.ok else (LOAD, MUCH)

    def texts(self) -> list[Text]:
        """Messages since the last call."""
        out, self._texts = self._texts, []
        return out

    def _incidence(self, est: GustEstimate) -> float:
        """Of the estimate [rad]; 0 without one."""
        if not est.valid:
            return 0.0
        k.air(est.x, self._par, self._a)
        return float(self._a[k.AIR_ALPHA])
