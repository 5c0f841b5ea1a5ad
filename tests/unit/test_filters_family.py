"""Every filter of the family on linear problems against filterpy and against each other."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter as PyKF
from filterpy.kalman import SquareRootKalmanFilter as PySquareRoot

from flightsw import plugins
from flightsw.filters.covariance import log_likelihood
from flightsw.filters.factory import make_filter
from flightsw.filters.kalman import KalmanFilter

KINDS = plugins.ours(plugins.ESTIMATORS)

Array = np.ndarray
DT = 0.1
# every kind, and the scalings that make the centre weight negative where the kind can run them
VARIANTS = [*((k, {}) for k in KINDS), *((k, {"kappa": None}) for k in ("ukf", "ukf_augmented", "srukf_printed"))]
VARIANTS += [(k, {"redraw": True}) for k in ("ukf_augmented", "srukf_printed")]
VARIANTS += [("srukf_printed", {"alpha": 0.5, "kappa": 1.0})]
IDS = [k + "".join(f"-{a}={b}" for a, b in kw.items()) for k, kw in VARIANTS]


class Linear:
    """Six states, a singular process noise of three columns, four mixed measurements."""

    def __init__(self) -> None:
        rng = np.random.default_rng(7)
        self.F = np.eye(6)
        self.F[:3, 3:] = DT * np.eye(3)
        self.F[3:, 3:] += DT * 0.3 * np.array([[0, 1, 0], [-1, 0, 0.4], [0, -0.4, 0]])
        # Decaying, so that the mean stays at the size of its sigmas: a slope by differences over d = 1e-3 sigma is rounded by
        # eps |x|/d, 2e-11 for |x| of ten, but beyond the comparison's 1e-9 for a mean that has run to thousands.
        self.F *= 0.95
        self.b = rng.normal(size=6) * 0.2
        self.H = rng.normal(size=(4, 6))
        self.sq = rng.normal(size=(6, 3)) * 0.1
        self.r = np.array([0.5, 0.2, 1.0, 0.3])
        a = rng.normal(size=(6, 6))
        self.P0 = a @ a.T + np.eye(6)
        self.x0 = rng.normal(size=6) * 10

    def data(self, steps: int) -> Array:
        rng = np.random.default_rng(8)
        x, out = self.x0 + rng.normal(size=6), []
        for _ in range(steps):
            x = self.F @ x + self.b + self.sq @ rng.normal(size=3)
            out.append(self.H @ x + self.r * rng.normal(size=4))
        return np.array(out)


def gap(a: Array, b: Array) -> float:
    """Largest difference relative to the size of the arrays."""
    return float(np.abs(a - b).max() / max(1.0, np.abs(b).max()))


@pytest.mark.parametrize(("kind", "kw"), VARIANTS, ids=IDS)
def test_linear_problem_equals_filterpy_kalman_and_square_root(kind: str, kw: dict) -> None:
    p = Linear()
    flt = make_filter(kind, 6, 4, 3, **kw)
    flt.x[:] = p.x0
    flt.set_cov(p.P0)
    kf, sq = PyKF(dim_x=6, dim_z=4), PySquareRoot(dim_x=6, dim_z=4)
    for f in (kf, sq):
        f.F, f.H, f.x = p.F, p.H, p.x0.reshape(6, 1).copy()
        f.P, f.R = p.P0.copy(), np.diag(p.r**2)
    kf.Q, sq.Q = p.sq @ p.sq.T, p.sq @ p.sq.T + 1e-13 * np.eye(6)
    worst = 0.0
    for k, y in enumerate(p.data(200)):
        flt.predict(lambda X: X @ p.F.T + p.b, p.sq)
        for f in (kf, sq):
            f.predict()
            f.x = f.x + p.b.reshape(6, 1)
        if k % 7 == 3:
            continue  # no measurement this time: two time updates in a row
        rows = [0, 1, 2, 3] if k % 5 else [1, 3]
        nis = flt.update(lambda X, rows=rows: X @ p.H[rows].T, y[rows], p.r[rows])
        kf.H, kf.R, kf.dim_z = p.H[rows], np.diag(p.r[rows] ** 2), len(rows)
        kf.update(y[rows])
        if rows == [0, 1, 2, 3]:
            assert abs(nis - (kf.y.T @ np.linalg.solve(kf.S, kf.y)).item()) < 1e-9 * max(1.0, nis)
        worst = max(worst, gap(flt.x, kf.x.ravel()), gap(flt.P, kf.P), gap(flt.S @ flt.S.T, kf.P))
        assert flt.sigmas() == pytest.approx(np.sqrt(np.diag(kf.P)), rel=1e-9)
        assert gap(flt.Sy[: len(rows), : len(rows)] @ flt.Sy[: len(rows), : len(rows)].T, kf.S) < 1e-9
        assert gap(flt.nu[: len(rows)], kf.y.ravel()) < 1e-9
        assert gap(flt.K[:, : len(rows)], kf.K) < 1e-9
        ll = log_likelihood(flt.nu, flt.Sy, len(rows), np.zeros(4))
        assert ll == pytest.approx(kf.log_likelihood, rel=1e-9)
    assert worst < 1e-9
    assert getattr(flt, "failures", 0) == 0


def test_square_root_filter_of_filterpy_agrees_too() -> None:
    p = Linear()
    flt = make_filter("srukf_printed", 6, 4, 6)
    sq = PySquareRoot(dim_x=6, dim_z=4)
    full = np.tril(np.random.default_rng(1).normal(size=(6, 6))) * 0.05 + 0.1 * np.eye(6)
    sq.F, sq.H, sq.x, sq.P, sq.Q, sq.R = (
        p.F, p.H, p.x0.reshape(6, 1).copy(), p.P0.copy(), full @ full.T, np.diag(p.r**2),
    )  # fmt: skip
    flt.x[:] = p.x0
    flt.set_cov(p.P0)
    for y in p.data(100):
        flt.predict(lambda X: X @ p.F.T, full)
        flt.update(lambda X: X @ p.H.T, y, p.r)
        sq.predict()
        sq.update(y.reshape(4, 1))
        assert gap(flt.x, sq.x.ravel()) < 1e-9
        assert gap(flt.P, sq.P) < 1e-9


def test_kalman_filter_by_matrices_equals_the_point_interface() -> None:
    p = Linear()
    a, b = KalmanFilter(6, 4, 3), KalmanFilter(6, 4, 3)
    for f in (a, b):
        f.x[:] = p.x0
        f.set_cov(p.P0)
    for y in p.data(50):
        a.predict_linear(p.F, p.sq, p.b)
        b.predict(lambda X: X @ p.F.T + p.b, p.sq)
        assert a.update_linear(p.H, y, p.r) == pytest.approx(b.update(lambda X: X @ p.H.T, y, p.r), rel=1e-9)
        assert gap(a.x, b.x) < 1e-10
        assert gap(a.P, b.P) < 1e-10


def test_unknown_kind_and_sizes_are_named() -> None:
    with pytest.raises(ValueError, match=r"filter = 'ukf2': allowed: ekf, .*srukf, srukf_printed"):
        make_filter("ukf2", 3, 1, 1)
    with pytest.raises(ValueError, match=r"n=0, m=1, nq=1"):
        make_filter("ekf", 0, 1, 1)
    with pytest.raises(ValueError, match=r"L \+ lambda = 0; allowed > 0"):
        make_filter("ukf", 3, 1, 1, kappa=-3.0)
    with pytest.raises(ValueError, match="indefinite"):
        make_filter("srukf_printed", 2, 1, 1).set_cov(np.diag([1.0, -1.0]))
    with pytest.raises(ValueError, match="indefinite"):
        make_filter("srukf", 2, 1, 1).set_cov(np.diag([1.0, -1.0]))
