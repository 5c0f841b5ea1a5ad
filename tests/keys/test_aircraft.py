"""Every number of an aircraft file is flown by the plant and believed on board: another on either side shows in the flight."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import pytest

from flightsw.aircraft import Airframe, load_airframe
from flightsw.strict import ConfigError, to_dict
from hil_scripts.launch import tomlout
from hil_scripts.launch.runfolder import resolve
from sim_plant.lost import AircraftLostError
from sim_plant.scenario import load_scenario
from sim_plant.world import World
from tests.keys.flights import acts, designs_kept
from tests.keys.keys import Key, leaves, others

SILENT = ("controls.silent",)  # what the servos do when nobody answers: tests/hil/test_restart.py
# keys one side has no use for: linear model and height of the filter; side force and (of forces per mass) the mass of the plant
NOT_PLANT = {
    "alexis": ("trim.height_m", "linear.A", "linear.B", "linear.E", *SILENT),
    "twinjet": SILENT,
}
STRUCTURE = ("structure.load_g", "structure.dive_eas_mps", "structure.dive_mach")  # where the truth ends
NOT_ONBOARD = {
    "alexis": ("mass.kg", "side.beta", *STRUCTURE, *SILENT),
    "twinjet": ("side.CY_beta", *STRUCTURE, *SILENT),
}
STALLED = ("lift.fall", "lift.fall_rad", "drag.beyond")  # beyond the stall: tests/unit/test_windshear_plant.py
UNASKED = ("onboard", "alexis", "limits")  # this mission asks for nothing near them
NAMES = ("meta.name", "probe.0.name")  # words of messages
CASES = {"alexis": ("gust", "alexis"), "twinjet": ("windshear", "twinjet")}
AT_ONCE = {  # steers from the first sample; of the bank's models, each with gains of its own to design, a few
    "alexis": (
        "alexis.nav.servo_bank.wait_s=0.0",
        *(
            f"{who}.nav.servo_bank.{few}"
            for who in ("alexis", "reference")
            for few in ("wn_radps=[28.0, 40.0]", "extra_samples=[0, 1]", "lift_designs=[0.0]")
        ),
    )
}
WIND = [{"amplitude_mps": [0.0, 2.0, 0.0], "period_s": [1.0, 4.0, 1.0]}]
VALUES = {
    "controls.elevator_rate_degps": (1.0,),
    "controls.flap_rate_degps": (1.0,),
    "controls.elevator_deg": ((-1.0, 1.0),),
    "controls.flap_deg": ((-0.1, 0.1),),
    "limits.V_max_mps": (18.0, 60.0),
    "limits.alpha_max_deg": (1.0,),
    "structure.load_g": ((-1.0, 1.0),),
    "structure.dive_eas_mps": (15.0,),
    "structure.dive_mach": (0.05,),
    "structure.bars": (((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5),),),
}


def write(record: Airframe, key: str, value: Any, at: Path) -> Path:
    """The record as a file with one value changed."""
    tree = to_dict(record)
    node: Any = tree
    *path, leaf = key.split(".")
    for p in path:
        node = node[int(p)] if p.isdigit() else node[p]
    node[leaf] = value
    at.write_text(tomlout.dumps(tree))
    return at


def plant_flight(scenario: str, over: dict[str, Any]) -> list[str]:
    """Truths of the first aircraft and the frames of all, with the elevator, flap and throttle moved to and fro."""
    world = World(load_scenario(scenario, {"meta.duration_s": 1.0, "wind.sine": WIND, **over}))
    hold = [world.trim_cmd(i) for i in range(len(world.members))]
    out = []
    while not world.done:
        try:
            frames = world.sense()
        except AircraftLostError as e:
            return [*out, str(e)]
        out.append(repr((world.truth(0), frames[0])))
        push = 0.05 if world.tick < 20 else -0.05
        cmds = [
            replace(c, t_us=world.t_us, elevator=c.elevator + push, flap=push, throttle=c.throttle + push) for c in hold
        ]
        world.step(cmds)  # type: ignore[arg-type]
    return out


def answer(name: str, side: str, k: Key, tmp: Path) -> str:
    """What another value of a file's key does on one side: "acts", "refused" (naming it) or ""."""
    scenario, who = CASES[name]
    key = k.name.removeprefix("file.")
    for i, v in enumerate((*VALUES.get(key, ()), *others(k)[:3])):
        path = write(load_airframe(name), key, v, tmp / f"{name}-{side}-{key}-{i}.toml")
        try:
            if side == "plant":
                got = "acts" if plant_flight(scenario, {"aircraft.0.file": str(path)}) != base_flight(scenario) else ""
            else:
                got = acts(scenario, AT_ONCE.get(name, ()), 2.0, (f"{who}.app.aircraft={path}",), k.field)
        except ConfigError as e:
            named = (k.field, path.stem, f"aircraft.{who}.start", f"allowed for {name}")
            assert any(n in str(e) for n in named), e
            got = "refused"
        if got:
            return got
    return ""


