"""The study joinup_contact: its settings are flown, what it calls not reached, and its figures of a known path."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hil_scripts.studies.grades.flight import STATION_M
from hil_scripts.studies.grades.words import Words
from hil_scripts.studies.integrity.flight import LOOK_HZ
from hil_scripts.studies.integrity.snapshot import Flying
from hil_scripts.studies.joinup import contact


@pytest.fixture(scope="module")
def flight() -> Flying:
    return Flying(contact.SCENARIO, 1, contact.settings("tactical"))


def test_sensors_are_of_the_grade(flight: Flying) -> None:
    sensors = flight.server.scenario.sensors
    assert {sensors[who].grade for who in ("tanker", "receiver")} == {"tactical"}


def test_no_contact_by_the_latest_time_is_said(flight: Flying, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contact, "LATEST_S", flight.t_s + 0.5)
    assert contact.fly(flight.fork(), Words()) == ("not_reached", None)


def test_figures_are_of_what_follows_the_settling(flight: Flying) -> None:
    held, g = contact.Held(flight.fork()), np.random.default_rng(1)
    settling = [(9.0, 9.0, 9.0)] * round(contact.SETTLE_S * LOOK_HZ)
    rest = g.normal(scale=(0.1, 0.2, 0.3), size=(4000, 3))
    held.contact = settling + [tuple(r) for r in rest]
    held.rows = [(0.0, 0.0, 11.0, False, False), (0.05, 0.0, 7.5, False, False)]
    f = held.figures()
    for i, x in enumerate("xyz"):
        sigma = (0.1, 0.2, 0.3)[i]
        assert f[f"contact.rms_m.{x}"] == pytest.approx(math.sqrt((rest[:, i] ** 2).sum() / len(rest)), rel=1e-12)
        assert f[f"contact.p95_m.{x}"] == pytest.approx(1.96 * sigma, rel=0.06)
    assert f["gap_min_m"] == 7.5
    assert f["contact.s"] == len(held.contact) / LOOK_HZ


def test_a_look_is_the_place_less_the_station(flight: Flying) -> None:
    held = contact.Held(flight.fork())
    held.flight.server.world.sense()
    held.look()
    (off,) = np.array(held.contact)
    assert math.dist(off, (0.0, 0.0, 0.0)) == pytest.approx(np.array(held.rows)[0, 1])
    assert abs(off[0] + STATION_M[0]) > 1000.0  # it starts 30 NM away
