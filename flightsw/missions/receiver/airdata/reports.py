"""What the air data have to say of themselves on the wire: the position in the wake, and the faults found."""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.missions.base import Packets, report
from flightsw.sixdof.windcal.record import WindReport, report_values
from flightsw.types import ZERO3, Vec3


@dataclass(slots=True)
class WakeFix:
    """Own position in the tanker's wake from the air-data probes alone. F = the tanker's air-path axes (x along its air
    velocity, y right, z down), origin at its centre of gravity."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not started"
    pos_f: Vec3 = ZERO3  # [m] x is an input (held from elsewhere), y and z are estimated
    vel_f: Vec3 = ZERO3  # [m/s]
    cov_yy: float = 0.0  # [m^2]
    cov_yz: float = 0.0
    cov_zz: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)  # [-] circulation of wing and tail relative to the onboard model
    scale_sigma: tuple[float, float] = (0.0, 0.0)
    height_m: float = 0.0  # [m] vortices below (+) the onboard model, where it is estimated
    wind_f: Vec3 = ZERO3  # [m/s] wind common to the probes besides the wake
    nis: float = 0.0
    nis_dof: int = 0
    restarts: int = 0


@dataclass(slots=True)
class FdiStatus:
    """Air-data fault detection. Channel c = 3 variable + probe; variables V, beta, alpha; masks have 9 bits."""

    t_us: int = 0
    valid: bool = False  # expected readings were at hand
    gamma: Vec3 = ZERO3  # [-] test statistic per variable, chi-square with 2 degrees of freedom
    threshold: float = 0.0  # [-]
    residual: tuple[float, float, float, float, float, float] = (
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )  # whitened parity vectors
    alarm: int = 0  # variables in alarm now, bit = variable
    isolated: int = 0  # channels blamed now
    negative: int = 0  # of those, the ones reading low
    excluded: int = 0  # channels kept out of navigation
    exclusions: int = 0  # how many so far


def wake_values(w: WakeFix) -> Packets:
    """Fields of WAKE_POSITION."""
    yield (
        w.t_us, *w.pos_f, *w.vel_f, w.cov_yy, w.cov_yz, w.cov_zz, *w.scale, *w.scale_sigma, w.height_m, *w.wind_f, w.nis,
        min(w.restarts, 0xFFFF), min(w.nis_dof, 255), 1 if w.valid else 0, w.reason.encode("ascii", "replace")[:50],
    )  # fmt: skip


def fdi_values(f: FdiStatus) -> Packets:
    """Fields of FDI_STATUS."""
    yield (
        f.t_us, *f.gamma, f.threshold, *f.residual, min(f.exclusions, 0xFFFFFFFF), f.isolated, f.negative, f.excluded, f.alarm,
        1 if f.valid else 0,
    )  # fmt: skip


REPORTS = (
    report("FDI_STATUS", FdiStatus, fdi_values, rate_hz=10.0),
    report("WAKE_POSITION", WakeFix, wake_values, rate_hz=10.0),
    report("WIND_CALIBRATION", WindReport, report_values, rate_hz=1.0, offset=7),
)
