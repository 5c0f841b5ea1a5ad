"""Refuelling phase machine: commands, escapes, paths clear of the wake. Navigation by hand, no plant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.guidances import make_refuel_path
from flightsw.missions.receiver.refuel import (
    BREAKAWAY,
    CONTACT,
    DISCONNECT,
    HOLD,
    INIT,
    NAMES,
    OBSERVATION,
    PRECONTACT,
    RETURN,
    TO_CONTACT,
    TO_PRECONTACT,
    RefuelGuidance,
    RefuelParams,
)
from flightsw.types import ZERO3, NavState, SensorFrame

DT = 0.05
ACTION = {"hold": 1, "precontact": 2, "contact": 3, "disconnect": 4, "breakaway": 5, "observation": 6}


class Flight:
    """A receiver that is always exactly where the reference wants it."""

    def __init__(self, params: RefuelParams | None = None, around: Surroundings | None = None) -> None:
        made = make_refuel_path(params or RefuelParams(), around)
        assert isinstance(made, RefuelGuidance)
        self.g = made
        self.f, self.nav = SensorFrame(), NavState(valid=True, reason="", rel_valid=True, rel_age_s=0.0, peer_age_s=0.0)
        self.nav.rel_pos_t = self.g.p.observation_m
        self.offset = np.zeros(3)
        self.boom = False  # whether there is a boom signal
        self.path: list[tuple[float, float, float]] = []
        self.vel: list[tuple[float, float, float]] = []

    def step(self, n: int = 1) -> None:
        for _ in range(n):
            self.f.boom_t_us = self.f.t_us if self.boom else 0
            self.f.t_us += round(DT * 1e6)
            out = self.g.step(self.f, self.nav, DT)
            self.nav.rel_pos_t = tuple(np.array(out.rel_pos_t) + self.offset)
            self.nav.rel_vel_t = out.rel_vel_t
            self.path.append(out.rel_pos_t)
            self.vel.append(out.rel_vel_t)

    def until(self, phase: int, limit_s: float = 600.0) -> None:
        for _ in range(round(limit_s / DT)):
            if self.g.phase == phase:
                return
            self.step()
        raise AssertionError(f"{NAMES[phase]} not reached from {NAMES[self.g.phase]}")

    def order(self, name: str) -> None:
        ok, why = self.g.command(ACTION[name])
        assert ok, why

    def at(self, phase: int) -> Flight:
        """Fly to a phase by the regular procedure."""
        self.until(OBSERVATION)
        self.step(400)
        if phase == OBSERVATION:
            return self
        if phase == HOLD:
            self.order("hold")
            return self
        self.order("precontact")
        if phase == TO_PRECONTACT:
            self.step(100)
            return self
        self.until(PRECONTACT)
        if phase in (TO_CONTACT, CONTACT, DISCONNECT):
            self.order("contact")
            self.step(50)
        if phase in (CONTACT, DISCONNECT):
            self.until(CONTACT)
        if phase in (DISCONNECT, RETURN, BREAKAWAY):
            self.order({DISCONNECT: "disconnect", RETURN: "observation", BREAKAWAY: "breakaway"}[phase])
            self.step(20)
        assert self.g.phase == phase
        return self


# what each command does in each phase; a phase left out refuses it
ALLOWED = {
    "hold": dict.fromkeys(range(1, 10), HOLD),
    "precontact": dict.fromkeys((OBSERVATION, HOLD, RETURN), TO_PRECONTACT),
    "contact": {PRECONTACT: TO_CONTACT},
    "disconnect": dict.fromkeys((CONTACT, TO_CONTACT), DISCONNECT),
    "breakaway": dict.fromkeys(range(1, 10), BREAKAWAY),
    "observation": dict.fromkeys((PRECONTACT, TO_PRECONTACT, BREAKAWAY, HOLD), RETURN),
}


@pytest.mark.parametrize("phase", range(1, 10), ids=NAMES[1:])
@pytest.mark.parametrize("name", ACTION)
def test_every_command_in_every_phase(name: str, phase: int) -> None:
    f = Flight().at(phase)
    before = f.g.pos
    ok, why = f.g.command(ACTION[name])
    want = ALLOWED[name].get(phase)
    assert ok == (want is not None)
    assert f.g.phase == (phase if want is None else want)
    if want is None:
        assert NAMES[phase] in why  # the refusal says where it was refused
    f.step()
    assert math.dist(f.g.pos, before) < 0.25  # whatever was ordered, the reference does not jump


@pytest.mark.parametrize("name", [n for n in ACTION if n != "hold"])
def test_before_navigation_every_movement_is_refused(name: str) -> None:
    g = RefuelGuidance(RefuelParams())
    ok, why = g.command(ACTION[name])
    assert not ok and "navigation" in why
    assert g.phase == INIT


@pytest.mark.parametrize("action", [0, 7, -1, 10**9])
def test_an_unknown_action_is_refused_with_what_is_allowed(action: int) -> None:
    ok, why = Flight().at(OBSERVATION).g.command(action)
    assert not ok and "1 to 6" in why


def test_it_starts_where_the_aircraft_is() -> None:
    f = Flight()
    f.nav.rel_pos_t, f.nav.rel_vel_t = (-70.0, 60.0, 3.0), (0.5, -0.2, 0.1)
    f.g.step(f.f, f.nav, DT)
    assert f.g.phase == OBSERVATION
    assert f.g.pos == (-70.0, 60.0, 3.0)
    assert math.dist(f.g.vel, (0.5, -0.2, 0.1)) < 1e-12


def test_the_latch_is_closed_only_while_closing_and_in_contact() -> None:
    for phase in range(1, 10):
        f = Flight().at(phase)
        f.step()
        assert f.g.out.latch == (f.g.phase in (TO_CONTACT, CONTACT)), NAMES[phase]


def closing(offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Flight:
    """With a boom, at rest in the contact position of `airdata`, 0.62 m below the envelope's upper face, less `offset`."""
    p = RefuelParams(
        low_m=(-59.0, 56.3, 5.6),
        behind_m=(-59.0, 0.0, 5.6),
        precontact_m=(-47.0, 0.0, 6.2),
        contact_m=(-35.6, 0.0, 6.9),
    )
    f = Flight(p, Surroundings(load_aircraft("kc135r"), load_aircraft("learjet24"))).at(PRECONTACT)
    f.boom = True
    f.offset[:] = offset
    f.order("contact")
    return f


