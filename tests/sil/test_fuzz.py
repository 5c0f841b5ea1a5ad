"""A little of `python -m hil_scripts.bench.fuzz`: rubbish at every port of every program, and the flight is the same."""

from __future__ import annotations

from pathlib import Path

from hil_scripts.bench.fuzz import STRANGER, fly, pool

PACKETS = 500  # to each port


def test_what_is_sent_is_of_every_kind_and_from_a_stranger() -> None:
    datagrams = pool(1, 400)
    assert len(datagrams) == 400 and datagrams == pool(1, 400) and datagrams != pool(2, 400)
    assert all(d[0] == 0xFD and d[5] == STRANGER for d in datagrams[3::4])


def test_a_flight_under_fire_is_the_same_flight(tmp_path: Path, port_offset: int) -> None:
    out = fly(tmp_path, "gust", 8.0, PACKETS, port_offset)
    assert out.same_truth and "Traceback" not in out.text, out.text
    assert out.code == 0 and out.completed, out.text
    assert len(out.sent) == 8 and set(out.sent.values()) == {PACKETS}
    # what nobody counts was heard: sound packets from a stranger
    on_screen = out.sent["live"]
    heard = sum(out.sent.values()) - on_screen - sum(out.counted.values())
    assert heard < 0.25 * (sum(out.sent.values()) - on_screen)
    for program in (
        "ground.junk",
        "plant.stray",
        "plant.refused_order",
        "flightsw.alexis.refused_ground",
        "flightsw.alexis.unread",
    ):
        assert any(k.startswith(program) for k in out.counted), (program, out.counted)
    assert max(out.grown.values()) < 30.0, out.grown
