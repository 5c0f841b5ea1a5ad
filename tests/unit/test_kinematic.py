"""The wind estimator without an aerodynamic model: exactness, consistency, gating, bad input, snapshot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from hil_scripts.estimate.kinematic import KinematicInput, KinematicNav, KinematicParams

Array = np.ndarray
DT = 0.02
AS_READ = replace(KinematicParams(), probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)


class Flight:
    """A figure of eight at 50 Hz with known wind and probe errors; own equations, quaternions by SciPy."""

    def __init__(
        self, p: KinematicParams, seed: int, seconds: float = 30.0, walk: float | None = None, straight: bool = False
    ) -> None:
        rng = np.random.default_rng(seed)
        n = round(seconds / DT)
        t = np.arange(n) * DT
        psi = np.zeros(n) if straight else 1.9 * np.sin(2 * np.pi * t / 15.0)
        phi = np.zeros(n) if straight else 0.8 * np.cos(2 * np.pi * t / 15.0)
        theta = np.zeros(n) if straight else 0.2 * np.sin(2 * np.pi * t / 11.0)
        self.euler = np.stack([psi, theta, phi], -1)
        body = Rotation.from_euler("ZYX", self.euler)
        w = (body[:-1].inv() * body[1:]).as_rotvec() / DT
        self.w_b = np.concatenate([w[:1], 0.5 * (w[1:] + w[:-1]), w[-1:]])
        speed = np.full(n, 26.0) if straight else 26.0 + 4.0 * np.sin(2 * np.pi * t / 9.0)
        vel = speed[:, None] * np.stack([np.cos(psi), np.sin(psi), 0.1 * np.sin(2 * theta)], -1)
        q = p.q_wind if walk is None else walk
        self.wind = np.array([-3.0, 8.0, 0.5]) + np.cumsum(rng.normal(size=(n, 3)) * q * math.sqrt(DT), axis=0)
        self.probe = rng.normal(size=3) * [p.probe_scale, p.probe_beta, p.probe_alpha]
        u = body.inv().apply(vel - self.wind)
        V = np.linalg.norm(u, axis=1)
        true = np.stack([V, np.arcsin(u[:, 1] / V), np.arctan2(u[:, 2], u[:, 0])], -1)
        self.true_air = true
        self.air = true * [1.0 + self.probe[0], 1.0, 1.0] + [0.0, *self.probe[1:]]
        self.air = self.air + rng.normal(size=(n, 3)) * [p.r_V, p.r_beta, p.r_alpha]
        self.vel = vel + rng.normal(size=(n, 3)) * p.r_vel
        self.n = n

    def at(self, k: int) -> KinematicInput:
        e, w, v, a = (tuple(x[k].tolist()) for x in (self.euler, self.w_b, self.vel, self.air))
        return KinematicInput(t_us=round(k * DT * 1e6), euler=e, w_b=w, vel_n=v, air=a)


def fly(nav: KinematicNav, f: Flight, start: int = 0, stop: int | None = None) -> Array:
    """Wind estimate [k,3] and reported sigma [k,3], side by side."""
    out = []
    for k in range(start, stop or f.n):
        o = nav.step(f.at(k))
        out.append((*o.wind_n, *o.wind_sigma))
    return np.array(out)


def test_wind_error_matches_its_covariance() -> None:
    """NEES of wind and of probe errors at the end of 40 flights inside its 97.5 % band; RMS with interval below the bound."""
    p = KinematicParams()
    n, wind, probe, mean_sq, inside = 40, [], [], [], []
    for seed in range(n):
        f, nav = Flight(p, seed, 20.0), KinematicNav(p)
        w = fly(nav, f)
        d = w[:, :3] - f.wind
        P = nav.out.P
        e = np.array(nav.out.probe) - f.probe
        wind.append(d[-1] @ np.linalg.solve(P[:3, :3], d[-1]))
        probe.append(e @ np.linalg.solve(P[3:, 3:], e))
        mean_sq.append(np.mean(d[100:] ** 2))
        inside.append(np.mean(np.abs(d[100:]) < 3.0 * w[100:, 3:]))
    lo, hi = chi2.ppf([0.0125, 0.9875], 3 * n) / n
    assert lo < np.mean(wind) < hi
    assert lo < np.mean(probe) < hi
    upper = math.sqrt(np.mean(mean_sq) + 1.96 * np.std(mean_sq, ddof=1) / math.sqrt(n))
    assert upper < 0.6  # [m/s] per axis; 2 % and 0.9 deg of probe error alone are worth 0.55
    assert np.mean(inside) > 0.98


def test_white_innovations_on_its_own_model() -> None:
    """Air-data innovations are white and of unit variance when the model is right."""
    p = replace(KinematicParams(), probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)
    f, nav = Flight(p, 3, 40.0), KinematicNav(p)
    z = []
    for k in range(f.n):
        o = nav.step(f.at(k))
        if k > 50:
            z.append(o.whitened[:3].copy())
    x = np.array(z)
    n = len(x)
    assert np.abs(x.mean(axis=0)).max() < 4.0 / math.sqrt(n)
    assert chi2.ppf(0.001, 3 * n) < (x**2).sum() < chi2.ppf(0.999, 3 * n)
    for lag in (1, 2, 5):
        assert np.abs((x[lag:] * x[:-lag]).mean(axis=0)).max() < 4.0 / math.sqrt(n)


@pytest.mark.parametrize("seed", range(3))
def test_straight_flight_teaches_nothing_about_the_probe(seed: int) -> None:
    """Gusts must not pass for manoeuvres: in straight steady flight probe errors keep their value and their variance."""
    p = KinematicParams()
    f, nav = Flight(p, seed, 40.0, straight=True), KinematicNav(p)
    fly(nav, f)
    assert np.abs(nav.ukf.x[9:12] / [p.probe_scale, p.probe_beta, p.probe_alpha]).max() < 0.5
    assert np.array(nav.out.probe_sigma) == pytest.approx([p.probe_scale, p.probe_beta, p.probe_alpha], rel=0.1)


def test_turning_flight_finds_probe_errors_in_calm_air() -> None:
    """With little turbulence, turns separate probe errors from wind: three times better than the prior."""
    p = replace(KinematicParams(), q_wind=0.1)
    for seed in range(4):
        f, nav = Flight(p, seed, 30.0), KinematicNav(p)
        fly(nav, f)
        s = np.array(nav.out.probe_sigma)
        assert (s < np.array([p.probe_scale, p.probe_beta, p.probe_alpha]) / 3.0).all()
        assert (np.abs(nav.ukf.x[9:12] - f.probe) < 4.0 * s).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_probe_error_the_flight_does_not_show_is_held_at_its_prior(seed: int) -> None:
    """Straight flight: wind and sigma are those of a filter that takes the probe as it reads, whose sigma also holds the
    errors the probe may have: V sigma_k along, V sigma_b across.
    """
    p = KinematicParams()
    f, nav, read = Flight(p, seed, 20.0, walk=0.1, straight=True), KinematicNav(p), KinematicNav(AS_READ)
    w, r = fly(nav, f), fly(read, f)
    assert nav.out.probe == (0.0, 0.0, 0.0) and nav.out.probe_held == (True, True, True)
    assert nav.out.probe_sigma == pytest.approx((p.probe_scale, p.probe_beta, p.probe_alpha), rel=1e-9)
    assert max(nav.out.probe_shown) < p.observed_share[0]
    assert np.abs(w[10:, :3] - r[10:, :3]).max() < 0.01
    V = nav.out.air[0]
    along, across = V * p.probe_scale, V * p.probe_beta
    extra = np.sqrt(w[-1, 3:5] ** 2 - r[-1, 3:5] ** 2)
    psi = math.atan2(*(f.vel[-1] - f.wind[-1])[1::-1])
    want = [
        math.hypot(along * math.cos(psi), across * math.sin(psi)),
        math.hypot(along * math.sin(psi), across * math.cos(psi)),
    ]
    assert extra == pytest.approx(want, rel=0.05)


def test_a_probe_error_once_shown_is_used_and_stays_used() -> None:
    """Turns in calm air: from the step at which half of the prior's variance is gone, the value is the filter's own."""
    p = replace(KinematicParams(), q_wind=0.1)
    f, nav = Flight(p, 1, 20.0), KinematicNav(p)
    held = []
    for k in range(f.n):
        o = nav.step(f.at(k))
        held.append(o.probe_held[0])
        assert o.probe_held[0] == (o.probe_shown[0] < 0.5) or not o.probe_held[0]
    assert held[0] and not held[-1]
    assert held == sorted(held, reverse=True)
    assert nav.out.probe[0] == pytest.approx(nav.ukf.x[9], abs=1e-9)
    never = KinematicNav(replace(p, observed_share=(1.0, 1.0, 1.0)))
    fly(never, f)
    assert never.out.probe == (0.0, 0.0, 0.0) and never.out.probe_shown == pytest.approx(nav.out.probe_shown)


def test_channels_come_and_go_one_by_one() -> None:
    """Airspeed missing for 2 s: flow angles and velocity carry on, and nothing is offered for what was not read."""
    p = KinematicParams()
    f, nav = Flight(p, 5, 8.0, walk=0.3), KinematicNav(p)
    for k in range(f.n):
        i = f.at(k)
        if 100 <= k < 200:
            i.air = (math.nan, *i.air[1:])
        if 200 <= k < 300:
            i.air = (i.air[0], math.nan, math.nan)
        o = nav.step(i)
        assert o.valid
        assert (
            o.codes == ((1, 2, 3, 4, 5) if 100 <= k < 200 else (0, 3, 4, 5) if 200 <= k < 300 else (0, 1, 2, 3, 4, 5))
            or k == 0
        )
        assert np.abs(np.array(o.wind_n) - f.wind[k]).max() < 4.0 * max(o.wind_sigma)


def test_a_start_without_flow_angles_knows_little_of_the_wind() -> None:
    p = KinematicParams()
    f = Flight(p, 5, 1.0)
    i, nav, other = f.at(0), KinematicNav(p), KinematicNav(p)
    full = max(other.step(f.at(0)).wind_sigma)
    i.air = (i.air[0], math.nan, math.nan)
    o = nav.step(i)
    assert o.valid and max(o.wind_sigma) > 0.9 * p.flow_sigma0 * i.air[0] > 2.0 * full


def test_outputs_are_air_data_of_the_truth() -> None:
    """V, beta, alpha of the output are the true ones once the probe is trusted."""
    p = replace(KinematicParams(), probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)
    f, nav = Flight(p, 1, 10.0), KinematicNav(p)
    f.probe[:] = 0.0
    d = []
    for k in range(f.n):
        d.append(np.array(nav.step(f.at(k)).air) - f.true_air[k])
    assert (np.sqrt(np.mean(np.array(d)[50:] ** 2, axis=0)) < [p.r_V, p.r_beta, p.r_alpha]).all()


def test_spikes_are_refused_and_a_lasting_step_is_not_refused_for_ever() -> None:
    """Single spikes of 15 m/s, 0.5 rad move the wind by less than 0.3 m/s; a lasting step is followed within 2 s."""
    p = replace(KinematicParams(), probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)
    f, clean = Flight(p, 2, 20.0, walk=0.3), KinematicNav(p)
    base = fly(clean, f)
    f.air[300, 0] += 15.0
    f.air[400, 2] += 0.5
    f.vel[500, 1] += 20.0
    nav = KinematicNav(p)
    refused = 0
    worst = 0.0
    for k in range(f.n):
        o = nav.step(f.at(k))
        refused += o.refused
        worst = max(worst, float(np.abs(np.array(o.wind_n) - base[k, :3]).max()))
    assert refused >= 3
    assert worst < 0.3
    step = Flight(p, 2, 20.0, walk=0.3)
    step.vel[500:] += [6.0, 0.0, 0.0]
    nav = KinematicNav(p)
    w = fly(nav, step)
    assert np.abs(w[650:, 0] - base[650:, 0] - 6.0).max() < 1.5


def test_attitude_correction_is_not_taken_for_motion() -> None:
    """A jump of the attitude the rates do not show, taken back 0.2 s later, leaves the wind within its covariance."""
    p = KinematicParams()
    f = Flight(p, 5, 20.0, walk=0.3)
    for k in range(100, f.n, 20):
        f.euler[k : k + 10, 0] += 0.015
    w = fly(KinematicNav(p), f)
    d = w[200:, :3] - f.wind[200:]
    assert np.mean(np.abs(d) < 3.0 * w[200:, 3:]) > 0.97


def test_bad_input_never_raises_and_says_why() -> None:
    p = KinematicParams()
    f, nav = Flight(p, 0, 6.0), KinematicNav(p)
    bad = f.at(0)
    bad.air = (math.nan, 0.0, 0.0)
    o = nav.step(bad)
    assert not o.valid and "air data" in o.reason
    fly(nav, f, 1, 150)
    assert nav.out.valid
    nan_rate = f.at(150)
    nan_rate.w_b = (math.nan, 0.0, 0.0)
    o = nav.step(nan_rate)
    assert not o.valid and "rate" in o.reason
    o = nav.step(f.at(149))
    assert not o.valid and "time" in o.reason
    late = f.at(151)
    late.t_us += 10_000_000
    assert nav.step(late).valid  # starts again
    assert nav.out.codes == ()


def test_dropouts_coast_with_growing_uncertainty() -> None:
    """Air data gone for 2 s: wind sigma grows tenfold and is back 0.2 s after. Attitude gone for 0.4 s: the rates take over."""
    p = replace(KinematicParams(), probe_scale=0.0, probe_beta=0.0, probe_alpha=0.0)
    f, nav, whole = Flight(p, 4, 16.0, walk=0.3), KinematicNav(p), KinematicNav(p)
    ratio, worst = [], 0.0
    for k in range(f.n):
        i = f.at(k)
        i.air_ok = not 300 <= k < 400
        i.att_ok = not 600 <= k < 620
        o, full = nav.step(i), whole.step(f.at(k))
        assert o.valid
        ratio.append(math.sqrt(o.P[0, 0] / full.P[0, 0]))
        if k >= 600:
            worst = max(worst, float(np.abs(np.array(o.wind_n) - f.wind[k]).max()))
    assert ratio[299] == 1.0
    assert ratio[399] > 10.0
    assert ratio[410] < 1.01
    assert 1.0 < ratio[619] < 2.0
    assert worst < 1.0


def test_snapshot_restores_bit_for_bit() -> None:
    p = KinematicParams()
    f, a, b = Flight(p, 9, 8.0), KinematicNav(p), KinematicNav(p)
    fly(a, f, 0, 200)
    b.set_state(a.get_state())
    assert np.array_equal(fly(a, f, 200), fly(b, f, 200))
