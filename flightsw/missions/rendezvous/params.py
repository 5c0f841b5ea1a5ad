"""Parameters of the rendezvous estimators and the vectors their kernels read."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous.aid_errors import N14
from flightsw.strict import ConfigError, OneOf, Range

NM = 1852.0
KN = 1852.0 / 3600.0
FT = 0.3048

SPREAD = 8  # least components that turns and speeds can share
ESTIMATORS = ("ekf3", "ekf7", "ekf8", "ukf8", "bank")


@dataclass(frozen=True)
class RangeRules:
    """What becomes of ranges that do not fit (missions/rendezvous/range_rules.py). Zeros: none of it, as printed."""

    believed: Annotated[int, Range(0, 10)] = 0  # ranges refused in a row, agreeing, that are believed; 0: never
    early: Annotated[int, Range(0, 60)] = 4  # ranges after the first within which they mean a new start
    agree_m: Annotated[float, Range(1.0)] = 1000.0  # between the innovations of two refused ranges that agree
    repeat_m: Annotated[float, Range(0.0, 10.0)] = 0.0  # closer than this to the last range: stuck; 0: not judged
    young_z: Annotated[float, Range(0.0, 8.0)] = (
        0.0  # normal quantile at which a window not yet full warns; 0: it does not
    )
    open: bool = False  # a warning opens the estimate
    open_vx_mps: Annotated[float, Range(0.0, 200.0)] = 15.0 * KN  # sigma added then
    open_vy_mps: Annotated[float, Range(0.0, 200.0)] = 50.0 * KN
    open_x_m: Annotated[float, Range(0.0, 5000.0)] = 100.0
    open_y_m: Annotated[float, Range(0.0, 5000.0)] = 300.0
    open_back: Annotated[int, Range(0, 10)] = (
        0  # ranges it is first taken back by, then the bank is spread; 0: it is not
    )
    open_turn_deg: Annotated[float, Range(0.0, 90.0)] = 0.0  # over turns up to this
    open_speed_mps: Annotated[float, Range(0.0, 100.0)] = 0.0  # and over changes of speed up to this


@dataclass(frozen=True)
class Aids:
    """Bearings and positions at a rate of their own (missions/rendezvous/fix_rules.py): their errors as states. Their sigmas,
    `bearing_sigma_deg` and `datalink_sigma_m`, are then those of the correlated part. Off: white, one with every range."""

    on: bool = False
    bearing_tau_s: Annotated[float, Range(0.1)] = 5.0  # correlation time of a bearing's error
    bearing_constant_deg: Annotated[float, Range(0.0, 45.0)] = 0.3  # sigma of what stays of it
    link_tau_s: Annotated[float, Range(0.1)] = 5.0
    link_constant_m: Annotated[float, Range(0.0, 5000.0)] = 5.0
    limit: Annotated[float, Range(0.0, 10.0)] = (
        4.6  # of a sum of innovations, in sigma, beyond which the receiver is off its plan
    )
    fade_s: Annotated[float, Range(0.1)] = 5.0  # in which the sums forget
    back_s: Annotated[float, Range(0.0, 60.0)] = 10.0  # the estimate is taken back by when it is opened
    stir_m2ps3: Annotated[float, Range(0.0)] = 50.0  # noise of the velocity then: a turn noticed goes on
    noisy_s: Annotated[float, Range(0.0, 120.0)] = 10.0  # for so long
    kept: Annotated[int, Range(2, 200)] = 40  # of what was heard


WHITE = (
    0.01  # share of an error's variance that is left white where it is a state: the states need not explain all of it
)


@dataclass(frozen=True)
class RendezvousNavParams:
    """Choice and tuning of the estimator; the defaults are Rivard's population of receivers and TACAN sets."""

    estimator: Annotated[str, OneOf(ESTIMATORS)] = "bank"
    components: Annotated[int, Range(3, 101)] = 57  # of the bank: 15 for a radar prior of 1 NM, 57 without
    grid_sigma: Annotated[float, Range(1.0, 6.0)] = 3.5  # half width of the bank in sigma of the lateral prior
    receiver_mps: Annotated[float, Range(50.0, 350.0)] = 396.0 * KN  # planned true airspeed of the receiver
    altitude_separation_m: Annotated[float, Range(0.0, 3000.0)] = 1000.0 * FT  # planned, tanker above or below
    velocity_sigma_mps: Annotated[float, Range(0.0, 100.0)] = 6.0 * KN  # constant part, along track
    fluctuation_sigma_mps: Annotated[float, Range(0.01, 100.0)] = 10.0 * KN  # fluctuating part
    fluctuation_tau_s: Annotated[float, Range(1.0)] = 455.0
    drift_sigma_mps: Annotated[float, Range(0.0, 50.0)] = 0.55 * math.sqrt(2.0) * KN  # inertial drift across track
    walk_m2ps: Annotated[float, Range(0.0)] = (500.0 * FT) ** 2 / 600.0  # random walk across track
    altitude_sigma_m: Annotated[float, Range(0.0, 500.0)] = 150.0 * FT
    range_bias_sigma_m: Annotated[float, Range(0.0, 2000.0)] = 0.1 * NM
    range_noise_sigma_m: Annotated[float, Range(0.0, 2000.0)] = 0.016 * NM
    range_noise_tau_s: Annotated[float, Range(0.1)] = 3.6
    range_white_m2: Annotated[float, Range(0.0)] = 1e-6 * NM * NM  # white part left beside the states
    earth_radius_m: Annotated[float, Range(1e6)] = 3444.0 * NM
    ekf3_r_m2: Annotated[float, Range(1.0)] = 0.010256 * NM * NM
    ekf3_qx_m2ps3: Annotated[float, Range(0.0)] = 1.696e-8 * NM * NM
    ekf3_qy_m2ps: Annotated[float, Range(0.0)] = 2.521e-3 * NM * NM
    ekf3_cross_term: bool = False  # the term -X Y P13/d^3 the source's bias correction drops
    mean_shift: bool = True  # second-order mean of the first along-track position
    bearing_sigma_deg: Annotated[float, Range(0.01, 45.0)] = 2.0
    datalink_sigma_m: Annotated[float, Range(0.1, 5000.0)] = 100.0  # receiver's own position, per axis
    aids: Aids = field(default_factory=Aids)
    gate_nis: Annotated[float, Range(0.0)] = 0.0  # a range with a larger NIS is refused; 0: none is
    window: Annotated[int, Range(2, 60)] = 6  # innovations judged together
    window_nis: Annotated[float, Range(1.0)] = 3.75  # mean NIS that warns: chi-square, 6 degrees, 1 in 1000
    window_drift: Annotated[float, Range(1.0)] = 10.83  # (sum of normalised innovations)^2/n: chi-square, 1 degree
    rules: RangeRules = field(default_factory=RangeRules)

    def __post_init__(self) -> None:
        """Raises ConfigError where rules are asked of a filter that has none, or cannot obey them."""
        if self.estimator == "ekf3" and (self.rules.believed or self.rules.repeat_m or self.rules.open):
            raise ConfigError(
                "estimator = 'ekf3': allowed with rules.believed = 0, rules.repeat_m = 0, rules.open = false"
            )
        r = self.rules
        wide = (r.open_turn_deg > 0.0, r.open_speed_mps > 0.0)
        if r.open_back and not (self.estimator == "bank" and self.components >= SPREAD and all(wide)):
            raise ConfigError(
                f"rules.open_back = {r.open_back}: allowed with estimator = 'bank', components >= {SPREAD}, "
                "rules.open_turn_deg > 0, rules.open_speed_mps > 0"
            )
        if self.aids.on and not (r.open and r.open_back):
            raise ConfigError("aids.on = true: allowed with rules.open = true and rules.open_back >= 1")
        if not self.aids.on and self.aids != Aids():
            raise ConfigError("aids.on = false: allowed with its other keys left out")
        if any(wide) and not r.open_back:
            raise ConfigError("rules.open_turn_deg, rules.open_speed_mps: allowed with rules.open_back >= 1")


