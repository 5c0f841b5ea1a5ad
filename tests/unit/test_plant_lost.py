"""When an aircraft is lost: against closed forms and a minimiser, in flight by what it is made to do, and not before."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from flightsw.aircraft import load_aircraft, load_airframe
from flightsw.types import ActuatorCmd
from sim_plant.kernels import layout as n
from sim_plant.kernels import segments
from sim_plant.kernels.atmosphere import isa
from sim_plant.kernels.rot import quat_dcm, quat_from_euler
from sim_plant.lost import HOLD_S, AircraftLostError, Collision, Watch, bars_of
from sim_plant.scenario import load_scenario
from sim_plant.world import World

CALM: dict[str, Any] = {"wind.prevailing": "constant", "wind.dryden.sigma_mps": 0.0, "event": []}
WELL = World(load_scenario("refueling", CALM), 1)
point = st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3).map(np.array)


# --- one aircraft --------------------------------------------------------------------------------------------------------


def flying(name: str = "kc135r", height: float = 7010.0, V: float = 195.0) -> Any:
    """An aircraft in steady level flight, as the judge sees it."""
    s, o = [0.0] * n.NS, [0.0] * n.NO
    s[0], s[n.S_P + 2], o[2], o[n.O_V] = 1.0, -height, -n.G0, V
    ac = load_airframe(name)
    cfg = SimpleNamespace(name=name, start=SimpleNamespace(upset=None))
    return SimpleNamespace(view=SimpleNamespace(s=s, o=o), ac=ac, cfg=cfg, air=isa, bounds=np.zeros(n.NB), well=False)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(-math.pi, math.pi), st.floats(-1.5, 1.5), st.floats(-4.0, 4.0), st.floats(60.0, 320.0), st.floats(1e3, 12e3),
    st.sampled_from([0.0, math.nan, math.inf]),
)  # fmt: skip
def test_an_aircraft_found_well_at_a_glance_is_well(
    bank: float, pitch: float, rate: float, V: float, height: float, fuel: float
) -> None:
    """The compiled glance spares the closer look only where that would say nothing and note nothing."""
    m = WELL.members[0]
    m.s[0:4] = quat_from_euler(0.3, pitch, bank)
    m.s[n.S_W + 1], m.s[n.S_P + 2], m.s[n.S_RATE] = rate, -height, fuel
    m.s[n.S_V : n.S_V + 3] = m.wind[:3] + V * np.array([math.cos(0.3), math.sin(0.3), 0.0])
    m.observe()
    if m.well:
        m.well, watch = False, Watch(m, 0.01)
        assert watch.step() == "" and watch._upset == {}


@pytest.mark.parametrize("name", ["kc135r", "learjet24", "twinjet", "alexis"])
def test_load_factor_at_the_edge(name: str) -> None:
    v = flying(name, 300.0, {"alexis": 20.0, "twinjet": 75.0}.get(name, 150.0))
    lo, hi = v.ac.structure.load_g
    assert lo <= -1.5 and hi >= 3.75  # no type certificate allows less
    for load, broken in ((lo + 1e-6, False), (lo - 1e-6, True), (hi - 1e-6, False), (hi + 1e-6, True), (1.0, False)):
        v.view.o[2] = -load * n.G0
        assert ("broke up: load factor" in Watch(v, 0.01).step()) == broken, load


def test_speed_at_the_edge_at_both_ends_of_the_height_range() -> None:
    """At sea level the equivalent airspeed decides, it being the true one; high up the Mach number (US Standard 1976: 299.5
    m/s at 10 km)."""
    low, high = flying(height=1e-6), flying(height=10_000.0)
    for v, edge, word in ((low, 225.0, "equivalent airspeed"), (high, 0.97 * 299.53, "Mach")):
        v.view.o[n.O_V] = 0.999 * edge
        assert Watch(v, 0.01).step() == ""
        v.view.o[n.O_V] = 1.001 * edge
        assert word in Watch(v, 0.01).step()


@pytest.mark.parametrize(
    ("set_to", "bound", "word"),
    [
        (lambda v, x: v.view.o.__setitem__(n.O_EULER + 2, x), math.radians(90.0), "bank"),
        (lambda v, x: v.view.o.__setitem__(n.O_EULER + 1, x), math.radians(60.0), "pitch"),
        (lambda v, x: v.view.o.__setitem__(n.O_ALPHA, x), math.radians(28.0), "incidence"),
        (lambda v, x: v.view.s.__setitem__(n.S_W + 1, x), math.radians(180.0), "rate"),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_out_of_control_only_when_it_lasts(
    set_to: Callable[[Any, float], None], bound: float, word: str, sign: float
) -> None:
    v, dt = flying(), 0.01
    watch = Watch(v, dt)
    hold = round(HOLD_S / dt)
    for wobble in range(3):  # short of the time, again and again
        set_to(v, sign * (bound + 0.01))
        assert all(watch.step() == "" for _ in range(hold - 1)), wobble
        set_to(v, sign * (bound - 0.01))
        assert all(watch.step() == "" for _ in range(hold + 1))
    set_to(v, sign * (bound + 0.01))
    said = [watch.step() for _ in range(hold + 2)]
    assert said[hold - 2] == "" and f"out of control: {word}" in said[-1]


def test_rolling_on_and_on_is_no_recovery() -> None:
    """Upright half of the time, never for long."""
    v, dt = flying(), 0.01
    watch, t = Watch(v, dt), 0.0
    while not (said := watch.step()):
        t += dt
        v.view.o[n.O_EULER + 2] = math.remainder(math.radians(90.0) * t, 2.0 * math.pi)  # 90 deg/s
        assert t < 8.0
    assert "out of control: bank" in said


def test_ground_and_rubbish() -> None:
    v = flying(height=0.0)
    assert Watch(v, 0.01).step() == "hit the ground"
    for at in (0, n.S_V, n.S_P, n.S_FUEL):
        v = flying()
        v.view.s[at] = math.nan
        assert "not finite" in Watch(v, 0.01).step()


def distance(p: Any, q: Any, u: Any, v: Any) -> float:
    """Of the segments p..q and u..v."""
    return float(segments.distance(np.concatenate((p, q)), np.concatenate((u, v))))


# --- two bodies ----------------------------------------------------------------------------------------------------------


@settings(max_examples=200, deadline=None)
@given(point, point, point, point)
@example(
    np.array([0.0, 6.1e-5, 0.0]), np.array([6.1e-5, 1.0, 20.0]), np.array([0.0, 1.0, 20.0]), np.array([1e-9, 0.0, 0.0])
)  # antiparallel but for 6e-5 of 20 m
def test_distance_of_segments_against_a_minimiser(p: Any, q: Any, u: Any, v: Any) -> None:
    """Least squares within bounds of |p + s d - u - t e|: an independent solver of the same problem, of finitely many steps (the
    trust-region one can search a line without end where the segments are parallel)."""
    best = lsq_linear(np.stack([q - p, u - v], axis=1), u - p, bounds=(0.0, 1.0), method="bvls", tol=1e-14, max_iter=50)
    found = distance(p, q, u, v)
    assert found == pytest.approx(math.sqrt(2.0 * best.cost), abs=1e-5)
    assert found == pytest.approx(distance(u, v, q, p), abs=1e-9)


def test_distances_on_paper() -> None:
    x, y, z = np.eye(3)
    assert distance(-x, x, y * 2 - z, y * 2 + z) == pytest.approx(2.0)  # crossing at right angles
    assert distance(0 * x, x, 3 * x, 5 * x) == pytest.approx(2.0)  # in line
    assert distance(-x, x, -x + y, x + y) == pytest.approx(1.0)  # parallel
    assert distance(x, x, 4 * x + 3 * y + x, 4 * x + 4 * y + x) == pytest.approx(5.0)  # a point
    assert distance(-x, x, -y, y) == 0.0


def pair(xi: tuple[float, float, float], bank_deg: float = 0.0) -> str:
    """What the judge says of the receiver with its cg at xi [m], tanker body axes, both heading north-east."""
    made = []
    for name, phi in (("kc135r", 0.0), ("learjet24", math.radians(bank_deg))):
        v = flying(name)
        v.ac = load_aircraft(name)
        h = math.radians(22.5)
        c, s, cp, sp = math.cos(h), math.sin(h), math.cos(phi / 2), math.sin(phi / 2)
        v.view.s[0:4] = c * cp, c * sp, s * sp, s * cp
        made.append(v)
    made[1].view.rel = [*xi] + [0.0] * (n.NR - 3)
    return Collision(cast(Any, made[0]), cast(Any, made[1])).step()


@pytest.mark.parametrize(
    ("xi", "touches"),
    [
        ((-35.5, 0.0, 8.5), False),  # contact: the boom is no body
        ((-59.0, 56.0, 0.0), False),
        ((-27.0, 0.0, -0.5), True),  # nose in the tail cone
        ((-29.5, 0.0, -1.0), False),  # and 1 m behind it
        ((0.0, 0.0, 2.3), True),  # fuselage under fuselage: 1.7 + 0.75 m of radii
        ((0.0, 0.0, 9.0), False),
        ((-19.0, 0.0, -8.0), True),  # in the fin
        ((-9.0, 24.0, -1.2), True),  # wing tip against wing tip
        ((-9.0, 26.5, -1.2), False),
        ((0.0, 0.0, 0.0), True),
    ],
)
def test_where_the_two_touch(xi: tuple[float, float, float], touches: bool) -> None:
    assert pair(xi) == ("touched kc135r" if touches else "")


def test_bank_turns_the_bars() -> None:
    """A wing 5 m long below the tanker: level it passes 1.6 m under the fuselage, on its side it does not."""
    assert pair((0.0, 0.0, 4.6)) == "" and pair((0.0, 0.0, 4.6), 80.0) == "touched kc135r"


def test_bars_off_the_plane_of_symmetry_come_twice() -> None:
    rows = load_aircraft("kc135r").structure.bars
    assert len(bars_of(rows)) == len(rows) + 2
    assert {round(float(p[1]), 3) for p in bars_of(rows)[:, :3]} == {0.0, 1.5, -1.5, 0.6, -0.6}


# --- in flight -----------------------------------------------------------------------------------------------------------


def flown(w: World, command: Callable[[World], list[ActuatorCmd | None]], seconds: float) -> str:
    """How a flight under `command` ends: the error's text, "" if it does not."""
    try:
        for _ in range(round(seconds * w.rate_hz)):
            w.sense()
            w.step(command(w))
        w.sense()
    except AircraftLostError as e:
        return str(e)
    return ""


