"""Witnesses of a disputed reading that share nothing with it: who is right when a sensor and the estimate disagree for long.

Specific force and another aircraft's wind for air data; the difference of GNSS fixes (nav.position_aid) for the relative
position.
"""

from __future__ import annotations

import math

from flightsw.refusal import AGAINST, FOR, UNDECIDED
from flightsw.types import Vec3

LEARN_TAU_S = 40.0  # [s] over which lift is compared with the model while the airspeed is good
NOW_TAU_S = 1.0  # [s] smoothing of the present lift
LEARNT_S = 10.0  # [s] of comparison before it counts
CAP = 25.0  # [-] most one witness can say in squared sigmas: none is believed beyond five
AGAINST_AT, FOR_AT = (
    9.0,
    -16.0,
)  # [-] difference of squared sigmas; a sensor is taken back on stronger evidence than kept out


def verdict(pairs: list[tuple[float, float]], before: int = UNDECIDED) -> int:
    """AGAINST the sensor, FOR it, or UNDECIDED, from (sensor, estimate) distances of each witness in its sigmas.

    The sum of z_sensor^2 - z_estimate^2 is twice the log-likelihood ratio of "the estimate is right" against "the sensor is".
    A verdict stands until less than half of it is left.
    """
    score = sum(min(s * s, CAP) - min(e * e, CAP) for s, e in pairs)
    half = 0.5 if before == AGAINST else 1.0
    return AGAINST if score > half * AGAINST_AT else FOR if score < FOR_AT else UNDECIDED


class Forces:
    """Airspeed, incidence and sideslip from the specific force across the flight path.

    Lift grows with V^2 and incidence, side force with sideslip. By how much the real aircraft's differ from the model's is learnt
    while the air data are in use.
    """

    def __init__(self, sigma: float, error: float, side_sigma: float) -> None:
        """sigma [-] of lift once learnt, error [-] of lift before; side_sigma [m/s^2] of side force."""
        self.sigma, self.error, self.side_sigma = sigma, error, side_sigma
        self.reset()

    def reset(self) -> None:
        """Forget what was learnt."""
        self.learnt, self.side_learnt, self.known_s = (
            1.0,
            0.0,
            0.0,
        )  # lift: measured over modelled; side force: their difference
        self.now, self.side = math.nan, 0.0
        self.wind: Vec3 = (0.0, 0.0, 0.0)  # [m/s] NED, mean over the same time

    def step(self, measured: Vec3, modelled: Vec3, wind: Vec3, dt: float, learn: bool) -> None:
        """Specific force [m/s^2] in body axes as measured, and as the model has it at the estimate; wind [m/s] NED of that; dt
        [s] after the last; learn: the estimate's air data are measured."""
        if not (measured[2] * modelled[2] > 1.0 and dt > 0.0):  # pushed over, or no number: no lift to compare
            return
        r, d = min(measured[2] / modelled[2], 4.0), measured[1] - modelled[1]
        gain = min(dt / NOW_TAU_S, 1.0) if math.isfinite(self.now) else 1.0
        self.now = r if gain == 1.0 else self.now + gain * (r - self.now)
        self.side += gain * (d - self.side)
        if learn:
            self.known_s += dt
            gain = dt / min(self.known_s, LEARN_TAU_S)
            self.learnt += gain * (r - self.learnt)
            self.side_learnt += gain * (d - self.side_learnt)
            x, y, z = (a + gain * (b - a) for a, b in zip(self.wind, wind, strict=True))
            self.wind = x, y, z

    def lift(self, share: float, unsure: float) -> tuple[float, float]:
        """Distances in sigmas of the measured lift from `share` times what the model has at the estimate, and from just that,
        where the estimate's own uncertainty is worth `unsure` [-] of lift; 0, 0: nothing to go by."""
        if not (self.now > 0.0 and share > 0.0):
            return 0.0, 0.0
        old = self.known_s >= LEARNT_S
        r, s = self.now / (self.learnt if old else 1.0), self.sigma if old else self.error
        return (r / share - 1.0) / s, (r - 1.0) / math.hypot(s, unsure)

    @property
    def more(self) -> float:
        """Share by which the lift is more than the model's at the estimate."""
        return self.now / self.learnt - 1.0 if self.now > 0.0 else 0.0

    @property
    def faster(self) -> float:
        """Share by which the airspeed that bears the measured lift is more than the estimate's."""
        return math.sqrt(1.0 + self.more) - 1.0

    def borne(self) -> None:
        """The estimate has been given the airspeed that bears the lift."""
        self.now = self.learnt

    def sideways(self, more: float, unsure: float) -> tuple[float, float]:
        """Distances in sigmas of the measured side force from the model's at the estimate plus `more`, and from just that,
        where the estimate's own uncertainty is worth `unsure`, all [m/s^2]."""
        if self.known_s < LEARNT_S:
            return 0.0, 0.0
        d, s = self.side - self.side_learnt, self.side_sigma
        return (d - more) / s, d / math.hypot(s, unsure)

    @property
    def plausible(self) -> bool:
        """Whether the lift is what the model can explain."""
        return not abs(self.now - 1.0) > self.error