def three_vector(p: RendezvousNavParams, u: float) -> np.ndarray:
    """Parameter vector of the three-state kernels; u nominal along-track ground velocity of the receiver [m/s]."""
    e = np.zeros(k3.E3_N)
    e[k3.E3_U], e[k3.E3_A0], e[k3.E3_R] = u, p.altitude_separation_m, p.ekf3_r_m2
    e[k3.E3_QX], e[k3.E3_QY] = p.ekf3_qx_m2ps3, p.ekf3_qy_m2ps
    e[k3.E3_VAR0] = p.range_bias_sigma_m**2 + p.range_noise_sigma_m**2
    e[k3.E3_VARV] = p.velocity_sigma_mps**2 + p.fluctuation_sigma_mps**2
    e[k3.E3_CROSS] = 1.0 if p.ekf3_cross_term else 0.0
    return e


def eight_vector(p: RendezvousNavParams, u: float) -> np.ndarray:
    """Parameter vector of the full-order kernels; ekf7 takes the correlated range error as white."""
    seven = p.estimator == "ekf7"
    e = np.zeros(k8.E8_N)
    e[k8.E8_U], e[k8.E8_A0], e[k8.E8_RE] = u, p.altitude_separation_m, p.earth_radius_m
    e[k8.E8_R] = p.range_white_m2 + (p.range_noise_sigma_m**2 if seven else 0.0)
    e[k8.E8_TF], e[k8.E8_SF] = p.fluctuation_tau_s, p.fluctuation_sigma_mps
    e[k8.E8_TN], e[k8.E8_SN] = p.range_noise_tau_s, 0.0 if seven else p.range_noise_sigma_m
    e[k8.E8_QY], e[k8.E8_SC], e[k8.E8_SY] = p.walk_m2ps, p.velocity_sigma_mps, p.drift_sigma_mps
    e[k8.E8_SA], e[k8.E8_SB] = p.altitude_sigma_m, p.range_bias_sigma_m
    a = p.aids
    e[k8.E8_BC], e[k8.E8_BS] = math.radians(a.bearing_constant_deg), math.radians(p.bearing_sigma_deg)
    e[k8.E8_LC], e[k8.E8_LS] = a.link_constant_m, p.datalink_sigma_m
    e[k8.E8_BT], e[k8.E8_LT] = a.bearing_tau_s, a.link_tau_s
    return e


