"""A tanker that turns during the join-up, and the distance kept whatever it does.

Far from a turning tanker the receiver follows: it stays at its vertical separation, flies the tanker's velocity and closes on a
point behind it no faster than the gap allows. Near, it holds its place in the tanker's turning axes: a place at r moves with
omega x r. Beside both stands a guard: where the path of the next seconds comes nearer than the keep-out distance, the receiver
slows down, goes down and away, and comes back only when it is clear. Level heading axes H: x forward, y right, z down.
"""

from __future__ import annotations

import math

from flightsw.types import Vec3

AHEAD_S, STEP_S = 12.0, 0.5  # how far and how finely the path ahead is looked at
TURN_S = 2.0  # [s] a difference of turn rates is taken to last: longer, and every correction of the heading would alarm


def in_turning_axes(v: tuple[float, float], pos: Vec3, omega: float) -> tuple[float, float]:
    """Velocity (x, y) [m/s] relative to the tanker that gives v [m/s] in axes turning right at omega [rad/s]: v + omega x r."""
    return v[0] - omega * pos[1], v[1] + omega * pos[0]


def follow(pos: Vec3, back_m: float, closing: float) -> tuple[float, float]:
    """Velocity (x, y) [m/s] relative to the tanker that closes on the point back_m [m] behind it at `closing` [m/s]."""
    dx, dy = -back_m - pos[0], -pos[1]
    d = max(math.hypot(dx, dy), 1.0)
    return closing * dx / d, closing * dy / d


def nearest(pos: Vec3, vel: Vec3, accel_y: float) -> float:
    """Least distance [m] to the tanker over the next AHEAD_S at relative velocity vel [m/s] and sideways acceleration [m/s^2].

    accel_y = V (own turn rate - the tanker's), over the first TURN_S.
    """
    x, y, z = pos
    best = math.hypot(x, y, z)
    for k in range(1, round(AHEAD_S / STEP_S) + 1):
        t = k * STEP_S
        turning = min(t, TURN_S)
        aside = y + vel[1] * t + accel_y * turning * (t - 0.5 * turning)
        best = min(best, math.hypot(x + vel[0] * t, aside, z + vel[2] * t))
    return best


class Guard:
    """Whether the receiver gives way: from a path ahead nearer than keep_out_m [m] until it opens beyond clear_m [m]."""

    def __init__(self, keep_out_m: float, clear_m: float) -> None:
        self.keep_out_m, self.clear_m = keep_out_m, clear_m
        self.active = False

    def step(self, pos: Vec3, vel: Vec3, accel_y: float) -> bool:
        """Judge the path ahead; True while the receiver gives way."""
        if self.active:
            opening = pos[0] * vel[0] + pos[1] * vel[1] + pos[2] * vel[2] > 0.0
            self.active = not (opening and math.hypot(*pos) > self.clear_m)
        else:
            self.active = nearest(pos, vel, accel_y) < self.keep_out_m
        return self.active
