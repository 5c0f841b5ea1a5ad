"""Linear removal of colour, Lee (2011) (3.20)-(3.29): against Gauss, noise states, scipy's Riccati equation, and drawn noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.stats import chi2

from hil_scripts.campaign.study import Case
from hil_scripts.studies.lee import linear
from hil_scripts.studies.lee.removal import FORMS, Augmented, Linear, Removal, backward

T = 0.05
# two states, one push, two readings of unlike colour: of what is differenced the push is more than half
SYS = Linear(
    A=np.array([[0.0, 1.0], [-4.0, -0.8]]),
    G=np.array([[0.1], [1.0]]),
    C=np.array([[1.0, 0.0], [0.5, 1.0]]),
    Q=np.array([[200.0]]),
    s=np.array([0.3, 0.8]),
    tau=np.array([2.0, 0.4]),
    T=T,
)
P0 = np.diag([4.0, 1.0])


def record(
    sys: Linear, n: int, rng: np.random.Generator, P: np.ndarray, runs: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States [n,k], readings [n,m] and B u [n,k] by (3.21), solved as it stands; `runs`: so many records at once, last axis."""
    k, m = len(sys.A), len(sys.s)
    x, v = np.linalg.cholesky(P) @ rng.standard_normal((k, *runs)), np.diag(sys.s) @ rng.standard_normal((m, *runs))
    x_all, y_all, u = [], [], rng.standard_normal((n, k, *runs))
    for i in range(n):
        if i:
            w = np.linalg.cholesky(sys.Q) @ rng.standard_normal((len(sys.Q), *runs))
            x = np.linalg.solve(np.eye(k) - T * sys.A, x + T * (u[i] + sys.G @ w))
            W = np.sqrt(sys.R_v) @ rng.standard_normal((m, *runs))
            v = np.linalg.solve(np.eye(m) - T * sys.A_v, v + T * W)
        x_all.append(x)
        y_all.append(sys.C @ x + v)
    return np.array(x_all), np.array(y_all), u


def both(sys: Linear, y: np.ndarray, u: np.ndarray, form: str = "correlated") -> tuple[Removal, Augmented]:
    """Both filters at the end of a record."""
    aug = Augmented(sys, np.zeros(2), P0)
    aug.correct(y[0])
    rem = Removal(sys, aug.x[:2], aug.P[:2, :2], form)
    for k in range(1, len(y)):
        aug.step(y[k], u[k])
        rem.step(rem.measurement(y[k], y[k - 1], u[k]), u[k])
    return rem, aug


