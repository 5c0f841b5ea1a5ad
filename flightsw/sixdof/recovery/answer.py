"""Whether surfaces and thrust answer: what would explain the motion that is felt, against what is believed of them
(docs/sources/recovery.md 11).

A surface that is stuck, runs away, floats or is slow shows as a moment its servo's command does not give. Which deflection does
is solved for twice, with incidence and sideslip by the vanes and by the forces: a vane that lies accuses no surface, nor does
a gyro that the attitude reference contradicts.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.sixdof.actuators import thrust_available
from flightsw.sixdof.recovery import answer_kernel as ak
from flightsw.sixdof.recovery.answer_kernel import LEARN_S, THRUST
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.turning import Turning
from flightsw.types import ZERO3, Text, Vec3

AILERON, ELEVATOR, RUDDER = range(3)
NAMES = ("aileron", "elevator", "rudder")
SHORT_S, LONG_S, MOTION_S, THRUST_S = 0.3, 1.0, 1.5, 5.0  # [s] windows of means; of what has been commanded
LEAST = (math.radians(0.7), math.radians(0.5), math.radians(2.0))  # [rad] off that counts
# [-] of what was commanded to and fro: so wrong may the file's derivatives be, and so late a gyro that is not yet known to be
SHARE = (0.35, 0.25, 0.35)
LEAST_THRUST, SHARE_THRUST = 0.08, 0.35  # [-] of what is available; of its changes
TWICE = 2  # steps in a row
SEEN = 3.0  # sigmas of the reference
MOVES_S = (0.6, 1.2)  # [s] windows of movement
STILL, MOVES = -0.4, -0.25  # [-] slope of what stands still, and that it has to be CLEAR sigmas clear of
CLEAR = 1.5
FAR = 3.0  # [-] of what is too far off, beyond which it does not matter how it moves
AGAIN_S = 5.0  # [s] in which thrust is there that was missed
FELT_S, FELT_LEAST = 1.0, 1.0  # [s] of the acceleration, by which airspeed and accelerometers may part; [m/s] at least


class Answer:
    """One aircraft's. `at` [3]: deflections [rad] that explain the motion; `failed`: surface that does not answer, -1 none."""

    def __init__(self, ac: Aircraft, dt_s: float) -> None:
        """dt_s [s]: between two steps."""
        self.ac = ac
        self.at: Vec3 = (0.0, 0.0, 0.0)
        self.failed = -1
        self.weak = False  # thrust is not what is commanded
        self._missed = (1.0, 1.0)  # [N] commanded and there when it was not
        self._again_s = 0.0  # for which it has been there
        self.texts: list[Text] = []
        self._P, self._m = ak.numbers(ac), np.zeros(ak.MEMORY)
        self._m[ak.LEAST : ak.APART] = *LEAST, math.inf, *SHARE, SHARE_THRUST
        self._m[[ak.SLOW, ak.AVAILABLE]] = -1.0, 1.0
        self._known = False  # the rates of the step before are
        self._windows = np.array([max(round(T / dt_s), 2) for T in (SHORT_S, LONG_S)])
        self._recent, self._moves = round(MOTION_S / dt_s), tuple(max(round(T / dt_s), 5) for T in MOVES_S)
        self._slope, self._slope_sigma = np.zeros((2, 3)), np.zeros((2, 3))  # by window
        self._n = 0  # steps in the rings
        # controls by the vanes, by the forces, less what is believed
        self._off = np.zeros((max(int(self._windows[1]), *self._moves), 8))
        self._told = np.zeros((round(THRUST_S / dt_s), 4))  # that
        self._square, self._mean, self._over = np.zeros((2, 8)), np.zeros((2, 8)), np.zeros(4)
        self._count = [0, 0, 0, 0]
        self._avail = 1.0  # [N] thrust there is

    def step(self, s: Readings, u: np.ndarray, sound: bool, turning: Turning | None, dt: float) -> None:
        """u [4]: mean controls (surfaces rad, thrust N) believed to have acted over the dt [s] whose mean rates and forces s has;
        sound: nobody has found gyro or accelerometers wrong; turning: which compares gyro and attitude reference."""
        more = ZERO3 if turning is None else turning.more
        if not sound or not s.V_measured or not self._known:
            ak.parted(*more, dt, self._m)
            self._m[ak.SLOW] = -1.0
            self._m[ak.LAST : ak.LASTING] = u
            self._known, self._n, self._count = sound and s.V_measured, 0, [0, 0, 0, 0]
            return
        if self._n % len(self._off) == 0:  # no quicker than height and speed go
            self._avail = self._m[ak.AVAILABLE] = thrust_available(self.ac, s.h_m, s.V)
            self._m[ak.LEAST + THRUST] = LEAST_THRUST * self._avail
        most, aileron, elevator, rudder = ak.looked(
            s.x, self._P, dt, u, self._n, self._moves[0], self._off, self._told, self._windows, self._recent, self._m,
            self._square, self.weak, self._mean, self._over, *more,
        )  # fmt: skip
        self._n += 1
        if most < 0.0:
            return
        self.at = aileron, elevator, rudder
        if most <= 1.0:
            self._count = [0, 0, 0, 0]
            if not self.weak:
                return
        else:
            over = self._over.tolist()
            missed = over[THRUST] > 1.0 and self._gathers(s)
            self._judge([*self._accused(s, over, turning), missed], over)
        k = self._n - 1
        if self.weak:
            self._recovers(self._told.item(k % len(self._told), THRUST), dt)
        ak.learnt(self._off[k % len(self._off)], self._mean, most, self.weak, dt, self._m, self._square)

    def _accused(self, s: Readings, over: list[float], turning: Turning | None) -> list[bool]:
        """Of each surface whether it is too far off, does not follow its command (what balances a wake does), and would have
        made a turn over SHORT_S that the reference has seen too: more than that can miss, and more than it has lately turned
        otherwise than the gyro, as one that comes late is apart now and then only."""
        if max(over[:THRUST]) <= 1.0:
            return [False] * 3
        sigmas = ZERO3 if turning is None else turning.lately()[1]
        apart = self._m[ak.APART : ak.SLOW].tolist()
        known = [k for k in range(2) if self._n >= self._moves[k]]
        for k in known:
            ak.follows(self._off, self._n, self._told, self._moves[k], self._slope[k], self._slope_sigma[k])
        c, g = self.ac.aero, self.ac.geometry
        moments = (c.Cl_da * g.b_m, c.Cm_de * g.c_m, c.Cn_dr * g.b_m)
        out = []
        for j, (m, i) in enumerate(zip(moments, s.inertia, strict=True)):
            slopes = [(float(self._slope[k, j]), float(self._slope_sigma[k, j])) for k in known]
            still = any(x < STILL and x + CLEAR * sigma < MOVES for x, sigma in slopes)
            turned = 0.5 * SHORT_S**2 * abs(m * s.q * g.S_m2 / i * self._lasts(j))
            seen = turned > max(SEEN * sigmas[j], 2.0 * apart[j])
            out.append(over[j] > 1.0 and (still or over[j] > FAR) and seen)
        return out

    def _lasts(self, j: int) -> float:
        """Mean deflection [rad] that surface j has been off over SHORT_S, but for the step that was off most: a gyro that jumps
        is off in one, before the reference can tell."""
        w = int(self._windows[0])
        off = self._off[np.arange(self._n - w, self._n) % len(self._off), j] - self._m[ak.LASTING + j]
        return float(off.sum() - off[np.abs(off).argmax()]) / (w - 1)

    def _gathers(self, s: Readings) -> bool:
        """Whether the airspeed gathers as thrust that is off would have it: accelerometers that lie part from it."""
        gained = FELT_S * abs(float(self._mean[1, THRUST])) / s.mass
        return abs(s.V_beyond_felt) < max(gained, FELT_LEAST)

    def _judge(self, accused: list[bool], over: list[float]) -> None:
        """Who does not answer, once that is sure."""
        if self._m[ak.LEARNT_S] < LEARN_S:
            return
        for j, x in enumerate(accused):
            self._count[j] = self._count[j] + 1 if x else 0
        some = max(self._count[:THRUST]) >= TWICE
        worst = max(range(3), key=lambda j: over[j] * (self._count[j] >= TWICE)) if some else 0
        if self.failed < 0 and self._count[worst] >= TWICE:
            self.failed = worst
            deg = math.degrees(self.at[worst] - self._m.item(ak.LAST + worst))
            self.texts.append(Text(3, f"{NAMES[worst]} does not answer: {deg:+.0f} deg"))
        if self._count[THRUST] >= self._windows[1] and not self.weak and self.failed < 0:
            lately = np.arange(self._n - self._windows[1], self._n) % len(self._told)
            at, off = max(float(self._told[lately, THRUST].mean()), 1.0), float(self._mean[1, THRUST])
            self.weak, self._missed, self._again_s = True, (at, at + off), 0.0
            self.texts.append(Text(3, f"thrust {off / 1e3:+.1f} kN off"))

    @property
    def surplus(self) -> bool:
        """Whether there is more thrust than is commanded."""
        return self.weak and self._missed[1] > self._missed[0]

    def _recovers(self, thrust: float, dt: float) -> None:
        """Takes back what has been said of the thrust [N] once less than half is off of what a share that is lost, and thrust
        that stays where it was, would still leave off; both of them enough to tell."""
        at, was = self._missed
        off = abs(float(self._mean[1, THRUST]))
        left = min(abs(was / at - 1.0) * thrust, abs(was - thrust))
        if off > 0.5 * max(left, LEAST_THRUST * self._avail):
            self._again_s = 0.0
        elif left > LEAST_THRUST * self._avail:
            self._again_s += dt
        if self._again_s > AGAIN_S:
            self.weak = False
            self.texts.append(Text(5, "thrust is what is commanded again"))
