"""The tanker as the receiver knows it: the last data-link sample, carried forward to any time asked for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import dcm_from_euler, dcm_from_quat, euler_from_dcm, rotate_dcm
from flightsw.sixdof.layout import TK_P, TK_PD, TK_Q, TK_R, TK_VN
from flightsw.types import HF_ROUGH, ZERO3, PeerState

ROLL_OUT = 0.087  # [rad/s] roll rate of the virtual tanker
LEVEL_RAD = math.radians(4.0)  # [rad] bank below which a tanker is taken to fly straight
STEER_S = 1.0  # [s] time constant with which a virtual tanker takes up the velocity seen by the relative sensor
REJOIN_M = 60.0  # [m] and
REJOIN_MPS = 5.0  # [m/s] within which a returning tanker is taken up again


@jit
def carried(R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float, tk: np.ndarray) -> None:
    """tk [18] <- stage dt [s] after the sample R [9] NED to body, w [3] body rates, v [3], a [3] NED."""
    rotate_dcm(R, w, dt, tk[:TK_P])
    for i in range(3):
        tk[TK_P + i] = w[i]
        tk[TK_PD + i] = 0.0
        tk[TK_VN + i] = v[i] + a[i] * dt


def turn_rate(tk: Sequence[float]) -> float:
    """psi_dot [rad/s] of a stage tk [18]: (q sin phi + r cos phi) / cos theta."""
    sin_theta = -tk[2]
    # sin phi cos theta = R[5], cos phi cos theta = R[8]
    return (tk[TK_Q] * tk[5] + tk[TK_R] * tk[8]) / max(1.0 - sin_theta * sin_theta, 0.1)


class PeerTracker:
    """Holds one sample of another aircraft's estimate and extrapolates it with its own rates and acceleration."""

    def __init__(self) -> None:
        self.t_us = self.sample_us = -1
        self._R, self._w = np.zeros(9), np.zeros(3)
        self._v, self._a, self._pos = np.zeros(3), np.zeros(3), np.zeros(3)
        self._wind = np.zeros(3)
        self._q, self._e, self._Rn = np.zeros(4), np.zeros(3), np.zeros(9)
        self.pos_sigma, self.wind_valid = ZERO3, False
        self.rough = False  # its air is rougher than refuelling bears
        self.coasting = False
        self.level = False  # of a coasting tanker: its wings were level when the link went

    def take(self, p: PeerState) -> None:
        """Accept a newer sample; an older or repeated one is ignored."""
        if p.t_us <= self.sample_us or (self.coasting and not self.agrees(p)):
            return
        self.t_us = self.sample_us = p.t_us
        self._q[:] = p.q_nb
        dcm_from_quat(self._q, self._R)
        self._w[:], self._v[:], self._a[:], self._pos[:] = p.w_b, p.vel_n, p.acc_n, p.pos_n
        self._wind[:] = p.wind_n
        self.pos_sigma, self.wind_valid, self.rough = p.pos_sigma, p.wind_valid, bool(p.flags & HF_ROUGH)
        self.coasting = False

    def coast(self, t_us: int) -> None:
        """The link is gone: carry a virtual tanker to `t_us` that rolls its wings level and flies straight on.

        Continuous with the last sample in position, velocity and attitude, so that the receiver breaks away in a frame that
        neither jumps nor swings. Call it every step while the data are missing.
        """
        if self.t_us < 0:
            return
        if not self.coasting:
            rotate_dcm(self._R, self._w, (t_us - self.t_us) * 1e-6, self._Rn)
            self._pos[:], self._v[:] = self.position(t_us), self.velocity(t_us)
            self._R[:] = self._Rn
            self._v[2] = 0.0
            euler_from_dcm(self._R, self._e)
            self.t_us, self.coasting = t_us, True
            self.level = abs(self._e[2]) < LEVEL_RAD
        dt = (t_us - self.t_us) * 1e-6
        psi, theta, phi = self._e
        roll = -math.copysign(min(ROLL_OUT, abs(phi) / dt if dt > 0.0 else 0.0), phi)
        air = self._v - self._wind
        turn = G0 * math.tan(phi) / max(math.hypot(air[0], air[1]), 50.0)
        self._pos += self._v * dt
        c, s = math.cos(turn * dt), math.sin(turn * dt)
        self._v[0], self._v[1] = self._wind[0] + c * air[0] - s * air[1], self._wind[1] + s * air[0] + c * air[1]
        self._e[0], self._e[2] = psi + turn * dt, phi + roll * dt
        dcm_from_euler(self._e[0], theta, self._e[2], self._R)
        ct = math.cos(theta)
        self._w[:] = roll - turn * math.sin(theta), turn * ct * math.sin(phi), turn * ct * math.cos(phi)
        self._a[:] = -turn * air[1], turn * air[0], 0.0
        self.t_us = t_us

    def steer(self, v_n: np.ndarray, dt: float) -> None:
        """A coasting tanker takes up the velocity v_n [3] NED [m/s] that the relative sensor shows, over STEER_S, dt [s] on."""
        self._v += min(dt / STEER_S, 1.0) * (v_n - self._v)

    def agrees(self, p: PeerState) -> bool:
        """Whether a sample that ends a gap belongs to about the tanker that was carried on: the receiver may join it again."""
        dv = math.dist(p.vel_n, self.velocity(p.t_us).tolist())
        return math.dist(p.pos_n, self.position(p.t_us).tolist()) < REJOIN_M and dv < REJOIN_MPS

    def stage(self, t_us: int, tk: np.ndarray) -> None:
        """tk [18] <- R_BI, w, w_dot = 0 (not on the link), v NED at `t_us`."""
        carried(self._R, self._w, self._v, self._a, (t_us - self.t_us) * 1e-6, tk)

    @property
    def sample(self) -> tuple[np.ndarray, ...]:
        """The sample, as `carried` takes it: R, w, v, a; and its position."""
        return self._R, self._w, self._v, self._a, self._pos

    @property
    def wind(self) -> np.ndarray:
        """The tanker's own wind estimate [3] NED [m/s]."""
        return self._wind

    @property
    def acceleration(self) -> np.ndarray:
        """Inertial acceleration [3] NED [m/s^2] of the last sample."""
        return self._a

    def velocity(self, t_us: int) -> np.ndarray:
        """Inertial velocity [3] NED [m/s] at `t_us`."""
        return np.asarray(self._v + self._a * ((t_us - self.t_us) * 1e-6))

    def position(self, t_us: int) -> np.ndarray:
        """Position [3] NED [m] at `t_us`."""
        dt = (t_us - self.t_us) * 1e-6
        return np.asarray(self._pos + self._v * dt + 0.5 * self._a * dt * dt)
