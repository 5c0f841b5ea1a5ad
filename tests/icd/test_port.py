"""Packets handed over in one process are those that would have come out of the bytes, whatever is in them."""

from __future__ import annotations

import copy
import math
import struct
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flightsw.aircraft import load_airframe
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.icd.port import DIRECT, WIRE, Hand
from flightsw.icd.texts import answer
from flightsw.icd.wire import BY_NAME, SPECS, Counters, Sender, Spec, split
from flightsw.types import Ack, ActuatorCmd, Gain, NavState, SensorFrame

AC = load_airframe("learjet24")
# among what hypothesis draws itself: infinities, NaN, denormals; and what a wire of 32 bits rounds, holds or refuses
NUMBERS = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True, width=64),
    st.sampled_from(
        [0.0, -0.0, 1e-46, 1e38, 3.4028235e38, 3.5e38, -1e300, math.nan, math.inf, 0.1, 1 / 3, 2**24 + 1.0]
    ),
    st.floats(-1e4, 1e4),
)
SMALL = st.one_of(st.floats(-1e5, 1e5), st.sampled_from([math.nan, math.inf, 0.0, -0.0, 1e-46, 0.005, 0.015]))
STAMP = st.integers(0, 2**40)


def same(a: object, b: object) -> bool:
    """Equal to the bit: NaN to NaN, and not 0 to -0."""
    return repr(a) == repr(b)


def number(spec: Spec) -> st.SearchStrategy[tuple[object, ...]]:
    """Values of a message, by the letters of its layout; integers beyond their type too."""
    out: list[st.SearchStrategy[object]] = []
    for count, letter in _letters(spec.packer.format):
        if letter == "s":
            out.append(st.binary(max_size=count + 3))
        else:
            each = NUMBERS if letter in "fd" else st.integers(0, 2 ** (8 * struct.calcsize(letter) - 1) - 1)
            out += [each] * count
    return st.tuples(*out)


def _letters(layout: str) -> list[tuple[int, str]]:
    out, digits = [], ""
    for c in layout.lstrip("<"):
        if c.isdigit():
            digits += c
        else:
            out.append((int(digits or 1), c))
            digits = ""
    return out


@given(st.sampled_from(sorted(SPECS)), st.data())
@settings(max_examples=400, deadline=None)
def test_every_message_is_handed_over_as_it_comes_out_of_the_wire(ident: int, data: st.DataObject) -> None:
    """Floats rounded, texts padded and cut, trailing zeros; what one form cannot pack the other cannot either."""
    spec = SPECS[ident]
    values = data.draw(number(spec))
    try:
        packet = Sender(7, 9).pack(spec, *values)
    except (struct.error, OverflowError) as e:
        with pytest.raises(type(e)):
            Hand(7, 9).pack(spec, *values)
        return
    (there,), (here,) = split(packet, SPECS, Counters()), Hand(7, 9).pack(spec, *values)
    assert here[0] is there[0] and here[2:4] == there[2:4] and same(here[1], there[1])


@st.composite
def frames(draw: st.DrawFn) -> SensorFrame:
    """Every group of a frame, with any number in it."""

    def n(k: int, of: st.SearchStrategy[float] = SMALL) -> tuple[float, ...]:
        return tuple(draw(of) for _ in range(k))

    k = draw(st.integers(0, 4))
    whole = st.floats(-1e5, 1e5)  # the wire's integers have no NaN
    t = draw(STAMP)
    past = draw(st.integers(0, 100_000))
    return SensorFrame(
        t_us=t, updated=draw(st.integers(0, 2**14 - 1)), gyro_b=n(3), acc_b=n(3), mag_b=n(3), pressure_pa=draw(SMALL),
        baro_alt_m=draw(SMALL), gnss_t_us=max(t - past, 0), gnss_pos_n=n(3, whole), gnss_vel_n=n(3, whole),
        air_t_us=max(t - past, 0), air_mask=draw(st.integers(0, 255)), air_V=n(k), air_alpha=n(k), air_beta=n(k),
        att_t_us=max(t - past, 0), att_q_nb=n(4, st.one_of(st.floats(-1.0, 1.0), SMALL)), rel_t_us=max(t - past, 0),
        rel_valid=draw(st.booleans()), rel_pos_t=n(3), rel_vel_t=n(3), fuel_kg=draw(whole), fuel_flow_kgps=draw(SMALL),
        boom_t_us=max(t - past, 0), boom_contact=draw(st.booleans()), boom_inside=draw(st.booleans()),
        boom_elevation=draw(SMALL), boom_azimuth=draw(SMALL), boom_extension_m=draw(SMALL), tacan_t_us=max(t - past, 0),
        tacan_range_m=draw(st.none() | SMALL), tacan_bearing=draw(st.none() | SMALL),
        tacan_link=draw(st.none() | st.tuples(SMALL, SMALL)), radar_t_us=max(t - past, 0), radar_y_m=draw(SMALL),
        bearing_t_us=max(t - past, 0), bearing=draw(SMALL), position_t_us=max(t - past, 0),
        position=draw(st.tuples(SMALL, SMALL)), radar_sigma_m=draw(SMALL), radalt_t_us=max(t - past, 0), radalt_m=draw(whole),
    )  # fmt: skip


