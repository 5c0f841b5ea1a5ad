"""The plant as seen by the link: one datagram out per aircraft and tick, one reply back. No sockets, no clock: the UDP
loops and the in-process runner drive the same object."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Generic

from flightsw.icd.codec import PlantCodec, Reply
from flightsw.icd.geo import Origin
from flightsw.icd.port import WIRE, D, Port
from flightsw.icd.tlog import FLUSH_US, TlogWriter
from flightsw.strict import ConfigError
from flightsw.types import ACCEPTED
from sim_plant.couplings.radio import FIXES, Radio
from sim_plant.failures.desk import CommandDesk
from sim_plant.scenario import Scenario, dump, load_scenario
from sim_plant.truth import row_of
from sim_plant.world import World

REPLY_AGE_US = (
    1_000_000  # [us] a reply may be behind in real time: a flightsw that answers the same old tick is not heard
)


WATCHED_US = 100_000  # [us] of truth that a reader of the growing log may be behind in real time


class PlantServer(Generic[D]):
    """World, codec, radio and truth log of one run.

    Per tick: begin_tick() -> datagrams; offer each reply to accept() (or pass all to end_tick); end_tick(). With
    `run_dir` it writes truth.tlog and the resolved scenario.toml there; raises TlogError or OSError naming the file
    if it cannot. `world`: one of an equal scenario and this seed, not yet flown. `port`: the form of the datagrams. `notes`
    collects lines for the operator (refused scripted commands); whoever shows them empties it.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int | None = None,
        run_dir: str | Path | None = None,
        world: World | None = None,
        port: Port[D] = WIRE,  # type: ignore[assignment]
    ) -> None:
        self.port = port
        self.scenario = scenario
        self.world = World(scenario, seed) if world is None else world
        self._origin = Origin(scenario.origin.lat_deg, scenario.origin.lon_deg)
        members = self.world.members
        self.names = [m.cfg.name for m in members]
        self.sysids = [m.cfg.sysid for m in members]
        self.codecs = [PlantCodec(m.ac, m.cfg.sysid, self._origin, port) for m in members]
        self._others: dict[int, PlantCodec[bytes]] = {}  # of what flies without onboard software, for its truth
        link = scenario.link
        self.radio: Radio[D] = Radio(
            self.names, self.world.seed, link.radio_latency_ms, link.radio_loss, self.world.rate_hz
        )
        self.notes: list[str] = []
        self.rejected = [0] * len(self.names)  # datagrams that were no reply to an open tick
        self.stamps = [-1] * len(self.names)  # [us] what the last reply looked at answers; -1: it was none
        self._out: list[D] = []
        self._replies: list[Reply[D] | None] = [None] * len(self.names)
        self._answers: list[list[D]] = [[] for _ in self.names]  # to orders that came by way of the aircraft
        self._truth_div = max(1, self.world.rate_hz // scenario.clock.truth_hz)
        self._log: TlogWriter | None = None
        self.desk = CommandDesk(self.world, self.notes, None if run_dir is None else Path(run_dir))
        if run_dir is not None:
            folder = Path(run_dir)
            folder.mkdir(parents=True, exist_ok=True)
            self._write_scenario(folder / "scenario.toml")
            watched = scenario.clock.mode == "realtime"  # by a live picture, which reads the log as it grows
            self._log = TlogWriter(folder / "truth.tlog", flush_us=WATCHED_US if watched else FLUSH_US)

    def _write_scenario(self, path: Path) -> None:
        """Store the resolved scenario, unless the launcher already left an equal one."""
        try:
            have = load_scenario(str(path))
            if have == self.scenario and have.meta.seed == self.world.seed:
                return
        except ConfigError:
            pass  # none, or another one
        path.write_text(dump(self.scenario, self.world.seed))

    @property
    def done(self) -> bool:
        """Whether the scenario's duration is over."""
        return self.world.done

    @property
    def tick(self) -> int:
        """Number of the current tick."""
        return self.world.tick

    @property
    def t_us(self) -> int:
        """Simulated time of the current tick [us]."""
        return self.world.t_us

    def begin_tick(self) -> list[D]:
        """This tick's datagrams in scenario order. Calling again before end_tick returns the same ones (repeats)."""
        if self._out:
            return self._out
        w, out, receive, answers = self.world, self._out, self.radio.receive, self._answers
        frames, tick = w.sense(), w.tick
        self.desk.record()
        for i, codec in enumerate(self.codecs):
            frame, extra = frames[i], receive(i, tick, w.link_up(i))
            if frame.commands:
                extra += [codec.command(c.command, *c.params) for c in frame.commands]
            if answers[i]:
                extra += answers[i]
                answers[i] = []
            out.append(codec.sensors(frame, extra))
        if self._log is not None and tick % self._truth_div == 0:
            self._write_truth()
        return self._out

    def _write_truth(self) -> None:
        assert self._log is not None
        w, t_us, write = self.world, self.world.t_us, self._log.write
        for codec, m in zip(self.codecs, w.members, strict=True):
            write(t_us, codec.truth(t_us, row_of(m)))
        for sysid, other in w.others():
            if sysid not in self._others:  # any record does: it has no controls to scale
                self._others[sysid] = PlantCodec(w.members[0].ac, sysid, self._origin)
            write(t_us, self._others[sysid].truth(t_us, other.row))

    def accept(self, i: int, datagram: D, exact: bool = True) -> bool:
        """Take a datagram of aircraft i. True if it answers the current tick (`exact`) or a recent one (real time).

        Anything else (duplicate, late, corrupt, without actuator command) is counted in `rejected` and changes nothing.
        """
        reply, before = self.codecs[i].decode_reply(datagram), self._replies[i]
        cmd = reply.cmd
        if cmd is None:
            self.stamps[i] = -1
            self.rejected[i] += 1
            return False
        self.stamps[i] = stamp = cmd.t_us
        late = self.world.t_us - stamp
        if not 0 <= late <= REPLY_AGE_US or (exact and (late or before is not None)):
            if stamp:  # tick 0 is repeated until answered: more than one answer to it is no fault
                self.rejected[i] += 1
            return False
        if before is not None:  # real time: several replies in one tick; none of their packets may get lost
            reply.link, reply.orders = (*before.link, *reply.link), (*before.orders, *reply.orders)
            reply.fixes = (*before.fixes, *reply.fixes)
            if before.cmd is not None and before.cmd.t_us > cmd.t_us:
                reply.cmd = before.cmd
        for ack in reply.acks:
            if ack.result != ACCEPTED:
                at = f"t = {self.t_us / 1e6:.2f} s"
                why = f": {ack.reason}" if ack.reason else ""
                self.notes.append(f"{self.names[i]}: command {ack.command} refused, result {ack.result}, at {at}{why}")
        self._replies[i] = reply
        return True

    def answered(self, i: int) -> bool:
        """Whether aircraft i has answered the open tick."""
        return self._replies[i] is not None

    def end_tick(self, replies: Sequence[D | None] | None = None) -> None:
        """Close the tick with `replies` (in scenario order) or with what accept() took; fly on to the next tick."""
        for i, d in enumerate(replies or ()):
            if d:
                self.accept(i, d)
        w, taken = self.world, self._replies
        for i, r in enumerate(taken):
            if r is None:
                continue
            if r.link or r.fixes:
                up = w.link_up(i)
                self.radio.send(i, w.tick, r.link, up)
                self.radio.send(i, w.tick, r.fixes, up, FIXES)
            for order in r.orders:
                answers = self.desk.take(self.port.as_bytes(order), trusted=True)
                self._answers[i] += map(self.port.of_bytes, answers)
        cmds = [None if r is None else r.cmd for r in taken]
        self._replies = [None] * len(taken)
        w.step(cmds)
        self._out = []

    def shutdown(self) -> list[D]:
        """The last datagrams of the run, one per aircraft: flightsw flushes its logs and exits."""
        return [c.shutdown() for c in self.codecs]

    def close(self) -> None:
        """Flush and close the logs. Raises TlogError if the disk refuses."""
        self.desk.close()
        if self._log is not None:
            self._log.close()
