"""What the bench measures it measures: its parts run, in short, where the suite does not run them whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from hil_scripts.bench import airdata, plant, start


def test_the_air_data_step_is_timed_in_a_flight_that_goes_on() -> None:
    median, p99 = airdata.step_us(2.5)
    assert 0.0 < median <= p99


def test_the_plant_steps_with_and_without_its_air() -> None:
    us = plant.step_us(batch_steps=4)
    assert {plant.PLANT, plant.AIR, plant.DYNAMICS} <= set(us) and min(us.values()) > 0.0


def test_a_start_is_timed_to_the_first_tick_and_no_further(tmp_path: Path) -> None:
    assert start.cpu_s(start.FIRST_TICK, start.SCENARIO, str(tmp_path / "run")) > 0.0
    assert (tmp_path / "run" / "meta.json").exists()
    logs = {p.name: p.stat().st_size for p in (tmp_path / "run").glob("*.tlog")}
    assert {"truth.tlog", "tlm.tlog"} <= set(logs) and not any(logs.values())
    with pytest.raises(RuntimeError, match="no such name"):
        start.cpu_s(start.FIRST_TICK, "nowhere", str(tmp_path / "other"))
