"""The plant against real flightsw processes: lockstep (exact) and paced real time, and what silence does to either."""

from __future__ import annotations

import time

from sim_plant.links import ANSWER, NOTHING, REPEAT_S, PeerLostError, PlantLinks, StoppedError
from sim_plant.peers import STRANGER
from sim_plant.silence import END, FLY, WAIT

__all__ = ["PeerLostError", "StoppedError", "UdpPlant"]

BURST = 1000  # datagrams taken in one tick of real time


class UdpPlant(PlantLinks):
    """Drives a PlantServer against its onboard computers. Raises PeerLostError, StoppedError."""

    def lockstep(self) -> None:
        """Fly the scenario as fast as the peers answer. Raises PeerLostError naming a peer that falls silent."""
        s, n = self.server, len(self.server.names)
        out = self.start()
        s.end_tick()
        clock, quiet, pace = s.scenario.clock, self.quiet, s.desk.pace
        while not s.done:
            self._look()
            self._take_orders()
            while pace.hold():
                self._keep_alive(out)
            out = s.begin_tick()
            self._send(out)
            # as flightsw does: with the first ticks a peer may still be starting
            limit = clock.peer_timeout_s if s.tick > 1 else max(clock.startup_timeout_s, clock.peer_timeout_s)
            waiting, began, sent = n - len(quiet.since), 0.0, 0.0
            if quiet.since:
                waiting += self._while_silent()
            while waiting:
                if self._receive(True) == ANSWER:
                    waiting -= 1
                    continue
                self._look()
                now = time.monotonic()  # the clock is asked only when something is odd
                began, sent = began or now, sent or now
                if now - began > limit:
                    if quiet.rule == END or quiet.over(now):
                        raise self._lost(now - began, False)
                    self._fall_silent(began, now)
                    if quiet.rule == FLY:
                        break
                if now - sent >= REPEAT_S:
                    self._send(out, only_open=True)
                    sent = now
                self._report(now)
            if quiet.since and quiet.rule == WAIT:
                self._come_back()
            s.end_tick()
            self.books.close()
            if s.tick & 31 == 0:
                self._report(time.monotonic())

    def _keep_alive(self, out: list[bytes]) -> None:
        """While time stands still: the last tick again, now and then, so that no peer takes this for silence; what is answered is
        known already."""
        s, now = self.server, time.monotonic()
        if now - self._repeated >= REPEAT_S:
            self._repeated = now
            for i, d in enumerate(out):
                self._peers.send(i, d)
        while (got := self._peers.receive(wait=False)) is not None:
            self.books.heard(*got)
        s.desk.record()  # commands are taken a tick's worth at a time
        self._look()
        self._take_orders()
        self._report(now)

    def _fall_silent(self, since: float, now: float) -> None:
        for i in range(len(self.server.names)):
            if not self.server.answered(i):
                self.quiet.falls(i, since, now, self.server.t_us)

    def _come_back(self) -> None:
        """All that have answered are silent no more."""
        now = time.monotonic()
        for i in [i for i in self.quiet.since if self.server.answered(i)]:
            self.quiet.heard(i, now, self.server.t_us)

    def _while_silent(self) -> int:
        """Lockstep goes at the wall clock's pace while it does not wait for somebody. The number of those that have spoken: their
        answers are waited for again. Raises PeerLostError when it is enough."""
        s, back = self.server, 0
        time.sleep(1.0 / s.world.rate_hz)
        while (what := self._receive(True, wait=False)) != NOTHING:
            i = self._who
            if i != STRANGER and s.stamps[i] >= 0 and self.quiet.heard(i, time.monotonic(), s.t_us):
                back += what != ANSWER  # its answer to a tick long past: it is there, and has the present one to answer
        if waited := self.quiet.over(time.monotonic()):
            raise self._lost(waited, False)
        return back

    def _stand_still(self, out: list[bytes]) -> None:
        """Real time stops until all have answered the open tick."""
        sent = 0.0
        self._peers.wait(0.05)
        while not all(map(self.server.answered, range(len(self.server.names)))):
            self._look()
            self._take_orders()
            now = time.monotonic()
            if waited := self.quiet.over(now):
                raise self._lost(waited, False)
            if now - sent >= REPEAT_S:
                self._send(out, only_open=True)
                sent = now
            self._receive(False)
            self._report(now)
        self._come_back()

    def _pass(self, seconds: float) -> None:
        """Let time go by; replies of external aircraft are taken as they come, so that it is known when."""
        if self._peers.external and seconds >= 1e-3:  # the system waits whole milliseconds for several lines
            self._peers.wait(seconds)
            self._receive(False)
        else:
            time.sleep(seconds)

    def realtime(self) -> None:
        """Fly at the wall clock's pace: absolute deadlines, whatever reply is newest; silence ends the run as in
        lockstep."""
        s, n = self.server, len(self.server.names)
        self.start()
        s.end_tick()
        s.desk.pace.fixed = "real time goes at the pace of the wall clock"
        period = 1.0 / s.world.rate_hz
        limit, quiet = s.scenario.clock.peer_timeout_s, self.quiet
        heard = [time.monotonic()] * n
        deadline = time.monotonic()
        while not s.done:
            self._look()
            self._take_orders()
            out = s.begin_tick()
            self._send(out)
            deadline += period
            while (left := deadline - time.monotonic()) > 2e-4:
                self._pass(left - 1e-4)
            for _ in range(BURST):
                if self._receive(False, wait=False) == NOTHING:
                    break
            now = time.monotonic()
            for i in range(n):
                if s.answered(i):
                    heard[i] = now
                else:
                    self.missed[i] += 1
                    if now - heard[i] > limit:
                        if quiet.rule == END or quiet.over(now):
                            raise self._lost(now - heard[i], False)
                        quiet.falls(i, heard[i], now, s.t_us)
            if quiet.since:
                if quiet.rule == WAIT:
                    self._stand_still(out)
                    now = deadline = time.monotonic()
                    heard = [now] * n
                self._come_back()
            s.end_tick()
            self.books.close()
            if now - deadline >= period:  # fell behind: count and go on from here, no burst of ticks
                self.late_ticks += 1
                deadline = now
            self._report(now)