def gauss(sys: Linear, y: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the last state given all readings: everything that is drawn in one vector, no recursion."""
    n, k, m, q = len(y), len(sys.A), len(sys.s), len(sys.Q)
    F, Fv = np.linalg.inv(np.eye(k) - T * sys.A), np.linalg.inv(np.eye(m) - T * sys.A_v)
    size = k + m + (n - 1) * (q + m)  # x_0, v_0, and w, W of each step
    X, V, push = np.zeros((k, size)), np.zeros((m, size)), np.zeros(k)
    X[:, :k], V[:, k : k + m] = np.linalg.cholesky(P0), np.diag(sys.s)
    Y, mean = [sys.C @ X + V], [np.zeros(m)]
    for i in range(1, n):
        at = k + m + (i - 1) * (q + m)
        X[:, at : at + q] = T * sys.G @ np.linalg.cholesky(sys.Q)
        V[:, at + q : at + q + m] = T * np.sqrt(sys.R_v)
        X, V, push = F @ X, Fv @ V, F @ (push + T * u[i])
        Y.append(sys.C @ X + V)
        mean.append(sys.C @ push)
    H = np.vstack(Y)
    K = np.linalg.solve(H @ H.T, H @ X.T).T
    return push + K @ (y - np.array(mean)).ravel(), (X - K @ H) @ (X - K @ H).T


def test_removal_is_the_mean_given_all_readings() -> None:
    """(3.22)-(3.28), and the noise states, give what Gauss does of all readings at once: estimate and covariance."""
    _, y, u = record(SYS, 40, np.random.default_rng(1), P0)
    rem, aug = both(SYS, y, u)
    x, P = gauss(SYS, y, u)
    for got, cov in ((rem.x, rem.P), (aug.x[:2], aug.P[:2, :2]), (rem.x, rem.true)):
        assert got == pytest.approx(x, rel=1e-8)
        assert cov == pytest.approx(P, rel=1e-8)


@pytest.mark.parametrize("form", ["uncorrelated", "chapter4"])
def test_correlation_left_out_is_seen(form: str) -> None:
    """Without M the estimate is another, worse one, and the covariance is not that of its error."""
    _, y, u = record(SYS, 200, np.random.default_rng(1), P0)
    rem, aug = both(SYS, y, u, form)
    assert np.trace(rem.true) > 1.05 * np.trace(aug.P[:2, :2])
    assert np.abs(rem.P / rem.true - 1.0).max() > 0.1
    assert np.abs(rem.x - aug.x[:2]).max() > 0.01


def test_steady_covariance_is_scipys_with_noise_states() -> None:
    """The Riccati solution of states and noise, readings with a millionth of white noise, after its correction."""
    _, y, u = record(SYS, 2000, np.random.default_rng(2), P0)
    rem, aug = both(SYS, y, u)
    R = 1e-12 * np.eye(2)
    P = solve_discrete_are(aug.F.T, aug.H.T, aug.Q, R)
    P = P - P @ aug.H.T @ np.linalg.solve(aug.H @ P @ aug.H.T + R, aug.H @ P)
    assert pytest.approx(P[:2, :2], rel=1e-5) == rem.P


def test_new_noises_are_uncorrelated_as_the_print_has_it() -> None:
    """(3.24), (3.27), (3.29) of drawn w and W, 5 sigma of each product's mean; E[w_N v_N^T] without the term of M is G M."""
    rng, n = np.random.default_rng(3), 400_000
    rem = Removal(SYS, np.zeros(2), P0)
    w = np.sqrt(SYS.Q[0, 0]) * rng.standard_normal((n, 1))
    v_N = w @ (SYS.C @ SYS.G).T + np.sqrt(np.diag(SYS.R_v)) * rng.standard_normal((n, 2))
    w_N = w @ SYS.G.T - v_N @ rem.K.T  # (3.26c)

    def inside(a: np.ndarray, b: np.ndarray, want: np.ndarray) -> bool:
        each = a[:, :, None] * b[:, None, :]
        return bool((np.abs(each.mean(axis=0) - want) < 5.0 * each.std(axis=0) / np.sqrt(n)).all())

    assert inside(w, v_N, rem.M)
    assert inside(v_N, v_N, rem.R_N)
    assert inside(w_N, w_N, rem.Q_N)
    assert inside(w_N, v_N, np.zeros((2, 2)))
    assert not inside(w @ SYS.G.T, v_N, np.zeros((2, 2)))
    assert pytest.approx(np.zeros((2, 2)), abs=1e-12) == SYS.G @ rem.M - rem.K @ rem.R_N


def test_error_is_as_large_as_said_and_the_reading_is_that_of_the_step() -> None:
    """300 records: NEES in its 99.9 % band, `true` of every form too; with the reading before in u_N it leaves it."""
    rng, runs, steps = np.random.default_rng(4), 300, 40
    total, claimed = {}, 0.0
    x, y, u = record(SYS, steps, rng, P0, (runs,))  # the covariances are those of every record
    aug = Augmented(SYS, np.zeros(2), P0)
    aug.x = np.zeros((4, runs))
    aug.correct(y[0])
    for k in (*FORMS, "before"):
        f = Removal(SYS, aug.x[:2], aug.P[:2, :2], "correlated" if k == "before" else k)
        last = np.zeros((2, runs))
        for i in range(1, steps):
            y_N = f.measurement(y[i], y[i - 1], u[i])
            f.step(y_N, u[i], last if k == "before" and i > 1 else None)
            last = y_N
        e = x[-1] - f.x
        total[k] = np.sum(e * np.linalg.solve(f.true, e))
        if k == "uncorrelated":
            claimed = np.sum(e * np.linalg.solve(f.P, e))
    low, high = chi2.ppf([0.0005, 0.9995], 2 * runs)
    for k in FORMS:
        assert low < total[k] < high
    assert total["before"] > high
    assert claimed < low  # what it has of itself is another thing: here too cautious


def test_noise_of_the_backward_rule_is_less_than_the_tables() -> None:
    """Phi of (2.61) is that of (2.60); in (3.21b) it gives less than s^2: 28 % where tau is one sample, T / 2 tau where long."""
    short = {}
    for tau in (T, 20.0):
        sys = replace(SYS, tau=np.array([tau, tau]))
        F = backward(sys.A_v, T)[0, 0]
        short[tau] = (F * T) ** 2 * sys.R_v[0, 0] / (1.0 - F * F) / sys.s[0] ** 2
        e = np.exp(-T / tau)
        assert (1.0 - e) ** 2 * tau**2 * sys.R_v[0, 0] / (1.0 - e * e) == pytest.approx(sys.s[0] ** 2)  # (2.60)
        right = ((1.0 + T / tau) ** 2 - 1.0) / T**2 * sys.s[0] ** 2  # of G_v Phi G_v^T
        assert (F * T) ** 2 * right / (1.0 - F * F) == pytest.approx(sys.s[0] ** 2)
    assert short[T] == pytest.approx(0.72, abs=0.005)
    assert short[20.0] == pytest.approx(1.0 - T / 40.0, abs=1e-5)


def test_on_the_tanker_the_two_ways_are_one() -> None:
    """Twelve readings of 20 s: the same wind; chapter 4's form is half as much off again and does not know it."""
    v = linear.run_removal(Case("tau_20", {"noise": "small", "tau_s": 20.0, "duration_s": 100.0}), 0).values
    for a in "ned":
        assert v[f"correlated.wind.rms_mps.{a}"] == pytest.approx(v[f"augmented.wind.rms_mps.{a}"], rel=1e-6)
        assert v[f"correlated.wind.sigma_mps.{a}"] == pytest.approx(v[f"correlated.wind.rms_mps.{a}"], rel=1e-6)
    assert v["chapter4.over_augmented"] > v["uncorrelated.over_augmented"] > 1.1
    assert v["chapter4.wind.error_over_sigma"] > 1.15


def test_unknown_form_is_named() -> None:
    with pytest.raises(ValueError, match="form = 'exact'"):
        Removal(SYS, np.zeros(2), P0, "exact")
