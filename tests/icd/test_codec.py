"""Port types through the wire and back: values, units, and what happens to bad input."""

from __future__ import annotations

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_aircraft
from flightsw.health import HealthMonitor, HealthParams
from flightsw.icd import wire
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.types import (
    HF_AIR,
    NO_GAIN,
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_BOOM,
    UPD_FIX,
    UPD_FUEL,
    UPD_GNSS,
    UPD_IMU,
    UPD_MAG,
    UPD_PEER,
    UPD_REL,
    Ack,
    ActuatorCmd,
    Gain,
    NavState,
    SensorFrame,
)

from .generated import mav

ALL = UPD_IMU | UPD_BARO | UPD_MAG | UPD_GNSS | UPD_AIR | UPD_ATT | UPD_REL | UPD_FUEL | UPD_BOOM
LEARJET = load_aircraft("learjet24")
TANKER = load_aircraft("kc135r")


def frame(t_us: int = 50_000, updated: int = ALL) -> SensorFrame:
    return SensorFrame(
        t_us=t_us,
        updated=updated,
        gyro_b=(0.01, -0.02, 0.03),
        acc_b=(0.5, -0.1, -9.81),
        mag_b=(0.2, 0.01, 0.45),
        pressure_pa=41_060.0,
        baro_alt_m=7010.0,
        gnss_t_us=t_us - 10_000,
        gnss_pos_n=(12_345.6, -6_543.2, -7010.12),
        gnss_vel_n=(190.12, -8.05, 0.33),
        air_t_us=t_us,
        air_mask=0b101,
        air_V=(195.0, 194.0, 196.0),
        air_alpha=(0.05, 0.06, 0.04),
        air_beta=(0.0, 0.01, -0.01),
        att_t_us=t_us,
        att_q_nb=(math.cos(0.3), 0.0, math.sin(0.3), 0.0),
        rel_t_us=t_us - 20_000,
        rel_valid=True,
        rel_pos_t=(-35.5, 0.1, 8.5),
        rel_vel_t=(0.01, 0.02, -0.03),
        fuel_kg=1789.5,
        fuel_flow_kgps=30.0,
        boom_t_us=t_us,
        boom_contact=True,
        boom_inside=True,
        boom_elevation=-0.5,
        boom_azimuth=0.1,
        boom_extension_m=4.2,
    )


def pair() -> tuple[PlantCodec, FlightCodec]:
    return PlantCodec(LEARJET, 2), FlightCodec(LEARJET, 2, peer_sysid=1)


def packets(datagram: bytes) -> list[str]:
    return [p[0].name for p in wire.split(datagram, wire.SPECS, wire.Counters())]


def test_every_sensor_group_survives_the_wire() -> None:
    plant, flight = pair()
    sent, got = frame(), SensorFrame()
    flight.decode(plant.sensors(sent, ()), got)
    assert got.updated == ALL
    assert flight.count == wire.Counters()
    for f in dataclasses.fields(SensorFrame):
        a, b = getattr(sent, f.name), getattr(got, f.name)
        if f.name in ("peer", "fix", "commands", "updated") or f.name.startswith(
            ("tacan", "radar")
        ):  # tests of their own
            continue
        tol = {"gnss_pos_n": 6e-3, "gnss_vel_n": 5.1e-3}.get(f.name, 2e-7)
        if f.name == "fuel_t_us":
            assert b == sent.t_us
        elif isinstance(a, tuple):
            assert b == pytest.approx(a, abs=tol, rel=2e-7), f.name
        else:
            assert b == pytest.approx(a, abs=tol, rel=2e-7), f.name


def test_hil_sensor_comes_last_and_always() -> None:
    plant, _ = pair()
    extra = [wire.Sender(255, 1).named("COMMAND_LONG", target_system=2, command=31010, param1=2.0)]
    assert packets(plant.sensors(frame(), extra))[-2:] == ["COMMAND_LONG", "HIL_SENSOR"]
    assert packets(plant.sensors(SensorFrame(t_us=10_000))) == ["HIL_SENSOR"]


@pytest.mark.parametrize("bit", [UPD_IMU, UPD_BARO, UPD_MAG, UPD_GNSS, UPD_AIR, UPD_ATT, UPD_REL, UPD_FUEL, UPD_BOOM])
def test_only_updated_groups_travel_and_others_keep_their_value(bit: int) -> None:
    plant, flight = pair()
    got = SensorFrame()
    flight.decode(plant.sensors(frame(50_000)), got)
    kept = dataclasses.replace(got)
    flight.decode(plant.sensors(frame(100_000, bit)), got)
    assert got.updated == bit and got.t_us == 100_000
    assert got.gyro_b == kept.gyro_b and got.rel_pos_t == kept.rel_pos_t