@lru_cache(maxsize=4)
def base_flight(scenario: str) -> list[str]:
    """The flight of the file as it is."""
    return plant_flight(scenario, {})


@pytest.mark.parametrize("side", ["plant", "onboard"])
@pytest.mark.parametrize("name", list(CASES))
def test_every_number_of_the_file_is_read_by_both_sides(name: str, side: str, tmp_path: Path) -> None:
    unused: tuple[str, ...] = (NOT_PLANT if side == "plant" else NOT_ONBOARD)[name]
    record = load_airframe(name)
    dead, alive = [], []
    with designs_kept():
        for k in leaves("file", record):
            key = k.name.removeprefix("file.")
            if key in NAMES or key in STALLED or (side, name, key.partition(".")[0]) == UNASKED:
                continue
            got = answer(name, side, k, tmp_path)
            if got and key in unused:
                alive.append(key)
            elif not got and key not in unused:
                dead.append(key)
    assert not dead, f"{side}: nothing comes of {', '.join(dead)} of {name}.toml"
    assert not alive, f"{side}: {', '.join(alive)} act; the table here says otherwise"


@pytest.mark.parametrize(("scenario", "key"), [("windshear", "twinjet"), ("gust", "alexis"), ("refueling", "receiver")])
def test_another_aircraft_on_board_than_in_the_plant_is_said(scenario: str, key: str, tmp_path: Path) -> None:
    plain = resolve(scenario, None, [], 2.0)
    assert plain.warnings == ()
    record = load_airframe(plain.flights[-1 if key == "receiver" else 0].config["app"]["aircraft"])
    path = write(record, "limits.V_min_mps", 1.25, tmp_path / "other.toml")
    plan = resolve(scenario, None, [f"{key}.app.aircraft={path}"], 2.0)
    assert (
        len(plan.warnings) == 1
        and f"{key}.app.aircraft" in plan.warnings[0]
        and "limits.V_min_mps = 1.25" in plan.warnings[0]
    )
    if key == "receiver":  # and of the aircraft it follows
        leader = write(load_airframe("kc135r"), "geometry.b_m", 41.0, tmp_path / "leader.toml")
        assert "geometry.b_m = 41.0" in resolve(scenario, None, [f"receiver.tanker={leader}"], 2.0).warnings[0]


def test_a_file_of_another_model_and_contradictions_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.twinjet\.file = 'alexis': an aircraft of model 'alexis'"):
        resolve("windshear", None, ["plant.aircraft.0.file=alexis"], 2.0)
    record = load_airframe("alexis")
    for key, value, text in (
        ("controls.aileron_deg", [-5.0, 5.0], r"controls\.aileron_deg = .*have none"),
        ("controls.elevator_deg", [-15.0, 10.0], r"controls\.elevator_deg = .*same travel"),
        ("controls.flap_rate_degps", 0.0, r"controls\.flap_rate_degps = 0\.0: needed"),
        ("probe.0.position_m", [1.0, 0.0, 0.0], r"probe\.0\.position_m = .*centre of gravity"),
        ("side.beta", 1.0, r"side\.beta = 1\.0: allowed -inf to 0"),
    ):
        with pytest.raises(ConfigError, match=text):
            load_airframe(str(write(record, key, value, tmp_path / "bad.toml")))
    assert replace(record.meta, name="x").model == "alexis"
