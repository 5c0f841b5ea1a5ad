"""Every airspeed wrong at once: two witnesses of three decide, one of them never does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.icing import Icing
from flightsw.types import SensorFrame

AC = load_aircraft("learjet24")
V, RHO, DT, ALPHA = 195.0, 0.59, 0.05, 0.05
FUEL = 1000.0
SOUND = 400  # samples before anything happens


def flown(
    iced: np.ndarray, gust: float = 0.0, tanker: float = 0.0, gnss: bool = True, rough: float = 0.39
) -> tuple[list[bool], list[float | None]]:
    """Whether each sample says every airspeed is bad, and the airspeed without them: `iced` [n] is added to the readings, a gust
    along the path meets both aircraft, `tanker` is an error of the other's airspeed, all after SOUND samples."""
    w, g = Icing(AC), np.random.default_rng(1)
    CL = AC.aero.CL0 + AC.aero.CL_alpha * ALPHA
    bad, by = [], []
    for i, ice in enumerate(iced):
        now = i >= SOUND
        true = V + (gust if now else 0.0)
        lift = 0.5 * RHO * true**2 * AC.geometry.S_m2 * CL / (AC.mass.empty_kg + FUEL)
        t = round(1e6 * DT * (i + 1))
        f = SensorFrame(
            t_us=t, gnss_t_us=t if gnss else 0, gnss_vel_n=(V + 3.0, 0.0, 0.0), acc_mean_b=(0.0, 0.0, -lift), fuel_kg=FUEL
        )  # fmt: skip
        read = true + ice + 0.3 * g.standard_normal()
        peer = true + (tanker if now else 0.0) + 0.4 * g.standard_normal()
        w.step(read, peer, (3.0, 0.0, 0.0), ALPHA, f, RHO, rough, DT)
        bad.append(w.bad)
        by.append(w.V)
    return bad, by


def step(size: float, n: int = 400) -> np.ndarray:
    return np.concatenate((np.zeros(SOUND), np.full(n, size)))


@pytest.mark.parametrize("size", [-10.0, -30.0, 10.0])
def test_ice_is_found_within_a_second_and_the_airspeed_goes_on_without(size: float) -> None:
    bad, by = flown(step(size))
    assert not any(bad[:SOUND]) and all(bad[SOUND + 20 :])
    assert by[-1] == pytest.approx(V, abs=0.5)


def test_ice_that_grows_is_found_before_it_is_five_metres_per_second() -> None:
    bad, by = flown(np.concatenate((np.zeros(SOUND), -0.3 * DT * np.arange(600))))
    first = bad.index(True)
    assert first > SOUND and 0.3 * DT * (first - SOUND) < 5.0
    assert by[-1] == pytest.approx(V, abs=1.5)


def test_a_gust_a_tanker_that_lies_and_a_silent_gnss_are_no_ice() -> None:
    assert not any(flown(step(0.0), gust=8.0)[0])
    assert not any(flown(step(0.0), tanker=8.0)[0])
    assert not any(flown(step(-10.0), gnss=False)[0][:SOUND])
    assert not any(flown(step(0.0), rough=3.0)[0])


def test_without_gnss_lift_is_the_second_witness_against_what_is_large() -> None:
    bad, by = flown(step(-30.0), gnss=False)
    assert bad[-1] and by[-1] is None
    assert not flown(step(-5.0), gnss=False)[0][-1]


def test_airspeeds_that_agree_again_are_taken_after_a_while() -> None:
    bad, _ = flown(np.concatenate((step(-10.0, 200), np.zeros(300))))
    assert bad[SOUND + 199] and bad[SOUND + 240] and not bad[-1]
    assert math.isclose(sum(bad) * DT, 10.0 + 5.0, abs_tol=4.0)
