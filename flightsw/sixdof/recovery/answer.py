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
from flightsw.sixdof.recovery.answer_kernel import FOUND, MOTION, THRUST, follows, learn, looked, numbers
from flightsw.sixdof.recovery.readings import Readings
from flightsw.types import Text, Vec3

AILERON, ELEVATOR, RUDDER = range(3)
NAMES = ("aileron", "elevator", "rudder")
SHORT_S, LONG_S, MOTION_S, THRUST_S = 0.3, 1.0, 1.5, 5.0  # [s] windows of means; of what has been commanded
SIGMAS = 6.0  # of the mean of a window, as learnt
LEARN_S = 20.0  # [s]
LEAST = (math.radians(0.7), math.radians(0.5), math.radians(2.0))  # [rad] off that counts
# [-] of what was commanded to and fro: so wrong may the file's derivatives be, and so late a gyro that is not yet known to be
SHARE = (0.35, 0.25, 0.35)
LEAST_THRUST, SHARE_THRUST, LAZY = 0.08, 0.35, 0.7  # [-] of what is available; of its changes; of the file's spool
TWICE = 2  # steps in a row
DOUBTFUL = 0.5  # [-] of what is too far, beyond which nothing is learnt
SEEN, APART_S = 3.0, 2.0  # sigmas of the reference; [s] over which it is forgotten that gyro and reference were apart
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
        self._P, self._x = numbers(ac), np.zeros(MOTION)
        self._w: Vec3 = (0.0, 0.0, 0.0)
        self._known = False  # the rates of the step before are
        self._u = np.zeros(4)
        self._windows = np.array([max(round(T / dt_s), 2) for T in (SHORT_S, LONG_S)])
        self._recent, self._moves = round(MOTION_S / dt_s), tuple(max(round(T / dt_s), 5) for T in MOVES_S)
        self._slope, self._slope_sigma = np.zeros((2, 3)), np.zeros((2, 3))  # by window
        self._n = 0  # steps in the rings
        # controls by the vanes, by the forces, less what is believed
        self._off = np.zeros((max(int(self._windows[1]), *self._moves), 8))
        self._told = np.zeros((round(THRUST_S / dt_s), 4))  # that
        self._lasting, self._square, self._learnt_s = np.zeros(8), np.zeros((2, 8)), 0.0
        self._mean, self._found = np.zeros((2, 8)), np.zeros(FOUND)
        self._least, self._share = np.array([*LEAST, math.inf]), np.array([*SHARE, SHARE_THRUST])
        self._count = [0, 0, 0, 0]
        self._apart: Vec3 = (0.0, 0.0, 0.0)  # [rad] by which gyro and reference have been apart at most
        self._avail = 1.0  # [N] thrust there is
        self._slow = -1.0  # [N] that of an engine as slow as the file's spool; below 0: not known

    def step(self, s: Readings, u: np.ndarray, sound: bool, apart: tuple[Vec3, Vec3], dt: float) -> None:
        """u [4]: mean controls (surfaces rad, thrust N) believed to have acted over the dt [s] whose mean rates and forces s has;
        sound: nobody has found gyro or accelerometers wrong; apart: by how much the reference has turned more than the gyro about
        each axis over SHORT_S [rad], and one sigma of that."""
        before, self._w = self._w, s.w
        faded = max(1.0 - dt / APART_S, 0.0)
        (x, y, z), (roll, pitch, yaw) = apart[0], self._apart
        self._apart = (max(abs(x), faded * roll), max(abs(y), faded * pitch), max(abs(z), faded * yaw))
        if not sound or not s.V_measured or not self._known:
            self._slow = -1.0
            self._u[:] = u
            self._known, self._n, self._count = sound and s.V_measured, 0, [0, 0, 0, 0]
            return
        if self._n % len(self._off) == 0:  # no quicker than height and speed go
            self._avail = thrust_available(self.ac, s.h_m, s.V)
            self._least[THRUST] = LEAST_THRUST * self._avail
        thrust = 0.5 * (self._u.item(THRUST) + u.item(THRUST))
        forward, _, below = s.down
        self._x[:] = (
            *s.w, *before, *s.force, s.load, s.V, s.alpha, s.beta, 0.0, s.q, s.mass, *s.inertia, forward, below,
        )  # fmt: skip
        looked(
            self._x, self._P, dt, u, self._u, self._lag(thrust, dt), self._n, self._moves[0], self._off, self._told,
            self._windows, self._recent, self._lasting, self._square, self._least, SIGMAS, self._share, self._mean, self._found,
        )  # fmt: skip
        self._n += 1
        if self._n < self._moves[0]:
            return
        *over, aileron, elevator, rudder = self._found.tolist()
        self.at, most = (aileron, elevator, rudder), max(over)
        if most <= 1.0:
            self._count = [0, 0, 0, 0]
        else:
            missed = over[THRUST] > 1.0 and self._gathers(s)
            self._judge([*self._accused(s, over, apart), missed], over)
        if self.weak:
            self._recovers(thrust, dt)
        if self._learnt_s < LEARN_S or most < DOUBTFUL:
            self._learn(dt)

    def _lag(self, thrust: float, dt: float) -> float:
        """By how much [N] the file's slowest engine has another thrust by now than is believed: what is between is not off."""
        e = self.ac.engine
        if self._slow < 0.0 or e.spool_full_ps == 0.0:
            self._slow = thrust
        full = min(max(self._slow / self._avail, 0.0), 1.0)
        most = LAZY * (e.spool_idle_ps + (e.spool_full_ps - e.spool_idle_ps) * full) * self._avail * dt
        self._slow += min(max(thrust - self._slow, -most), most)
        return self._slow - thrust

    def _accused(self, s: Readings, over: list[float], apart: tuple[Vec3, Vec3]) -> list[bool]:
        """Of each surface whether it is too far off, does not follow its command (what balances a wake does), and would have
        made a turn over SHORT_S that the reference has seen too: more than that can miss, and more than it has lately turned
        otherwise than the gyro, as one that comes late is apart now and then only."""
        if max(over[:THRUST]) <= 1.0:
            return [False] * 3
        known = [k for k in range(2) if self._n >= self._moves[k]]
        for k in known:
            follows(self._off, self._n, self._told, self._moves[k], self._slope[k], self._slope_sigma[k])
        c, g = self.ac.aero, self.ac.geometry
        moments = (c.Cl_da * g.b_m, c.Cm_de * g.c_m, c.Cn_dr * g.b_m)
        out = []
        for j, (m, i) in enumerate(zip(moments, s.inertia, strict=True)):
            slopes = [(float(self._slope[k, j]), float(self._slope_sigma[k, j])) for k in known]
            still = any(x < STILL and x + CLEAR * sigma < MOVES for x, sigma in slopes)
            turned = 0.5 * SHORT_S**2 * abs(m * s.q * g.S_m2 / i * self._lasts(j))
            seen = turned > max(SEEN * apart[1][j], 2.0 * self._apart[j])
            out.append(over[j] > 1.0 and (still or over[j] > FAR) and seen)
        return out

    def _lasts(self, j: int) -> float:
        """Mean deflection [rad] that surface j has been off over SHORT_S, but for the step that was off most: a gyro that jumps
        is off in one, before the reference can tell."""
        w = int(self._windows[0])
        off = self._off[np.arange(self._n - w, self._n) % len(self._off), j] - self._lasting[j]
        return float(off.sum() - off[np.abs(off).argmax()]) / (w - 1)

    def _gathers(self, s: Readings) -> bool:
        """Whether the airspeed gathers as thrust that is off would have it: accelerometers that lie part from it."""
        gained = FELT_S * abs(float(self._mean[1, THRUST])) / s.mass
        return abs(s.V_beyond_felt) < max(gained, FELT_LEAST)

    def _judge(self, accused: list[bool], over: list[float]) -> None:
        """Who does not answer, once that is sure."""
        if self._learnt_s < LEARN_S:
            return
        for j, x in enumerate(accused):
            self._count[j] = self._count[j] + 1 if x else 0
        some = max(self._count[:THRUST]) >= TWICE
        worst = max(range(3), key=lambda j: over[j] * (self._count[j] >= TWICE)) if some else 0
        if self.failed < 0 and self._count[worst] >= TWICE:
            self.failed = worst
            deg = math.degrees(self.at[worst] - float(self._u[worst]))
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

    def _learn(self, dt: float) -> None:
        """What the file's numbers lack, and by how much the means of a window scatter."""
        self._learnt_s += dt
        gain = dt / min(self._learnt_s, LEARN_S)
        learn(self._off[(self._n - 1) % len(self._off)], self._mean, gain, self.weak, self._lasting, self._square)
