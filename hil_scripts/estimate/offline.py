"""The onboard estimator run over a log, and the raw wind triangle beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from flightsw.filters.coloured import scaled_sigma
from hil_scripts.estimate.columns import Array, FlightLog
from hil_scripts.estimate.kinematic import KinematicInput, KinematicNav, KinematicParams

CHANNELS = ("airspeed", "beta", "alpha", "vel_n", "vel_e", "vel_d")


@dataclass(frozen=True)
class Track:
    """Estimate at every sample of a log. wind, sigma, probe, probe_sigma, air [n,3]; z, e [n,6] innovation over its 1-sigma and
    whitened (NaN at the first sample); P [n,6,6] covariance of wind and probe errors; held [3] probe errors the whole log has
    not shown, which stay at their prior; shown [3] share of their prior variance it has taken away.
    """

    wind: Array
    sigma: Array
    air: Array
    probe: Array
    probe_sigma: Array
    z: Array
    e: Array
    P: Array
    log_likelihood: float
    softened: int
    refused: int
    held: tuple[bool, bool, bool]
    shown: tuple[float, float, float]


# A vane the log does not have: the angle is taken as 0, wrong by an offset and by a part that lasts as long as a quick swing (a
# coordinated aircraft without sideslip; an incidence of some degrees that follows the load factor). The offset is considered and
# never estimated: what is wrong with an assumption is no constant, and turns would find one that suits them.
ASSUMED = {"beta": (0.03, 0.03), "alpha": (0.1, 0.05)}  # [rad] 1-sigma of the offset, of the rest
ASSUMED_S = 0.3  # [s] correlation time of the rest


def params_for(log: FlightLog, p: KinematicParams) -> KinematicParams:
    """The tuning for what a log holds: an angle that is assumed instead of measured is trusted accordingly."""
    step, (scale, beta, alpha) = float(np.median(np.diff(log.t))), p.observed_share
    if not log.vanes[0]:
        offset, rest = ASSUMED["beta"]
        p, beta = replace(p, probe_beta=offset, r_beta=scaled_sigma(rest, step, ASSUMED_S)), 1.0
    if not log.vanes[1]:
        offset, rest = ASSUMED["alpha"]
        p, alpha = replace(p, probe_alpha=offset, r_alpha=scaled_sigma(rest, step, ASSUMED_S)), 1.0
    return replace(p, observed_share=(scale, beta, alpha))


def run(log: FlightLog, params: KinematicParams) -> Track:
    """Run `KinematicNav` over the log, sample by sample, as it would run onboard: no look-ahead. Frozen readings are left out."""
    n = len(log)
    seen = np.where(np.stack([log.fresh(s) for s in ("airspeed", "beta", "alpha")], axis=-1), log.air, np.nan)
    att, vel = log.fresh("attitude").tolist(), log.fresh("velocity").tolist()
    nav = KinematicNav(params)
    wind, sigma, air, probe, psig = (np.full((n, 3), np.nan) for _ in range(5))
    z, e, P = np.full((n, 6), np.nan), np.full((n, 6), np.nan), np.full((n, 6, 6), np.nan)
    ll, soft, refused = 0.0, 0, 0
    f = KinematicInput()
    t_us = np.rint(log.t * 1e6).astype(np.int64).tolist()
    rows = zip(t_us, log.euler.tolist(), log.w_b.tolist(), log.vel_n.tolist(), seen.tolist(), strict=True)
    for k, (t, euler, w, v, a) in enumerate(rows):
        f.t_us, f.euler, f.w_b, f.vel_n, f.air = t, tuple(euler), tuple(w), tuple(v), tuple(a)
        f.att_ok, f.vel_ok = att[k], vel[k]
        o = nav.step(f)
        if not o.valid:
            continue
        wind[k], sigma[k], air[k], probe[k], psig[k] = o.wind_n, o.wind_sigma, o.air, o.probe, o.probe_sigma
        P[k] = o.P
        if len(o.codes) == 6:
            z[k], e[k] = o.innovation / o.innovation_sigma, o.whitened
            ll += o.log_likelihood
        soft += o.softened
        refused += o.refused
    return Track(wind, sigma, air, probe, psig, z, e, P, ll, soft, refused, nav.out.probe_held, nav.out.probe_shown)


def body_axes(log: FlightLog) -> Rotation:
    """Rotations body to NED at every sample (3-2-1 angles)."""
    return Rotation.from_euler("ZYX", log.euler)


def air_velocity(air: Array) -> Array:
    """Air-relative velocity [n,3] in body axes of (V, beta, alpha) [n,3]."""
    V, b, a = air.T
    return np.stack([V * np.cos(a) * np.cos(b), V * np.sin(b), V * np.sin(a) * np.cos(b)], axis=-1)


def triangle(log: FlightLog) -> Array:
    """Raw wind triangle [n,3] NED: ground velocity less the air-relative velocity, sample by sample, as logged."""
    return log.vel_n - body_axes(log).apply(air_velocity(log.air))


def implied_air(log: FlightLog, wind: Array) -> Array:
    """(V, beta, alpha) [n,3] that a probe without error would read in this wind [n,3] NED."""
    u = body_axes(log).apply(log.vel_n - wind, inverse=True)
    V = np.linalg.norm(u, axis=1)
    return np.stack([V, np.arcsin(u[:, 1] / V), np.arctan2(u[:, 2], u[:, 0])], axis=-1)
