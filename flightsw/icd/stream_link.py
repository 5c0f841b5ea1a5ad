"""A link over a byte stream to one peer, with the manners of UdpLink: sending never blocks, `take` gives datagrams.

A line that goes away (cable, peer, adapter) is opened again by whoever uses it, every RETRY_S; how often it was open is counted.
"""

from __future__ import annotations

import contextlib
import errno
import os
import selectors
import socket
from collections import deque
from collections.abc import Callable
from typing import Any

from flightsw.icd.lines import SERIAL, Line
from flightsw.icd.link import DRAIN, SIZE, Address, LinkError
from flightsw.icd.signing import OPEN, PLANT, Security, heard
from flightsw.icd.stream import Assembler, Seal

RETRY_S = 0.25  # [s] between two tries to open
CHUNK = 65536  # [byte] read at once
READS = 16  # at most in one call
PENDING_MAX = 8192  # [byte] that wait to be written: what is older than 90 ms at 921600 helps nobody
EMPTY_MAX = 3  # times a tty says it has bytes and has none: it has hung up


class StreamLink:
    """One stream: serial device, TCP port that is listened on (`listen`) or called.

    `now` gives seconds for the tries. `whole` as in Assembler. Counts: `dropped` datagrams the line would not take, `unread`
    those too large, `noise` bytes, `torn` datagrams, `opened` times. Raises LinkError if device or port cannot be had at the
    start, SigningError for an address that needs a key.
    """

    def __init__(
        self,
        line: Line,
        use: str,
        now: Callable[[], float],
        *,
        listen: bool,
        whole: bool,
        security: Security = OPEN,
        ident: int = PLANT,
    ) -> None:
        if line.kind != SERIAL:
            security.admit(line.host)
        self.line, self.where = line, str(line)
        self.signing = security.link(ident)
        self.dropped = self.unread = self.opened = 0
        self._use, self._now, self._listens = use, now, listen and line.kind != SERIAL
        self._peer: Address = (self.where, 0)
        self._assembler, self._seal = Assembler(whole), Seal()
        self._queue: deque[bytes] = deque()
        self._pending = bytearray()
        self._selector = selectors.DefaultSelector()
        self._server: socket.socket | None = None
        self._open: Any = None  # socket or serial port
        self._connecting = False
        self._empty = 0
        self._next_try = 0.0
        try:
            if self._listens:
                self._listen()
            elif line.kind == SERIAL:
                self._open_serial()
        except LinkError:
            self._selector.close()
            raise

    # --- as UdpLink -----------------------------------------------------------------------------------------------

    def fileno(self) -> int:
        """To wait on: readable when there is something to do."""
        return self._selector.fileno()

    @property
    def noise(self) -> int:
        """Bytes that belonged to no sound packet."""
        return self._assembler.noise

    @property
    def torn(self) -> int:
        """Datagrams of which something was missing."""
        return self._assembler.torn

    def arrived(self) -> bool:
        """Whether a datagram waits."""
        self._tend()
        return bool(self._queue)

    def send(self, data: bytes, to: Address | None = None) -> bool:
        """Send one datagram without waiting; False (and counted) if there is no line or it is behind by PENDING_MAX bytes."""
        self._tend()
        if self._open is None or self._connecting or len(self._pending) > PENDING_MAX:
            self.dropped += 1
            return False
        if self.signing is not None:
            data = self.signing.sign(data)
        self._pending += self._seal.close(data)
        self._flush()
        return True

    def take(self, friend: Address | None = None) -> list[tuple[bytes, Address]]:
        """Datagrams that have arrived, oldest first, each with the one peer there is. A repeat of the one before is left out."""
        self._tend()
        out: list[tuple[bytes, Address]] = []
        before = b""
        while self._queue and len(out) < DRAIN:
            data = self._queue.popleft()
            if data == before:
                continue
            before = data
            if len(data) > SIZE:
                self.unread += 1
                continue
            if believed := heard(data, self.signing):
                out.append((believed, self._peer))
        return out

    def close(self) -> None:
        """Write what waits as far as the line takes it, and close everything."""
        self._flush()
        self._lose()
        if self._server is not None:
            self._selector.unregister(self._server)
            self._server.close()
        self._selector.close()

    # --- the line -------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        self._server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._server.bind((self.line.host, self.line.port))
        except OSError as e:
            self._server.close()
            why = "is already in use by another program" if e.errno == errno.EADDRINUSE else f"cannot be opened: {e}"
            raise LinkError(f"TCP port {self.line.host}:{self.line.port} ({self._use}) {why}") from None
        self._server.listen(1)
        self._server.setblocking(False)
        self._selector.register(self._server, selectors.EVENT_READ)

    def _open_serial(self) -> None:
        import serial

        device, baud = self.line.device, self.line.baud
        try:
            port = serial.Serial(device, baud, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError) as e:  # SerialException is an OSError
            raise LinkError(f"serial device {device} ({self._use}): cannot be opened at {baud} baud: {e}") from None
        # a USB adapter holds bytes back for 16 ms otherwise
        with contextlib.suppress(OSError, ValueError, AttributeError):
            port.set_low_latency_mode(True)
        self._have(port)

    def _call(self) -> None:
        s = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        s.setblocking(False)
        if s.connect_ex((self.line.host, self.line.port)) not in (0, errno.EINPROGRESS):
            s.close()
            return
        self._connecting = True
        self._have(s)

    def _have(self, line: Any) -> None:
        """This is the line now."""
        self._lose()
        self._open, self._empty = line, 0
        if isinstance(line, socket.socket):
            line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            line.setblocking(False)
        self.opened += not self._connecting
        self._selector.register(line, selectors.EVENT_READ | (selectors.EVENT_WRITE if self._connecting else 0))

    def _lose(self) -> None:
        """There is no line any more; what was under way is gone."""
        if self._open is not None:
            self._selector.unregister(self._open)
            self._open.close()
            self._open = None
        self._pending.clear()
        self._assembler.reset()
        self._next_try = self._now() + RETRY_S

    def _tend(self) -> None:
        """Everything that can be done without waiting: open, accept, read, write."""
        if self._open is None and not self._listens and self._now() >= self._next_try:
            self._next_try = self._now() + RETRY_S
            if self.line.kind == SERIAL:
                with contextlib.suppress(LinkError):
                    self._open_serial()
            else:
                self._call()
        for key, events in self._selector.select(0):
            if key.fileobj is self._server:
                assert self._server is not None
                with contextlib.suppress(OSError):
                    self._have(self._server.accept()[0])  # a peer that was restarted takes the place of what it was
            elif key.fileobj is self._open:
                if self._connecting and not self._connected():
                    continue
                if events & selectors.EVENT_READ:
                    self._read()
        self._flush()

    def _connected(self) -> bool:
        """A call was answered; False: it was not, and is made again later."""
        self._connecting = False
        if self._open.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._lose()
            return False
        self.opened += 1
        self._selector.modify(self._open, selectors.EVENT_READ)
        return True

    def _read(self) -> None:
        got = False
        for _ in range(READS):
            try:
                data = os.read(self._open.fileno(), CHUNK)
            except BlockingIOError:
                break
            except OSError:  # the device is gone, the peer has reset
                self._lose()
                return
            if not data:
                self._empty += not got
                if self.line.kind != SERIAL or self._empty >= EMPTY_MAX:
                    self._lose()
                return
            got, self._empty = True, 0
            self._queue.extend(self._assembler.feed(data))

    def _flush(self) -> None:
        """Write what the line takes now; the rest when it is writable again."""
        if self._open is None or self._connecting:
            return
        before = bool(self._pending)
        try:
            while self._pending:
                n = os.write(self._open.fileno(), self._pending)
                del self._pending[:n]
        except BlockingIOError:
            pass
        except OSError:
            self._lose()
            return
        if before:
            wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if self._pending else 0)
            if self._selector.get_key(self._open).events != wanted:
                self._selector.modify(self._open, wanted)
