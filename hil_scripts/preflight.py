"""Everything a run is built of, built once before its folder is made: what would stop it in the first second stops it here."""

from __future__ import annotations

from flightsw.config import FlightConfig
from flightsw.node import Node
from flightsw.strict import ConfigError, convert
from hil_scripts.runfolder import FlightPlan, RunPlan
from sim_plant.scenario import Scenario
from sim_plant.world import World


def check(plan: RunPlan) -> None:
    """Build the plant's world and every onboard process of a plan, and throw them away.

    Raises ConfigError naming the aircraft and what is wrong: a value alone, values that do not go together, no trim, no
    control law.
    """
    sc = convert(plan.scenario, Scenario, plan.scenario_name)
    try:
        World(sc, plan.seed)
    except ConfigError:
        raise
    except (ValueError, ArithmeticError, RuntimeError) as e:
        raise ConfigError(f"scenario {plan.scenario_name}: {e}") from None
    for f in plan.flights:
        _node(f)


def _node(f: FlightPlan) -> None:
    try:
        Node(convert(f.config, FlightConfig, f"flight configuration {f.name!r}"))
    except ConfigError:
        raise
    except (ValueError, ArithmeticError, RuntimeError) as e:
        raise ConfigError(f"aircraft {f.name}: {e}") from None
