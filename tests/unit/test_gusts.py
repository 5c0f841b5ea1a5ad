"""Turbulence levels, von Karman filters, coherence across lines and rotational gusts against closed forms, within intervals of
chi-square."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_lyapunov
from scipy.stats import chi2

from hil_scripts.air import law as gustlaw
from sim_plant.kernels import layout as n
from sim_plant.wind.config import Dryden
from sim_plant.wind.extent import Filtered, sigma_p
from sim_plant.wind.forms import ShapedSeries, form
from sim_plant.wind.gusts import RING, Gusts
from sim_plant.wind.levels import FT, KNOT, LENGTH_FT, SPECTRA, strength
from sim_plant.wind.span import TAPS, Across, factors

Arr = NDArray[np.float64]
V, DT = 195.0, 0.01
LENGTH = {s: LENGTH_FT[s] * FT for s in SPECTRA}
RISK = 1e-4  # of each interval to be left by chance; every draw is seeded


def transforms(x: Arr, m: int) -> tuple[Arr, Arr]:
    """Angular frequencies [rad/s] and Hann-windowed transforms [segments, bins, ...] of segments of m samples, scaled to a
    one-sided PSD in rad/s; bins that share nothing with the next."""
    w = np.hanning(m)
    parts = x[: len(x) // m * m].reshape(-1, m, *x.shape[1:])
    f = np.fft.rfft(parts * w.reshape(1, m, *[1] * (x.ndim - 1)), axis=1) * math.sqrt(
        2.0 * DT / np.sum(w * w) / (2.0 * np.pi)
    )
    om = 2.0 * np.pi * np.fft.rfftfreq(m, DT)
    return om[9::3], f[:, 9::3]


def within(ratio: Arr, what: str) -> None:
    """Mean of periodogram over closed form, one entry per independent estimate, lies in the interval of chi-square."""
    dof = 2 * ratio.size
    lo, hi = (float(chi2.ppf(p, dof)) / dof for p in (RISK, 1.0 - RISK))
    assert lo < ratio.mean() < hi, f"{what}: {ratio.mean():.4f} not in {lo:.4f} to {hi:.4f}"


def bands(om: Arr) -> list[NDArray[np.bool_]]:
    edges = (0.5, 3.0, 10.0, 30.0)
    return [(om >= a) & (om < b) for a, b in itertools.pairwise(edges)]


def test_levels_at_refuelling_height_and_above_the_air() -> None:
    for level, sigma in {"light": 0.94, "moderate": 2.10, "severe": 6.22}.items():
        s, L = strength(level, "dryden", 7010.0)
        assert np.allclose(s, sigma, atol=0.005) and np.allclose(L, 533.4)
        assert np.allclose(strength(level, "von_karman", 7010.0)[1], 762.0)
    assert not strength("light", "dryden", 15e3)[0].any()


def test_levels_near_the_ground() -> None:
    """MIL-F-8785C figures 10 and 11 at 500 ft, worked by hand; 10 ft and less alike; no jump at 1000 and 2000 ft."""
    s, L = strength("moderate", "dryden", 500.0 * FT)
    assert np.allclose(s, np.array([0.5885**-0.4, 0.5885**-0.4, 1.0]) * 3.0 * KNOT)
    assert np.allclose(L, np.array([500.0 / 0.5885**1.2] * 2 + [500.0]) * FT)
    assert np.array_equal(strength("light", "dryden", 3.0), strength("light", "dryden", -10.0))
    for edge in (1000.0, 2000.0):
        below, above = (np.array(strength("severe", "von_karman", (edge + d) * FT)) for d in (-1e-6, 1e-6))
        assert np.allclose(below, above, rtol=1e-6)


@pytest.mark.parametrize(("spectrum", "states", "off"), [("dryden", 5, 1e-9), ("von_karman", 14, 0.021)])
def test_filters_have_the_spectra_of_the_closed_form(spectrum: str, states: int, off: float) -> None:
    f = form(spectrum)
    assert len(f.a) == states
    p = solve_continuous_lyapunov(f.a, -f.bbt)
    assert np.allclose(np.diag(f.c @ p @ f.c.T), 1.0, atol=off)
    L = LENGTH[spectrum]
    for om in np.geomspace(1e-3, 75.0, 40):
        h = f.c @ np.linalg.inv(1j * om * L / V * np.eye(states) - f.a)
        psd = np.real(np.diag(h @ f.bbt @ h.conj().T)) / np.pi * L / V
        want = [gustlaw.spectrum(spectrum, i, np.array([om]), 1.0, L, V)[0] for i in range(3)]
        assert np.allclose(psd, want, rtol=off)


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_drawn_gusts_have_the_spectrum(spectrum: str) -> None:
    L = LENGTH[spectrum]
    series = ShapedSeries(11, "test", spectrum, V, np.full(3, L), DT, 1000)
    x = np.concatenate([series.advance().copy() for _ in range(300)])
    om, f = transforms(x, 1 << 13)
    for i in range(3):
        ratio = np.abs(f[:, :, i]) ** 2 / gustlaw.spectrum(spectrum, i, om, 1.0, L, V)
        for b in bands(om):
            within(ratio[:, b], f"{spectrum} {'uvw'[i]} {om[b][0]:.1f} rad/s")


def test_scale_changes_without_a_change_of_variance() -> None:
    """Descending from 500 ft to 50 ft within a minute, over many flights: variance 1 all the way."""
    last = []
    for seed in range(400):
        s = ShapedSeries(seed, "descent", "von_karman", 70.0, np.array([300.0, 300.0, 150.0]), 0.1, 10)
        for h in (150.0, 100.0, 50.0, 20.0):
            s.tune(np.array([2.0 * h, 2.0 * h, h]))
            s.advance()
        last.append(s.rows[-1].copy())
    var = np.var(np.array(last), axis=0) * 400 / 0.9921  # of the rational form
    assert np.all(var > chi2.ppf(RISK, 399)) and np.all(var < chi2.ppf(1.0 - RISK, 399))


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_filters_across_give_the_coherence_of_isotropic_turbulence(spectrum: str) -> None:
    """At the filters' own frequencies within what sampling folds, between them within 3 %."""
    y, L = np.array([0.0, -14.0, 14.0, 5.0]), LENGTH[spectrum]
    h = factors(spectrum, y, V * DT, np.full(3, L))
    k = np.arange(TAPS + 1)
    for om, off in (
        (2.0 * np.pi / (2 * TAPS * DT) * np.array([1.0, 2.0, 5.0, 12.0]), 0.016),
        (np.array([1.2, 3.7]), 0.03),
    ):
        low = np.tensordot(h * np.where(k == 0, 1.0, 2.0), np.cos(np.outer(k, om * DT)), axes=([3], [0]))
        got = np.einsum("ailo,ajlo->aijo", low, low)
        for axis in range(3):
            for i, j in ((0, 1), (1, 2), (1, 3), (2, 3)):
                want = gustlaw.coherence(spectrum, axis, om, abs(y[i] - y[j]), L, V)
                assert np.allclose(got[axis, i, j], want, atol=off), (axis, i, j)
            assert np.allclose(got[axis, 3, 3], 1.0, atol=off)
        if len(om) == 4:  # each line its whole spectrum, to rounding, at the filters' own frequencies
            assert np.allclose(np.einsum("aiio->aio", got), 1.0, atol=1e-8)


