"""Equation error: where the search for the most likely coefficients begins. Sensors are smoothed and differentiated, forces and
moments made dimensionless and fitted coefficient by coefficient (docs/sources/identification.md 2). Noise in the smoothed
readings pulls the derivatives of rates towards 0: a start, no result.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from flightsw.kernels.atmosphere import density
from hil_scripts.identify.flight.inputs import thrust_at
from hil_scripts.identify.flight.model import COEFFICIENTS, NC, FlightModel
from hil_scripts.identify.flight.output_error import likelihood
from hil_scripts.identify.regress import CONSTANT, least_squares

Arr = NDArray[np.float64]
SPAN_S, DEGREE = 0.9, 3  # of the polynomials that smooth
SURE = 0.3  # [-] of its size: a coefficient with a greater standard error begins at the file's value
REGRESSORS = {"CL": ("alpha", "q", "de"), "Cm": ("alpha", "q", "de"), "CY": ("beta", "p", "r", "dr"),
              "Cl": ("beta", "p", "r", "da", "dr"), "Cn": ("beta", "p", "r", "da", "dr")}  # fmt: skip


class Smoothed:
    """Smoothed readings on the grid of a flight model, and the coefficients they amount to."""

    def __init__(self, m: FlightModel) -> None:
        span = 2 * round(0.5 * SPAN_S / m.dt) + 1
        grid = np.arange(m.n)

        def smooth(name: str, order: int = 0) -> Arr:
            c = next(c for c in m.channels if c.name == name)
            full = np.interp(grid, c.at, c.values)
            return np.asarray(savgol_filter(full, min(span, m.n - 1 + m.n % 2), DEGREE, deriv=order, delta=m.dt))

        def flow(what: str, order: int = 0) -> Arr:
            return np.asarray(np.mean([smooth(f"{what}{i}", order) for i in range(len(m.probes))], axis=0))

        w = [smooth(f"gyro_{a}") for a in "xyz"]
        wd = [smooth(f"gyro_{a}", 1) for a in "xyz"]
        x, y, z = m.probes.mean(axis=0)
        V = flow("V")
        # the probes are ahead of the centre of gravity
        alpha = flow("alpha") + (w[1] * x - w[0] * y) / V
        beta = flow("beta") - (w[2] * x - w[0] * z) / V
        alphadot = flow("alpha", 1) + (wd[1] * x - wd[0] * y) / V
        mass, ix, iy, iz, ixz = m.mass.T
        thrust = thrust_at(m.throttle, m.engine, m.dt)
        X, Y, Z = (mass * smooth(f"acc_{a}") for a in "xyz")
        X = X - thrust
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
        S, b, c = m.like.geometry.S_m2, m.like.geometry.b_m, m.like.geometry.c_m
        qs = 0.5 * density(float(m.mean[NC + 11])) * V * V * S
        p, q, r = w
        hx, hz = ix * p - ixz * r, iz * r - ixz * p
        roll = ix * wd[0] - ixz * wd[2] + q * hz - r * iy * q
        pitch = iy * wd[1] + r * hx - p * hz
        yaw = iz * wd[2] - ixz * wd[0] + p * iy * q - q * hx
        self.y = {
            "CD": -(X * ca * cb + Y * sb + Z * sa * cb) / qs,
            "CY": (-X * ca * sb + Y * cb - Z * sa * sb) / qs,
            "CL": (X * sa - Z * ca) / qs,
            "Cl": (roll * ca + yaw * sa) / (qs * b),
            "Cm": pitch / (qs * c),
            "Cn": (yaw * ca - roll * sa) / (qs * b),
        }
        hb, hc = 0.5 * b / V, 0.5 * c / V
        self.x: Mapping[str, Arr] = {
            "alpha": alpha, "beta": beta, "p": (p * ca + r * sa) * hb, "r": (r * ca - p * sa) * hb, "q": q * hc,
            "alphadot": alphadot * hc, "da": m.surf[:, 0, 0], "de": m.surf[:, 0, 1], "dr": m.surf[:, 0, 2],
        }  # fmt: skip


def start(m: FlightModel) -> tuple[Arr, bool]:
    """Parameters [size] from which to search, and whether they are those of equation error: else they are the file's, which are
    the more likely."""
    x = m.mean.copy()
    x[:NC] = coefficients(m)
    return (x, True) if likelihood(m, x) < likelihood(m, m.mean) else (m.mean.copy(), False)


def coefficients(m: FlightModel) -> Arr:
    """By least squares [26]; what they do not tell is the file's. A rate of incidence is not told from a pitch rate: their
    derivatives keep the file's proportion."""
    s = Smoothed(m)
    like = dict(zip(COEFFICIENTS, m.mean[:NC].tolist(), strict=True))
    found = dict(like)
    for name, regressors in REGRESSORS.items():
        zero = f"{name}0"
        columns: dict[str, Arr] = {zero if zero in like else CONSTANT: np.ones(m.n)}
        ratio = like.get(f"{name}_alphadot", 0.0) / like[f"{name}_q"] if like.get(f"{name}_q") else 0.0
        for k in regressors:
            columns[f"{name}_{k}"] = s.x["q"] + ratio * s.x["alphadot"] if k == "q" else s.x[k]
        _take(found, name, columns, s.y[name])
        if ratio:
            found[f"{name}_alphadot"] = ratio * found[f"{name}_q"]
    lift = found["CL0"] + found["CL_alpha"] * s.x["alpha"] + found["CL_de"] * s.x["de"]
    _take(found, "CD", {"CD0": np.ones(m.n), "K": lift * lift}, s.y["CD"])
    return np.array([found[k] for k in COEFFICIENTS])


def _take(found: dict[str, float], name: str, columns: Mapping[str, Arr], y: Arr) -> None:
    """Put what least squares tell into `found`."""
    try:
        e = least_squares(name, columns, y)  # type: ignore[arg-type]
    except ValueError:
        return
    for k, v in e.values.items():
        if e.errors[k] <= SURE * max(abs(v), abs(found[k])):
            found[k] = v
