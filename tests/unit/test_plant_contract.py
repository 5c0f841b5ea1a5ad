"""The plant's contract: shared files name no kind of aircraft and no mission, nothing untyped stands on the seams, and a kind
from outside flies with sensors, truth, faults and couplings."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest

from flightsw import plugins
from flightsw.aircraft import Airframe, Boom, Receptacle, load_airframe
from flightsw.strict import ConfigError, Range, to_dict
from flightsw.types import UPD_BOOM, UPD_GNSS, UPD_REL, Command
from hil_scripts.launch import tomlout
from sim_plant.aircraft.base import Member, Tanks
from sim_plant.aircraft.kind import Kind, Setup
from sim_plant.kernels import layout as n
from sim_plant.kernels.atmosphere import isa
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.server import PlantServer
from sim_plant.wind.field import AirMass
from sim_plant.world import AircraftLostError, World

ROOT = Path(__file__).resolve().parent.parent.parent
PLANT = ROOT / "sim_plant"
SHARED = sorted(
    f for g in ("*.py", "sensors/*.py", "failures/*.py", "couplings/*.py", "kernels/*.py", "aircraft/*.py", "wind/field.py")
    for f in PLANT.glob(g)
)  # fmt: skip
# what the air, the couplings and whoever follows the truth know of an aircraft, and the world of all of them
SEAMS = [
    PLANT / name for name in ("world.py", "truth.py", "lost.py", "wind/field.py", "aircraft/base.py", "failures/orders.py")
] + sorted(f for f in (PLANT / "couplings").glob("*.py") if not f.stem.startswith("traffic"))  # fmt: skip
# words of the air and of two aircraft that meet; missions are named after them
WORDS = {"gust", "tanker", "receiver"}


@pytest.mark.parametrize("path", SHARED, ids=lambda p: str(p.relative_to(PLANT)))
def test_a_shared_file_names_no_kind_and_no_mission(path: Path) -> None:
    assert len(SHARED) > 30
    missions = {name.partition("_")[0] for name in plugins.declared(plugins.MISSIONS)} - WORDS
    kinds = set(plugins.declared(plugins.AIRCRAFT))
    assert {"windshear", "rendezvous"} <= missions and {"alexis", "sixdof", "twinjet"} <= kinds
    found = re.findall("|".join(sorted(missions | kinds)), path.read_text(), re.IGNORECASE)
    assert not found, f"{path}: {found}"


def untyped(tree: ast.AST) -> Iterator[str]:
    """Names that switch types off or ask for them at run time."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in ("Any", "getattr", "hasattr", "isinstance", "cast"):
            yield f"line {node.lineno}: {node.id}"


@pytest.mark.parametrize("path", SEAMS, ids=lambda p: str(p.relative_to(PLANT)))
def test_the_seams_are_typed(path: Path) -> None:
    text = path.read_text()
    assert "type: ignore" not in text and not list(untyped(ast.parse(text)))


def test_the_search_for_untyped_names_finds_them() -> None:
    assert list(untyped(ast.parse("x: Any = getattr(y, 'z') if isinstance(y, Z) else None")))


# --- a kind from outside --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mass:
    kg: Annotated[float, Range(1.0)]
    thrust_N: Annotated[float, Range(0.0)]


@dataclass(frozen=True)
class PointMass(Airframe):
    """A point that flies level: thrust against drag linear in airspeed."""

    mass: Mass
    boom: Boom | None = None
    receptacle: Receptacle | None = None


@dataclass(frozen=True)
class Table:
    drag_Nspm: Annotated[float, Range(0.0)] = 10.0


