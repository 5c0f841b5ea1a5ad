"""Intensity of the turbulence that is flown through, by air data, attitude and accelerometers (docs/sources/rough-air.md 1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.readings_kernel import AHEAD, ALPHA, ASIDE, BETA, DOWN, SPEED
from flightsw.strict import Range
from flightsw.types import Text

WARNING, NOTICE = 4, 5  # MAV_SEVERITY
FIRST_S = 1.0  # [s] of differences before anything is said of them
KEPT = 512  # steps: more than the longest lag at 200 Hz
TIME, HERE, WIDTH = 0, 1, 4  # columns of a step: [s]; [m/s] velocity gained less velocity through the air, NED
# what is learnt: velocity gained [3] m/s NED since the beginning, squares along, across, down [3] m^2/s^2; [s] of differences;
# the oldest step kept, and how many
GAINED, SQUARE, SPAN, OLDEST, STEPS, LEARNT = 0, 3, 6, 7, 8, 9


@jit
def parted(x: np.ndarray, R: np.ndarray, dt: float, gained: np.ndarray, here: np.ndarray) -> None:
    """here [3] <- velocity [m/s] NED gained so far, `gained` [3] in place, less that through the air, of what is known of a step
    of dt [s], x [MOTION] (readings_kernel.py), at attitude R [9] NED to body."""
    V, alpha, beta = x[SPEED], x[ALPHA], x[BETA]
    cb = math.cos(beta)
    u, v, w = V * math.cos(alpha) * cb, V * math.sin(beta), V * math.sin(alpha) * cb
    for i in range(3):  # both turned into NED
        gained[i] += (R[i] * x[AHEAD] + R[3 + i] * x[ASIDE] + R[6 + i] * x[DOWN] + (G0 if i == 2 else 0.0)) * dt
        here[i] = gained[i] - (R[i] * u + R[3 + i] * v + R[6 + i] * w)


@jit
def learnt(
    R: np.ndarray, n: float, e: float, d: float, share: float, gain: float, noise2: float, square: np.ndarray
) -> None:
    """Squares `square` [3] m^2/s^2 along, across, down <- by a share `gain` those of a difference n, e, d [m/s] NED, less noise2
    [m^2/s^2], over what one of unit intensity would have after `share` [-] of the scale length; R [9] attitude."""
    heading = math.atan2(R[1], R[0])
    c, w = math.cos(heading), math.sin(heading)
    decay = math.exp(-share)
    along, across = 2.0 * (1.0 - decay), 2.0 * (1.0 - (1.0 - 0.5 * share) * decay)
    x, y = c * n + w * e, c * e - w * n
    square[0] += gain * ((x * x - noise2) / along - square[0])
    square[1] += gain * ((y * y - noise2) / across - square[1])
    square[2] += gain * ((d * d - noise2) / across - square[2])


@jit
def taken(
    x: np.ndarray, R: np.ndarray, t: float, dt: float, ring: np.ndarray, m: np.ndarray, lag_s: float, window_s: float,
    noise2: float, L: float, sigma: float,
) -> float:  # fmt: skip
    """Intensity [m/s], so far `sigma`, after a step of dt [s] at t [s], x and R as `parted`: the difference over lag_s [s] into m
    [LEARNT], its square over what one of unit intensity would have at scale length L [m] (rough-air.md 1). ring [KEPT,WIDTH]:
    steps; window_s [s]: differences remembered; noise2 [m^2/s^2] of one."""
    oldest, n = int(m[OLDEST]), int(m[STEPS])
    here = ring[(oldest + n) % KEPT]
    here[TIME] = t
    parted(x, R, dt, m[GAINED:SQUARE], here[HERE:])
    n += 1
    while n > 1 and (n == KEPT or t - ring[oldest, TIME] > lag_s + 0.5 * dt):
        oldest, n = (oldest + 1) % KEPT, n - 1
    m[OLDEST], m[STEPS] = oldest, n
    then = ring[oldest]
    lag = t - then[TIME]
    if not lag > lag_s - 0.5 * dt and n < KEPT - 1:  # of steps too short to keep that many, over what is kept
        return sigma
    m[SPAN] += dt
    if m[SPAN] > window_s:
        m[SPAN] = window_s
    a, b, c = here[HERE] - then[HERE], here[HERE + 1] - then[HERE + 1], here[HERE + 2] - then[HERE + 2]
    learnt(R, a, b, c, lag * x[SPEED] / L, dt / m[SPAN], noise2, m[SQUARE:SPAN])
    if m[SPAN] < FIRST_S:
        return sigma
    a, b, c = m[SQUARE], m[SQUARE + 1], m[SQUARE + 2]
    if b < a:
        a, b = b, a
    square = b if b < c else c if a < c else a  # the middle one: one axis may be a sensor's doing
    return math.sqrt(0.0 if square < 0.0 else square)


@dataclass(frozen=True)
class TurbulenceParams:
    """What intensity refuelling bears, and how it is learnt."""

    bear_mps: Annotated[float, Range(0.5, 20.0)] = 3.5  # 1 sigma; moderate is 2.1 and severe 6.2 at 7010 m
    over_s: Annotated[float, Range(0.1, 60.0)] = 0.5  # beyond it for so long: it is too rough
    ease_frac: Annotated[float, Range(0.1, 1.0)] = 0.8  # [-] of it, and
    calm_s: Annotated[float, Range(1.0, 3600.0)] = 30.0  # below that for so long: it may go on
    window_s: Annotated[float, Range(2.0, 120.0)] = 4.0  # differences remembered
    lag_s: Annotated[float, Range(0.1, 2.0)] = 0.3  # over which a difference is taken
    noise_mps: Annotated[float, Range(0.0, 5.0)] = 0.38  # 1 sigma of a difference in calm air, of tactical sensors
    L_m: Annotated[float, Range(50.0, 5000.0)] = 533.4  # scale length that an intensity is stated for


@dataclass(frozen=True)
class RoughAirParams(TurbulenceParams):
    """[rough_air] of a receiver flight file: that, and what is flown beyond it."""

    on: bool | None = None  # left out: as integrity.on; then nothing else here may be set without that
    V_mps: Annotated[float, Range(1.0)] = 175.0  # airspeed for rough air: as far from the slowest as from gust loads
    speed_mps2: Annotated[float, Range(0.05, 5.0)] = 1.0  # how fast it is come to


class Turbulence:
    """What is learnt of it. One `step` a mission step; `sigma` [m/s] per axis, 0 until there is enough; `rough`: refuelling does
    not bear it."""

    def __init__(self, p: TurbulenceParams) -> None:
        self.p = p
        self.sigma, self.rough = 0.0, False
        self.texts: list[Text] = []
        self._noise2 = p.noise_mps**2
        self._ring, self._m = np.zeros((KEPT, WIDTH)), np.zeros(LEARNT)
        self._t = self._over_s = self._calm_s = 0.0
        self._known = False

    def step(self, s: Readings, learn: bool, dt: float) -> None:
        """Readings as of this step, dt [s] after the last; learn: they are of an aircraft that is flown, not tumbling."""
        if not (learn and s.trusted and s.V_measured):
            self._m[STEPS] = 0.0
            self._known = False
            return
        self._t += dt
        if not self._known:  # the step before has no reading to begin from
            self._known = True
            return
        p = self.p
        self.sigma = taken(
            s.x, s.R, self._t, dt, self._ring, self._m, p.lag_s, p.window_s, self._noise2, p.L_m, self.sigma
        )  # fmt: skip
        self._judge(dt)

    def _judge(self, dt: float) -> None:
        p = self.p
        self._over_s = self._over_s + dt if self.sigma > p.bear_mps else 0.0
        self._calm_s = self._calm_s + dt if self.sigma < p.ease_frac * p.bear_mps else 0.0
        if not self.rough and self._over_s >= p.over_s:
            self.rough = True
            self.texts.append(Text(WARNING, self.why))
        elif self.rough and self._calm_s >= p.calm_s:
            self.rough = False
            self.texts.append(Text(NOTICE, f"turbulence {self.sigma:.1f} m/s: calm enough again"))

    def tell(self) -> list[Text]:
        """Messages since the last call."""
        out, self.texts = self.texts, []
        return out

    @property
    def why(self) -> str:
        """Why refuelling cannot go on."""
        return f"turbulence {self.sigma:.1f} m/s, allowed {self.p.bear_mps:g}"
