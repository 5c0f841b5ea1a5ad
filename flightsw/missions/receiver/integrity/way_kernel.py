"""Means of what both aircraft's accelerometers said, and filter 0 carried on by them, each in one call (way.py)."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.missions.receiver.integrity.layout import B_D, B_U

FAITH_US = 300_000  # a gain tells the acceleration after it for so long
# of a step of the own aircraft: [us] from, to, 1.0 if its acceleration is known, that [3] m/s^2 NED;
FROM, TO, FELT, ACC = 0, 1, 2, 3
# of a gain of the tanker's: [us] from, to, [s] its span, what was gained [3] m/s NED;
SPAN, GAINED = 2, 3
# of the way ahead: [us] when, position [3] m and velocity [3] m/s NED
AT, POS, VEL = 0, 1, 4
OWN, OTHER, PATH = ACC + 3, GAINED + 3, VEL + 3


@jit
def mean_own(own: np.ndarray, n: int, from_us: float, to_us: float) -> tuple[bool, float, float, float]:
    """Whether the own acceleration is known from from_us to to_us, and its mean [m/s^2] NED; n steps into own [KEPT,OWN]."""
    x, y, z, covered = 0.0, 0.0, 0.0, 0.0
    for k in range(min(n, own.shape[0])):
        s = own[(n - 1 - k) % own.shape[0]]
        if s[TO] <= from_us:
            break
        part = min(s[TO], to_us) - max(s[FROM], from_us)
        if part > 0.0:
            if s[FELT] == 0.0:
                return False, 0.0, 0.0, 0.0
            x, y, z, covered = x + part * s[ACC], y + part * s[ACC + 1], z + part * s[ACC + 2], covered + part
    return (True, x / covered, y / covered, z / covered) if covered > 0.0 else (False, 0.0, 0.0, 0.0)


@jit
def mean_other(other: np.ndarray, n: int, from_us: float, to_us: float) -> tuple[bool, float, float, float]:
    """As `mean_own` of the tanker, n gains into other [KEPT,OTHER]: where it was told, and as told last for a while after."""
    x, y, z, covered = 0.0, 0.0, 0.0, 0.0
    for k in range(min(n, other.shape[0])):
        g = other[(n - 1 - k) % other.shape[0]]
        end = g[TO] if k else g[TO] + FAITH_US
        if end <= from_us:
            break
        part = min(end, to_us) - max(g[FROM], from_us)
        if part > 0.0:
            share = part / g[SPAN]
            x, y, z = x + share * g[GAINED], y + share * g[GAINED + 1], z + share * g[GAINED + 2]
            covered += part
    told = 2.0 * covered > to_us - from_us
    return (True, x / covered, y / covered, z / covered) if told else (False, 0.0, 0.0, 0.0)


@jit
def over(
    own: np.ndarray, n: int, other: np.ndarray, m: int, a: np.ndarray, coasting: bool, from_us: float, to_us: float
) -> tuple[bool, bool, float, float, float]:  # fmt: skip
    """Whether the own part is felt, whether both are measured, and the receiver's mean acceleration [m/s^2] NED from from_us to
    to_us less the tanker's, n steps into own and m gains into other; a [3] m/s^2 NED: the tanker's as transmitted."""
    felt, x, y, z = mean_own(own, n, from_us, to_us)
    if not felt:
        return False, False, 0.0, 0.0, 0.0
    told, u, v, w = mean_other(other, m, from_us, to_us)
    if coasting or not told:
        return True, False, x - a[0], y - a[1], z - a[2]
    return True, True, x - u, y - v, z - w


@jit
def build(
    own: np.ndarray, n: int, other: np.ndarray, m: int, a: np.ndarray, coasting: bool, from_us: int, to_us: int, step_us: int,
    X: np.ndarray, path: np.ndarray,
) -> tuple[int, bool, bool]:  # fmt: skip
    """path [>=rows,PATH] <- filter 0 of X [M,n] carried on from from_us to to_us by steps of step_us [us], d' = u, u' = `over`;
    its rows, and the last step's felt and measured (true without one)."""
    felt, known = True, True
    now, rows = from_us, 1
    path[0, AT] = now
    for i in range(3):
        path[0, POS + i], path[0, VEL + i] = X[0, B_D + i], X[0, B_U + i]
    while now < to_us:
        end = min(now + step_us, to_us)
        dt = (end - now) * 1e-6
        felt, known, ax, ay, az = over(own, n, other, m, a, coasting, now, end)
        last, here = path[rows - 1], path[rows]
        here[AT] = end
        for i, acc in enumerate((ax, ay, az)):
            here[POS + i] = last[POS + i] + dt * (last[VEL + i] + 0.5 * dt * acc)
            here[VEL + i] = last[VEL + i] + dt * acc
        now, rows = end, rows + 1
    return rows, felt, known


@jit
def at(path: np.ndarray, rows: int, t_us: float) -> tuple[float, float, float, float, float, float]:
    """Position [m] and velocity [m/s] NED at t_us by the `rows` of path, between two in a straight line; outside of them as at
    the end."""
    here = 0
    while here < rows - 1 and path[here, AT] < t_us:
        here += 1
    a, b = path[max(here - 1, 0)], path[here]
    if b[AT] < t_us:
        return b[POS], b[POS + 1], b[POS + 2], b[VEL], b[VEL + 1], b[VEL + 2]
    span = b[AT] - a[AT]
    k = max((t_us - a[AT]) / span, 0.0) if span > 0.0 else 1.0
    return (
        a[POS] + k * (b[POS] - a[POS]),
        a[POS + 1] + k * (b[POS + 1] - a[POS + 1]),
        a[POS + 2] + k * (b[POS + 2] - a[POS + 2]),
        a[VEL] + k * (b[VEL] - a[VEL]),
        a[VEL + 1] + k * (b[VEL + 1] - a[VEL + 1]),
        a[VEL + 2] + k * (b[VEL + 2] - a[VEL + 2]),
    )
