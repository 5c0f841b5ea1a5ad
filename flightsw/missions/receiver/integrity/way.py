"""What both aircraft's accelerometers say of their relative motion.

The tanker's arrive late, so the bank is kept a fixed time behind, where both are known, and carried on from there.
Source: separation.md 1.
"""

from __future__ import annotations

import numpy as np

from flightsw.missions.receiver.integrity import way_kernel
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import ZERO3, Gain, Vec3

KEPT = 40  # steps of either


class Way:
    """Accelerations of both aircraft over the last steps."""

    def __init__(self) -> None:
        self._own, self._steps = np.zeros((KEPT, way_kernel.OWN)), 0
        self._other, self._gains, self._told_us = np.zeros((KEPT, way_kernel.OTHER)), 0, -1
        self.known = False
        self.felt = True  # the own part of it
        self.felt_now = False  # the own acceleration of the last step is known

    def own(self, from_us: int, to_us: int, acc_n: Vec3 | None) -> None:
        """A step of the own aircraft with mean acceleration acc_n [3] m/s^2 NED; None: not known."""
        if to_us > from_us:
            self.felt_now = acc_n is not None
            self._own[self._steps % KEPT] = (from_us, to_us, self.felt_now, *(acc_n or ZERO3))
            self._steps += 1

    def other(self, g: Gain) -> None:
        """What the tanker's accelerometers gained."""
        if g.span_s > 0.0 and (not self._gains or g.t_us > self._told_us):
            self._told_us = g.t_us
            self._other[self._gains % KEPT] = (g.t_us - round(g.span_s * 1e6), g.t_us, g.span_s, *g.vel_n)
            self._gains += 1

    @property
    def arrays(self) -> tuple[np.ndarray, int, np.ndarray, int]:
        """Steps of the own aircraft and their number, gains of the tanker's and theirs, as kernels take them."""
        return self._own, self._steps, self._other, self._gains

    def over(self, from_us: int, to_us: int, peer: PeerTracker) -> Vec3:
        """The receiver's mean acceleration [3] m/s^2 NED from from_us to to_us less the tanker's: measured by both (`known`
        then), else with the tanker's as transmitted or, where it is silent, carried on; none where the own is not (`felt`)."""
        self.felt, self.known, x, y, z = way_kernel.over(*self.arrays, peer.acceleration, peer.coasting, from_us, to_us)
        return x, y, z