def held(w: World, **change: float) -> list[ActuatorCmd | None]:
    """Trim of both; the receiver's changed."""
    cmd = w.trim_cmd(1)
    return [w.trim_cmd(0), replace(cmd, **{k: getattr(cmd, k) + x for k, x in change.items()})]


def test_trimmed_flight_goes_on() -> None:
    w = World(load_scenario("refueling", CALM), 1)
    assert flown(w, lambda w: held(w), 5.0) == ""


@pytest.mark.parametrize(
    ("change", "seconds", "words"),
    [
        ({"elevator": -0.2}, 3.0, "receiver broke up: load factor"),
        ({"elevator": 0.2}, 3.0, "receiver broke up: load factor -"),
        ({"aileron": 0.1}, 12.0, "receiver is out of control: "),
    ],
)
def test_what_is_asked_too_much_of_it(change: dict[str, float], seconds: float, words: str) -> None:
    w = World(load_scenario("refueling", CALM), 1)
    assert words in flown(w, lambda w: held(w, **change), seconds)


def test_a_receiver_flown_into_the_tanker() -> None:
    """From 6 m below the contact position, climbing at 4 m/s in the tanker's line."""
    w = World(load_scenario("refueling", CALM | {"aircraft.receiver.start.xi_m": [-15.0, 0.0, 12.0]}), 1)

    def climb(w: World) -> list[ActuatorCmd | None]:
        a, b = w.members
        b.s[0:4], b.s[n.S_W : n.S_W + 3] = a.s[0:4], 0.0
        up = np.array(quat_dcm(*a.s[0:4])).reshape(3, 3) @ np.array([0.0, 0.0, -4.0])
        b.s[n.S_V : n.S_V + 3] = a.s[n.S_V : n.S_V + 3] + up
        return held(w)

    said = flown(w, climb, 6.0)
    assert said.startswith("receiver touched tanker at t = ")
    xi = w.members[1].view.rel[:3]
    assert 1.0 < xi[2] < 5.0  # before the centres met
