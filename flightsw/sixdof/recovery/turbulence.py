"""Intensity of the turbulence that is flown through, by air data, attitude and accelerometers (docs/sources/rough-air.md 1)."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated

from flightsw.kernels.atmosphere import G0
from flightsw.sixdof.recovery.readings import Readings
from flightsw.strict import Range
from flightsw.types import Text, Vec3

WARNING, NOTICE = 4, 5  # MAV_SEVERITY
FIRST_S = 1.0  # [s] of differences before anything is said of them


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
        self._gained = [0.0, 0.0, 0.0]  # [m/s] NED, since the beginning
        self._square = [0.0, 0.0, 0.0]  # [m^2/s^2] along, across, down
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
        R, (x, y, z), gained = s.R.tolist(), s.force, self._gained
        cb = math.cos(s.beta)
        u, v, w = s.V * math.cos(s.alpha) * cb, s.V * math.sin(s.beta), s.V * math.sin(s.alpha) * cb
        for i in range(3):  # both turned into NED
            gained[i] += (R[i] * x + R[3 + i] * y + R[6 + i] * z + (G0 if i == 2 else 0.0)) * dt
        n, e, d = (gained[i] - (R[i] * u + R[3 + i] * v + R[6 + i] * w) for i in range(3))
        here = (n, e, d)
        self._past.append((self._t, here))
        lag = 0.0
        while self._past and (lag := self._t - self._past[0][0]) > self.p.lag_s + 0.5 * dt:
            self._past.popleft()
        if lag > self.p.lag_s - 0.5 * dt:
            self._learn(s, here, self._past[0][1], lag, dt)
        self._judge(dt)

    def _learn(self, s: Readings, here: Vec3, then: Vec3, lag: float, dt: float) -> None:
        """Take in a difference over `lag` [s]: its square over what one of unit intensity would have (rough-air.md 1)."""
        n, e, d = (a - b for a, b in zip(here, then, strict=True))
        north, east = s.R[:2].tolist()
        heading = math.atan2(east, north)
        c, w = math.cos(heading), math.sin(heading)
        share = lag * s.V / self.p.L_m
        decay = math.exp(-share)
        along, across = 2.0 * (1.0 - decay), 2.0 * (1.0 - (1.0 - 0.5 * share) * decay)
        self._n_s = min(self._n_s + dt, self.p.window_s)
        for i, (x, unit) in enumerate(((c * n + w * e, along), (c * e - w * n, across), (d, across))):
            self._square[i] += dt / self._n_s * ((x * x - self.p.noise_mps**2) / unit - self._square[i])
        if self._n_s >= FIRST_S:
            self.sigma = math.sqrt(max(sorted(self._square)[1], 0.0))  # one axis may be a sensor's doing

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
