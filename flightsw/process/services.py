"""MAVLink manners: parameters, plans, commands and their answers, message intervals, time synchronisation.

Commands of the mission pass through to the application, which answers them; the rest is answered here, those of another
mission and unknown ones with UNSUPPORTED, and every refusal says why. Whoever is no operator of the aircraft may look and not
touch. Nothing a ground station sends can raise, and what it sends costs no tick more than a bounded time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Container, Iterable
from functools import partial
from typing import Any

from flightsw.icd.codec_orders import command_of
from flightsw.icd.dialect import ENUMS, VALUES
from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.wire import SPECS, Counters, Sender, split, table
from flightsw.process import plans
from flightsw.process.paramdesk import ParameterDesk
from flightsw.process.parameters import Parameter
from flightsw.process.plans import Plans
from flightsw.process.telemetry import Maker, Telemetry
from flightsw.types import ACCEPTED, DENIED, UNSUPPORTED, Ack, Command, Vec3

ACCEPT = table(
    (
        "HEARTBEAT", "SYSTEM_TIME", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST", "PARAM_SET", "COMMAND_LONG", "COMMAND_INT",
        "TIMESYNC", "REQUEST_DATA_STREAM", "PING", "SET_MODE", *plans.MESSAGES,
    )
)  # fmt: skip
CMD_SET_MODE = VALUES["MAV_CMD_DO_SET_MODE"]
CMD_SHUTDOWN = 246
CMD_HOME = VALUES["MAV_CMD_GET_HOME_POSITION"]
CMD_INJECT = VALUES["MAV_CMD_INJECT_FAILURE"]
CMD_GET_INTERVAL = 510
CMD_SET_INTERVAL = 511
CMD_REQUEST_MESSAGE = 512
CMD_CAPABILITIES = 520
PACKETS_MAX = 32  # of the ground, dealt with in one tick; beyond this they are dropped and counted
ANSWERS_MAX = 20  # queued packets that leave in one tick
QUEUE_MAX = 200  # [packet] beyond this, answers are dropped and counted
SENDERS_MAX = 16  # whose last command is remembered
ORDERS_MAX = 16  # to the plant, unanswered
VERSION = (0, 1, 0, 0)
CAPABILITIES = sum(
    VALUES[f"MAV_PROTOCOL_CAPABILITY_{n}"] for n in ("MISSION_INT", "COMMAND_INT", "MAVLINK2", "PARAM_ENCODE_C_CAST")
)
MODES = "modes are phases of the mission, entered by its own orders"
COMMANDS = {v: e.description.rstrip(".") for v, e in ENUMS["MAV_CMD"].items()}
# REQUEST_DATA_STREAM: stock messages of each stream. The house's own stay at their rates: others listen too
STREAMS: dict[int, tuple[str, ...]] = {
    1: ("HIGHRES_IMU", "GPS_RAW_INT", "SCALED_PRESSURE"),
    2: ("SYS_STATUS", "EXTENDED_SYS_STATE", "FUEL_STATUS"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("SYSTEM_TIME", "WIND_COV"),
}


class Services:
    """Ground-side services of one aircraft.

    `parameters`: what it shows as such; `commands`: MAV_CMD the mission answers itself; `route`: places it flies by;
    `operators`: system ids that may command; `simulated`: a plant is there to take failures. `count` holds what was dropped of
    the ground's packets; `left`: how many more are dealt with in this tick; `orders`: commands for the plant.
    """

    def __init__(
        self,
        sysid: int,
        mission: str,
        parameters: Iterable[Parameter],
        telemetry: Telemetry,
        commands: frozenset[int],
        route: Callable[[], tuple[Vec3, ...]] = tuple,
        operators: Container[int] = range(256),
        simulated: bool = True,
    ) -> None:
        self.sysid = sysid
        self.mission = mission
        self.telemetry = telemetry
        self.send: Sender = telemetry.ctx.send
        self.count = Counters()
        self.commands = commands
        self.operators, self.simulated = operators, simulated
        self.strangers = 0  # orders of those who are no operators, refused
        self.left = PACKETS_MAX
        self.used = 0
        self.parameters = ParameterDesk(self.send, parameters, self._queue)
        self.plans = Plans(self.send, telemetry.ctx.geo, route, self._queue)
        self._ready: deque[Maker] = deque()
        self.acks: list[Ack] = []
        self.orders: list[Command] = []
        self._ordered: deque[tuple[int, int]] = deque()  # who waits for an answer of the plant
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
            name, v, sender = p[0].name, p[1], (p[2], p[3])
            if name.startswith("COMMAND_"):
                c = command_of(p, self.sysid)
                if c is not None:
                    out.append(c)
            elif name == "TIMESYNC":
                tc1, ts1 = v
                if tc1 == 0:
                    self._queue(partial(self.send.named, "TIMESYNC", tc1=t_us * 1000, ts1=ts1))
            elif name not in ("HEARTBEAT", "SYSTEM_TIME"):
                self._request(name, p[0].to_dict(v), sender)
        return out

    def _request(self, name: str, f: dict[str, Any], sender: tuple[int, int]) -> None:
        """A packet that is no command, if it is for this aircraft."""
        if name == "PING":
            if f["target_system"] == f["target_component"] == 0:
                to = {"target_system": sender[0], "target_component": sender[1]}
                self._queue(partial(self.send.named, "PING", **(f | to)))
            return
        if f["target_system"] not in (0, self.sysid) or f.get("target_component", 0) not in (0, COMP_AUTOPILOT):
            return
        if name.startswith("PARAM_"):
            may = sender[0] in self.operators
            self.strangers += name == "PARAM_SET" and not may
            self.parameters.handle(name, f, sender, may)
        elif name == "SET_MODE":
            self.acks.append(Ack(CMD_SET_MODE, UNSUPPORTED, *sender, MODES))
        elif name == "REQUEST_DATA_STREAM":
            if sender[0] in self.operators:
                self._stream(f["req_stream_id"], f["req_message_rate"] if f["start_stop"] else 0)
            else:
                self.strangers += 1
        else:
            self.plans.handle(name, f, sender)

    def _stream(self, which: int, rate_hz: int) -> None:
        """The messages of a stream at least so often; 0: as by default."""
        tel = self.telemetry
        for name in STREAMS.get(which, ()) if which else (n for names in STREAMS.values() for n in names):
            if (usual := tel.defaults.get(name)) is not None:
                tel.set_rate(name, min(max(usual, float(rate_hz)), tel.base_hz) if rate_hz else None)

    def takes(self, c: Command) -> bool:
        """True if the mission must answer `c` (its answer is to come to `note`); otherwise it was answered here (`acks`).

        A repeat to the mission (confirmation above 0, the rest as before) is answered as before and carried out once.
        """
        sender = (c.src_system, c.src_component)
        if c.src_system not in self.operators:
            self.strangers += 1
            self.acks.append(Ack(c.command, DENIED, *sender, f"system {c.src_system} is no operator"))
            return False
        if c.command == CMD_INJECT:
            self._inject(c)
            return False
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

    def _inject(self, c: Command) -> None:
        """A failure is the plant's to make: hand the order on; its answer comes back by `answered`."""
        if not self.simulated:
            self.acks.append(Ack(c.command, DENIED, c.src_system, c.src_component, "this aircraft flies hardware"))
        elif len(self._ordered) >= ORDERS_MAX:
            self.count.excess += 1
        else:
            self._ordered.append((c.src_system, c.src_component))
            self.orders.append(c)

    def take_orders(self) -> list[Command]:
        """Commands for the plant since the last call."""
        out, self.orders = self.orders, []
        return out

    def answered(self, a: Ack) -> None:
        """The plant's answer to the oldest of the orders handed on: to whoever gave it."""
        if a.command == CMD_INJECT and self._ordered:
            self.acks.append(Ack(a.command, a.result, *self._ordered.popleft(), a.reason))

    def _execute(self, c: Command) -> tuple[int, str]:
        """MAV_RESULT of a command of these services, and why it is refused."""
        if c.command == CMD_CAPABILITIES:
            self._queue(self._version)
            return ACCEPTED, ""
        if c.command == CMD_SHUTDOWN:
            return DENIED, "the plant ends a run, nobody else"
        if c.command == CMD_HOME:
            self.telemetry.once["HOME_POSITION"] = None
            return ACCEPTED, ""
        if c.command == CMD_SET_MODE:
            return UNSUPPORTED, MODES
        if c.command not in (CMD_REQUEST_MESSAGE, CMD_SET_INTERVAL, CMD_GET_INTERVAL):
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
        if c.command == CMD_REQUEST_MESSAGE and name == "AVAILABLE_MODES":
            return self._modes(c.params[1])
        if c.command == CMD_GET_INTERVAL:
            self._queue(partial(self._interval, int(wanted)))
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

    def _modes(self, which: float) -> tuple[int, str]:
        """AVAILABLE_MODES: one by its number, all for 0."""
        modes = self.telemetry.ctx.modes
        if which != 0.0 and which not in range(1, len(modes) + 1):
            return DENIED, f"mode {which:g}: allowed 1 to {len(modes)}, 0 all"
        for k in range(1, len(modes) + 1) if which == 0.0 else (int(which),):
            self._queue(partial(self.telemetry.mode, k))
        return ACCEPTED, ""

    def _interval(self, ident: int) -> bytes:
        spec, rates = SPECS.get(ident), self.telemetry.rates
        known = spec is not None and spec.name in rates
        rate = rates[spec.name] if spec is not None and known else 0.0
        interval = round(1e6 / rate) if rate > 0.0 else -1 if known else 0
        return self.send.named("MESSAGE_INTERVAL", message_id=ident & 0xFFFF, interval_us=interval)

    # --- send ------------------------------------------------------------------------------------------------------

    def ready(self, slot: bool) -> list[Maker]:
        """What makes the packets to send now. `slot`: this tick carries scheduled telemetry, the parameter list may go on."""
        out = [self._ready.popleft() for _ in range(min(ANSWERS_MAX, len(self._ready)))] if self._ready else []
        if slot and self.parameters.busy:
            out += self.parameters.listed()
        return out

    @property
    def busy(self) -> bool:
        """True if an answer waits."""
        return bool(self._ready or self.acks or self.parameters.busy)

    def _queue(self, make: Maker) -> None:
        if len(self._ready) >= QUEUE_MAX:
            self.count.excess += 1
            return
        self._ready.append(make)

    def _version(self) -> bytes:
        a, b, c, d = VERSION
        return self.send.named(
            "AUTOPILOT_VERSION",
            capabilities=CAPABILITIES,
            flight_sw_version=a << 24 | b << 16 | c << 8 | d,
            product_id=VALUES.get(f"WKF_MISSION_{self.mission.upper()}", 0),
            uid=self.sysid,
        )
