"""Whether surfaces and thrust answer: what would explain the motion that is felt, against what is believed of them
(docs/sources/recovery.md 11).

A surface that is stuck, runs away, floats or is slow shows as a moment its servo's command does not give. Which deflection does
is solved for twice, with incidence and sideslip by the vanes and by the forces: a vane that lies accuses no surface, nor does
a gyro that the attitude reference contradicts.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.atmosphere import G0
from flightsw.sixdof.actuators import thrust_available
from flightsw.sixdof.recovery.readings import Readings
from flightsw.types import Text, Vec3

AILERON, ELEVATOR, RUDDER, THRUST = range(4)
NAMES = ("aileron", "elevator", "rudder")
SHORT_S, LONG_S, MOTION_S, THRUST_S = 0.3, 1.0, 1.5, 5.0  # [s] windows of means; of what has been commanded
SIGMAS = 6.0  # of the mean of a window, as learnt
LEARN_S = 20.0  # [s]
LEAST = (math.radians(0.7), math.radians(0.5), math.radians(2.0))  # [rad] off that counts
SHARE = 0.35  # [-] of what was commanded to and fro: so wrong may the file's derivatives be
LEAST_THRUST, SHARE_THRUST = 0.08, 0.5  # [-] of what is available; of its changes: engines lag by more than believed
TWICE = 2  # steps in a row
DOUBTFUL = 0.5  # [-] of what is too far, beyond which nothing is learnt
SEEN = 3.0  # sigmas of the reference


class Answer:
    """One aircraft's. `at` [3]: deflections [rad] that explain the motion; `failed`: surface that does not answer, -1 none."""

    def __init__(self, ac: Aircraft, dt_s: float) -> None:
        """dt_s [s]: between two steps."""
        self.ac = ac
        self.at: Vec3 = (0.0, 0.0, 0.0)
        self.failed = -1
        self.weak = False  # thrust is not what is commanded
        self.texts: list[Text] = []
        self._w: Vec3 | None = None
        self._u = np.zeros(4)
        c = ac.aero
        # moments and side force of aileron, rudder, sideslip; lift and moment of incidence, elevator
        self._lateral = np.linalg.inv(
            np.array([[c.Cl_da, c.Cl_dr, c.Cl_beta], [c.Cn_da, c.Cn_dr, c.Cn_beta], [0.0, c.CY_dr, c.CY_beta]])
        )
        self._n = tuple(max(round(T / dt_s), 2) for T in (SHORT_S, LONG_S))
        self._off: deque[np.ndarray] = deque(maxlen=self._n[1])  # [8]: controls by the vanes, by the forces
        self._told: deque[np.ndarray] = deque(maxlen=round(THRUST_S / dt_s))  # [4] controls believed
        self._recent = round(MOTION_S / dt_s)
        self._lasting, self._learnt_s = np.zeros(8), 0.0
        self._square = np.zeros((2, 8))
        self._count = [0, 0, 0, 0]

    def step(self, s: Readings, u: np.ndarray, sound: bool, apart: tuple[Vec3, Vec3], dt: float) -> None:
        """u [4]: mean controls (surfaces rad, thrust N) believed to have acted over the dt [s] whose mean rates and forces s has;
        sound: nobody has found gyro or accelerometers wrong; apart: by how much the reference has turned more than the gyro about
        each axis over SHORT_S [rad], and one sigma of that."""
        before, self._w = self._w, s.w
        acted, self._u = 0.5 * (self._u + u), u.copy()
        if not sound or before is None or not s.V_measured:
            self._off.clear()
            self._count = [0, 0, 0, 0]
            return
        self._off.append(self._explained(s, before, dt) - np.concatenate((acted, acted)))
        self._told.append(acted)
        if len(self._off) < self._n[0]:
            return
        means = [np.mean(list(self._off)[-n:], axis=0) - self._lasting for n in self._n if len(self._off) >= n]
        near = means[0]
        self.at = (float(acted[0] + near[0]), float(acted[1] + near[1]), float(acted[2] + near[2]))
        over = self._beyond(s, means)
        self._judge(over, self._witnessed(s, near, apart), means[-1])
        if self._learnt_s < LEARN_S or max(over) < DOUBTFUL:
            self._learn(means, dt)

    def _witnessed(self, s: Readings, off: np.ndarray, apart: tuple[Vec3, Vec3]) -> list[bool]:
        """Of each surface whether the turn it would have made over SHORT_S is one the reference has seen too: more than that can
        miss, and more than it has turned otherwise than the gyro."""
        c, g = self.ac.aero, self.ac.geometry
        moments = (c.Cl_da * g.b_m, c.Cm_de * g.c_m, c.Cn_dr * g.b_m)
        out = []
        for j, (m, i) in enumerate(zip(moments, s.inertia, strict=True)):
            turned = 0.5 * SHORT_S**2 * abs(m * s.q * g.S_m2 / i * float(off[j]))
            out.append(turned > max(SEEN * apart[1][j], 2.0 * abs(apart[0][j])))
        return out

    def _explained(self, s: Readings, before: Vec3, dt: float) -> np.ndarray:
        """[8]: aileron, elevator, rudder [rad] and thrust [N] by the vanes, the same by the forces."""
        c, g = self.ac.aero, self.ac.geometry
        qS, (ixx, iyy, izz) = s.q * g.S_m2, s.inertia
        p, q, r = (0.5 * (a + b) for a, b in zip(s.w, before, strict=True))
        pd, qd, rd = ((a - b) / dt for a, b in zip(s.w, before, strict=True))
        hb, hc = 0.5 * g.b_m / s.V, 0.5 * g.c_m / s.V
        roll = (ixx * pd - (iyy - izz) * q * r) / (qS * g.b_m) - hb * (c.Cl_p * p + c.Cl_r * r)
        yaw = (izz * rd - (ixx - iyy) * p * q) / (qS * g.b_m) - hb * (c.Cn_p * p + c.Cn_r * r)
        pitch = (iyy * qd - (izz - ixx) * p * r) / (qS * g.c_m) - c.Cm0 - hc * (c.Cm_q * q + c.Cm_alphadot * s.swing)
        CL = s.load * s.mass * G0 / qS
        side = s.force[1] * s.mass / qS
        det = c.Cl_da * c.Cn_dr - c.Cl_dr * c.Cn_da
        x, y = roll - c.Cl_beta * s.beta, yaw - c.Cn_beta * s.beta
        elevator = (c.CL_alpha * pitch - c.Cm_alpha * (CL - c.CL0)) / (c.CL_alpha * c.Cm_de - c.Cm_alpha * c.CL_de)
        drag = c.CD0 + c.K * CL * CL
        by_lift = (CL - c.CL0) / c.CL_alpha
        thrust = [s.mass * s.force[0] - qS * (CL * math.sin(a) - drag * math.cos(a)) for a in (s.alpha, by_lift)]
        by_forces = self._lateral @ np.array([roll, yaw, side])
        return np.array([
            (x * c.Cn_dr - y * c.Cl_dr) / det, (pitch - c.Cm_alpha * s.alpha) / c.Cm_de, (y * c.Cl_da - x * c.Cn_da) / det,
            thrust[0], by_forces[0], elevator, by_forces[1], thrust[1],
        ])  # fmt: skip

    def _beyond(self, s: Readings, means: list[np.ndarray]) -> list[float]:
        """Of each control, how many times it is as far off as it may be."""
        told = np.array(self._told)
        moved = np.ptp(told[-self._recent :, :3], axis=0)
        out = [
            max(self._over(j, m, k, max(LEAST[j], SHARE * float(moved[j]))) for k, m in enumerate(means))
            for j in range(3)
        ]
        least = max(LEAST_THRUST * thrust_available(self.ac, s.h_m, s.V), SHARE_THRUST * float(np.ptp(told[:, 3])))
        return [*out, self._over(THRUST, means[-1], len(means) - 1, least)]

    def _judge(self, over: list[float], seen: list[bool], off: np.ndarray) -> None:
        """Who does not answer, once that is sure. off [8]: mean over the long window."""
        if self._learnt_s < LEARN_S:
            return
        for j, x in enumerate(over):
            self._count[j] = self._count[j] + 1 if x > 1.0 and (j == THRUST or seen[j]) else 0
        worst = max(range(3), key=lambda j: over[j] * (self._count[j] >= TWICE))
        if self.failed < 0 and self._count[worst] >= TWICE:
            self.failed = worst
            deg = math.degrees(self.at[worst] - float(self._u[worst]))
            self.texts.append(Text(3, f"{NAMES[worst]} does not answer: {deg:+.0f} deg"))
        if self._count[THRUST] >= self._n[1] and not self.weak and self.failed < 0:
            self.weak = True
            self.texts.append(Text(3, f"thrust {off[THRUST] / 1e3:+.1f} kN off"))

    def _over(self, j: int, mean: np.ndarray, window: int, least: float) -> float:
        """How many times a control is as far off as may be; 0 where vanes and forces do not say the same."""
        sigma = np.sqrt(self._square[window])
        a, b = float(mean[j]), float(mean[j + 4])
        if a * b <= 0.0:
            return 0.0
        return min(abs(a) / max(least, SIGMAS * sigma[j]), abs(b) / max(least, SIGMAS * sigma[j + 4]))

    def _learn(self, means: list[np.ndarray], dt: float) -> None:
        """What the file's numbers lack, and by how much the means of a window scatter."""
        self._learnt_s += dt
        gain = dt / min(self._learnt_s, LEARN_S)
        self._lasting += gain * (self._off[-1] - self._lasting)
        for k, m in enumerate(means):
            self._square[k] += gain * (m**2 - self._square[k])
