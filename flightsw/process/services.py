"""MAVLink manners: parameters, commands and their answers, message intervals, time synchronisation.

Commands of the mission pass through to the application, which answers them; the rest is answered here, those of another
mission and unknown ones with UNSUPPORTED, and every refusal says why. Nothing a ground station sends can raise, and what it
sends costs no tick more than a bounded time. Packets are not signed: the links are local.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from flightsw.icd.codec_receive import command_of
from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.wire import SPECS, Counters, Sender, split, table
from flightsw.process.telemetry import Maker, Telemetry
from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED, Ack, Command

ACCEPT = table(
    (
        "HEARTBEAT",
        "SYSTEM_TIME",
        "PARAM_REQUEST_READ",
        "PARAM_REQUEST_LIST",
        "PARAM_SET",
        "COMMAND_LONG",
        "COMMAND_INT",
        "TIMESYNC",
        "REQUEST_DATA_STREAM",
    )
)
CMD_SHUTDOWN = 246
CMD_SET_INTERVAL = 511
CMD_REQUEST_MESSAGE = 512
CMD_CAPABILITIES = 520
PARAMS_PER_SLOT = 20  # answers to PARAM_REQUEST_LIST go down at this pace per telemetry tick
PACKETS_MAX = 32  # of the ground, dealt with in one tick; beyond this they are dropped and counted
ANSWERS_MAX = 20  # queued packets that leave in one tick
QUEUE_MAX = 200  # [packet] beyond this, answers are dropped and counted
SENDERS_MAX = 16  # whose last command is remembered
VERSION = (0, 1, 0, 0)
_REAL32 = 9
COMMANDS = {v: e.description.rstrip(".") for v, e in ENUMS["MAV_CMD"].items()}

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

    `tree`: configuration shown as parameters; `commands`: MAV_CMD the mission answers itself; `settable`: dotted key ->
    setter that returns whether it took the value. `count` holds what was dropped of the ground's packets; `left`: how many
    more are dealt with in this tick.
    """

    def __init__(
        self,
        sysid: int,
        mission: str,
        tree: dict[str, Any],
        telemetry: Telemetry,
        commands: frozenset[int],
        settable: Mapping[str, Setter] | None = None,
    ) -> None:
        self.sysid = sysid
        self.mission = mission
        self.telemetry = telemetry
        self.send: Sender = telemetry.ctx.send
        self.count = Counters()
        self.settable = settable or {}
        self.commands = commands
        self.left = PACKETS_MAX
        self.used = 0
        pairs = list(flatten(tree))
        self.keys = [k for k, _ in pairs]
        self.values = [v for _, v in pairs]
        self.names = short_names(self.keys)
        self._index = {n: i for i, n in enumerate(self.names)}
        self._list: deque[int] = deque()
        self._ready: deque[Maker] = deque()
        self.acks: list[Ack] = []
        self._asked: dict[
            tuple[int, int], tuple[str, Ack | None]
        ] = {}  # last to the mission, by sender, and its answer

    # --- receive ---------------------------------------------------------------------------------------------------

    def receive(self, datagram: bytes, t_us: int) -> list[Command]:
        """Handle one datagram from the ground at sample time `t_us` [us]; returns its commands, in order.

        `used` is how many of its bytes this tick had time for.
        """
        out: list[Command] = []
        packets = split(datagram, ACCEPT, self.count, self.left)
        self.used = len(datagram) if len(packets) < self.left else packets[-1][5]
        self.left -= max(len(packets), 1)  # rubbish counts as one
        for p in packets:
            name, v = p[0].name, p[1]
            if name.startswith("COMMAND_"):
                c = command_of(p, self.sysid)
                if c is not None:
                    out.append(c)
            elif name == "TIMESYNC":
                tc1, ts1 = v
                if tc1 == 0:
                    self._queue(partial(self.send.named, "TIMESYNC", tc1=t_us * 1000, ts1=ts1))
            elif name.startswith("PARAM_"):
                self._param(p[0].name, p[0].to_dict(v))
        return out

    def takes(self, c: Command) -> bool:
        """True if the mission must answer `c` (its answer is to come to `note`); otherwise it was answered here (`acks`).

        A repeat to the mission (confirmation above 0, the rest as before) is answered as before and carried out once.
        """
        sender = (c.src_system, c.src_component)
        if c.command not in self.commands:
            result, why = self._execute(c)
            self.acks.append(Ack(c.command, result, *sender, why))
            return False
        key = f"{c.command} {c.params}"  # as text: NaN is unequal to itself
        before = self._asked.get(sender)
        if c.confirmation and before is not None and before[0] == key:
            if before[1] is not None:
                self.acks.append(before[1])
            return False
        if sender not in self._asked and len(self._asked) >= SENDERS_MAX:
            del self._asked[next(iter(self._asked))]
        self._asked[sender] = (key, None)
        return True

    def note(self, acks: list[Ack]) -> None:
        """What the mission answered, for repeats of the command."""
        for a in acks:
            sender = (a.target_system, a.target_component)
            key = self._asked.get(sender, ("", None))[0]
            if key.startswith(f"{a.command} "):
                self._asked[sender] = (key, a)

    def _execute(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT of a command of these services, and why it is refused."""
        if c.command == CMD_CAPABILITIES:
            self._queue(self._version)
            return ACCEPTED, ""
        if c.command == CMD_SHUTDOWN:
            return DENIED, "the plant ends a run, nobody else"
        if c.command not in (CMD_REQUEST_MESSAGE, CMD_SET_INTERVAL):
            known = COMMANDS.get(c.command)
            what = f"command {c.command}" + (f" ({known})" if known else "")
            return UNSUPPORTED, f"{what}: not one of mission {self.mission}"
        wanted = c.params[0]
        if not (math.isfinite(wanted) and wanted == math.floor(wanted)):
            return DENIED, f"message id {wanted:g}: a whole number is needed"
        spec = SPECS.get(int(wanted))
        name = spec.name if spec else ""
        if c.command == CMD_REQUEST_MESSAGE and name == "AUTOPILOT_VERSION":
            self._queue(self._version)
            return ACCEPTED, ""
        if name not in self.telemetry.defaults:
            return UNSUPPORTED, f"message id {wanted:.0f} is not sent here"
        if c.command == CMD_REQUEST_MESSAGE:
            self.telemetry.once[name] = None
            return ACCEPTED, ""
        interval, base_hz = c.params[1], self.telemetry.base_hz
        if interval in (0.0, -1.0):
            self.telemetry.set_rate(name, None if interval == 0.0 else 0.0)
        elif math.isfinite(interval) and interval * base_hz * 1.001 >= 1e6:
            self.telemetry.set_rate(name, 1e6 / interval)
        else:
            return DENIED, f"interval {interval:g} us: allowed {1e6 / base_hz:g} or more, 0 default, -1 off"
        return ACCEPTED, ""

    def _param(self, kind: str, f: dict[str, Any]) -> None:
        if f["target_system"] not in (0, self.sysid) or f["target_component"] not in (0, COMP_AUTOPILOT):
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

    def ready(self, slot: bool) -> list[Maker]:
        """What makes the packets to send now. `slot`: this tick carries scheduled telemetry, the parameter list may go on."""
        out = [self._ready.popleft() for _ in range(min(ANSWERS_MAX, len(self._ready)))]
        if slot and self._list:
            out += [partial(self._value, self._list.popleft()) for _ in range(min(PARAMS_PER_SLOT, len(self._list)))]
        return out

    @property
    def busy(self) -> bool:
        """True if an answer waits."""
        return bool(self._ready or self._list or self.acks)

    def _queue(self, make: Maker) -> None:
        if len(self._ready) >= QUEUE_MAX:
            self.count.excess += 1
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
            "AUTOPILOT_VERSION",
            capabilities=2 | 8192,
            flight_sw_version=a << 24 | b << 16 | c << 8 | d,
            product_id=VALUES.get(f"WKF_MISSION_{self.mission.upper()}", 0),
            uid=self.sysid,
        )
