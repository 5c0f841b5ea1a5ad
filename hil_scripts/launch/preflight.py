"""Everything a run is built of, built once before its folder is made: what would stop it in the first second stops it here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Generic

from flightsw.icd.port import WIRE, D, Port
from flightsw.process.config import flight_of
from flightsw.process.node import Node
from flightsw.strict import ConfigError, convert
from hil_scripts.launch.runfolder import RunPlan
from sim_plant.scenario import Scenario
from sim_plant.world import World


@dataclass(frozen=True)
class Built(Generic[D]):
    """The plant's world and the onboard nodes of a plan, in its order, not yet flown."""

    world: World
    nodes: list[Node[D]]


def build(plan: RunPlan, port: Port[D] = WIRE) -> Built[D]:  # type: ignore[assignment]
    """Build the world and every onboard process of a plan, which takes the plant's datagrams by `port`.

    Raises ConfigError naming scenario or aircraft and what is wrong: a value alone, values that do not go together, no trim,
    no control law.
    """
    with _naming(f"scenario {plan.scenario_name}"):
        world = World(convert(plan.scenario, Scenario, plan.scenario_name), plan.seed)
    nodes = []
    for f in plan.flights:
        with _naming(f"aircraft {f.name}"):
            nodes.append(Node(flight_of(f.config, "flight configuration"), port=port))
    return Built(world, nodes)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    try:
        yield
    except (ValueError, ArithmeticError, RuntimeError) as e:
        raise ConfigError(f"{what}: {e}") from None
