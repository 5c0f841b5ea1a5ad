"""`sil identify`: what is known of JSBSim's models is found, the file is read by both sides, what cannot fly there is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from rich.console import Console

from flightsw.aircraft import load_aircraft
from flightsw.strict import ConfigError
from hil_scripts.identify import command, fit
from hil_scripts.identify.bench import Bench, Condition, Point
from hil_scripts.launch.runfolder import resolve
from sim_plant.aircraft.jsbsim.stock import read
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.world import World

KC135 = load_aircraft("kc135r")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of the 737."""
    out = tmp_path_factory.mktemp("identified")
    with pytest.MonkeyPatch.context() as m:
        m.setattr(fit, "POINTS", 400)
        command.identify(command.Asked("jsbsim:737", "kc135r", 7010.0, 195.0, -1.0, out), Console(quiet=True))
    return out


def test_the_numbers_of_the_model_are_found(folder: Path) -> None:
    """As written in its XML, where the form and the place of the moments' reference leave them as they are."""
    ac = load_aircraft(str(folder / "737.toml"))
    a = ac.aero
    assert (a.CL0, a.CL_alpha, a.CL_de) == pytest.approx((0.2, 1.0 / 0.23, 0.2), rel=1e-6)
    assert a.CY_beta == pytest.approx(-1.0, rel=1e-6)
    assert (a.Cm_q, a.Cm_alphadot) == pytest.approx((-27.0, -16.0), abs=1.5)  # told apart by the attitude
    assert a.Cl_p == pytest.approx(-0.4, abs=0.02)
    assert (a.CL_q, a.CL_alphadot, a.CY_p, a.CY_r, a.CY_dr) == (0.0,) * 5
    assert ac.controls.elevator_deg == pytest.approx((math.degrees(-0.3), math.degrees(0.3)), abs=0.01)
    assert ac.mass.empty_kg + ac.mass.default_fuel_kg == pytest.approx(107000 * 0.45359237, abs=0.1)
    assert ac.geometry.S_m2 == pytest.approx(1171 * 0.3048**2, rel=1e-6)


def test_the_file_says_how_well_and_what_not(folder: Path) -> None:
    text = (folder / "737.toml").read_text()
    for words in (
        "SHA-256",
        "What this form cannot hold",
        "thrust line",
        "drag of sideslip",
        "centre of gravity",
        "Cm_q = -2",
    ):
        assert words in text
    line = next(x for x in text.splitlines() if x.startswith("Cm_alpha = "))
    assert "# +- 0.00" in line


def test_what_is_written_flies(folder: Path) -> None:
    """Both sides take the files; held in its trim, the model stays where it is for five seconds."""
    for name in ("racetrack", "refueling"):
        assert not resolve(str(folder / f"{name}.toml"), None, [], None).warnings
    world = World(load_scenario(str(folder / "racetrack.toml"), {"wind.dryden.level": "none"}), 1)
    m, cmd = world.members[0], world.trim_cmd(0)
    for _ in range(500):
        world.sense()
        world.step([cmd])
    world.sense()
    assert m.view.o[n.O_V] == pytest.approx(195.0, abs=0.1) and abs(m.height_m - 7010.0) < 0.5


def test_the_trims_thrust_and_the_thrust_line_balance() -> None:
    bench = Bench(read("B747"), KC135, Condition(7010.0, 195.0, 12375.0))
    trim, thrust = bench.trim()
    r = bench.read(trim)
    weight = bench.mass_kg * n.G0
    qs = 0.5 * bench.rho * 195.0**2 * bench.S_m2
    assert r.CL * qs == pytest.approx(weight - thrust * math.sin(trim.alpha), rel=1e-6)
    assert r.CD * qs == pytest.approx(thrust * math.cos(trim.alpha), rel=1e-6)
    assert r.Cm == pytest.approx(-command.thrust_Cm(bench, 195.0, thrust), rel=5e-3)
    assert pytest.approx(r.CL - 0.2 * trim.surfaces[1], rel=1e-9) == bench.read(Point(195.0, trim.alpha)).CL


def test_what_does_not_fly_there_is_refused_with_the_reason() -> None:
    asked = command.Asked("jsbsim:C130", "kc135r", 7010.0, 195.0, -1.0, None)
    with pytest.raises(
        ConfigError, match=r"C130 at 195 m/s, 7010 m, .* needs 90\.1 kN of thrust, its engines \(t56\) give 0\.2 kN"
    ):
        command.identify(asked, Console(quiet=True))
    with pytest.raises(ConfigError, match=r"--fuel 99999: allowed for 737: up to 16057 kg"):
        command.identify(command.Asked("737", "kc135r", 7010.0, 195.0, 99999.0, None), Console(quiet=True))


def test_columns_that_cannot_be_told_apart_are_said_to_be() -> None:
    with pytest.raises(ValueError, match="X: its derivatives cannot be told apart"):
        fit.least_squares("X", {"a": [1.0, 2.0, 3.0], "b": [2.0, 4.0, 6.0]}, [1.0, 2.0, 3.0])
