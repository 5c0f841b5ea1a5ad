"""Witnesses of a disputed reading that share nothing with it: who is right when a sensor and the estimate disagree for long.

Lift and another aircraft's wind for the airspeed; the difference of GNSS fixes (nav.position_aid) for the relative position.
"""

from __future__ import annotations

import math

from flightsw.nav.refusal import AGAINST, FOR, UNDECIDED

LEARN_TAU_S = 40.0  # [s] over which lift is compared with the model while the airspeed is good
NOW_TAU_S = 1.0  # [s] smoothing of the present lift
LEARNT_S = 10.0  # [s] of comparison before it counts
CAP = 25.0  # [-] most one witness can say in squared sigmas: none is believed beyond five
AGAINST_AT, FOR_AT = (
    9.0,
    -16.0,
)  # [-] difference of squared sigmas; a sensor is taken back on stronger evidence than kept out


def verdict(pairs: list[tuple[float, float]]) -> int:
    """AGAINST the sensor, FOR it, or UNDECIDED, from (sensor, estimate) distances of each witness in its sigmas.

    The sum of z_sensor^2 - z_estimate^2 is twice the log-likelihood ratio of "the estimate is right" against "the sensor is".
    """
    score = sum(min(s * s, CAP) - min(e * e, CAP) for s, e in pairs)
    return AGAINST if score > AGAINST_AT else FOR if score < FOR_AT else UNDECIDED


class Lift:
    """Airspeed from lift: normal specific force is proportional to V^2 at a given incidence, and how the real aircraft's
    differs from the model's is learnt while the airspeed is in use."""

    def __init__(self, sigma: float, error: float) -> None:
        """sigma [-] of airspeed once learnt; error [-] of lift before: half of it in airspeed."""
        self.sigma, self.error = sigma, error
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt."""
        self.learnt, self.known_s = 1.0, 0.0  # [-] measured over modelled, mean
        self.now = math.nan

    def step(self, measured: float, modelled: float, dt: float, learn: bool) -> None:
        """Normal specific force [m/s^2] as measured and as the model has it at the estimate, dt [s] after the last; learn: the
        estimate's airspeed is measured."""
        if not (measured * modelled > 1.0 and dt > 0.0):  # pushed over, or no number: no lift to compare
            return
        r = min(measured / modelled, 4.0)
        first = not math.isfinite(self.now)
        self.now = r if first else self.now + min(dt / NOW_TAU_S, 1.0) * (r - self.now)
        if learn:
            self.known_s += dt
            self.learnt += dt / min(self.known_s, LEARN_TAU_S) * (r - self.learnt)

    def airspeed(self, V: float) -> tuple[float, float]:
        """Airspeed and its 1-sigma [m/s] where the estimate is V; sigma is infinite while there is no lift to go by."""
        if not self.now > 0.0:
            return V, math.inf
        old = self.known_s >= LEARNT_S
        return V * math.sqrt(self.now / (self.learnt if old else 1.0)), (self.sigma if old else 0.5 * self.error) * V

    @property
    def plausible(self) -> bool:
        """Whether the lift is what the model can explain."""
        return not abs(self.now - 1.0) > self.error
