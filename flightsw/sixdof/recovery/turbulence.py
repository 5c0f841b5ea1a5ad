"""Intensity of the turbulence that is flown through, by air data, attitude and accelerometers (docs/sources/rough-air.md 1)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import less
from flightsw.sixdof.recovery.readings import Readings
from flightsw.strict import Range
from flightsw.types import Text, Vec3

WARNING, NOTICE = 4, 5  # MAV_SEVERITY
FIRST_S = 1.0  # [s] of differences before anything is said of them


@jit
def parted(
    R: np.ndarray, x: float, y: float, z: float, V: float, alpha: float, beta: float, dt: float, gained: np.ndarray
) -> tuple[float, float, float]:
    """Velocity [m/s] NED gained so far, `gained` [3] in place, less that through the air; R [9] NED to body, x, y, z [m/s^2]
    specific force of the step of dt [s], V [m/s], alpha, beta [rad] flow."""
    cb = math.cos(beta)
    u, v, w = V * math.cos(alpha) * cb, V * math.sin(beta), V * math.sin(alpha) * cb
    for i in range(3):  # both turned into NED
        gained[i] += (R[i] * x + R[3 + i] * y + R[6 + i] * z + (G0 if i == 2 else 0.0)) * dt
    return (
        gained[0] - (R[0] * u + R[3] * v + R[6] * w),
        gained[1] - (R[1] * u + R[4] * v + R[7] * w),
        gained[2] - (R[2] * u + R[5] * v + R[8] * w),
    )


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
        self._past: deque[tuple[float, Vec3]] = deque()  # [s], [m/s] velocity gained less velocity through the air, NED
        self._t = self._n_s = self._over_s = self._calm_s = 0.0
        self._gained = np.zeros(3)  # [m/s] NED, since the beginning
        self._square = np.zeros(3)  # [m^2/s^2] along, across, down
        self._noise2 = p.noise_mps**2
        self._known = False

    def step(self, s: Readings, learn: bool, dt: float) -> None:
        """Readings as of this step, dt [s] after the last; learn: they are of an aircraft that is flown, not tumbling."""
        if not (learn and s.trusted and s.V_measured):
            self._past.clear()
            self._known = False
            return
        self._t += dt
        if not self._known:  # the step before has no reading to begin from
            self._known = True
            return
        here = parted(s.R, *s.force, s.V, s.alpha, s.beta, dt, self._gained)
        past, longest = self._past, self.p.lag_s + 0.5 * dt
        past.append((self._t, here))
        while (lag := self._t - past[0][0]) > longest and len(past) > 1:
            past.popleft()
        if lag > self.p.lag_s - 0.5 * dt:
            self._learn(s, here, past[0][1], lag, dt)
        self._judge(dt)

    def _learn(self, s: Readings, here: Vec3, then: Vec3, lag: float, dt: float) -> None:
        """Take in a difference over `lag` [s]: its square over what one of unit intensity would have (rough-air.md 1)."""
        n, e, d = less(here, then)
        self._n_s = min(self._n_s + dt, self.p.window_s)
        learnt(s.R, n, e, d, lag * s.V / self.p.L_m, dt / self._n_s, self._noise2, self._square)
        if self._n_s >= FIRST_S:
            self.sigma = math.sqrt(max(sorted(self._square.tolist())[1], 0.0))  # one axis may be a sensor's doing

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