@given(st.tuples(frames(), frames()))
@settings(max_examples=300, deadline=None)
def test_a_frame_arrives_alike(two: tuple[SensorFrame, SensorFrame]) -> None:
    """Two frames in a row by either form: the same frames and the same counts of what was dropped."""
    ends = [
        (PlantCodec(AC, 2, port=p), FlightCodec(AC, 2, peer_sysid=1, port=p), SensorFrame()) for p in (WIRE, DIRECT)
    ]
    for f in two:
        for plant, flight, out in ends:
            flight.decode(plant.sensors(f, [plant.command(42, 1.0, math.nan)]), out)
        (_, a, there), (_, b, here) = ends
        assert same(asdict(there), asdict(here)) and a.count == b.count


@given(
    st.lists(NUMBERS, min_size=5, max_size=5),
    STAMP,
    st.booleans(),
    st.booleans(),
    st.lists(SMALL, min_size=30, max_size=30),
)
@settings(max_examples=200, deadline=None)
def test_a_reply_arrives_alike(u: list[float], t: int, latch: bool, armed: bool, x: list[float]) -> None:
    """Commands, the state for the other aircraft, a fix, an answer and its reason, by way of the radio into the other's frame."""
    cmd = ActuatorCmd(t, *u[:4], latch, armed, u[4])
    at = tuple(v if math.isfinite(v) else 0.0 for v in x[:3])
    nav = NavState(
        t, True, "", w_b=(x[3], x[4], x[5]), q_nb=(x[6], x[7], x[8], x[9]), pos_n=at, vel_n=(x[10], x[11], x[12]),
        acc_n=(x[13], x[14], x[15]), wind_n=(x[16], x[17], x[18]), pos_sigma=(x[19], x[20], x[21]),
    )  # fmt: skip
    fix = SensorFrame(gnss_t_us=t, gnss_pos_n=at, gnss_vel_n=(x[22], x[23], x[24]))
    gain = Gain(t, 0.05, (x[25], x[26], x[27]))
    found = []
    for port in (WIRE, DIRECT):
        plant, tanker, receiver = (
            PlantCodec(AC, 1, port=port),
            *(FlightCodec(AC, k, peer_sysid=1, port=port) for k in (1, 2)),
        )
        try:
            said = [
                tanker.actuators(cmd),
                tanker.peer(nav, 5),
                tanker.fix(fix, gain),
                tanker.answer(Ack(7, 2, 3, 4, "no " * 30)),
            ]
        except (struct.error, OverflowError) as e:
            found.append(type(e).__name__)
            continue
        r, frame_ = plant.decode_reply(tanker.send.join(said)), SensorFrame(t_us=t)
        for part in (*r.link, *r.fixes):
            receiver.apply(receiver.parse(part)[0], frame_, t)
        found.append((r.cmd, r.acks, asdict(frame_), plant.count, receiver.count))
    assert same(*found)


@given(
    st.lists(st.floats(-10.0, 10.0), min_size=5, max_size=5),
    st.lists(STAMP, min_size=1, max_size=4),
    st.booleans(),
    st.booleans(),
)
@settings(max_examples=100, deadline=None)
def test_a_command_that_is_kept_is_sent_as_one_packed_anew(
    u: list[float], stamps: list[int], latch: bool, armed: bool
) -> None:
    """In either form, sequence numbers included."""
    for port in (WIRE, DIRECT):
        kept, anew = FlightCodec(AC, 1, port=port), FlightCodec(AC, 1, port=port)
        cmd = ActuatorCmd(7, *u[:4], latch, armed, u[4])
        sent = kept.actuators(cmd)
        assert same(sent, anew.actuators(cmd))
        for t in stamps:
            cmd.t_us = t
            sent = kept.actuators_again(sent, t)
            assert same(sent, anew.actuators(cmd))


def test_bytes_and_packets_are_made_into_each_other() -> None:
    """An order handed on to the plant, and the plant's answer with its reason."""
    direct = Hand(2, 1).named("COMMAND_LONG", target_system=2, command=420, param1=0.1)
    back = DIRECT.of_bytes(DIRECT.as_bytes(direct))
    assert [p[:4] for p in back] == [p[:4] for p in direct]
    sent = answer(Sender(2, 190), Ack(420, 3, 2, 1, "not here, " * 12))
    handed = DIRECT.of_bytes(sent)
    again = split(DIRECT.as_bytes(handed), SPECS, Counters())
    assert len(handed) == 4 and [p[:4] for p in again] == [p[:4] for p in split(sent, SPECS, Counters())]
    count = Counters()
    only = {BY_NAME["COMMAND_ACK"].id: BY_NAME["COMMAND_ACK"]}
    assert [p[0].name for p in DIRECT.packets(handed, only, count)] == ["COMMAND_ACK"] and count.unknown == 3
    assert DIRECT.part(handed, handed[0]) == handed[:1]


def test_a_copy_of_a_packet_is_of_the_same_message() -> None:
    packets = Hand(1, 1).pack(BY_NAME["SYSTEM_TIME"], 5, 6)
    assert copy.deepcopy(packets)[0][0] is packets[0][0] and np.isscalar(packets[0][1][0])
