"""The onboard monitor step by step against the vectorised detectors; repeatability, snapshots, parameters."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

from flightsw.missions.receiver.airdata.fdi import detectors, parity
from flightsw.missions.receiver.airdata.fdi.monitor import Fdi, FdiParams, same_tail
from flightsw.missions.receiver.airdata.fdi.monitor_kernel import blame
from flightsw.strict import ConfigError, convert, to_dict
from hil_scripts.studies.sevil import two_faults
from tests.unit.fdi_data import ALL, COMMON_SIGMA, E9, S0, SIGMA9, SIGMA_V, ZERO3, fly, noise3, readings


def spd9(seed: int) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(9, 9)) * SIGMA9[:, None]
    return 0.1 * a @ a.T


@pytest.mark.parametrize("n", [1, 5])
@pytest.mark.parametrize("unequal", [False, True])
def test_steps_agree_with_the_vectorised_window(n: int, unequal: bool) -> None:
    """Same gamma, residuals and alarms sample by sample, through faults that come and go, with changing covariance."""
    k = np.array([1.0, 1.7, 0.6]) if unequal else np.ones(3)
    sig = SIGMA9.reshape(3, 3) * k
    p = 1e-2 if n == 1 else 1e-5
    f = Fdi(FdiParams(window=n, p_alarm=p, sigma_V=tuple(sig[0]), sigma_beta=tuple(sig[1]), sigma_alpha=tuple(sig[2])))
    y = E9 + np.random.default_rng(n).normal(size=(600, 9)) * sig.ravel()
    y[200:300, 1] -= 3.0
    y[400:500, 8] += np.radians(1.0)
    S = np.array([spd9(k % 7) for k in range(600)])
    out = [f.step(y[k], ALL, E9, S[k], ZERO3, COMMON_SIGMA) for k in range(600)]
    for v in range(3):
        c = slice(3 * v, 3 * v + 3)
        want = detectors.windowed_cleared(y[:, c], sig[v], n, p, E9[c], S[:, c, c])
        np.testing.assert_allclose([s.gamma[v] for s in out], want.gamma, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose([s.residual[2 * v : 2 * v + 2] for s in out], want.t, rtol=1e-7, atol=1e-7)
        assert [s.alarm >> v & 1 for s in out] == list((want.gamma > out[0].threshold).astype(int))


def test_steps_agree_with_the_multiplicative_and_plain_detectors() -> None:
    y = readings(300, 3, common=np.random.default_rng(9).normal(size=(300, 3)) * [0.4, 0.002, 0.002])
    E = E9 * (1 + 0.001 * np.arange(300)[:, None])
    mult, plain = Fdi(FdiParams(form="multiplicative")), Fdi(FdiParams(form="plain"))
    a = np.array([mult.step(y[k], ALL, E[k], None, None, None).gamma for k in range(300)])
    b = np.array([plain.step(y[k], ALL, None, None, None, None).gamma for k in range(300)])
    for v in range(3):
        c = slice(3 * v, 3 * v + 3)
        want = detectors.windowed(y[:, c], SIGMA9[3 * v], 5, E[:, c], form="multiplicative").gamma
        quiet = np.maximum.accumulate(want > 20) == 0  # clearing acts in alarm only
        np.testing.assert_allclose(a[quiet, v], want[quiet], rtol=1e-6, atol=1e-8)
    # V reads nearly the same on all probes: plain and windowed agree
    want = detectors.windowed_cleared(y[:, :3], SIGMA_V, 5, 1e-5).gamma
    np.testing.assert_allclose(b[:, 0], want, rtol=1e-6, atol=1e-6)


def test_cusum_agrees_and_finds_small_faults() -> None:
    y = readings(300, 4)
    y[100:, 2] -= 0.8
    f = Fdi(FdiParams(cusum=True, cusum_h=13.0))
    for k in range(300):
        s = f.step(y[k], ALL, E9, S0, ZERO3, COMMON_SIGMA)
        if k == 99:
            assert s.excluded == 0
    assert s.excluded == s.isolated == s.negative == 0b100
    want = detectors.cusum(parity.additive(y[:, :3], E9[:3], SIGMA_V)).sums
    np.testing.assert_allclose(f.sums[0], want[-1], rtol=1e-9)


def test_decision_agrees_with_the_vectorised_one() -> None:
    rng = np.random.default_rng(5)
    f = Fdi(FdiParams())
    seen = set()
    for _ in range(300):
        r = rng.normal(size=3) * 0.3 + rng.choice([0.0, 3.0, -3.0], 3)
        C = np.diag(rng.uniform(0.02, 0.06, 3))
        for sc in (None, 0.39):
            if parity.normalise(r[None] @ parity.PARITY.T, parity.PARITY, C).gamma[0] < f.th[1, 2]:
                continue
            want = int(two_faults.decide(r[None], C, sc)[0])
            got = blame(r, C, np.ones(3), 0.0 if sc is None else sc**-2, 7, 0, f.th, np.zeros(8))
            if want != 0:
                assert got == want
                seen.add(got)
    assert seen == {-1, 1, 2, 3, 4, 5, 6, 7}


def test_two_probe_statistic_has_the_same_tail() -> None:
    for g in (0.01, 1.0, 10.0, 300.0, 599.9):
        assert stats.chi2.logsf(same_tail(g), 2) == pytest.approx(stats.chi2.logsf(g, 1), rel=1e-9)
    for g in (600.0, 5000.0):
        assert stats.chi2.logsf(same_tail(g), 2) == pytest.approx(stats.chi2.logsf(g, 1), rel=1e-5)
    out = fly(Fdi(FdiParams(window=1)), readings(20_000, 2), ALL & ~0b010, virtual=False)
    gamma = [s.gamma[0] for s in out]
    assert stats.kstest(gamma, "chi2", args=(2,)).pvalue > 1e-3


def test_snapshot_restore_and_repeatability() -> None:
    y = readings(400, 21)
    y[120:260, 4] += np.radians(0.5)
    y[130:300, 0] -= 2.5
    a, b = Fdi(FdiParams(cusum=True)), Fdi(FdiParams(cusum=True))
    first = fly(a, y)
    fly(b, y[:150])
    state = b.get_state()
    fly(b, noise3(50, 1).repeat(3, axis=1))  # disturb
    b.set_state(state)
    again = [b.step(y[k], ALL, E9, S0, ZERO3, COMMON_SIGMA, t_us=50_000 * k) for k in range(150, 400)]
    assert again == first[150:]
    a.reset()
    assert fly(a, y) == first


def test_parameters_are_strict() -> None:
    p = convert({"window": 3, "sigma_V": [0.2, 0.2, 0.2], "form": "plain"}, FdiParams, "fdi.toml")
    assert p.window == 3 and p.sigma_V == (0.2, 0.2, 0.2)
    assert convert(to_dict(FdiParams()) | {"sigma_V": [0.4] * 3, "sigma_beta": [1e-3] * 3, "sigma_alpha": [1e-3] * 3},
                   FdiParams, "x").window == 5  # fmt: skip
    for bad, text in (
        ({"window": 0}, "window = 0: allowed 1"),
        ({"p_alarm": 0.9}, "p_alarm = 0.9"),
        ({"form": "robust"}, "allowed: additive, multiplicative, plain"),
        ({"sigma_V": [0.1, 0.0, 0.1]}, "sigma_V"),
        ({"sigma": 1.0}, "unknown key"),
    ):
        with pytest.raises(ConfigError, match=text):
            convert(bad, FdiParams, "fdi.toml")
    with pytest.raises(dataclasses.FrozenInstanceError):
        p.window = 4  # type: ignore[misc]
