"""Which readings an estimator of an aircraft refuses, what it says of it, and what a dispute adds to the published uncertainty.

Every reading is judged by its innovation (filters.gate.GroupGate). A sensor that goes on disagreeing is kept out; from then on
the estimate holds nothing of it, so that comparing both is a comparison of witnesses. It comes back
- when it agrees again, for seconds, with what the estimate knew when it went: persistence of its own does not count;
- when witnesses of another kind (nav.witness) say that it is right: the estimate is opened by the size of the dispute;
- when nobody speaks against it and the estimate has become too uncertain to contradict it: under reservation.
While nobody can tell, and after a return under reservation, the dispute is part of the published sigma.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.filters.group_gate import LAST, OFFERED, RATIO, REFUSALS, REFUSED, STRAINED, TAKEN, GroupGate
from flightsw.strict import Range, changed
from flightsw.types import HF_AIR, HF_ATT, HF_GNSS, HF_IMU, HF_REL, Text

# WKF_READING
V, BETA, ALPHA, GYRO, ATT, GNSS_POS, GNSS_VEL, REL_POS, REL_VEL, WAKE, GNSS_DIFF, REL_RATE = range(12)
_DEG = 180.0 / math.pi
# name, factor and unit in texts, sensor in Health (0: an aid computed on board)
KINDS = (
    ("airspeed", 1.0, "m/s", HF_AIR), ("sideslip", _DEG, "deg", HF_AIR), ("incidence", _DEG, "deg", HF_AIR),
    ("gyro", _DEG, "deg/s", HF_IMU), ("attitude", _DEG, "deg", HF_ATT), ("GNSS position", 1.0, "m", HF_GNSS),
    ("GNSS velocity", 1.0, "m/s", HF_GNSS), ("relative position", 1.0, "m", HF_REL),
    ("relative velocity", 1.0, "m/s", HF_REL), ("wake position", 1.0, "m", 0), ("GNSS difference", 1.0, "m", 0),
    ("GNSS closure rate", 1.0, "m/s", 0),
)  # fmt: skip
AIR = (V, BETA, ALPHA)
AGAINST, UNDECIDED, FOR = -1, 0, 1
SAY_S = 10.0  # [s] between two texts on single refusals of a sensor
FAMILIES_MAX = 3  # sensors out at once from which the estimate is in doubt and not they
RESTARTS, PATIENCE_S = 3, 10.0  # restarts, each within [s] of the last, after which all is taken for that time
STRAIN_DECAY, STRAIN_MIN = 0.99, 1e-4  # [-] per step; [unit of the reading] below which it is over
DECIDE_S = 2.0  # [s] out before a return under reservation
DOUBT_SIGMA = 3.0  # [-] dispute within this many sigma of what is known: nothing speaks against the sensor any more

# sensor -> whose readings its own are the integral or the rate of, and at what error dead reckoning drifts
KINEMATIC = {
    ATT: (GYRO, 3e-4),
    GYRO: (ATT, 0.0),
    GNSS_POS: (GNSS_VEL, 0.03),
    GNSS_VEL: (GNSS_POS, 0.0),
    REL_VEL: (REL_POS, 0.0),
}

Prob = Annotated[float, Range(0.0, 0.1)]
Pos = Annotated[float, Range(1e-9)]
NonNeg = Annotated[float, Range(0.0)]
Factor = Annotated[float, Range(1.0)]


@dataclass(frozen=True)
class GateParams:
    """[nav.gate]: refusal of readings and what validity asks for."""

    false_alarm: Prob = 1e-6  # probability that one sound reading is refused; 0: nothing is judged
    loosen: Factor = 10.0  # on the process noise of air data not measured now: the model alone is 10 % off
    loose_rate: Pos = 0.1  # [rad/s] per sqrt(s) of body rates while attitude is not measured
    lift_sigma: Pos = 0.04  # [-] of lift, against the lift seen while the air data were good: 2 % of airspeed, 0.2 deg
    lift_error: Pos = 0.25  # [-] most the lift may differ from the model's; beyond, the first airspeed is not believed
    side_sigma: Pos = 0.2  # [m/s^2] of side force, likewise: 0.8 deg of sideslip
    peer_wind_sigma: Pos = 2.0  # [m/s] receiver only: of its wind from the tanker's, beside the wake
    samples: Annotated[int, Range(1, 1000)] = 8  # accepted of every sensor before the estimate is valid
    wind_sigma_max: Pos = 8.0  # [m/s] beyond: no wind is given out and the navigation is reported as failed
    pos_sigma_max: Pos = 100.0  # [m] beyond: reported as failed
    att_sigma_max: Pos = 0.05  # [rad] likewise
    silent_s: Annotated[float, Range(0.5, 60.0)] = 2.0  # [s] without any accepted reading: likewise
    turn_sigma: NonNeg = 5.0  # gyro against attitude reference: sigmas that count (sixdof/turning.py); 0: not compared

    def __post_init__(self) -> None:
        """Raises ValueError for a setting that nothing obeys."""
        if self.false_alarm == 0.0 and (idle := changed(self, GateParams(), ("false_alarm",))) is not None:
            raise ValueError(f"{idle[0]} = {idle[1]!r}: nothing obeys it with false_alarm = 0")


@dataclass(frozen=True, slots=True)
class AidStatus:
    """One sensor aid of an estimator as it stands. Counts are of readings, from the beginning on."""

    kind: int  # WKF_READING
    offered: int
    used: int
    refused: int  # by the gate; what is offered and neither was kept out by what went before
    kept_out: bool  # now
    age_s: float  # [s] since one was last used, or since the estimate began anew
    innovation: tuple[float, ...]  # [unit of the reading] of the last one, per channel; infinite: it was no number
    sigma: tuple[float, ...]  # [unit of the reading] 1-sigma of that as the filter and what it is not told of have it
    ratio: float  # [-] largest innovation of the last reading to what the gate allows; above 1 it is refused

    @property
    def name(self) -> str:
        """As in texts."""
        return KINDS[self.kind][0]


class Refusals:
    """Memory of one estimator's gate. The owner sets `t_us` every step and asks `judge` in every correction."""

    def __init__(self, p: GateParams, rows: int) -> None:
        """rows: measurements at most."""
        n = len(KINDS)
        self.p = p
        self.gate = GroupGate(n, rows, p.false_alarm, WAKE)
        self.gate.share(V, 1.0)
        self.t_us = self.judged_us = 0
        self.calm = True  # nobody is missed, refused, kept out or in dispute
        self.plain = True  # and nobody has come back under reservation
        self.verdict = [UNDECIDED] * n  # of the witnesses, on who is kept out
        self.reserved = [0.0] * n  # [unit of the reading] dispute at a return under reservation
        self.strained = [0.0] * n  # [unit of the reading] recent disagreement of what was taken all the same
        self.opened: list[int] = []  # groups taken back by the witnesses in this step: the owner opens the estimate
        self.texts: list[Text] = []
        self._held = [False] * n
        self._said_us = [-(10**12)] * n
        self._since_us = [0] * n
        self._restart_us, self._again, self._open_us = -(10**12), 0, 0

    def restart(self, t_us: int) -> None:
        """The estimate begins anew from its sensors: all are taken back, nothing is earned yet."""
        self._again = self._again + 1 if t_us - self._restart_us < PATIENCE_S * 1e6 else 0
        self._restart_us = t_us
        if self._again >= RESTARTS and t_us >= self._open_us:
            self._open_us = t_us + round(PATIENCE_S * 1e6)
            self._say(3, "sensors contradict each other: all are taken")
        self.gate.restart(t_us)
        self.judged_us = t_us
        n = len(KINDS)
        self.verdict, self.reserved, self.strained, self._held = [UNDECIDED] * n, [0.0] * n, [0.0] * n, [False] * n
        self.calm = self.plain = True

    # --- the correction ---------------------------------------------------------------------------------------------
    def judge(
        self, group: np.ndarray, nu: np.ndarray, Sy: np.ndarray, slack: np.ndarray, m: int, speed: float
    ) -> np.ndarray | None:  # fmt: skip
        """Positions below m that may correct; None: all. As filters.gate.sift; speed [m/s] makes gusts of flow angles."""
        g = self.gate
        g.share(BETA, speed)
        g.share(ALPHA, speed)
        g.taking = self.taking
        return self._judged(*g.kept(group, nu, Sy, slack, m, self.t_us))

    @property
    def taking(self) -> bool:
        """Whether nothing is refused for now."""
        return self.t_us < self._open_us

    def sifted(self, n: int, m: int) -> np.ndarray | None:
        """As `judge`, where the gate's `sift` has been called for the m rows and has returned n."""
        return self._judged(*self.gate.told(n, m))

    def _judged(self, keep: np.ndarray | None, quiet: bool) -> np.ndarray | None:
        self.judged_us = self.t_us
        if not (quiet and self.calm):
            self._follow()
            self.calm = quiet and not any(self._held) and not any(self.strained)
            self.plain = self.calm and not any(self.reserved)
        return keep

    def _witness(self, k: int) -> None:
        """A jump that a sensor's own rate or integral does not show is that sensor's, until dead reckoning has lost as much."""
        who, rate = KINEMATIC[k]
        if self._held[who] or self.age_s(who) > 1.0:
            self.verdict[k] = UNDECIDED
            return
        lost = rate * self.age_s(k)
        far = any(
            abs(d) > DOUBT_SIGMA * math.hypot(s, lost)
            for d, s in zip(self.gate.offsets(k), self.gate.sigmas(k), strict=True)
        )
        self.verdict[k] = AGAINST if far else UNDECIDED

    def _follow(self) -> None:
        """Texts, and returns other than by agreement."""
        bad = self.gate.bad
        for k, (name, scale, unit, _) in enumerate(KINDS):
            held, was = self.gate.held(k), self._held[k]
            off = abs(self.dispute(k))
            said = f"{off * scale:.1f} {unit}"
            if held and not was:
                self._since_us[k], self.verdict[k] = self.t_us, UNDECIDED
                self._say(4, f"{name} kept out: {said} off")
            elif was and not held:
                self._say(5, f"{name} back in use")
                self.reserved[k] = 0.0
            elif bad[k] >= STRAINED and not held and self.t_us - self._said_us[k] >= SAY_S * 1e6:
                self._said_us[k] = self.t_us
                self._say(5, f"{name} {'refused' if bad[k] == REFUSED else 'strained'}: {said} off")
            old = self.strained[k] * STRAIN_DECAY
            self.strained[k] = max(old, off) if bad[k] == STRAINED else old if old > STRAIN_MIN else 0.0
            if held and k in KINEMATIC:
                self._witness(k)
            if held and self.verdict[k] != AGAINST and self.t_us - self._since_us[k] > DECIDE_S * 1e6:
                held = not self._admit(k, said)
            self._held[k] = held

    def _admit(self, k: int, off: str) -> bool:
        """Take sensor k back if the witnesses are for it, or if nothing known contradicts it any more."""
        name = KINDS[k][0]
        if self.verdict[k] == FOR:
            self.opened.append(k)
            self._say(4, f"{name} back, {off}: borne out by others")
        else:
            if not self.gate.disagrees(k):
                return False  # on its way back by agreement
            d = np.abs(self.gate.offsets(k))
            if not ((d < DOUBT_SIGMA * self.gate.sigmas(k)).all() and self.gate.steady(k).any()):
                return False
            self.reserved[k] = float(d.max())
            self._say(4, f"{name} back, {off} in doubt")
        self.gate.admit(k)
        return True

    def _say(self, severity: int, text: str) -> None:
        self.texts.append(Text(severity, text[:50]))

    def keep_out(self, k: int) -> None:
        """Keep sensor k out on the word of the witnesses."""
        self.gate.keep_out(k)
        self.calm = self.plain = False

    # --- what others ask --------------------------------------------------------------------------------------------
    def held(self, k: int) -> bool:
        """Whether sensor k is kept out."""
        return self._held[k]

    def dispute(self, k: int) -> float:
        """Largest mean disagreement of a channel of sensor k [unit of the reading], with its sign; 0: none."""
        d = self.gate.offsets(k)
        return float(d[np.argmax(np.abs(d))])

    def doubt(self, k: int) -> float:
        """What the dispute over sensor k adds to a sigma [unit of the reading]."""
        d = max(self.reserved[k], self.strained[k])
        if self._held[k] and self.verdict[k] == UNDECIDED:
            d = max(d, float(np.abs(self.gate.offsets(k)[self.gate.steady(k)]).max(initial=0.0)))
        return d

    def age_s(self, k: int) -> float:
        """Time since a reading of sensor k was taken [s]."""
        return (self.t_us - float(self.gate.groups[k, LAST])) * 1e-6

    @property
    def silent_s(self) -> float:
        """Time since a reading of any sensor was taken [s]."""
        return (self.t_us - float(self.gate.groups[:, LAST].max())) * 1e-6

    def taken_now(self, k: int) -> bool:
        """Whether a reading of sensor k was taken in this step."""
        return bool(self.gate.groups[k, LAST] == self.t_us)

    def unmeasured(self, k: int) -> bool:
        """Whether sensor k is kept out or has not been heard for a second."""
        return not self.calm and (self._held[k] or self.age_s(k) > 1.0)

    @property
    def flags(self) -> int:
        """HF_* of the sensors kept out."""
        bits = 0
        if not self.calm:
            for k, kind in enumerate(KINDS):
                bits |= kind[3] if self._held[k] else 0
        return bits

    @property
    def mask(self) -> int:
        """Sensors kept out, bit = WKF_READING."""
        return 0 if self.calm else sum(1 << k for k in range(len(KINDS)) if self._held[k])

    @property
    def counts(self) -> tuple[int, ...]:
        """Readings refused so far, per WKF_READING."""
        return tuple(int(n) for n in self.gate.groups[:, REFUSALS].tolist())

    @property
    def ratios(self) -> tuple[float, ...]:
        """AidStatus.ratio of every sensor, per WKF_READING; 0: nothing offered."""
        return tuple(np.sqrt(self.gate.groups[:, RATIO]).tolist())

    def status(self, k: int) -> AidStatus:
        """Of sensor k."""
        g = self.gate
        offered, used, refused = (int(n) for n in g.groups[k, [OFFERED, TAKEN, REFUSALS]].tolist())
        ratio = math.sqrt(float(g.groups[k, RATIO]))
        innovation, sigma = tuple(g.innovations(k).tolist()), tuple(g.sigmas(k).tolist())
        return AidStatus(k, offered, used, refused, self._held[k], self.age_s(k), innovation, sigma, ratio)

    @property
    def aids(self) -> tuple[AidStatus, ...]:
        """Status of every aid that has offered a reading, in the order of WKF_READING."""
        return tuple(self.status(k) for k in np.flatnonzero(self.gate.groups[:, OFFERED]).tolist())

    @property
    def contradicted(self) -> bool:
        """Whether so many sensors are out that the estimate is in doubt and not they."""
        return self.flags.bit_count() >= FAMILIES_MAX

    def missing(self, *kinds: int) -> str:
        """Which sensor has not had enough readings taken yet, in words; empty: none."""
        for k in kinds:
            n = self.gate.accepted(k)
            if n < self.p.samples:
                return f"{KINDS[k][0]}: {n} of {self.p.samples} readings"
        return ""
