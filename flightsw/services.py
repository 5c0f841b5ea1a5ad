"""MAVLink manners: parameters, commands and their answers, message intervals, time synchronisation.

Commands of the mission pass through to the application, which answers them; the rest is answered here, an unknown one
with UNSUPPORTED. Nothing a ground station sends can raise. Packets are not signed: the links are local.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from flightsw.icd.wire import BY_NAME, SPECS, Counters, Packet, Sender, split, table
from flightsw.telemetry import Telemetry
from flightsw.types import Ack, Command

ACCEPT = table(
    (
        "HEARTBEAT",
        "SYSTEM_TIME",
        "PARAM_REQUEST_READ",
        "PARAM_REQUEST_LIST",
        "PARAM_SET",
        "COMMAND_LONG",
        "TIMESYNC",
        "REQUEST_DATA_STREAM",
    )
)
CMD_SHUTDOWN = 246
CMD_SET_INTERVAL = 511
CMD_REQUEST_MESSAGE = 512
CMD_CAPABILITIES = 520
MISSION_COMMANDS = frozenset({178, 191, 31010})  # passed to the application: speed, go around, user 1
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
PARAMS_PER_SLOT = 20  # answers to PARAM_REQUEST_LIST go down at this pace per telemetry tick
QUEUE_MAX = 2000  # [packet] beyond this, answers are dropped and counted
VERSION = (0, 1, 0, 0)
_CMD = BY_NAME["COMMAND_LONG"].pick(
    "target_system", "command", "confirmation", "param1", "param2", "param3", "param4", "param5", "param6", "param7"
)
_REAL32 = 9

Setter = Callable[[float], bool]


def flatten(tree: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Dotted key and value of every number in a tree of dicts and lists, in order."""
    if isinstance(tree, dict):
        for k, v in tree.items():
            yield from flatten(v, f"{prefix}.{k}" if prefix else k)
    elif isinstance(tree, (list, tuple)):
        for i, v in enumerate(tree):
            yield from flatten(v, f"{prefix}.{i}")
    elif isinstance(tree, (int, float)) and not isinstance(tree, bool):
        yield prefix, float(tree)


def short_names(keys: list[str]) -> list[str]:
    """A distinct name of at most 16 characters for each dotted key: its end, numbered if that is taken."""
    out: list[str] = []
    taken: set[str] = set()
    for key in keys:
        name = key
        while len(name) > 16 and "." in name:
            rest = name.split(".", 1)[1]
            if rest.isdigit():
                break
            name = rest
        name = name[:16]
        n = 2
        base = name
        while name in taken:
            tail = f"~{n}"
            name = base[: 16 - len(tail)] + tail
            n += 1
        taken.add(name)
        out.append(name)
    return out