@pytest.mark.parametrize(
    ("bit", "change"),
    [
        (UPD_IMU, {"gyro_b": (math.nan, 0.0, 0.0)}),
        (UPD_IMU, {"acc_b": (0.0, math.inf, 0.0)}),
        (UPD_MAG, {"mag_b": (0.0, 0.0, -math.inf)}),
        (UPD_BARO, {"pressure_pa": math.nan}),
        (UPD_ATT, {"att_q_nb": (math.nan, 0.0, 0.0, 0.0)}),
        (UPD_ATT, {"att_q_nb": (0.0, 0.0, 0.0, 0.0)}),
        (UPD_REL, {"rel_pos_t": (math.nan, 0.0, 0.0)}),
        (UPD_BOOM, {"boom_extension_m": math.inf}),
        (UPD_FUEL, {"fuel_kg": math.nan}),
    ],
)
def test_non_finite_group_is_dropped_counted_and_leaves_the_rest(bit: int, change: dict[str, object]) -> None:
    plant, flight = pair()
    bad = dataclasses.replace(frame(), **change)  # type: ignore[arg-type]
    if bit == UPD_FUEL:  # the plant's share of capacity needs a number: make the packet by hand
        bad = dataclasses.replace(frame(), updated=ALL & ~UPD_FUEL)
        extra = [wire.Sender(2, 190).named("FUEL_STATUS", remaining_fuel=math.nan, fuel_type=1)]
    else:
        extra = []
    got = SensorFrame()
    flight.decode(plant.sensors(bad, extra), got)
    assert got.updated == ALL & ~bit
    assert flight.count.non_finite == 1 and flight.count.bad == 1


def test_non_finite_reading_is_lost_alone() -> None:
    plant, flight = pair()
    got = SensorFrame()
    bad = dataclasses.replace(frame(), air_mask=0b111, air_alpha=(0.05, math.nan, 0.04))
    flight.decode(plant.sensors(bad), got)
    assert got.air_mask == 0b111 and got.updated & UPD_AIR
    assert got.air_alpha == pytest.approx((0.05, math.nan, 0.04), nan_ok=True) and flight.count.non_finite == 1
    monitor = HealthMonitor(HealthParams(), HF_AIR)
    got, _ = monitor.step(got)
    assert got.updated & UPD_AIR and got.air_bad == 1 << 7  # alpha of probe 1, nothing else


def test_stamps_that_do_not_advance_are_dropped_per_group() -> None:
    plant, flight = pair()
    got = SensorFrame()
    flight.decode(plant.sensors(frame(50_000)), got)
    late = dataclasses.replace(
        frame(60_000), gnss_t_us=30_000, air_t_us=50_000, rel_t_us=0, att_t_us=50_000, boom_t_us=1
    )
    flight.decode(plant.sensors(late), got)
    assert got.updated == UPD_IMU | UPD_BARO | UPD_MAG | UPD_FUEL
    assert flight.count.out_of_order == 5 and flight.count.bad == 0
    assert got.gnss_t_us == 40_000


def test_too_many_probes_and_invalid_rel_nav() -> None:
    plant, flight = pair()
    five = dataclasses.replace(frame(), air_V=(1.0,) * 5)
    with pytest.raises(ValueError, match="5 air data probes"):
        plant.sensors(five)
    got = SensorFrame()
    flight.decode(plant.sensors(dataclasses.replace(frame(), rel_valid=False, rel_pos_t=(math.nan,) * 3)), got)
    assert got.updated & UPD_REL and not got.rel_valid and got.rel_pos_t == (0.0, 0.0, 0.0)
    assert flight.count.bad == 0


def test_gnss_without_fix_is_no_sample() -> None:
    _, flight = pair()
    got = SensorFrame()
    flight.decode(wire.Sender(2, 190).named("HIL_GPS", time_usec=1000, fix_type=1), got)
    assert not got.updated


# --- replies --------------------------------------------------------------------------------------------------------


def test_actuator_reply_round_trip_and_echo() -> None:
    plant, flight = pair()
    cmd = ActuatorCmd(1_230_000, 0.1, -0.2, 0.05, 0.61, True, True)
    reply = plant.decode_reply(flight.actuators(cmd))
    assert reply.cmd is not None
    got = dataclasses.astuple(reply.cmd)
    assert got[0] == 1_230_000 and got[5:] == (True, True, 0.0)
    assert got[1:5] == pytest.approx((0.1, -0.2, 0.05, 0.61), rel=1e-6)


