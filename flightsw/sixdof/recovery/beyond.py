"""What of its envelope an aircraft is beyond, for long enough that the protection has to take it (docs/sources/recovery.md 7)."""

from __future__ import annotations

import math

from flightsw.aircraft import Aircraft
from flightsw.sixdof.recovery.answer import NAMES, Answer
from flightsw.sixdof.recovery.readings import Readings
from flightsw.types import NavState, Vec3

BANK_BEYOND, PITCH_BEYOND = math.radians(20.0), math.radians(25.0)  # [rad] above the file's largest bank; either way
ROLL, PITCH, YAW = (
    math.radians(60.0),
    math.radians(20.0),
    math.radians(20.0),
)  # [rad/s] station keeping rolls with 45 deg/s
SIDEWAYS = math.radians(60.0)  # [rad] of pitch beyond which it alone tells
# between a surface that does not answer and the estimate's attitude
WHAT = ("bank", "pitch", "incidence", "airspeed", "rates", "load", "navigation", "estimated")
# [s] before each counts; attitude has been judged
AFTER_S = (0.0, 0.0, 0.0, 0.3, 1.0, 0.1, 0.1, 1.0, 1.0, 1.0)


class Beyond:
    """One aircraft's. `step` it whenever the protection may take or keep the command."""

    def __init__(self, ac: Aircraft, load: tuple[float, float]) -> None:
        """load: least and largest load factor [-] that is inside."""
        self._limits, self._load = ac.limits, load
        self._top, self._banked = math.radians(ac.limits.alpha_max_deg), math.radians(ac.limits.bank_max_deg)
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
        limits, top, known, since = self._limits, self._top, nav.valid, self._since
        x, y, z = s.down
        bank, pitch = math.atan2(y, z), -math.asin(min(max(x, -1.0), 1.0))
        # of one alone a sensor may be the cause
        over = min(_fast(s.w), _fast(nav.w_b)) if known else _fast(s.w)
        slowest, fastest = (min(s.V, nav.V), max(s.V, nav.V)) if known else (s.V, s.V)
        seen = (
            answer.failed >= 0,
            abs(bank) > self._banked + BANK_BEYOND and abs(pitch) < SIDEWAYS,
            abs(pitch) > PITCH_BEYOND,
            s.alpha_measured and abs(s.alpha) > top and (not known or abs(nav.alpha) > top),
            s.V_measured and (fastest < limits.V_min_mps or slowest > limits.V_max_mps),
            over > 1.0,
            not (known or self._load[0] < s.load < self._load[1]),
            strange != "",
            lost and self.was_valid and not known,
            apart,
        )
        if True not in seen and not since:
            return ""
        names = (NAMES[answer.failed], *WHAT[:6], strange.partition(" ")[0], *WHAT[6:])
        for k, (beyond, after, what) in enumerate(zip(seen, AFTER_S, names, strict=True)):
            if not beyond:
                since.pop(what, None)
                continue
            since[what] = since.get(what, 0.0) + dt
            if since[what] > after:
                return _words(s, NAMES[answer.failed], bank, pitch, strange)[k]
        return ""


def _fast(w: Vec3) -> float:
    """Rates [3] rad/s as a share of the most: of the axis about which that is largest."""
    p, q, r = w
    return max(abs(p) / ROLL, abs(q) / PITCH, abs(r) / YAW)


def _words(s: Readings, failed: str, bank: float, pitch: float, strange: str) -> tuple[str, ...]:
    """What is said of each; they cost more than finding out, and are asked for once."""
    deg = math.degrees
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