def test_drawn_lines_are_as_coherent_as_they_should_be() -> None:
    """Real part of the cross spectrum over the spectrum, of 14 and 28 m: normal about the closed form, variance (1 + c^2)/2 of
    an estimate; and each line its own spectrum by chi-square."""
    d = Dryden(sigma_mps=1.0, over="field")
    g = Gusts("test", d, 4, DT, 0, 7010.0, Across((0.0, -14.1, 14.1)), 0)
    rows = []
    for k in range(100 * RING + 1):
        if k % RING == 0 and k:
            rows.append(g.rings.transpose(1, 0, 2).copy())
        g.lay((1.0, 0.0), k, 7010.0)
    om, f = transforms(np.concatenate(rows), 1 << 13)
    for axis in range(3):
        s = gustlaw.spectrum("dryden", axis, om, 1.0, d.L_m, V)
        for i, j, y in ((0, 2, 14.1), (1, 2, 28.2)):
            got = np.real(f[:, :, i, axis] * np.conj(f[:, :, j, axis])) / s
            for b in bands(om):
                want = gustlaw.coherence("dryden", axis, om[b], y, d.L_m, V)
                sigma = math.sqrt(np.mean(0.5 * (1.0 + want**2)) / got[:, b].size)
                assert abs(got[:, b].mean() - want.mean()) < 4.0 * sigma + 0.01
        for b in bands(om):
            within(np.abs(f[:, b, 2, axis]) ** 2 / s[b], f"line {'uvw'[axis]}")


def test_a_rolling_airframe_meets_no_slope_in_air_that_has_none() -> None:
    """30 deg/s of roll in a gust that is the same everywhere: q and r stay nothing."""
    g = Gusts("test", Dryden(), 9, DT, 0, 7010.0)
    over, s, wind, probe = Filtered(g, 9, "test", 10.36, V, DT), np.zeros(n.NS), np.zeros(n.NW), np.zeros((0, 3))
    g.rings[:] = (1.0, 3.0, -2.0)
    for k in range(60):
        half = 0.5 * math.radians(30.0) * k * DT
        s[0], s[1] = math.cos(half), math.sin(half)
        over.turn(s, k, 0.0, wind, probe)
    assert np.abs(wind[n.W_ROT :]).max() < 1e-12


@pytest.mark.parametrize("b", [39.88, 10.36])
def test_rotational_gusts_have_the_spectra_of_the_specification(b: float) -> None:
    """p, q, r of a wings-level aircraft heading north; their variances are the integrals of the spectra."""
    d, count = Dryden(sigma_mps=2.0), 60_000
    g = Gusts("test", d, 9, DT, 0, 7010.0)
    over = Filtered(g, 9, "test", b, V, DT)
    s, wind, probe = np.zeros(n.NS), np.zeros(n.NW), np.zeros((0, 3))
    s[0] = 1.0
    out = np.zeros((count, 3))
    for k in range(count):
        g.lay((1.0, 0.0), k, 7010.0)
        wind[:] = 0.0
        over.turn(s, k, 0.0, wind, probe)
        out[k] = wind[n.W_ROT :]
    om, f = transforms(out, 1 << 13)
    laws = [gustlaw.roll(om, 2.0, d.L_m, V, b)] + [gustlaw.turning("dryden", i, om, 2.0, d.L_m, V, b) for i in (2, 1)]
    for i, law in enumerate(laws):
        for band in bands(om)[:2]:
            within(np.abs(f[:, band, i]) ** 2 / law[band], f"{'pqr'[i]} {om[band][0]:.1f} rad/s")
    fine = np.concatenate([[0.0], np.geomspace(1e-3, 1e6, 20_001)])
    area = np.trapezoid(gustlaw.roll(fine, 2.0, d.L_m, V, b), fine)
    assert sigma_p(2.0, d.L_m, b) ** 2 == pytest.approx(area, rel=1e-4)
