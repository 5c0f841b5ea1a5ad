"""The bank of relative position: kernels against filterpy and scipy, bounds and tests on drawn sensors, sound and faulty."""

from __future__ import annotations

import math

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.stats import chi2, multivariate_normal

from flightsw.missions.receiver.integrity import kernel
from flightsw.missions.receiver.integrity.flown import CATCH_MPS
from flightsw.missions.receiver.integrity.layout import AB, BOOM, GNSS, NB, REL, D, U
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.refuel import CONTACT, PRECONTACT
from tests.unit.integrity_draws import DT, Air, Fault, Seen, draw

DRAWS = 4


def spd(rng: np.random.Generator, n: int) -> np.ndarray:
    a = rng.standard_normal((n, n))
    return np.asarray(a @ a.T / n + 0.1 * np.eye(n))


def test_prediction_and_correction_equal_filterpy() -> None:
    """Filter 1 leaves the source out and stays as it was; the likelihood is the joint one of all rows."""
    rng = np.random.default_rng(1)
    X, P = rng.standard_normal((2, NB)), np.stack([spd(rng, NB), spd(rng, NB)])
    decay, q, dt, accel2 = rng.uniform(0.5, 1.0, NB), rng.uniform(0.0, 0.1, (2, NB)), 0.05, 0.09
    decay[D], decay[U] = 1.0, 1.0
    F = np.diag(decay)
    F[D, U] = F[U, AB] = dt * np.eye(3)
    a, gain = np.array([0.3, -0.2, 1.0]), np.zeros(NB)
    gain[D], gain[U] = 0.5 * dt * dt * a, dt * a
    Q = np.zeros((NB, NB))
    Q[D, D], Q[U, U] = np.eye(3) * dt**3 / 3.0, np.eye(3) * dt
    Q[D, U] = Q[U, D] = np.eye(3) * dt**2 / 2.0
    H, y, r = (
        rng.standard_normal((6, NB)) * (rng.uniform(size=(6, NB)) < 0.3),
        rng.standard_normal(6),
        rng.uniform(0.1, 1.0, 6),
    )
    twins = []
    for m in range(2):
        twin = KalmanFilter(dim_x=NB, dim_z=6)
        twin.x, twin.P, twin.F, twin.Q = X[m].copy(), P[m].copy(), F, accel2 * Q + np.diag(q[m])
        twin.H, twin.R = H, np.diag(r)
        twin.predict()
        twin.x += gain
        twins.append(twin)
    kernel.predict(X, P, decay, q, a, accel2, dt)
    for m, twin in enumerate(twins):
        np.testing.assert_allclose(X[m], twin.x, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(P[m], twin.P, rtol=0.0, atol=1e-12)
    joint = multivariate_normal(H @ twins[0].x, H @ twins[0].P @ H.T + np.diag(r)).logpdf(y)
    alone = [abs(y[i] - H[i] @ X[0]) / math.sqrt(H[i] @ P[0] @ H[i] + r[i]) for i in range(6)]
    z = np.zeros(6)
    assert kernel.innovations(X[0], P[0], H, y, r, 6, z) == pytest.approx(max(alone), rel=1e-12)
    np.testing.assert_allclose(np.abs(z), alone, rtol=1e-12)
    wide, apart, also = np.zeros((2, NB, kernel.width(NB))), X.copy(), np.zeros(2)
    wide[:, :, :NB] = P
    kernel.correct(apart, wide, also, np.array([0, 4], dtype=np.int64), 4, H, y, r, 6)
    twins[0].update(y)
    L, before = np.zeros(2), X[1].copy()
    kernel.correct(X, P, L, np.array([0, 4], dtype=np.int64), 4, H, y, r, 6)
    np.testing.assert_allclose(X[0], twins[0].x, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(P[0], twins[0].P, rtol=0.0, atol=1e-11)
    assert (apart == X).all() and (wide[:, :, :NB] == P).all() and (also == L).all() and not wide[:, :, NB:].any()
    assert L[0] == pytest.approx(joint, rel=1e-11) and L[1] == 0.0
    assert (X[1] == before).all()


@pytest.fixture(scope="module", params=[PRECONTACT, CONTACT], ids=["pre-contact", "contact"])
def sound(request: pytest.FixtureRequest) -> tuple[int, list[Seen]]:
    """Draws without a fault."""
    return request.param, [draw(seed, 40.0, request.param) for seed in range(DRAWS)]


def test_sound_sensors_are_bounded_and_raise_no_alarm(sound: tuple[int, list[Seen]]) -> None:
    """The error within the bound in every sample, the bound within the limits to be flown by, nobody accused; the error as large
    as its sigma says: no smaller than a margin of half, no larger than chance allows (chi-square, one sample a draw)."""
    phase, draws = sound
    pl, error = np.concatenate([s.pl for s in draws]), np.concatenate([s.error for s in draws])
    assert (np.abs(error) <= pl).all()
    late = np.stack([s.pl[400:] for s in draws])
    assert late.mean(axis=(0, 1)).max() < (1.2 if phase == CONTACT else 2.2)
    assert late.max() < (2.0 if phase == CONTACT else 3.0)
    assert [s.texts for s in draws] == [[]] * DRAWS
    assert not any(s.over[400:].any() for s in draws)
    nees = np.array([((s.error[-1] / s.sigma[-1]) ** 2).sum() for s in draws]).sum()
    low, high = chi2.ppf((1e-3, 1.0 - 1e-3), 3 * DRAWS)
    assert 0.5 * low < nees < high


@pytest.mark.parametrize("phase", [PRECONTACT, CONTACT], ids=["pre-contact", "contact"])
@pytest.mark.parametrize("told", [True, False], ids=["heard", "not heard"])
def test_gusts_accuse_nobody(phase: int, told: bool) -> None:
    """Both aircraft thrown about by 4 m/s^2: bounded, nobody accused, and the bound is a calm flight's where the tanker's
    accelerometers are heard; where not, it is learnt that the motion is less known."""
    s = draw(5, 60.0, phase, air=Air(4.0, told))
    assert s.texts == [] and (np.abs(s.error) <= s.pl).all() and not s.over[400:].any()
    calm = 1.2 if phase == CONTACT else 2.2
    assert s.pl[400:].mean() < (calm if told else 1.4 * calm)
    density, least = s.bank.horizon.unrest.density, IntegrityParams().accel
    assert density < 3.0 * least if told else density > 5.0 * least


FAULTS = {  # fault: (phase, what is said of it first, source left out in the end or None, largest time to it [s])
    "rel steps 1 m": (Fault("rel", 2, step=1.0), PRECONTACT, "relative sensor left out", REL, 0.5),
    "rel steps 6 m, latched": (Fault("rel", 0, step=-6.0), CONTACT, "relative sensor left out", REL, 0.5),
    "rel walks": (Fault("rel", 2, walk=0.3, whole=True), PRECONTACT, "relative sensor, GNSS disagree", None, 5.0),
    "rel walks slowly": (Fault("rel", 1, walk=0.1), PRECONTACT, "relative sensor, GNSS disagree", None, 20.0),
    "rel walks, latched": (
        Fault("rel", 2, walk=0.3, whole=True),
        CONTACT,
        "relative sensor, GNSS, boom disagree",
        REL,
        5.0,
    ),
    "gnss steps 2 m": (Fault("gnss", 2, step=2.0), PRECONTACT, "GNSS left out", GNSS, 0.5),
    "gnss walks, latched": (
        Fault("gnss", 1, walk=0.3, whole=True),
        CONTACT,
        "relative sensor, GNSS, boom disagree",
        GNSS,
        5.0,
    ),
    "boom steps 0.5 m": (Fault("boom", 1, step=0.5), CONTACT, "boom left out", BOOM, 0.5),
    "boom walks": (Fault("boom", 2, walk=0.06), CONTACT, "relative sensor, GNSS, boom disagree", None, 12.0),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_told_in_time_and_its_error_stays_bounded(name: str) -> None:
    """Said within its time; the bound holds the error throughout; who did nothing is never left out; what is handed on to the
    estimator is never off by more than the bound and a reading's noise while the phase may go on."""
    fault, phase, words, out, within_s = FAULTS[name]
    s = draw(100, 60.0, phase, fault)
    assert s.texts and s.texts[0][1].startswith(words), s.texts
    assert 0.0 <= s.texts[0][0] - fault.at_s <= within_s
    assert (np.abs(s.error) <= s.pl).all()
    assert s.bank.excluded == (0 if out is None else 1 << out)
    go = ~s.over
    assert (np.abs(s.fed[go]) <= s.pl[go] + 0.6).all(axis=1).mean() > 0.99
    if out is None:
        assert s.over[-1]


def test_the_estimate_is_not_flown_by_what_the_bank_leaves_out() -> None:
    """A fix of a pair that lies is not handed on: whose it is nobody knows."""
    s = draw(4, 30.0, CONTACT, Fault("gnss", 0, step=5.0))
    assert s.bank.excluded == 1 << GNSS
    out = s.t >= s.texts[0][0]
    assert s.gnss[~out].any() and not s.gnss[out].any()


def test_an_estimator_aside_of_the_bank_is_not_flown_by() -> None:
    """2.5 m apart from 20 s on: what is flown by stays the bank's, and nothing is over."""
    s = draw(4, 30.0, CONTACT, off_m=2.5)
    assert not s.over[400:].any() and np.abs(s.flown - s.error)[400:].max() < 1e-9


def test_what_is_flown_by_is_no_better_bounded_than_it_is_off_the_bank() -> None:
    """Where the bank begins 2.5 m aside of the estimator the flight begins there too, beyond the limit in contact, and comes
    to the bank by 0.3 m/s."""
    s = draw(4, 30.0, CONTACT, off_m=2.5, off_s=-1.0)
    first = int(np.argmax(np.isfinite(s.pl[:, 1])))
    off = s.flown[:, 1] - s.error[:, 1]
    for late in (2.0, 5.0):
        assert off[first + round(late / DT)] == pytest.approx(2.5 - CATCH_MPS * late, abs=0.1)
    assert s.over[first + round(1.5 / DT)] and not s.over[first + round(9.0 / DT) :].any()
    assert np.abs(off[first + round(9.0 / DT) :]).max() < 1e-9


@pytest.mark.parametrize(("until_s", "back"), [(35.0, True), (math.inf, False)], ids=["ends", "lasts"])
def test_a_source_left_out_comes_back_by_agreeing_with_the_others_for_long(until_s: float, back: bool) -> None:
    """A step of 3 m that ends: taken again 30 s after its end, the bound honest throughout; one that lasts never is."""
    s = draw(11, 75.0, CONTACT, Fault("rel", 1, step=3.0, until_s=until_s))
    words = ["relative sensor left out: stepped away from the others", "relative sensor taken again"]
    assert [x for _, x in s.texts] == words[: 1 + back] and (np.abs(s.error) <= s.pl).all() and not s.over.any()
    assert not back or 30.0 <= s.texts[1][0] - until_s < 31.0
    assert s.bank.out.used >> REL & 1 == back


def test_a_silent_relative_sensor_is_stood_in_for() -> None:
    """60 s at contact: the reading handed on is the bank's, 0.3 m RMS. With GNSS alone it rests on what was known and on
    accelerometers: the bound grows, holds, and ends the phase."""
    s = draw(7, 90.0, CONTACT, Fault("rel", off=True, at_s=30.0))
    gone = s.t > 30.0 + 0.3
    assert not s.over.any() and (np.sqrt((s.fed[gone] ** 2).mean(axis=0)) < 0.3).all()
    assert s.bank.out.used == (1 << GNSS | 1 << BOOM)
    alone = draw(7, 40.0, PRECONTACT, Fault("rel", off=True, at_s=30.0))
    assert alone.pl[-1].min() > 10.0 and (np.abs(alone.error) <= alone.pl).all() and alone.over[-1]
    assert 2.0 < alone.t[np.argmax(alone.over)] - 30.0 < 8.0
