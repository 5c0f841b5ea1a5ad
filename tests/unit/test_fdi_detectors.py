"""Parity residuals and detectors against chi-square theory (scipy.stats), closed forms and properties."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import optimize, stats

from flightsw.missions.receiver.airdata.fdi import detectors, metrics, parity
from hil_scripts.studies.sevil import isolation
from tests.unit.fdi_data import SIGMA_A, SIGMA_V, consistent, noise3

N = 60_000
ANGLE = np.radians(1.0)
floats = st.floats(-3.0, 3.0)


def spd(r: np.random.Generator) -> np.ndarray:
    a = r.normal(size=(3, 3))
    return a @ a.T + 0.3 * np.eye(3)


def test_null_space_of_equal_entries_is_the_printed_matrix() -> None:
    want = [[np.sqrt(2 / 3), -1 / np.sqrt(6), -1 / np.sqrt(6)], [0, 1 / np.sqrt(2), -1 / np.sqrt(2)]]
    np.testing.assert_allclose(parity.null_space(np.array([7.0, 7.0, 7.0])), want, atol=1e-15)
    np.testing.assert_allclose(parity.PARITY, want, atol=1e-15)
    np.testing.assert_allclose(parity.null_space(np.zeros(3)), want, atol=1e-15)


@settings(deadline=None, max_examples=100)
@given(arrays(float, 3, elements=floats))
def test_null_space_is_orthonormal_and_annihilates_h(h: np.ndarray) -> None:
    V = parity.null_space(h)
    np.testing.assert_allclose(V @ V.T, np.eye(2), atol=1e-12)
    if np.linalg.norm(h) > 1e-9:
        np.testing.assert_allclose(V @ h, 0.0, atol=1e-12 * max(1.0, np.linalg.norm(h)))


@settings(deadline=None, max_examples=50)
@given(arrays(float, 3, elements=floats), arrays(float, (2, 2), elements=floats), st.integers(0, 100))
def test_statistic_does_not_depend_on_the_basis(y: np.ndarray, mix: np.ndarray, seed: int) -> None:
    if abs(np.linalg.det(mix)) < 0.1:
        return
    C = spd(np.random.default_rng(seed))
    other = mix @ parity.PARITY
    a = parity.normalise(y[None] @ parity.PARITY.T, parity.PARITY, C)
    b = parity.normalise(y[None] @ other.T, other, C)
    # closed form: weighted sum of squares about the weighted mean
    W = np.linalg.inv(C)
    d = y - (W.sum(axis=0) @ y) / W.sum()
    assert a.gamma[0] == pytest.approx(d @ W @ d, rel=1e-9, abs=1e-9)
    assert b.gamma[0] == pytest.approx(a.gamma[0], rel=1e-6, abs=1e-9)


@settings(deadline=None, max_examples=50)
@given(arrays(float, 3, elements=floats), floats)
def test_common_value_leaves_no_trace(y: np.ndarray, c: float) -> None:
    a, b = parity.plain(y[None], 1.0), parity.plain(y[None] + c, 1.0)
    np.testing.assert_allclose(a.t, b.t, atol=1e-12)


def test_normalised_residuals_have_unit_covariance() -> None:
    C = spd(np.random.default_rng(3))
    y = np.random.default_rng(4).multivariate_normal(np.zeros(3), C, 200_000)
    t = parity.normalise(y @ parity.PARITY.T, parity.PARITY, C).t
    np.testing.assert_allclose(np.cov(t.T), np.eye(2), atol=0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_plain_false_alarms_are_one_percent(seed: int) -> None:
    gamma = parity.plain(200.0 + noise3(N, seed), SIGMA_V).gamma
    fap = metrics.false_alarm_pct(metrics.alarm_index(gamma, metrics.threshold(0.01)))
    assert metrics.threshold(0.01) == pytest.approx(9.2103, abs=1e-4)
    assert 0.9 <= fap <= 1.1
    assert stats.kstest(gamma, "chi2", args=(2,)).pvalue > 1e-3


@pytest.mark.parametrize(("sigma", "fault", "want"), [(SIGMA_V, 3.0, 0.99483), (SIGMA_A, ANGLE, 1.0)])
@pytest.mark.parametrize("probe", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_true_alarms_follow_the_noncentral_chi_square(
    sigma: float, fault: float, want: float, probe: int, sign: int
) -> None:
    y = noise3(N, 10 + probe, sigma)
    y[:, probe] += sign * fault
    alarm = parity.plain(y, sigma).gamma > metrics.threshold(0.01)
    p = metrics.detection_probability(fault, sigma, 0.01)
    assert p == pytest.approx(want, abs=1e-5)
    assert p == pytest.approx(stats.ncx2.sf(stats.chi2.isf(0.01, 2), 2, 2 / 3 * fault**2 / sigma**2), rel=1e-9)
    assert consistent(alarm.sum(), N, p) or (p == 1.0 and alarm.all())


@pytest.mark.parametrize("var", [0.02, 0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("fault", [0.5, 1.0, 3.0])
def test_sweeps_of_noise_and_fault_size_follow_theory(var: float, fault: float) -> None:
    y = noise3(20_000, int(100 * var + fault), np.sqrt(var))
    y[:, 2] += fault
    alarm = parity.plain(y, np.sqrt(var)).gamma > metrics.threshold(0.01)
    assert consistent(alarm.sum(), len(y), metrics.detection_probability(fault, np.sqrt(var), 0.01), 0.9999)


@pytest.mark.parametrize(
    ("n", "p", "h", "miss", "least_V", "least_deg"),
    [(1, 1e-2, 9.21, 5.2e-3, 3.29, 0.33), (3, 1e-4, 18.42, 7e-8, 2.31, 0.23), (5, 1e-5, 23.03, 3e-14, 1.91, 0.19),
     (10, 1e-6, 27.63, 0.0, 1.43, 0.14)],
)  # fmt: skip
def test_window_table(n: int, p: float, h: float, miss: float, least_V: float, least_deg: float) -> None:
    """sevil.md 9.3: threshold, false alarms, misses and the fault found with 99.9 %."""
    assert metrics.threshold(p) == pytest.approx(h, abs=0.006)
    assert 1 - metrics.detection_probability(3.0, SIGMA_V, p, n) == pytest.approx(miss, rel=0.1, abs=1e-14)
    least = optimize.brentq(lambda f: metrics.detection_probability(f, 1.0, p, n) - 0.999, 0.1, 20.0)
    assert least * SIGMA_V == pytest.approx(least_V, abs=0.006)
    assert np.degrees(least * SIGMA_A) == pytest.approx(least_deg, abs=0.006)
    y = noise3(400_000, n)
    alarms = (detectors.windowed(y, SIGMA_V, n).gamma > h).sum()
    # neighbouring windows share samples: every n-th one is independent
    assert consistent(round(alarms / n), len(y) // n, p)


@pytest.mark.parametrize(
    ("n", "p", "mean", "p999"), [(1, 1e-2, 1.0, 2), (3, 1e-4, 1.9, 3), (5, 1e-5, 2.4, 4), (10, 1e-6, 3.5, 5)]
)
def test_window_delay(n: int, p: float, mean: float, p999: int) -> None:
    """sevil.md 9.3: delay to the alarm after a 3 m/s step, samples counted from 1."""
    runs, before, after = 8000, n, 10
    r = np.random.default_rng(n).normal(0.0, SIGMA_V, (runs, before + after, 3))
    r[:, before:, 1] += 3.0
    late = np.stack([r[:, k - n + 1 : k + 1].mean(axis=1) for k in range(before, before + after)], axis=1)
    C = parity.covariance(SIGMA_V) / n
    gamma = parity.normalise(late.reshape(-1, 3) @ parity.PARITY.T, parity.PARITY, C).gamma.reshape(runs, after)
    hit = gamma > metrics.threshold(p)
    assert hit.any(axis=1).all()
    delay = hit.argmax(axis=1) + 1
    assert delay.mean() == pytest.approx(mean, abs=0.12)
    assert np.quantile(delay, 0.999) <= p999


def test_moving_mean_is_a_convolution() -> None:
    x = noise3(50, 1)
    want = [x[max(0, k - 4) : k + 1].mean(axis=0) for k in range(50)]
    np.testing.assert_allclose(detectors.moving_mean(x, 5), want, atol=1e-15)
    with pytest.raises(ValueError, match="n=0; allowed >= 1"):
        detectors.moving_mean(x, 0)


def test_record_of_the_source_windowed() -> None:
    """3000 s at 20 Hz, 3 m/s on sensor 2 between 500 and 1500 s: TAP >= 99.98 %, FAP < 0.01 %, delay <= 5 samples, short tail."""
    first, last = 10_000, 29_999
    tail_plain = tail = 0.0
    for seed in range(5):
        y = noise3(N, 40 + seed)
        y[first : last + 1, 1] += 3.0
        h = metrics.threshold(1e-5)
        cleared = detectors.windowed_cleared(y, SIGMA_V, 5, 1e-5)
        a, b = cleared.gamma > h, detectors.windowed(y, SIGMA_V, 5).gamma > h
        assert metrics.true_alarm_pct(a, first, last) >= 99.98
        assert metrics.false_alarm_pct(a, first, last) < 0.01
        assert 1 <= metrics.delay(a, first) <= 5
        probe, _ = isolation.isolate(cleared.t, cleared.mu)
        assert metrics.isolation_pct(a, probe, 1, first, last) >= 99.9
        tail += a[last + 1 : last + 6].sum() / 5
        tail_plain += b[last + 1 : last + 6].sum() / 5
        np.testing.assert_array_equal(a[first + 4 : last + 1], b[first + 4 : last + 1])
    assert tail_plain > 2.0  # without clearing the window remembers the fault
    assert tail < 0.6 * tail_plain


def test_cusum_false_alarm_rate() -> None:
    """delta 2, h 13: Siegmund's (1985) run length of six one-sided schemes; sevil.md 9.3: 4.9e-6 of samples."""
    n, events, samples = 2_000_000, 0, 0
    for seed in range(2):
        res = parity.plain(noise3(n, 90 + seed), SIGMA_V)
        events += int(detectors.cusum(res, reset=True).alarm.sum())
        samples += int(detectors.cusum(res).alarm.sum())
    b = 13.0 / 2.0 + 1.166  # in standard deviations, reference value 1
    run_length = (np.exp(2.0 * b) - 2.0 * b - 1.0) / 2.0
    lo, hi = stats.chi2.ppf([0.005, 0.995], [2 * events, 2 * events + 2]) / 2 / (2 * n)
    assert lo <= 6.0 / run_length <= hi
    assert events <= samples <= 4 * 4.9e-6 * 2 * n


