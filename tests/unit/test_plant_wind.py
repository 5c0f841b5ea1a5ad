"""Prevailing wind and turbulence: sounding, Dryden statistics against closed form, frozen field."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov
from scipy.signal import welch

from flightsw.strict import ConfigError
from sim_plant.rng import BLOCK
from sim_plant.scenario import load_scenario
from sim_plant.wind.air import calm_air
from sim_plant.wind.dryden import DrydenSeries, discretise, shaping
from sim_plant.wind.prevailing import constant_table, sounding_table
from sim_plant.world import World

V, L, SIGMA, DT = 195.0, 533.4, 0.39, 0.01
OUN = "sounding_oun_20181222_12z_uwyo.txt"


def _wind_at(table: np.ndarray, h: float) -> np.ndarray:
    out = np.zeros(3)
    calm_air(h, table, np.zeros((1, 3)), 0, out)
    return out


def test_sounding_holds_the_measured_levels() -> None:
    t = sounding_table(OUN)
    assert len(t) == 101  # 102 levels with wind, 21330 m listed twice
    assert np.sum(t[:, 0] < 12500.0) == 47
    assert np.all(np.diff(t[:, 0]) > 0)
    jet = t[np.argmax(np.hypot(t[:, 1], t[:, 2]))]
    assert jet[0] == 10973.0
    assert np.hypot(jet[1], jet[2]) == pytest.approx(65.8, abs=0.1)


def test_sounding_is_interpolated_by_component() -> None:
    """6737 m: 62 kt from 275 deg, 7280 m: 72 kt from 270 deg; a westerly blows east."""
    t = sounding_table(OUN)
    assert np.allclose(_wind_at(t, 7280.0), (0.0, 72 * 0.514444, 0.0), atol=1e-9)
    a = np.radians(275.0)
    low = 62 * 0.514444 * np.array([-np.cos(a), -np.sin(a), 0.0])
    high = np.array([0.0, 72 * 0.514444, 0.0])
    f = (7010.0 - 6737.0) / (7280.0 - 6737.0)
    assert np.allclose(_wind_at(t, 7010.0), low + f * (high - low), atol=1e-9)
    assert np.allclose(_wind_at(t, -100.0)[:2], t[0, 1:])
    assert np.allclose(_wind_at(t, 99e3)[:2], t[-1, 1:])


def test_constant_wind_is_constant() -> None:
    assert np.allclose(_wind_at(constant_table(7.0, -13.0), 7010.0), (7.0, -13.0, 0.0))


def test_a_missing_sounding_is_named() -> None:
    with pytest.raises(ConfigError, match=r"nowhere\.txt.*shipped.*oun"):
        sounding_table("nowhere.txt")


def test_dryden_variance_is_sigma_squared_on_every_axis() -> None:
    a, bbt, c = shaping(V, L, SIGMA)
    p = solve_continuous_lyapunov(a, -bbt)
    assert np.allclose(np.diag(c @ p @ c.T), SIGMA**2, rtol=1e-12)


def test_discretisation_is_exact() -> None:
    """The stationary covariance is preserved, and two half steps make one step."""
    a, bbt, _ = shaping(V, L, SIGMA)
    p = solve_continuous_lyapunov(a, -bbt)
    phi, q = discretise(a, bbt, 0.05)
    assert np.allclose(phi @ p @ phi.T + q, p, rtol=1e-10, atol=1e-12 * p.max())
    half, qh = discretise(a, bbt, 0.025)
    assert np.allclose(half @ half, phi, rtol=1e-12, atol=1e-13)
    assert np.allclose(half @ qh @ half.T + qh, q, rtol=1e-9, atol=1e-12)


def test_dryden_spectrum_follows_the_closed_form() -> None:
    """Transfer function of the shaping filters: one-sided PSD per rad/s as in MIL-F-8785C."""
    a, bbt, c = shaping(V, L, SIGMA)
    for om in (0.01, 0.1, 0.5, 2.0, 20.0):
        h = c @ np.linalg.inv(1j * om * np.eye(5) - a)
        psd = np.real(np.diag(h @ bbt @ h.conj().T)) / np.pi  # two-sided over 2 pi, doubled to one-sided
        x = (L / V * om) ** 2
        u = SIGMA**2 * 2 * L / (np.pi * V) / (1 + x)
        vw = SIGMA**2 * L / (np.pi * V) * (1 + 3 * x) / (1 + x) ** 2
        assert np.allclose(psd, [u, vw, vw], rtol=1e-10)


def test_generated_gusts_have_the_variance_and_the_spectrum() -> None:
    series = DrydenSeries(3, "x", V, L, SIGMA, DT)
    g = np.concatenate([series.advance().copy() for _ in range(2000)])  # 20 000 s: about 7000 correlation times
    assert g.shape == (2000 * BLOCK, 3)
    assert np.allclose(g.std(axis=0) / SIGMA, 1.0, atol=0.04)
    corr = np.corrcoef(g.T)
    assert np.max(np.abs(corr - np.eye(3))) < 0.05
    f, psd = welch(g, fs=1 / DT, nperseg=2**14, axis=0)
    om = 2 * np.pi * f
    x = (L / V * om) ** 2
    u = SIGMA**2 * 2 * L / (np.pi * V) / (1 + x) * 2 * np.pi  # per Hz
    vw = SIGMA**2 * L / (np.pi * V) * (1 + 3 * x) / (1 + x) ** 2 * 2 * np.pi
    band = (f > 0.05) & (f < 3.0)
    for i, form in enumerate((u, vw, vw)):
        ratio = psd[band, i] / form[band]
        assert abs(ratio.mean() - 1.0) < 0.02
        assert ratio.std() < 0.15


def test_first_gust_is_stationary() -> None:
    """Over many seeds the very first sample already has the full variance."""
    first = np.array([DrydenSeries(s, "x", V, L, 1.0, DT).advance()[0] for s in range(600)])
    assert np.allclose(first.std(axis=0), 1.0, atol=0.1)


@pytest.mark.parametrize("axes", ["track", "ned"])
def test_receiver_meets_the_tankers_gusts_later(axes: str) -> None:
    """Frozen field: the gust on the receiver is the tanker's, delayed by (-xi_x) / V."""
    over = {"wind.prevailing": "constant", "wind.wake.source": "", "wind.dryden.axes": axes}
    w = World(load_scenario("refueling", over), 5)
    tanker, receiver, lag = [], [], []
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    for _ in range(1500):
        w.sense()
        tanker.append(w.truth(0).wind_n)
        receiver.append(w.truth(1).wind_n)
        lag.append(-w.truth(1).xi[0] / w.truth(0).V)
        w.step(cmds)
    t, r = np.array(tanker), np.array(receiver)
    assert 0.25 < lag[0] < 0.35
    k = np.arange(200, 1500)
    late = k - np.array(lag)[200:] * 100
    for i in range(3):
        assert np.max(np.abs(r[k, i] - np.interp(late, np.arange(1500), t[:, i]))) < 1e-9


