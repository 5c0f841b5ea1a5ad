"""One name per estimator: the choice a parameter file or a study makes."""

from __future__ import annotations

from flightsw.filters.augmented import AugmentedUKF
from flightsw.filters.base import PointFilter
from flightsw.filters.ekf import ExtendedKalmanFilter
from flightsw.filters.kalman import KalmanFilter
from flightsw.filters.srukf import SquareRootUKF
from flightsw.filters.srukf_printed import PrintedSquareRootUKF
from flightsw.filters.ukf import UnscentedKalmanFilter

KINDS = ("srukf", "srukf_printed", "ukf", "ukf_augmented", "ekf", "srckf", "kalman")


def make_filter(
    kind: str, n: int, m: int, nq: int, *, alpha: float = 1.0, kappa: float | None = 0.0, beta: float = 2.0,
    redraw: bool = False, strict: bool = False,
) -> PointFilter:  # fmt: skip
    """Filter of n states, m measurements at most, nq process-noise columns.

    kind: "srukf" (default in flight, no down-dates), "srukf_printed" (augmented, QR and rank-1 down-dates), "ukf" (full
    covariance, additive noise), "ukf_augmented" (full covariance, L = n + nq + m), "ekf" (differenced Jacobians), "srckf"
    (cubature: srukf without the centre point), "kalman" (linear; matrices, or differences exact for affine models).
    alpha, kappa, beta: scaling of the sigma-point kinds, kappa None means 3 - L; ignored by ekf, srckf and kalman.
    redraw, strict: augmented kinds only. Raises ValueError for an unknown kind or a scaling the kind cannot run.
    """
    if kind == "srukf":
        return SquareRootUKF(n, m, nq, alpha=alpha, kappa=3.0 - n if kappa is None else kappa, beta=beta)
    if kind == "srckf":
        # alpha 1, kappa 0, beta 0: centre weights zero, 2n points at sqrt(n) S (Arasaratnam and Haykin 2009)
        return SquareRootUKF(n, m, nq, alpha=1.0, kappa=0.0, beta=0.0)
    if kind == "srukf_printed":
        return PrintedSquareRootUKF(n, m, nq, alpha=alpha, kappa=kappa, beta=beta, redraw=redraw, strict=strict)
    if kind == "ukf_augmented":
        return AugmentedUKF(n, m, nq, alpha=alpha, kappa=kappa, beta=beta, redraw=redraw, strict=strict)
    if kind == "ukf":
        return UnscentedKalmanFilter(n, m, nq, alpha=alpha, kappa=kappa, beta=beta)
    if kind == "ekf":
        return ExtendedKalmanFilter(n, m, nq)
    if kind == "kalman":
        return KalmanFilter(n, m, nq)
    raise ValueError(f"filter kind = {kind!r}; allowed: {', '.join(KINDS)}")
