"""Where the onboard computer of an aircraft is met, in words: `udp:HOST:PORT`, `tcp:HOST:PORT`, `serial:DEVICE:BAUD`.

The same words at both ends. UDP and TCP name the address on which the onboard computer listens and to which the plant goes;
each end of a serial line names its own device.
"""

from __future__ import annotations

from dataclasses import dataclass

from flightsw.icd.link import LinkError

UDP, TCP, SERIAL = KINDS = ("udp", "tcp", "serial")
USUAL_BAUD = 921_600  # [bit/s]
BAUDS = (9_600, 4_000_000)  # [bit/s] slowest and fastest that is taken
BITS_PER_BYTE = 10  # 8N1: a start bit, eight, a stop bit
FORM = "allowed: udp:HOST:PORT, tcp:HOST:PORT, serial:DEVICE:BAUD"


@dataclass(frozen=True)
class Line:
    """One end of a link: `host` and `port`, or `device` and `baud` [bit/s] with kind `serial`."""

    kind: str
    host: str = ""
    port: int = 0
    device: str = ""
    baud: int = 0

    def __str__(self) -> str:
        at = f"{self.device}:{self.baud}" if self.kind == SERIAL else f"{self.host}:{self.port}"
        return f"{self.kind}:{at}"

    @property
    def stream(self) -> bool:
        """Whether bytes arrive without the bounds of datagrams."""
        return self.kind != UDP


def parse_line(text: str, usual_port: int) -> Line:
    """The line `text` names; `usual_port` where it names no port. Raises LinkError quoting the text, with what is allowed."""
    kind, _, rest = text.partition(":")
    if kind not in KINDS or not rest:
        raise LinkError(f"line {text!r}: {FORM}")
    at, sep, number = rest.rpartition(":")
    if not sep:
        at, number = rest, ""
    if kind == SERIAL:
        if number and not number.isdigit():  # a device with a colon in its name
            at, number = rest, ""
        baud = int(number or USUAL_BAUD)
        if not at or not BAUDS[0] <= baud <= BAUDS[1]:
            raise LinkError(f"line {text!r}: baud {baud}: allowed: {BAUDS[0]} to {BAUDS[1]}")
        return Line(kind, device=at, baud=baud)
    if number and not number.isdigit():
        raise LinkError(f"line {text!r}: port {number!r}: {FORM}")
    port = int(number or usual_port)
    if not at or not 1 <= port <= 65535:
        raise LinkError(f"line {text!r}: port {port}: allowed: 1 to 65535")
    return Line(kind, at, port)
