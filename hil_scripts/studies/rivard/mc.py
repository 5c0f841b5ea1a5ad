"""Monte Carlo of the range-only rendezvous: N flights of one setting (named settings: cases.py).

Rendezvous i of master seed S reads row i % 256 of the normals of (S, block i // 256): any rendezvous can be flown again
alone, and results do not depend on the number of workers.
"""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flightsw.missions.rendezvous.guidance import RendezvousGuidanceParams, guidance_vector
from flightsw.missions.rendezvous.params import (
    KN,
    NM,
    RendezvousNavParams,
    eight_vector,
    new_window,
    nominal_velocity,
    three_vector,
)
from hil_scripts.studies.rivard import kernel as rk
from sim_plant.couplings import traffic_kernel as tr
from sim_plant.rng import generator

Array = np.ndarray
BLOCK = 256  # rendezvous drawn together
USUAL_S = 220.0  # beyond the time the aircraft take to close: what most rendezvous are over in
SEED = 20821
SAMPLE_S = (20.0, 60.0, 80.0, 120.0, 160.0, 180.0, 310.0)
KIND = {"truth": 0, "ekf3": 1, "ekf7": 2, "ekf8": 2, "ukf8": 3, "bank": 3}


@dataclass(frozen=True)
class Truth:
    """What the world does; factors multiply the sigmas of Rivard's population."""

    velocity: float = 1.0
    fluctuation: float = 1.0
    drift: float = 1.0
    walk: float = 1.0  # on the square root of q_y
    bias: float = 1.0
    noise: float = 1.0
    altitude: float = 1.0
    wind_x_mps: float = 0.0
    wind_y_mps: float = 0.0
    roll_rate_degps: float = 0.0  # of the tanker; 0: at once
    accel_mps2: float = 0.5 * KN
    # what the software does not know
    wind_error_mps: float = 0.0  # sigma, per axis
    bank_error_deg: float = 0.0  # sigma of a constant error of the bank flown
    speed_error_mps: float = 0.0  # sigma of a constant error of the airspeed flown
    turn_at_s: float = math.inf  # the receiver's manoeuvre
    turn_deg: float = 0.0
    turn_rate_degps: float = 1.5
    speed_change_mps: float = 0.0
    speed_accel_mps2: float = 0.5
    dropout: float = 0.0  # probability that a range is lost
    outage_s: tuple[float, float] = (0.0, 0.0)
    latency_s: float = 0.0
    stamped: bool = True  # ranges carry their time of validity


# the source's own filter and law; without a least bank the last degrees of some turns take minutes or never end
SEED_NAV = RendezvousNavParams(estimator="ekf3")
SEED_GUIDANCE = RendezvousGuidanceParams(
    law="closed_loop", steer=False, trim_mps=0.0, roll_rate_degps=0.0, bank_min_deg=0.3
)


@dataclass(frozen=True)
class RivardCase:
    """One setting: geometry, onboard parameters, truth, schedule."""

    nav: RendezvousNavParams = SEED_NAV
    guid: RendezvousGuidanceParams = SEED_GUIDANCE
    truth: Truth = field(default_factory=Truth)
    range_nm: float = 30.0
    offset_nm: float = 9.6  # of the tanker at the start
    sigma_y_nm: float = 1.0
    range_s: float = 10.0
    guidance_s: float = 0.0  # 0: after each range
    exact_start: bool = True  # rule A; False: at a guidance step (rule B)
    perfect: bool = False  # no estimator, guidance reads the truth
    guide_by_truth: bool = False  # guidance reads the truth, the estimator runs beside it
    bearing_deg: float = 0.0  # sigma; 0: no bearing
    datalink_m: float = 0.0
    t_max_s: float = 900.0
    y_hat_nm: float = 0.0

    def but(self, **changes: Any) -> RivardCase:
        """Copy with changes; `nav_x`, `guid_x`, `truth_x` change field x of these parts."""
        own: dict[str, Any] = {}
        parts: dict[str, dict[str, Any]] = {"nav": {}, "guid": {}, "truth": {}}
        for key, value in changes.items():
            head, _, tail = key.partition("_")
            if head in parts and tail:
                parts[head][tail] = value
            else:
                own[key] = value
        for name, change in parts.items():
            if change:
                own[name] = replace(own.get(name, getattr(self, name)), **change)
        return replace(self, **own)


