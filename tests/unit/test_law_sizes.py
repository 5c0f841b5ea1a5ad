"""What a law is designed for belongs to the aircraft: masses come from its file or are refused, thrust is weighed by weight."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.missions.receiver import station_keeping
from flightsw.missions.receiver.mission import ReceiverMission, ReceiverParams
from flightsw.missions.receiver.station_keeping import ReceiverCtrlParams
from flightsw.missions.tanker.mission import TankerMission, TankerParams
from flightsw.sixdof import autopilot
from flightsw.sixdof.autopilot import TankerControl, TankerCtrlParams
from flightsw.sixdof.command import ScheduleParams, design_mass
from flightsw.strict import ConfigError

KC135, LEARJET = load_aircraft("kc135r"), load_aircraft("learjet24")


def scaled(ac: Aircraft, by: float) -> Aircraft:
    """The aircraft with its masses and its area times `by`: the same flight at the same speed by so much force."""
    m, g, i = ac.mass, ac.geometry, ac.inertia
    mass = replace(m, empty_kg=m.empty_kg * by, max_kg=m.max_kg * by, default_fuel_kg=m.default_fuel_kg * by)
    columns = ("mass_kg", "Ixx_kgm2", "Iyy_kgm2", "Izz_kgm2", "Ixz_kgm2")
    inertia = {f: tuple(x * by for x in getattr(i, f)) for f in columns}
    return replace(ac, mass=mass, geometry=replace(g, S_m2=g.S_m2 * by), inertia=replace(i, **inertia))


def test_a_mass_left_out_is_that_of_the_file() -> None:
    assert design_mass(KC135, 0.0, "k") == 120000.0
    p = station_keeping.sized(LEARJET, KC135, ReceiverCtrlParams(ScheduleParams()))
    assert (p.schedule.mass_kg, p.tanker_mass_kg) == (4989.5, 120000.0)
    assert p.w_input[3] == pytest.approx(3500.0 * 4989.5 / 5300.0)
    small = station_keeping.sized(LEARJET, scaled(KC135, 0.5), ReceiverCtrlParams(ScheduleParams()))
    assert small.tanker_mass_kg == 60000.0


def test_a_mass_the_aircraft_cannot_have_is_refused_by_name() -> None:
    small = scaled(KC135, 0.5)
    with pytest.raises(
        ConfigError, match=r"ctrl\.schedule\.mass_kg = 119000: allowed for kc135r: 22331.5 to 73142.5 kg"
    ):
        TankerMission(small, TankerParams(ctrl=TankerCtrlParams(ScheduleParams(mass_kg=119000.0))), 0.05)
    with pytest.raises(ConfigError, match=r"ctrl\.tanker_mass_kg = 40000: allowed for kc135r"):
        ReceiverMission(
            LEARJET, ReceiverParams(ctrl=ReceiverCtrlParams(ScheduleParams(), tanker_mass_kg=40000.0)), 0.05
        )


@pytest.mark.parametrize("by", [0.5, 4.0])
def test_thrust_is_weighed_in_proportion_to_the_aircraft(by: float) -> None:
    """An aircraft of half or four times the weight asks for about as many times the thrust."""
    p = TankerCtrlParams(ScheduleParams())
    one, other = TankerControl(KC135, p, 0.05), TankerControl(scaled(KC135, by), p, 0.05)
    for state in (autopilot.Z_V, autopilot.Z_ALT):
        assert other.sched.K[2, 3, state] / one.sched.K[2, 3, state] == pytest.approx(by, rel=0.12)


def test_what_a_flight_file_says_stays() -> None:
    p = TankerCtrlParams(ScheduleParams(mass_kg=119000.0), w_input=(0.1, 0.1, 0.1, 2.0e4))
    assert autopilot.sized(KC135, p) == p
