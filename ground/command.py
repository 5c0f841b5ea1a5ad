"""`ground send`: one command to an aircraft, answered truthfully or reported unanswered, in bounded time.

COMMAND_LONG goes to the aircraft's telemetry socket from an ephemeral port, so that several ground stations do not
disturb each other; it is repeated with a rising confirmation counter until a COMMAND_ACK for it comes back
(MAVLink command protocol, mavlink.io).
"""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass

from flightsw.icd import mav
from flightsw.icd.link import plant_command_port, telemetry_port
from flightsw.icd.scaling import COMP_AUTOPILOT, COMP_PLANT
from flightsw.icd.wire import Sender
from ground.packets import AIRCRAFT, IDS, RECEIVER, TANKER, decode, packet_id, split

GROUND_SYSID, GROUND_COMPID = 255, 190
CMD_ACTION, CMD_SPEED, CMD_GO_AROUND = 31010, 178, 191  # MAV_CMD_USER_1, _DO_CHANGE_SPEED, _DO_GO_AROUND
RETRY_S = 0.7  # [s] wall time before a repeat
ATTEMPTS = 4
IN_PROGRESS = 5  # MAV_RESULT: begun, a final answer follows
PROGRESS_S = 5.0  # [s] how long to wait for that final answer
ACTIONS: dict[str, int] = {
    e.name.removeprefix("WKF_ACTION_").lower(): v
    for v, e in mav.enums["WKF_ACTION"].items()
    if not e.name.endswith("ENUM_END")
}


def _laws(enum: str) -> dict[str, int]:
    found = mav.enums[enum].items()
    return {e.name.removeprefix(enum + "_").lower(): v for v, e in found if not e.name.endswith("ENUM_END")}


LAWS = _laws("WKF_GUST_LAW")
GO_AROUND, JET = "go-around", 5  # of the windshear mission; its usual system id
ESCAPE_LAWS = _laws("WKF_WS_LAW")


class CommandError(Exception):
    """The command cannot be formed; the message names the argument and what is allowed."""


@dataclass(frozen=True)
class Order:
    """What to send: target system, MAV_CMD, param1..param7; component COMP_PLANT: to the plant, not to the aircraft."""

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
        laws = ESCAPE_LAWS if to == JET else LAWS
        known = ", ".join(f"{v} {n}" for n, v in laws.items())
        if value not in laws.values() or to is None:
            raise CommandError(f"law needs a number ({known}) and an aircraft, for example: ground send law 0 --to 3")
        name = next(n for n, v in laws.items() if v == value)
        return Order(to, CMD_ACTION, (float(laws[name]),) + (0.0,) * 6, f"law {name}")
    if action not in ACTIONS and action != GO_AROUND:
        words = [*ACTIONS, "speed", "law", GO_AROUND, "inject"]
        raise CommandError(f"unknown action {action!r}; known: {', '.join(words)}")
    if value is not None:
        raise CommandError(f"action {action!r} takes no value, got {value:g}")
    if action == GO_AROUND:
        return Order(JET if to is None else to, CMD_GO_AROUND, (0.0,) * 7, action)
    target = RECEIVER if to is None else to
    return Order(target, CMD_ACTION, (float(ACTIONS[action]),) + (0.0,) * 6, action)


def result_name(result: int) -> str:
    """MAV_RESULT as a word."""
    entry = mav.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"result {result}"


def _ack(sock: socket.socket, what: Order, until: float) -> int | None:
    """MAV_RESULT of the first matching COMMAND_ACK before `until` (monotonic s), None if none came."""
    while (left := until - time.monotonic()) > 0.0:
        sock.settimeout(left)
        try:
            datagram = sock.recv(65536)
        except TimeoutError:
            return None
        except ConnectionError:  # nobody bound there (ICMP); keep trying until the time is up
            time.sleep(min(0.05, max(left, 0.0)))
            continue
        for packet, fault in split(datagram):
            if fault or packet_id(packet) != IDS["COMMAND_ACK"]:
                continue
            if packet[6] != COMP_PLANT if what.component == COMP_PLANT else packet[5] != what.target:
                continue
            fields = decode(packet)
            if fields["command"] == what.command and fields["target_system"] in (0, GROUND_SYSID):
                return int(fields["result"])
    return None


def send(
    what: Order,
    port_offset: int = 0,
    host: str = "127.0.0.1",
    port: int | None = None,
    retry_s: float = RETRY_S,
    attempts: int = ATTEMPTS,
) -> Answer:
    """Send and wait, at most attempts * retry_s (longer if the aircraft says IN_PROGRESS)."""
    name = f"{AIRCRAFT.get(what.target, 'aircraft')} (sysid {what.target})"
    usual = telemetry_port(what.target, port_offset)
    if what.component == COMP_PLANT:
        name, usual = f"the plant for {name}", plant_command_port(port_offset)
    address = (host, usual if port is None else port)
    sender = Sender(GROUND_SYSID, GROUND_COMPID)
    params = {f"param{i + 1}": p for i, p in enumerate(what.params)}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.connect(address)
        for attempt in range(attempts):
            packet = sender.named(
                "COMMAND_LONG",
                target_system=what.target,
                target_component=what.component,
                command=what.command,
                confirmation=attempt,
                **params,
            )
            until = time.monotonic() + retry_s
            try:
                sock.send(packet)
            except ConnectionError:
                pass  # the refusal belongs to the packet before; the wait below paces the repeats
            result = _ack(sock, what, until)
            if result == IN_PROGRESS:
                final = _ack(sock, what, time.monotonic() + PROGRESS_S)
                result = result if final is None else final
            if result is not None:
                word = "accepted" if result in (0, IN_PROGRESS) else "refused"
                return Answer(result, f"{what.text}: {word} by {name}: {result_name(result)}")
    return Answer(None, f"{what.text}: no answer from {name} at UDP {address[0]}:{address[1]} ({attempts} attempts)")