@pytest.mark.parametrize(("fault", "want"), [(3.0, 2.0), (1.0, 8.5)])
@pytest.mark.parametrize("probe", [0, 2])
@pytest.mark.parametrize("sign", [1, -1])
def test_cusum_delay_and_blame(fault: float, want: float, probe: int, sign: int) -> None:
    late, right = [], 0
    for k in range(600):
        y = noise3(100, 1000 * probe + k)
        y[30:, probe] += sign * fault
        c = detectors.cusum(parity.plain(y, SIGMA_V))
        d = metrics.delay(c.alarm, 30)
        late.append(d)
        right += c.probe[29 + d] == probe and c.sign[29 + d] == sign
    assert min(late) > 0
    assert np.mean(late) == pytest.approx(want, rel=0.08)
    assert right / 600 >= (0.985 if fault > 2 else 0.95)


@pytest.mark.parametrize("probe", [0, 1, 2])
def test_cusum_still_blames_the_right_probe_long_after_its_sums_are_full(probe: int) -> None:
    y = noise3(20_000, 5)
    y[:, probe] -= 3.0
    out = detectors.cusum(parity.plain(y, SIGMA_V))
    late = slice(1000, None)
    assert out.alarm[late].all()
    assert np.mean(out.probe[late] == probe) > 0.999 and np.mean(out.sign[late] == -1) > 0.999