def test_controls_are_deflection_over_largest_travel() -> None:
    _, flight = pair()
    top = math.radians(max(abs(x) for x in LEARJET.controls.elevator_deg))
    [p] = wire.split(flight.actuators(ActuatorCmd(elevator=top)), wire.SPECS, wire.Counters())
    controls = p[0].to_dict(p[1])["controls"]
    assert controls[1] == pytest.approx(1.0) and controls[0] == 0.0


@pytest.mark.parametrize("field", ["aileron", "elevator", "rudder", "throttle"])
def test_non_finite_command_never_reaches_the_plant(field: str) -> None:
    plant, flight = pair()
    reply = plant.decode_reply(flight.actuators(dataclasses.replace(ActuatorCmd(), **{field: math.nan})))
    assert reply.cmd is None and plant.count.non_finite == 1


def test_reply_with_data_link_and_ack() -> None:
    plant = PlantCodec(TANKER, 1)
    flight = FlightCodec(TANKER, 1)
    link = flight.peer(NavState(t_us=40_000, valid=True))
    reply = plant.decode_reply(flight.actuators(ActuatorCmd(50_000)) + link + flight.answer(Ack(178, 0, 255, 190)))
    assert b"".join(reply.link) == link and packets(link) == ["FOLLOW_TARGET", "WIND_COV"]
    assert reply.acks == [Ack(178, 0, 255, 190)]


@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_rubbish_never_raises_on_either_side(data: bytes) -> None:
    plant, flight = pair()
    plant.decode_reply(b"\xfd" + data)
    flight.decode(b"\xfd" + data, SensorFrame())


# --- data link ------------------------------------------------------------------------------------------------------

NAV = NavState(
    t_us=40_000,
    valid=True,
    q_nb=(math.cos(0.2), math.sin(0.2), 0.0, 0.0),
    w_b=(0.01, 0.02, 0.03),
    pos_n=(5000.0, -300.0, -7010.0),
    vel_n=(195.0, 1.0, -0.5),
    acc_n=(0.1, 0.2, 0.3),
    wind_n=(-8.0, 3.0, 0.4),
    wind_sigma=(0.2, 0.3, 0.1),
)


def test_a_fix_reaches_the_other_aircraft_as_it_came() -> None:
    """Decoded by the stock generator's own module, then by the other aircraft: below a millimetre and a millimetre per second."""
    plant, flight = pair()
    tanker = FlightCodec(TANKER, 1)
    tanker.offset_us = 7_000_000  # its plant was restarted: the time is the plant's all the same
    f = SensorFrame(
        gnss_t_us=7_040_000, gnss_pos_n=(12_345.678, -6543.219, -7010.123), gnss_vel_n=(190.123, -8.051, 0.337)
    )
    fix = tanker.fix(f, Gain(7_050_000, 0.1, (0.5, -0.25, 1.5)))
    [m] = mav.MAVLink(None).parse_buffer(fix)
    assert (m.get_type(), m.time_usec, m.get_srcSystem()) == ("RAW_FIX", 40_000, 1)
    assert m.vel == pytest.approx(f.gnss_vel_n, rel=1e-6)
    assert all(math.isnan(s) for s in (*m.pos_sigma, *m.vel_sigma))
    reply = plant.decode_reply(tanker.actuators(ActuatorCmd(50_000)) + tanker.peer(NAV) + fix)
    assert reply.fixes == [fix] and packets(b"".join(reply.link)) == ["FOLLOW_TARGET", "WIND_COV"]
    got = SensorFrame()
    flight.decode(plant.sensors(SensorFrame(t_us=60_000), reply.fixes), got)
    assert got.updated == UPD_FIX and got.fix.t_us == 40_000
    assert got.fix.pos_n == pytest.approx(f.gnss_pos_n, abs=1e-6) and got.fix.vel_n == pytest.approx(
        f.gnss_vel_n, abs=1e-5
    )
    assert got.fix.pos_sigma == got.fix.vel_sigma == (0.0, 0.0, 0.0)  # HIL_GPS states none
    assert (got.fix.gain.t_us, got.fix.gain.vel_n) == (50_000, (0.5, -0.25, 1.5))
    assert got.fix.gain.span_s == pytest.approx(0.1)
    stated = tanker.send.named("RAW_FIX", time_usec=50_000, lat=35.0, lon=-97.0, pos_sigma=(1.5, math.nan, 3.0))
    flight.decode(plant.sensors(SensorFrame(t_us=70_000), [stated]), got)
    assert got.fix.pos_sigma == (1.5, 0.0, 3.0) and got.fix.gain == NO_GAIN


