"""Commands that come in over the plant link, and what the plant answers to those handed on to it."""

from __future__ import annotations

from flightsw.icd.scaling import COMP_AUTOPILOT
from flightsw.icd.texts import Joiner
from flightsw.icd.wire import BY_NAME, Counters, Packet
from flightsw.types import Ack, Command, SensorFrame

COMMANDS_MAX = 32  # taken in one tick
_COMMAND_INT = BY_NAME["COMMAND_INT"]
_ACK = BY_NAME["COMMAND_ACK"]
_ACK_FIELDS = _ACK.pick("command", "result", "target_system", "target_component", "result_param2")
REASONS_MAX = 16  # texts of the plant that wait for the answer that names them
_TARGET = ("target_system", "target_component", "command")
_LONG = BY_NAME["COMMAND_LONG"].pick(*_TARGET, "confirmation", *(f"param{i}" for i in range(1, 8)))
_INT = _COMMAND_INT.pick(*_TARGET, "param1", "param2", "param3", "param4", "x", "y", "z")


def command_of(p: Packet, sysid: int) -> Command | None:
    """Command of a COMMAND_LONG or COMMAND_INT packet; None if it is for another system or component."""
    if p[0] is _COMMAND_INT:
        target, component, command, *params = _INT(p[1])
        confirmation = 0
    else:
        target, component, command, confirmation, *params = _LONG(p[1])
    if target not in (0, sysid) or component not in (0, COMP_AUTOPILOT):
        return None
    return Command(command, tuple(map(float, params)), p[2], p[3], confirmation)


class OrdersIn:
    """Commands, answers and their reasons of one aircraft's plant link. Nothing that arrives can raise."""

    def __init__(self, sysid: int, count: Counters) -> None:
        self.sysid, self.count = sysid, count
        self.left = COMMANDS_MAX  # of this tick; whoever runs the ticks sets it
        self._texts = Joiner()
        self._reasons: dict[int, str] = {}
        self.answers: list[Ack] = []  # of the plant to orders handed on to it; for `take`

    def command(self, p: Packet, f: SensorFrame) -> None:
        """Append a command to the frame's; one too many is counted."""
        if not self.left:
            self.count.excess += 1
        elif (c := command_of(p, self.sysid)) is not None:
            self.left -= 1
            f.commands.append(c)

    def take(self) -> list[Ack]:
        """What the plant answered to orders handed on to it, since the last call."""
        out, self.answers = self.answers, []
        return out

    def answer(self, p: Packet, f: SensorFrame) -> None:
        """Keep a COMMAND_ACK, with the reason it names."""
        command, result, system, component, ident = _ACK_FIELDS(p[1])
        if system in (0, self.sysid) and len(self.answers) < COMMANDS_MAX:
            self.answers.append(Ack(command, result, system, component, self._reasons.pop(ident, "")))

    def text(self, p: Packet, f: SensorFrame) -> None:
        """Keep a text until the answer that names it."""
        t = p[0].to_dict(p[1])
        line = self._texts.take(p[2], p[3], t["text"], t["id"], t["chunk_seq"])
        if line is not None and t["id"]:
            if len(self._reasons) >= REASONS_MAX:
                del self._reasons[next(iter(self._reasons))]
            self._reasons[t["id"]] = line
