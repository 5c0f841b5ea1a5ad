"""The tanker as the receiver knows it: the last data-link sample, carried forward to any time asked for."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.rotations import dcm_from_quat, rotate_dcm
from flightsw.types import PeerState


class PeerTracker:
    """Holds one sample of another aircraft's estimate and extrapolates it with its own rates and acceleration."""

    def __init__(self) -> None:
        self.t_us = -1
        self._R, self._w = np.zeros(9), np.zeros(3)
        self._v, self._a, self._pos = np.zeros(3), np.zeros(3), np.zeros(3)
        self._q = np.zeros(4)
        self.straight = False

    def take(self, p: PeerState) -> None:
        """Accept a newer sample; an older or repeated one is ignored."""
        if p.t_us <= self.t_us:
            return
        self.t_us = p.t_us
        self._q[:] = p.q_nb
        dcm_from_quat(self._q, self._R)
        self._w[:], self._v[:], self._a[:], self._pos[:] = p.w_b, p.vel_n, p.acc_n, p.pos_n
        self.straight = False

    def freeze(self, t_us: int) -> None:
        """The link is gone: keep flying the last sample straight ahead, wings level, from `t_us` on.

        Extrapolating a turn for seconds would swing the reference frame away; a straight virtual tanker gives the receiver
        a smooth frame to break away in.
        """
        if self.straight or self.t_us < 0:
            return
        pos, v = self.position(t_us), self.velocity(t_us)
        self._pos[:], self._v[:] = pos, v
        self._v[2] = 0.0
        psi = np.arctan2(v[1], v[0])
        theta = 0.06  # [rad] close to the tanker's pitch in level flight; only the frame's tilt depends on it
        c, s, ct, st = np.cos(psi), np.sin(psi), np.cos(theta), np.sin(theta)
        self._R[:] = [ct * c, ct * s, -st, -s, c, 0.0, st * c, st * s, ct]
        self._w[:] = 0.0
        self._a[:] = 0.0
        self.t_us = t_us
        self.straight = True

    def stage(self, t_us: int, tk: np.ndarray) -> None:
        """tk [18] <- R_BI, w, w_dot = 0 (not on the link), v NED at `t_us`."""
        dt = (t_us - self.t_us) * 1e-6
        rotate_dcm(self._R, self._w, dt, tk[:9])
        tk[9:12] = self._w
        tk[12:15] = 0.0
        tk[15:18] = self._v + self._a * dt

    def velocity(self, t_us: int) -> np.ndarray:
        """Inertial velocity [3] NED [m/s] at `t_us`."""
        return np.asarray(self._v + self._a * ((t_us - self.t_us) * 1e-6))

    def position(self, t_us: int) -> np.ndarray:
        """Position [3] NED [m] at `t_us`."""
        dt = (t_us - self.t_us) * 1e-6
        return np.asarray(self._pos + self._v * dt + 0.5 * self._a * dt * dt)
