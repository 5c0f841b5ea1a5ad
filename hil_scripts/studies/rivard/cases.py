"""Named settings of the range-only rendezvous: the rows of Rivard's tables, the improvements one by one, his open questions."""

from __future__ import annotations

import math

from hil_scripts.studies.rivard.mc import KN, NM, RivardCase

GAINS = (0, 1, 2, 3, 4, 6, 8, 10, 12)
PRINTED_GAINS = (3, 6, 9, 12)
SWEPT_TURNS = (5, 10, 20, 30, 45, -30)  # [deg] of the receiver, left positive
SWEPT_SPEEDS = (10, 20, 30, 50, 80, -50)  # [kn]


def _chart_early(offset_nm: float, lead_s: float) -> float:
    """Slant range [m] at which a tanker flying the chart turns lead_s before 17 NM, at nominal closing speed."""
    x = math.sqrt(17.0**2 - offset_nm**2) * NM + lead_s * 2.0 * 396.0 * KN
    return math.hypot(x, offset_nm * NM)


def _tables() -> dict[str, RivardCase]:
    """Tables 1 and 2, gain sweep, filter alone. Suffix a: turn when the time to go is zero; b: at the last update before."""
    a = RivardCase()
    b = a.but(exact_start=False, guid_lead_s=10.0)
    chart = a.but(guid_law="chart", offset_nm=7.0, perfect=True, range_s=1.0)
    wide = a.but(offset_nm=11.6, guid_lead_s=5.0)
    out = {
        "open": chart,
        "open_interpolated": chart.but(offset_nm=7.916, guid_chart_range_m=16.46 * NM),
        "t2_open": chart.but(offset_nm=9.0, guid_chart_range_m=_chart_early(9.0, 5.0)),
        "t2_cross": wide.but(guid_law="cross_track"),
        "t2_k3": wide,
    }
    for rule, base in (("a", a), ("b", b)):
        out[f"cross_{rule}"] = base.but(guid_law="cross_track")
        out[f"k2_{rule}"] = base.but(guid_gain=2.0)
        out[f"k3_{rule}"] = base
        out[f"true_k3_{rule}"] = base.but(perfect=True)
    for k in GAINS:
        out[f"gain_{k}"] = a.but(guid_gain=float(k))
    for k in PRINTED_GAINS:
        out[f"gain_printed_{k}"] = b.but(guid_gain=float(k), guid_guard=False)
    out["filter"] = a.but(guide_by_truth=True)
    out["filter_2s"] = a.but(guide_by_truth=True, range_s=2.0)
    out["filter_no_bias"] = a.but(guide_by_truth=True, truth_bias=0.0)
    out["loop_2s"] = a.but(range_s=2.0)
    out["filter_r_printed"] = a.but(nav_ekf3_r_m2=0.101 * NM**2)
    out["unaided_seed"] = a.but(range_nm=100.0, sigma_y_nm=6.149)
    out["seven_unaided"] = out["unaided_seed"].but(nav_estimator="ekf7")
    out["eight_30"] = a.but(nav_estimator="ekf8", guide_by_truth=True)
    return out


def _better() -> dict[str, RivardCase]:
    """The same sensor, one improvement after the other; b7re is the product with a radar prior."""
    b0 = RivardCase()
    b3 = b0.but(nav_estimator="ukf8")
    b4 = b0.but(nav_estimator="bank", nav_components=15)
    b5 = b4.but(guid_law="two_arc", guidance_s=0.5)
    b6 = b5.but(guid_steer=True)
    b7 = b6.but(guid_trim_mps=20.0 * KN)
    roll = {"guid_roll_rate_degps": 5.0, "truth_roll_rate_degps": 5.0}
    b7r = b7.but(**roll)
    unaided = {"range_nm": 100.0, "sigma_y_nm": 6.149, "nav_components": 57}
    out = {
        "b1": b0.but(nav_ekf3_qy_m2ps=2.5e-5 * NM**2, nav_ekf3_r_m2=0.003 * NM**2),
        "b2": b0.but(nav_estimator="ekf8"),
        "b3": b3,
        "b4": b4,
        "b5": b5,
        "b6": b6,
        "b7": b7,
        "b7r": b7r,
        "b7e": b7.but(guid_lead_s=-1.0),
        "b7re": b7r.but(guid_lead_s=-1.0),
        "b8": b7.but(nav_estimator="ekf3"),
        "unaided": b7.but(**unaided),
        "unaided_roll": b7r.but(**unaided),
        "unaided_best": b7r.but(**unaided, guid_lead_s=-1.0),
        "unaided_roll_no_trim": b7r.but(**unaided, guid_trim_mps=0.0),
        "weave_60": b7r.but(range_nm=60.0, sigma_y_nm=2.0, nav_components=21, guid_weave_deg=30.0),
        "roll_uncompensated": b0.but(truth_roll_rate_degps=5.0),
    }
    ukf = b7r.but(nav_estimator="ukf8")
    for deg in (2.0, 1.0, 0.5):
        name = f"bearing_{deg:g}".replace(".", "p")
        out[name] = ukf.but(bearing_deg=deg, nav_bearing_sigma_deg=deg)
        out[f"{name}_k3"] = b3.but(bearing_deg=deg, nav_bearing_sigma_deg=deg)
    for metres in (100.0, 10.0):
        out[f"link_{metres:g}"] = ukf.but(datalink_m=metres, nav_datalink_sigma_m=metres)
        out[f"link_{metres:g}_k3"] = b3.but(datalink_m=metres, nav_datalink_sigma_m=metres)
    out["perfect"] = b7r.but(perfect=True)
    return out


