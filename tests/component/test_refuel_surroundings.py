"""Refuelling: where the boom reaches and the tanker is. Navigation by hand, no plant."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.boom import Surroundings, crosses, hull
from flightsw.missions.receiver.refuel import (
    CONTACT,
    HOLD,
    OBSERVATION,
    PRECONTACT,
    RefuelGuidance,
    RefuelParams,
)
from flightsw.strict import ConfigError
from sim_plant.kernels import layout as n
from sim_plant.kernels.geometry import relative
from tests.component.test_onboard_guidance import ACTION, Flight

AROUND = Surroundings(load_aircraft("kc135r"), load_aircraft("learjet24"))


def boom_of_the_plant(
    xi: tuple[float, float, float], q: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
) -> tuple[float, float, float]:
    """Elevation, azimuth [deg], extension [m] as the plant's own kernel has them, the tanker level, the receiver's attitude q."""
    tanker, receiver = load_aircraft("kc135r"), load_aircraft("learjet24")
    assert tanker.boom is not None and receiver.receptacle is not None
    a, b, out = np.zeros(20), np.zeros(20), np.zeros(16)
    a[0], b[0:4] = 1.0, q
    b[10:13] = xi
    geo = np.array([*tanker.boom.pivot_m, *receiver.receptacle.position_m, tanker.boom.length_retracted_m])
    relative(a, b, geo, out)
    el, az, ext = out[n.R_EL], out[n.R_AZ], out[n.R_EXT]
    return math.degrees(el), math.degrees(az), float(ext)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.floats(-45.0, -25.0), st.floats(-8.0, 8.0), st.floats(0.0, 20.0))
def test_the_envelope_is_the_plants(x: float, y: float, z: float) -> None:
    el, az, ext = boom_of_the_plant((x, y, z))
    inside = -40.0 <= el <= -20.0 and -15.0 <= az <= 15.0 and 1.83 <= ext <= 5.49
    why = AROUND.out_of_reach((x, y, z))
    assert (why == "") == inside
    if why:
        name, value = why.split()[1], float(why.split()[2])
        assert value == pytest.approx({"elevation": el, "azimuth": az, "extension": ext}[name], abs=0.051)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.floats(-45.0, -25.0), st.floats(-8.0, 8.0), st.floats(0.0, 20.0), *[st.floats(-0.3, 0.3)] * 3)
def test_the_depth_is_the_way_out_of_the_plants_envelope(
    x: float, y: float, z: float, psi: float, theta: float, phi: float
) -> None:
    """The least of the ways to its six faces, by the plant's own angles and extension; negative outside."""
    axes = ((0.0, 0.0, 1.0, psi), (0.0, 1.0, 0.0, theta), (1.0, 0.0, 0.0, phi))
    q = (1.0, 0.0, 0.0, 0.0)
    for i, j, k, angle in axes:
        c, s = math.cos(0.5 * angle), math.sin(0.5 * angle)
        w, a, b, d = q
        i, j, k = i * s, j * s, k * s
        q = (
            w * c - a * i - b * j - d * k, w * i + a * c + b * k - d * j,
            w * j - a * k + b * c + d * i, w * k + a * j - b * i + d * c,
        )  # fmt: skip
    el, az, ext = boom_of_the_plant((x, y, z), q)
    length = ext + 8.53
    faces = (
        math.radians(el + 40.0) * length, math.radians(-20.0 - el) * length, ext - 1.83, 5.49 - ext,
        math.radians(az + 15.0) * length * math.cos(math.radians(el)),
        math.radians(15.0 - az) * length * math.cos(math.radians(el)),
    )  # fmt: skip
    assert AROUND.depth((x, y, z), (psi, theta, phi)) == pytest.approx(min(faces), abs=1e-9)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(*[st.tuples(*[st.floats(-60.0, 60.0)] * 3)] * 2)
def test_a_line_crosses_the_box_where_a_fine_walk_along_it_does(a: tuple, b: tuple) -> None:
    lo, hi = np.array(AROUND.box)
    walk = np.array(a) + np.linspace(0.0, 1.0, 2001)[:, None] * (np.array(b) - np.array(a))
    depth = np.minimum(walk - lo, hi - walk).min(axis=1)  # > 0 inside
    if abs(depth.max()) > 0.1:  # a walk of 0.1 m steps cannot tell a touch
        assert crosses(a, b, AROUND.box) == (depth.max() > 0.0)


def test_the_procedure_is_clear_of_the_tanker_and_its_hull_holds_the_boom() -> None:
    (x0, _, _), (x1, y1, _) = hull(load_aircraft("kc135r"))
    assert x0 == pytest.approx(-21.943) and x1 == pytest.approx(17.0) and y1 == pytest.approx(19.94)
    f = Flight(around=AROUND).at(CONTACT)
    f.order("disconnect")
    f.until(PRECONTACT)
    f.order("observation")
    f.until(OBSERVATION)


@pytest.mark.parametrize(
    ("key", "point", "words"),
    [
        ("contact_m", (-33.0, 0.0, 3.0), r"guid.contact_m = \[-33.0, 0.0, 3.0\]: boom elevation -4.2 deg there"),
        ("contact_m", (-40.0, 0.0, 8.5), "boom extension"),
        ("contact_m", (-34.0, 6.0, 8.5), "boom azimuth"),
        ("contact_m", (-35.6, 0.0, 6.4), "0.1[0-9] m inside the boom's envelope there, needed 0.3"),
        ("contact_m", (-20.0, 0.0, 0.0), "guid.contact_m = .*: in the tanker's way"),
        ("precontact_m", (0.0, 10.0, 0.0), "guid.precontact_m = .*: in the tanker's way"),
        ("breakaway_m", (0.0, 0.0, 0.0), "guid.breakaway_m"),
    ],
)
def test_way_points_in_the_tanker_or_out_of_reach_are_refused_by_name(
    key: str, point: tuple[float, float, float], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        RefuelGuidance(RefuelParams(**{key: point}), AROUND)


def test_a_way_through_the_tanker_and_a_tanker_without_boom_are_refused() -> None:
    f = Flight(around=AROUND).at(OBSERVATION)
    f.order("hold")
    f.g.pos, f.g.seg = (-20.0, 40.0, 0.0), None  # abeam of it
    f.nav.rel_pos_t = f.g.pos
    f.g.p = RefuelParams(behind_m=(-20.0, -40.0, 0.0), low_m=(-20.0, 40.0, 0.0))
    f.step()
    ok, why = f.g.command(ACTION["precontact"])
    assert not ok and "in the tanker's way (x -30 to 25" in why and f.g.phase == HOLD
    f = Flight(around=Surroundings(load_aircraft("learjet24"), load_aircraft("learjet24"))).at(PRECONTACT)
    ok, why = f.g.command(ACTION["contact"])
    assert not ok and "no [boom]" in why
