"""The Gaussian sum against the posterior itself, by importance sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.params import KN, NM, RendezvousNavParams

U = -396.0 * KN


def test_bank_finds_the_posterior_a_particle_cloud_finds() -> None:
    """Unaided start, weaving tanker, ten ranges: mean and spread of y against 400,000 weighted draws of the same prior."""
    p = RendezvousNavParams(estimator="bank", range_white_m2=150.0**2, walk_m2ps=0.0)
    own = [(2000.0 * i, -17e3 + 6000.0 * math.sin(0.7 * i)) for i in range(10)]
    r = np.random.default_rng(5)
    n = 400_000
    y = r.normal(size=n) * 6.149 * NM
    b = r.normal(size=n) * p.range_bias_sigma_m
    vc = r.normal(size=n) * math.hypot(p.velocity_sigma_mps, p.fluctuation_sigma_mps)
    vy = r.normal(size=n) * p.drift_sigma_mps
    true = np.array([95e3, 3000.0, 100.0, U + 3.0, 0.1])  # x, y, bias, v_x, v_y
    slow = RendezvousNavParams(**{**p.__dict__, "fluctuation_tau_s": 1e6, "altitude_sigma_m": 0.0})
    est = RangeEstimator(RendezvousNavParams(**{**slow.__dict__, "range_noise_sigma_m": 0.0}))
    x = logw = None
    for i, (xo, yo) in enumerate(own):
        t = 10.0 * i
        d = math.sqrt((true[0] + true[3] * t - xo) ** 2 + (true[1] + true[4] * t - yo) ** 2 + 304.8**2) + true[2]
        d += 100.0 * (-1) ** i
        if i == 0:
            est.start(d, xo, yo, 0.0, 6.149 * NM)
            x = xo + np.sqrt((d - b + 150.0 * r.normal(size=n)) ** 2 - (y - yo) ** 2 - 304.8**2)
            logw = np.zeros(n)
            continue
        est.predict(10.0)
        assert est.update(d, xo, yo)
        pred = np.sqrt((x + (U + vc) * t - xo) ** 2 + (y + vy * t - yo) ** 2 + 304.8**2) + b
        logw -= 0.5 * ((d - pred) / 150.0) ** 2
    w = np.exp(logw - logw.max())
    w /= w.sum()
    now = y + vy * 90.0
    mean = w @ now
    sigma = math.sqrt(w @ (now - mean) ** 2)
    assert 1.0 / (w @ w) > 300.0  # effective draws
    assert est.mean[2] == pytest.approx(mean, abs=0.25 * sigma)
    assert est.out.sigma[2] == pytest.approx(sigma, rel=0.25)
