"""Flight in the vertical plane through the heading: its two angles, the readings of one probe, and the state it publishes."""

from __future__ import annotations

import math

from flightsw.health import AIR_ALPHA, AIR_V
from flightsw.types import UPD_AIR, NavState, Quat, SensorFrame, Vec3

AIR_USED = AIR_V | AIR_ALPHA  # readings of the probe; sideslip has no place in the plane
AIRSPEED_BAD, VANE_BAD = 1, 1 << 6  # bits of SensorFrame.air_bad: probe 0, V and alpha


def heading_and_pitch(q_nb: Quat) -> tuple[float, float]:
    """psi, theta [rad] of a unit quaternion, body to navigation axes."""
    w, x, y, z = q_nb
    psi = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return psi, math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))


def probe(f: SensorFrame, updated: int) -> tuple[float | None, float | None]:
    """Airspeed [m/s] and incidence [rad] of the one probe; None: not new, or refused."""
    if not updated & UPD_AIR or not f.air_mask & 1:
        return None, None
    V, *_ = f.air_V
    alpha, *_ = f.air_alpha
    return None if f.air_bad & AIRSPEED_BAD else V, None if f.air_bad & VANE_BAD else alpha


def publish(
    *, t_us: int, valid: bool, reason: str, psi: float, theta: float, q: float, V: float, alpha: float,
    place: tuple[float, float], height: float, along: float, climb: float, wind_along: float, wind_down: float,
    wind_sigma: Vec3, pos_sigma: Vec3, pitch_sigma: float, nis: float, nis_dof: int,
) -> NavState:  # fmt: skip
    """An estimate in the plane as the state every aircraft publishes; across the heading neither speed nor wind is known.

    psi, theta [rad], q [rad/s]; V [m/s], alpha [rad] through the air; place (north, east) and height [m]; along, climb [m/s] over
    ground; wind_along, wind_down [m/s]; sigmas NED in the same units.
    """
    c, n = math.cos(psi), math.sin(psi)
    ct, st, cp, sp = math.cos(0.5 * theta), math.sin(0.5 * theta), math.cos(0.5 * psi), math.sin(0.5 * psi)
    return NavState(
        t_us=t_us, valid=valid, reason=reason, V=V, beta=0.0, alpha=alpha, w_b=(0.0, q, 0.0), euler=(psi, theta, 0.0),
        q_nb=(cp * ct, -sp * st, cp * st, sp * ct), pos_n=(*place, -height), vel_n=(c * along, n * along, -climb),
        wind_n=(c * wind_along, n * wind_along, wind_down), wind_sigma=wind_sigma, pos_sigma=pos_sigma,
        att_sigma=(0.0, pitch_sigma, 0.0), nis=nis, nis_dof=nis_dof,
    )  # fmt: skip
