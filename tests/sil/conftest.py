"""Flights that several tests look at."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve

SECONDS = 4.0
Flown = Callable[[str], tuple[Path, InProcess]]


@pytest.fixture(scope="session")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    """Scenario -> its run folder and its first seconds, flown in process when first asked for; the logs are closed, the
    applications as they were at the end. Not to be changed: copy."""

    @cache
    def fly(scenario: str) -> tuple[Path, InProcess]:
        plan = resolve(scenario, 4, [], SECONDS)
        folder = make_folder(plan, tmp_path_factory.mktemp("flown") / scenario)
        flight = InProcess(plan, folder)
        while not flight.server.done:
            flight.tick()
        flight.finish()
        return folder, flight

    return fly
