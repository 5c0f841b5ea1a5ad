"""The two loops around a Node: lockstep and real time. Sockets, signals and the log live here; no decision about
flying does.
"""

from __future__ import annotations

import gc
import select
import signal
from collections.abc import Callable
from types import FrameType

from flightsw.icd.framing import modern
from flightsw.icd.link import Address, UdpLink
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.stream_link import StreamLink
from flightsw.icd.timesync import LineStatus, answer, is_timesync
from flightsw.icd.wire import Sender
from flightsw.priority import Eager
from flightsw.process.clock import RealtimeClock, monotonic_us
from flightsw.process.config import FlightConfig, parse_target
from flightsw.process.node import Node
from flightsw.process.recorder import LinkRecorder

EXIT_OK, EXIT_SILENT = 0, 3
POLL_MS = 100  # [ms] longest wait before signals and time-outs are looked at
FRIEND_US = 1_000_000  # [us] wall time after which another than the plant heard last may take its place
LISTEN_TICKS = 1000  # telemetry also goes to whoever sent something within so many ticks
MAX_LISTENERS = 4
STALE_TAKES = 100  # times the socket is emptied before real time begins
MAGIC = (b"\xfd", b"\xfe")


class Stop:
    """SIGINT and SIGTERM as a flag, so that the loop ends between two ticks."""

    def __init__(self) -> None:
        self.signum = 0
        for s in (signal.SIGINT, signal.SIGTERM):
            signal.signal(s, self._on)

    def _on(self, signum: int, frame: FrameType | None) -> None:
        self.signum = signum

    @property
    def exit_code(self) -> int:
        """128 + signal number: 130 or 143."""
        return 128 + self.signum


class Ground:
    """Telemetry socket: targets of the configuration, and whoever asked lately."""

    def __init__(self, link: UdpLink, node: Node, targets: list[Address]) -> None:
        self.link, self.node, self.targets = link, node, targets
        self._listeners: dict[Address, int] = {}

    def take(self) -> list[bytes]:
        """Datagrams that arrived, in MAVLink 2 framing; their senders become listeners."""
        out = []
        for data, sender in self.link.take():
            out.append(modern(data))
            if sender not in self.targets and data[:1] in MAGIC:
                if sender not in self._listeners and len(self._listeners) >= MAX_LISTENERS:
                    del self._listeners[min(self._listeners, key=self._listeners.__getitem__)]
                self._listeners[sender] = self.node.tick
        self.node.unread_ground += self.link.unread
        self.link.unread = 0
        return out

    def send(self, datagrams: list[bytes]) -> None:
        """Send telemetry; drops are counted in the node's telemetry."""
        ctx = self.node.telemetry.ctx
        if self._listeners:
            old = self.node.tick - LISTEN_TICKS
            self._listeners = {a: t for a, t in self._listeners.items() if t >= old}
        for d in datagrams:
            for a in (*self.targets, *self._listeners):
                self.link.send(d, a)
        ctx.dropped = self.link.dropped
        ctx.sent += len(datagrams) * len(self.targets)


