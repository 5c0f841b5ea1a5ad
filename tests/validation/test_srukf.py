"""The square-root unscented filter against two programs we did not write and against large Monte Carlo (acceptance
6).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter, MerweScaledSigmaPoints, UnscentedKalmanFilter
from scipy.stats import chi2, norm

from flightsw.filters.srukf import SquareRootUKF

Array = np.ndarray
DT = 0.1


class Linear:
    """Six states (position and velocity on three axes, coupled by a rotation), four mixed measurements."""

    def __init__(self) -> None:
        rng = np.random.default_rng(7)
        self.F = np.eye(6)
        self.F[:3, 3:] = DT * np.eye(3)
        w = 0.3 * np.array([[0, 1, 0], [-1, 0, 0.4], [0, -0.4, 0]])
        self.F[3:, 3:] += DT * w
        self.H = rng.normal(size=(4, 6))
        self.sq = np.tril(rng.normal(size=(6, 6))) * 0.05 + 0.1 * np.eye(6)
        self.r = np.array([0.5, 0.2, 1.0, 0.3])
        a = rng.normal(size=(6, 6))
        self.P0 = a @ a.T + np.eye(6)
        self.x0 = rng.normal(size=6) * 10

    def data(self, steps: int) -> Array:
        rng = np.random.default_rng(8)
        x, out = self.x0 + rng.normal(size=6), []
        for _ in range(steps):
            x = self.F @ x + self.sq @ rng.normal(size=6)
            out.append(self.H @ x + self.r * rng.normal(size=4))
        return np.array(out)


def start(ukf: SquareRootUKF, x: Array, P: Array) -> SquareRootUKF:
    ukf.x[:], ukf.S[:] = x, np.linalg.cholesky(P)
    return ukf


def gap(a: Array, b: Array) -> float:
    """Largest difference relative to the size of the arrays."""
    return float(np.abs(a - b).max() / max(1.0, np.abs(b).max()))


def assert_factor(S: Array) -> None:
    """A covariance factor stays lower triangular with a positive diagonal."""
    assert not np.triu(S, 1).any()
    assert (np.diag(S) > 0).all()


def test_linear_problem_equals_textbook_kalman_filter_and_filterpy() -> None:
    p, steps = Linear(), 200
    ours = start(SquareRootUKF(6, 4, 6), p.x0, p.P0)
    points = MerweScaledSigmaPoints(6, alpha=1.0, beta=2.0, kappa=0.0)
    ukf = UnscentedKalmanFilter(6, 4, DT, hx=lambda x: p.H @ x, fx=lambda x, dt: p.F @ x, points=points)
    kf = KalmanFilter(dim_x=6, dim_z=4)
    kf.F, kf.H = p.F, p.H
    for f in (ukf, kf):
        f.P, f.Q, f.R = p.P0.copy(), p.sq @ p.sq.T, np.diag(p.r**2)
    ukf.x, kf.x = p.x0.copy(), p.x0.reshape(6, 1).copy()
    x, P = p.x0.copy(), p.P0.copy()  # the textbook filter, Joseph form
    worst = {"filterpy UKF": 0.0, "filterpy KF": 0.0, "textbook": 0.0, "NIS": 0.0}
    for y in p.data(steps):
        ours.predict(lambda X: X @ p.F.T, p.sq)
        nis = ours.update(lambda X: X @ p.H.T, y, p.r)
        ukf.predict()
        ukf.update(y)
        kf.predict()
        kf.update(y)
        x, P = p.F @ x, p.F @ P @ p.F.T + p.sq @ p.sq.T
        Pyy = p.H @ P @ p.H.T + np.diag(p.r**2)
        K, nu = P @ p.H.T @ np.linalg.inv(Pyy), y - p.H @ x
        x = x + K @ nu
        M = np.eye(6) - K @ p.H
        P = M @ P @ M.T + K @ np.diag(p.r**2) @ K.T
        for name, xr, Pr in (
            ("filterpy UKF", ukf.x, ukf.P),
            ("filterpy KF", kf.x.ravel(), kf.P),
            ("textbook", x, P),
        ):
            worst[name] = max(worst[name], gap(ours.x, xr), gap(ours.P, Pr))
        worst["NIS"] = max(worst["NIS"], abs(nis - nu @ np.linalg.solve(Pyy, nu)) / max(1.0, nis))
        assert_factor(ours.S)
    print(
        f"largest relative differences over {steps} linear steps: "
        + ", ".join(f"{k} {v:.1e}" for k, v in worst.items())
    )
    assert max(worst.values()) < 1e-9


# --- nonlinear: a target in a level turn seen by a range and bearing sensor -----------------------------------------
R_POLAR = np.array([0.5, 0.004])


def turn(X: Array) -> Array:
    """Points [k,5] of x, y, speed, heading, turn rate, one step of DT [s] on (exact arc for constant rate)."""
    x, y, v, psi, w = X.T
    mid = psi + 0.5 * w * DT
    return np.stack((x + v * DT * np.cos(mid), y + v * DT * np.sin(mid), v, psi + w * DT, w), axis=1)


def polar(X: Array) -> Array:
    """Range and bearing of points [k,5] from the origin."""
    return np.stack((np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])), axis=1)


SQ_TURN = np.diag([0.01, 0.01, 0.05, 0.002, 0.002])
X0_TURN = np.array([300.0, 100.0, 20.0, 0.4, 0.15])
S0_TURN = np.diag([3.0, 3.0, 1.0, 0.05, 0.03])


def test_nonlinear_problem_equals_filterpy() -> None:
    """Same sigma points, same weights, so the full and the square-root form must agree far below the noise."""
    rng = np.random.default_rng(1)
    ours = start(SquareRootUKF(5, 2, 5), X0_TURN, S0_TURN**2)
    points = MerweScaledSigmaPoints(5, alpha=1.0, beta=2.0, kappa=0.0)
    ukf = UnscentedKalmanFilter(
        5, 2, DT, hx=lambda x: polar(x[None])[0], fx=lambda x, dt: turn(x[None])[0], points=points
    )
    ukf.x, ukf.P, ukf.Q, ukf.R = X0_TURN.copy(), S0_TURN**2, SQ_TURN @ SQ_TURN.T, np.diag(R_POLAR**2)
    truth, worst = X0_TURN + S0_TURN @ rng.normal(size=5), 0.0
    for _ in range(200):
        truth = turn(truth[None])[0] + SQ_TURN @ rng.normal(size=5)
        y = polar(truth[None])[0] + R_POLAR * rng.normal(size=2)
        ours.predict(turn, SQ_TURN)
        ours.update(polar, y, R_POLAR)
        ukf.predict()
        ukf.update(y)
        worst = max(worst, gap(ours.x, ukf.x), gap(ours.P, ukf.P))
        assert_factor(ours.S)
    print(f"nonlinear, 200 steps: largest relative difference to filterpy {worst:.1e}")
    assert worst < 1e-9


def test_transformed_moments_lie_inside_the_monte_carlo_confidence_interval() -> None:
    """Polar to Cartesian with 4 m and 3.4 deg: mean and spread against 4 million samples, 99.9 % intervals.

    The bending of the arc pulls the mean 0.36 m inward, more than 40 standard errors of the sample mean on either
    axis: a linearised transform fails the same check.
    """
    mean, sd, N = np.array([200.0, 0.7]), np.array([4.0, 0.06]), 4_000_000
    rng = np.random.default_rng(3)

    def to_xy(X: Array) -> Array:
        return np.stack((X[:, 0] * np.cos(X[:, 1]), X[:, 0] * np.sin(X[:, 1])), axis=1)

    ours = start(SquareRootUKF(2, 2, 2), mean, np.diag(sd**2))
    ours.predict(to_xy, np.zeros((2, 0)))
    Y = to_xy(mean + sd * rng.normal(size=(N, 2)))
    z = norm.ppf(1 - 0.001 / 2)
    mc, err = Y.mean(axis=0), Y.std(axis=0) / math.sqrt(N)
    print(f"mean {ours.x} against {mc} +- {z * err}")
    assert (np.abs(ours.x - mc) < z * err).all()
    assert (np.abs(to_xy(mean[None])[0] - mc) > 40 * err).all()
    # standard deviations: sampling error sd/sqrt(2N), and the transform's own fourth-order error, sigma_bearing^2
    # relative
    ratio = np.sqrt(np.diag(ours.P)) / Y.std(axis=0)
    print(f"standard deviation ratio {ratio}")
    assert (np.abs(ratio - 1.0) < z / math.sqrt(2 * N) + sd[1] ** 2).all()


def test_update_matches_the_monte_carlo_linear_estimator() -> None:
    """One range-bearing update: posterior mean and spread against 4 million joint samples."""
    rng = np.random.default_rng(5)
    N, batches = 4_000_000, 40
    ours = start(SquareRootUKF(5, 2, 5), X0_TURN, S0_TURN**2)
    X = X0_TURN + rng.normal(size=(N, 5)) @ S0_TURN.T
    Y = polar(X) + R_POLAR * rng.normal(size=(N, 2))
    y = polar(X0_TURN[None])[0] + [2.0, -0.008]

    def linear_estimate(Xb: Array, Yb: Array) -> Array:
        C = np.cov(Xb.T, Yb.T)
        K = C[:5, 5:] @ np.linalg.inv(C[5:, 5:])
        post = C[:5, :5] - K @ C[5:, :5]
        return np.concatenate((Xb.mean(axis=0) + K @ (y - Yb.mean(axis=0)), np.sqrt(np.diag(post))))

    parts = np.array([linear_estimate(a, b) for a, b in zip(np.split(X, batches), np.split(Y, batches), strict=True)])
    mc, err = parts.mean(axis=0), parts.std(axis=0, ddof=1) / math.sqrt(batches)
    ours.update(polar, y, R_POLAR)
    got = np.concatenate((ours.x, np.sqrt(np.diag(ours.P))))
    # 10 comparisons at 99.9 % together; the transform's own fourth-order error may add a thousandth of the posterior
    # sigma
    z = norm.ppf(1 - 0.001 / 20)
    print(f"deviation in standard errors {np.round((got - mc) / err, 1)}, allowed {z:.1f}")
    assert (np.abs(got - mc) < z * err + 1e-3 * np.tile(mc[5:], 2)).all()


def test_filter_is_consistent_over_a_monte_carlo_of_runs() -> None:
    """Range-bearing tracking, 400 runs of 40 steps: NEES and mean error at the end inside their 99.9 % intervals."""
    rng = np.random.default_rng(11)
    runs, steps, nees, errors = 400, 40, [], []
    ukf = SquareRootUKF(5, 2, 5)
    for _ in range(runs):
        start(ukf, X0_TURN, S0_TURN**2)
        truth = X0_TURN + S0_TURN @ rng.normal(size=5)
        for _ in range(steps):
            truth = turn(truth[None])[0] + SQ_TURN @ rng.normal(size=5)
            ukf.predict(turn, SQ_TURN)
            ukf.update(polar, polar(truth[None])[0] + R_POLAR * rng.normal(size=2), R_POLAR)
        e = ukf.x - truth
        nees.append(float(np.sum(np.linalg.solve(ukf.S, e) ** 2)))
        errors.append(e / np.sqrt(np.diag(ukf.P)))
    lo, hi = chi2.ppf([0.0005, 0.9995], 5 * runs) / runs
    print(f"mean NEES {np.mean(nees):.3f}, allowed {lo:.3f} to {hi:.3f} (5 states)")
    assert lo < np.mean(nees) < hi
    bias = np.mean(errors, axis=0) * math.sqrt(runs)
    assert (np.abs(bias) < norm.ppf(1 - 0.001 / 10)).all(), f"normalised mean errors {bias}"


# --- behaviour ------------------------------------------------------------------------------------------------------
def test_a_missing_measurement_leaves_its_information_out() -> None:
    """Fewer columns than the filter was sized for: equal to a textbook update with the remaining rows alone."""
    p = Linear()
    for rows in ([0], [2, 3], [1, 0, 3]):
        ours = start(SquareRootUKF(6, 4, 6), p.x0, p.P0)
        y = np.arange(len(rows), dtype=float)
        ours.Y[:] = np.nan  # columns beyond the present measurements must not be read
        ours.update(lambda X, rows=rows: X @ p.H[rows].T, y, p.r[rows])
        H = p.H[rows]
        K = p.P0 @ H.T @ np.linalg.inv(H @ p.P0 @ H.T + np.diag(p.r[rows] ** 2))
        assert gap(ours.x, p.x0 + K @ (y - H @ p.x0)) < 1e-11
        assert gap(ours.P, p.P0 - K @ H @ p.P0) < 1e-11
        assert_factor(ours.S)


def test_split_updates_equal_one_joint_update_when_linear() -> None:
    p = Linear()
    y = np.array([1.0, -2.0, 0.5, 3.0])
    joint, split = (start(SquareRootUKF(6, 4, 6), p.x0, p.P0) for _ in range(2))
    joint.update(lambda X: X @ p.H.T, y, p.r)
    for i in (3, 0, 2, 1):
        split.update(lambda X, i=i: X @ p.H[i : i + 1].T, y[i : i + 1], p.r[i : i + 1])
    assert gap(split.x, joint.x) < 1e-10
    assert gap(split.P, joint.P) < 1e-10


def test_covariance_survives_measurements_a_million_times_better_than_the_prior() -> None:
    """Where sequential down-dates lose positive definiteness: prior 1e6, sensor 1e-6, two nearly parallel rows."""
    H = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-7, 0.0]])
    ukf = start(SquareRootUKF(3, 2, 3), np.zeros(3), 1e12 * np.eye(3))
    for _ in range(5):
        ukf.predict(lambda X: X, 1e-8 * np.eye(3))
        ukf.update(lambda X: X @ H.T, np.array([1.0, 1.0]), np.full(2, 1e-6))
        assert np.isfinite(ukf.S).all()
        assert_factor(ukf.S)
    assert abs(ukf.x[0] + ukf.x[1] - 1.0) < 1e-5
    assert abs(ukf.S[2, 2] / 1e6 - 1.0) < 1e-9  # the unmeasured state keeps its uncertainty


def test_large_offsets_do_not_cancel() -> None:
    """Positions of 1e7 m with millimetre spread: the mean is formed from deviations, not from large sums."""
    x = np.array([1.0e7, -2.0e7])
    ukf = start(SquareRootUKF(2, 1, 2), x, 1e-6 * np.eye(2))
    ukf.predict(lambda X: X, np.zeros((2, 0)))
    assert np.abs(ukf.x - x).max() < 1e-8
    assert np.abs(ukf.P - 1e-6 * np.eye(2)).max() < 1e-11


@pytest.mark.parametrize(("alpha", "kappa", "beta"), [(1.0, 3 - 45, 2.0), (1e-3, 0.0, 2.0), (1.0, -3.0, 0.0)])
def test_negative_centre_weight_is_refused(alpha: float, kappa: float, beta: float) -> None:
    """lee.md trap 13 and erratum E17: kappa = 3 - L would need a down-date; it is refused by name, not computed
    wrongly.
    """
    n = 45 if kappa < -3 else 5
    with pytest.raises(ValueError, match=r"centre weight -.* < 0; allowed >= 0"):
        SquareRootUKF(n, 1, n, alpha=alpha, kappa=kappa, beta=beta)


def test_other_non_negative_scalings_stay_exact_on_the_linear_problem() -> None:
    p = Linear()
    y = np.array([1.0, -2.0, 0.5, 3.0])
    ref = start(SquareRootUKF(6, 4, 6), p.x0, p.P0)
    other = start(SquareRootUKF(6, 4, 6, alpha=0.9, kappa=2.0, beta=2.0), p.x0, p.P0)
    for f in (ref, other):
        f.predict(lambda X: X @ p.F.T, p.sq)
        f.update(lambda X: X @ p.H.T, y, p.r)
    assert gap(other.x, ref.x) < 1e-11
    assert gap(other.P, ref.P) < 1e-11