def test_the_boom_is_asked_for_after_two_seconds_well_inside_its_envelope() -> None:
    f = closing()
    inside = []
    while not f.g.out.latch:
        f.step()
        assert f.g.phase == TO_CONTACT
        x, _, z = np.array(f.nav.rel_pos_t) + (3.0 + 21.943, 0.0, -1.0 - 1.405)  # receptacle from the boom's pivot
        # of both faces met on this way: how far it is below the upper one, and short of the longest extension
        inside.append(
            min(x * math.sin(math.radians(20.0)) + z * math.cos(math.radians(20.0)), 8.53 + 5.49 - math.hypot(x, z))
        )
    assert all(d > 0.29 for d in inside[-40:]) and min(inside[:-42]) < 0.0
    assert len([d for d in inside if d > 0.31]) <= 43


def test_an_unsteady_receiver_waits_says_so_and_is_not_in_contact_without_the_boom() -> None:
    f = closing((0.0, 0.0, -0.5))  # 0.13 m inside
    f.until(TO_CONTACT)
    while not f.g.at_rest:
        f.step()
    f.step(20)
    said = [t.text for t in f.g.texts if "not steady" in t.text]
    assert said == ["closing: not steady inside the boom's envelope"] and f.g.reason == said[0].partition(": ")[2]
    assert f.g.phase == TO_CONTACT and not f.g.out.latch
    for _ in range(5):  # good for less than two seconds at a time is not good
        f.offset[2] = 0.0
        f.step(35)
        f.offset[2] = -0.5
        f.step(5)
        assert not f.g.out.latch
    f.offset[2] = 0.0
    f.step(45)
    assert f.g.out.latch and f.g.phase == TO_CONTACT
    f.f.boom_contact = True
    f.step()
    assert f.g.phase == CONTACT
    f.offset[2] = -0.5  # once it is in the boom decides
    f.step(100)
    assert f.g.out.latch and f.g.phase == CONTACT


