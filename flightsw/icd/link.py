"""UDP endpoints. A busy port is an error that names it; sending never blocks; receive buffers are large."""

from __future__ import annotations

import errno
import socket

from flightsw.icd.signing import OPEN, TELEMETRY, Security, heard

RCVBUF = 8 << 20  # [byte]
MAX_DATAGRAM = 65535  # [byte]
Address = tuple[str, int]
# one tick's share of what may come in
DRAIN = 400  # [datagram] read from the socket
SIZE = 2048  # [byte] of a datagram; ours and the plant's are below 1500
EACH, TOTAL = 8, 12  # [datagram] of one stranger, of all

# port plan; every program adds the same --port-offset
PLANT_PORT = 4560  # flightsw of sysid s listens for the plant on PLANT_PORT + s - 1
TELEMETRY_PORT = 14600  # flightsw of sysid s sends telemetry from, and hears commands on, TELEMETRY_PORT + s
GROUND_PORT = 14550  # ground recorder
OPERATOR_PORT = 14551  # the user's own ground station
WATCH_PORT = 14552  # the live picture; the recorder forwards what it hears
PLANT_COMMAND_PORT = 14590  # the plant hears commands of the ground (failures to inject)


def plant_port(sysid: int, offset: int = 0) -> int:
    """UDP port on which the flightsw of `sysid` hears the plant."""
    return PLANT_PORT + sysid - 1 + offset


def telemetry_port(sysid: int, offset: int = 0) -> int:
    """UDP port from which the flightsw of `sysid` talks to the ground."""
    return TELEMETRY_PORT + sysid + offset


def plant_command_port(offset: int = 0) -> int:
    """UDP port on which the plant hears commands of the ground."""
    return PLANT_COMMAND_PORT + offset


class LinkError(OSError):
    """An endpoint cannot be opened. The text names the port and its use."""


class UdpLink:
    """One UDP socket bound to `host:port` (port 0: any). `use` says what for, in error messages.

    `dropped` counts datagrams the system would not take, `unread` those that came in too large or too many for one `take`.
    With a key in `security` everything sent is signed, and `take` gives only what is; `ident`: link id of the signatures.
    Raises LinkError if the port is busy or not allowed, SigningError for an address that needs a key.
    """

    def __init__(
        self,
        port: int,
        use: str,
        host: str = "127.0.0.1",
        rcvbuf: int = RCVBUF,
        security: Security = OPEN,
        ident: int = TELEMETRY,
    ) -> None:
        security.admit(host)
        self.signing = security.link(ident)
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.dropped = self.unread = 0
        self._set_buffer(rcvbuf)
        try:
            self.sock.bind((host, port))
        except (OSError, OverflowError) as e:
            self.sock.close()
            busy = isinstance(e, OSError) and e.errno == errno.EADDRINUSE
            why = "is already in use by another program" if busy else f"cannot be opened: {e}"
            raise LinkError(f"UDP port {host}:{port} ({use}) {why}; free it or choose another --port-offset") from None
        self.sock.setblocking(False)
        self.port: int = self.sock.getsockname()[1]
        self.where = f"udp:{host}:{self.port}"

    def fileno(self) -> int:
        """To wait on."""
        return self.sock.fileno()

    def arrived(self) -> bool:
        """Whether something may wait, asked once the socket has become readable."""
        return True

    def _set_buffer(self, size: int) -> None:
        """Ask for a large receive buffer: first beyond the system limit (needs privilege), then within it."""
        force = getattr(socket, "SO_RCVBUFFORCE", 33)
        for option in (force, socket.SO_RCVBUF):
            try:
                self.sock.setsockopt(socket.SOL_SOCKET, option, size)
                return
            except OSError:
                continue

    def send(self, data: bytes, to: Address) -> bool:
        """Send one datagram without waiting; False (and counted) if the system would not take it."""
        if self.signing is not None:
            data = self.signing.sign(data)
        try:
            self.sock.sendto(data, to)
            return True
        except OSError:
            self.dropped += 1
            return False

    def recv(self, timeout_s: float, size: int = MAX_DATAGRAM) -> tuple[bytes, Address] | None:
        """Next datagram (its first `size` bytes) and its sender, or None after `timeout_s` (0: do not wait)."""
        if timeout_s > 0:
            self.sock.settimeout(timeout_s)
            try:
                return self.sock.recvfrom(size)
            except (TimeoutError, ConnectionError):
                return None
            finally:
                self.sock.setblocking(False)
        try:
            return self.sock.recvfrom(size)
        except (BlockingIOError, ConnectionError):
            return None

    def take(self, friend: Address | None = None) -> list[tuple[bytes, Address]]:
        """What waits in the socket, oldest first, as much of it as one tick can deal with: of each sender EACH datagrams, of
        all of them TOTAL, none above SIZE bytes; the rest is dropped and counted in `unread`. `friend` is the peer this socket
        is for: first, and without a limit but that of the whole call. A datagram right after its equal (a tick repeated until
        it is answered) is left out. What is not signed by the key is no datagram; version 1 packets come in version 2 framing.
        """
        ours: list[tuple[bytes, Address]] = []
        others: list[tuple[bytes, Address]] = []
        count: dict[Address, int] = {}
        before, taken = None, 0
        for _ in range(DRAIN):
            got = self.recv(0.0, SIZE + 1)
            if got is None:
                break
            if got == before:
                continue
            before = got
            data, sender = got
            if len(data) > SIZE:
                self.unread += 1
                continue
            if sender != friend and (taken >= TOTAL or count.get(sender, 0) >= EACH):
                self.unread += 1
                continue
            if sender != friend:  # also what is refused takes up its share: judging costs time
                count[sender] = count.get(sender, 0) + 1
                taken += 1
            if self.signing is not None or sender != friend:
                believed = heard(data, self.signing)
                if self.signing is not None and not believed:
                    continue
                got = believed, sender
            (ours if sender == friend else others).append(got)
        return ours + others

    def close(self) -> None:
        """Close the socket."""
        self.sock.close()
