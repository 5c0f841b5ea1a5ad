"""One onboard process without its sockets: datagrams in, datagrams out, no clock. The same object runs over UDP, in
process and in replay.

A tick has two halves, so that the reply leaves before anything else is done: `step` gives the reply, `after` the
telemetry. `handle` is both. Per tick, in this order: decode, services, application, reply (actuators, data link, acks);
then telemetry.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Generic

from flightsw.aircraft import load_airframe
from flightsw.icd.codec import FlightCodec
from flightsw.icd.codec_orders import COMMANDS_MAX
from flightsw.icd.codec_telemetry import rate_group
from flightsw.icd.codec_terms import refuse_unknown
from flightsw.icd.port import WIRE, D, Port
from flightsw.icd.signing import REASONS
from flightsw.icd.stamps import Frames
from flightsw.icd.tlog import GROUND_IN, LINK_IN
from flightsw.icd.wire import Counters
from flightsw.process.application import App, make_app
from flightsw.process.clock import LockstepClock
from flightsw.process.config import FlightConfig
from flightsw.process.executive import Executive, no_time
from flightsw.process.gained import Gained
from flightsw.process.losses import Losses
from flightsw.process.parameters import parameters
from flightsw.process.recorder import Heard
from flightsw.process.services import CMD_SHUTDOWN, PACKETS_MAX, Services
from flightsw.process.telemetry import Telemetry
from flightsw.types import UPD_GNSS, Ack, Command, SensorFrame, Settled, Snapshot

GROUND_MAX = 32  # [datagram] of the ground that wait for a tick
MAX_HEARD = 1000  # [datagram] kept for the log between two ticks
MAX_ALONE_US = 600_000  # [us] onboard time goes on without frames: long enough for every input to be called lost
NO_TICK, AGAIN, TICK = range(3)  # what a datagram of the plant is


@dataclass(slots=True)
class NodeOutput(Generic[D]):
    """Answer to one call of `handle`. An empty reply means: nothing to answer (rubbish, or no tick)."""

    reply: D
    telemetry: list[bytes] = field(default_factory=list)
    done: bool = False


class Node(Generic[D]):
    """Flight process of one aircraft. `app` replaces the real application; `now_us` is the accounting clock of real
    time; `port` the form of the plant's datagrams.
    """

    def __init__(
        self,
        cfg: FlightConfig,
        app: App | None = None,
        *,
        realtime: bool = False,
        now_us: Callable[[], int] = no_time,
        port: Port[D] = WIRE,  # type: ignore[assignment]
    ) -> None:
        origin = cfg.origin.origin()
        base = cfg.app.base_rate_hz
        self.cfg = cfg
        self.realtime = realtime
        self.app = make_app(cfg) if app is None else app
        self.codec = FlightCodec(
            load_airframe(cfg.app.aircraft),
            cfg.app.sysid,
            origin,
            peer_sysid=cfg.link.peer_sysid,
            lockstep=not realtime,
            port=port,
        )
        refuse_unknown(self.app.laws)
        self.telemetry = Telemetry(
            cfg.app.sysid, self.app.reports, self.app.sends_relative, origin, base, self.codec.count,
            cfg.telemetry.rates_hz, phases=self.app.phases, capacity_kg=self.app.fuel_capacity_kg,
            simulated=cfg.link.simulated,
        )  # fmt: skip
        own = (("app", cfg.app), ("origin", cfg.origin), ("link", cfg.link))
        self.services = Services(
            cfg.app.sysid,
            cfg.app.mission,
            parameters((*own, *self.app.records)),
            self.telemetry,
            self.app.commands,
            self.app.route,
            range(cfg.link.operators[0], cfg.link.operators[1] + 1),
            cfg.link.simulated,
        )
        self.frame = SensorFrame()
        self.frames = Frames(self.codec.count)
        self.clock = LockstepClock(cfg.period_us)
        self.exec = Executive(now_us)
        self.exec.add("app", 1, 0, self._run_app)
        if cfg.link.broadcast_peer:
            self.exec.add("peer", max(1, base // cfg.link.peer_rate_hz), 0, self._run_peer)
        if cfg.link.raw_fix:
            self.exec.add("fix", 1, 0, self._run_fix)
        self._gained = Gained()
        self.tick = 0
        self.t_us = -1  # [us] sample time of the last tick
        self.dt_s = 0.0
        self.done = False
        self.duplicates = 0
        self.taken = self.passed_over = 0  # ticks that came in; of these not answered for a newer one
        self.heard: list[Heard] = []
        self.heard_lost = 0
        self.settled: list[tuple[int, Settled]] = []
        self.unread_plant = self.unread_ground = (
            0  # [datagram] the sockets dropped unread; whoever has the sockets says
        )
        self.refused: tuple[int, ...] = (0,) * len(REASONS)  # [packet] by signing; whoever has the sockets says
        self.last_text = ""
        self.losses = Losses()
        self._waiting: list[Command] = []  # to the mission, asked without a tick: for the next one
        self._ground: list[bytes] = []  # of the ground, for the next tick
        self._last_datagram = self._last_reply = port.nothing
        self._held = port.nothing  # the actuator command sent last
        self._said: list[D] = []  # this tick, of which the reply is made
        self.answers = -1
        self._ticked = False
        self._snap: Snapshot | None = None
        self._link_asked: set[tuple[int, int, int]] = set()

    @property
    def count(self) -> Counters:
        """What was dropped of the plant link."""
        return self.codec.count

    def handle(self, datagrams: Sequence[D], dt_s: float | None = None, ground: Sequence[bytes] = ()) -> NodeOutput[D]:
        """One call: datagrams of the plant (lockstep: one tick's) and of the ground in, reply and telemetry out. Pure.

        `dt_s` [s]: time step for the application; None = difference of the sample times. Never raises on what it
        receives.
        """
        reply = self.step(datagrams, dt_s, ground)
        return NodeOutput(reply, self.after(), self.done)

    def step(self, datagrams: Sequence[D], dt_s: float | None = None, ground: Sequence[bytes] = ()) -> D:
        """First half: take the datagrams in, run the application if there is a tick, return the reply (empty: none).

        `answers` is the place of the datagram the reply answers, -1 if none of them opened a tick.
        """
        f = self.frame
        if self._ticked:  # the frame of the last tick has been read by everyone
            self._ticked = False
            f.updated = 0
            if f.commands:
                f.commands.clear()
            if f.settings:
                f.settings.clear()
        new = again = False
        self.answers = -1
        for k, d in enumerate(datagrams):
            if d == self._last_datagram and d:
                self.duplicates += 1
                again, self.answers = True, k
                continue
            what = self._take(d)
            if what == AGAIN:
                self.duplicates += 1
                again, self.answers = True, k
            elif what == TICK:
                self._last_datagram = d
                self.taken += 1
                self.passed_over += new
                new, self.answers = True, k
        if f.commands:
            self._own_commands()
        if self.codec.orders.answers:
            for a in self.codec.orders.take():
                self.services.answered(a)
        if ground:
            room = GROUND_MAX - len(self._ground)
            self._ground += ground[:room]
            self.unread_ground += max(len(ground) - room, 0)
        if not new and not (self.realtime and self.frames.raw >= 0):
            return self._last_reply if again else self.codec.port.nothing
        if self._ground:
            for data in self._ground:
                self._from_ground(data)
            self._ground.clear()
        if self._waiting:
            f.commands[:], self._waiting = self._waiting, []
        if self.services.parameters.pending:
            f.settings[:] = self.services.parameters.take()
        self._run(new, dt_s)
        return self._last_reply

    def after(self) -> list[bytes]:
        """Second half: telemetry datagrams of the tick `step` ran, possibly none."""
        snap = self._snap
        if snap is None:
            return []
        self._snap = None
        tick = self.tick
        self.tick += 1
        tel, services = self.telemetry, self.services
        due = bool(tel.names(tick))
        if snap.acks:
            services.note(snap.acks)
        if snap.settled:
            services.parameters.settled(snap.settled)
            self.settled += [(snap.t_us, s) for s in snap.settled if not s.why]
        if services.parameters.texts:
            snap.texts += services.parameters.told()
        if not (due or snap.texts or snap.acks or services.busy or tel.once):
            return []
        if due:
            ctx = tel.ctx
            self.exec.fill(ctx.timing)
            ctx.late_p999_us = self.exec.late_p999_us if self.realtime else 0.0
            ctx.excess = self.excess
            if tick % self.cfg.app.base_rate_hz == 0:
                late = self.count.ahead + self.count.stale
                snap.texts += self.losses.tell(
                    self.exec.new_slips(), (late, self.excess, self.services.strangers), self.refused
                )
        acks = snap.acks + services.acks
        services.acks = []
        if snap.texts or acks:
            for t in (*(t.text for t in snap.texts), *(a.reason for a in acks)):
                self.last_text = t or self.last_text
        answers = services.ready(due)
        if self.realtime and tick % self.cfg.app.base_rate_hz == 0:
            costs = self.exec.costs()
            answers = [*answers, *(partial(rate_group, tel.ctx.send, snap.t_us, k, g) for k, g in enumerate(costs))]
        return tel.datagrams(snap, tick, snap.texts, acks, answers)

    def take_settled(self) -> list[tuple[int, Settled]]:
        """Changes of parameters that came in force since the last call, with their time [us]."""
        out, self.settled = self.settled, []
        return out

    def take_heard(self) -> list[Heard]:
        """Datagrams received since the last call, for the log: exact repeats of the last one left out."""
        out, self.heard = self.heard, []
        return out

    # --- inside ----------------------------------------------------------------------------------------------------

    def _take(self, datagram: D) -> int:
        """Decode one plant datagram into the frame: TICK (its HIL_SENSOR opens one), AGAIN (the tick answered last, in other
        bytes: not taken) or NO_TICK.
        """
        codec, frames, count = self.codec, self.frames, self.codec.count
        torn = count.bad_crc + count.bad_length
        packets, t = codec.parse(datagram)
        if t == frames.raw and t >= 0:
            return AGAIN
        if codec.port.logged:
            self._hear(LINK_IN, torn == count.bad_crc + count.bad_length, codec.port.as_bytes(datagram))
        if t >= 0 and not frames.take(t, self.t_us):
            return NO_TICK
        codec.offset_us = frames.offset
        now = t + frames.offset if t >= 0 else 0
        codec.apply(packets, self.frame, now if now > self.t_us else self.t_us)
        return TICK if t >= 0 else NO_TICK

    def _hear(self, link: int, sound: bool, datagram: bytes) -> None:
        if len(self.heard) < MAX_HEARD:
            self.heard.append((link, sound, datagram))
        else:
            self.heard_lost += 1

    def _own_commands(self) -> None:
        """Commands of the plant link: the end of the run, services, and those left for the mission."""
        for c in self.frame.commands:
            key = (c.command, c.src_system, c.src_component)
            if c.command == CMD_SHUTDOWN and c.params[0] == 2.0:
                self.done = True
                continue
            self._link_asked.add(key)
            self._offer(c)
        self.frame.commands.clear()

    def _offer(self, c: Command) -> None:
        """Let the services answer a command, or the mission with the next tick."""
        if len(self._waiting) >= COMMANDS_MAX:
            self.services.count.excess += 1
        elif self.services.takes(c):
            self._waiting.append(c)

    def _from_ground(self, datagram: bytes) -> None:
        services = self.services
        if not services.left:  # enough for one tick: not even looked at
            self.unread_ground += 1
            return
        count = services.count
        torn = count.bad_crc + count.bad_length
        for c in services.receive(datagram, max(self.t_us, 0)):
            self._offer(c)
        self.unread_ground += services.used < len(datagram)
        self._hear(GROUND_IN, torn == count.bad_crc + count.bad_length, datagram[: services.used])

    def _run(self, new: bool, dt_s: float | None) -> None:
        """The tick itself."""
        f = self.frame
        before = self.t_us
        at = self.frames.raw + self.frames.offset
        if new:  # time never runs back: after frames that were too early it holds
            f.t_us = at if at > before else before
        else:  # real time only: it goes on by the step, for a while
            f.t_us = max(min(before + round((dt_s or 0.0) * 1e6), at + MAX_ALONE_US), before)
        self.dt_s = self.clock.advance(f.t_us) if dt_s is None else dt_s
        self.t_us = f.t_us
        self.exec.run(self.tick)
        self._last_reply = self.codec.send.join(self._said)
        self.services.left, self.codec.orders.left = PACKETS_MAX, COMMANDS_MAX
        self._ticked = True

    def _run_app(self) -> None:
        cmd, snap = self.app.tick(self.frame, self.dt_s)
        cmd.t_us = raw = self.frames.raw
        self._snap = snap
        self.telemetry.ctx.see(self.frame)
        codec = self.codec
        self._held = held = codec.actuators(cmd) if snap.commanded else codec.actuators_again(self._held, raw)
        self._said = [held]
        if self.services.orders:
            self._said += map(codec.order, self.services.take_orders())
        if self._link_asked:
            acks = [a for a in snap.acks + self.services.acks if self._asked_here(a)]
            self._link_asked.clear()
            self._said += map(self.codec.answer, acks)

    @property
    def excess(self) -> int:
        """Datagrams and packets dropped unread so far, both links."""
        return self.unread_plant + self.unread_ground + self.count.excess + self.services.count.excess

    def _asked_here(self, a: Ack) -> bool:
        return (a.command, a.target_system, a.target_component) in self._link_asked

    def _run_peer(self) -> None:
        if self._snap is not None:
            self._said.append(self.codec.peer(self._snap.nav, self._snap.health.flags))

    def _run_fix(self) -> None:
        if self._snap is None:
            return
        f = self._snap.sensors  # health has let through what is new in it
        self._gained.add(f)
        if f.updated & UPD_GNSS:
            self._said.append(self.codec.fix(f, self._gained.take()))