class PointMember(Member):
    """Along its heading through the air, carried along by the wind."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.record, self.drag = setup.record(PointMass), setup.table(Table).drag_Nspm
        self.receptacle, self.tanks = self.record.receptacle, Tanks(1e4, 1e6)
        self.speed = self.cfg.start.V_mps
        psi = math.radians(self.cfg.start.psi_deg)
        self.ahead = math.cos(psi), math.sin(psi)
        self.s[0], self.s[3] = math.cos(0.5 * psi), math.sin(0.5 * psi)

    @property
    def height_m(self) -> float:
        return -float(self.s[n.S_P + 2])

    def track(self) -> tuple[float, float]:
        return self.ahead

    def start(self, air: AirMass, other: Member | None) -> None:
        self.s[n.S_P : n.S_P + 3] = self.cfg.start.pos_n_m
        if other is not None:  # heading north, as whom it follows here
            self.s[n.S_P : n.S_P + 3] = other.s[n.S_P : n.S_P + 3] + np.array(self.cfg.start.xi_m)
        air.mean(self)
        if other is not None:
            self.speed = float(other.s[n.S_V] - self.free[0])
        self._move(0.0)
        self.hold((0.0, 0.0, 0.0, self.drag * self.speed / self.record.mass.thrust_N, False, 0.0))
        self.observe()

    def _move(self, dt: float) -> None:
        self.s[n.S_V : n.S_V + 3] = self.free + self.speed * np.array([*self.ahead, 0.0])
        self.s[n.S_P : n.S_P + 3] += self.s[n.S_V : n.S_V + 3] * dt

    def observe(self) -> None:
        self.obs[2] = -n.G0
        self.obs[n.O_V], self.obs[n.O_PRESS] = self.speed, isa(self.height_m)[1]
        self.obs[n.O_MASS] = self.record.mass.kg
        for i in range(len(self.probes)):
            self.obs[n.O_PROBE + 3 * i] = self.speed
        self.show()

    def advance(self, jam: list[float]) -> None:
        _, elevator, _, throttle, _, _ = self.path.current
        push = throttle * self.record.mass.thrust_N if not jam[1] else 0.0
        self.s[n.S_SURF + 1] = elevator
        self._move(self.dt_s)
        self.speed += (push - self.drag * self.speed) / self.record.mass.kg * self.dt_s


HERE = "tests.unit.test_plant_contract"
ALONE = Kind(PointMass, PointMember, lambda: Table, surfaces=("elevator",))
FOLLOWER = replace(ALONE, carries=(*ALONE.carries, "fuel"), formation=True)


def aircraft_file(folder: Path, model: str, whole: bool = False) -> Path:
    """The file of a point mass; `whole`: with a receptacle."""
    like = load_airframe("learjet24")
    tree = {k: v for k, v in to_dict(like).items() if k in ("controls", "limits", "structure", "probe")}
    tree |= {"meta": {"name": "point", "model": model}, "mass": {"kg": 5000.0, "thrust_N": 20000.0}}
    if whole:
        tree["receptacle"] = {"position_m": [0.0, 0.0, 0.0]}
    path = folder / "point.toml"
    path.write_text(tomlout.dumps(tree))
    return path


def alone(folder: Path, kind: str, record: str, **over: object) -> Scenario:
    aircraft = {
        "name": "point", "file": str(aircraft_file(folder, record)), "sysid": 7, "model": kind, "plant": {"drag_Nspm": 20.0},
        "start": {"pos_n_m": [100.0, 0.0, -1000.0], "V_mps": 150.0, "psi_deg": 90.0},
    }  # fmt: skip
    path = folder / "alone.toml"
    path.write_text(tomlout.dumps({"meta": {"name": "alone", "duration_s": 5.0}, "aircraft": [aircraft]}))
    return load_scenario(str(path), {"noise.scale": 0.0, "noise.bias_scale": 0.0, **over})


@pytest.fixture
def declared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Another installed package that declares the kind and its record."""
    info = tmp_path / "installed" / "point_mass-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: point-mass\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        f"[{plugins.AIRCRAFT}]\npoint = {HERE}:ALONE\n[{plugins.RECORDS}]\npoint = {HERE}:PointMass\n"
    )
    monkeypatch.syspath_prepend(str(info.parent))
    plugins.look_again()
    yield
    plugins.look_again()


