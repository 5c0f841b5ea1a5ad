"""Estimators by name: the choice a parameter file or a study makes.

Ours and those of other packages are declared in the same table (entry-point group wakefield.estimators): a function
`build(n, m, nq, scaling) -> PointFilter`, or a class that is made from the three sizes alone. `package.module:Class` in place
of a name does for one that is not declared.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType
from typing import cast

from flightsw import plugins
from flightsw.filters.augmented import AugmentedUKF
from flightsw.filters.base import PointFilter
from flightsw.filters.ekf import ExtendedKalmanFilter
from flightsw.filters.kalman import KalmanFilter
from flightsw.filters.srukf import SquareRootUKF
from flightsw.filters.srukf_printed import PrintedSquareRootUKF
from flightsw.filters.ukf import UnscentedKalmanFilter
from flightsw.strict import ConfigError


@dataclass(frozen=True)
class Scaling:
    """Scaling of the sigma-point kinds, kappa None means 3 - L; redraw, strict: augmented kinds only."""

    alpha: float = 1.0
    kappa: float | None = 0.0
    beta: float = 2.0
    redraw: bool = False
    strict: bool = False


def srukf(n: int, m: int, nq: int, s: Scaling) -> PointFilter:
    """Square-root unscented filter without down-dates, additive noise."""
    return SquareRootUKF(n, m, nq, alpha=s.alpha, kappa=3.0 - n if s.kappa is None else s.kappa, beta=s.beta)


def srckf(n: int, m: int, nq: int, _: Scaling) -> PointFilter:
    """Cubature: srukf without the centre point (Arasaratnam and Haykin 2009): 2n points at sqrt(n) S."""
    return SquareRootUKF(n, m, nq, alpha=1.0, kappa=0.0, beta=0.0)


def srukf_printed(n: int, m: int, nq: int, s: Scaling) -> PointFilter:
    """Augmented, QR and rank-1 down-dates."""
    return PrintedSquareRootUKF(n, m, nq, alpha=s.alpha, kappa=s.kappa, beta=s.beta, redraw=s.redraw, strict=s.strict)


def ukf(n: int, m: int, nq: int, s: Scaling) -> PointFilter:
    """Full covariance, additive noise."""
    return UnscentedKalmanFilter(n, m, nq, alpha=s.alpha, kappa=s.kappa, beta=s.beta)


def ukf_augmented(n: int, m: int, nq: int, s: Scaling) -> PointFilter:
    """Full covariance, L = n + nq + m."""
    return AugmentedUKF(n, m, nq, alpha=s.alpha, kappa=s.kappa, beta=s.beta, redraw=s.redraw, strict=s.strict)


def ekf(n: int, m: int, nq: int, _: Scaling) -> PointFilter:
    """Differenced Jacobians."""
    return ExtendedKalmanFilter(n, m, nq)


def kalman(n: int, m: int, nq: int, _: Scaling) -> PointFilter:
    """Linear; matrices, or differences exact for affine models."""
    return KalmanFilter(n, m, nq)


def make_filter(
    kind: str, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float | None = 0.0, beta: float = 2.0,
    redraw: bool = False, strict: bool = False,
) -> PointFilter:  # fmt: skip
    """Filter of n states, m measurements at most, nq process-noise columns; kind: a declared name or `package.module:Class`.

    Raises ConfigError for an unknown kind or one that is no PointFilter, ValueError for a scaling the kind cannot run.
    """
    found = plugins.part(plugins.ESTIMATORS, kind, object, "filter")
    if isinstance(found, FunctionType):
        made = cast(Callable[[int, int, int, Scaling], object], found)(
            n, m, nq, Scaling(alpha, kappa, beta, redraw, strict)
        )
    elif isinstance(found, type):
        made = found(n, m, nq)
    else:
        raise ConfigError(f"filter = {kind!r}: is {found!r}; allowed: a class, or a function that builds one")
    if not isinstance(made, PointFilter):
        lacks = sorted(a for a in MEMBERS if not hasattr(made, a))
        raise ConfigError(f"filter = {kind!r}: lacks {', '.join(lacks)} of flightsw.filters.base.PointFilter")
    return made


MEMBERS = (*PointFilter.__annotations__, *(a for a in vars(PointFilter) if not a.startswith("_")))
