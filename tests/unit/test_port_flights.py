"""A flight whose packets are handed over is the flight by bytes: the same end state to the bit, with faults and orders too."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import pytest

from flightsw.icd.port import DIRECT, WIRE
from hil_scripts.studies.integrity.flight import TEXT
from hil_scripts.studies.integrity.snapshot import HEARD, Flying, said
from sim_plant.failures.script import Event

FAULTS = {
    "refueling": (
        Event(0.0, "bias", "receiver", sensor="rel", value=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        Event(0.0, "stamp", "tanker", sensor="gnss", value=(-0.2,)),
        Event(0.0, "link_loss", "tanker", for_s=0.5),
    ),
    "airdata": (Event(0.0, "intermittent", "receiver", sensor="air", value=(0.5,)),),
    "rendezvous": (Event(0.0, "dropout", "tanker", sensor="tacan"),),
    "windshear": (Event(0.0, "delayed", "twinjet", sensor="imu", samples=5),),
    "gust": (),
}


def state(f: Flying[Any]) -> str:
    """Everything plant and onboard software go on from that a step would show in the next."""
    plant = [m.view.s if m.view.arrays is None else m.view.arrays[0].tolist() for m in f.server.world.members]
    dropped = [repr(c.count) for c in f.server.codecs] + [repr(n.codec.count) for n in f.nodes]
    onboard = [(asdict(n.app.nav), n.app.u.tolist(), n.app.cmd, n.t_us, n.duplicates) for n in f.nodes]  # type: ignore[attr-defined]
    return repr((plant, [m.path.current for m in f.server.world.members], onboard, dropped, f.server.rejected))


@pytest.mark.parametrize("scenario", FAULTS)
def test_packets_handed_over_fly_as_bytes_do(scenario: str) -> None:
    """3 s without a fault and 1 s with; an order to the plant by way of the aircraft is answered alike."""
    flights = [Flying(scenario, 5, (), port) for port in (WIRE, DIRECT)]
    began = state(flights[0])
    for f in flights:
        f.fly_to(3.0)
    assert state(flights[0]) == state(flights[1]) != began
    said_ = []
    for f in flights:
        for e in FAULTS[scenario]:
            f.inject(e)
        # a ground station's order of a failure the plant does not know
        order = f.server.codecs[0].port.as_bytes(f.server.codecs[0].command(420, 99.0, 1.0, 0.0))
        told = []
        for k in range(100):
            sent = f.server.begin_tick()
            replies = [n.step((d,), ground=(order,) if k == 5 else ()) for n, d in zip(f.nodes, sent, strict=True)]
            f.server.end_tick(replies)
            told += [x for n in f.nodes for x in said(n.after())]
        said_.append(repr((told, f.server.notes)))
    assert state(flights[0]) == state(flights[1]) and said_[0] == said_[1]
    assert any(n.last_text for n in flights[0].nodes)


def test_messages_that_nobody_reads_change_no_flight() -> None:
    """Only what is asked for is sent and texts, with the same in them, and the aircraft fly alike."""
    whole, few = (Flying("refueling", 3) for _ in range(2))
    few.hear_only(frozenset(), HEARD)
    length = [0, 0]
    for _ in range(300):
        (replies, told), (same, part) = whole.tick(), few.tick()
        assert repr(replies) == repr(same)  # NaN is NaN
        for a, b in zip(told, part, strict=True):
            length = [length[0] + sum(map(len, a)), length[1] + sum(map(len, b))]
        assert [m for m in said(told[0]) if m[0] == TEXT] == list(said(part[0]))
        assert list(said(told[1])) == list(said(part[1]))
    assert 0 < 4 * length[1] < length[0]
