"""The questions QGroundControl puts to a vehicle it meets, in its order, each with its own time-out and no repeat.

From its documented behaviour: heartbeat; AUTOPILOT_VERSION; the modes one by one; component metadata, newer and older form; all
parameters; plan, fence and rally points with their items. (docs/clients.md has the table.)
"""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass, field
from typing import Any

from flightsw.icd.dialect import VALUES
from flightsw.icd.wire import SPECS, Counters, Sender, split

TIMEOUT_S = 3.0  # [s] after which it would ask again: COMMAND_LONG 3 s, mission 1.5 s (5 of them), parameters 3 s
REQUEST = VALUES["MAV_CMD_REQUEST_MESSAGE"]
VERSION, MODES, METADATA, INFORMATION = 148, 435, 397, 395
UNSUPPORTED = VALUES["MAV_RESULT_UNSUPPORTED"]


@dataclass
class Met:
    """What it knows afterwards. `late`: questions that were not answered in time."""

    version: dict[str, Any] = field(default_factory=dict)
    modes: list[str] = field(default_factory=list)
    metadata: list[int] = field(default_factory=list)  # MAV_RESULT of the two forms
    parameters: dict[str, float] = field(default_factory=dict)
    count: int = 0
    plans: dict[int, list[dict[str, Any]]] = field(default_factory=dict)
    late: list[str] = field(default_factory=list)


class Station:
    """One ground station's socket to one aircraft's telemetry port."""

    def __init__(self, port: int, target: int) -> None:
        self.sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sock.connect(("127.0.0.1", port))
        self.send, self.target = Sender(255, 190), target
        self.met = Met()

    def ask(self, name: str, **fields: Any) -> None:
        """One packet to the aircraft."""
        to = {} if name == "HEARTBEAT" else {"target_system": self.target, "target_component": 1}
        self.sock.send(self.send.named(name, **to, **fields))

    def hear(self, what: str, *kinds: str, seconds: float = TIMEOUT_S, **match: Any) -> dict[str, Any] | None:
        """The next packet of one of the kinds with these fields; None, and noted as late, if none comes in time."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.sock.settimeout(left)
            try:
                datagram = self.sock.recv(65535)
            except TimeoutError:
                break
            found = None
            for spec, values, *_ in split(datagram, SPECS, Counters()):
                f = spec.to_dict(values)
                if spec.name == "PARAM_VALUE":
                    self.met.parameters[f["param_id"]], self.met.count = f["param_value"], f["param_count"]
                elif spec.name == "AUTOPILOT_VERSION":
                    self.met.version = f
                if found is None and spec.name in kinds and all(f[k] == v for k, v in match.items()):
                    found = f
            if found is not None:
                return found
        self.met.late.append(what)
        return None

    def message(self, ident: int, index: int = 0) -> int:
        """MAV_RESULT of asking for one message; -1: no answer."""
        self.ask("COMMAND_LONG", command=REQUEST, param1=float(ident), param2=float(index))
        ack = self.hear(f"message {ident}", "COMMAND_ACK", "AVAILABLE_MODES", **({} if index else {"command": REQUEST}))
        if ack is not None and "mode_name" in ack:
            self.met.modes.append(ack["mode_name"])
            return ack["number_modes"]
        return -1 if ack is None else ack["result"]

    def plan(self, kind: int) -> None:
        """Download one of the plans and say that it has come."""
        self.ask("MISSION_REQUEST_LIST", mission_type=kind)
        count = self.hear(f"count of plan {kind}", "MISSION_COUNT", mission_type=kind)
        items = []
        for seq in range(count["count"] if count else 0):
            self.ask("MISSION_REQUEST_INT", seq=seq, mission_type=kind)
            items.append(self.hear(f"item {seq} of plan {kind}", "MISSION_ITEM_INT", seq=seq) or {})
        self.met.plans[kind] = items
        self.ask("MISSION_ACK", mission_type=kind)

    def connect(self) -> Met:
        """The whole sequence."""
        self.ask("HEARTBEAT", type=6, autopilot=8)
        self.hear("heartbeat", "HEARTBEAT")
        self.message(VERSION)
        total, k = 1, 1
        while k <= total and not self.met.late:
            self.ask("COMMAND_LONG", command=REQUEST, param1=float(MODES), param2=float(k))
            mode = self.hear(f"mode {k}", "AVAILABLE_MODES", mode_index=k)
            total = mode["number_modes"] if mode else 0
            self.met.modes += [mode["mode_name"]] if mode else []
            k += 1
        self.met.metadata = [self.message(i) for i in (METADATA, INFORMATION)]
        self.ask("PARAM_REQUEST_LIST")
        while self.hear("parameters", "PARAM_VALUE") is not None and len(self.met.parameters) < self.met.count:
            pass
        for kind in (0, 1, 2):
            self.plan(kind)
        self.sock.close()
        return self.met
