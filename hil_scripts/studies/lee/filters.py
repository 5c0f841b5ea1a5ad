"""Run one estimator over the readings of a flight, and judge it against the truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flightsw.kernels.rotations import quat_from_euler
from flightsw.refusal import GateParams
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, Health, SensorFrame
from hil_scripts.campaign.consistency import chi2_band, convergence_time, nees, share_inside
from hil_scripts.studies.lee.flight import DT, Flight, study_aircraft

ALL = UPD_IMU | UPD_AIR | UPD_ATT | UPD_GNSS


@dataclass
class Estimate:
    """State [N,15] and 1-sigma [N,15] after each sample; covariance [N,15,15]; NIS [N] and its degrees of freedom [N]."""

    x: np.ndarray
    sigma: np.ndarray
    P: np.ndarray
    nis: np.ndarray
    dof: np.ndarray
    q_wind: np.ndarray


def run(p: NavParams, fl: Flight, y: np.ndarray, acc: np.ndarray) -> Estimate:
    """Estimator with parameters p on readings y [N,15] (channels as in layout.M_*) and specific force [N,3]."""
    # the works refuse no reading
    nav = AirframeNav(study_aircraft(), replace(p, gate=GateParams(false_alarm=0.0)))
    core, flt = nav.core, nav.core.ukf
    f, h = SensorFrame(), Health()
    n = len(fl.t)
    out = Estimate(
        np.zeros((n, 15)), np.zeros((n, 15)), np.zeros((n, 15, 15)), np.zeros(n), np.zeros(n, int), np.zeros(n)
    )
    q = np.zeros(4)
    f.air_mask, f.gyro_count = 1, 1
    for k in range(n):
        r = y[k].tolist()
        f.fuel_kg = float(fl.fuel[k])
        f.t_us = f.air_t_us = f.att_t_us = f.gnss_t_us = round(k * DT * 1e6) + 1
        f.air_V, f.air_beta, f.air_alpha = (r[0],), (r[1],), (r[2],)
        f.gyro_b = f.gyro_mean_b = (r[3], r[4], r[5])
        quat_from_euler(r[6], r[7], r[8], q)
        f.att_q_nb = (q[0], q[1], q[2], q[3])
        f.gnss_pos_n, f.gnss_vel_n = (r[9], r[10], r[11]), (r[12], r[13], r[14])
        f.acc_b = tuple(acc[k].tolist())
        o = nav.step(f, fl.u[k], h, ALL)
        out.x[k] = flt.x[:15]
        P = flt.P[:15, :15]
        out.P[k] = P
        out.sigma[k] = np.sqrt(np.diag(P))
        out.nis[k], out.dof[k] = o.nis, o.nis_dof
        out.q_wind[k] = core.q_wind
    return out


def calculated_wind(fl: Flight, y: np.ndarray, samples: int = 41) -> np.ndarray:
    """CMW [N,3]: causal moving mean of v - R_BI^T u_a from the readings alone (Lee 4.7)."""
    V, b, a = y[:, 0], y[:, 1], y[:, 2]
    ua = np.stack([V * np.cos(a) * np.cos(b), V * np.sin(b), V * np.sin(a) * np.cos(b)], axis=1)
    W = y[:, 12:15] - _to_nav(y[:, 6:9], ua)
    c = np.cumsum(np.vstack([np.zeros(3), W]), axis=0)
    n = np.arange(1, len(W) + 1)
    lo = np.maximum(n - samples, 0)
    return np.asarray((c[n] - c[lo]) / (n - lo)[:, None])


def _to_nav(e: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Body components v [N,3] to NED with psi, theta, phi e [N,3]."""
    c, s = np.cos(e), np.sin(e)
    x, yv, z = v.T
    # R1(phi)^T, then R2(theta)^T, then R3(psi)^T
    y1, z1 = c[:, 2] * yv - s[:, 2] * z, s[:, 2] * yv + c[:, 2] * z
    x2, z2 = c[:, 1] * x + s[:, 1] * z1, -s[:, 1] * x + c[:, 1] * z1
    return np.stack([c[:, 0] * x2 - s[:, 0] * y1, s[:, 0] * x2 + c[:, 0] * y1, z2], axis=1)


def wind_figures(
    t: np.ndarray, W: np.ndarray, est: np.ndarray, sigma: np.ndarray | None, after_s: float
) -> dict[str, float]:
    """Flat figures of a wind estimate est [N,3] against W [N,3] from `after_s` on; sigma [N,3] or None."""
    m = t >= after_s
    e = (est - W)[m]
    mag = np.linalg.norm(W[m], axis=1)
    pct = (np.linalg.norm(est[m], axis=1) - mag) / mag * 100.0
    d = np.arctan2(est[m, 1], est[m, 0]) - np.arctan2(W[m, 1], W[m, 0])
    d = np.degrees((d + math.pi) % (2 * math.pi) - math.pi)
    out = {
        "wind.magnitude_rms_pct": _rms(pct),
        "wind.magnitude_p95_pct": float(np.percentile(np.abs(pct), 95)),
        "wind.magnitude_max_pct": float(np.abs(pct).max()),
        "wind.direction_rms_deg": _rms(d),
        "wind.direction_p95_deg": float(np.percentile(np.abs(d), 95)),
        "wind.direction_max_deg": float(np.abs(d).max()),
    }
    for i, a in enumerate("ned"):
        out[f"wind.rms_mps.{a}"] = _rms(e[:, i])
    if sigma is not None:
        out["wind.inside_3sigma_pct"] = 100.0 * float(share_inside(e, sigma[m], 3.0))
        steady = 3.0 * sigma[m].mean(axis=0)
        for i, a in enumerate("ned"):
            out[f"wind.convergence_s.{a}"] = float(convergence_time(t, (est - W)[:, i], float(steady[i]), 2.0))
    return out


def consistency(t: np.ndarray, x: np.ndarray, est: Estimate, after_s: float) -> dict[str, float]:
    """Mean NEES of the 15 states and of the wind alone, share of samples inside the single-run 95 % band, mean NIS per
    degree of freedom."""
    m = t >= after_s
    e = (est.x - x)[m]
    e[:, 6] = (e[:, 6] + math.pi) % (2 * math.pi) - math.pi
    v = nees(e, est.P[m])
    w = nees(e[:, 12:15], est.P[m][:, 12:15, 12:15])
    lo, hi = chi2_band(15)
    return {
        "nees.mean": float(np.mean(v)),
        "nees.wind_mean": float(np.mean(w)),
        "nees.inside_pct": 100.0 * float(np.mean((v >= lo) & (v <= hi))),
        "nis.per_dof": float(np.mean(est.nis[m] / np.maximum(est.dof[m], 1))),
    }


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