def test_cusum_ends_after_the_fault() -> None:
    y = noise3(3000, 5)
    y[1000:2000, 0] -= 3.0
    a = detectors.cusum(parity.plain(y, SIGMA_V)).alarm
    assert a[1010:2000].all()
    assert not a[2020:].any()
    with pytest.raises(ValueError, match="delta=0"):
        detectors.cusum(parity.plain(y, SIGMA_V), delta=0.0)


def test_additive_residuals_ignore_expected_differences_and_common_wind() -> None:
    e = np.array([0.0, 0.03, -0.03])
    wind = 0.01 * np.sin(np.arange(N) / 300.0)[:, None]
    y = e + noise3(N, 7, SIGMA_A) + wind
    h = metrics.threshold(0.01)
    assert consistent((parity.additive(y, e, SIGMA_A).gamma > h).sum(), N, 0.01)
    assert (parity.plain(y, SIGMA_A).gamma > h).all()


def test_position_covariance_keeps_the_false_alarm_rate() -> None:
    """Position error of 1 m (1-sigma): false alarms rise without J P J^T and stay at 1 % with it; 1 deg is still found."""
    J = SIGMA_A * np.array([[2.0, -1.0], [0.5, 1.5], [-1.0, 0.0]])
    P = np.diag([1.0, 0.8])
    S = J @ P @ J.T
    dx = np.random.default_rng(2).multivariate_normal(np.zeros(2), P, N)
    y = noise3(N, 8, SIGMA_A) + dx @ J.T
    h = metrics.threshold(0.01)
    assert (parity.additive(y, np.zeros(3), SIGMA_A).gamma > h).mean() > 0.05
    assert consistent((parity.additive(y, np.zeros(3), SIGMA_A, S).gamma > h).sum(), N, 0.01)
    y[:, 0] -= ANGLE
    assert (parity.additive(y, np.zeros(3), SIGMA_A, S).gamma > h).mean() > 0.9999


