"""`ground send`: one command to an aircraft, answered truthfully or reported unanswered, in bounded time.

The aircraft is asked first which mission it flies (AUTOPILOT_VERSION): a command that belongs to another is refused here, by
name. Then COMMAND_LONG goes to its telemetry socket from an ephemeral port, so that several ground stations do not disturb
each other; it is repeated with a rising confirmation counter until a COMMAND_ACK for it comes back (MAVLink command protocol,
mavlink.io). A refusal is printed with the STATUSTEXT the COMMAND_ACK names.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.icd.link import plant_command_port, telemetry_port
from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT
from flightsw.icd.texts import Joiner
from flightsw.icd.wire import Sender
from ground.link.packets import AIRCRAFT, IDS, RECEIVER, TANKER, decode, packet_id, split

GROUND_SYSID, GROUND_COMPID = 255, 190
CMD_REFUEL: int = VALUES["MAV_CMD_USER_1"]
CMD_GUST_LAW: int = VALUES["MAV_CMD_USER_2"]
CMD_ESCAPE_LAW: int = VALUES["MAV_CMD_USER_3"]
CMD_SPEED: int = VALUES["MAV_CMD_DO_CHANGE_SPEED"]
CMD_GO_AROUND: int = VALUES["MAV_CMD_DO_GO_AROUND"]
CMD_REQUEST_MESSAGE: int = VALUES["MAV_CMD_REQUEST_MESSAGE"]
RETRY_S = 0.7  # [s] wall time before a repeat
ATTEMPTS = 4
IN_PROGRESS = 5  # MAV_RESULT: begun, a final answer follows
UNSUPPORTED: int = VALUES["MAV_RESULT_UNSUPPORTED"]
PROGRESS_S = 5.0  # [s] how long to wait for that final answer
DATAGRAM = 65536  # [byte]


def _words(enum: str) -> dict[str, int]:
    """Lower-case word -> value of an enumeration of the dialect."""
    found = ENUMS[enum].items()
    return {e.name.removeprefix(enum + "_").lower(): v for v, e in found}


ACTIONS, LAWS, ESCAPE_LAWS = _words("WKF_ACTION"), _words("WKF_GUST_LAW"), _words("WKF_WS_LAW")
MISSIONS = {v: name for name, v in _words("WKF_MISSION").items()}
# the missions whose command it is (message ICD, WKF_MISSION)
OWNERS: dict[int, tuple[str, ...]] = {
    CMD_REFUEL: ("receiver", "receiver_rendezvous"),
    CMD_SPEED: ("tanker", "rendezvous"),
    CMD_GUST_LAW: ("gust",),
    CMD_ESCAPE_LAW: ("windshear",),
    CMD_GO_AROUND: ("windshear",),
}
LAW_COMMANDS = {"gust": (CMD_GUST_LAW, LAWS), "windshear": (CMD_ESCAPE_LAW, ESCAPE_LAWS)}
GO_AROUND, JET = "go-around", 5  # of the windshear mission; its usual system id


class CommandError(Exception):
    """The command cannot be formed; the message names the argument and what is allowed."""


@dataclass(frozen=True)
class Order:
    """What to send: target system, MAV_CMD (0: the law of whatever mission it flies), param1..param7; component COMP_PLANT:
    to the plant, not to the aircraft."""

    target: int
    command: int
    params: tuple[float, ...]
    text: str
    component: int = COMP_AUTOPILOT


@dataclass(frozen=True)
class Answer:
    """Outcome: `result` is a MAV_RESULT, None if nobody answered."""

    result: int | None
    text: str

    @property
    def exit_code(self) -> int:
        """0 accepted, 1 refused, 2 unanswered."""
        return 2 if self.result is None else 0 if self.result in (0, IN_PROGRESS) else 1


def order(action: str, value: float | None, to: int | None) -> Order:
    """The command for an action word; speed [m/s] needs a value. Raises CommandError."""
    if action == "speed":
        target = TANKER if to is None else to
        if value is None or not value > 0.0:
            raise CommandError("speed needs a value in m/s greater than 0, for example: ground send speed 195 --to 1")
        return Order(target, CMD_SPEED, (0.0, value, -1.0, 0.0, 0.0, 0.0, 0.0), f"speed {value:g} m/s")
    if action == "law":
        known = "; ".join(f"{m}: {_listed(laws)}" for m, (_, laws) in LAW_COMMANDS.items())
        numbers = {v for _, laws in LAW_COMMANDS.values() for v in laws.values()}
        if value not in numbers or to is None:
            raise CommandError(f"law needs a number ({known}) and an aircraft, for example: ground send law 0 --to 3")
        return Order(to, 0, (value,) + (0.0,) * 6, f"law {value:g}")
    if action not in ACTIONS and action != GO_AROUND:
        words = [*ACTIONS, "speed", "law", GO_AROUND, "inject"]
        raise CommandError(f"unknown action {action!r}; known: {', '.join(words)}")
    if value is not None:
        raise CommandError(f"action {action!r} takes no value, got {value:g}")
    if action == GO_AROUND:
        return Order(JET if to is None else to, CMD_GO_AROUND, (0.0,) * 7, action)
    target = RECEIVER if to is None else to
    return Order(target, CMD_REFUEL, (float(ACTIONS[action]),) + (0.0,) * 6, action)


def _listed(words: dict[str, int]) -> str:
    return ", ".join(f"{v} {n}" for n, v in words.items())


def result_name(result: int) -> str:
    """MAV_RESULT as a word."""
    entry = ENUMS["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"result {result}"


def fit(what: Order, mission: str | None) -> tuple[Order, str]:
    """The order as `mission` takes it, and ""; or why it does not. mission None: the aircraft has not said."""
    if what.command == 0:
        if mission is None or mission not in LAW_COMMANDS:
            flies = f"flies {mission}" if mission else "does not say what it flies"
            return what, f"{what.text}: of {', '.join(LAW_COMMANDS)}; this aircraft {flies}"
        command, laws = LAW_COMMANDS[mission]
        name = next((n for n, v in laws.items() if v == what.params[0]), "")
        if not name:
            return what, f"{what.text}: {mission} has {_listed(laws)}"
        return replace(what, command=command, text=f"law {name}"), ""
    owners = OWNERS.get(what.command, ())
    if what.component == COMP_AUTOPILOT and mission is not None and mission not in owners:
        return what, f"{what.text}: of {', '.join(owners)}; this aircraft flies {mission}"
    return what, ""


@dataclass
class _Ask:
    """One question and what came back."""

    result: int | None = None
    reason: str = ""
    version: dict[str, Any] | None = None


class _Line:
    """A connected socket to one component, with its texts put together."""

    def __init__(self, sock: socket.socket, system: int, component: int) -> None:
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
            for packet, fault in split(datagram):
                if fault or packet[5] != self.system or packet[6] != self.component:
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
                self.sock.send(packet)
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
) -> Answer:
    """Send and wait, at most attempts * retry_s for each of two questions (longer if the aircraft says IN_PROGRESS)."""
    name = f"{AIRCRAFT.get(what.target, 'aircraft')} (sysid {what.target})"
    usual = telemetry_port(what.target, port_offset)
    if what.component == COMP_PLANT:
        name, usual = f"the plant for {name}", plant_command_port(port_offset)
    address = (host, usual if port is None else port)
    silent = f"{what.text}: no answer from {name} at UDP {address[0]}:{address[1]} ({attempts} attempts)"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.connect(address)
        line = _Line(sock, what.target, what.component)
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
