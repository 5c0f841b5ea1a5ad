"""The register of aircraft models beside the six-degree-of-freedom one: scenario name -> class."""

from __future__ import annotations

from flightsw.aircraft import Airframe
from sim_plant.aircraft.alexis.craft import AlexisCraft
from sim_plant.aircraft.base import Craft, Mean, plant_table
from sim_plant.aircraft.twinjet.craft import TwinJetCraft
from sim_plant.scenario import AircraftCfg, Scenario

CRAFTS: dict[str, type[Craft]] = {"alexis": AlexisCraft, "twinjet": TwinJetCraft}


def make_craft(cfg: AircraftCfg, ac: Airframe, sc: Scenario, seed: int, mean: Mean) -> Craft:
    """The aircraft `cfg` of a scenario, started in the wind `mean` [m/s] north, east. Raises ConfigError naming what its model
    does not take."""
    return CRAFTS[cfg.model](cfg, ac, sc, seed, mean)  # type: ignore[call-arg, arg-type]


def check_craft(cfg: AircraftCfg) -> None:
    """Raise ConfigError naming the key if the table of an aircraft is not one of its model."""
    plant_table(CRAFTS[cfg.model], cfg)