def test_a_receiver_never_steady_backs_off_after_a_while_whether_or_not_there_is_a_signal() -> None:
    for signal in (True, False):
        f = closing((0.0, 0.0, -0.5))
        f.boom = signal
        while not f.g.at_rest:
            f.step()
        f.step(round(29.0 / DT))
        assert f.g.phase == TO_CONTACT
        f.step(round(1.5 / DT))
        assert f.g.phase == DISCONNECT and f.g.reason == "not steady inside the boom's envelope"
        assert f.g.texts[-1].severity == 4


def test_contact_counts_for_station_keeping_after_settling_with_the_boom_in() -> None:
    f = Flight().at(CONTACT)
    f.f.boom_contact = True
    f.step(round(9.8 / DT))
    assert not f.g.out.measure
    f.step(10)
    assert f.g.out.measure
    f.f.boom_contact = False
    f.step()
    assert not f.g.out.measure


# --- leaving by its own rule -----------------------------------------------------------------------------------------
NEAR = (TO_PRECONTACT, PRECONTACT, TO_CONTACT, CONTACT, DISCONNECT)


@pytest.mark.parametrize("phase", NEAR, ids=[NAMES[p] for p in NEAR])
@pytest.mark.parametrize("what", ["navigation", "link", "relative"])
def test_it_breaks_away_when_what_it_flies_on_stops(what: str, phase: int) -> None:
    f = Flight().at(phase)
    if what == "navigation":
        f.nav.valid, f.nav.reason = False, "settling"
    elif what == "link":
        f.nav.peer_age_s = 1.05
    else:
        f.nav.rel_age_s = 2.05
    f.step()
    assert f.g.phase == BREAKAWAY
    assert {"navigation": "settling", "link": "data link", "relative": "relative sensor"}[what] in f.g.reason
    assert f.g.texts[-1].severity <= 2
    assert not f.g.out.latch


@pytest.mark.parametrize("phase", [TO_CONTACT, CONTACT])
def test_it_breaks_away_after_half_a_second_of_large_station_error(phase: int) -> None:
    f = Flight().at(phase)
    f.offset[:] = 0.0, 3.2, 0.0
    f.step(10)
    assert f.g.phase == phase
    f.step(3)
    assert f.g.phase == BREAKAWAY and "station error 3.2 m" in f.g.reason


def test_a_short_excursion_is_not_an_escape() -> None:
    f = Flight().at(CONTACT)
    for _ in range(5):
        f.offset[:] = 0.0, 0.0, 3.5
        f.step(8)
        f.offset[:] = 0.0
        f.step(2)
    assert f.g.phase == CONTACT


def test_the_reference_waits_for_an_aircraft_that_lags() -> None:
    f = Flight().at(TO_PRECONTACT)
    f.offset[:] = 0.0, 0.0, 4.5
    f.step(2)
    here = f.g.pos
    f.step(200)
    assert f.g.pos == here
    f.offset[:] = 0.0
    f.step(40)
    assert math.dist(f.g.pos, here) > 0.5


