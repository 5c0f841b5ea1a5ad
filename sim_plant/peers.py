"""The onboard computers as the plant reaches them: those on this machine through one UDP socket, each external one by a line of
its own."""

from __future__ import annotations

import select
import socket
import struct
import time
from collections import deque
from collections.abc import Mapping, Sequence

from flightsw.icd.lines import Line
from flightsw.icd.link import MAX_DATAGRAM, Address, LinkError, UdpLink, plant_port
from flightsw.icd.overrun import overrun
from flightsw.icd.signing import OPEN, PLANT, Security
from flightsw.icd.stream_link import StreamLink
from flightsw.priority import Eager

HOST = "127.0.0.1"
STRANGER = -1  # instead of the number of an aircraft
Got = tuple[int, bytes]  # number of the aircraft, datagram


class Peers:
    """Datagrams to and from the aircraft of a run, by their number. `external`: name -> the line of one that is not reached by
    the port plan. `whole`, for lockstep: streams give whole datagrams only, and answers are expected soon. Raises LinkError,
    SigningError."""

    def __init__(
        self,
        names: Sequence[str],
        sysids: Sequence[int],
        port_offset: int,
        external: Mapping[str, Line],
        security: Security = OPEN,
        whole: bool = True,
    ) -> None:
        self._local = UdpLink(0, "plant", security=security, ident=PLANT)
        self._local.sock.setblocking(True)
        self._far: dict[int, UdpLink | StreamLink] = {}
        self._at: list[Address] = [(HOST, plant_port(s, port_offset)) for s in sysids]
        self.where = [f"UDP port {a[1]}" for a in self._at]
        try:
            for i, name in enumerate(names):
                if name in external:
                    self._open(i, f"link to {name}", external[name], security, whole)
        except OSError:
            self.close()
            raise
        self._index = {a: i for i, a in enumerate(self._at) if i not in self._far}
        self._queue: deque[Got] = deque()
        self._poll = select.poll()
        self._by_fd: dict[int, int] = {self._local.fileno(): STRANGER}
        for i, far in self._far.items():
            self._by_fd[far.fileno()] = i
        for fd in self._by_fd:
            self._poll.register(fd, select.POLLIN)
        self._eager = Eager(self._poll, lambda: time.monotonic_ns() // 1000) if whole else None
        self._wait_ms = 0.0
        self.wait(0.05)

    def _open(self, i: int, use: str, line: Line, security: Security, whole: bool) -> None:
        self.where[i] = str(line)
        if line.stream:
            self._far[i] = StreamLink(
                line, use, time.monotonic, listen=False, whole=whole, security=security, ident=PLANT
            )
            return
        try:
            self._at[i] = (socket.gethostbyname(line.host), line.port)
        except OSError as e:
            raise LinkError(f"{use}: {line.host}: no such host: {e}") from None
        self._far[i] = UdpLink(0, use, own_address(line.host), security=security, ident=PLANT)

    def wait(self, seconds: float) -> None:
        """Set how long `receive` waits: in the kernel, one system call per datagram, where all aircraft are on this machine."""
        s = max(seconds, 1e-6)
        self._wait_ms = s * 1e3
        span = struct.pack("ll", int(s), int(s % 1.0 * 1e6) or 1)
        self._local.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, span)

    @property
    def external(self) -> bool:
        """Whether there is one that is not reached by the port plan."""
        return bool(self._far)

    def is_external(self, i: int) -> bool:
        """Whether aircraft i is one of them."""
        return i in self._far

    def send(self, i: int, datagram: bytes) -> None:
        """To aircraft i, without waiting."""
        far = self._far.get(i)
        if far is None:
            self._local.send(datagram, self._at[i])
        else:
            far.send(datagram, self._at[i])

    def receive(self, wait: bool = True) -> Got | None:
        """The next datagram and whose it is (STRANGER: of no aircraft); None: nothing has come within the time of `wait`."""
        if wait and self._eager is not None and not self._queue:
            self._eager.soon()
        if not self._far:
            return self._of_local(0 if wait else socket.MSG_DONTWAIT)
        if not self._queue:
            self._gather(self._wait_ms if wait else 0.0)
        return self._queue.popleft() if self._queue else None

    def _of_local(self, flags: int) -> Got | None:
        try:
            data, addr = self._local.sock.recvfrom(MAX_DATAGRAM, flags)
        except (BlockingIOError, ConnectionError):  # nothing there, or a peer's port is not open yet
            return None
        if self._local.signing is not None:
            data = self._local.signing.check(data)
        return self._index.get(addr, STRANGER), data

    def _gather(self, wait_ms: float) -> None:
        woken = [self._by_fd[fd] for fd, _ in self._poll.poll(int(wait_ms))]  # whole ms: better early than late
        if STRANGER in woken:
            while (got := self._of_local(socket.MSG_DONTWAIT)) is not None:
                self._queue.append(got)
        for i, far in self._far.items():  # also those that have not woken: a line that is gone is to be opened again
            for data, sender in far.take(self._at[i]):
                mine = isinstance(far, StreamLink) or sender == self._at[i]
                self._queue.append((i if mine else STRANGER, data))

    def _all(self) -> list[UdpLink | StreamLink]:
        return [self._local, *self._far.values()]

    @property
    def unsent(self) -> int:
        """Datagrams the system would not take."""
        return sum(link.dropped for link in self._all())

    @property
    def refused(self) -> int:
        """Packets that signing has refused."""
        return sum(link.signing.refused.total for link in self._all() if link.signing is not None)

    @property
    def overrun(self) -> int:
        """Datagrams the kernel dropped on arrival."""
        return sum(overrun(link) for link in self._all())

    def streams(self) -> dict[int, StreamLink]:
        """Those external ones that are met over a stream of bytes."""
        return {i: far for i, far in self._far.items() if isinstance(far, StreamLink)}

    def close(self) -> None:
        """Close everything."""
        for link in self._all():
            link.close()


def own_address(host: str) -> str:
    """The address of this machine that `host` sees. Raises LinkError."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        try:
            s.connect((host, 9))  # sends nothing
        except OSError as e:
            raise LinkError(f"{host}: cannot be reached from here: {e}") from None
        return str(s.getsockname()[0])
