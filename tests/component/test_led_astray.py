"""A tube that ices over or a vane that drifts leads the estimate, until lift and wind speak; then it gets back what it lost."""

from __future__ import annotations

import numpy as np
import pytest

from sim_plant.failures.script import Event
from tests.component.refuel_rig import Rig

BOTH = ("tanker", "receiver")
AT_S, FOR_S = 15.0, 25.0
# share of the impact pressure lost per second -> [m/s] the airspeed reads too little at the end, if anything
RATES = {0.0167: 43.0, 0.1: 195.0}


@pytest.fixture(scope="module", params=RATES)
def iced(request: pytest.FixtureRequest) -> tuple[float, Rig, dict[str, dict[str, np.ndarray]]]:
    """Both aircraft's tubes ice over, in contact, with derivatives a tenth off."""
    events = tuple(Event(AT_S, "iced", who, sensor="air", value=(request.param,)) for who in BOTH)
    rig = Rig(3, AT_S + FOR_S, mismatch=0.10, events=events)
    return request.param, rig, rig.run()


@pytest.mark.parametrize("who", BOTH)
def test_an_iced_tube_is_told_and_the_wind_comes_back(
    iced: tuple[float, Rig, dict[str, dict[str, np.ndarray]]], who: str
) -> None:
    """Without it the estimate had the whole error for wind, or the receiver broke up by elevators for half its airspeed."""
    rate, rig, log = iced
    own = log["tanker.flown" if who == "tanker" else "flown"]
    off = np.linalg.norm(own["wind"], axis=1)[log["truth"]["t"] > AT_S]
    told = [s for s, i, x in rig.texts if i == (who == "receiver") and x.startswith("airspeed kept out")]
    assert len(told) == 1 and told[0] > AT_S
    assert off.max() < 0.75 * min(RATES[rate], 40.0)
    assert off[-1] < 10.0
    sigma = np.linalg.norm(own["wind_sigma"][-1])
    assert off[-1] < 3.0 * sigma


@pytest.mark.parametrize("rate", [0.002, 0.01])
def test_a_vane_that_drifts_is_not_taken_for_a_tube(rate: float) -> None:
    """Lift contradicts the estimate as well, but the wind has changed upwards, or the gate strains at the vane alone."""
    events = tuple(Event(AT_S, "drift", who, sensor="air", channel="alpha", value=(rate,)) for who in BOTH)
    rig = Rig(3, AT_S + FOR_S, mismatch=0.10, events=events)
    log = rig.run()
    assert not any(x.startswith("airspeed kept out") for _, _, x in rig.texts)
    for who in BOTH:
        assert sum(i == (who == "receiver") and x.startswith("incidence kept out") for _, i, x in rig.texts) == 1
        wind = log["tanker.flown" if who == "tanker" else "flown"]["wind"]
        assert abs(wind[-1, 2]) < 3.0
