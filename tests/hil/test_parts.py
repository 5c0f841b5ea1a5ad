"""What the lines are made of, without processes: words, framing, meter, clock offset, budget."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from flightsw.icd.lines import Line, parse_line
from flightsw.icd.link import LinkError
from flightsw.icd.stream import Assembler, Seal
from flightsw.icd.stream_link import StreamLink
from flightsw.icd.timesync import LineStatus, Offset, answer
from flightsw.icd.wire import Sender
from flightsw.strict import ConfigError
from hil_scripts.launch.budget import Budget, Way, budgets
from hil_scripts.launch.runfolder import resolve
from sim_plant.meter import LineMeter
from tests.hil.ptys import PtyLine


@pytest.mark.parametrize(
    "text", ["udp:10.0.0.2:4561", "tcp:board:99", "serial:/dev/ttyUSB0:460800", "serial:COM:3:9600"]
)
def test_a_line_reads_as_it_is_written(text: str) -> None:
    assert str(parse_line(text, 1)) == text


def test_what_a_line_need_not_say() -> None:
    assert parse_line("udp:board", 4561) == Line("udp", "board", 4561)
    assert parse_line("serial:/dev/ttyUSB0", 0).baud == 921_600
    with pytest.raises(LinkError, match="'tcp:board': port 0"):
        parse_line("tcp:board", 0)


def datagrams(n: int) -> list[bytes]:
    send, draw = Sender(2, 1), random.Random(3)
    return [
        b"".join(send.named("TIMESYNC", tc1=draw.getrandbits(60), ts1=i + 1) for _ in range(draw.randrange(1, 6)))
        for i in range(n)
    ]


@pytest.mark.parametrize("piece", [1, 7, 64, 4096])
def test_datagrams_come_out_as_they_went_in(piece: int) -> None:
    sent, seal, read = datagrams(60), Seal(), Assembler(whole=True)
    line = b"".join(seal.close(d) for d in sent)
    out = [d for at in range(0, len(line), piece) for d in read.feed(line[at : at + piece])]
    assert out == sent and read.noise == read.torn == 0


def test_every_byte_of_noise_is_counted() -> None:
    sent, seal, read, draw = datagrams(200), Seal(), Assembler(whole=True), random.Random(5)
    out, junk = [], 0
    for d in sent:
        rubbish = draw.choice((b"", b"\xfd", b"\xfd\xff\x00\x00", draw.randbytes(draw.randrange(30))))
        junk += len(rubbish)
        out += read.feed(rubbish + seal.close(d))
    assert out == sent and read.noise == junk and read.torn == 0


@pytest.mark.parametrize("whole", [True, False])
def test_a_damaged_datagram_is_torn_and_the_next_is_whole(whole: bool) -> None:
    seal, read = Seal(), Assembler(whole)
    first, second, third = (d + d for d in datagrams(3))
    bad = bytearray(seal.close(first))
    bad[20] ^= 4
    out = read.feed(bytes(bad) + seal.close(second))
    assert out[-1] == second and read.torn == 1 and len(out) == (1 if whole else 2)
    assert (
        read.feed(seal.close(third)[:-14] + seal.close(second))[-1][-len(second) :] == second
    )  # its LINE_FRAME was lost


def test_serial_device_goes_and_comes_back(tmp_path: Path) -> None:
    device = tmp_path / "tty"
    with PtyLine() as first:
        device.symlink_to(first.a)
        link = StreamLink(
            Line("serial", device=str(device), baud=115_200), "test", time.monotonic, listen=False, whole=True
        )
        assert link.send(datagrams(1)[0])
    device.unlink()
    end = time.monotonic() + 20.0
    with PtyLine() as second:
        device.symlink_to(second.a)
        other = StreamLink(
            Line("serial", device=second.b, baud=115_200), "test", time.monotonic, listen=False, whole=True
        )
        while link.opened < 2 and time.monotonic() < end:
            link.take()
            time.sleep(0.05)
        link.send(datagrams(1)[0])
        while not other.arrived() and time.monotonic() < end:
            time.sleep(0.01)
        assert [d for d, _ in other.take()] == datagrams(1)
        link.close()
        other.close()


def test_a_device_that_is_not_there_is_named() -> None:
    with pytest.raises(LinkError, match=r"serial device /dev/ttyNOT \(test\): cannot be opened at 9600 baud"):
        StreamLink(Line("serial", device="/dev/ttyNOT", baud=9600), "test", time.monotonic, listen=False, whole=True)


def test_late_lost_and_passed_over_are_told_apart() -> None:
    m = LineMeter()
    for k in range(1, 301):
        t = k * 10_000
        m.sent(t, t * 1e-6)
        if k % 10 == 0:
            continue  # never answered
        late = 20_000 if k % 4 == 0 else 0
        m.replied(t, (t + late) * 1e-6 + 0.004, t + late, 10_000)
        m.close(t)
    m.close(10_000_000)
    m.passed_over = 5
    got = m.accounts("r")
    assert (m.on_time, m.late, m.unanswered) == (210, 60, 30)
    assert got["replies_lost.r"] == 25 and got["ticks_passed_over.r"] == 5 and got["replies_latest_ticks.r"] == 2
    assert got["latency_p50_ms.r"] == pytest.approx(4.0) and got["latency_max_ms.r"] == pytest.approx(24.0)


def test_offset_of_the_clocks_is_filtered() -> None:
    draw, ours, theirs = random.Random(2), Sender(2, 200), Sender(2, 1)
    offset, ahead = Offset(ours), 1234.5
    now = 100.0
    for _ in range(200):
        question = offset.ask(now)
        assert question
        there = now + 0.002 + draw.expovariate(200.0)
        back = there + 0.002 + draw.expovariate(200.0)
        offset.take(answer(question, theirs, round((there + ahead) * 1e9), LineStatus(taken=7)), back)
        now += 0.5
    assert offset.offset_s == pytest.approx(ahead, abs=2.0 * offset.uncertainty_s)
    assert offset.uncertainty_s < 0.004 and offset.status.taken == 7


def test_budget_of_the_refuelling() -> None:
    plan = resolve("refueling", 3, [], 3.0)
    (b,) = budgets(plan, {"receiver": Line("serial", device="x", baud=921_600)}, signed=False)
    out, back = b.ways
    assert 140 < out.mean < 200 and 400 < out.worst < 640 and 90 < back.mean < 130
    assert not b.warning() and b.enough() == 921_600
    with pytest.raises(ConfigError, match=r"serial:x:115200: 115200 baud: the average tick takes 1\d\d % of the line"):
        budgets(plan, {"receiver": Line("serial", device="x", baud=115_200)}, signed=False)
    assert (
        "a tick with every group and its reply take"
        in Budget("r", Line("serial", "", 0, "x", 460_800), 100, b.ways).warning()
    )
    assert Way(100.0, 100).seconds(921.6, 9216) == pytest.approx(1.0)
