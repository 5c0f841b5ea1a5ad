"""What a run asks of its serial lines, before it starts: bytes a tick against the baud rate, on average and at worst.

The first seconds of the run are flown in memory and their datagrams measured, LINE_FRAME and signatures with them: that has every
rate group, start-up and all. A tick that carries every group must have passed before the next begins, or its reply is late.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flightsw.icd.framing import SIGNATURE
from flightsw.icd.lines import BITS_PER_BYTE, SERIAL, Line
from flightsw.icd.wire import OVERHEAD, frames
from flightsw.strict import ConfigError, convert
from hil_scripts.launch import preflight
from hil_scripts.launch.runfolder import RunPlan
from sim_plant.scenario import Scenario
from sim_plant.server import PlantServer

MEASURED_S = 2.0  # [s]
FRAME = OVERHEAD + 2  # [byte] of LINE_FRAME
FULL = 0.8  # share of the line that the average may take, and of the period that the worst tick may: the rest is for repeats
BAUDS = (115_200, 230_400, 460_800, 921_600, 1_000_000, 1_500_000, 2_000_000, 3_000_000, 4_000_000)
WAYS = ("out", "back")


@dataclass(frozen=True)
class Way:
    """One direction of a line: bytes a tick."""

    mean: float
    worst: int

    def seconds(self, size: float, baud: int) -> float:
        """Time [s] that `size` bytes take."""
        return size * BITS_PER_BYTE / baud


@dataclass(frozen=True)
class Budget:
    """Both directions of the line to one aircraft at `rate_hz` ticks a second; a direction's share is of 1."""

    name: str
    line: Line
    rate_hz: int
    ways: tuple[Way, Way]

    def mean_share(self, baud: int) -> float:
        """Of the line, the fuller direction, on average."""
        return max(w.seconds(w.mean, baud) * self.rate_hz for w in self.ways)

    def worst_share(self, baud: int) -> float:
        """Of the period, the worst tick there and its reply back."""
        return sum(w.seconds(w.worst, baud) for w in self.ways) * self.rate_hz

    def enough(self) -> int:
        """The slowest usual baud rate at which neither is too much; the fastest there is if none does."""
        good = (b for b in BAUDS if self.mean_share(b) <= FULL and self.worst_share(b) <= FULL)
        return next(good, BAUDS[-1])

    def text(self) -> str:
        """A line for a person."""
        baud = self.line.baud
        parts = [
            f"{way} {w.mean:.0f} bytes a tick ({100.0 * w.seconds(w.mean, baud) * self.rate_hz:.0f} %), "
            f"at most {w.worst} ({1e3 * w.seconds(w.worst, baud):.1f} ms)"
            for way, w in zip(WAYS, self.ways, strict=True)
        ]
        total_s = sum(w.seconds(w.mean, baud) for w in self.ways)
        fastest = 1.0 / (total_s * self.rate_hz)
        return (
            f"{self.name} at {baud} baud: {', '.join(parts)} of {1e3 / self.rate_hz:g} ms; "
            f"lockstep at most {fastest:.1f} x real time"
        )

    def warning(self) -> str:
        """What is tight about it; "" if nothing is."""
        share = self.worst_share(self.line.baud)
        if share <= FULL:
            return ""
        return (
            f"{self.name} at {self.line.baud} baud: a tick with every group and its reply take {100.0 * share:.0f} % of a "
            f"period: in real time such replies are late; {self.enough()} baud is enough"
        )

    def check(self) -> None:
        """Raise ConfigError for a line that cannot carry it."""
        share = self.mean_share(self.line.baud)
        if share > FULL:
            raise ConfigError(
                f"--external {self.name}={self.line}: {self.line.baud} baud: the average tick takes {100.0 * share:.0f} % of the "
                f"line; allowed: at most {100.0 * FULL:.0f} %, {self.enough()} baud or more"
            )


def budgets(plan: RunPlan, lines: Mapping[str, Line], signed: bool) -> list[Budget]:
    """The budgets of the serial ones of `lines`, by aircraft. Raises ConfigError for one that cannot carry its share, and as
    preflight.build."""
    serial = {name: line for name, line in lines.items() if line.kind == SERIAL}
    if not serial:
        return []
    built = preflight.build(plan)
    scenario = convert(plan.scenario, Scenario, plan.scenario_name)
    server = PlantServer(scenario, plan.seed, None, built.world)
    sizes: dict[str, tuple[list[int], list[int]]] = {name: ([], []) for name in serial}
    for _ in range(min(round(MEASURED_S * server.world.rate_hz), round(plan.duration_s * server.world.rate_hz))):
        out = server.begin_tick()
        replies = [node.step((d,)) for node, d in zip(built.nodes, out, strict=True)]
        for node in built.nodes:
            node.after()
        server.end_tick(replies)
        for name, d, reply in zip(server.names, out, replies, strict=True):
            if name in serial:
                for way, data in zip(sizes[name], (d, reply), strict=True):
                    way.append(len(data) + FRAME + (SIGNATURE * len(frames(data)) if signed else 0))
    found = []
    for name, line in serial.items():
        ways = tuple(Way(sum(w) / len(w), max(w)) for w in sizes[name])
        b = Budget(name, line, server.world.rate_hz, (ways[0], ways[1]))
        b.check()
        found.append(b)
    return found
