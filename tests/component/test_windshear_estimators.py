"""Every estimator of the windshear mission in the plant's aircraft: it finds the wind, or says that it cannot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.continuous import LOST
from flightsw.missions.windshear.estimator import CONTINUOUS
from flightsw.missions.windshear.mission import ESTIMATORS
from flightsw.missions.windshear.reports import WindshearState
from flightsw.strict import ConfigError
from sim_plant.aircraft.twinjet.flight import TwinJetAir
from sim_plant.wind.microburst import MICROBURSTS
from tests.component.test_windshear_mission import Flight, make

# what a continuous filter takes
PLAIN = {"nav__states": 13, "nav__adaptive": False, "nav__turbulence": 0.0, "nav__wind_gain_s2pm": 0.0}
SAMPLED = [(name, states) for name in ESTIMATORS if name not in CONTINUOUS for states in (13, 15)]


@pytest.mark.parametrize(("name", "states"), [*SAMPLED, ("ukf_printed", 13), ("ukf_43", 13)])
def test_every_estimator_finds_the_wind(name: str, states: int) -> None:
    more = PLAIN if name in CONTINUOUS else {"nav__states": states}
    flight = Flight(make(nav__filter=name, **more), TwinJetAir(MICROBURSTS["seed"], 0.5, 0.4))
    s = flight.fly(50.0)
    w, truth = s.report(WindshearState), flight.rows[-1][0]
    assert w is not None and w.valid and (ESTIMATORS[w.estimator], w.states) == (name, states)
    assert w.x[k.WX] == pytest.approx(truth[7], abs=1.2) and w.x[k.WH] == pytest.approx(truth[8], abs=0.8)
    assert w.wind_monitor[0] == pytest.approx(truth[7], abs=2.5)


def test_the_filter_that_loses_its_covariance_says_so_and_starts_anew() -> None:
    """Trap 1 of docs/sources/jing.md: as meant, it loses it at the second step after every start; the flight goes on."""
    flight = Flight(make(nav__filter="ukf_continuous", **PLAIN), TwinJetAir(MICROBURSTS["seed"], 0.5, 0.4))
    flight.fly(10.0)
    seen = [s.report(WindshearState) for _, s in flight.rows]
    assert flight.app.mission.nav.restarts > 100 and {ESTIMATORS[w.estimator] for w in seen} == {"ukf_continuous"}
    assert 0.5 < np.mean([w.valid for w in seen]) < 0.8
    assert any(LOST.startswith(t.text.removeprefix("navigation: ")) for _, s in flight.rows for t in s.texts)
    assert (
        all(math.isfinite(s.cmd.elevator + s.cmd.throttle) for _, s in flight.rows) and flight.phases[-1] == "approach"
    )


@pytest.mark.parametrize("name", CONTINUOUS)
def test_a_continuous_filter_takes_no_more_than_the_source_has(name: str) -> None:
    for more in ({"nav__states": 15}, {"nav__adaptive": True, "nav__turbulence": 0.02}, {"nav__wind_gain_s2pm": 1.0}):
        with pytest.raises(ConfigError, match=name):
            make(nav__filter=name, **(PLAIN | more))
