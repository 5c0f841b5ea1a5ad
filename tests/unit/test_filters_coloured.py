"""Coloured measurement noise: what each of the three treatments does to the noise, and what it costs (lee.md 3.6, 3.7)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from flightsw.filters.coloured import Differencer, NoiseStates, scaled_sigma
from flightsw.filters.factory import make_filter

T = 0.05


def coloured(rng: np.random.Generator, n: int, s: float, tau: float) -> np.ndarray:
    e = math.exp(-T / tau)
    w = s * math.sqrt(1 - e * e) * rng.normal(size=n)
    w[0] = s * rng.normal()
    return lfilter([1.0], [1.0, -e], w)


@given(st.floats(1e-3, 1.0), st.floats(1e-3, 1e5), st.floats(1e-6, 1e3))
def test_scaled_sigma_is_the_sum_of_all_correlations(dt: float, tau: float, s: float) -> None:
    e = math.exp(-dt / tau)
    want = math.inf if e == 1.0 else s * math.sqrt((1 + e) / -math.expm1(-dt / tau))
    assert scaled_sigma(s, dt, tau) == pytest.approx(want, rel=1e-9)
    assert scaled_sigma(s, dt, 0.0) == s


def test_scaled_sigma_predicts_the_error_of_a_long_mean() -> None:
    """Mean of N samples has the variance of white noise with the scaled sigma: 400 records, 5-sigma interval."""
    rng = np.random.default_rng(1)
    n, runs, tau, s = 4000, 400, 2.0, 0.2
    means = [coloured(rng, n, s, tau).mean() for _ in range(runs)]
    ratio = np.std(means) / (scaled_sigma(s, T, tau) / math.sqrt(n))
    # finite record: 1 - tau/(nT) of the variance is missing
    assert ratio == pytest.approx(math.sqrt(1 - tau / (n * T)), abs=5 / math.sqrt(2 * runs))


@pytest.mark.parametrize("tau", [0.5, 20.0])
def test_exact_differencing_whitens_and_its_sigma_is_right(tau: float) -> None:
    rng = np.random.default_rng(2)
    n, s = 200_000, 0.3
    v = coloured(rng, n, s, tau)
    d = Differencer([s], [tau])
    assert not d.push(v[:1], T)
    out = np.array([float(d.y[0]) for k in range(1, n) if d.push(v[k : k + 1], T)])
    assert out.std() == pytest.approx(d.r[0], rel=5 / math.sqrt(2 * n))
    assert d.r[0] == pytest.approx(s * math.sqrt(1 - math.exp(-2 * T / tau)) / T)
    for lag in (1, 2, 7):
        assert abs(np.mean(out[lag:] * out[:-lag]) / out.var()) < 5 / math.sqrt(n)


def test_printed_differencing_leaves_a_small_correlated_share() -> None:
    """b_v = 1/tau with a backward difference: the old noise stays with weight e/tau - (1-e)/T."""
    tau, s, e = 0.5, 1.0, math.exp(-T / 0.5)
    d = Differencer([s], [tau], form="printed")
    d.push(np.array([1.0]), T)
    d.push(np.array([e]), T)  # noise that only decays
    assert d.y[0] == pytest.approx(e / tau - (1 - e) / T)
    assert d.y[0] == pytest.approx(-T / (2 * tau**2), rel=0.15)
    x = Differencer([s], [tau])
    x.push(np.array([1.0]), T)
    x.push(np.array([e]), T)
    assert x.y[0] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("form", ["exact", "printed"])
def test_a_noise_free_signal_gives_the_promised_h(form: str) -> None:
    """yN = cf f + cx x for a ramp, f from the backward difference."""
    tau, rate, x0 = 3.0, 0.7, 5.0
    d = Differencer([1.0, 1.0], [tau, tau], form=form)
    d.push(np.array([x0, x0]), 0.0)
    assert d.push(np.array([x0 + rate * T] * 2), T)
    assert d.y == pytest.approx(d.cf * rate + d.cx * (x0 + rate * T), rel=1e-12)


def test_angles_are_wrapped_before_the_division() -> None:
    """A heading that crosses +-pi: without wrapping the row would read -125 rad/s."""
    d = Differencer([0.01, 0.01], [20.0, 20.0], angle=[True, False])
    psi = math.pi - 0.01 + 0.03 * np.arange(3)
    wrapped = np.angle(np.exp(1j * psi))
    d.push(np.array([wrapped[0], wrapped[0]]), T)
    d.push(np.array([wrapped[1], wrapped[1]]), T)
    assert d.y[0] == pytest.approx(d.cf[0] * 0.03 / T + d.cx[0] * psi[1])
    assert d.y[1] < -100
    d.push(np.array([wrapped[2], wrapped[2]]), T)  # stays unwrapped from then on
    assert d.y[0] == pytest.approx(d.cf[0] * 0.03 / T + d.cx[0] * psi[2])


def test_gap_and_reset_prime_again_and_the_period_may_vary() -> None:
    d = Differencer([1.0], [2.0])
    assert not d.push(np.array([1.0]), T)
    assert d.push(np.array([1.5]), 3 * T)
    assert d.r[0] == pytest.approx(math.sqrt(1 - math.exp(-3 * T)) / (3 * T))
    assert not d.push(np.array([2.0]), 0.0)
    d.reset()
    assert not d.push(np.array([3.0]), T)


def test_inflation_counts_the_wind_increment() -> None:
    """Trap 6: difference of a wind random walk of intensity q has standard deviation q/sqrt(T), here 1.5 m/s^2 against 0.28."""
    q, s, tau = 0.33, 0.2, 20.0
    d = Differencer([s, 0.5], [tau, tau])
    d.push(np.zeros(2), T)
    d.push(np.zeros(2), T)
    r = d.inflated(np.array([q, 0.0]), T)
    assert d.r[0] == pytest.approx(0.28, abs=0.005)
    assert r[0] == pytest.approx(1.5, abs=0.02)
    assert r[1] == d.r[1]
    rng = np.random.default_rng(4)
    n = 100_000
    y = np.cumsum(q * math.sqrt(T) * rng.normal(size=n)) + coloured(rng, n, s, tau)
    e = math.exp(-T / tau)
    # remove the part h predicts from the wind itself; what remains is noise plus increment
    out = (y[1:] - e * y[:-1]) / T
    w = np.cumsum(q * math.sqrt(T) * np.random.default_rng(4).normal(size=n))
    assert (out - (1 - e) / T * w[1:]).std() == pytest.approx(r[0], rel=0.02)


def test_bad_arguments_are_named() -> None:
    with pytest.raises(ValueError, match="form = 'euler'"):
        Differencer([1.0], [1.0], form="euler")
    with pytest.raises(ValueError, match="lengths 2, 1, 2"):
        Differencer([1.0, 1.0], [1.0])
    with pytest.raises(ValueError, match="allowed > 0"):
        Differencer([0.0], [1.0])
    with pytest.raises(ValueError, match="T = 0"):
        scaled_sigma(1.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="all > 0"):
        NoiseStates(1, 1, [1.0], [-1.0])


@pytest.mark.parametrize("n", [2, 10, 100])
def test_constant_started_from_its_first_reading_has_the_variance_of_the_best_mean(n: int) -> None:
    """A constant in first-order noise, n samples: generalised least squares, s^2 (1+e)/(n (1-e) + 2 e)."""
    s, tau = 0.5, 2.0
    e = math.exp(-T / tau)
    lay = NoiseStates(1, 1, [s], [tau])

    def variance(read: bool) -> float:
        flt = make_filter("srukf", 2, 1, 2)
        S = np.diag([s, 1.0])
        lay.start(flt.x, S, read)
        lay.fill(flt.SQ, T)
        flt.set_factor(S)
        for _ in range(n - 1):
            lay.propagate(flt.draw(), T)
            flt.recombine()
            flt.Y[:, 0] = flt.draw()[:, 0]
            lay.add(flt.X, flt.Y, 0, 0)
            flt.correct(np.zeros(1), np.array([1e-6]), 1)
        return float(flt.P[0, 0])

    i = np.arange(n)
    C = s * s * e ** np.abs(i[:, None] - i)
    best = 1.0 / np.linalg.solve(C, np.ones(n)).sum()
    assert best == pytest.approx(s * s * (1 + e) / (n * (1 - e) + 2 * e))
    assert variance(read=True) == pytest.approx(best, rel=1e-4)
    assert variance(read=False) < 0.75 * best  # the first reading counted as knowledge and as noise: too sure


# --- a linear problem on which the truth is known: random-walk wind, one coloured and one white sensor -----------------
def run(treatment: str, seed: int, n: int = 3000) -> tuple[float, float]:
    """RMS error of the wind and its mean NEES after 10 s."""
    q, s, tau, r_white = 0.3, 0.5, 2.0, 3.0
    rng = np.random.default_rng(seed)
    wind = np.cumsum(q * math.sqrt(T) * rng.normal(size=n))
    y = np.stack((wind + coloured(rng, n, s, tau), wind + r_white * rng.normal(size=n)), axis=1)
    lay = NoiseStates(1, 1, [s], [tau])
    aug = treatment == "states"
    flt = make_filter("srukf", 2 if aug else 1, 2, 2 if aug else 1)
    S = np.eye(flt.n) * 5.0
    if aug:
        lay.start(flt.x, S)
        lay.fill(flt.SQ, T)
    flt.set_factor(S)
    flt.SQ[0, 0] = q * math.sqrt(T)
    r = np.array([1e-6 if aug else s, r_white])
    if treatment == "scaled":
        r[0] = scaled_sigma(s, T, tau)
    err, nees = [], []
    for k in range(n):
        flt.draw()
        if aug:
            lay.propagate(flt.X, T)
        flt.recombine()
        flt.draw()
        flt.Y[:, 0] = flt.X[:, 0]
        flt.Y[:, 1] = flt.X[:, 0]
        if aug:
            lay.add(flt.X, flt.Y, 0, 0)
        flt.correct(y[k], r, 2)
        if k * T > 10.0:
            e = flt.x[0] - wind[k]
            err.append(e)
            nees.append(e * e / flt.P[0, 0])
    return math.sqrt(np.mean(np.square(err))), float(np.mean(nees))


def test_noise_states_are_optimal_and_honest_ignoring_colour_is_neither() -> None:
    res = {t: np.mean([run(t, seed) for seed in range(10)], axis=0) for t in ("ignored", "scaled", "states")}
    assert res["states"][0] <= min(res["ignored"][0], res["scaled"][0]) * 1.001
    assert 0.75 < res["states"][1] < 1.25
    assert res["ignored"][1] > 3.0  # over-confident
    assert res["scaled"][1] < 1.25  # pessimistic or right, never over-confident
    assert res["scaled"][0] < res["ignored"][0] * 1.1
