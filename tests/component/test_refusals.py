"""Readings that contradict the others are refused, counted and told, sensor by sensor; what remains of the estimate is honest."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.nav import refusal as rd
from sim_plant.events import Event
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
