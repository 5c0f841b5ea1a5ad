"""One onboard process without its sockets: datagrams in, datagrams out, no clock. The same object runs over UDP, in
process and in replay.

A tick has two halves, so that the reply leaves before anything else is done: `step` gives the reply, `after` the
telemetry. `handle` is both. Per tick, in this order: decode, services, application, reply (actuators, data link, acks);
then telemetry.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from flightsw.aircraft import load_airframe
from flightsw.clock import LockstepClock
from flightsw.config import FlightConfig
from flightsw.executive import Executive, no_time
from flightsw.icd.codec import FlightCodec
from flightsw.icd.tlog import GROUND_IN, LINK_IN
from flightsw.icd.wire import Counters
from flightsw.recorder import Heard
from flightsw.services import CMD_SHUTDOWN, MISSION_COMMANDS, Services
from flightsw.strict import ConfigError, to_dict
from flightsw.telemetry import Telemetry
from flightsw.types import HF_PEER, Ack, ActuatorCmd, Command, SensorFrame, Snapshot, Text

MAX_HEARD = 1000  # [datagram] kept for the log between two ticks
WARNING = 4  # MAV_SEVERITY


class App(Protocol):
    """What the node asks of the application."""

    def tick(self, frame: SensorFrame, dt_s: float) -> tuple[ActuatorCmd, Snapshot]:
        """One base tick."""


@dataclass(slots=True)
class NodeOutput:
    """Answer to one call of `handle`. An empty reply means: nothing to answer (rubbish, or no tick)."""

    reply: bytes = b""
    telemetry: list[bytes] = field(default_factory=list)
    done: bool = False


def make_app(cfg: FlightConfig) -> App:
    """The real application of a configuration. Raises ConfigError and the design errors of the control law."""
    from flightsw.app import FlightApp  # slow to import (numba, scipy): not before it is needed

    app = FlightApp(
        cfg.app.mission,
        cfg.app.aircraft,
        cfg.tables,
        base_rate_hz=cfg.app.base_rate_hz,
        mission_rate_hz=cfg.app.mission_rate_hz,
        link_delay_ticks=cfg.link.delay_ticks,
        where=f"flight configuration {cfg.app.name!r}",
    )
    if cfg.link.peer_sysid and not app.mission.may_watch & HF_PEER:
        raise ConfigError(
            f"link.peer_sysid = {cfg.link.peer_sysid}: mission {cfg.app.mission!r} listens to no other aircraft"
        )
    return app


class Node:
    """Flight process of one aircraft. `app` replaces the real application; `now_us` is the accounting clock of real
    time.
    """

    def __init__(
        self,
        cfg: FlightConfig,
        app: App | None = None,
        *,
        realtime: bool = False,
        now_us: Callable[[], int] = no_time,
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
        )
        self.telemetry = Telemetry(
            cfg.app.sysid, cfg.app.mission, origin, base, self.codec.count, cfg.telemetry.rates_hz
        )
        shown = {k: v for k, v in to_dict(cfg).items() if k not in ("link", "telemetry")}
        self.services = Services(
            cfg.app.sysid,
            shown,
            self.telemetry,
            getattr(self.app, "settable", None),
            getattr(self.app, "commands", MISSION_COMMANDS),
        )
        self.frame = SensorFrame()
        self.clock = LockstepClock(cfg.period_us)
        self.exec = Executive(now_us)
        self.exec.add("app", 1, 0, self._run_app)
        if cfg.link.broadcast_peer:
            self.exec.add("peer", max(1, base // cfg.link.peer_rate_hz), 0, self._run_peer)
        self.tick = 0
        self.t_us = -1  # [us] sample time of the last tick
        self.dt_s = 0.0
        self.done = False
        self.duplicates = 0
        self.heard: list[Heard] = []
        self.heard_lost = 0
        self.last_text = ""
        self._sensor_t_us = -1
        self._last_datagram = b""
        self._last_reply = b""
        self._ticked = False
        self._snap: Snapshot | None = None
        self._link_asked: set[tuple[int, int, int]] = set()

    @property
    def count(self) -> Counters:
        """What was dropped of the plant link."""
        return self.codec.count

    def handle(self, datagrams: Sequence[bytes], dt_s: float | None = None, ground: Sequence[bytes] = ()) -> NodeOutput:
        """One call: datagrams of the plant (lockstep: one tick's) and of the ground in, reply and telemetry out. Pure.

        `dt_s` [s]: time step for the application; None = difference of the sample times. Never raises on what it
        receives.
        """
        reply = self.step(datagrams, dt_s, ground)
        return NodeOutput(reply, self.after(), self.done)

    def step(self, datagrams: Sequence[bytes], dt_s: float | None = None, ground: Sequence[bytes] = ()) -> bytes:
        """First half: take the datagrams in, run the application if there is a tick, return the reply (b"" = none)."""
        f = self.frame
        if self._ticked:  # the frame of the last tick has been read by everyone
            self._ticked = False
            f.updated = 0
            f.commands.clear()
        new = again = False
        for d in datagrams:
            if d == self._last_datagram and d:
                self.duplicates += 1
                again = True
                continue
            t = self._take(d)
            if t == self._sensor_t_us >= 0:
                self.duplicates += 1
                again = True
            elif t > self._sensor_t_us:
                self._sensor_t_us = t
                self._last_datagram = d
                new = True
        asked = self._own_commands() if f.commands else []
        for d in ground:
            asked += self._from_ground(d)
        if not new and not (self.realtime and self._sensor_t_us >= 0):
            if asked:
                f.commands.extend(asked)  # they wait for the next tick
            return self._last_reply if again else b""
        f.commands[:] = asked
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
        due = tel.is_due(tick)
        if not (due or snap.texts or snap.acks or services.busy or tel.once):
            return []
        if due:
            ctx = tel.ctx
            self.exec.fill(ctx.timing)
            ctx.late_p999_us = self.exec.late_p999_us if self.realtime else 0.0
            if tick % self.cfg.app.base_rate_hz == 0 and (n := self.exec.new_slips()):
                snap.texts.append(Text(WARNING, f"loop slipped {n} periods"))
        acks = snap.acks + services.acks
        services.acks = []
        for t in snap.texts:
            self.last_text = t.text
        return tel.datagrams(snap, tick, snap.texts, acks, services.ready(due))

    def take_heard(self) -> list[Heard]:
        """Datagrams received since the last call, for the log: exact repeats of the last one left out."""
        out, self.heard = self.heard, []
        return out

    # --- inside ----------------------------------------------------------------------------------------------------

    def _take(self, datagram: bytes) -> int:
        """Decode one plant datagram into the frame. Its sample time; -1 = no sensor packet, -2 = refused."""
        count = self.codec.count
        torn = count.bad_crc + count.bad_length
        packets = self.codec.parse(datagram)
        sound = torn == count.bad_crc + count.bad_length
        t = self.codec.sensor_time(packets)
        if 0 <= t < self._sensor_t_us:  # time runs backwards
            count.out_of_order += 1
            self._hear(LINK_IN, sound, datagram)
            return -2
        if t == self._sensor_t_us and t >= 0:  # this tick again, in other bytes: answered, not taken
            return t
        self._hear(LINK_IN, sound, datagram)
        self.codec.apply(packets, self.frame)
        return t

    def _hear(self, link: int, sound: bool, datagram: bytes) -> None:
        if len(self.heard) < MAX_HEARD:
            self.heard.append((link, sound, datagram))
        else:
            self.heard_lost += 1

    def _own_commands(self) -> list[Command]:
        """Commands of the plant link: the end of the run, services, and those left for the mission."""
        out = []
        for c in self.frame.commands:
            key = (c.command, c.src_system, c.src_component)
            if c.command == CMD_SHUTDOWN and c.params[0] == 2.0:
                self.done = True
                continue
            self._link_asked.add(key)
            if self.services.takes(c):
                out.append(c)
        self.frame.commands.clear()
        return out

    def _from_ground(self, datagram: bytes) -> list[Command]:
        count = self.services.count
        torn = count.bad_crc + count.bad_length
        out = self.services.receive(datagram, max(self.t_us, 0))
        self._hear(GROUND_IN, torn == count.bad_crc + count.bad_length, datagram)
        return out

    def _run(self, new: bool, dt_s: float | None) -> None:
        """The tick itself."""
        f = self.frame
        before = self.t_us
        if dt_s is None:
            dt_s = self.clock.advance(self._sensor_t_us)
        # without a new frame (real time only) time goes on by the step, and never backwards
        f.t_us = max(self._sensor_t_us, before) if new else before + round(dt_s * 1e6)
        self.t_us = f.t_us
        self.dt_s = dt_s
        self.exec.run(self.tick)
        self._ticked = True

    def _run_app(self) -> None:
        cmd, snap = self.app.tick(self.frame, self.dt_s)
        cmd.t_us = self._sensor_t_us if self.realtime else self.t_us
        self._snap = snap
        self._last_reply = self.codec.actuators(cmd)
        if self._link_asked:
            acks = [a for a in snap.acks + self.services.acks if self._asked_here(a)]
            self._link_asked.clear()
            self._last_reply += b"".join(
                self.codec.ack(a.command, a.result, a.target_system, a.target_component) for a in acks
            )

    def _asked_here(self, a: Ack) -> bool:
        return (a.command, a.target_system, a.target_component) in self._link_asked

    def _run_peer(self) -> None:
        if self._snap is not None:
            self._last_reply += self.codec.peer(self._snap.nav)
