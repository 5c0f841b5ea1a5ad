"""The relative position that is flown by and sent: the bank's, come to without a jump. Source: separation.md 7."""

from __future__ import annotations

from flightsw.types import ZERO3, Vec3

CATCH_MPS = 0.3  # [m/s] a way off the bank's position is made good at
SETTLE_US = 500_000  # [us] the bank's position may jump after a change of its sources
GAP_US = 500_000  # [us] after a longer one it begins anew


class Flown:
    """The bank's position jumps when a source is left out, suspected or taken again, and as the boom latches: what is flown by
    goes on from where it was, with the rate of the bank, and the way that is left shrinks by CATCH_MPS in every axis."""

    def __init__(self) -> None:
        self._last: tuple[int, Vec3, Vec3] | None = None  # [us], [m], [m/s]
        self._off, self._sources, self._since_us = ZERO3, -1, 0

    def forget(self) -> None:
        """Nothing of it is flown by: the next begins where the aircraft is flown then."""
        self._last = None

    def step(self, t_us: int, own: Vec3, xi: Vec3, rate: Vec3, sources: int) -> Vec3:
        """Position [m] at t_us; xi [m], rate [m/s] of the bank by `sources` (any number that tells which), own [m] of the
        estimator, all in tanker axes."""
        if self._last is None or not 0 <= t_us - self._last[0] <= GAP_US:
            self._sources, self._since_us, dt = sources, t_us - SETTLE_US, 0.0
            self._off = _less(own, xi, ZERO3, 0.0)
        else:
            dt = (t_us - self._last[0]) * 1e-6
            if sources != self._sources:
                self._sources, self._since_us = sources, t_us
            if t_us - self._since_us < SETTLE_US:
                self._off = _less(self._last[1], xi, self._last[2], dt)
        (x, y, z), caught = self._off, CATCH_MPS * dt
        x -= min(max(x, -caught), caught)
        y -= min(max(y, -caught), caught)
        z -= min(max(z, -caught), caught)
        self._off = (x, y, z)
        out = (xi[0] + x, xi[1] + y, xi[2] + z)
        self._last = (t_us, out, rate)
        return out


def _less(a: Vec3, b: Vec3, rate: Vec3, dt: float) -> Vec3:
    """a [m], dt [s] on with its rate [m/s], less b [m]."""
    return a[0] + dt * rate[0] - b[0], a[1] + dt * rate[1] - b[1], a[2] + dt * rate[2] - b[2]