@pytest.mark.parametrize("how", ["declared", "by place"])
def test_a_kind_from_outside_flies(how: str, tmp_path: Path, declared: None) -> None:
    """Speed through the air by its closed form, carried by the wind; sensors without errors read the truth."""
    kind, record = ("point", "point") if how == "declared" else (f"{HERE}:ALONE", f"{HERE}:PointMass")
    sc = alone(tmp_path, kind, record, **{"wind.constant_mps": [3.0, -2.0]})
    assert load_scenario(str(tmp_path / "alone.toml")).aircraft[0].plant == {"drag_Nspm": 20.0}
    w = World(sc)
    assert [s.group for s in w.members[0].sensors] == ["imu", "baro", "gnss", "att", "air"]
    hold = w.trim_cmd(0)
    while not w.done:
        (f,), t = w.sense(), w.truth(0)
        if f.updated & UPD_GNSS:
            assert f.gnss_pos_n == t.pos_n and f.air_V == (t.V,) * len(f.air_V)
        w.step([replace(hold, t_us=w.t_us, throttle=0.3)])
    t = w.truth(0)
    tau, end = 5000.0 / 20.0, 0.3 * 20000.0 / 20.0
    assert pytest.approx(end + (150.0 - end) * math.exp(-5.0 / tau), abs=0.01) == t.V
    assert t.wind_n == (3.0, -2.0, 0.0) and t.pos_n[0] == pytest.approx(100.0 + 15.0) and t.pos_n[1] > 5.0 * 148.0
    assert w.others() == []


def test_its_turbulence_faults_and_log_are_those_of_any_aircraft(tmp_path: Path, declared: None) -> None:
    events = [
        {"t_s": 0.5, "kind": "jam", "target": "point", "surface": "elevator"},
        {"t_s": 0.5, "kind": "bias", "target": "point", "sensor": "baro", "value": [7.0]},
    ]
    sc = alone(tmp_path, "point", "point", **{"wind.dryden.sigma_mps": 1.0, "event": events})
    server = PlantServer(sc, 1, tmp_path / "run")
    w = server.world
    for _ in range(100):
        server.begin_tick()
        server.end_tick([None])
    f, t = w.sense()[0], w.truth(0)
    assert f.baro_alt_m + t.pos_n[2] == pytest.approx(7.0) and t.V < 149.9 and min(map(abs, t.wind_n)) > 0.0
    assert w.command(0, Command(420, (8.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0), 255, 190)).verdict.result == 0
    server.close()
    assert (tmp_path / "run" / "truth.tlog").stat().st_size > 0
    assert load_scenario(str(tmp_path / "run" / "scenario.toml")).aircraft == sc.aircraft


def test_it_is_lost_as_any_aircraft(tmp_path: Path, declared: None) -> None:
    w = World(alone(tmp_path, "point", "point"))
    w.sense()
    w.step([None])
    w.members[0].s[n.S_P + 2] = 1.0
    with pytest.raises(AircraftLostError, match="point hit the ground"):
        w.sense()


def test_it_follows_another_kind_to_its_boom(tmp_path: Path) -> None:
    """In formation with a six-degree-of-freedom tanker: relative navigation, boom signal, contact, fuel."""
    at = aircraft_file(tmp_path, f"{HERE}:PointMass", whole=True)
    over = {
        "aircraft.receiver.model": f"{HERE}:FOLLOWER", "aircraft.receiver.file": str(at),
        "aircraft.receiver.aero_error_frac": 0.0,
        "aircraft.receiver.start.xi_m": [-32.5, 0.0, 7.5], "aircraft.receiver.fuel_kg": -1.0, "wind.prevailing": "constant",
        "wind.constant_mps": [0.0, 0.0], "noise.scale": 0.0, "noise.bias_scale": 0.0, "event": [], "wind.wake.source": "",
        "refuel.capture_s": 0.1, "refuel.capture_speed_mps": 50.0, "wind.dryden.sigma_mps": 0.0, "wind.slow.sigma_mps": 0.0,
    }  # fmt: skip
    w = World(load_scenario("refueling", over))
    lead, m = w.members
    seen = 0
    for _ in range(40):
        frame = w.sense()[1]
        seen |= frame.updated
        w.step([w.trim_cmd(0), replace(w.trim_cmd(1), t_us=w.t_us, latch=True)])
    w.sense()
    t = w.truth(1)
    assert seen & UPD_REL and seen & UPD_BOOM and frame.rel_pos_t == pytest.approx(t.xi, abs=0.5)
    assert w.truth(0).xi == (0.0, 0.0, 0.0) and w.truth(0).boom_extension == t.boom_extension
    assert t.inside and t.contact and w.truth(0).contact
    assert m.view.transfer_kgps == -lead.view.transfer_kgps > 0.0


