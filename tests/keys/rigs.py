"""Keys that act late in a flight, in rigs that get there at once: guidance on point masses, a rendezvous without the aircraft.

A rig turns a record into the numbers its component gives, one after the other; another value of a field must give others. Those
of a record are flights by themselves: what shows in one is not flown in the others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.condition import Condition, ConditionParams
from flightsw.missions.receiver.boom import Surroundings
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.joinup import JoinUpParams
from flightsw.missions.receiver.refuel import CONTACT, OBSERVATION, TO_CONTACT, RefuelParams
from flightsw.missions.receiver.sequence import Sequence, SequenceParams
from flightsw.missions.tanker.racetrack import RacetrackParams, make_path
from flightsw.sixdof.windcal.filter import WindCalibrator
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.types import UPD_FUEL, NavState, SensorFrame
from hil_scripts.launch.runfolder import resolve
from hil_scripts.studies.rivard.six_dof_flight import fly_twin
from tests.component.test_onboard_guidance import Flight as Refuelling
from tests.keys.integrity_rig import INTEGRITY
from tests.unit.test_joinup import Flight as Joining
from tests.unit.windcal_synth import Errors, fly

Rig = Callable[[Any], Iterator[Any]]


def refuelling(p: RefuelParams) -> Iterator[Any]:
    """A whole refuelling with a small station error, then an error too large, a sensor and a link too old, a breakaway."""
    f = Refuelling(p)
    f.nav.rel_pos_t = (-70.0, 50.0, 3.0)
    f.offset[:] = 0.1, -0.2, 0.1
    f.until(OBSERVATION)
    f.step(600)
    for name in ("precontact", "contact", "disconnect", "observation"):
        if not f.g.command({"precontact": 2, "contact": 3, "disconnect": 4, "observation": 6}[name])[0]:
            yield name
        f.f.boom_contact = name == "contact"
        for _ in range({"precontact": 3600, "contact": 1400}.get(name, 600)):
            f.step()
            yield f.g.out.measure
    yield from [f.path[::20], f.g.phase]
    for spoil in ("far", "far in contact", "rel", "link"):
        g = Refuelling(p).at(CONTACT)
        if spoil.startswith("far"):
            g.offset[:] = 0.0, 3.2 if spoil == "far in contact" else 4.2, 0.0
        for k in range(400):
            g.nav.rel_age_s, g.nav.peer_age_s = (
                (k * 0.05 if spoil == "rel" else 0.0),
                (k * 0.05 if spoil == "link" else 0.0),
            )
            g.step()
            yield g.g.phase
        yield from g.path[-400::10]
    for connected in (True, False):  # a boom that lets go, one that is never in
        g = Refuelling(p).at(CONTACT)
        g.boom, g.f.boom_contact = True, connected
        g.step(20)
        g.f.boom_contact = False
        for _ in range(800):
            g.step()
            yield g.g.phase
    g = Refuelling(p, Surroundings(load_aircraft("kc135r"), load_aircraft("learjet24"))).at(TO_CONTACT)
    for _ in range(1200):
        g.step()
        yield g.g.out.latch
    waiting = Refuelling(p)
    waiting.until(OBSERVATION)
    waiting.order("precontact")
    waiting.offset[:] = 0.0, 0.0, 4.1
    waiting.step(200)
    yield from waiting.path[::10]


def joining(start: dict[str, float], seconds: float, p: JoinUpParams) -> Iterator[Any]:
    """With the tanker turning at first and lost from sight for a while, then seen for `seconds`."""
    f = Joining(p=p, rate_bias=1e-4, heading_error=0.15, **start)  # type: ignore[arg-type]
    f.turn_rate = math.radians(0.9)
    f.fly(6.0)
    f.turn_rate = 0.0
    for lasts, seen in ((30.0, True), (3.4, False), (seconds, True)):
        f.seen = seen
        for _ in range(round(lasts / 0.1)):
            f.step()
            yield (f.track[-1], f.g.ready, f.g.phase)
    f.wind = (f.wind[0] + 20.0, f.wind[1])
    yield from f.fly(20.0)[-100:].tolist()


def outturned(start: dict[str, float], push: float, p: JoinUpParams) -> Iterator[Any]:
    """By a tanker that turns faster than the receiver does itself, `push` [m/s] too fast."""
    f = Joining(p=p, **start)  # type: ignore[arg-type]
    f.fly(10.0)
    f.turn_rate, f.V = math.radians(2.5), f.V + push
    yield from f.fly(40.0)[::5].tolist()
    f.turn_rate = 0.0
    yield from f.fly(90.0)[::5].tolist()


JOINING: tuple[Rig, ...] = (  # from far behind on both sides, from ahead, from near
    partial(joining, {}, 40.0),
    partial(joining, {"x": -900.0, "y": -150.0, "z": 200.0}, 40.0),
    partial(joining, {"x": -40.0, "y": 120.0, "z": 250.0}, 40.0),
    partial(joining, {"x": -150.0, "y": 66.0, "z": 8.0}, 140.0),
    partial(outturned, {"x": -2500.0, "y": -300.0, "z": 250.0}, 0.0),
    partial(outturned, {"x": -150.0, "y": 20.0, "z": 10.0}, 40.0),
)


def sequence(p: SequenceParams) -> Iterator[Any]:
    """Every order as it falls due; `auto` on unless that is what is asked."""
    yield p.auto
    for fuel in (0.0, 900.0):
        s, f = Sequence(replace(p, auto=True)), SensorFrame(boom_contact=True, fuel_kg=fuel)
        for phase in (OBSERVATION, 3, CONTACT, 3):
            yield from [s.step(f, phase, True, 0.5) for _ in range(800)]


def racetrack(p: RacetrackParams) -> Iterator[Any]:
    """Two legs and a turn of a tanker that turns as commanded, a little off its heading."""
    g, f, nav = (
        make_path(replace(p, first_leg_s=p.first_leg_s * 0.05, leg_s=p.leg_s * 0.05)),
        SensorFrame(),
        NavState(valid=True, V=190.0),
    )
    psi = 0.3
    yield g.V
    g.set_speed(p.V_mps + 2.0, 0.0, 1e3)
    for _ in range(4000):
        f.t_us += 50_000
        nav.euler = (psi + 0.01, 0.05, 0.0)
        o = g.step(f, nav, 0.05)
        psi += (o.psi_dot + 1e-4) * 0.05
        yield (o.psi_dot, o.V, o.alt_m, o.phase)


def condition(p: ConditionParams) -> Iterator[Any]:
    """Tanks that run dry, a gauge that jumps and falls silent, a command at its limit."""
    c = Condition(p, 2900.0)
    f = SensorFrame()
    for k in range(1200):
        f.t_us, f.updated = 100_000 * k, UPD_FUEL if k < 900 or k > 1000 else 0
        f.fuel_kg = max(1000.0 - 1.25 * k, 0.0) + (80.0 if k == 300 else 0.0)
        yield c.intake(f)[1]
        c.step(NavState(valid=True), 100 < k < 150, 0.1)
        yield from [c.flags, [t.text for t in c.texts]]
        c.texts = []


def wind_calibration(p: WindCalParams) -> Iterator[Any]:
    """Straight flight behind another aircraft with gusts, a reading that is off and an airspeed that lies for long."""
    if not p.on:
        return
    e = Errors(200)
    e.wind[:] = 2.0 * np.sin(0.7 * np.arange(200))[:, None]
    e.air[60, 0], e.air[120:, 0] = 6.0, 60.0
    for s in fly(WindCalibrator(p, 0.0, True), e, 0.1, 8.0):
        yield (s.nav.wind_n, s.nav.wind_sigma, s.nav.wind_valid)


RIGS: dict[type, tuple[Any, tuple[Rig, ...]]] = {
    RefuelParams: (RefuelParams(), (refuelling,)),
    JoinUpParams: (JoinUpParams(track_deg=23.0, track_point_m=(6500.0, -21400.0)), JOINING),
    SequenceParams: (SequenceParams(fuel_kg=800.0), (sequence,)),
    RacetrackParams: (RacetrackParams(), (racetrack,)),
    ConditionParams: (ConditionParams(), (condition,)),
    WindCalParams: (WindCalParams(on=True), (wind_calibration,)),
    IntegrityParams: (IntegrityParams(on=True), INTEGRITY),
}


def meeting(sets: tuple[str, ...]) -> list[Any]:
    """A whole rendezvous of the kinematic tanker with the flight file's own software; sets: as after --set."""
    m = fly_twin(resolve("rendezvous", 1, list(sets), 420.0))
    return [repr(v) for v in m.values("twin").values()] + [m.track]
