"""What the bench measures it measures: its parts run, in short, where the suite does not run them whole."""

from __future__ import annotations

from hil_scripts.bench import airdata, plant


def test_the_air_data_step_is_timed_in_a_flight_that_goes_on() -> None:
    median, p99 = airdata.step_us(2.5)
    assert 0.0 < median <= p99


def test_the_plant_steps_with_and_without_its_air() -> None:
    us = plant.step_us(batch_steps=4)
    assert {plant.PLANT, plant.AIR, plant.DYNAMICS} <= set(us) and min(us.values()) > 0.0