@pytest.mark.parametrize(
    ("kind", "record", "text"),
    [
        ("balloon", "point", r"aircraft\[0\]\.model = 'balloon': allowed: alexis, jsbsim, point, polynomial, sixdof, twinjet"),
        (f"{HERE}:Table", "point", r"aircraft\.point\.model = .*Table is a type; allowed: a Kind"),
        ("nowhere.at_all:KIND", "point", r"aircraft\.point\.model = 'nowhere.at_all:KIND': cannot be imported"),
        ("point", "balloon", r"point\.toml: meta\.model = 'balloon': allowed: alexis, point, sixdof, twinjet"),
        ("point", f"{HERE}:Table", r"point\.toml: meta\.model = .*Table is no record of an aircraft"),
        ("twinjet", "point", r"aircraft\.point\.file = .*: an aircraft of model 'point'; allowed: one of model = 'twinjet'"),
    ],
)  # fmt: skip
def test_what_is_no_kind_and_no_record_is_refused_by_name(
    kind: str, record: str, text: str, tmp_path: Path, declared: None
) -> None:
    with pytest.raises(ConfigError, match=text):
        alone(tmp_path, kind, record).load_aircraft()


def test_a_formation_that_cannot_be_is_refused(tmp_path: Path) -> None:
    """A wake nobody feels, a boom for one that has no receptacle, and names that mean nothing."""
    over = {
        "aircraft.receiver.model": f"{HERE}:FOLLOWER", "aircraft.receiver.aero_error_frac": 0.0,
        "aircraft.receiver.file": str(aircraft_file(tmp_path, f"{HERE}:PointMass")),
    }  # fmt: skip
    with pytest.raises(
        ConfigError, match=r"wake\.source = 'tanker': aircraft\.receiver\.model = .* would fly through it unmoved"
    ):
        World(load_scenario("refueling", over))
    with pytest.raises(
        ConfigError, match=r"boom_to = 'tanker': that aircraft's file needs a \[boom\] and this one's a \[recept"
    ):
        World(load_scenario("refueling", over | {"wind.wake.source": ""}))
    with pytest.raises(ConfigError, match=r"kind of PointMass: surfaces: 'flap': allowed: aileron, elevator, rudder"):
        Kind(PointMass, PointMember, surfaces=("flap",))


def test_its_own_table_and_surfaces_are_checked(tmp_path: Path, declared: None) -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.point\.plant: drag_Nspm = -1\.0: allowed"):
        alone(tmp_path, "point", "point", **{"aircraft.point.plant.drag_Nspm": -1.0}).load_aircraft()
    jam = {"t_s": 0.5, "kind": "jam", "target": "point", "surface": "rudder"}
    with pytest.raises(ConfigError, match=r"event\[0\]\.surface = 'rudder': point \(model = 'point'\) has elevator"):
        World(alone(tmp_path, "point", "point", event=[jam]))
    with pytest.raises(ConfigError, match=r"aircraft\.point\.fuel_kg = 1\.0: nothing obeys it"):
        alone(tmp_path, "point", "point", **{"aircraft.point.fuel_kg": 1.0})
