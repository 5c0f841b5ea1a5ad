"""Monte Carlo of the meeting with its rules: N flights of one geometry (named settings: geometry.py).

Normals are those of mc.py's streams, long enough for a leg after the turn: rendezvous i of a seed meets the same receiver in
every geometry.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from flightsw.missions.rendezvous.guidance import (
    MeetingParams,
    RendezvousGuidanceParams,
    guidance_vector,
    meeting_vector,
)
from flightsw.missions.rendezvous.params import (
    RangeRules,
    RendezvousNavParams,
    eight_vector,
    fixes_vector,
    kept_bank,
    kept_fixes,
    new_window,
    plain_rules,
    rules_vector,
)
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard.mc import BLOCK, KN, NM, SEED, RivardCase, Truth, truth_vectors
from sim_plant.couplings import traffic_kernel as tr
from sim_plant.rng import generator

Array = np.ndarray
RULES = RangeRules(
    believed=2, repeat_m=0.1, young_z=3.719, open=True, open_back=4, open_turn_deg=40.0, open_speed_mps=30.0
)
NAV = RendezvousNavParams(
    estimator="bank", components=15, gate_nis=25.0, window_nis=4.64, window_drift=15.1, rules=RULES
)
GUIDANCE = RendezvousGuidanceParams(
    law="two_arc", lead_s=-1.0, offset_bank_deg=24.56, meeting=MeetingParams(on=True, straight=True, doubt=True)
)  # the product's (flightsw/params/rendezvous.toml) by ranges alone, without its aircraft's lag
LOST_S = 35.0  # TrackParams.lost_s
TRUTH = Truth(roll_rate_degps=5.0)


@dataclass(frozen=True)
class Fault:
    """What the set does wrong from at_s on, for for_s [s]."""

    at_s: float = math.inf
    for_s: float = 1.0
    add_m: float = 0.0
    stuck: bool = False
    silent: bool = False


@dataclass(frozen=True)
class GeometryCase:
    """One setting. Positive offset: tanker to the right of the track (y < 0), as printed."""

    nav: RendezvousNavParams = NAV
    guid: RendezvousGuidanceParams = GUIDANCE
    truth: Truth = TRUTH
    fault: Fault = field(default_factory=Fault)
    range_nm: float = 30.0
    offset_nm: float = 9.6
    heading_deg: float = 0.0  # of the tanker at the start, from towards the receiver, to the left
    sigma_y_nm: float = 1.0
    receiver_kn: float = 0.0  # faster than planned
    known_s: float = math.inf  # guidance reads the truth from then on
    bearing_deg: float = 0.0
    bearing_bias_deg: float = 0.0
    bearing_s: float = 0.0  # between bearings; 0: one with every range, white
    bearing_tau_s: float = 0.0  # correlation time of their error
    link_m: float = 0.0
    link_bias_m: float = 0.0
    link_s: float = 0.0
    link_tau_s: float = 0.0
    link_late_s: float = 0.0
    link_gone: float = 0.0  # share of the positions lost
    range_s: float = 10.0
    guidance_s: float = 0.5
    t_max_s: float = 1100.0


def setting_vector(c: GeometryCase) -> Array:
    """Setting vector sp of geometry_kernel.fly."""
    s = np.zeros(gk.SP_N)
    delta = math.asin(c.truth.wind_y_mps / (396.0 * KN))
    s[gk.SP_MEAS], s[gk.SP_GUID], s[gk.SP_TMAX], s[gk.SP_KNOWN] = c.range_s, c.guidance_s, c.t_max_s, c.known_s
    s[gk.SP_BEARING], s[gk.SP_BEARING_BIAS] = math.radians(c.bearing_deg), math.radians(c.bearing_bias_deg)
    s[gk.SP_BEARING_R] = math.radians(c.nav.bearing_sigma_deg) ** 2
    s[gk.SP_LINK], s[gk.SP_LINK_BIAS], s[gk.SP_LINK_R] = c.link_m, c.link_bias_m, c.nav.datalink_sigma_m**2
    s[gk.SP_PSI0], s[gk.SP_Y0] = math.radians(c.heading_deg) - delta, -c.offset_nm * NM
    s[gk.SP_YHAT], s[gk.SP_SIGY] = 0.0, c.sigma_y_nm * NM
    s[gk.SP_SHIFT], s[gk.SP_SPAN] = float(c.nav.mean_shift), c.nav.grid_sigma
    s[gk.SP_WX], s[gk.SP_WY], s[gk.SP_WIND_ERR] = c.truth.wind_x_mps, c.truth.wind_y_mps, c.truth.wind_error_mps
    s[gk.SP_VR] = c.nav.receiver_mps
    f = c.fault
    s[gk.SP_FAULT0], s[gk.SP_FAULT1], s[gk.SP_ADD] = f.at_s, f.at_s + f.for_s, f.add_m
    s[gk.SP_BEARING_DT], s[gk.SP_BEARING_TAU] = c.bearing_s, c.bearing_tau_s
    s[gk.SP_LINK_DT], s[gk.SP_LINK_TAU], s[gk.SP_LINK_LATE] = c.link_s, c.link_tau_s, c.link_late_s
    s[gk.SP_LINK_GONE] = NormalDist().inv_cdf(c.link_gone) if c.link_gone > 0.0 else -math.inf
    s[gk.SP_STUCK], s[gk.SP_SILENT], s[gk.SP_LOST] = f.stuck, f.silent, LOST_S
    return s


def own_rates(c: GeometryCase) -> list[float]:
    """Periods [s] of what comes at a rate of its own."""
    return [dt for dt in (c.bearing_s, c.link_s) if dt > 0.0]


def draw(c: GeometryCase, seed: int, b: int) -> tuple[Array, Array, Array, Array]:
    """Unit normals W, Z, V, U of block b of `seed` as geometry_kernel.fly takes them, BLOCK rows each.

    A receiver looked at more often has more of them behind those of ranges alone: at the start it is the same.
    """
    steps = int(c.t_max_s / c.range_s) + 6
    more = sum(int(c.t_max_s / dt) + 6 for dt in own_rates(c))
    W = generator(seed, f"rendezvous.receiver.{b}").standard_normal((BLOCK, 8 + 4 * steps))
    Z = generator(seed, f"rendezvous.sensors.{b}").standard_normal((BLOCK, 3 + 3 * steps))
    V = generator(seed, f"rendezvous.tanker.{b}").standard_normal((BLOCK, 4))
    U = generator(seed, f"rendezvous.own_rate.{b}").standard_normal((BLOCK, 3 + 7 * more))
    return np.hstack([W, U[:, 3 + 3 * more :]]), Z, V, U


def run_geometry(case: GeometryCase, n: int, seed: int = SEED, workers: int = 1) -> Array:
    """Rows [n, 20] (geometry_kernel.R_*) of meetings 0 to n - 1 of `seed`, SI.

    Raises ValueError for n < 1 or workers < 1, and for rates of their own that do not fit.
    """
    if n < 1 or workers < 1:
        raise ValueError(f"n={n}, workers={workers}; allowed >= 1")
    rates = own_rates(case)
    if rates and not (case.nav.aids.on and case.link_late_s < min(rates)):
        raise ValueError("bearing_s, link_s > 0: allowed with nav.aids.on and link_late_s below both")
    p, q = truth_vectors(
        RivardCase(truth=case.truth, range_nm=case.range_nm, offset_nm=abs(case.offset_nm), sigma_y_nm=case.sigma_y_nm)
    )
    p[tr.P_U] -= case.receiver_kn * KN
    sp, gp, mp, rp = (
        setting_vector(case),
        guidance_vector(case.guid),
        meeting_vector(case.guid.meeting),
        rules_vector(case.nav),
    )
    e, w, M = eight_vector(case.nav, 0.0), new_window(case.nav), case.nav.components
    rows = np.zeros((n, gk.R_N))

    def block(b: int) -> None:
        """Fly the meetings of block b that are asked for."""
        lo, hi = b * BLOCK, min((b + 1) * BLOCK, n)
        W, Z, V, U = (a[: hi - lo] for a in draw(case, seed, b))
        room = (*kept_bank(case.nav, M), *kept_fixes(case.nav, M))
        gk.fly(W, Z, V, U, p, q, sp, e, gp, mp, rp, plain_rules(rp), fixes_vector(case.nav), M, w, *room, rows[lo:hi])

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(block, range((n - 1) // BLOCK + 1)))
    return rows


def changed(c: GeometryCase, **changes: object) -> GeometryCase:
    """Copy of a setting with changes; `nav_x`, `guid_x`, `meet_x`, `truth_x` change field x of these parts."""
    own: dict[str, object] = {}
    parts: dict[str, dict[str, object]] = {"nav": {}, "guid": {}, "truth": {}, "meet": {}, "rules": {}}
    for key, value in changes.items():
        head, _, tail = key.partition("_")
        if head in parts and tail:
            parts[head][tail] = value
        else:
            own[key] = value
    if parts["rules"]:
        parts["nav"]["rules"] = replace(c.nav.rules, **parts["rules"])  # type: ignore[arg-type]
    guid = replace(c.guid, **parts["guid"])  # type: ignore[arg-type]
    guid = replace(guid, meeting=replace(guid.meeting, **parts["meet"]))  # type: ignore[arg-type]
    own |= {"nav": replace(c.nav, **parts["nav"]), "guid": guid, "truth": replace(c.truth, **parts["truth"])}  # type: ignore[arg-type]
    return replace(c, **own)  # type: ignore[arg-type]
