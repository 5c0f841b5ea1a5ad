"""Test inputs: orthogonal, within their amplitude at any time, begun and ended at zero, told, and given up where they must be."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.excitation import (
    CONTROLS,
    Excitation,
    ExcitationParams,
    Multisine,
    flat_phases,
    harmonics,
)
from flightsw.strict import ConfigError, convert

KC135 = load_aircraft("kc135r")
PERIOD = 0.05
TRIM = np.array([0.0, -0.02, 0.0, 7e4])


def params(**more: object) -> ExcitationParams:
    return convert({"on": True, **more}, ExcitationParams, "excitation")


def test_harmonics_are_dealt_out_within_the_band() -> None:
    p = params(duration_s=50.0, band_hz=[0.1, 1.0])
    dealt = harmonics(p)
    together = sorted(k for ks in dealt for k in ks)
    assert together == list(range(5, 51))  # each once
    assert max(map(len, dealt)) - min(map(len, dealt)) <= 1
    without = harmonics(params(duration_s=50.0, band_hz=[0.1, 1.0], rudder_deg=0.0))
    assert without[2] == []
    assert sorted(k for ks in without for k in ks) == together


def test_multisines_are_orthogonal_and_their_power_is_that_of_equal_cosines() -> None:
    """Over the whole duration: mean of two controls' product 0, mean square amplitude^2 M / (2 peak^2)."""
    p = params()
    t = np.arange(0.0, p.duration_s, PERIOD)
    sines = [Multisine(k, a, p.duration_s) for k, a in zip(harmonics(p), p.amplitudes, strict=True)]
    y = np.array([[s.at(x) for x in t] for s in sines])
    gram = y @ y.T / len(t)
    size = np.sqrt(np.diag(gram))
    assert np.abs(gram / np.outer(size, size) - np.eye(4)).max() < 1e-12
    assert np.diag(gram) == pytest.approx([0.5 * len(s.w) * s.share**2 for s in sines], rel=1e-12)


def test_peak_keeps_within_the_amplitude_between_the_points_it_was_sought_at() -> None:
    for ks in ([2, 6, 10, 14], list(range(3, 80, 4)), [7]):
        s = Multisine(ks, 0.1, 80.0)
        fine = np.array([s.at(t) for t in np.linspace(0.0, 80.0, 40001)])
        assert np.abs(fine).max() <= 0.1
        assert np.abs(fine).max() > 0.095
        assert s.at(0.0) == pytest.approx(0.0, abs=1e-12)
        assert s.at(80.0) == pytest.approx(0.0, abs=1e-12)


def test_peaks_are_flatter_than_schroeders() -> None:
    k = np.arange(2, 80, 4)
    _, peak = flat_phases(k)
    i = np.arange(len(k))
    t = np.linspace(0.0, 2.0 * np.pi, 20000)
    schroeder = np.abs(np.cos(np.outer(t, k) - np.pi * i * i / len(k)).sum(axis=1)).max()
    assert peak < schroeder
    assert peak / math.sqrt(0.5 * len(k)) < 1.6  # crest factor


def flown(e: Excitation, seconds: float) -> list[tuple[np.ndarray, float]]:
    return [e.step(TRIM.copy(), 0.45, round(k * PERIOD * 1e6)) for k in range(round(seconds / PERIOD))]


def test_it_begins_ends_and_says_so() -> None:
    e = Excitation(KC135, params(start_s=1.0, duration_s=20.0), PERIOD)
    out = flown(e, 25.0)
    assert [t.text for t in e.texts] == ["excitation begins: 20 s", "excitation ends"]
    acting = [k for k, (u, _) in enumerate(out) if not np.array_equal(u, TRIM)]
    assert min(acting) >= 20  # it begins at zero
    assert max(acting) < 420
    u = np.array([row for row, _ in out])
    deg = np.degrees(np.abs(u - TRIM)[:, :3].max(axis=0))
    assert (deg <= [6.0, 5.0, 6.0]).all()
    assert (deg > [5.0, 4.0, 5.0]).all()
    share = np.array([s for _, s in out])
    assert u[:, 3] == pytest.approx(TRIM[3] * share / 0.45)


def test_commands_stay_within_the_travel() -> None:
    e = Excitation(KC135, params(start_s=0.0, duration_s=20.0), PERIOD)
    near = np.array([0.0, math.radians(14.0), 0.0, 7e4])
    u = np.array([e.step(near, 0.98, round(k * PERIOD * 1e6)) for k in range(400)], dtype=object)
    assert max(x[1] for x in u[:, 0]) == pytest.approx(math.radians(15.0))
    assert max(u[:, 1]) == 1.0


def test_it_is_given_up_for_good() -> None:
    e = Excitation(KC135, params(start_s=0.0), PERIOD)
    flown(e, 1.0)
    e.stop("recovery")
    e.stop("recovery")
    assert [t.text for t in e.texts] == ["excitation begins: 80 s", "excitation stopped: recovery"]
    u, throttle = e.step(TRIM, 0.45, 2_000_000)
    assert np.array_equal(u, TRIM)
    assert throttle == 0.45


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"aileron_deg": 11.0}, "aileron_deg = 11.0"),
        ({"elevator_deg": 8.0}, "elevator_deg = 8: allowed for kc135r: up to 7.5 deg"),
        ({"band_hz": [0.1, 6.0]}, "up to 4 Hz"),
        ({"duration_s": 10.0, "band_hz": [0.1, 1.0]}, "10 harmonics"),
        (dict.fromkeys(CONTROLS, 0.0), "above 0"),
        ({"on": False, "rudder_deg": 2.0}, "excitation.rudder_deg = 2.0: nothing obeys it"),
    ],
)
def test_what_cannot_be_flown_is_refused_by_name(more: dict[str, object], words: str) -> None:
    with pytest.raises(ConfigError, match=words.replace("[", r"\[")):
        Excitation(KC135, params(**more), PERIOD)