def states(p: RendezvousNavParams) -> int:
    """States of a component."""
    return N14 if p.aids.on else k8.N8


def fixes_vector(p: RendezvousNavParams) -> np.ndarray:
    """Parameter vector fp of missions/rendezvous/fix_rules.py."""
    q = np.zeros(kf.FP_N)
    q[kf.FP_LIMIT], q[kf.FP_FADE], q[kf.FP_BACK] = p.aids.limit, p.aids.fade_s, p.aids.back_s
    q[kf.FP_STIR], q[kf.FP_SETTLE] = p.aids.stir_m2ps3, p.aids.noisy_s
    q[kf.FP_RB], q[kf.FP_RL] = WHITE * math.radians(p.bearing_sigma_deg) ** 2, WHITE * p.datalink_sigma_m**2
    return q


def kept_fixes(p: RendezvousNavParams, M: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Room for what M components heard, and their estimates before it (missions/rendezvous/fix_rules.py, note)."""
    K, n = p.aids.kept if p.aids.on else 0, states(p)
    return np.zeros((K, kf.F_N)), np.zeros((K, M, n + 2)), np.zeros((K, M, n, n))


def rules_vector(p: RendezvousNavParams) -> np.ndarray:
    """Parameter vector rp of missions/rendezvous/range_rules.py."""
    r, q = p.rules, np.zeros(kr.RP_N)
    q[kr.RP_GATE], q[kr.RP_ROW], q[kr.RP_EARLY], q[kr.RP_AGREE] = p.gate_nis, r.believed, r.early, r.agree_m
    q[kr.RP_STUCK], q[kr.RP_OPEN], q[kr.RP_YOUNG] = r.repeat_m, 1.0 if r.open else 0.0, r.young_z
    q[kr.RP_OPEN_VX], q[kr.RP_OPEN_VY], q[kr.RP_OPEN_X], q[kr.RP_OPEN_Y] = (
        r.open_vx_mps,
        r.open_vy_mps,
        r.open_x_m,
        r.open_y_m,
    )
    q[kr.RP_BACK], q[kr.RP_TURN], q[kr.RP_PACE] = r.open_back, math.radians(r.open_turn_deg), r.open_speed_mps
    return q


def plain_rules(rp: np.ndarray) -> np.ndarray:
    """Copy of rp by which a range does not itself open the estimate (missions/rendezvous/fix_rules.py, heard_range)."""
    q = rp.copy()
    q[kr.RP_OPEN] = q[kr.RP_BACK] = 0.0
    return q


def kept_bank(p: RendezvousNavParams, M: int) -> tuple[np.ndarray, np.ndarray]:
    """Room for the estimates of M components that are kept (missions/rendezvous/range_rules.py, keep)."""
    K, n = p.rules.open_back, states(p)
    return np.zeros((K, M, n + 2)), np.zeros((K, M, n, n))


def new_window(p: RendezvousNavParams) -> np.ndarray:
    """Empty window of normalised innovations with the limits of p (missions/rendezvous/range_filter.py, window_push)."""
    w = np.zeros(k3.W_HEAD + p.window)
    w[k3.W_LIMIT], w[k3.W_DRIFT_LIMIT] = p.window_nis, p.window_drift
    return w


def nominal_velocity(p: RendezvousNavParams, wind_x: float, wind_y: float) -> tuple[float, float]:
    """(u, delta): along-track ground velocity [m/s] and drift correction [rad] of a receiver holding its track in wind.

    delta = asin(w_y/v_R), u = -v_R cos(delta) + w_x; a crosswind beyond the airspeed is taken as just below it.
    """
    s = min(max(wind_y / p.receiver_mps, -0.99), 0.99)
    return -p.receiver_mps * math.sqrt(1.0 - s * s) + wind_x, math.asin(s)