def test_windowed_covariance_does_not_average_the_expectation_error() -> None:
    S = 0.05 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.5], [0.0, 0.5, 1.0]])
    runs = 20_000
    shared = np.random.default_rng(1).multivariate_normal(np.zeros(3), S, runs)  # one error for all samples of a window
    mean = noise3(runs, 2, SIGMA_V / np.sqrt(5)) + shared
    gamma = parity.normalise(mean @ parity.PARITY.T, parity.PARITY, parity.covariance(SIGMA_V) / 5 + S).gamma
    assert consistent((gamma > metrics.threshold(0.01)).sum(), runs, 0.01)
    y = np.repeat(mean[:1], 9, axis=0)
    assert detectors.windowed(y, SIGMA_V, 5, S=S).gamma[-1] == pytest.approx(gamma[0])


def test_multiplicative_is_harmless_far_from_zero_and_ill_posed_across_it() -> None:
    h = metrics.threshold(0.01)
    eV = np.array([199.0, 200.0, 201.0])
    y = eV * 1.002 + noise3(N, 3)
    assert consistent((parity.multiplicative(y, np.tile(eV, (N, 1)), SIGMA_V).gamma > h).sum(), N, 0.01)
    beta = np.array([0.0, 0.03, -0.03])  # contact: (0, b, -b)
    y = beta + np.radians(0.11) + noise3(N, 4, SIGMA_A)  # 0.39 m/s of side wind at 200 m/s
    assert (parity.multiplicative(y, np.tile(beta, (N, 1)), SIGMA_A).gamma > h).mean() > 0.5
    assert consistent((parity.additive(y, beta, SIGMA_A).gamma > h).sum(), N, 0.01)


def test_windowed_refuses_what_it_cannot_do() -> None:
    y = noise3(5, 1)
    with pytest.raises(ValueError, match="form='both'; allowed: additive, multiplicative"):
        detectors.windowed(y, 1.0, 2, form="both")
    with pytest.raises(ValueError, match="E=None"):
        detectors.windowed(y, 1.0, 2, form="multiplicative")
    with pytest.raises(ValueError, match="p_false=2"):
        metrics.threshold(2.0)


def test_window_clearing_needs_no_wake() -> None:
    """Clearing changes nothing while there is no alarm: the statistic is that of the plain window."""
    y = noise3(20_000, 12)
    a, b = detectors.windowed(y, SIGMA_V, 5).gamma, detectors.windowed_cleared(y, SIGMA_V, 5, 1e-5).gamma
    np.testing.assert_allclose(a, b, rtol=1e-9)
