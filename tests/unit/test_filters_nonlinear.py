"""The family on nonlinear problems: filterpy, the printed equations written out, and Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter as PyEKF
from filterpy.kalman import MerweScaledSigmaPoints
from filterpy.kalman import UnscentedKalmanFilter as PyUKF
from scipy.linalg import block_diag
from scipy.stats import chi2, norm

from flightsw import plugins
from flightsw.filters.factory import make_filter

KINDS = plugins.ours(plugins.ESTIMATORS)

Array = np.ndarray
DT = 0.1


def gap(a: Array, b: Array) -> float:
    """Largest difference relative to the size of the arrays."""
    return float(np.abs(a - b).max() / max(1.0, np.abs(b).max()))


# --- nonlinear: a target in a level turn seen by a range and bearing sensor -----------------------------------------
R_POLAR = np.array([0.5, 0.004])
SQ_TURN = np.diag([0.01, 0.01, 0.05, 0.002, 0.002])
X0 = np.array([300.0, 100.0, 20.0, 0.4, 0.15])
S0 = np.diag([3.0, 3.0, 1.0, 0.05, 0.03])


def turn(X: Array) -> Array:
    """Points [k,5] of x, y, speed, heading, turn rate, one step of DT [s] on."""
    x, y, v, psi, w = X.T
    mid = psi + 0.5 * w * DT
    return np.stack((x + v * DT * np.cos(mid), y + v * DT * np.sin(mid), v, psi + w * DT, w), axis=1)


def polar(X: Array) -> Array:
    """Range and bearing of points [k,5] from the origin."""
    return np.stack((np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])), axis=1)


def turn_jacobian(s: Array) -> Array:
    v, psi, w = s[2:]
    c, n = math.cos(psi + 0.5 * w * DT), math.sin(psi + 0.5 * w * DT)
    F = np.eye(5)
    F[0, 2:] = DT * c, -v * DT * n, -0.5 * v * DT * DT * n
    F[1, 2:] = DT * n, v * DT * c, 0.5 * v * DT * DT * c
    F[3, 4] = DT
    return F


def polar_jacobian(s: Array) -> Array:
    x, y = s[:2]
    d = math.hypot(x, y)
    return np.array([[x / d, y / d, 0, 0, 0], [-y / d**2, x / d**2, 0, 0, 0]])


def measurements(steps: int) -> Array:
    rng = np.random.default_rng(1)
    s, out = X0 + S0 @ rng.normal(size=5), []
    for _ in range(steps):
        s = turn(s[None])[0] + SQ_TURN @ rng.normal(size=5)
        out.append(polar(s[None])[0] + R_POLAR * rng.normal(size=2))
    return np.array(out)


def started(kind: str, **kw: object) -> object:
    flt = make_filter(kind, 5, 2, 5, **kw)  # type: ignore[arg-type]
    flt.x[:] = X0
    flt.set_factor(S0)
    return flt


def test_ekf_equals_filterpy_with_hand_written_jacobians() -> None:
    """filterpy is given F of the nonlinear model; the differenced Jacobians must not be visible."""
    ours, ref = started("ekf"), PyEKF(dim_x=5, dim_z=2)
    ref.x, ref.P = X0.copy(), S0 @ S0.T
    ref.Q, ref.R = SQ_TURN @ SQ_TURN.T, np.diag(R_POLAR**2)
    for y in measurements(200):
        ours.predict(turn, SQ_TURN)
        ours.update(polar, y, R_POLAR)
        F = turn_jacobian(ref.x)
        ref.x, ref.P = turn(ref.x[None])[0], F @ ref.P @ F.T + ref.Q
        ref.update(y, polar_jacobian, lambda s: polar(s[None])[0])
        # the step is 1e-3 sigma, so third-order terms enter with 1e-6 of a sigma-point filter's share
        assert gap(ours.x, ref.x) < 1e-8
        assert gap(ours.P, ref.P) < 1e-7
    ours.draw()
    ours.X[:] = turn(ours.X)
    x = ours.x.copy()
    ours.recombine()
    assert gap(ours.F, turn_jacobian(x)) < 1e-9


@pytest.mark.parametrize("kw", [{}, {"alpha": 0.7, "kappa": 1.5}, {"kappa": None}], ids=str)
def test_ukf_equals_filterpy_on_the_nonlinear_problem(kw: dict) -> None:
    ours = started("ukf", **kw)
    kappa = -2.0 if kw.get("kappa", 0.0) is None else kw.get("kappa", 0.0)
    points = MerweScaledSigmaPoints(5, alpha=kw.get("alpha", 1.0), beta=2.0, kappa=kappa)
    ref = PyUKF(5, 2, DT, hx=lambda s: polar(s[None])[0], fx=lambda s, dt: turn(s[None])[0], points=points)
    ref.x, ref.P, ref.Q, ref.R = X0.copy(), S0 @ S0.T, SQ_TURN @ SQ_TURN.T, np.diag(R_POLAR**2)
    for y in measurements(200):
        ours.predict(turn, SQ_TURN)
        ours.update(polar, y, R_POLAR)
        ref.predict()
        # filterpy keeps its propagated points for the measurement; this filter redraws, as the square-root one does
        ref.sigmas_f = points.sigma_points(ref.x, ref.P)
        ref.update(y)
        assert gap(ours.x, ref.x) < 1e-9
        assert gap(ours.P, ref.P) < 1e-9


def test_ukf_and_srukf_are_the_same_filter_in_other_words() -> None:
    a, b = started("ukf"), started("srukf")
    for y in measurements(300):
        for f in (a, b):
            f.predict(turn, SQ_TURN)
            f.update(polar, y, R_POLAR)
        assert gap(a.x, b.x) < 1e-9
        assert gap(a.P, b.P) < 1e-9


def literal_step(x: Array, P: Array, y: Array, alpha: float, kappa: float, beta: float) -> tuple[Array, Array]:
    """One cycle of Lee 2011 (3.9)-(3.13) with L = n + q + m, errata E16 corrected, plain numpy."""
    q, m = 5, 2
    n = len(x)
    L = n + q + m
    lam = alpha**2 * (L + kappa) - L
    Pa = block_diag(P, np.eye(q), np.diag(R_POLAR**2))
    root = np.linalg.cholesky(Pa) * math.sqrt(L + lam)
    xa = np.concatenate((x, np.zeros(q + m)))
    chi = np.vstack((xa, xa + root.T, xa - root.T))
    wm = np.full(2 * L + 1, 0.5 / (L + lam))
    wc = wm.copy()
    wm[0] = lam / (L + lam)
    wc[0] = wm[0] + 1 - alpha**2 + beta
    X = turn(chi[:, :n]) + chi[:, n : n + q] @ SQ_TURN.T
    xm = wm @ X
    Pm = (X - xm).T @ (wc[:, None] * (X - xm))
    Y = polar(X) + chi[:, n + q :]
    ym = wm @ Y
    Pyy = (Y - ym).T @ (wc[:, None] * (Y - ym))
    Pxy = (X - xm).T @ (wc[:, None] * (Y - ym))
    K = Pxy @ np.linalg.inv(Pyy)
    return xm + K @ (y - ym), Pm - K @ Pyy @ K.T


@pytest.mark.parametrize("kind", ["ukf_augmented", "srukf_printed"])
@pytest.mark.parametrize("kappa", [0.0, 1.0, None])
def test_augmented_filters_are_the_printed_equations(kind: str, kappa: float | None) -> None:
    flt = started(kind, kappa=kappa)
    x, P = X0.copy(), S0 @ S0.T
    for y in measurements(200):
        flt.predict(turn, SQ_TURN)
        flt.update(polar, y, R_POLAR)
        x, P = literal_step(x, P, y, 1.0, 3.0 - 12 if kappa is None else kappa, 2.0)
        assert gap(flt.x, x) < 1e-9
        assert gap(flt.P, P) < 1e-9
    assert flt.failures == 0


@pytest.mark.parametrize("kind", ["ukf_augmented", "srukf_printed"])
def test_kept_points_are_dropped_when_the_owner_edits_the_state(kind: str) -> None:
    """After an edit of x or of the factor the next draw must be centred on the edited state."""
    flt = started(kind)
    flt.predict(turn, SQ_TURN)
    assert not np.array_equal(flt.draw()[0], flt.x)  # propagated centre, not the mean of the points
    flt.predict(turn, SQ_TURN)
    flt.x[3] += 2 * math.pi
    assert np.array_equal(flt.draw()[0], flt.x)
    flt.predict(turn, SQ_TURN)
    flt.set_factor(2 * S0)
    X = flt.draw()
    assert X[1] - X[0] == pytest.approx(flt.g * 2 * S0[:, 0])


def test_transformed_moments_lie_inside_the_monte_carlo_interval() -> None:
    """Polar to Cartesian, 4 m and 3.4 deg: mean within 99.9 % of 2 million samples, except for the linearised filter."""
    mean, sd, N = np.array([200.0, 0.7]), np.array([4.0, 0.06]), 2_000_000
    rng = np.random.default_rng(3)

    def to_xy(X: Array) -> Array:
        return np.stack((X[:, 0] * np.cos(X[:, 1]), X[:, 0] * np.sin(X[:, 1])), axis=1)

    Y = to_xy(mean + sd * rng.normal(size=(N, 2)))
    mc, err = Y.mean(axis=0), Y.std(axis=0) / math.sqrt(N)
    z = norm.ppf(1 - 0.001 / 2)
    for kind in KINDS:
        flt = make_filter(kind, 2, 1, 1)
        flt.x[:] = mean
        flt.set_factor(np.diag(sd))
        flt.predict(to_xy, np.zeros((2, 0)))
        inside = (np.abs(flt.x - mc) < z * err).all()
        assert inside == (kind not in ("ekf", "kalman")), kind
        ratio = np.sqrt(np.diag(flt.P)) / Y.std(axis=0)
        assert (np.abs(ratio - 1.0) < 0.01).all(), (kind, ratio)


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "kalman"])
def test_filter_is_consistent_over_a_monte_carlo_of_runs(kind: str) -> None:
    """150 tracking runs of 30 steps: NEES of the end inside its 99.9 % interval."""
    rng = np.random.default_rng(11)
    runs, nees = 150, []
    flt = make_filter(kind, 5, 2, 5)
    for _ in range(runs):
        flt.x[:] = X0
        flt.set_factor(S0)
        truth = X0 + S0 @ rng.normal(size=5)
        for _ in range(30):
            truth = turn(truth[None])[0] + SQ_TURN @ rng.normal(size=5)
            flt.predict(turn, SQ_TURN)
            flt.update(polar, polar(truth[None])[0] + R_POLAR * rng.normal(size=2), R_POLAR)
        e = flt.x - truth
        nees.append(e @ np.linalg.solve(flt.P, e))
    lo, hi = chi2.ppf([0.0005, 0.9995], 5 * runs) / runs
    assert lo < np.mean(nees) < hi, (kind, np.mean(nees))
