"""An onboard computer that is gone for a while, in the worst places: what the servo unit and the restarted mission make of it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import load_airframe
from flightsw.aircraft.base import Controls, find
from flightsw.missions.receiver.mission import ReceiverParams
from flightsw.missions.receiver.station_keeping import make_station_keeping
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.types import GuidanceCmd, NavState
from sim_plant.kernels import layout as n
from sim_plant.sensors.base import View
from sim_plant.servo_unit import ServoUnit
from tests.hil.cuts import RECEIVER, TANKER, fly


@pytest.mark.parametrize(
    ("who", "where", "seconds", "fresh"),
    [
        (RECEIVER, "contact", 3.0, True),
        (RECEIVER, "contact", 1.0, False),
        (RECEIVER, "precontact", 5.0, True),
        (TANKER, "contact", 3.0, False),
    ],
)
def test_nobody_is_hurt(who: int, where: str, seconds: float, fresh: bool) -> None:
    flown = fly(where, who, seconds, fresh, after_s=8.0)
    assert not flown.lost
    assert flown.bank_deg < 15.0 and flown.highest_m > 2.0 and flown.closest_m > 30.0
    assert flown.phase == "BREAKAWAY"


def test_hold_is_what_killed_it(tmp_path: Path) -> None:
    """The rule of the servo unit decides: the receiver whose servos keep the last command does not live through this."""
    held = tmp_path / "held.toml"
    text = find("learjet24").read_text().replace('silent = "level"', 'silent = "hold"')
    held.write_text(text.replace("silent_pitch_deg", "#").replace("silent_throttle", "#"))
    flown = fly("contact", RECEIVER, 3.0, True, after_s=8.0, sets=(f"plant.aircraft.receiver.file={held}",))
    assert flown.lost or flown.bank_deg > 15.0 or flown.highest_m < 2.0


TRIM = (0.01, -0.02, 0.003, 0.6, True, 0.0)


def view(bank: float, pitch: float, rates: tuple[float, float, float]) -> View:
    v = View(0)
    v.s, v.o = np.zeros(n.NS).tolist(), np.zeros(n.NO).tolist()
    v.o[n.O_EULER : n.O_EULER + 3] = [0.0, pitch, bank]
    v.s[n.S_W : n.S_W + 3] = rates
    return v


def test_servo_unit_rules() -> None:
    last = (0.1, 0.1, 0.1, 0.9, True, 0.0)
    level = view(0.0, 0.05, (0.0, 0.0, 0.0))
    for rule, expected in (("hold", last), ("trim", (*TRIM[:4], False, 0.0)), ("level", (*TRIM[:4], False, 0.0))):
        unit = ServoUnit(Controls((-20.0, 20.0), silent=rule), TRIM, 1, "receiver")
        unit.begin(level)
        # level: less what its own reference and gyro are wrong by, four sigma at most here
        assert unit.command(last, level) == pytest.approx(
            expected, abs=0.3 * math.radians(5.2) if rule == "level" else 0.0
        )
    assert unit.command(last, level)[0] != TRIM[0]
    aileron, elevator, rudder, throttle, latch, _ = unit.command(last, view(0.2, 0.15, (0.1, 0.1, 0.1)))
    assert aileron < TRIM[0] and elevator > TRIM[1] and rudder > TRIM[2] and throttle == TRIM[3] and not latch


def test_position_error_is_limited_into_the_law() -> None:
    ac, tanker = load_airframe("learjet24"), load_airframe("kc135r")
    p = ReceiverParams().ctrl
    out = []
    for far in (1.0, 3.0):
        law = make_station_keeping(ac, tanker, p, 0.05, p)
        nav, cmd = NavState(), GuidanceCmd()
        nav.V = 195.0
        cmd.rel_pos_t = (-35.5, 0.0, 8.5)
        nav.rel_pos_t = tuple(c + far * m for c, m in zip(cmd.rel_pos_t, p.pos_limit_m, strict=True))
        out.append(law.step(nav, cmd, ActuatorModel(ac, 1), 0.0, 195.0, 7010.0, 0.05)[0])
    assert np.array_equal(out[0], out[1])
