"""Lee 2011, measurements and filters: errata E15-E19 of lee.md section 4.

E16-E18 have their details in tests/unit/test_filters_errata.py; here each is set against closed-form moments.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.filters.factory import make_filter
from flightsw.filters.srukf_printed import chol_downdate, chol_update
from flightsw.filters.ukf import weights
from tests.validation import wind_axis as wa

Array = np.ndarray


def augmented_points(x: Array, P: Array, noise: int, gamma: float) -> Array:
    """State rows [2L+1, n] of (3.10), L = n + noise: the points of the noise block repeat the centre."""
    n = len(x)
    L = n + noise
    X = np.tile(x, (2 * L + 1, 1))
    root = gamma * np.linalg.cholesky(P).T
    X[1 : 1 + n] += root
    X[1 + L : 1 + L + n] -= root
    return X


def spd(n: int, seed: int) -> Array:
    """Random covariance."""
    a = np.random.default_rng(seed).normal(size=(n, n))
    return a @ a.T + 0.1 * np.eye(n)


def test_E15_airspeed_noise_of_the_large_set_is_thirty_times() -> None:
    """Text of section 2.6 says "twenty times"; Tables 2.2, 2.3 print 0.2 -> 6 m/s = 30x, and 9.47 % of 190 = 3 x 6."""
    small, large, nominal = 0.2, 6.0, 190.0
    assert abs(large / small - 30.0) < 1e-12
    assert round(100 * 3 * small / nominal, 2) == 0.32  # Table 2.2, "Percent Err"
    assert round(100 * 3 * large / nominal, 2) == 9.47  # Table 2.3
    twenty = 100 * 3 * 20 * small / nominal
    assert round(twenty, 2) == 6.32
    assert abs(0.0947 * nominal - 18.0) < 0.01  # "9.47 percent error of the airspeed is 18 m/s"
    for a, b in ((0.0035, 0.035), (0.0044, 0.044), (0.0131, 0.131)):  # angles and rates: ten times, as the text says
        assert abs(b / a - 10.0) < 1e-9


def test_E16_all_points_with_the_mean_weights() -> None:
    """(3.11b) prints a sum to 2D; correct to 2L, first weight w0^m of (3.12a); (3.10), (3.16) have L rows, not n."""
    n, noise = 4, 6
    L = n + noise
    x, P, H = np.array([1.0, -2.0, 0.5, 3.0]), spd(n, 16), spd(n, 17)
    g, w0m, w0c, wi = weights(L, 1.0, 1.0, 2.0)
    X = augmented_points(x, P, noise, g)
    y = np.einsum("ki,ij,kj->k", X, H, X)
    exact = x @ H @ x + np.trace(H @ P)  # mean of a quadratic form of a Gaussian vector
    mean = np.r_[w0m, np.full(2 * L, wi)]
    short = mean[: 2 * n + 1] @ y[: 2 * n + 1]
    first = np.r_[w0c, np.full(2 * L, wi)] @ y
    print(f"mean exact {exact:.3f}, to 2L {mean @ y:.3f}, to 2n {short:.3f}, first weight w0^c {first:.3f}")
    assert mean @ y == pytest.approx(exact, rel=1e-12)
    assert abs(short / exact - 1) > 0.4
    assert first - exact == pytest.approx(2.0 * (x @ H @ x), rel=1e-12)  # beta times the centre point
    rows = np.vstack([X.T, np.zeros((noise, 2 * L + 1))])
    assert rows.shape == (L, 2 * L + 1)  # L rows


def test_E17_negative_centre_weight_has_no_root() -> None:
    """(3.17c), (3.18e) take sqrt(w0^c) with '+'; L = 45, kappa = 3 - L gives lambda -42, w0^c -12: '-' with sqrt(12)."""
    L = 45
    g, w0m, w0c, wi = weights(L, 1.0, None, 2.0)
    assert abs(1.0 * (L + (3 - L)) - L - (-42)) < 1e-12
    assert (g, w0m, w0c, wi) == pytest.approx((math.sqrt(3), -14.0, -12.0, 1 / 6), rel=1e-12)
    with pytest.warns(RuntimeWarning):
        assert np.isnan(np.sqrt(np.float64(w0c)))
    # one prediction through a bent model: factor of the outer points, then the centre
    n = 15
    rng = np.random.default_rng(17)
    P, A = 0.01 * spd(n, 18), rng.normal(size=(n, n))
    X = augmented_points(np.zeros(n), P, L - n, g)
    X = X + 0.05 * (X @ A.T) ** 2
    d = X - np.r_[w0m, np.full(2 * L, wi)] @ X
    want = d.T @ (np.r_[w0c, np.full(2 * L, wi)][:, None] * d)  # (3.11c)
    outer = np.linalg.qr(math.sqrt(wi) * d[1:], mode="r").T
    S0 = np.ascontiguousarray(outer * np.sign(np.diag(outer)))
    minus, plus, v = S0.copy(), S0.copy(), math.sqrt(-w0c) * d[0]
    assert chol_downdate(minus, n, v.copy(), np.zeros(2 * n)) == 0
    chol_update(plus, n, v.copy())
    good = np.abs(minus @ minus.T - want).max() / np.abs(want).max()
    bad = np.linalg.norm(plus @ plus.T - want) / np.linalg.norm(want)
    print(f"'-' {good:.1e}; '+' with |w0^c| wrong by {100 * bad:.1f} % of P")
    assert good < 1e-12
    assert bad > 0.05
    assert np.abs(plus @ plus.T - want - 24 * np.outer(d[0], d[0])).max() < 1e-12  # 2 |w0^c| d0 d0^T too much


def test_E18_posterior_factor_takes_one_down_date_per_measurement() -> None:
    """(3.18j) prints one cholupdate with the matrix U; correct m rank-1 down-dates; (3.18k) must read their result."""
    n, m = 6, 3
    rng = np.random.default_rng(18)
    P, H, R = spd(n, 19), rng.normal(size=(m, n)), np.diag(rng.uniform(0.1, 1.0, m))
    Py, pxy = H @ P @ H.T + R, P @ H.T
    Sy = np.linalg.cholesky(Py)
    K = np.linalg.solve(Sy.T, np.linalg.solve(Sy, pxy.T)).T  # (3.18g), (Pxy / Sy^T) / Sy: right as printed
    assert np.abs(K - pxy @ np.linalg.inv(Py)).max() < 1e-12
    joseph = (np.eye(n) - K @ H) @ P @ (np.eye(n) - K @ H).T + K @ R @ K.T
    U, S = K @ Sy, np.linalg.cholesky(P)
    seq, one, work = S.copy(), S.copy(), np.zeros(2 * n)
    for a in range(m):
        assert chol_downdate(seq, n, U[:, a].copy(), work) == 0
    assert chol_downdate(one, n, U[:, 0].copy(), work) == 0  # a routine that takes a vector reads the first column

    def off(F: Array) -> float:
        return float(np.linalg.norm(F @ F.T - joseph) / np.linalg.norm(joseph))

    good, first, prior, swapped = np.abs(seq @ seq.T - joseph).max(), off(one), off(S), off(seq.T)
    print(
        f"m down-dates {good:.1e}; first column only {100 * first:.0f} %; (3.18k) as printed returns the prior factor "
        f"{100 * prior:.0f} %; S^T for S {100 * swapped:.0f} %"
    )
    assert good < 1e-12
    assert min(first, prior, swapped) > 0.1


def test_innovation_of_the_extended_filter_needs_h() -> None:
    """Not in lee.md: (3.6c) prints y - H x for a nonlinear h; correct y - h(x). Airspeed squared, velocity less wind."""
    x = np.array([200.0, -13.0, 7.0, -13.0])  # north, east velocity; north, east wind

    def h(Z: Array) -> Array:
        return (Z[:, 0] - Z[:, 2]) ** 2 + (Z[:, 1] - Z[:, 3]) ** 2

    H = np.array([(h(x[None] + 1e-3 * e) - h(x[None] - 1e-3 * e))[0] / 2e-3 for e in np.eye(4)])
    y = h(x[None])[0]  # a perfect reading of a perfect estimate
    assert y - H @ x == pytest.approx(-y, rel=1e-6)  # a quadratic: off by the whole reading
    ekf = make_filter("ekf", 4, 1, 4)
    ekf.x[:] = x
    ekf.set_cov(np.eye(4))
    ekf.update(lambda Z: h(Z)[:, None], np.array([y]), np.array([1.0]))
    assert np.abs(ekf.x - x).max() < 1e-6


def calculated_wind(V: Array, be: Array, al: Array, eul: Array, v: Array) -> Array:
    """(4.6) for one set of readings."""
    return v - wa.r_bi(*eul).T @ wa.r_bw(float(be), float(al)) @ [float(V), 0.0, 0.0]


def test_E19_calculated_wind_is_not_free_of_noise() -> None:
    """(4.8), (6.15) print noise 0 for the calculated wind; the text's pre-computed variance: first order = Monte Carlo."""
    V, al, eul = 190.0, 0.06, np.array([0.4, 0.06, 0.0])
    sig = np.array(
        [0.2, 0.0035, 0.0044, 0.0035, 0.0035, 0.0035]
    )  # V, beta, alpha, psi, theta, phi (Table 2.2, lee.md 5)
    v = wa.r_bi(*eul).T @ wa.r_bw(0.0, al) @ [V, 0, 0] + np.array([7.0, -13.0, 0.0])
    z0 = np.array([V, 0.0, al, *eul])

    def wind(z: Array) -> Array:
        return calculated_wind(z[0], z[1], z[2], z[3:6], v)

    h = 1e-5
    J = np.array([(wind(z0 + h * e) - wind(z0 - h * e)) / (2 * h) for e in np.eye(6)]).T
    first_order = np.sqrt(np.sum((J * sig) ** 2, axis=1))
    rng = np.random.default_rng(19)
    draws = np.array([wind(z0 + sig * rng.standard_normal(6)) for _ in range(6000)])
    error = draws - [7.0, -13.0, 0.0]
    print(f"sigma of the calculated wind {np.round(error.std(axis=0), 3)} m/s, first order {np.round(first_order, 3)}")
    assert np.allclose(error.std(axis=0), first_order, rtol=0.04)
    assert first_order.min() > 0.2
    # what R = 0 does to a filter of a constant wind: zero variance claimed after the first sample
    P0, R = 20.0**2, first_order[1] ** 2
    zero = P0 - P0 / (P0 + 0.0) * P0
    right = P0 - P0 / (P0 + R) * P0
    k = P0 / (P0 + R)
    estimate = k * (error[:, 1] - 13.0)
    truth_error = np.mean((estimate + 13.0) ** 2)
    assert zero == 0.0
    assert truth_error / right == pytest.approx(1.0, abs=0.06)