@dataclass(frozen=True)
class RivardResult:
    """n rendezvous: rows [n,9] (rivard_kernel.R_*), samples [n,k,8] and states [n,k,16] at `times` [s]. SI. wall_s [s]."""

    rows: Array
    samples: Array
    states: Array
    seed: int
    first: int
    wall_s: float
    times: tuple[float, ...] = SAMPLE_S


def truth_vectors(case: RivardCase) -> tuple[Array, Array]:
    """Parameter vectors p, q of the plant's kernels; the population's numbers are the plant's own (rivard.md section 4)."""
    T = case.truth
    v = 396.0 * KN
    delta = math.asin(T.wind_y_mps / v)
    p = np.zeros(tr.P_N)
    p[tr.P_U] = -v * math.cos(delta) + T.wind_x_mps
    p[tr.P_SC], p[tr.P_SF], p[tr.P_TF] = 6.0 * KN * T.velocity, 10.0 * KN * T.fluctuation, 455.0
    p[tr.P_SY0], p[tr.P_SVY] = case.sigma_y_nm * NM, 0.55 * math.sqrt(2.0) * KN * T.drift
    p[tr.P_QY] = (500.0 * 0.3048) ** 2 / 600.0 * T.walk**2
    p[tr.P_A0], p[tr.P_SA], p[tr.P_RE] = 304.8, 150.0 * 0.3048 * T.altitude, 3444.0 * NM
    p[tr.P_SB], p[tr.P_SN], p[tr.P_TN] = 0.1 * NM * T.bias, 0.016 * NM * T.noise, 3.6
    p[tr.P_X0] = math.sqrt(case.range_nm**2 - case.offset_nm**2) * NM
    p[tr.P_MT], p[tr.P_MA], p[tr.P_MR] = T.turn_at_s, math.radians(T.turn_deg), math.radians(T.turn_rate_degps)
    p[tr.P_MV], p[tr.P_MD], p[tr.P_VR] = T.speed_change_mps, T.speed_accel_mps2, v
    q = np.zeros(tr.Q_N)
    q[tr.Q_WX], q[tr.Q_WY], q[tr.Q_ROLL] = T.wind_x_mps, T.wind_y_mps, math.radians(T.roll_rate_degps)
    q[tr.Q_ACC], q[tr.Q_G] = T.accel_mps2, 9.80665
    return p, q


def schedule(case: RivardCase) -> Array:
    """Schedule vector of rivard_kernel.fly."""
    T, s = case.truth, np.zeros(rk.SP_N)
    delta = math.asin(T.wind_y_mps / (396.0 * KN))
    s[rk.SP_MEAS], s[rk.SP_GUID], s[rk.SP_EXACT] = case.range_s, case.guidance_s, float(case.exact_start)
    s[rk.SP_TMAX], s[rk.SP_KIND] = case.t_max_s, 0 if case.perfect else KIND[case.nav.estimator]
    s[rk.SP_TRUE], s[rk.SP_BEARING] = float(case.guide_by_truth), math.radians(case.bearing_deg)
    s[rk.SP_LINK], s[rk.SP_PSI0], s[rk.SP_Y0] = case.datalink_m, -delta, -case.offset_nm * NM
    s[rk.SP_YHAT], s[rk.SP_SIGY] = case.y_hat_nm * NM, case.sigma_y_nm * NM
    s[rk.SP_SHIFT], s[rk.SP_SPAN] = float(case.nav.mean_shift), case.nav.grid_sigma
    from scipy.stats import norm  # slow to import: not for every list of studies

    s[rk.SP_DROP] = norm.ppf(T.dropout) if T.dropout > 0.0 else -math.inf
    s[rk.SP_OUT0], s[rk.SP_OUT1] = T.outage_s
    s[rk.SP_LATENCY], s[rk.SP_STAMPED], s[rk.SP_GATE] = T.latency_s, float(T.stamped), case.nav.gate_nis
    s[rk.SP_VT], s[rk.SP_WX], s[rk.SP_WY], s[rk.SP_VR] = (
        case.guid.speed_mps,
        T.wind_x_mps,
        T.wind_y_mps,
        case.nav.receiver_mps,
    )
    s[rk.SP_WIND_ERR], s[rk.SP_BANK_ERR] = T.wind_error_mps, math.radians(T.bank_error_deg)
    s[rk.SP_SPEED_ERR] = T.speed_error_mps
    return s


