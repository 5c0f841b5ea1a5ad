"""What the wind estimate says on the wire: the calibration of the aircraft's own sensors, and the slow wind."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flightsw.types import ZERO3, Vec3

Two = tuple[float, float]
Six = tuple[float, float, float, float, float, float]


@dataclass(slots=True)
class WindReport:
    """Errors of the own sensors as learnt, reading less truth, with 1-sigma; constant and slowly varying part together unless
    said otherwise."""

    t_us: int = 0
    valid: bool = False
    wind: Vec3 = ZERO3  # [m/s] NED, slow part: without gusts and wake
    wind_cov: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # [m^2/s^2] NN, NE, ND, EE, ED, DD
    gust: float = 0.0  # [m/s] 1-sigma per axis, as learnt
    scale: float = 0.0  # [-] of the airspeed, less one
    scale_sigma: float = 0.0
    offset: float = 0.0  # [m/s] of the airspeed, constant part
    offset_sigma: float = 0.0
    airspeed: float = 0.0  # [m/s] error of the airspeed as it reads now, all parts
    airspeed_sigma: float = 0.0
    vanes: Two = (0.0, 0.0)  # [rad] incidence, sideslip
    vanes_sigma: Two = (0.0, 0.0)
    attitude: Vec3 = ZERO3  # [rad] attitude reference about the body axes; the third is the heading
    attitude_sigma: Vec3 = ZERO3
    nis: float = 0.0  # [-] of the last readings
    nis_dof: int = 0
    refused: int = 0  # readings left out so far
    restarts: int = 0


def report_values(r: WindReport) -> Iterator[tuple[float | int | bytes, ...]]:
    """Fields of WIND_CALIBRATION."""
    yield (
        r.t_us, *r.wind, *r.wind_cov, r.gust, r.scale, r.scale_sigma, r.offset, r.offset_sigma, r.airspeed, r.airspeed_sigma,
        *r.vanes, *r.vanes_sigma, *r.attitude, *r.attitude_sigma, r.nis, min(r.refused, 0xFFFFFFFF), min(r.restarts, 0xFFFF),
        min(r.nis_dof, 255), 1 if r.valid else 0,
    )  # fmt: skip
