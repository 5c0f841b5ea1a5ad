"""Books about the lines to external aircraft: meter and clock offset of each, live and at the end."""

from __future__ import annotations

import time

from flightsw.icd.scaling import COMP_PLANT
from flightsw.icd.timesync import Offset, is_timesync
from flightsw.icd.wire import Sender
from sim_plant.meter import LineMeter
from sim_plant.peers import Peers
from sim_plant.server import PlantServer


class Books:
    """One meter and one offset for each external aircraft of `peers`; without any, nothing costs anything."""

    def __init__(self, peers: Peers, server: PlantServer) -> None:
        self._peers, self._server = peers, server
        far = [i for i in range(len(server.names)) if peers.is_external(i)]
        self.meters = {i: LineMeter() for i in far}
        self.offsets = {i: Offset(Sender(server.sysids[i], COMP_PLANT)) for i in far}
        self._period_us = 1_000_000 // server.world.rate_hz

    def sent(self, i: int) -> None:
        """The open tick has gone to aircraft i; and a question about its clock, if it is time for one."""
        if i not in self.meters:
            return
        now = time.monotonic()
        self.meters[i].sent(self._server.t_us, now)
        if not self._server.tick:  # nobody is there yet: what waits in his socket is the first tick, again and again
            return
        if question := self.offsets[i].ask(now):
            self._peers.send(i, question)

    def heard(self, i: int, datagram: bytes) -> bool:
        """Whether a datagram of aircraft i is for these books alone."""
        if i not in self.meters or not is_timesync(datagram):
            return False
        self.offsets[i].take(datagram, time.monotonic())
        self.meters[i].passed_over = self.offsets[i].status.passed_over
        return True

    def replied(self, i: int) -> None:
        """The server has looked at a reply of aircraft i."""
        if i in self.meters:
            s = self._server
            self.meters[i].replied(s.stamps[i], time.monotonic(), s.t_us, self._period_us)

    def close(self) -> None:
        """The open tick is over."""
        for m in self.meters.values():
            m.close(self._server.t_us)

    def words(self) -> dict[str, str]:
        """How each line is now, by aircraft."""
        return {self._server.names[i]: m.words() for i, m in self.meters.items()}

    def accounts(self) -> dict[str, int | float]:
        """For the summary of a run, by aircraft."""
        out: dict[str, int | float] = {}
        for i, m in self.meters.items():
            name, offset = self._server.names[i], self.offsets[i]
            out |= m.accounts(name)
            if offset.taken:
                there = offset.status
                out |= {
                    f"noise_bytes_there.{name}": there.noise,
                    f"torn_datagrams_there.{name}": there.torn,
                    f"unsent_replies_there.{name}": there.unsent,
                    f"clock_offset_s.{name}": round(offset.offset_s, 6),
                    f"clock_offset_known_to_ms.{name}": round(1e3 * offset.uncertainty_s, 3),
                }
        for i, far in self._peers.streams().items():
            name = self._server.names[i]
            out |= {f"noise_bytes.{name}": far.noise, f"torn_datagrams.{name}": far.torn, f"opened.{name}": far.opened}
        return out
