"""Where a receiver may be asked to fly: outside its tanker, and for contact where the boom reaches.

Geometry of the two aircraft files, a planned receiver level to its tanker as the files have it. Positions are xi, the receiver's
centre of gravity in tanker body axes [m].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.kernels.rotations import added, dcm_from_euler, less, to_parent, vec3
from flightsw.types import ZERO3, Vec3

MARGIN_M = 2.0  # about what the points of the files leave out: fin, engines, and the wake of the moment
Box = tuple[Vec3, Vec3]  # least and greatest corner
Seen = tuple[str, float, tuple[float, float], str, float]  # name, value, least and greatest, unit, metres per unit


def hull(ac: Aircraft) -> Box:
    """Box [m, body axes] about all points an aircraft's file places on it, as wide as its span."""
    points = [ac.wake.wing_ac_m, ac.wake.tail_ac_m, ac.wake.nose_m, *(p.position_m for p in ac.probe)]
    points += [ac.boom.pivot_m] if ac.boom is not None else []
    points += [ac.receptacle.position_m] if ac.receptacle is not None else []
    x, _, z = zip(*points, strict=True)
    half = 0.5 * ac.geometry.b_m
    return (min(x), -half, min(z)), (max(x), half, max(z))


def crosses(a: Vec3, b: Vec3, box: Box) -> bool:
    """Whether the straight line from a to b has a point in `box` (slabs: Kay and Kajiya, SIGGRAPH 1986)."""
    enter, leave = 0.0, 1.0
    for i in range(3):
        d = b[i] - a[i]
        low, high = box[0][i] - a[i], box[1][i] - a[i]
        if d == 0.0:
            if low > 0.0 or high < 0.0:
                return False
            continue
        near, far = sorted((low / d, high / d))
        enter, leave = max(enter, near), min(leave, far)
    return enter <= leave


class Surroundings:
    """What a receiver's path is checked against."""

    def __init__(self, tanker: Aircraft, receiver: Aircraft) -> None:
        (t0, t1), (r0, r1) = hull(tanker), hull(receiver)
        # where the two boxes overlap
        low = tuple(a - b - MARGIN_M for a, b in zip(t0, r1, strict=True))
        high = tuple(a - b + MARGIN_M for a, b in zip(t1, r0, strict=True))
        self.box: Box = ((low[0], low[1], low[2]), (high[0], high[1], high[2]))
        self.boom, self.receptacle = tanker.boom, receiver.receptacle
        self._place = None if receiver.receptacle is None else np.array(receiver.receptacle.position_m)
        self._R, self._lever = np.zeros(9), np.zeros(3)

    def blocked(self, path: Sequence[Vec3]) -> str:
        """Why a path of straight legs (or a single point) cannot be flown, "" if it is clear of the tanker."""
        if not any(crosses(a, b, self.box) for a, b in pairwise([path[0], *path])):
            return ""
        (x0, y0, z0), (x1, y1, z1) = self.box
        return f"in the tanker's way (x {x0:.0f} to {x1:.0f}, y {y0:.0f} to {y1:.0f}, z {z0:.0f} to {z1:.0f} m)"

    def out_of_reach(self, xi: Vec3, margin_m: float = 0.0) -> str:
        """Why the boom cannot serve a receiver at xi, "" if its receptacle is inside the envelope by `margin_m`."""
        if self.boom is None or self.receptacle is None:
            return "the aircraft files have no [boom] and [receptacle]"
        seen = self._seen(xi, ZERO3)
        for name, value, (low, high), unit, _ in seen:
            if not low <= value <= high:
                return f"boom {name} {value:.1f} {unit} there, allowed {low:g} to {high:g}"
        depth = _depth(seen)
        return f"{depth:.2f} m inside the boom's envelope there, needed {margin_m:g}" if depth < margin_m else ""

    def depth(self, xi: Vec3, euler: Vec3) -> float:
        """How far [m] the receptacle of a receiver at xi, attitude `euler` [rad] relative to the tanker, is inside the boom's
        envelope, the least over its faces; negative outside. Infinite without a boom."""
        if self.boom is None or self.receptacle is None:
            return math.inf
        return _depth(self._seen(xi, euler))

    def _seen(self, xi: Vec3, euler: Vec3) -> tuple[Seen, ...]:
        """Boom geometry of a receptacle there."""
        assert self.boom is not None and self._place is not None
        dcm_from_euler(*euler, self._R)
        to_parent(self._R, self._place, self._lever)
        x, y, z = less(added(xi, vec3(self._lever)), self.boom.pivot_m)
        level, length = math.hypot(x, y), math.sqrt(x * x + y * y + z * z)
        deg = math.radians(1.0)
        return (
            ("elevation", math.degrees(math.atan2(-z, level)), self.boom.elevation_deg, "deg", deg * length),
            ("azimuth", math.degrees(math.atan2(y, -x)), self.boom.azimuth_deg, "deg", deg * level),
            ("extension", length - self.boom.length_retracted_m, self.boom.extension_m, "m", 1.0),
        )


def _depth(seen: Sequence[Seen]) -> float:
    return min(min(value - low, high - value) * metres for _, value, (low, high), _, metres in seen)
