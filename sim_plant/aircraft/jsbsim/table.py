"""[aircraft.plant] of an aircraft flown by JSBSim."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

OWN_FILE = "file"


@dataclass(frozen=True)
class JsbsimTable:
    """`source`: "file" makes JSBSim's model from the aircraft file; else an aircraft that comes with JSBSim ("737"), or a model
    of yours (a path that ends in .xml). `substeps`: steps of JSBSim in one of the plant."""

    source: str = OWN_FILE
    substeps: Annotated[int, Range(1, 20)] = 4
