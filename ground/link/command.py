"""`ground send`: one command to an aircraft, answered truthfully or reported unanswered, in bounded time.

The aircraft is asked first which mission it flies (AUTOPILOT_VERSION): a command that belongs to another is refused here, by
name. Then COMMAND_LONG goes to its telemetry socket from an ephemeral port, so that several ground stations do not disturb
each other; it is repeated with a rising confirmation counter until a COMMAND_ACK for it comes back (MAVLink command protocol,
mavlink.io). A refusal is printed with the STATUSTEXT the COMMAND_ACK names.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flightsw.icd.dialect import HOUSE, VALUES
from flightsw.icd.link import plant_command_port, telemetry_port
from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT
from flightsw.icd.signing import OPEN, STATION, Security, Signing, heard
from flightsw.icd.texts import Joiner
from flightsw.icd.wire import Sender
from flightsw.plugins import VIEWS
from flightsw.strict import ConfigError
from ground.link.packets import IDS, decode, packet_id, split
from ground.views import registry
from ground.views.base import Command

GROUND_SYSID, GROUND_COMPID = 255, 190
CMD_REQUEST_MESSAGE: int = VALUES["MAV_CMD_REQUEST_MESSAGE"]
RETRY_S = 0.7  # [s] wall time before a repeat
ATTEMPTS = 4
IN_PROGRESS = 5  # MAV_RESULT: begun, a final answer follows
RESERVED = ("inject", "list", "pause", "resume", "step", "pace")  # words of `ground send` that are of no mission
UNSUPPORTED: int = VALUES["MAV_RESULT_UNSUPPORTED"]
PROGRESS_S = 5.0  # [s] how long to wait for that final answer
DATAGRAM = 65536  # [byte]


MISSIONS = HOUSE.words("WKF_MISSION")


class CommandError(Exception):
    """The command cannot be formed; the message names the argument and what is allowed."""


@dataclass(frozen=True)
class Order:
    """What to send: target system, MAV_CMD (0: what `word` is in the mission it flies), param1..param7, the word and number they
    were made of; component COMP_PLANT: to the plant, not to the aircraft."""

    target: int
    command: int
    params: tuple[float, ...]
    text: str
    component: int = COMP_AUTOPILOT
    word: str = ""
    value: float | None = None


@dataclass(frozen=True)
class Answer:
    """Outcome: `result` is a MAV_RESULT, None if nobody answered."""

    result: int | None
    text: str

    @property
    def exit_code(self) -> int:
        """0 accepted, 1 refused, 2 unanswered."""
        return 2 if self.result is None else 0 if self.result in (0, IN_PROGRESS) else 1


def offered() -> dict[str, list[Command]]:
    """Word -> the commands that views offer by it. Raises ConfigError for a view that offers one of `ground send` itself."""
    out: dict[str, list[Command]] = {}
    for name, view in registry.views().items():
        for command in view.commands:
            if command.word in RESERVED:
                raise ConfigError(f"{VIEWS} = {name!r}: command {command.word!r} is one of `ground send` itself")
            out.setdefault(command.word, []).append(command)
    return out


def order(action: str, value: float | None, to: int | None) -> Order:
    """The command for a word of some view. Several missions may have it: then the Order is for `fit` to complete, by what the
    aircraft flies. Raises CommandError."""
    known = offered()
    if action not in known:
        raise CommandError(f"unknown action {action!r}; known: {', '.join([*known, 'inject'])}")
    choice = known[action]
    usual = {c.to for c in choice}
    if value is not None and all(c.value is None for c in choice):
        raise CommandError(f"action {action!r} takes no value, got {value:g}")
    target = to if to is not None else usual.pop() if len(usual) == 1 else None
    if target is None or not any(_takes(c, value) for c in choice):
        raise CommandError(f"{action} needs {_needs(choice)}, for example: {_example(choice[0])}")
    if len(choice) > 1:
        return Order(target, 0, (), action if value is None else f"{action} {value:g}", word=action, value=value)
    return _filled(choice[0], target, value)


def listing() -> list[str]:
    """A line for every word: whose it is, the number it needs, where it goes if no aircraft is named."""
    out = []
    for word, choice in offered().items():
        for c in choice:
            number = "" if c.value is None else f" {_listed(c.value.choices) or c.value.unit};"
            to = "name an aircraft" if c.to is None else f"usual sysid {c.to}"
            out.append(f"{word}: {', '.join(c.missions)};{number} {to}")
    return out


def _takes(c: Command, value: float | None) -> bool:
    """Whether a command can be given with this number."""
    if c.value is None or value is None:
        return c.value is None and value is None
    return value in c.value.choices if c.value.choices else value > 0.0


def _needs(choice: list[Command]) -> str:
    """What a word needs, in words."""
    value, parts = next((c.value for c in choice if c.value is not None), None), []
    if value is not None and value.choices:
        listed = (f"{c.missions[0]}: {_listed(c.value.choices)}" for c in choice if c.value is not None)
        parts.append(f"a number ({'; '.join(listed)})")
    elif value is not None:
        parts.append(f"a value in {value.unit} greater than 0")
    if len({c.to for c in choice}) > 1 or choice[0].to is None:
        parts.append("an aircraft")
    return " and ".join(parts)


def _example(c: Command) -> str:
    value = "" if c.value is None else f" {c.value.example:g}"
    return f"ground send {c.word}{value} --to {c.to or 3}"


def _listed(choices: Mapping[int, str]) -> str:
    return ", ".join(f"{v} {n}" for v, n in choices.items())


def _filled(c: Command, target: int, value: float | None) -> Order:
    """A command with its number in place."""
    params, text = list(c.params), c.word
    if c.value is not None and value is not None:
        params[c.value.at] = value
        text += f" {c.value.choices[int(value)]}" if c.value.choices else f" {value:g} {c.value.unit}"
    return Order(target, c.command, tuple(params), text, word=c.word, value=value)


def result_name(result: int) -> str:
    """MAV_RESULT as a word."""
    word = HOUSE.words("MAV_RESULT").get(result)
    return word.upper() if word else f"result {result}"


def fit(what: Order, mission: str | None) -> tuple[Order, str]:
    """The order as `mission` takes it, and ""; or why it does not. mission None: the aircraft has not said."""
    if what.component != COMP_AUTOPILOT:
        return what, ""
    choice = offered().get(what.word, [])
    owners = [m for c in choice for m in c.missions]
    if mission is None and len(choice) == 1:
        return what, ""
    if mission not in owners:
        flies = f"flies {mission}" if mission else "does not say what it flies"
        return what, f"{what.text}: of {', '.join(owners)}; this aircraft {flies}"
    own = next(c for c in choice if mission in c.missions)
    if not _takes(own, what.value):
        return what, f"{what.text}: {mission} has {_listed(own.value.choices) if own.value else 'no number'}"
    return _filled(own, what.target, what.value), ""


@dataclass
class _Ask:
    """One question and what came back."""

    result: int | None = None
    reason: str = ""
    version: dict[str, Any] | None = None


class _Line:
    """A connected socket to one component, with its texts put together."""

    def __init__(self, sock: socket.socket, system: int, component: int, signing: Signing | None = None) -> None:
        self.signing = signing
        self.sock, self.system, self.component = sock, system, component
        self._sender = Sender(GROUND_SYSID, GROUND_COMPID)
        self._joiner = Joiner()
        self._texts: dict[int, str] = {}  # by id

    def _packets(self, until: float) -> Iterator[tuple[str, dict[str, Any], str]]:
        """(message, fields, last text of the datagram) of every packet of the system that arrives before `until`."""
        while (left := until - time.monotonic()) > 0.0:
            self.sock.settimeout(left)
            try:
                datagram = self.sock.recv(DATAGRAM)
            except TimeoutError:
                return
            except ConnectionError:  # nobody bound there (ICMP); keep trying until the time is up
                time.sleep(min(0.05, max(left, 0.0)))
                continue
            said = ""
            datagram = heard(datagram, self.signing)
            for packet, fault in split(datagram):
                if fault or (self.system and packet[5] != self.system) or packet[6] != self.component:
                    continue
                kind = packet_id(packet)
                if kind not in WANTED:
                    continue
                f = decode(packet)
                if kind == IDS["STATUSTEXT"]:
                    line = self._joiner.take(packet[5], packet[6], f["text"], f["id"], f["chunk_seq"])
                    if line is not None:
                        said = self._texts[f["id"]] = line
                yield WANTED[kind], f, said

    def ask(self, command: int, params: tuple[float, ...], attempts: int, retry_s: float) -> _Ask:
        """Send a command until it is answered. AUTOPILOT_VERSION that was asked for counts as the answer, its own is not."""
        out = _Ask()
        wants = command == CMD_REQUEST_MESSAGE

        def answered() -> bool:
            return out.version is not None or (out.result is not None and not (wants and out.result == 0))

        for attempt in range(attempts):
            packet = self._sender.named(
                "COMMAND_LONG",
                target_system=self.system,
                target_component=self.component,
                command=command,
                confirmation=attempt,
                **{f"param{i + 1}": p for i, p in enumerate(params)},
            )
            try:
                self.sock.send(packet if self.signing is None else self.signing.sign(packet))
            except ConnectionError:
                pass  # the refusal belongs to the packet before; the wait below paces the repeats
            self._hear(out, command, time.monotonic() + retry_s, answered)
            if out.result == IN_PROGRESS:
                self._hear(out, command, time.monotonic() + PROGRESS_S, lambda: out.result != IN_PROGRESS)
            if answered():
                break
        return out

    def _hear(self, out: _Ask, command: int, until: float, done: Callable[[], bool]) -> None:
        for name, f, said in self._packets(until):
            if name == "AUTOPILOT_VERSION":
                out.version = f
            elif name == "COMMAND_ACK" and f["command"] == command and f["target_system"] in (0, GROUND_SYSID):
                out.result = int(f["result"])
                # an aircraft that does not name the text has said it in the same breath
                out.reason = self._texts.get(f["result_param2"], "") if f["result_param2"] else said
            if done():
                return


WANTED = {IDS[n]: n for n in ("COMMAND_ACK", "STATUSTEXT", "AUTOPILOT_VERSION")}


def send(
    what: Order,
    port_offset: int = 0,
    host: str = "127.0.0.1",
    port: int | None = None,
    retry_s: float = RETRY_S,
    attempts: int = ATTEMPTS,
    security: Security = OPEN,
) -> Answer:
    """Send and wait, at most attempts * retry_s for each of two questions (longer if the aircraft says IN_PROGRESS)."""
    name = f"{registry.usual_names().get(what.target, 'aircraft')} (sysid {what.target})"
    usual = telemetry_port(what.target, port_offset)
    if what.component == COMP_PLANT:
        name, usual = f"the plant for {name}", plant_command_port(port_offset)
    address = (host, usual if port is None else port)
    silent = f"{what.text}: no answer from {name} at UDP {address[0]}:{address[1]} ({attempts} attempts)"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.connect(address)
        line = _Line(sock, what.target, what.component, security.link(STATION))
        if what.component == COMP_AUTOPILOT:
            said = line.ask(CMD_REQUEST_MESSAGE, (float(IDS["AUTOPILOT_VERSION"]),), attempts, retry_s)
            if said.result is None and said.version is None:
                return Answer(None, silent)
            told = said.version if said.version is not None and not said.version["vendor_id"] else None
            mission = MISSIONS.get(told["product_id"]) if told else None
            what, why = fit(what, mission)
            if why:
                return Answer(UNSUPPORTED, f"{why}: not sent to {name}")
        got = line.ask(what.command, what.params, attempts, retry_s)
    if got.result is None:
        return Answer(None, silent)
    text = f"{what.text}: {'accepted' if got.result in (0, IN_PROGRESS) else 'refused'} by {name}: {result_name(got.result)}"
    refused = got.result not in (0, IN_PROGRESS)
    return Answer(got.result, f"{text}: {got.reason}" if refused and got.reason else text)
