"""The gust mission on aircraft that are not as its file says: servos are found, intervals hold, jams and stall are told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.missions.gust.model import published
from flightsw.missions.gust.servo_bank.believed import slow_by
from flightsw.missions.gust.servo_bank.params import ServoBankParams
from flightsw.missions.gust.steering import INCIDENCE, SERVOS
from hil_scripts.studies.hoffmann import sensors as hs
from hil_scripts.studies.hoffmann.loop import held
from hil_scripts.studies.hoffmann.robust import Onboard

WN, EXTRA = (20.0, 28.0, 40.0, 56.0, 80.0), (0, 1, 2)


def flown(duration_s: float, seed: int = 3, nav: dict[str, Any] | None = None, **case: Any) -> hs.Seen:
    return hs.fly(hs.BASE | {"duration_s": duration_s} | case, seed, Onboard(nav or {}))


@pytest.mark.parametrize("wn", WN)
@pytest.mark.parametrize("extra", EXTRA)
def test_every_servo_of_the_bank_is_found(wn: float, extra: int) -> None:
    s = flown(12.0, servo_wn_radps=wn, extra_late_samples=extra)
    found = s.model[-250:, :2]
    assert np.mean(np.all(found == (wn, 1 + extra), axis=1)) > 0.8
    assert not s.alleviates[:145].any()  # the hold until then,
    slow = 1.0 / wn + (1 + extra) * 0.02 > ServoBankParams().lag_most_s
    assert not s.alleviates[300:].any() if slow else s.alleviates[160:].all()  # and with what is too slow for the law
    assert slow is any(w == "hold: servos too slow and late" for _, w in s.warned) and SERVOS == 7  # WKF_GUST_DOUBT


def test_what_is_too_slow_is_the_slowest_two() -> None:
    most = ServoBankParams().lag_most_s
    assert [(w, e) for w in WN for e in EXTRA if 1.0 / w + 0.02 * (1 + e) > most] == [(20.0, 2), (28.0, 2)]


def test_slow_models_lead_by_their_best_over_the_best_of_the_others() -> None:
    """The model in force may be a slow one, and another behind: it is the evidence that counts."""
    ll, lag = np.array([-1.0, 0.0, -7.0]), np.array([0.11, 0.07, 0.12])
    assert slow_by(ll, lag, 0.095) == -1.0 and slow_by(ll, lag, 0.115) == -7.0
    assert slow_by(ll, lag, 0.05) == math.inf and slow_by(ll, lag, 0.2) == -math.inf


def test_lift_and_airspeed_bias_are_inside_their_intervals() -> None:
    inside = {"lift": [], "bias": [], "alpha_W": []}
    for seed in (1, 2, 3):
        s = flown(30.0, seed, lift_factor=0.85, fault={"at_s": 0.0, "V_mps": 1.5})
        m = s.model[500:]
        inside["lift"].append(np.abs(m[:, 2] + 0.15) < 2.0 * m[:, 3])
        inside["bias"].append(np.abs(m[:, 4] - 1.5) < 2.0 * m[:, 5])
        inside["alpha_W"].append(np.abs(s.off[500:, 0]) < 2.0 * s.off[500:, 1])
    assert np.mean(inside["lift"]) > 0.7 and np.mean(inside["bias"]) > 0.85 and np.mean(inside["alpha_W"]) > 0.9


@pytest.mark.parametrize(("surface", "most_s"), [("elevator", 2.0), ("flap", 1.0)])
def test_a_jam_is_told_sooner_than_before(surface: str, most_s: float) -> None:
    for seed in (1, 2, 3):
        fault = {"at_s": 10.0, "jam": surface}
        now = flown(14.5, seed, fault=fault)
        left = np.flatnonzero(~now.alleviates[500:])
        assert len(left) and left[0] * 0.02 < most_s
        assert any(t > 10.0 and "disagree" in w for t, w in now.warned)


def test_a_stall_ends_trust_and_is_told() -> None:
    s = flown(20.0, 4, stall_deg=15.0, gusts=[[12.0, -16.0]])
    assert np.abs(s.alpha).max() > math.radians(15.0)
    assert any("incidence passes the model" in w for _, w in s.warned)
    assert not s.alleviates[round(12.5 / 0.02) :].any()
    assert INCIDENCE == 5  # WKF_GUST_DOUBT


def test_a_load_above_the_holds_is_left() -> None:
    """Commands four samples later than any model of the bank has them: alleviation does harm, and ends."""
    case = {"extra_late_samples": 6}
    s = flown(40.0, 1, **case)
    assert any(w.startswith("hold: ") for _, w in s.warned)
    base = hs.BASE | case
    hold = hs.fly(base, 1, held(published()))
    assert np.sqrt(np.mean(s.az[1000:] ** 2)) < 1.15 * np.sqrt(np.mean(hold.az[1000:] ** 2))


def test_a_vane_that_jumps_keeps_its_place_in_the_estimate() -> None:
    s = flown(30.0, fault={"at_s": 12.0, "vane_deg": 6.0})
    assert s.alleviates[700:].all() and np.degrees(np.sqrt(np.mean(s.off[700:, 0] ** 2))) < 0.6


def test_campaign_smoke() -> None:
    case = hs.STUDY.choose(["tactical_nominal"])[0]
    short = hs.Case(case.name, case.params | {"duration_s": 12.0})
    v = hs.run_sensors(short, 5).values
    assert v["hold.a_z_rms_mps2"] > 0.5 and v["servo_bank.hold_pct"] < 20.0
    assert {"bank.reduction_low_pct", "servo_bank.reduction_low_pct", "servo_bank.servo_wn_radps"} <= v.keys()
    assert len({c.name for c in hs.STUDY.cases}) == len(hs.STUDY.cases)