@pytest.mark.parametrize(
    "bad",
    [{"gain_s": math.nan}, {"gain_s": 0.0}, {"gain_s": 1.1}, {"gain_usec": 2_000_000}, {"gain": (math.inf, 0.0, 0.0)}],
)
def test_a_gain_that_cannot_be_is_none_and_the_fix_is_taken(bad: dict[str, object]) -> None:
    plant, flight = pair()
    got = SensorFrame()
    sound = {
        "time_usec": 50_000,
        "lat": 35.0,
        "lon": -97.0,
        "gain_usec": 50_000,
        "gain_s": 0.1,
        "gain": (1.0, 0.0, 0.0),
    }
    flight.decode(plant.sensors(SensorFrame(t_us=60_000), [wire.Sender(1, 1).named("RAW_FIX", **sound | bad)]), got)
    assert got.updated == UPD_FIX and got.fix.gain == NO_GAIN
    assert flight.count.non_finite == (0 if bad == {"gain_s": 0.0} else 1)  # span 0 says that there is none


@pytest.mark.parametrize(
    "bad", [{"lat": math.nan}, {"lat": 90.1}, {"lon": 1e300}, {"alt": math.inf}, {"vel": (0.0, math.nan, 0.0)}]
)
def test_a_fix_that_is_nowhere_is_counted_and_dropped(bad: dict[str, object]) -> None:
    plant, flight = pair()
    got = SensorFrame()
    flight.decode(
        plant.sensors(SensorFrame(t_us=60_000), [wire.Sender(1, 1).named("RAW_FIX", time_usec=50_000, **bad)]), got
    )
    assert got.updated == 0 and got.fix.t_us == 0 and flight.count.non_finite == 1


def test_peer_state_through_the_radio() -> None:
    plant, flight = pair()
    tanker = FlightCodec(TANKER, 1)
    got = SensorFrame()
    flight.decode(plant.sensors(SensorFrame(t_us=60_000), [tanker.peer(NAV)]), got)
    p = got.peer
    assert got.updated == UPD_PEER and p.t_us == 40_000 and p.wind_valid
    assert p.pos_n == pytest.approx(NAV.pos_n, abs=6e-3)
    for name in ("vel_n", "acc_n", "q_nb", "w_b", "wind_n"):
        assert getattr(p, name) == pytest.approx(getattr(NAV, name), rel=1e-6)


def test_peer_must_be_newer_valid_and_the_right_aircraft() -> None:
    plant, flight = pair()
    tanker, other = FlightCodec(TANKER, 1), FlightCodec(TANKER, 3)
    got = SensorFrame()

    def hear(packet: bytes, t_us: int) -> int:
        flight.decode(plant.sensors(SensorFrame(t_us=t_us), [packet]), got)
        return got.updated & UPD_PEER

    assert hear(tanker.peer(NAV), 60_000)
    assert not hear(tanker.peer(NAV), 70_000) and flight.count.out_of_order == 1
    assert not hear(tanker.peer(dataclasses.replace(NAV, t_us=50_000, valid=False)), 80_000)
    assert not hear(other.peer(dataclasses.replace(NAV, t_us=60_000)), 90_000) and flight.count.unknown == 2
    assert not hear(tanker.peer(dataclasses.replace(NAV, t_us=90_000, vel_n=(math.nan, 0.0, 0.0))), 100_000)
    assert flight.count.non_finite == 1 and got.peer.t_us == 40_000


def test_peer_wind_belongs_to_the_state_it_came_with() -> None:
    plant, flight = pair()
    tanker = FlightCodec(TANKER, 1)
    got = SensorFrame()
    state, _ = wire.frames(tanker.peer(NAV))
    flight.decode(plant.sensors(SensorFrame(t_us=60_000), [state]), got)
    assert got.updated & UPD_PEER and not got.peer.wind_valid


def test_commands_for_this_aircraft_only() -> None:
    plant, flight = pair()
    got = SensorFrame()
    other = PlantCodec(TANKER, 1).command(31010, 3)
    flight.decode(plant.sensors(SensorFrame(t_us=10_000), [other, plant.command(31010, 3.0)]), got)
    [c] = got.commands
    assert (c.command, c.params[0], c.src_system, len(c.params)) == (31010, 3.0, 255, 7)


def test_truth_is_unknown_on_board() -> None:
    plant, flight = pair()
    z3 = (0.0, 0.0, 0.0)
    airspeed, rest = (190.0, 0.0, 0.05), (0.0, 0.0, 0.0, 1.0, 1.0, *z3, False, True)
    packet = plant.truth(0, (*z3, *z3, 1.0, *z3, *z3, *z3, *z3, *z3, *airspeed, *rest))
    got = SensorFrame()
    flight.decode(packet, got)
    assert got == SensorFrame() and flight.count.unknown == 1
    [p] = wire.split(packet, wire.SPECS, wire.Counters())
    assert p[0].to_dict(p[1])["V"] == 190.0