class Services:
    """Ground-side services of one aircraft.

    `tree`: configuration shown as parameters; `settable`: dotted key -> setter that returns whether it took the value.
    `count` holds what was dropped of the ground's packets.
    """

    def __init__(
        self,
        sysid: int,
        tree: dict[str, Any],
        telemetry: Telemetry,
        settable: dict[str, Setter] | None = None,
        commands: frozenset[int] = MISSION_COMMANDS,
    ) -> None:
        self.sysid = sysid
        self.telemetry = telemetry
        self.send: Sender = telemetry.ctx.send
        self.count = Counters()
        self.settable = settable or {}
        self.commands = commands
        pairs = list(flatten(tree))
        self.keys = [k for k, _ in pairs]
        self.values = [v for _, v in pairs]
        self.names = short_names(self.keys)
        self._index = {n: i for i, n in enumerate(self.names)}
        self._list: deque[int] = deque()
        self._ready: deque[Callable[[], bytes]] = deque()
        self.overflow = 0
        self.acks: list[Ack] = []

    # --- receive ---------------------------------------------------------------------------------------------------

    def receive(self, datagram: bytes, t_us: int) -> list[Command]:
        """Handle one datagram from the ground at sample time `t_us` [us]; returns the mission's commands."""
        out: list[Command] = []
        for p in split(datagram, ACCEPT, self.count):
            name, v = p[0].name, p[1]
            if name == "COMMAND_LONG":
                c = self.command_of(p)
                if c is not None and self.takes(c):
                    out.append(c)
            elif name == "TIMESYNC":
                tc1, ts1 = v
                if tc1 == 0:
                    self._queue(partial(self.send.named, "TIMESYNC", tc1=t_us * 1000, ts1=ts1))
            elif name.startswith("PARAM_"):
                self._param(p[0].name, p[0].to_dict(v))
        return out

    def command_of(self, p: Packet) -> Command | None:
        """Command of a COMMAND_LONG packet, or None if it is for another aircraft."""
        target, command, confirmation, *params = _CMD(p[1])
        if target not in (0, self.sysid):
            return None
        return Command(command, tuple(params), p[2], p[3], confirmation)

    def takes(self, c: Command) -> bool:
        """True if the mission must answer `c`; otherwise it was answered here (see `acks`)."""
        if c.command in self.commands:
            return True
        self.acks.append(Ack(c.command, self._execute(c), c.src_system, c.src_component))
        return False

    def _execute(self, c: Command) -> int:
        """MAV_RESULT of a command of these services."""
        if c.command == CMD_CAPABILITIES:
            self._queue(self._version)
            return ACCEPTED
        if c.command == CMD_SHUTDOWN:  # the plant ends a run, nobody else
            return DENIED
        if c.command not in (CMD_REQUEST_MESSAGE, CMD_SET_INTERVAL):
            return UNSUPPORTED
        wanted = c.params[0]
        if not math.isfinite(wanted):
            return DENIED
        spec = SPECS.get(int(wanted))
        name = spec.name if spec else ""
        if c.command == CMD_REQUEST_MESSAGE:
            if name == "AUTOPILOT_VERSION":
                self._queue(self._version)
                return ACCEPTED
            if name not in self.telemetry.defaults:
                return UNSUPPORTED
            self.telemetry.once.append(name)
            return ACCEPTED
        if name not in self.telemetry.defaults:
            return UNSUPPORTED
        interval = c.params[1]
        if not math.isfinite(interval) or (interval < 0 and interval != -1):
            return DENIED
        if interval == 0:
            self.telemetry.set_rate(name, None)
        elif interval == -1:
            self.telemetry.set_rate(name, 0.0)
        else:
            rate = 1e6 / interval
            if rate > self.telemetry.base_hz * 1.001:
                return DENIED
            self.telemetry.set_rate(name, rate)
        return ACCEPTED

    def _param(self, kind: str, f: dict[str, Any]) -> None:
        if f["target_system"] not in (0, self.sysid):
            return
        if kind == "PARAM_REQUEST_LIST":
            self._list = deque(range(len(self.names)))
            return
        index = f.get("param_index", -1)
        if index < 0:
            index = self._index.get(f["param_id"], -1)
        if not 0 <= index < len(self.names):
            return
        if kind == "PARAM_SET":
            setter = self.settable.get(self.keys[index])
            value = f["param_value"]
            if setter is not None and math.isfinite(value) and setter(value):
                self.values[index] = value
        self._queue(lambda: self._value(index))  # the value in force: unchanged means refused

    # --- send ------------------------------------------------------------------------------------------------------

    def ready(self, slot: bool) -> list[bytes]:
        """Packets to send now. `slot`: this tick carries scheduled telemetry, the parameter list may go on."""
        out = [make() for make in self._ready]
        self._ready.clear()
        if slot and self._list:
            out += [self._value(self._list.popleft()) for _ in range(min(PARAMS_PER_SLOT, len(self._list)))]
        return out

    @property
    def busy(self) -> bool:
        """True if an answer waits."""
        return bool(self._ready or self._list or self.acks)

    def _queue(self, make: Callable[[], bytes]) -> None:
        if len(self._ready) >= QUEUE_MAX:
            self.overflow += 1
            return
        self._ready.append(make)

    def _value(self, i: int) -> bytes:
        # a value beyond the range of the wire's float has no business as a parameter: hold it at the limit
        value = max(-3.4e38, min(3.4e38, self.values[i]))
        return self.send.named(
            "PARAM_VALUE",
            param_id=self.names[i],
            param_value=value,
            param_type=_REAL32,
            param_count=len(self.names),
            param_index=i,
        )

    def _version(self) -> bytes:
        a, b, c, d = VERSION
        return self.send.named(
            "AUTOPILOT_VERSION", capabilities=2 | 8192, flight_sw_version=a << 24 | b << 16 | c << 8 | d, uid=self.sysid
        )
