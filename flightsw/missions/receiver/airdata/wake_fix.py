"""Positions in the wake as records: that of maximum likelihood (wake_search.py) with its parameters, that of the filter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata import least_squares as ls
from flightsw.missions.receiver.airdata import state as k
from flightsw.missions.receiver.airdata.reports import WakeFix
from flightsw.strict import OneOf, Range
from flightsw.types import ZERO3

if TYPE_CHECKING:
    from flightsw.missions.receiver.airdata.params import WakePositionParams

Arr = NDArray[np.float64]
Pos = Annotated[float, Range(1e-9)]
NonNeg = Annotated[float, Range(0.0)]
Span = Annotated[tuple[float, float], Range(-500.0, 500.0)]
WEIGHTINGS = ("diff", "joint", "abs")
PLACE = slice(ls.B_Y, ls.B_KW)  # of the unknowns


@dataclass(frozen=True)
class MlParams:
    """Weights and search region of the maximum-likelihood position. Sigmas are per sample and probe."""

    sigma_V: Pos = 0.447  # [m/s]
    sigma_angle: Pos = 7.8e-4  # [rad] beta and alpha
    fixed_V: NonNeg = 0.0  # [m/s] what of a probe's own error no mean takes off
    fixed_angle: NonNeg = 0.0  # [rad]
    weighting: Annotated[str, OneOf(WEIGHTINGS)] = "diff"
    common_V: NonNeg = 0.39  # [m/s] "joint": common error of V, here turbulence
    common_angle: NonNeg = 0.002  # [rad] "joint": of beta and alpha, turbulence / airspeed
    scale_wing_sigma: NonNeg = 0.0  # [-] prior of the wing's circulation error; 0: the onboard value is certain
    scale_tail_sigma: NonNeg = 0.0  # [-]
    y_m: Span = (-10.0, 70.0)  # search region in F
    z_m: Span = (-8.0, 16.0)
    step_m: Annotated[float, Range(0.1, 10.0)] = 1.0  # of the coarse search
    starts: Annotated[int, Range(1, 50)] = 12  # best local minima of the coarse search that are followed
    iterations: Annotated[int, Range(1, 200)] = 40
    rival_cost: NonNeg = 9.21  # [-] a basin this close to the best in cost is a rival: chi-square, 2 dof, 1 %

    def __post_init__(self) -> None:
        for name, (lo, hi) in (("y_m", self.y_m), ("z_m", self.z_m)):
            if not lo < hi:
                raise ValueError(f"{name} = {[lo, hi]}; allowed: lower limit first, and not equal")


@dataclass(frozen=True)
class MlFix:
    """One position. pos = (y, z) [m, F]; cov [4,4] of (y, z, wing, tail circulation error), zero where frozen; cost = weighted
    residual squared; dof = readings and priors less unknowns; rivals = (y, z, cost) of other basins the readings do not rule
    out; inside = within the search region."""

    pos: tuple[float, float]
    scale: tuple[float, float]
    cov: Arr
    cost: float
    dof: int
    rivals: tuple[tuple[float, float, float], ...]
    inside: bool
    PLACE: ClassVar[slice] = PLACE  # of y and z in cov

    @property
    def sigma_m(self) -> float:
        """Radial 1-sigma [m]."""
        return math.sqrt(self.cov[ls.B_Y, ls.B_Y] + self.cov[ls.B_Z, ls.B_Z])


def fix_of(
    t_us: int, why: str, x: Arr, P: Arr, g: Arr, tracking: bool, nis: float, nis_dof: int, restarts: int
) -> WakeFix:
    """What the filter publishes of its state x [N], covariance P [N,N] and frame g [11]; why: it is not valid, "" it is; nis with
    nis_dof degrees of freedom, of the last update."""
    y, z, vy, vz = x[[k.X_Y, k.X_Z, k.X_VY, k.X_VZ]].tolist()
    wind = tuple((x[k.TURB] + x[k.SLOW]).tolist())
    return WakeFix(
        t_us=t_us,
        valid=not why,
        reason=why,
        pos_f=(float(g[kp.G_X]), y, z),
        vel_f=(float(g[kp.G_XDOT]), vy, vz),
        cov_yy=float(P[k.X_Y, k.X_Y]),
        cov_yz=float(P[k.X_Y, k.X_Z]),
        cov_zz=float(P[k.X_Z, k.X_Z]),
        scale=(1.0 + float(x[k.X_KW]), 1.0 + float(x[k.X_KT])),
        scale_sigma=(math.sqrt(max(P[k.X_KW, k.X_KW], 0.0)), math.sqrt(max(P[k.X_KT, k.X_KT], 0.0))),
        height_m=float(x[k.X_H]),
        wind_f=wind if tracking else ZERO3,
        nis=nis,
        nis_dof=nis_dof,
        restarts=restarts,
    )


def doubt(p: WakePositionParams, since_s: float, blind_s: float, refused: int, excess: float, var: float) -> str:
    """Why the position of a filter that tracks since since_s [s] is not valid, "" if it is: blind_s [s] without an update taken,
    refused of them in a row, excess [-] mean NIS per reading, var [m^2] of the position, y and z together."""
    if since_s < p.settle_s:
        return "settling"
    if blind_s > p.blind_s or refused >= p.valid_refused:
        return "air data refused or missing"
    if excess > p.valid_excess:
        return "readings do not fit the wake model"
    return "position not observable here" if var > p.valid_sigma_m**2 else ""
