"""Kernel of readings.py, and the block that holds what is known in a step: its kernels and those of who goes by it read that."""

from __future__ import annotations

import math

import numpy as np

from flightsw.aircraft import Aircraft
from flightsw.aircraft.base import PROBES
from flightsw.kernels.atmosphere import G0, density
from flightsw.kernels.jit import jit

V_GATE, V_COAST_S = 20.0, 10.0  # [m/s] against what the accelerometers make of the last one; [s] it is carried on
FLOW_MOST = 0.6  # [rad]
SETTLE_V_S = 4.0  # [s] over which the accelerometers' airspeed takes over the probes'
SHARE_V = 0.6  # [-] of the range of airspeeds, where none is known
TAU_V_S = 20.0  # [s] over which an airspeed that is carried on is given up for that
# the block: rates, those of the step before [rad/s], specific force [m/s^2]; load [-], V [m/s], alpha, beta [rad], dynamic
# pressure [Pa], mass [kg], moments of inertia [kg m^2]; the vertical ahead, right, down
ROLLING, PITCHING, YAWING, ROLLED, PITCHED, YAWED, AHEAD, ASIDE, DOWN = range(9)
LOAD, SPEED, ALPHA, BETA, PRESSURE, MASS, IXX, IYY, IZZ, FORWARD, RIGHT, BELOW, MOTION = range(9, 22)
# 1.0 where probes and vanes measure; [m/s] by the accelerometers, slowly brought to the probes; [s] since an airspeed was taken;
# 1.0: it has last been the estimate's, the probes' has to come near it first
MEASURED, BY_VANES, V_FELT, V_AGE, GIVEN = range(MOTION, MOTION + 5)
SORTED = MOTION + 5  # work space [PROBES]
BLOCK = SORTED + PROBES
# file's numbers: airspeed where none is known, the slowest and fastest that is taken for one [m/s]; the vanes [m] ahead, right
CL0, CLA, CYB, AREA, BETWEEN, SLOWEST, FASTEST, VANES = range(8)
NUMBERS = VANES + 2 * PROBES


def numbers(ac: Aircraft) -> np.ndarray:
    """[NUMBERS] of an aircraft's file."""
    out, (lo, hi) = np.zeros(NUMBERS), (ac.limits.V_min_mps, ac.limits.V_max_mps)
    between = lo + SHARE_V * (hi - lo)
    c = ac.aero
    out[:VANES] = c.CL0, c.CL_alpha, c.CY_beta, ac.geometry.S_m2, between, 0.3 * between, 2.0 * between
    for i, probe in enumerate(ac.probe):
        out[VANES + 2 * i : VANES + 2 * i + 2] = probe.position_m[:2]
    return out


@jit
def middle(v: np.ndarray, n: int) -> float:
    """The middle one of the first n of v, which are sorted by this; of an even number the mean of both."""
    for i in range(1, n):
        x, k = v[i], i
        while k > 0 and x < v[k - 1]:
            v[k] = v[k - 1]
            k -= 1
        v[k] = x
    k = n // 2
    return v[k] if n % 2 == 1 else 0.5 * (v[k - 1] + v[k])


@jit
def go_on(x: np.ndarray, ahead: float, below: float, dt: float) -> None:
    """Airspeeds of the block x [BLOCK], dt [s] on with what gravity and a specific force [m/s^2] ahead and down make of them."""
    ca, sa = math.cos(x[ALPHA]), math.sin(x[ALPHA])
    gained = dt * (ca * (ahead + G0 * x[FORWARD]) + sa * (below + G0 * x[BELOW]))
    x[SPEED] += gained
    x[V_FELT] += gained


@jit
def probed(x: np.ndarray, V: float, dt: float) -> None:
    """Takes for the airspeed of the block x [BLOCK] that of the probes, V [m/s], where it is near enough to what is felt."""
    if x[MEASURED] == 0.0 and x[GIVEN] == 0.0:
        x[V_FELT] = V
    off = V - x[V_FELT]
    if abs(off) < V_GATE:
        x[SPEED], x[V_AGE], x[MEASURED], x[GIVEN] = V, 0.0, 1.0, 0.0
        share = dt / SETTLE_V_S
        x[V_FELT] += (1.0 if share > 1.0 else share) * off
    elif x[V_AGE] <= dt:
        x[SPEED] = x[V_FELT]  # it has run away, not leapt: what has been taken of it is wrong too


