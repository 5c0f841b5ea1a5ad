"""The plant's command desk: COMMAND_LONG of the ground to the plant, its COMMAND_ACK with the reason of a refusal, and the
record of all. A COMMAND_INT is answered too: it cannot carry values in SI where it has integers.

What was ordered, from the ground or by the scenario, goes to plant.tlog in the run folder, each under the tick at which it
takes effect (or was refused): COMMAND_LONG, COMMAND_ACK, STATUSTEXT in words. Without such commands there is no file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT, STATIONS
from flightsw.icd.texts import CHUNK, answer, text
from flightsw.icd.tlog import TlogWriter
from flightsw.icd.wire import BY_NAME, Counters, Sender, split, table
from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED, Ack, Command
from sim_plant.failures.orders import Injected
from sim_plant.failures.script import CMD_INJECT_FAILURE
from sim_plant.pace import CMD_PACE, Pace
from sim_plant.world import World

_ACCEPT = table(("COMMAND_LONG", "COMMAND_INT"))
_PARAMS = tuple(f"param{i}" for i in range(1, 8))
_TO = ("target_system", "target_component", "command")
_LONG = BY_NAME["COMMAND_LONG"].pick(*_TO, "confirmation", *_PARAMS)
_COMMAND_INT = BY_NAME["COMMAND_INT"]
_INT = _COMMAND_INT.pick(*_TO)
LONG_ONLY = 7  # MAV_RESULT_COMMAND_LONG_ONLY
COMMANDS_MAX = 16  # dealt with in one tick
SEVERITY_WARNING, SEVERITY_NOTICE = 4, 5
SENDERS_MAX = 16  # whose last command is remembered
LOG_NAME = "plant.tlog"


class CommandDesk:
    """Takes commands for the aircraft of `world`; `notes` receives a line for the operator per command. Raises TlogError
    naming the file if the record cannot be written to `folder` (None: no record)."""

    def __init__(self, world: World, notes: list[str], folder: Path | None) -> None:
        self._world, self._notes, self._folder = world, notes, folder
        self._sysids = [m.cfg.sysid for m in world.members]
        self.pace = Pace(world.rate_hz)
        self.count = Counters()
        self.strangers = 0  # commands of systems that are no ground station, refused
        self.unread = 0  # datagrams and commands dropped; whoever tells the operator sets it back
        self._left = COMMANDS_MAX
        self._senders = {s: Sender(s, COMP_PLANT) for s in self._sysids}
        self._logged = {s: Sender(s, COMP_PLANT) for s in self._sysids}
        self._orders: dict[tuple[int, int], Sender] = {}
        self._done: dict[tuple[int, int], tuple[Any, list[tuple[int, Ack]]]] = {}  # last command of each sender
        self._log: TlogWriter | None = None

    def take(self, datagram: bytes, trusted: bool = False) -> list[bytes]:
        """Carry out the commands of a datagram; the COMMAND_ACK packets to send back, each with its reason, one per aircraft
        concerned. A tick has time for COMMANDS_MAX of them. trusted: an aircraft handed them on, and has seen who gave them; else
        the sender must be a ground station (STATIONS).

        A command for no aircraft of the run, or for a component that is not here, is none of ours: no answer. A repeat
        (confirmation above 0, the rest as before) is answered again and not carried out again.
        """
        out: list[bytes] = []
        if not self._left:
            self.unread += 1
            return out
        packets = split(datagram, _ACCEPT, self.count, self._left)
        self._left -= len(packets)
        self.unread += not self._left and packets[-1][5] < len(datagram)
        for spec, values, sysid, compid, _, _ in packets:
            integers = spec is _COMMAND_INT
            target, component, command, confirmation, *params = (*_INT(values), 0) if integers else _LONG(values)
            if component not in (0, COMP_AUTOPILOT, COMP_PLANT):
                continue
            concerned = [i for i, s in enumerate(self._sysids) if target in (0, s)]
            if not concerned:
                self._notes.append(f"command {command} for sysid {target}: no such aircraft in this run")
                continue
            if command == CMD_PACE:  # of the whole run, whoever it is sent for
                del concerned[1:]
            # NaN is unequal to itself: compare what was sent, not what it means
            key, sender = (target, command, repr(params)), (sysid, compid)
            before = self._done.get(sender)
            if not trusted and not STATIONS[0] <= sysid <= STATIONS[1]:
                self.strangers += 1
                why = f"system {sysid} is no ground station"
                answers = [(self._sysids[i], Ack(command, DENIED, *sender, why)) for i in concerned]
            elif confirmation and before is not None and before[0] == key:
                answers = before[1]
            elif integers:
                result = LONG_ONLY if command == CMD_INJECT_FAILURE else UNSUPPORTED
                why = f"command {command} as COMMAND_INT: the plant takes COMMAND_LONG"
                answers = [(self._sysids[i], Ack(command, result, *sender, why)) for i in concerned]
            else:
                cmd = Command(command, tuple(params), sysid, compid, confirmation)
                answers = [(self._sysids[i], self._carry_out(i, cmd)) for i in concerned]
                if sender not in self._done and len(self._done) >= SENDERS_MAX:
                    del self._done[next(iter(self._done))]
                self._done[sender] = (key, answers)
            out += [answer(self._senders[s], a) for s, a in answers]
        return out

    def _carry_out(self, i: int, cmd: Command) -> Ack:
        if cmd.command == CMD_PACE:
            result, why = self.pace.order(cmd.params)
            if result == ACCEPTED and not self.pace.stepping:
                self._notes.append(f"pace: {self.pace.words or 'flat out'}")
            return Ack(cmd.command, result, cmd.src_system, cmd.src_component, why)
        verdict = self._world.command(i, cmd).verdict
        why = "" if verdict.result == ACCEPTED else verdict.text
        return Ack(cmd.command, verdict.result, cmd.src_system, cmd.src_component, why)

    def record(self) -> None:
        """Write down what was ordered since the last call: a new tick begins."""
        self._left = COMMANDS_MAX
        if not self._world.injected:
            return
        for r in self._world.injected:
            self._write(r)
        self._world.injected.clear()

    def _write(self, r: Injected) -> None:
        t_us = r.tick * 1_000_000 // self._world.rate_hz
        name, sysid, c = self._world.members[r.i].cfg.name, self._sysids[r.i], r.command
        accepted = r.verdict.result == ACCEPTED
        word = "done" if accepted else f"refused, result {r.verdict.result}"
        if not (r.scripted and accepted):
            self._notes.append(f"{name}: {r.verdict.text}: {word} at t = {t_us / 1e6:.2f} s (tick {r.tick})")
        if self._folder is None:
            return
        if self._log is None:
            self._log = TlogWriter(self._folder / LOG_NAME)
        key = (c.src_system, c.src_component)
        ground = self._orders.setdefault(key, Sender(*key))
        fields = dict(zip(_PARAMS, c.params, strict=True))
        self._log.write(
            t_us,
            ground.named(
                "COMMAND_LONG",
                target_system=sysid,
                target_component=COMP_PLANT,
                command=c.command,
                confirmation=c.confirmation,
                **fields,
            ),
        )
        plant = self._logged[sysid]
        self._log.write(t_us, answer(plant, Ack(c.command, r.verdict.result, *key)))
        words = (r.verdict.text if accepted else f"refused: {r.verdict.text}")[:CHUNK]
        self._log.write(t_us, text(plant, SEVERITY_WARNING if accepted else SEVERITY_NOTICE, words))

    def close(self) -> None:
        """Write down what is left and close the record. Raises TlogError if the disk refuses."""
        self.record()
        if self._log is not None:
            self._log.close()
