"""STATUSTEXT in chunks, and the reasons of refusals."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from flightsw.icd import wire
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.icd.texts import CHUNK, LONGEST, OPEN_MAX, Joiner, answer, text
from flightsw.types import Ack, ActuatorCmd

from .test_codec import LEARJET

WORDS = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=LONGEST + 40)


def rows(data: bytes) -> list[dict]:
    return [p[0].to_dict(p[1]) for p in wire.split(data, wire.SPECS, wire.Counters())]


def join(data: bytes) -> list[str]:
    joiner = Joiner()
    got = [joiner.take(1, 1, r["text"], r["id"], r["chunk_seq"]) for r in rows(data) if "text" in r]
    return [g for g in got if g is not None]


@given(WORDS)
def test_a_text_of_any_length_comes_out_whole(words: str) -> None:
    send = wire.Sender(1, 1)
    data = text(send, 4, words)
    assert join(data) == [words if len(words) <= CHUNK else words[: LONGEST - 1]]
    if len(words) <= CHUNK:
        [row] = rows(data)
        assert row["id"] == 0  # as before: complete in one
    else:
        assert {r["id"] for r in rows(data)} == {1} and [r["chunk_seq"] for r in rows(data)] == list(
            range(len(rows(data)))
        )


@pytest.mark.parametrize("n", [51, 100, 101, 250])
def test_stock_decoder_reads_the_chunks(n: int) -> None:
    """The last chunk ends with a zero: mavlink.io, STATUSTEXT."""
    words = ("station error " * 30)[:n]
    got = common.MAVLink(None, 1, 1).parse_buffer(text(wire.Sender(1, 1), 4, words))
    assert "".join(m.text for m in got) == words and len({m.id for m in got}) == 1 and got[0].id
    assert [m.chunk_seq for m in got] == list(range(len(got))) and len(got[-1].text) < CHUNK


def test_a_lost_chunk_leaves_a_mark_and_open_ones_are_bounded() -> None:
    joiner = Joiner()
    assert joiner.take(1, 1, "x" * 50, 7, 0) is None
    assert joiner.take(1, 1, "end", 7, 2) == "x" * 50 + " ... end"
    for k in range(100):
        joiner.take(1, 1, "y" * 50, k + 1, 0)
    assert len(joiner._open) == OPEN_MAX


@given(WORDS.filter(len), st.integers(0, 65535), st.integers(0, 4))
def test_an_answer_names_the_text_of_its_reason(why: str, command: int, result: int) -> None:
    send = wire.Sender(1, 1)
    *texts, ack = rows(answer(send, Ack(command, result, 255, 190, why)))
    assert {r["id"] for r in texts} == {ack["result_param2"]} != {0}
    assert (ack["command"], ack["result"], ack["target_system"]) == (command, result, 255)
    assert rows(answer(send, Ack(command, 0, 255, 190)))[0]["result_param2"] == 0


def test_ids_go_round_and_are_never_zero() -> None:
    send = wire.Sender(1, 1)
    send.ident = 65534
    assert [send.new_ident() for _ in range(3)] == [65535, 1, 2]


def test_the_plant_reads_the_reasons_of_a_reply() -> None:
    flight, plant = FlightCodec(LEARJET, 2), PlantCodec(LEARJET, 2)
    acks = [Ack(31010, 1, 255, 190, "too far " * 20), Ack(178, 3, 255, 190, "not here"), Ack(31010, 0, 255, 190)]
    reply = plant.decode_reply(flight.actuators(ActuatorCmd()) + b"".join(map(flight.answer, acks)))
    assert reply.acks == acks and reply.cmd is not None and reply.link == []
