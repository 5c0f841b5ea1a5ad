"""Message signing, both ways against the stock library's own signer and verifier, and every reason for a refusal."""

from __future__ import annotations

import socket
import time
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from flightsw.icd import signing, wire
from flightsw.icd.link import UdpLink
from flightsw.icd.signing import PER_S, SINCE_S, WINDOW, Security, Signing, SigningError, read_key, security, write_key

KEY, OTHER = bytes(range(32)), bytes(32)
T0 = 400_000 * 86_400 * 10  # a time


def stock(key: bytes = KEY, link: int = 5, at: int = T0) -> Any:
    """The stock library's end of a link that signs."""
    mav = common.MAVLink(None, 255, 190)
    mav.robust_parsing = True
    s = mav.signing
    s.secret_key, s.link_id, s.timestamp, s.sign_outgoing = key, link, at, True
    s.allow_unsigned_callback = None
    return mav


def ours(key: bytes = KEY, at: int = T0, link: int = signing.TELEMETRY) -> Signing:
    return Signing(key, link, lambda: at / PER_S + SINCE_S)


def test_the_stock_library_believes_what_is_signed_here() -> None:
    send, mine = wire.Sender(2, 1), ours()
    plain = send.named("HEARTBEAT", type=1) + send.named("ATTITUDE", roll=0.5) + send.named("STATUSTEXT", text="x" * 50)
    got = stock().parse_buffer(mine.sign(plain))
    assert [m.get_type() for m in got] == ["HEARTBEAT", "ATTITUDE", "STATUSTEXT"]
    assert all(m.get_signed() for m in got) and got[1].roll == 0.5
    assert stock(OTHER).parse_buffer(ours().sign(plain))[0].get_type() == "BAD_DATA"


@given(st.floats(allow_nan=False, width=32), st.integers(0, 7))
def test_what_the_stock_library_signs_is_believed_here(value: float, n: int) -> None:
    mav, mine = stock(), ours()
    for _ in range(n):
        packet = bytes(common.MAVLink_param_set_message(2, 1, b"A_NAME", value, 9).pack(mav))
        clear = mine.check(packet)
        [p] = wire.split(clear, wire.SPECS, wire.Counters())
        assert p[0].name == "PARAM_SET" and p[0].to_dict(p[1])["param_value"] == value and p[2:4] == (255, 190)
        assert len(clear) == len(packet) - 13 and not mine.refused.total


def test_signed_here_is_the_same_packet_here() -> None:
    send, there, here = wire.Sender(2, 1), ours(), ours()
    plain = send.named("HEARTBEAT", type=1) + send.named("ATTITUDE", roll=0.5)
    assert here.check(there.sign(plain)) == plain
    assert there.sign(there.sign(plain)) != plain and here.refused.total == 0


def test_every_reason_for_a_refusal_is_counted_apart() -> None:
    plain = wire.Sender(2, 1).named("HEARTBEAT", type=1)
    mine = ours()
    good = ours().sign(plain)
    changed = bytearray(ours().sign(wire.Sender(2, 1).named("ATTITUDE", roll=0.5)))
    changed[-1] ^= 1
    assert mine.check(plain) == b"" and mine.check(b"rubbish") == b""
    assert mine.check(ours(OTHER).sign(plain)) == b"" and mine.check(bytes(changed)) == b""
    assert mine.check(good) == plain and mine.check(good) == b""  # the second time it is a replay
    assert mine.check(ours(at=T0 - WINDOW - 100, link=signing.STATION).sign(plain)) == b""
    assert mine.check(ours(at=T0 - WINDOW + 100, link=signing.ORDERS).sign(plain)) == plain
    assert mine.refused.counts() == (2, 2, 1, 1)


def test_streams_are_apart_and_their_number_is_bounded() -> None:
    mine = ours()
    for sysid in range(1, 251):
        for link in range(4):
            assert mine.check(ours(link=link).sign(wire.Sender(sysid, 1).named("HEARTBEAT", type=1)))
    assert len(mine._streams) <= signing.STREAMS_MAX and mine.refused.total == 0


def test_time_goes_on_by_what_is_heard() -> None:
    """A receiver whose clock is behind: a stream that was current is stale once a later one has been heard."""
    mine, plain = ours(at=T0), wire.Sender(2, 1).named("HEARTBEAT", type=1)
    assert mine.check(ours(at=T0 + 3 * WINDOW, link=3).sign(plain))
    assert not mine.check(ours(at=T0, link=2).sign(plain)) and mine.refused.stale == 1


@given(st.binary(max_size=400), st.integers(0, 60), st.binary(max_size=20))
def test_nothing_that_arrives_raises_or_gets_in(junk: bytes, cut: int, more: bytes) -> None:
    packet = ours().sign(wire.Sender(2, 1).named("ATTITUDE", roll=0.5))
    mine = ours()
    for datagram in (junk, junk + packet[:cut], packet[:cut] + more + packet[cut + 1 :]):
        got = mine.check(datagram)
        assert got == b"" or datagram.endswith(packet) or packet in datagram


def test_a_key_file_is_made_for_its_owner_and_read_by_nobody_else(tmp_path: Path) -> None:
    path = tmp_path / "key"
    write_key(path)
    assert len(read_key(path)) == 32 and path.stat().st_mode & 0o777 == 0o600
    with pytest.raises(FileExistsError):
        write_key(path)
    path.chmod(0o640)
    with pytest.raises(SigningError, match="mode 640: others may read it; allowed: 600"):
        read_key(path)
    path.chmod(0o600)
    for text in ("", "12", "g" * 64, "0" * 63, "0" * 66, "\xff" * 64):
        path.write_text(text, encoding="latin-1")
        with pytest.raises(SigningError, match="expected 64 hexadecimal digits"):
            read_key(path)
    with pytest.raises(SigningError, match="cannot be read: No such file"):
        read_key(tmp_path / "none")
    with pytest.raises(SigningError, match="exclude each other"):
        security(path, True, float)


EVERYBODY = "0.0.0.0"  # noqa: S104


def test_an_address_others_reach_needs_a_key_or_a_word() -> None:
    for host in (EVERYBODY, "192.168.1.4", "::", "example.org"):
        with pytest.raises(SigningError, match=r"others can reach it; allowed: 127\.0\.0\.1, or a key"):
            Security().admit(host)
        Security(KEY).admit(host)
        Security(unsigned=True).admit(host)
    for host in ("127.0.0.1", "127.0.0.5", "::1", "localhost"):
        Security().admit(host)
    with pytest.raises(SigningError, match=r"0\.0\.0\.0"):
        UdpLink(0, "a test", EVERYBODY)
    link = UdpLink(0, "a test", EVERYBODY, security=Security(unsigned=True))
    link.close()


def test_a_socket_signs_and_lets_in_only_what_is_signed() -> None:
    link = UdpLink(0, "a test", security=Security(KEY, time.time), ident=signing.TELEMETRY)
    plain = wire.Sender(2, 1).named("HEARTBEAT", type=1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind(("127.0.0.1", 0))
        s.settimeout(5.0)
        link.send(plain, s.getsockname())
        back = Signing(KEY, 9, time.time).check(s.recv(2000))
        for d in (plain, Signing(OTHER, 9, time.time).sign(plain), Signing(KEY, 9, time.time).sign(plain)):
            s.sendto(d, ("127.0.0.1", link.port))
        got: list[bytes] = []
        while len(got) < 1 or link.signing is None or link.signing.refused.total < 2:
            got += [d for d, _ in link.take()]
    assert back == plain and got == [plain] and link.signing.refused.counts() == (1, 1, 0, 0)
    link.close()