def test_independent_turbulence_is_uncorrelated() -> None:
    over = {"wind.prevailing": "constant", "wind.wake.source": "", "wind.dryden.independent": True}
    w = World(load_scenario("refueling", over), 5)
    w.sense()
    assert not np.allclose(w.truth(0).wind_n, w.truth(1).wind_n, atol=1e-3)


def test_slow_variation_moves_both_aircraft_alike() -> None:
    over = {"wind.prevailing": "constant", "wind.wake.source": "", "wind.dryden.sigma_mps": 0.0}
    w = World(load_scenario("refueling", over | {"wind.slow.sigma_mps": 3.0, "wind.slow.tau_s": 10.0}), 5)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    seen = []
    for _ in range(2500):
        w.sense()
        assert w.truth(0).wind_n == w.truth(1).wind_n
        seen.append(w.truth(0).wind_n)
        w.step(cmds)
    x = np.array(seen)
    assert np.all(x[:, 2] == 0.0)
    assert np.all(x[:, :2].std(axis=0) > 0.3)
    assert np.max(np.abs(np.diff(x, axis=0))) < 1.0  # continuous across blocks too: one step is 0.13 m/s (1 sigma)


def test_a_sine_of_the_wind_is_the_sine_it_is_said_to_be() -> None:
    over = {
        "wind.prevailing": "constant",
        "wind.constant_mps": [3.0, 0.0],
        "wind.wake.source": "",
        "wind.dryden.sigma_mps": 0.0,
    }
    amp, period, phase = np.array([2.0, -1.0, 0.5]), np.array([4.0, 7.0, 3.0]), np.array([0.3, 0.0, -1.0])
    sine = [{"amplitude_mps": amp.tolist(), "period_s": period.tolist(), "phase_rad": phase.tolist()}]
    w = World(load_scenario("refueling", over | {"wind.sine": sine}), 5)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    for k in range(1100):  # beyond the border of a block
        w.sense()
        if k % 25 == 0 or k == 1000:
            want = [3.0, 0.0, 0.0] + amp * np.sin(2.0 * np.pi * 0.01 * k / period + phase)
            assert np.allclose(w.truth(0).wind_n, want, atol=1e-9) and w.truth(1).wind_n == w.truth(0).wind_n
        w.step(cmds)