class Process:
    """One flight process: node, sockets, log. `say` prints one line for a person."""

    def __init__(
        self,
        cfg: FlightConfig,
        node: Node,
        plant: UdpLink | StreamLink,
        telemetry: UdpLink,
        log: LinkRecorder,
        stop: Stop,
        say: Callable[[str], None],
        port_offset: int = 0,
    ) -> None:
        self.cfg, self.node, self.plant, self.log, self.stop, self.say = cfg, node, plant, log, stop, say
        targets = [(h, p + port_offset) for h, p in map(parse_target, cfg.link.targets)]
        self.ground = Ground(telemetry, node, targets)
        self._poll = select.poll()
        self._poll.register(plant.fileno(), select.POLLIN)
        self._telemetry_fd = telemetry.sock.fileno()
        self._poll.register(self._telemetry_fd, select.POLLIN)
        self._eager = Eager(self._poll, monotonic_us)
        self._clock_sender = Sender(cfg.app.sysid, COMP_AUTOPILOT)
        self._from: Address | None = None  # where the plant was heard last
        self._alive_us = 0  # wall time of its last tick

    def freeze(self) -> None:
        """After warm-up: what exists now is never collected, and nothing is collected behind our back."""
        gc.collect()
        gc.freeze()
        gc.disable()

    def lockstep(self) -> int:
        """Answer every sensor datagram until the plant ends the run, falls silent or a signal comes. Returns the exit
        code.
        """
        node, ground = self.node, self.ground
        heard_us = monotonic_us()
        while not self.stop.signum:
            for fd, _ in self._eager.soon() or self._poll.poll(POLL_MS):
                if fd == self._telemetry_fd:
                    node.step((), None, ground.take())  # it waits for the next tick
            before = node.tick
            for datagram, sender in self._take():
                self._answer_one(datagram, sender)
                if node.done:
                    return EXIT_OK
            if node.tick != before:
                self._alive_us = monotonic_us()
            elif self._is_silent(max(heard_us, self._alive_us)):
                return EXIT_SILENT
        return self.stop.exit_code

    def _answer_one(self, datagram: bytes, sender: Address) -> None:
        """Lockstep: one datagram, its reply, its telemetry, its log."""
        node, ground, log = self.node, self.ground, self.log
        before, t_us = node.tick, node.t_us
        reply = node.step((datagram,))
        if reply:
            self.plant.send(reply, sender)
            self._from = sender
            self._alive_us = monotonic_us()  # also by a repeat: a plant whose time stands still is not silent
        telemetry = node.after()
        if node.tick == before:
            return
        if telemetry:
            ground.send(telemetry)
        if node.t_us == t_us:  # two ticks under one stamp: the log keeps them apart
            log.tick(node.t_us, 0, 0)
        log.refused(node.t_us, node.refused)
        log.unread(node.t_us, node.unread_plant, node.unread_ground)
        log.inbound(node.t_us, node.take_heard())
        log.outbound(node.t_us, reply, telemetry)
        log.settled(node.take_settled())

    def _take(self) -> list[tuple[bytes, Address]]:
        """Datagrams of the plant link, the plant's own first."""
        got = self.plant.take(self._from)
        if (
            self._from is not None and monotonic_us() - self._alive_us < FRIEND_US
        ):  # nobody else speaks for a plant that is there
            friend = [g for g in got if g[1] == self._from]
            self.node.unread_plant += len(got) - len(friend)
            got = friend
        self.node.unread_plant += self.plant.unread
        self.plant.unread = 0
        got = [(d, s) for d, s in got if not self._asked_the_time(d, s)]
        self._judged()
        return got

    def _asked_the_time(self, datagram: bytes, sender: Address) -> bool:
        """Whether it is a question about this clock, which is answered here: nothing that flies hears of it."""
        if not is_timesync(datagram):
            return False
        if reply := answer(datagram, self._clock_sender, monotonic_us() * 1000, self._line_status()):
            self.plant.send(reply, sender)
        return True

    def _line_status(self) -> LineStatus:
        plant, node = self.plant, self.node
        noise, torn = (plant.noise, plant.torn) if isinstance(plant, StreamLink) else (0, 0)
        return LineStatus(node.taken, node.passed_over, noise, torn, plant.dropped)

    def _judged(self) -> None:
        """Tell the node what signing has refused at both sockets."""
        ends = [s.refused.counts() for s in (self.plant.signing, self.ground.link.signing) if s is not None]
        if ends:
            self.node.refused = tuple(map(sum, zip(*ends, strict=True)))

    def realtime(self, clock: RealtimeClock) -> int:
        """Run at the base rate whatever comes, newest frame wins. Returns the exit code as `lockstep` does."""
        node, ground, log = self.node, self.ground, self.log
        period_us = self.cfg.period_us
        for _ in range(STALE_TAKES):  # what came during start-up: old news, if the plant is under way
            if not self.plant.take():
                break
        self.plant.unread = 0
        heard_us = monotonic_us()
        while not self._poll_plant():
            if self.stop.signum:
                return self.stop.exit_code
            if self._is_silent(heard_us):
                return EXIT_SILENT
        clock.start()
        heard_us = monotonic_us()
        while not self.stop.signum:
            k = clock.wait_tick()
            begin_us = monotonic_us()
            got = self._take()
            before = node.tick
            reply = node.step([d for d, _ in got], k * period_us / 1e6, ground.take())
            if node.answers >= 0:
                heard_us = self._alive_us = begin_us
                self._from = got[node.answers][1]
            elif self._is_silent(heard_us):
                return EXIT_SILENT
            if reply and self._from is not None:
                self.plant.send(reply, self._from)
            telemetry = node.after()
            if telemetry:
                ground.send(telemetry)
            if node.tick != before:
                log.tick(node.t_us, k * period_us, node.exec.slips)
                log.refused(node.t_us, node.refused)
                log.unread(node.t_us, node.unread_plant, node.unread_ground)
                log.inbound(node.t_us, node.take_heard())
                log.outbound(node.t_us, reply, telemetry)
                log.settled(node.take_settled())
                node.exec.account(monotonic_us() - begin_us, clock.late_us, k - 1)
            if node.done:
                return EXIT_OK
        return self.stop.exit_code

    def close(self) -> None:
        """Store what came after the last tick, flush and close everything. Raises TlogError."""
        try:
            self.log.inbound(max(self.node.t_us, 0), self.node.take_heard())
        finally:
            self.log.close()
            self.plant.close()
            self.ground.link.close()

    def _poll_plant(self) -> bool:
        """Wait a little; True if the plant sent something."""
        woken = {fd for fd, _ in self._poll.poll(POLL_MS)}
        return self.plant.fileno() in woken and self.plant.arrived()

    def _is_silent(self, heard_us: int) -> bool:
        """True, and said, when the plant has been silent too long; until the second tick it may still be starting."""
        link, node = self.cfg.link, self.node
        patience_s = link.peer_timeout_s if link.silence == "end" else link.silence_end_s
        limit = patience_s if node.tick > 1 else max(link.startup_timeout_s, patience_s)
        if monotonic_us() - heard_us < limit * 1e6:
            return False
        where = (
            f"last tick here: {node.tick - 1} at t = {node.t_us / 1e6:.2f} s" if node.tick else "no tick was received"
        )
        self.say(f"plant silent on {self.plant.where} for {limit:g} s; {where}")
        return True
