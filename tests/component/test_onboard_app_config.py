"""The application refuses a wrong configuration by name."""

from __future__ import annotations

import pytest

from flightsw.app import FlightApp
from flightsw.strict import ConfigError


@pytest.mark.parametrize(
    ("kw", "text"),
    [
        ({"mission": "glider"}, r"app.mission = 'glider': allowed: gust, receiver"),
        ({"mission_rate_hz": 30}, r"mission_rate_hz = 30: must divide"),
        ({"tables": {"nav": {"q_W": 1.0}}}, r"q_W: unknown key"),
        ({"tables": {"health": {"imu_age_s": -1.0}}}, r"imu_age_s = -1.0: allowed"),
        ({"aircraft": "b52"}, r"does not exist; available"),
    ],
)
def test_wrong_configuration_is_named(kw: dict, text: str) -> None:
    args = {"mission": "tanker", "aircraft": "kc135r", "tables": {}, **kw}
    with pytest.raises(ConfigError, match=text):
        FlightApp(**args)
