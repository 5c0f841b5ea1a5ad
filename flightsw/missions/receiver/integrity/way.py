"""What both aircraft's accelerometers say of their relative motion.

The tanker's arrive late, so the bank is kept a fixed time behind, where both are known, and carried on from there.
Source: separation.md 1.
"""

from __future__ import annotations

from collections import deque

from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import ZERO3, Gain, Vec3

AXES = range(3)
KEPT = 40  # steps of either
FAITH_US = 300_000  # a gain tells the acceleration after it for so long


class Way:
    """Accelerations of both aircraft over the last steps."""

    def __init__(self) -> None:
        self._own: deque[tuple[int, int, Vec3 | None]] = deque(maxlen=KEPT)  # [us] from, to, [m/s^2] NED
        self._other: deque[Gain] = deque(maxlen=KEPT)
        self.known = False
        self.felt = True  # the own part of it

    def own(self, from_us: int, to_us: int, acc_n: Vec3 | None) -> None:
        """A step of the own aircraft with mean acceleration acc_n [3] m/s^2 NED; None: not known."""
        if to_us > from_us:
            self._own.append((from_us, to_us, acc_n))

    @property
    def felt_now(self) -> bool:
        """Whether the own acceleration of the last step is known."""
        return bool(self._own) and self._own[-1][2] is not None

    def other(self, g: Gain) -> None:
        """What the tanker's accelerometers gained."""
        if g.span_s > 0.0 and (not self._other or g.t_us > self._other[-1].t_us):
            self._other.append(g)

    def over(self, from_us: int, to_us: int, peer: PeerTracker) -> Vec3:
        """The receiver's mean acceleration [3] m/s^2 NED from from_us to to_us less the tanker's: measured by both (`known`
        then), else with the tanker's as transmitted or, where it is silent, carried on; none where the own is not (`felt`)."""
        own, tanker = self._mean_own(from_us, to_us), self._mean_other(from_us, to_us)
        self.felt = own is not None
        self.known = self.felt and tanker is not None and not peer.coasting
        if own is None:
            return ZERO3
        if tanker is None or peer.coasting:
            x, y, z = peer.acceleration.tolist()
            tanker = (x, y, z)
        return own[0] - tanker[0], own[1] - tanker[1], own[2] - tanker[2]

    def _mean_own(self, from_us: int, to_us: int) -> Vec3 | None:
        x, y, z, covered = 0.0, 0.0, 0.0, 0
        for a, b, acc in reversed(self._own):
            if b <= from_us:
                break
            part = (b if b < to_us else to_us) - (a if a > from_us else from_us)  # min and max take twice as long
            if part > 0:
                if acc is None:
                    return None
                x, y, z, covered = x + part * acc[0], y + part * acc[1], z + part * acc[2], covered + part
        return (x / covered, y / covered, z / covered) if covered else None

    def _mean_other(self, from_us: int, to_us: int) -> Vec3 | None:
        """Of the tanker where it has been told, and as told last for a while after that."""
        x, y, z, covered = 0.0, 0.0, 0.0, 0
        end = -1
        for g in reversed(self._other):
            end = g.t_us if end >= 0 else g.t_us + FAITH_US
            if end <= from_us:
                break
            start = g.t_us - round(g.span_s * 1e6)
            part = (end if end < to_us else to_us) - (start if start > from_us else from_us)
            if part > 0:
                share = part / g.span_s
                x, y, z, covered = (
                    x + share * g.vel_n[0],
                    y + share * g.vel_n[1],
                    z + share * g.vel_n[2],
                    covered + part,
                )
        return (x / covered, y / covered, z / covered) if 2 * covered > to_us - from_us else None


class Ahead:
    """Filter 0's position and velocity carried on from the bank's time to now."""

    def __init__(self) -> None:
        self._at: list[tuple[int, Vec3, Vec3]] = [(0, ZERO3, ZERO3)]

    def build(self, from_us: int, to_us: int, d: Vec3, u: Vec3, way: Way, peer: PeerTracker, step_us: int) -> None:
        """Steps of step_us [us] from from_us to to_us; d [3] m, u [3] m/s NED at from_us. d' = u, u' = a."""
        x, v, t = list(d), list(u), from_us
        self._at = [(t, d, u)]
        while t < to_us:
            end = min(t + step_us, to_us)
            dt, a = (end - t) * 1e-6, way.over(t, end, peer)
            for i in AXES:
                x[i] += dt * (v[i] + 0.5 * dt * a[i])
                v[i] += dt * a[i]
            t = end
            self._at.append((t, (x[0], x[1], x[2]), (v[0], v[1], v[2])))

    def at(self, t_us: int) -> tuple[Vec3, Vec3]:
        """Position [m] and velocity [m/s] NED at t_us, between two steps in a straight line; outside of them as at the end."""
        before = self._at[0]
        for here in self._at:
            if here[0] >= t_us:
                span = here[0] - before[0]
                k = max((t_us - before[0]) / span, 0.0) if span > 0 else 1.0
                return _between(before[1], here[1], k), _between(before[2], here[2], k)
            before = here
        return before[1], before[2]


def _between(a: Vec3, b: Vec3, k: float) -> Vec3:
    return a[0] + k * (b[0] - a[0]), a[1] + k * (b[1] - a[1]), a[2] + k * (b[2] - a[2])
