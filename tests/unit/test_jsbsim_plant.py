"""Aircraft in JSBSim: the same flight as in the plant, over either earth; models of others without what opens a socket."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightsw.strict import ConfigError
from sim_plant.aircraft.jsbsim import stock
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.world import World

BOTH = {"aircraft.tanker.model": "jsbsim", "aircraft.receiver.model": "jsbsim"}


def flown(ticks: int, sets: dict[str, Any], moved: bool = True) -> World:
    """The refuelling world with its trim commands held, surfaces stirred, after so many ticks."""
    world = World(load_scenario("refueling", sets), 3)
    cmds = [world.trim_cmd(i) for i in range(2)]
    for k in range(ticks):
        world.sense()
        if moved and k == 20:
            for c in cmds:
                c.aileron += 0.02
                c.elevator -= 0.01
                c.rudder += 0.01
                c.throttle *= 1.2
        world.step(cmds)
    world.sense()
    return world


@pytest.mark.parametrize(
    ("sets", "metres"),
    [({}, 1e-2), ({"earth": "wgs84"}, 2e-2), ({"wind.density": "sounding"}, 1e-2)],
    ids=["flat", "wgs84", "warm"],
)
def test_the_same_flight_as_by_the_plants_own_equations(sets: dict[str, Any], metres: float) -> None:
    """Turbulence, wake, moved controls, 5 s. On the round earth JSBSim's damping knows no turning of the earth (7e-5 rad/s)."""
    own, other = (flown(500, {**sets, **s}) for s in ({}, BOTH))
    for a, b in zip(own.members, other.members, strict=True):
        assert abs(a.s[n.S_P : n.S_P + 3] - b.s[n.S_P : n.S_P + 3]).max() < metres
        assert abs(a.s[n.S_V : n.S_V + 3] - b.s[n.S_V : n.S_V + 3]).max() < metres
        assert abs(a.obs[n.O_F : n.O_F + 3] - b.obs[n.O_F : n.O_F + 3]).max() < 10 * metres
        assert a.obs[n.O_LIFT] == pytest.approx(b.obs[n.O_LIFT], rel=2e-3)
        assert a.obs[n.O_PROBE : n.O_PROBE + 3] == pytest.approx(b.obs[n.O_PROBE : n.O_PROBE + 3], rel=1e-3, abs=1e-4)


def test_failures_do_the_same_in_both() -> None:
    """An engine out on the tanker, a jammed rudder and a leak on the receiver."""
    worlds = [World(load_scenario("refueling", s), 3) for s in ({}, BOTH)]
    for world in worlds:
        tanker, receiver = world.members
        cmds = [world.trim_cmd(i) for i in range(2)]
        tanker.set_power([0.0, 1.0, 1.0, 1.0])
        receiver.leak_kgps = 5.0
        world.faults.outage["receiver"].jam[2] = 1.0
        cmds[1].rudder += 0.05
        for _ in range(300):
            world.sense()
            world.step(cmds)
        world.sense()
    for a, b in zip(worlds[0].members, worlds[1].members, strict=True):
        assert abs(a.s[n.S_P : n.S_FUEL + 1] - b.s[n.S_P : n.S_FUEL + 1]).max() < 1.0  # thrust in newtons among them
        assert abs(a.s[n.S_W : n.S_P + 3] - b.s[n.S_W : n.S_P + 3]).max() < 5e-3
    tanker, receiver = worlds[1].members
    assert tanker.s[n.S_YAW] < -1e5 and tanker.view.o[n.O_EULER + 2] != 0.0
    assert receiver.s[n.S_SURF + 2] == pytest.approx(worlds[1].trim_cmd(1).rudder)


def test_mass_and_inertia_are_the_files_as_fuel_is_taken_on() -> None:
    world = flown(1, BOTH, moved=False)
    m = world.members[1]
    m.s[n.S_FUEL] += 900.0
    m._weigh()  # type: ignore[attr-defined]
    m.motion.look(7010.0, m.wind)  # type: ignore[attr-defined]
    from sim_plant.aircraft.sixdof.eom import inertia

    fdm, par = m.motion.fdm, m.par  # type: ignore[attr-defined]
    mass = float(par[n.P_EMPTY] + m.s[n.S_FUEL])
    slug_ft2 = 1.3558179483
    have = [fdm[f"inertia/{k}-slugs_ft2"] * slug_ft2 for k in ("ixx", "iyy", "izz", "ixz")]
    assert m.motion.mass_kg == pytest.approx(mass, rel=1e-7)  # type: ignore[attr-defined]
    assert np.abs(have) == pytest.approx(np.abs(inertia(mass, par)), rel=1e-6)


def test_two_worlds_of_one_seed_are_one() -> None:
    a, b = flown(200, BOTH), flown(200, BOTH)
    for x, y in zip(a.members, b.members, strict=True):
        assert (x.s == y.s).all() and (x.obs == y.obs).all()


def test_a_model_of_others_keeps_neither_sockets_nor_files_nor_its_own_control() -> None:
    st = stock.read("737")  # opens two sockets as shipped
    xml = st.xml(7010.0)
    assert not any(f"<{tag}" in xml for tag in ("input", "output", "flight_control", "autopilot", "engine"))
    assert st.empty_kg == pytest.approx(83000 * 0.45359237)
    assert len(st.thrusters_m) == 2 and len(st.tanks_kg) == 3
    assert st.digest == stock.read("737").digest


def test_what_is_not_there_or_not_ours_to_bend_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'738' does not exist; allowed: .*737"):
        stock.read("738")
    (bad := tmp_path / "bad.xml").write_text(
        '<!DOCTYPE x [<!ENTITY a SYSTEM "/etc/passwd">]><fdm_config>&a;</fdm_config>'
    )
    with pytest.raises(ConfigError, match="declares entities"):
        stock.read(str(bad))
    sets = {"aircraft.tanker.model": "jsbsim", "aircraft.tanker.plant.source": '"737"'}
    with pytest.raises(
        ConfigError, match=r"aircraft\.tanker\.aero_error_frac = 0\.1: nothing obeys it with plant\.source = '737'"
    ):
        World(load_scenario("refueling", sets), 1)
    with pytest.raises(ConfigError, match=r"its aerodynamics go by .*fcs/lef-pos-rad"):
        World(
            load_scenario(
                "refueling", {**sets, "aircraft.tanker.plant.source": "f16", "aircraft.tanker.aero_error_frac": 0.0}
            ),
            1,
        )
    with pytest.raises(
        ConfigError, match=r"earth = 'sphere': allowed with aircraft\.tanker\.model = 'jsbsim': flat, wgs84"
    ):
        World(load_scenario("refueling", {**BOTH, "earth": "sphere"}), 1)
    with pytest.raises(ConfigError, match=r"aircraft\.tanker\.airframe = 'full': nothing obeys it"):
        load_scenario("refueling", {**BOTH, "aircraft.tanker.airframe": "full"})


def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jsbsim", None)
    with pytest.raises(ConfigError, match=r"model = 'jsbsim': JSBSim is not installed.*wakefield\[jsbsim\]"):
        World(load_scenario("refueling", BOTH), 1)
