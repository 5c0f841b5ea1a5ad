"""One kinematic flight through the onboard position estimators, and what their errors are per leg (sevil.md 8.3 to 8.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.contour.algorithms import locate
from flightsw.missions.receiver.airdata.fdi.monitor import Fdi, FdiParams
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_filter import WakePosition
from flightsw.missions.receiver.airdata.wake_fix import MlParams
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.missions.receiver.airdata.wake_search import WakeMl, frame_vector
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil.flight import LEG_NAMES, RATE_HZ, AirFlight

Arr = m.Arr
Index = NDArray[np.signedinteger[Any]]
ALL_OK = 0b111111111
STEP_US = round(1e6 / RATE_HZ)
VIRTUAL = (0.39, math.radians(0.15), math.radians(0.15))  # 1-sigma of the predicted common value (sevil.md 9.4)
SETTLE_S = 10.0  # [s] of the flight before figures count
VARIANTS: dict[str, dict[str, Any]] = {
    "fixed": {"scales": False, "height": False},
    "augmented": {"scales": True, "height": False},
    "height": {"scales": True, "height": True},
}
FLOWN = "height"  # the variant whose switches are the flight defaults


@dataclass(frozen=True)
class Track:
    """Output of one estimator at times t [N] s: pos [N,2] y, z [m] (NaN: none), sigma [N,2] m; and, of the filters, valid [N],
    nis [N] and dof [N], scale [N,2], height [N] m, excluded [N] channel mask, alarm [N] variables, gap [N,9] reading minus
    expectation at the prior and S [N,3,3,3] covariance of the expectation by variable (NaN: not tracking), restarts."""

    t: Arr
    pos: Arr
    sigma: Arr
    valid: np.ndarray
    nis: Arr
    dof: np.ndarray
    scale: Arr
    height: Arr
    excluded: np.ndarray
    alarm: np.ndarray
    gap: Arr
    S: Arr
    restarts: int


def params(variant: str) -> WakePositionParams:
    """Parameters of a filter variant: circulations frozen, estimated, and with the height of the vortices besides."""
    return WakePositionParams(sigma_V=m.SIGMA[0], sigma_beta=m.SIGMA[1], sigma_alpha=m.SIGMA[2], **VARIANTS[variant])


def track(
    f: AirFlight,
    variant: str = "augmented",
    fdi: FdiParams | None = None,
    guess: tuple[float, float, float] | None = None,
    keep_prior: bool = False,
    virtual: tuple[float, float, float] = VIRTUAL,
) -> Track:
    """Run the filter along a flight. guess = (y, z, sigma) [m] seeds it, None lets it find itself. fdi: channels the monitor
    excludes are kept from the filter; None uses all nine always."""
    est = WakePosition(m.receiver(), params(variant), WakeParams())
    monitor = Fdi(fdi) if fdi is not None else None
    if guess is not None:
        est.seed(*guess)
    n = len(f.t)
    pos, sigma, scale = np.full((n, 2), np.nan), np.full((n, 2), np.nan), np.ones((n, 2))
    valid, dof = np.zeros(n, bool), np.zeros(n, np.int64)
    nis, height = np.zeros(n), np.zeros(n)
    excluded, alarm = np.zeros(n, np.int64), np.zeros(n, np.int64)
    gap, S = (np.full((n, 9), np.nan), np.full((n, 3, 3, 3), np.nan)) if keep_prior else (np.zeros(0), np.zeros(0))
    dt = 1.0 / RATE_HZ
    x_dot = f.xi_dot[:, 0]
    for i in range(n):
        at, w, a = f.att_m[i], f.omega_m[i], f.acc_m[i]
        est.predict(
            i * STEP_US, (at[0], at[1], at[2]), (w[0], w[1], w[2]), (a[0], a[1], a[2]), float(f.x_m[i]), 1.0, m.V_MPS,
            m.RHO, dt if i else 0.0, float(x_dot[i]),
        )  # fmt: skip
        usable = ALL_OK
        if monitor is not None or keep_prior:
            prior = est.prior()
            e, cov = prior if prior is not None else (None, None)
            if keep_prior and prior is not None:
                gap[i] = f.readings[i] - prior[0]
                for v in range(3):
                    S[i, v] = prior[1][3 * v : 3 * v + 3, 3 * v : 3 * v + 3]
            if monitor is not None:
                status = monitor.step(f.readings[i], ALL_OK, e, cov, (0.0, 0.0, 0.0), virtual, i * STEP_US)
                usable = monitor.usable(ALL_OK)
                excluded[i], alarm[i] = status.excluded, status.alarm
        fix = est.update(f.readings[i], usable)
        if fix.valid or est.fix.nis_dof:
            pos[i] = fix.pos_f[1:]
            sigma[i] = math.sqrt(max(fix.cov_yy, 0.0)), math.sqrt(max(fix.cov_zz, 0.0))
        valid[i], nis[i], dof[i] = fix.valid, fix.nis, fix.nis_dof
        scale[i], height[i] = fix.scale, fix.height_m
    return Track(f.t, pos, sigma, valid, nis, dof, scale, height, excluded, alarm, gap, S, est.restarts)


def seconds(f: AirFlight) -> tuple[Index, Arr, Arr, Arr]:
    """1 s means of a flight, one per second: index of the middle sample [k], readings [k,9], measured attitude [k,3], rates."""
    n = round(RATE_HZ)
    k = len(f.t) // n

    def mean(a: Arr) -> Arr:
        return np.asarray(a[: k * n].reshape(k, n, -1).mean(axis=1))

    return np.arange(k) * n + n // 2, mean(f.readings), mean(f.att_m), mean(f.omega_m)


def contour_track(f: AirFlight, algorithm: int) -> tuple[Index, Arr]:
    """(index [k], position [k,2], NaN: none) of a contour algorithm on 1 s means: the small map at contact, the extended
    one before; both hold for x = -35.5 m and their fixed attitude."""
    at, y, _, _ = seconds(f)
    out = np.full((len(at), 2), np.nan)
    for j, i in enumerate(at):
        name = "small" if LEG_NAMES[f.leg[i]] == "contact" else "extended"
        out[j] = locate(algorithm, m.contours(name), y[j]) or (math.nan, math.nan)
    return at, out


def ml_track(f: AirFlight) -> tuple[Index, Arr]:
    """(index [k], position [k,2]) of differential maximum likelihood on 1 s means with the own attitude."""
    at, y, att, omega = seconds(f)
    ml = WakeMl(m.PROBES, MlParams(sigma_V=m.SIGMA[0], sigma_angle=m.SIGMA[1]), WakeParams())
    out = np.full((len(at), 2), np.nan)
    for j, i in enumerate(at):
        frame = frame_vector(float(f.x_m[i]), att[j], m.V_MPS, m.RHO, omega[j], float(f.xi_dot[i, 0]))
        fix = ml.locate(y[j], frame, round(RATE_HZ))
        if fix is not None:
            out[j] = fix.pos
    return at, out


def errors(e: Arr) -> dict[str, float]:
    """Figures of position errors [n,2] m (NaN: no position); `rms_m` is radial, in the y-z plane."""
    have = np.isfinite(e).all(axis=1)
    r = np.hypot(*e[have].T)
    out = {"available_pct": 100.0 * float(have.mean()) if len(e) else math.nan}
    if not len(r):
        return out
    return out | {
        "rms_m": float(np.sqrt(np.mean(r * r))), "p95_m": float(np.percentile(r, 95)), "max_m": float(r.max()),
        "median_m": float(np.median(r)), "rms_m.y": float(np.sqrt(np.mean(e[have, 0] ** 2))),
        "rms_m.z": float(np.sqrt(np.mean(e[have, 1] ** 2))),
    }  # fmt: skip


def leg_figures(f: AirFlight, at: Index, pos: Arr, name: str, valid: np.ndarray | None = None) -> dict[str, float]:
    """Errors per leg of positions [k,2] at the samples `at` [k]; the first seconds of the flight are left out. `available_pct`
    of a filter is the share of valid fixes; its errors count whether or not it says it is valid."""
    out: dict[str, float] = {}
    e = pos - f.xi[at, 1:]
    for i, leg in enumerate(LEG_NAMES):
        sel = (f.leg[at] == i) & (f.t[at] >= SETTLE_S)
        if sel.any():
            figures = errors(e[sel])
            if valid is not None:
                figures["available_pct"] = 100.0 * float(valid[sel].mean())
            out |= {f"{name}.{leg}.{k}": v for k, v in figures.items()}
    return out


def filter_figures(f: AirFlight, tr: Track, name: str) -> dict[str, float]:
    """Errors per leg, consistency per leg (NIS scaled to nine readings, share inside 2 sigma), what it learnt of the wake."""
    out = leg_figures(f, np.arange(len(f.t)), tr.pos, name, tr.valid)
    e = np.abs(tr.pos - f.xi[:, 1:])
    for i, leg in enumerate(LEG_NAMES):
        sel = (f.leg == i) & (f.t >= SETTLE_S) & (tr.dof > 0)
        if sel.any():
            out[f"{name}.{leg}.nis"] = float(np.mean(tr.nis[sel] * 9.0 / tr.dof[sel]))
            out[f"{name}.{leg}.inside_2sigma_pct"] = 100.0 * float(np.mean(e[sel] <= 2.0 * tr.sigma[sel]))
    late = f.t >= f.t[-1] - 60.0
    out |= {
        f"{name}.scale_wing": float(tr.scale[late, 0].mean()), f"{name}.scale_tail": float(tr.scale[late, 1].mean()),
        f"{name}.height_m": float(tr.height[late].mean()), f"{name}.restarts": float(tr.restarts),
    }  # fmt: skip
    return out
