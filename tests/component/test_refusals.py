"""Readings that contradict the others are refused, counted and told, sensor by sensor; what remains of the estimate is honest."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw import refusal as rd
from flightsw.icd.codec_telemetry import READINGS
from flightsw.icd.dialect import ENUMS
from flightsw.types import HF_AIR
from sim_plant.failures.script import Event
from tests.component.refuel_rig import Rig

Flight = tuple[Rig, dict[str, dict[str, np.ndarray]]]
FIRST_S, APART_S = 12.0, 1.5
# aircraft, sensor of the plant, channel of its probes, error of one sample, what must refuse it
SPIKES: list[tuple[str, str, str, tuple[float, ...], int]] = [
    *((who, "air", "V", (12.0,), rd.V) for who in ("tanker", "receiver")),
    *((who, "air", "alpha", (-0.06,), rd.ALPHA) for who in ("tanker", "receiver")),
    *((who, "air", "beta", (0.06,), rd.BETA) for who in ("tanker", "receiver")),
    *((who, "imu", "", (0.0, 1.0, 0.0, 0.0, 0.0, 0.0), rd.GYRO) for who in ("tanker", "receiver")),
    *((who, "att", "", (0.0, 0.05, 0.0), rd.ATT) for who in ("tanker", "receiver")),
    ("tanker", "gnss", "", (8.0, -8.0, 8.0, 0.0, 0.0, 0.0), rd.GNSS_POS),
    *((who, "gnss", "", (0.0, 0.0, 0.0, 5.0, 5.0, 5.0), rd.GNSS_VEL) for who in ("tanker", "receiver")),
    ("receiver", "rel", "", (0.0, 6.0, 0.0, 0.0, 0.0, 0.0), rd.REL_POS),
    ("receiver", "rel", "", (0.0, 0.0, 0.0, 0.0, 0.0, 3.0), rd.REL_VEL),
]  # fmt: skip


def event(k: int) -> Event:
    who, sensor, channel, value, _ = SPIKES[k]
    return Event(FIRST_S + APART_S * k, "spike", who, sensor=sensor, channel=channel, value=value)


@pytest.fixture(scope="module")
def spiked() -> Flight:
    """One flight at contact with every spike of SPIKES, one after the other."""
    rig = Rig(3, FIRST_S + APART_S * len(SPIKES), mismatch=0.10, events=tuple(event(k) for k in range(len(SPIKES))))
    return rig, rig.run()


def published(who: str) -> tuple[str, ...]:
    """Estimates an aircraft publishes a 1-sigma of."""
    return ("wind", "pos", "att") if who == "tanker" else ("wind", "pos", "att", "rel")


def side(log: dict[str, dict[str, np.ndarray]], who: str) -> dict[str, np.ndarray]:
    return log["tanker.flown" if who == "tanker" else "flown"]


@pytest.mark.parametrize("k", range(len(SPIKES)), ids=[f"{s[0]}-{rd.KINDS[s[4]][0]}" for s in SPIKES])
def test_a_spike_is_refused_counted_and_leaves_the_estimate_inside_three_sigma(spiked: Flight, k: int) -> None:
    rig, log = spiked
    who, _, _, _, kind = SPIKES[k]
    t, own = log["truth"]["t"], side(log, who)
    at = FIRST_S + APART_S * k
    before, after = (int(np.argmin(np.abs(t - x))) for x in (at - 0.1, at + 0.2))
    gained = own["refused"][after] - own["refused"][before]
    assert gained[kind] == 1
    assert gained.sum() == 1
    name = rd.KINDS[kind][0]
    assert any(i == (who == "receiver") and x.startswith(name) and abs(s - at) < 0.1 for s, i, x in rig.texts)
    here = (t >= at) & (t < at + APART_S)
    for e in published(who):
        # lasting errors of the sensors stay for the whole flight: a bound for every sample, the share is judged below
        assert (np.abs(own[e][here]) <= 4.5 * own[f"{e}_sigma"][here]).all(), e


def test_nobody_is_kept_out_for_single_spikes(spiked: Flight) -> None:
    rig, log = spiked
    assert not any("kept out" in x for _, _, x in rig.texts)
    for who in ("tanker", "receiver"):
        own = side(log, who)
        assert own["valid"][40:].all() and not own["flags"][40:].any()
        for e in published(who):
            assert (np.abs(own[e][40:]) <= 3.0 * own[f"{e}_sigma"][40:]).mean() > 0.97, e


@pytest.fixture(scope="module")
def stepped() -> Flight:
    """Every airspeed of both aircraft reads 30 m/s too little from 15 s to 35 s."""
    events = tuple(
        Event(15.0, "bias", who, for_s=20.0, sensor="air", channel="V", value=(-30.0,))
        for who in ("tanker", "receiver")
    )
    rig = Rig(3, 45.0, mismatch=0.10, events=events)
    return rig, rig.run()


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_a_step_of_every_airspeed_does_not_enter_the_wind(stepped: Flight, who: str) -> None:
    rig, log = stepped
    t, own = log["truth"]["t"], side(log, who)
    during = (t > 15.0) & (t < 35.0)
    assert np.abs(own["wind"][during]).max() < 3.0
    assert (np.abs(own["wind"][t > 5.0]) <= 3.0 * own["wind_sigma"][t > 5.0]).mean() > 0.97
    # the sigma of the wind along the flight path (north) grows, that across does not
    before, after = own["wind_sigma"][t > 14.9][0], own["wind_sigma"][t > 34.9][0]
    assert after[0] > 2.0 * before[0]
    assert after[2] < 1.2 * before[2]
    assert (own["flags"][(t > 16.0) & (t < 35.0)] & HF_AIR).all()
    texts = [x for s, i, x in rig.texts if i == (who == "receiver") and x.startswith("airspeed")]
    assert [x.split(":")[0] for x in texts] == ["airspeed refused", "airspeed kept out", "airspeed back in use"]


def test_a_sensor_that_was_kept_out_and_is_good_again_comes_back(stepped: Flight) -> None:
    rig, log = stepped
    t = log["truth"]["t"]
    for who in ("tanker", "receiver"):
        back = next(s for s, i, x in rig.texts if i == (who == "receiver") and x == "airspeed back in use")
        assert 35.0 < back < 42.0
        own = side(log, who)
        assert np.abs(own["wind_sigma"][-1] - own["wind_sigma"][t > 14.9][0]).max() < 0.05
        assert not own["flags"][-1]


START = {
    "none_after": (
        Event(0.0, "bias", "tanker", for_s=0.1, sensor="air", channel="V", value=(-40.0,)),
        Event(0.1, "off", "tanker", sensor="air"),
    ),
    "good_after": (Event(0.0, "bias", "tanker", for_s=0.1, sensor="air", channel="V", value=(-40.0,)),),
    "bad_for_good": (Event(0.0, "bias", "tanker", sensor="air", channel="V", value=(-40.0,)),),
}


@pytest.mark.parametrize("name", START)
def test_validity_is_earned(name: str) -> None:
    """A bad airspeed at the start makes no valid wind that is 40 m/s wrong; good readings after it do make a valid one."""
    rig = Rig(3, 3.0, mismatch=0.10, events=START[name])
    log = rig.run()
    own = log["tanker.flown"]
    if name == "good_after":
        assert own["valid"][-1] and own["valid"].argmax() * 0.05 < 2.0
        assert (np.abs(own["wind"]) <= 3.5 * own["wind_sigma"])[own["valid"]].all()
    else:
        assert not own["valid"].any()
        why = rig.apps[0].nav.reason
        assert why == ("airspeed: 1 of 8 readings" if name == "none_after" else "lift does not fit the airspeed")


def test_a_lying_gyro_does_not_cost_the_attitude_reference() -> None:
    """Gyro 0.2 rad/s wrong: it is left out; 0.05 rad/s, below its gate: the attitude that contradicts it stays in use."""
    for value, out in ((0.2, True), (0.05, False)):
        e = Event(8.0, "bias", "receiver", sensor="imu", value=(0.0, value, 0.0, 0.0, 0.0, 0.0))
        rig = Rig(3, 16.0, mismatch=0.10, events=(e,))
        log = rig.run()
        assert any(x.startswith(("gyro kept out", "gyro left out")) for _, _, x in rig.texts) or not out
        assert not any(x.startswith("attitude kept out") for _, _, x in rig.texts)
        assert np.abs(log["flown"]["att"][-1]).max() < (0.01 if out else 0.05)
        assert np.abs(log["truth"]["xi"][-1]).max() < 1.5


def test_moderate_turbulence_keeps_no_sensor_out_for_good() -> None:
    """2.1 m/s where the filter expects 0.39: the gate opens with the roughness all three air data feel."""
    rig = Rig(3, 30.0, mismatch=0.10, plant={"wind.dryden.sigma_mps": 2.1})
    log = rig.run()
    t = log["truth"]["t"]
    for who in ("tanker", "receiver"):
        own = side(log, who)
        assert own["valid"][40:].all()
        assert (own["flags"][t > 5.0] & HF_AIR == 0).mean() > 0.9
        assert own["refused"][-1].sum() < 0.02 * 20.0 * t[-1] * 3


def test_the_names_of_the_readings_are_those_of_the_icd() -> None:
    entries = [e.name for _, e in sorted(ENUMS["WKF_READING"].items()) if "ENUM_END" not in e.name]
    ours = {
        "AIRSPEED": rd.V, "SIDESLIP": rd.BETA, "INCIDENCE": rd.ALPHA, "GYRO": rd.GYRO, "ATTITUDE": rd.ATT,
        "GNSS_POSITION": rd.GNSS_POS, "GNSS_VELOCITY": rd.GNSS_VEL, "REL_POSITION": rd.REL_POS, "REL_VELOCITY": rd.REL_VEL,
        "WAKE": rd.WAKE, "GNSS_DIFFERENCE": rd.GNSS_DIFF, "GNSS_RATE": rd.REL_RATE,
    }  # fmt: skip
    assert {f"WKF_READING_{k}": v for k, v in ours.items()} == {n: i for i, n in enumerate(entries)}
    assert len(rd.KINDS) == READINGS == len(entries)
