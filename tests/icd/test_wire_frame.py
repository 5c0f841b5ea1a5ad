"""The local frame on the wire: latitude, longitude and height, and back."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.icd import geo
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.types import (
    UPD_GNSS,
    NavState,
    SensorFrame,
)
from tests.icd.test_codec import LEARJET, TANKER


@given(st.floats(-2e5, 2e5), st.floats(-2e5, 2e5), st.floats(-15_000, 100), st.floats(-80, 80))
@settings(max_examples=200, deadline=None)
def test_geodetic_map_is_exactly_invertible(n: float, e: float, d: float, lat: float) -> None:
    origin = geo.Origin(lat, 10.0, 100.0)
    back = geo.to_local(*geo.to_geodetic((n, e, d), origin), origin)
    assert back == pytest.approx((n, e, d), abs=1e-7)
    m = geo.WireMap(origin)
    a, b, alt = m.encode((n, e, d))
    assert m.decode(a, b, alt) == pytest.approx((n, e, d), abs=6e-3)


@given(
    st.sampled_from([-180.0, -179.99, -179.0, 0.0, 179.0, 179.99, 180.0]),
    st.floats(-3e5, 3e5),
    st.floats(-3e5, 3e5),
    st.floats(-80, 80),
)
@settings(max_examples=200, deadline=None)
def test_longitudes_are_wrapped_on_the_wire_and_read_across_the_date_line(
    lon0: float, n: float, e: float, lat: float
) -> None:
    m = geo.WireMap(geo.Origin(lat, lon0, 0.0))
    a, b, alt = m.encode((n, e, -7010.0))
    assert -1_800_000_000 <= b < 1_800_000_000
    assert m.decode(a, b, alt) == pytest.approx((n, e, -7010.0), abs=6e-3)
    for turns in (-3_600_000_000, 3_600_000_000):  # whoever does not wrap
        assert m.decode(a, b + turns, alt) == pytest.approx((n, e, -7010.0), abs=6e-3)
    _, lon, _ = geo.to_geodetic((n, e, 0.0), geo.Origin(lat, lon0))
    assert -180.0 <= lon < 180.0 and geo.to_local(lat, lon, 0.0, geo.Origin(lat, lon0))[1] == pytest.approx(e, abs=1e-6)


def test_five_kilometres_east_of_the_date_line() -> None:
    """180.03 deg on the wire is what no ground station shows where the aircraft is."""
    m = geo.WireMap(geo.Origin(0.0, 179.985, 0.0))
    assert m.encode((0.0, 5009.4, 0.0))[1] == pytest.approx(-1_799_700_000, abs=20)  # 111319.5 m per degree


@pytest.mark.parametrize("east", [-5000.0, 0.0, 5000.0])
def test_sensors_and_data_link_across_the_date_line(east: float) -> None:
    """What an aircraft flies on is the same wherever the origin lies."""
    origin = geo.Origin(10.0, 179.999, 0.0)
    plant, flight = PlantCodec(LEARJET, 2, origin), FlightCodec(LEARJET, 2, origin)
    other = FlightCodec(TANKER, 1, origin).peer(NavState(t_us=0, valid=True, pos_n=(100.0, east, -7010.0)))
    got = SensorFrame()
    flight.decode(plant.sensors(SensorFrame(updated=UPD_GNSS, gnss_pos_n=(0.0, east, -7010.0)), [other]), got)
    assert got.gnss_pos_n == pytest.approx((0.0, east, -7010.0), abs=0.01)
    assert got.peer.pos_n == pytest.approx((100.0, east, -7010.0), abs=0.01)


def test_scales_against_published_degree_lengths() -> None:
    # length of a degree on WGS-84 (NIMA TR8350.2 radii): equator 110574 m and 111320 m, 45 deg 111132 m and 78847 m
    assert geo.scales(geo.Origin(0.0, 0.0)) == pytest.approx((110_574.3, 111_319.5), abs=0.5)
    assert geo.scales(geo.Origin(45.0, 0.0)) == pytest.approx((111_132.0, 78_847.0), abs=1.0)


def test_altitude_is_minus_down_above_the_datum() -> None:
    assert geo.to_geodetic((0.0, 0.0, -7010.0), geo.Origin(35.0, -97.0, 12.0)) == (35.0, -97.0, 7022.0)
