"""Where the project keeps what a run is made of, and what `--set` calls the plant. Imports nothing: lists answer at once."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "sim_plant" / "scenarios"
PARAMS = ROOT / "flightsw" / "params"
AIRCRAFT = ROOT / "flightsw" / "aircraft"
PLANT_KEY = "plant"
