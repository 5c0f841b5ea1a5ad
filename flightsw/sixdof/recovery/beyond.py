"""What of its envelope an aircraft is beyond, for long enough that the protection has to take it (docs/sources/recovery.md 7)."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.jit import jit
from flightsw.sixdof.recovery.answer import NAMES, Answer
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.readings_kernel import (
    ALPHA,
    BELOW,
    BY_VANES,
    FORWARD,
    LOAD,
    MEASURED,
    PITCHING,
    RIGHT,
    ROLLING,
    SPEED,
    YAWING,
)  # fmt: skip
from flightsw.types import NavState

BANK_BEYOND, PITCH_BEYOND = math.radians(20.0), math.radians(25.0)  # [rad] above the file's largest bank; either way
ROLL, PITCH_RATE, YAW = (
    math.radians(60.0),
    math.radians(20.0),
    math.radians(20.0),
)  # [rad/s] station keeping rolls with 45 deg/s
SIDEWAYS = math.radians(60.0)  # [rad] of pitch beyond which it alone tells
# between a surface that does not answer and the estimate's attitude
WHAT = ("bank", "pitch", "incidence", "airspeed", "rates", "load", "navigation", "estimated")
# bits of what it is beyond; [s] before each counts; attitude has been judged
FAILED, BANK, PITCH, INCIDENCE, AIRSPEED, RATES, OVERLOAD, STRANGE, LOST, APART = (1 << k for k in range(10))
AFTER_S = (0.0, 0.0, 0.0, 0.3, 1.0, 0.1, 0.1, 1.0, 1.0, 1.0)


@jit
def fast(p: float, q: float, r: float) -> float:
    """Rates [rad/s] as a share of the most: of the axis about which that is largest."""
    return max(abs(p) / ROLL, abs(q) / PITCH_RATE, abs(r) / YAW)


@jit
def felt_beyond(
    x: np.ndarray, known: bool, V: float, alpha: float, p: float, q: float, r: float, inside: np.ndarray
) -> int:  # fmt: skip
    """Bits of what the aircraft is beyond by what is known of a step, x [BLOCK] (readings_kernel.py), and, of one alone a sensor
    may be the cause, by the estimate where it is known: V [m/s], alpha [rad], rates p, q, r [rad/s]. inside [6]: largest bank
    and incidence [rad], slowest and fastest [m/s], lowest and highest load factor [-]."""
    out, sine = 0, x[FORWARD]
    banked, top, slow, fastest, low, high = inside[0], inside[1], inside[2], inside[3], inside[4], inside[5]
    pitch = abs(math.asin(-1.0 if sine < -1.0 else 1.0 if sine > 1.0 else sine))
    if abs(math.atan2(x[RIGHT], x[BELOW])) > banked and pitch < SIDEWAYS:
        out |= BANK
    if pitch > PITCH_BEYOND:
        out |= PITCH
    if x[BY_VANES] != 0.0 and abs(x[ALPHA]) > top and (not known or abs(alpha) > top):
        out |= INCIDENCE
    if x[MEASURED] != 0.0:
        if x[SPEED] < slow and (not known or slow > V):
            out |= AIRSPEED
        if x[SPEED] > fastest and (not known or fastest < V):
            out |= AIRSPEED
    if fast(x[ROLLING], x[PITCHING], x[YAWING]) > 1.0 and (not known or fast(p, q, r) > 1.0):
        out |= RATES
    if not (known or low < x[LOAD] < high):
        out |= OVERLOAD
    return out


class Beyond:
    """One aircraft's. `step` it whenever the protection may take or keep the command."""

    def __init__(self, ac: Aircraft, load: tuple[float, float]) -> None:
        """load: least and largest load factor [-] that is inside."""
        limits = ac.limits
        banked, top = math.radians(limits.bank_max_deg) + BANK_BEYOND, math.radians(limits.alpha_max_deg)
        self._inside = np.array([banked, top, limits.V_min_mps, limits.V_max_mps, *load])
        self._since: dict[str, float] = {}  # [s] for which it has been beyond something
        self.was_valid = False  # navigation has been

    def clear(self) -> None:
        """Begin to count again."""
        self._since.clear()

    def step(
        self, s: Readings, nav: NavState, answer: Answer, apart: bool, strange: str, dt: float, lost: bool = True
    ) -> str:
        """What the aircraft is beyond, dt [s] after the last; "" inside. apart: the estimate's attitude is not the sensors';
        strange: why the law cannot fly from here; lost: navigation that is lost counts."""
        known, since = nav.valid, self._since
        seen = felt_beyond(s.x, known, nav.V, nav.alpha, *nav.w_b, self._inside)
        if answer.failed >= 0:
            seen |= FAILED
        if strange:
            seen |= STRANGE
        if lost and self.was_valid and not known:
            seen |= LOST
        if apart:
            seen |= APART
        if not seen and not since:
            return ""
        names = (NAMES[answer.failed], *WHAT[:6], strange.partition(" ")[0], *WHAT[6:])
        for k, (after, what) in enumerate(zip(AFTER_S, names, strict=True)):
            if not seen >> k & 1:
                since.pop(what, None)
                continue
            since[what] = since.get(what, 0.0) + dt
            if since[what] > after:
                return _words(s, NAMES[answer.failed], strange)[k]
        return ""


def _words(s: Readings, failed: str, strange: str) -> tuple[str, ...]:
    """What is said of each; they cost more than finding out, and are asked for once."""
    deg, (x, y, z) = math.degrees, s.down
    bank, pitch = math.atan2(y, z), -math.asin(min(max(x, -1.0), 1.0))
    return (
        f"{failed} does not answer",
        f"bank {deg(bank):.0f} deg",
        f"pitch {deg(pitch):.0f} deg",
        f"incidence {deg(s.alpha):.0f} deg",
        f"airspeed {s.V:.0f} m/s",
        "rates " + ", ".join(f"{deg(x):.0f}" for x in s.w) + " deg/s",
        f"load {s.load:.1f}",
        strange,
        "navigation lost",
        "estimated attitude not that of the sensors",
    )
