"""The relative position that is flown by and sent: the bank's, come to without a jump. Source: separation.md 7."""

from __future__ import annotations

from flightsw.types import Vec3

CATCH_MPS = 0.3  # [m/s] a way off the bank's position is made good at
GAP_US = 500_000  # [us] after a longer one it begins anew


class Flown:
    """Filter and position change when a source is left out, suspected or taken again, and as the boom latches: what is flown by
    goes on from where it was, with the rate of the bank, and the way that is left shrinks by CATCH_MPS in every axis."""

    def __init__(self) -> None:
        self._last: tuple[int, Vec3, Vec3] | None = None  # [us], [m], [m/s]

    def forget(self) -> None:
        """Nothing of it is flown by: the next begins where the aircraft is flown then."""
        self._last = None

    def step(self, t_us: int, own: Vec3, xi: Vec3, rate: Vec3) -> Vec3:
        """Position [m] at t_us; xi [m], rate [m/s] of the bank, own [m] of the estimator, all in tanker axes."""
        out = own
        if self._last is not None and 0 < t_us - self._last[0] <= GAP_US:
            dt = (t_us - self._last[0]) * 1e-6
            x, y, z = (a + dt * u for a, u in zip(self._last[1], self._last[2], strict=True))
            most = CATCH_MPS * dt
            x, y, z = (b + _shrunk(a - b, most) for a, b in zip((x, y, z), xi, strict=True))
            out = (x, y, z)
        self._last = (t_us, out, rate)
        return out


def _shrunk(x: float, by: float) -> float:
    """x nearer to zero by as much, not beyond."""
    return x - min(max(x, -by), by)
