"""What of its envelope an aircraft is beyond, for long enough that the protection has to take it (docs/sources/recovery.md 7)."""

from __future__ import annotations

import math

from flightsw.aircraft import Aircraft
from flightsw.sixdof.recovery.answer import NAMES, Answer
from flightsw.sixdof.recovery.readings import Readings
from flightsw.types import NavState

BANK_BEYOND, PITCH_BEYOND = math.radians(20.0), math.radians(25.0)  # [rad] above the file's largest bank; either way
ROLL, PITCH, YAW = (
    math.radians(60.0),
    math.radians(20.0),
    math.radians(20.0),
)  # [rad/s] station keeping rolls with 45 deg/s
SIDEWAYS = math.radians(60.0)  # [rad] of pitch beyond which it alone tells
# [s] before it counts; attitude has been judged
ATTITUDE_S, MOTION_S, FLOW_S, SPEED_S, LOST_S, APART_S = 0.0, 0.1, 0.3, 1.0, 1.0, 1.0


class Beyond:
    """One aircraft's. `step` it whenever the protection may take or keep the command."""

    def __init__(self, ac: Aircraft, load: tuple[float, float]) -> None:
        """load: least and largest load factor [-] that is inside."""
        self.ac, self._load = ac, load
        self._since: dict[str, float] = {}
        self.was_valid = False  # navigation has been

    def clear(self) -> None:
        """Begin to count again."""
        self._since.clear()

    def step(
        self, s: Readings, nav: NavState, answer: Answer, apart: bool, strange: str, dt: float, lost: bool = True
    ) -> str:
        """What the aircraft is beyond, dt [s] after the last; "" inside. apart: the estimate's attitude is not the sensors';
        strange: why the law cannot fly from here; lost: navigation that is lost counts."""
        limits = self.ac.limits
        bank, pitch = math.atan2(s.down[1], s.down[2]), -math.asin(min(max(s.down[0], -1.0), 1.0))
        top = math.radians(limits.alpha_max_deg)
        alike = not nav.valid or abs(nav.alpha) > top
        # of one alone a sensor may be the cause
        speeds, turning = ((s.V, nav.V), (s.w, nav.w_b)) if nav.valid else ((s.V,), (s.w,))
        over = min(max(abs(p) / ROLL, abs(q) / PITCH, abs(r) / YAW) for p, q, r in turning)
        off = s.V_measured and (max(speeds) < limits.V_min_mps or min(speeds) > limits.V_max_mps)
        seen = (
            (answer.failed >= 0, ATTITUDE_S, NAMES[answer.failed]),
            (abs(bank) > math.radians(limits.bank_max_deg) + BANK_BEYOND and abs(pitch) < SIDEWAYS, ATTITUDE_S, "bank"),
            (abs(pitch) > PITCH_BEYOND, ATTITUDE_S, "pitch"),
            (s.alpha_measured and abs(s.alpha) > top and alike, FLOW_S, "incidence"),
            (off, SPEED_S, "airspeed"),
            (over > 1.0, MOTION_S, "rates"),
            (not (nav.valid or self._load[0] < s.load < self._load[1]), MOTION_S, "load"),
            (bool(strange), LOST_S, strange.partition(" ")[0]),
            (lost and self.was_valid and not nav.valid, LOST_S, "navigation"),
            (apart, APART_S, "estimated"),
        )
        since = self._since
        for k, (beyond, after, what) in enumerate(seen):
            since[what] = since.get(what, 0.0) + dt if beyond else 0.0
            if since[what] > after:
                return _words(s, NAMES[answer.failed], bank, pitch, strange)[k]
        return ""


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
