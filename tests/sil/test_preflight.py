"""What would stop a run in its first second stops it before anything starts: exit 2, one line, no folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.strict import ConfigError
from hil_scripts.launch import preflight
from hil_scripts.launch.runfolder import resolve
from tests.sil.launch import sil

READ = [  # told by reading: nothing is built
    ("refueling", ["receiver.nav.nonsense=1"], r"receiver\.toml: nav\.nonsense: unknown key; allowed: q_V"),
    ("refueling", ["tanker.guid.leg_m=x"], r"tanker\.toml: guid\.leg_m"),
    ("refueling", ["receiver.health.imu_age_s=-1"], r"receiver\.toml: health: imu_age_s = -1\.0: allowed 0\.01"),
    ("refueling", ["receiver.nav.q_wind=true"], r"nav\.q_wind = True: expected float"),
    ("refueling", ["tanker.app.mission=joyride"], r"app\.mission = 'joyride': allowed: gust"),
    ("refueling", ["tanker.app.mission=gust"], r"app\.mission_rate_hz = 20: allowed for mission gust"),
    ("airdata", ["receiver.airdata.position.height=3"], r"airdata\.position\.height = 3: expected bool"),
    ("gust", ["alexis.nav.estimator=foo"], r"gust\.toml: nav\.estimator = 'foo': allowed: printed"),
    (
        "gust",
        ["reference.app.mission_rate_hz=25"],
        r"mission_rate_hz = 25: allowed for mission gust: base_rate_hz = 50",
    ),
    ("windshear", ["twinjet.nav.states=14"], r"windshear\.toml: nav: states = 14"),
    ("joinup", ["receiver.join.guid.track=90"], r"join\.guid\.track: unknown key"),
    ("refueling", ["plant.wind.sounding=nope.txt"], r"sounding file .*nope\.txt"),
    ("rendezvous", ["tanker.rendezvous.pilot.guidance.law=straight"], r"guidance\.law = 'straight': allowed"),
]
BUILT = [  # told by building: values that do not go together
    ("refueling", ["receiver.nav.model=hybrid"], r"aircraft receiver: .*nav\.model = 'hybrid'"),
    (
        "refueling",
        ["receiver.ctrl.tanker_mass_kg=9e5"],
        r"aircraft receiver: .*tanker_mass_kg = 900000: allowed for kc135r",
    ),
    ("refueling", ["tanker.app.aircraft=alexis"], r"aircraft tanker: .*alexis\.toml"),
    ("refueling", ["plant.aircraft.tanker.start.V_mps=20"], r"scenario refueling: no trim at airspeed 20"),
    ("refueling", ["plant.aircraft.receiver.file=kc135r"], r"scenario refueling: .*receptacle"),
]


@pytest.mark.parametrize(("scenario", "sets", "text"), READ)
def test_a_slip_in_the_onboard_parameters_is_named(scenario: str, sets: list[str], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        resolve(scenario, None, sets, 1.0)


@pytest.mark.parametrize(("scenario", "sets", "text"), BUILT)
def test_values_that_do_not_go_together_are_named(scenario: str, sets: list[str], text: str) -> None:
    plan = resolve(scenario, None, sets, 1.0)
    with pytest.raises(ConfigError, match=text):
        preflight.build(plan)


@pytest.mark.parametrize("flags", [("--in-process",), ()], ids=["in-process", "processes"])
@pytest.mark.parametrize("case", [READ[0], BUILT[0]], ids=["read", "built"])
def test_nothing_is_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: tuple[str, list[str], str], flags: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = sil("run", case[0], "--set", case[1][0], "--duration", 1, *flags)
    assert ended.code == 2 and len(ended.text.splitlines()) == 1, ended.text
    assert not list(tmp_path.iterdir())


def test_all_wait_for_the_one_that_starts_slowest() -> None:
    plan = resolve("refueling", None, ["receiver.link.startup_timeout_s=400"], 1.0)
    waits = [plan.scenario["clock"], *(f.config["link"] for f in plan.flights)]
    assert [w["startup_timeout_s"] for w in waits] == [400.0] * 3
    plan = resolve("refueling", None, ["plant.clock.startup_timeout_s=500"], 1.0)
    assert {f.config["link"]["startup_timeout_s"] for f in plan.flights} == {500.0}