def draw(case: RivardCase, seed: int, block: int, late: bool = False) -> tuple[Array, Array, Array]:
    """Unit normals of a block: receiver W [256, 8 + 4 steps], sensors Z [256, 4 steps or 0], tanker V [256, 4].

    Enough for all but slow turns; `late` appends those for the rest of t_max_s, from generators of their own.
    """
    T = case.truth
    steps = int((case.range_nm * NM / (2.0 * 396.0 * KN) + USUAL_S) / case.range_s) + 2
    more = max(int(case.t_max_s / case.range_s) + 4 - steps, 1)
    used = case.bearing_deg > 0.0 or case.datalink_m > 0.0 or T.dropout > 0.0

    def normals(name: str, head: int, wanted: bool) -> Array:
        """Draws [BLOCK, head + 4 steps], with those of `late` behind; no columns where they are not wanted."""
        if not wanted:
            return np.zeros((BLOCK, 0))
        first = generator(seed, f"rendezvous.{name}.{block}").standard_normal((BLOCK, head + 4 * steps))
        if not late:
            return first
        return np.hstack((first, generator(seed, f"rendezvous.{name}.late.{block}").standard_normal((BLOCK, 4 * more))))

    own = T.wind_error_mps or T.bank_error_deg or T.speed_error_mps
    V = generator(seed, f"rendezvous.tanker.{block}").standard_normal((BLOCK, 4)) if own else np.zeros((BLOCK, 4))
    return normals("receiver", 8, True), normals("sensors", 0, used), V


def run_case(
    case: RivardCase,
    n: int,
    seed: int = SEED,
    workers: int = 2,
    first: int = 0,
    samples: bool = True,
    times: tuple[float, ...] = SAMPLE_S,
) -> RivardResult:
    """Fly rendezvous first ... first + n - 1 of `seed` over `workers` threads; the result does not depend on `workers`.

    What the filter says is kept at the first range at or after each of `times` [s] (ascending, at least a range period
    apart); samples = False leaves it out (samples and states are empty).

    Raises ValueError for n < 1, first < 0 or workers < 1.
    """
    if n < 1 or first < 0 or workers < 1:
        raise ValueError(f"n={n}, first={first}, workers={workers}; allowed >= 1, >= 0, >= 1")
    p, q = truth_vectors(case)
    sp, gp = schedule(case), guidance_vector(case.guid)
    u, _ = nominal_velocity(case.nav, case.truth.wind_x_mps, case.truth.wind_y_mps)
    e3, e8, window = three_vector(case.nav, u), eight_vector(case.nav, u), new_window(case.nav)
    M = case.nav.components if case.nav.estimator == "bank" and not case.perfect else 1
    at_s = np.array(times, dtype=np.float64)
    k = len(at_s) if samples else 0
    rows, sampled, states = np.zeros((n, rk.R_N)), np.zeros((n, k, rk.Q_N)), np.zeros((n, k, 16))

    def block(b: int) -> None:
        """Fly the rendezvous of block b that are asked for; those not done in the usual time again with `late` draws."""
        lo, hi = max(b * BLOCK, first), min((b + 1) * BLOCK, first + n)
        at = np.arange(lo, hi)
        for late in (False, True):
            W, Z, V = (a[at - b * BLOCK] for a in draw(case, seed, b, late))
            out, q3, st = np.zeros((len(at), rk.R_N)), np.zeros((len(at), k, rk.Q_N)), np.zeros((len(at), k, 16))
            rk.fly(W, Z, V, p, q, sp, e3, e8, gp, M, window, at_s, out, q3, st)
            rows[at - first], sampled[at - first], states[at - first] = out, q3, st
            at = at[out[:, rk.R_DONE] < 0.0]
            if not len(at):
                break

    began = time.perf_counter()
    blocks = range(first // BLOCK, (first + n - 1) // BLOCK + 1)
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(block, blocks))
    return RivardResult(rows, sampled, states, seed, first, time.perf_counter() - began, times if samples else ())