@jit
def bounded(x: np.ndarray, c: np.ndarray, dt: float) -> None:
    """An airspeed of the block x [BLOCK] that has been carried on for long is given up; c [NUMBERS]."""
    if x[V_AGE] > V_COAST_S:
        x[MEASURED] = 0.0
        share = dt / TAU_V_S
        x[SPEED] += (1.0 if share > 1.0 else share) * (c[BETWEEN] - x[SPEED])
    if x[SPEED] < c[SLOWEST]:
        x[SPEED] = c[SLOWEST]
    elif x[SPEED] > c[FASTEST]:
        x[SPEED] = c[FASTEST]


@jit
def within(a: float) -> float:
    """A flow angle [rad] of no more than FLOW_MOST."""
    if a < -FLOW_MOST:
        return -FLOW_MOST
    return FLOW_MOST if a > FLOW_MOST else a


@jit
def read(
    x: np.ndarray, c: np.ndarray, R: np.ndarray, felt: int, p: float, q: float, r: float, ahead: float, aside: float,
    below: float, h: float, dt: float, given: float, good: int, up: int, side: int,
    V0: float, V1: float, V2: float, V3: float, a0: float, a1: float, a2: float, a3: float,
    b0: float, b1: float, b2: float, b3: float,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """A step of the block x [BLOCK], dt [s] on, at attitude R [9] NED to body: load factor [-], V [m/s], alpha, beta [rad],
    dynamic pressure [Pa]; not 0.0 where probes and vanes measure.

    c [NUMBERS]; p, q, r [rad/s] rates, specific force [m/s^2] in body axes, taken where `felt` is not 0; h [m]; given [m/s]: the
    estimate's airspeed to go by instead, nan: none. V0.. [m/s], a0.., b0.. [rad]: airspeed, incidence, sideslip of each probe,
    of which those are gone by whose bit is set in good, up, side.
    """
    x[ROLLED], x[PITCHED], x[YAWED] = x[ROLLING], x[PITCHING], x[YAWING]
    x[ROLLING], x[PITCHING], x[YAWING] = p, q, r
    if felt != 0:
        x[AHEAD], x[ASIDE], x[DOWN] = ahead, aside, below
        x[LOAD] = -below / G0
    x[FORWARD], x[RIGHT], x[BELOW] = R[2], R[5], R[8]
    out = x[SORTED:]
    x[V_AGE] += dt
    if not math.isnan(given):
        x[SPEED] = x[V_FELT] = given
        x[V_AGE], x[MEASURED], x[GIVEN] = 0.0, 0.0, 1.0
    else:
        go_on(x, ahead, below, dt)
        n, speeds = 0, (V0, V1, V2, V3)
        for i in range(PROBES):
            if good >> i & 1:
                out[n] = speeds[i]
                n += 1
        if n > 0:
            probed(x, middle(out, n), dt)
        bounded(x, c, dt)
    V = x[SPEED]
    x[PRESSURE] = 0.5 * density(h) * V * V
    n, angles = 0, (a0, a1, a2, a3)
    for i in range(PROBES):  # a vane less what the rates make at it
        if up >> i & 1:
            out[n] = angles[i] - (p * c[VANES + 2 * i + 1] - q * c[VANES + 2 * i]) / V
            n += 1
    x[BY_VANES] = n
    qS = x[PRESSURE] * c[AREA]
    x[ALPHA] = within(middle(out, n) if n > 0 else (x[LOAD] * x[MASS] * G0 / qS - c[CL0]) / c[CLA])
    n, angles = 0, (b0, b1, b2, b3)
    for i in range(PROBES):
        if side >> i & 1:
            out[n] = angles[i] - r * c[VANES + 2 * i] / V
            n += 1
    x[BETA] = within(middle(out, n) if n > 0 else aside * x[MASS] / (qS * c[CYB]))
    return x[LOAD], V, x[ALPHA], x[BETA], x[PRESSURE], x[MEASURED], x[BY_VANES]
