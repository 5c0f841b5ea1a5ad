"""A tick of all aircraft of six degrees of freedom in compiled calls, on one row of numbers for each (block.py)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.aircraft.sixdof.eom import go_on, spool, step
from sim_plant.aircraft.sixdof.observe import look
from sim_plant.kernels import layout as n
from sim_plant.kernels.geometry import relative
from sim_plant.kernels.jit import jit
from sim_plant.sensors.bank_kernel import reading, used_up
from sim_plant.sensors.shape_kernel import K_OWNER, NODE_US
from sim_plant.wind.air import meet
from sim_plant.wind.vortex import NK, wake_on_airframe
from sim_plant.wind.wake import N_SPAN

Arr = NDArray[np.float64]
Ints = NDArray[np.int64]
# places in a row: state now and as observed, observation, bounds, effective, free and calm wind, wake at the probes, work space,
# motion relative to the leader and of whoever is at the boom, command, work space of the integration; of what stays as it is
# probes, earth's field, geometry of boom and receptacle, envelope (elevation, azimuth, extension, from and to each), reach of
# leader and follower, wake source; of the leader the most ticks a follower may lag, and ticks a second; points and weights of the
# airframe, parameters
MOST = N_SPAN + 3 + n.MAX_PROBES  # points of an airframe (wind/wake.py)
B_S = 0
B_HELD = B_S + n.NS
B_OBS = B_HELD + n.NS
B_BOUNDS = B_OBS + n.NO
B_WIND = B_BOUNDS + n.NB
B_FREE = B_WIND + n.NW
B_CALM = B_FREE + 3
B_PROBE_WAKE = B_CALM + 3
B_WORK = B_PROBE_WAKE + 3 * n.MAX_PROBES
B_REL = B_WORK + n.N_RIGID
B_BOOM = B_REL + n.NR
B_C = B_BOOM + n.NR
B_SCRATCH = B_C + n.NC
B_PROBES = B_SCRATCH + 4 * n.NS
B_MAG = B_PROBES + 3 * n.MAX_PROBES
B_GEO = B_MAG + 3
B_ENVELOPE = B_GEO + 7
B_REACH = B_ENVELOPE + 6
B_SOURCE = B_REACH + 1
B_MOST = B_SOURCE + NK
B_TICKS = B_MOST + 1
B_POINTS = B_TICKS + 1
B_WEIGHT = B_POINTS + 3 * MOST
B_PAR = B_WEIGHT + 3 * MOST
# whole numbers: probes, points of the airframe, those of them across the span and on it, parameters, whether it flies in the
# leader's wake, whether the leader's boom is for it; of the leader whether gusts lie along its track, how far ahead
I_PROBES, I_POINTS, I_SPAN, I_FRAME, I_PAR, I_WAKE, I_TAKER, I_ALIGNED, I_AHEAD, NI = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
# bits of what `sense_all` says; from UNWELL on one for each aircraft that is out of its bounds
INSIDE, NEAR, UNWELL = 1, 2, 4


@jit
def place(B: Arr, ints: Ints) -> int:
    """Who is where: all relative to the leader, row 0. Bits: a receptacle is inside the envelope, two may touch."""
    code = 0
    lead = B[0]
    for i in range(1, B.shape[0]):
        b = B[i]
        rel = b[B_REL : B_REL + n.NR]
        relative(lead[B_S : B_S + n.NS], b[B_S : B_S + n.NS], b[B_GEO : B_GEO + 7], rel)
        for j in range(n.NR):
            b[B_BOOM + j] = rel[j]
        reach = b[B_REACH]
        # by a hair more than it is: whoever looks closer decides
        if rel[0] * rel[0] + rel[1] * rel[1] + rel[2] * rel[2] <= reach * reach * (1.0 + 1e-9):
            code |= NEAR
        if ints[i, I_TAKER]:
            for j in range(n.NR):
                lead[B_BOOM + j] = rel[j]
            el, az, ext = rel[n.R_EL], rel[n.R_AZ], rel[n.R_EXT]
            e = b[B_ENVELOPE : B_ENVELOPE + 6]
            if e[0] <= el <= e[1] and e[2] <= az <= e[3] and e[4] <= ext <= e[5]:
                code |= INSIDE
    return code


@jit
def sense_all(
    B: Arr,
    ints: Ints,
    gust: Arr,
    row: int,
    rings: Arr,
    tick: int,
    table: Arr,
    slow: Arr,
    at: int,
    t_us: int,
    flow: bool,
    which: Ints,
    f: Arr,
    k: Ints,
    out: Arr,
) -> int:
    """Place, wind and observation of all in rows `B`, `ints`, and readings of the sensors `which` of a store (`f`, `k`), row by
    row, at t_us [us] into `out`. Bits as above; -1, and nothing done, when error rows have to be drawn first.

    As place(), AirMass.step() and observe() of one after the other: wind of a `table` and `slow`[at], and gusts `gust`[row] that
    the leader lays in `rings` I_AHEAD of `tick` along its track (I_ALIGNED; north), and that followers meet up to B_MOST ticks
    later; in the leader's wake. `flow`: air data are read at this tick; else the air at the probes stays as it was.
    """
    if used_up(which, f, k):
        return -1
    code, unwell = place(B, ints), UNWELL
    lead, ahead = B[0], ints[0, I_AHEAD]
    for i in range(B.shape[0]):
        b = B[i]
        s, obs, wind = b[B_S : B_S + n.NS], b[B_OBS : B_OBS + n.NO], b[B_WIND : B_WIND + n.NW]
        free, calm = b[B_FREE : B_FREE + 3], b[B_CALM : B_CALM + 3]
        m = ints[i, I_PROBES] if flow else 0
        probe_wake = b[B_PROBE_WAKE : B_PROBE_WAKE + 3 * m].reshape((m, 3))
        par = b[B_PAR : B_PAR + ints[i, I_PAR]]
        cs, sn, lag, lays = 1.0, 0.0, 0.0, -1
        if i == 0:
            lays = row
            if ints[0, I_ALIGNED]:
                vn, ve = s[n.S_V] - wind[0], s[n.S_V + 1] - wind[1]
                h = math.sqrt(vn * vn + ve * ve)
                cs, sn = vn / h, ve / h
        else:
            lag = min(lead[B_MOST], max(0.0, -b[B_REL + n.R_XI]) / max(1.0, lead[B_OBS + n.O_V]) * lead[B_TICKS])
        meet(
            cs, sn, gust, lays, ahead, -s[n.S_P + 2], table, slow, at, rings, tick, lag, calm, free, wind, probe_wake
        )  # fmt: skip
        if ints[i, I_WAKE]:
            span, frame = ints[i, I_SPAN], ints[i, I_FRAME]
            p = ints[i, I_POINTS] if flow else frame
            points = b[B_POINTS : B_POINTS + 3 * p].reshape((p, 3))
            weight = b[B_WEIGHT : B_WEIGHT + 3 * frame].reshape((frame, 3))
            wake_on_airframe(
                lead[B_S : B_S + n.NS], lead[B_OBS : B_OBS + n.NO], lead[B_SOURCE : B_SOURCE + NK], s, points, weight, span,
                frame, wind, probe_wake,
            )  # fmt: skip
        if not look(
            s, wind, free, par, b[B_MAG : B_MAG + 3], b[B_PROBES : B_PROBES + 3 * m].reshape((m, 3)), probe_wake,
            b[B_WORK : B_WORK + n.N_RIGID], obs, b[B_BOUNDS : B_BOUNDS + n.NB], b[B_HELD : B_HELD + n.NS],
        ):  # fmt: skip
            code |= unwell
        unwell *= 2
    end, j, past = 0, 0, t_us % NODE_US / NODE_US
    for i in range(B.shape[0]):
        b = B[i]
        s, obs = b[B_HELD : B_HELD + n.NS], b[B_OBS : B_OBS + n.NO]
        rel, boom = b[B_REL : B_REL + n.NR], b[B_BOOM : B_BOOM + n.NR]
        while j < which.shape[0] and k[which[j], K_OWNER] == i:
            end = reading(s, obs, rel, boom, which[j], f, k, past, out, end)
            j += 1
    return code


@jit
def advance_all(B: Arr, ints: Ints, dt: float) -> None:
    """fly() of every row of B over dt [s] with the command in it.

    Where a state is as it was observed, the rates it was observed with are those the step begins with.
    """
    for i in range(B.shape[0]):
        b = B[i]
        s, c, wind = b[B_S : B_S + n.NS], b[B_C : B_C + n.NC], b[B_WIND : B_WIND + n.NW]
        par, scratch = b[B_PAR : B_PAR + ints[i, I_PAR]], b[B_SCRATCH : B_SCRATCH + 4 * n.NS].reshape((4, n.NS))
        same = True
        for j in range(n.NS):
            same &= s[j] == b[B_HELD + j]
        if not same:
            step(s, c, wind, par, dt, scratch)
            continue
        k = scratch[1]
        for j in range(n.S_T):
            k[j] = b[B_WORK + j]
        most = b[B_OBS + n.O_AVAIL] if s[n.S_FUEL] > 0.0 else 0.0
        spool(s, min(1.0, max(0.0, c[n.C_THROTTLE])), most, par, k)
        go_on(s, c, wind, par, dt, scratch)