@pytest.mark.parametrize("name", ["precontact", "contact", "observation"])
def test_a_station_error_refuses_the_way_on(name: str) -> None:
    """What leads somewhere is refused from far off its reference; leaving and stopping never are."""
    f = Flight().at({"precontact": OBSERVATION, "contact": PRECONTACT, "observation": PRECONTACT}[name])
    phase = f.g.phase
    f.offset[:] = 125.0, 0.0, 0.0
    f.step(2)
    ok, why = f.g.command(ACTION[name])
    assert not ok and "station error 125.0 m, allowed" in why and f.g.phase == phase
    for always in ("hold", "breakaway"):
        assert f.g.command(ACTION[always])[0]
    f = Flight().at(phase)
    f.offset[:] = 0.5, 0.0, 0.0
    f.step()
    f.order(name)


@pytest.mark.parametrize("what", ["navigation", "link", "relative"])
def test_a_way_on_is_refused_without_what_it_would_be_flown_on(what: str) -> None:
    f = Flight().at(OBSERVATION)
    if what == "navigation":
        f.nav.valid, f.nav.reason = False, "settling"
    elif what == "link":
        f.nav.peer_age_s = 1.05
    else:
        f.nav.rel_age_s = 2.05
    f.step()
    ok, why = f.g.command(ACTION["precontact"])
    assert not ok and {"navigation": "settling", "link": "data link", "relative": "relative sensor"}[what] in why


@pytest.mark.parametrize("phase", [TO_CONTACT, CONTACT])
def test_contact_lost_backs_off_by_rule(phase: int) -> None:
    """Half a second without the boom after it was in: to pre-contact, latch open, told. A shorter gap is none."""
    f = Flight().at(phase)
    f.boom, f.f.boom_contact = True, True
    f.step(10)
    f.f.boom_contact = False
    f.step(8)
    f.f.boom_contact = True
    f.step(2)
    assert f.g.phase in (TO_CONTACT, CONTACT)
    f.f.boom_contact = False
    f.step(9)
    assert f.g.phase in (TO_CONTACT, CONTACT)
    f.step(2)
    assert f.g.phase == DISCONNECT and not f.g.out.latch and "boom has let go" in f.g.reason
    assert f.g.texts[-1].severity == 4 and "boom has let go" in f.g.texts[-1].text
    f.until(PRECONTACT)
    f.order("contact")  # and it may come back


def test_contact_never_made_backs_off_after_a_while_but_not_where_there_is_no_signal() -> None:
    f = Flight().at(CONTACT)
    f.boom = True
    f.step(round(29.8 / DT))
    assert f.g.phase == CONTACT
    f.step(10)
    assert f.g.phase == DISCONNECT and "no contact made" in f.g.reason
    g = Flight().at(CONTACT)
    g.step(round(60.0 / DT))
    assert g.g.phase == CONTACT


def test_recapture_leaves_the_boom_from_the_present_position() -> None:
    f = Flight().at(CONTACT)
    f.nav.rel_pos_t = (-37.0, 1.0, 9.0)
    f.g.recapture(f.nav)
    assert f.g.phase == BREAKAWAY and f.g.pos == (-37.0, 1.0, 9.0)


def test_recapture_stops_at_once_what_leads_up_or_ahead() -> None:
    """A reference that slowed down along the way would lead through the tanker's height."""
    f = Flight().at(CONTACT)
    f.nav.rel_pos_t, f.nav.rel_vel_t = (-35.8, -0.3, 5.2), (1.0, -1.5, -2.7)
    f.g.recapture(f.nav)
    f.nav.rel_vel_t = ZERO3
    places = []
    for _ in range(round(20.0 / DT)):
        f.nav.rel_pos_t = f.g.pos  # flown as asked for
        f.step(1)
        places.append(f.g.pos)
    assert max(x for x, _, _ in places) <= -35.8 and min(z for _, _, z in places) >= 5.2
    g = Flight().at(CONTACT)
    g.nav.rel_pos_t, g.nav.rel_vel_t = (-35.8, -0.3, 5.2), (-1.0, 0.0, 2.0)
    g.g.recapture(g.nav)
    assert g.g.vel[0] == -1.0 and g.g.vel[2] == 2.0  # what leads away goes on
