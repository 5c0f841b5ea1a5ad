"""Hazard alerting of the jet transport in wind shear: F of the estimated wind in low-passes, caution and abort.

A quick low-pass for caution and a slow one for the abort, so that turbulence (which is in F through the wind's rates) cautions
but hardly ever aborts. The rates that enter are differences of the estimated wind: the rate states of the estimator follow the
smooth part of the wind only, and the later the more turbulence there is beside it.

Two things need not wait for the slow value. Sinking air is in F without a derivative: a downdraught of a tenth of the airspeed
is the core, and no turbulence one flies an approach in. And after a gain of energy the loss that follows is no turbulence
either: the head wind that gave it is taken back, so that the quick value may abort.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.strict import IN_FLIGHT, OneOf, Range

Array = np.ndarray


@dataclass(frozen=True)
class HazardParams:
    """Caution and abort thresholds of F in its low-passes; `rates` says where the wind's rates come from."""

    rates: Annotated[str, OneOf(("differences", "states"))] = "differences"
    settle_s: Annotated[float, Range(0.0, 60.0), IN_FLIGHT] = (
        2.0  # after the first valid estimate; nothing is judged before
    )
    caution_s: Annotated[float, Range(0.05, 30.0), IN_FLIGHT] = 1.5
    caution_F: Annotated[float, Range(0.01, 1.0), IN_FLIGHT] = 0.12
    abort_s: Annotated[float, Range(0.05, 30.0), IN_FLIGHT] = 4.0
    abort_F: Annotated[float, Range(0.01, 1.0), IN_FLIGHT] = 0.12
    abort_on: Annotated[str, OneOf(("abort", "caution"))] = "abort"  # "caution": the quick value aborts too
    release_F: Annotated[float, Range(-1.0, 1.0), IN_FLIGHT] = 0.08  # caution ends below this
    gain_F: Annotated[float, Range(0.01, 1.0), IN_FLIGHT] = (
        0.1  # slow F below minus this is caution too: the far side will take it back
    )
    gain_hold_s: Annotated[float, Range(0.0, 120.0), IN_FLIGHT] = 20.0  # for this long after
    gain_abort: bool = False  # and meanwhile the quick value aborts
    sink_s: Annotated[float, Range(0.05, 30.0), IN_FLIGHT] = 1.0
    sink_F: Annotated[float, Range(0.0, 1.0), IN_FLIGHT] = 0.0  # F of the sinking air alone that aborts; 0: none does


@dataclass(frozen=True)
class HazardState:
    """F as estimated, its quick and slow low-pass, caution now, abort latched."""

    F: float = 0.0
    quick: float = 0.0
    slow: float = 0.0
    caution: bool = False
    abort: bool = False


class Hazard:
    """Low-passes and thresholds. `state` is the last result; `cautions` counts how often caution came on."""

    def __init__(self, p: HazardParams | None = None) -> None:
        """Starts clear."""
        self.p = p or HazardParams()
        self.state = HazardState()
        self.cautions = 0
        self._age = 0.0
        self._gain_s = 0.0
        self._sink = 0.0
        self._wind: tuple[float, float] | None = None

    def lost(self) -> None:
        """The estimate is interrupted: its next wind is not to be compared with the last, and needs time to settle."""
        self._wind = None
        self._age = 0.0

    def index(self, x: Array, F: float, dt: float, gravity: float) -> float:
        """F [-] of this sample by differences of the wind of the estimate x [15]; F itself at the first sample."""
        wx, wh = float(x[k.WX]), float(x[k.WH])
        last, self._wind = self._wind, (wx, wh)
        if last is None or self.p.rates == "states" or not dt > 0.0:
            return F
        gamma = float(x[k.GA])
        was_x, was_h = last
        rise = (wx - was_x) * math.cos(gamma) + (wh - was_h) * math.sin(gamma)
        return rise / (gravity * dt) - wh / float(x[k.VA])

    def step(self, F: float, dt: float, armed: bool = True, sink: float = 0.0) -> HazardState:
        """One sample of F and of its part that sinking air makes, -w_h/V, dt [s] since the last; a value that is not finite
        leaves everything as it is."""
        if not (math.isfinite(F) and math.isfinite(sink) and dt > 0.0):
            return self.state
        self._age += dt
        if self._age < self.p.settle_s:
            return self.state
        p, s = self.p, self.state
        quick = s.quick + (F - s.quick) * -math.expm1(-dt / p.caution_s)
        slow = s.slow + (F - s.slow) * -math.expm1(-dt / p.abort_s)
        self._sink += (sink - self._sink) * -math.expm1(-dt / p.sink_s)
        self._gain_s = p.gain_hold_s if slow < -p.gain_F else max(self._gain_s - dt, 0.0)
        caution = armed and (quick > p.caution_F or (s.caution and quick > p.release_F) or self._gain_s > 0.0)
        early = p.abort_on == "caution" or (p.gain_abort and self._gain_s > 0.0)
        sinks = 0.0 < p.sink_F < self._sink
        abort = s.abort or (armed and (slow > p.abort_F or (early and quick > p.caution_F) or sinks))
        self.cautions += caution and not s.caution
        self.state = HazardState(F, quick, slow, caution, abort)
        return self.state
