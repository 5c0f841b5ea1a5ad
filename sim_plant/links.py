"""The plant's end of the links to onboard computers and to the ground: sockets, start, reports, end."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from flightsw.icd.lines import Line
from flightsw.icd.link import UdpLink, plant_command_port
from flightsw.icd.overrun import overrun
from flightsw.icd.signing import OPEN, ORDERS, Security
from sim_plant.books import Books
from sim_plant.peers import STRANGER, Peers
from sim_plant.server import PlantServer
from sim_plant.silence import Silence

REPEAT_S = 0.2  # [s, wall] a tick is repeated this often until answered: a datagram may get lost in a flood
STATUS_S = 0.5  # [s, wall] between status reports
NOTES_MAX = 20  # lines for the operator in one report
NOTHING, RUBBISH, ANSWER = 0, 1, 2
Status = Callable[[int, int, dict[str, str]], None]  # simulated time [us], tick, lines to external aircraft in words


class StoppedError(RuntimeError):
    """The run was asked to end; the plant is between two ticks."""


def _never() -> bool:
    return False


class PeerLostError(RuntimeError):
    """A flightsw never answered, or fell silent. The text names the aircraft and the last tick on each side."""


class PlantLinks:
    """Between a PlantServer and one onboard computer per aircraft: a process on this machine, or `external`, by name, wherever
    its line leads. `status` is called about every STATUS_S; once `stopped` says so the run ends with StoppedError, between two
    ticks: no packet is cut, no log written twice."""

    def __init__(
        self,
        server: PlantServer,
        port_offset: int,
        status: Status,
        note: Callable[[str], None],
        stopped: Callable[[], bool] = _never,
        security: Security = OPEN,
        external: Mapping[str, Line] | None = None,
    ) -> None:
        self.server = server
        self._status, self._note, self._stopped = status, note, stopped
        lockstep = server.scenario.clock.mode != "realtime"
        self._peers = Peers(server.names, server.sysids, port_offset, external or {}, security, lockstep)
        try:
            self._orders = UdpLink(
                plant_command_port(port_offset), "commands to the plant", security=security, ident=ORDERS
            )
        except OSError:
            self._peers.close()
            raise
        self.books = Books(self._peers, server)
        clock = server.scenario.clock
        self.quiet = Silence(clock.silence, clock.silence_end_s, server.names, note)
        self._who = STRANGER  # whose the datagram taken last was
        n = len(server.names)
        self._answered_tick = [-1] * n  # last tick each peer answered
        self._next_status = self._repeated = 0.0
        self.unread = 0  # datagrams to the command port dropped unread
        self._told = 0  # packets refused by signing, as last told
        self.missed = [0] * n  # real time: ticks without a fresh reply
        self.late_ticks = 0  # real time: ticks that began after their deadline by a period or more
        self.stray = 0  # datagrams of somebody who is no aircraft
        self.overrun = 0  # datagrams dropped at the sockets, known after `finish`

    def _receive(self, exact: bool, wait: bool = True) -> int:
        """Take one datagram: ANSWER, RUBBISH (anything else that arrived) or NOTHING."""
        got = self._peers.receive(wait)
        if got is None:
            return NOTHING
        i, data = got
        self._who = i
        self.stray += i == STRANGER
        if i == STRANGER or self.books.heard(i, data):
            return RUBBISH
        taken = self.server.accept(i, data, exact)
        self.books.replied(i)
        if taken:
            self._answered_tick[i] = self.server.tick
            return ANSWER
        return RUBBISH

    @property
    def unsent(self) -> int:
        """Datagrams the system would not take."""
        return self._peers.unsent + self._orders.dropped

    @property
    def refused(self) -> int:
        """Packets that signing has refused."""
        return self._peers.refused + (self._orders.signing.refused.total if self._orders.signing is not None else 0)

    def _look(self) -> None:
        if self._stopped():
            raise StoppedError

    def _take_orders(self) -> None:
        """Commands of the ground to the plant: each is answered at once and takes effect at the next tick."""
        for data, addr in self._orders.take():
            for ack in self.server.desk.take(data):
                self._orders.send(ack, addr)
        self.server.desk.unread += self._orders.unread
        self.unread += self._orders.unread
        self._orders.unread = 0

    def _send(self, datagrams: list[bytes], only_open: bool = False) -> None:
        for i, d in enumerate(datagrams):
            if not (only_open and self.server.answered(i)):
                self._peers.send(i, d)
                self.books.sent(i)

    def _report(self, now: float) -> None:
        if now >= self._next_status:
            self._next_status = now + STATUS_S
            self._status(self.server.t_us, self.server.tick, self.books.words())
            notes = self.server.notes
            for line in notes[:NOTES_MAX]:
                self._note(line)
            if len(notes) > NOTES_MAX:
                self._note(f"{len(notes) - NOTES_MAX} more lines of this kind")
            notes.clear()
            if (n := self.refused) != self._told:
                self._note(f"signing: {n - self._told} packets refused")
                self._told = n
            if unread := self.server.desk.unread:
                self._note(f"{unread} commands to the plant dropped unread")
                self.server.desk.unread = 0

    def _lost(self, waited: float, starting: bool) -> PeerLostError:
        s = self.server
        silent = [i for i in range(len(s.names)) if not s.answered(i)]
        parts = []
        for i in silent:
            last = f"last answered tick {self._answered_tick[i]}" if self._answered_tick[i] >= 0 else "never answered"
            bad = f", {s.rejected[i]} datagrams rejected" if s.rejected[i] else ""
            parts.append(f"{s.names[i]} (sysid {s.sysids[i]}, {self._peers.where[i]}): {last}{bad}")
        what = "no answer at start-up" if starting else "peer silent"
        return PeerLostError(
            f"{what} for {waited:.1f} s; plant is at tick {s.tick} (t = {s.t_us / 1e6:.2f} s); " + "; ".join(parts)
        )

    def start(self) -> list[bytes]:
        """Repeat tick 0 until every aircraft has answered it; its datagrams. Raises PeerLostError after the start-up timeout."""
        s = self.server
        began = time.monotonic()
        next_send = began
        limit = s.scenario.clock.startup_timeout_s
        out = s.begin_tick()
        while not all(map(s.answered, range(len(s.names)))):
            self._look()
            now = time.monotonic()
            if now - began > limit:
                raise self._lost(now - began, True)
            if now >= next_send:
                self._send(out, only_open=True)
                next_send = now + REPEAT_S
            self._receive(True)
            self._take_orders()
            self._report(now)
        return out

    def finish(self) -> None:
        """Tell every flightsw that the run is over (three times: UDP may lose one), and close the socket."""
        for _ in range(3):
            for i, last in enumerate(self.server.shutdown()):
                self._peers.send(i, last)
        self.overrun = self._peers.overrun + overrun(self._orders)
        self._peers.close()
        self._orders.close()