def _open_questions() -> dict[str, RivardCase]:
    """Sensitivity to the model, wind, and cases the source did not try. Suffix _seed: k = 3, else b7re."""
    better = _better()
    bases = {"_seed": RivardCase(), "": better["b7re"]}
    changes: dict[str, dict[str, object]] = {
        "bias_x2": {"truth_bias": 2.0},
        "noise_x2": {"truth_noise": 2.0},
        "fluctuation_x1p5": {"truth_fluctuation": 1.5},
        "velocity_x2": {"truth_velocity": 2.0},
        "drift_x5": {"truth_drift": 5.0, "truth_walk": 5.0},
        "all_four": {"truth_bias": 2.0, "truth_noise": 2.0, "truth_fluctuation": 1.5, "truth_velocity": 2.0},
        "dropout_30": {"truth_dropout": 0.3},
        "outage_60": {"truth_outage_s": (80.0, 140.0)},
        "latency_1_stamped": {"truth_latency_s": 1.0},
        "latency_1": {"truth_latency_s": 1.0, "truth_stamped": False},
        "wind_error_10": {"truth_wind_error_mps": 10.0 * KN},
        "tanker_errors": {"truth_bank_error_deg": 0.5, "truth_speed_error_mps": 2.0 * KN},
        "tanker_errors_x3": {"truth_bank_error_deg": 1.5, "truth_speed_error_mps": 6.0 * KN},
        "dropout_60": {"truth_dropout": 0.6},
        "outage_turn": {"truth_outage_s": (140.0, 200.0)},
        "latency_3_stamped": {"truth_latency_s": 3.0},
        "latency_3": {"truth_latency_s": 3.0, "truth_stamped": False},
        "wind_error_20": {"truth_wind_error_mps": 20.0 * KN},
        "turn_30_late": {"truth_turn_at_s": 120.0, "truth_turn_deg": 30.0},
        "faster_50_late": {"truth_turn_at_s": 120.0, "truth_speed_change_mps": 50.0 * KN},
    }
    for degrees in SWEPT_TURNS:
        changes[f"turn_{degrees}"] = {"truth_turn_at_s": 60.0, "truth_turn_deg": float(degrees)}
    for knots in SWEPT_SPEEDS:
        name = f"faster_{knots}" if knots > 0 else f"slower_{-knots}"
        changes[name] = {"truth_turn_at_s": 60.0, "truth_speed_change_mps": knots * KN}
    out = {f"{name}{tail}": base.but(**c) for name, c in changes.items() for tail, base in bases.items()}
    for kn, offset in ((30, 10.77), (60, 11.99)):
        wind = {"truth_wind_y_mps": kn * KN, "offset_nm": offset}
        out[f"crosswind_{kn}_seed"] = bases["_seed"].but(**wind)
        out[f"crosswind_{kn}"] = bases[""].but(**wind, guid_offset_m=offset * NM)
        along = {"truth_wind_x_mps": kn * KN}
        out[f"headwind_{kn}_seed"], out[f"headwind_{kn}"] = bases["_seed"].but(**along), bases[""].but(**along)
        chart = RivardCase().but(guid_law="chart", offset_nm=7.0, perfect=True, range_s=1.0)
        out[f"crosswind_{kn}_open"] = chart.but(truth_wind_y_mps=kn * KN)
    return out


CASES: dict[str, RivardCase] = {**_tables(), **_better(), **_open_questions()}


def case(name: str) -> RivardCase:
    """The named setting. Raises ValueError listing the known ones."""
    if name not in CASES:
        raise ValueError(f"case {name!r}: allowed: {', '.join(CASES)}")
    return CASES[name]
