"""What the receiver's flight files believe of the sensors, and that it is switched off by name."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import flightsw
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError, convert
from hil_scripts.studies.integrity.table import MOMENTS
from sim_plant.scenario import load_scenario
from sim_plant.sensors.config import Suite
from sim_plant.sensors.terms import group_terms

PARAMS = Path(flightsw.__file__).parent / "params"


def believed(name: str) -> IntegrityParams:
    """[integrity] of a flight file."""
    return convert(load_flight(PARAMS / f"{name}.toml").tables["integrity"], IntegrityParams, "integrity")


@pytest.mark.parametrize("name", ["receiver_tactical", "receiver_to_contact_tactical"])
def test_tactical_sensors_are_believed_as_by_default(name: str) -> None:
    assert believed(name) == IntegrityParams(on=True)


def test_a_join_up_with_tactical_sensors_ends_in_the_refuelling_with_tactical_sensors() -> None:
    """The same law and bounds behind the boom; the tanker sends what they need."""
    joined, refuelling = (
        load_flight(PARAMS / f"{name}.toml") for name in ("receiver_to_contact_tactical", "receiver_tactical")
    )
    for table in ("ctrl", "integrity", "nav"):
        assert joined.tables[table] == refuelling.tables[table], table
    assert joined.tables["join"] == load_flight(PARAMS / "receiver_to_contact.toml").tables["join"]
    assert joined.tables["wind_calibration"]["on"]
    assert load_flight(PARAMS / "tanker_to_contact.toml").link.raw_fix


@pytest.mark.parametrize("grade", ["tactical", "mems"])
def test_no_sensor_of_a_grade_errs_by_more_than_is_believed(grade: str) -> None:
    """Margins up to half; the boom in its own axes."""
    p, of = believed(f"receiver_{grade}"), {k: group_terms(k, grade, {}, "") for k in ("rel", "gnss", "att", "boom")}
    rel, gnss, att, boom = (g.columns for g in of.values() if g is not None)
    pos, vel, angle = rel["pos"], rel["vel"], boom["angle"]
    fix = (gnss["pos_h"], gnss["pos_v"], gnss["vel_h"], gnss["vel_v"])
    lean = math.hypot(att["heading"].gm, att["heading"].constant)
    pairs = [
        (p.rel_pos_m, pos.white), (p.rel_slow_m, pos.gm), (p.rel_const_m, pos.constant), (p.rel_boresight_rad, pos.align),
        (p.rel_scale, pos.scale), (p.rel_vel_mps, vel.white), (p.rel_vel_slow_mps, math.hypot(vel.gm, vel.constant)),
        (p.gnss_pos_m, fix[1].white), (p.gnss_slow_m[0], fix[0].gm), (p.gnss_slow_m[1], fix[1].gm),
        (p.gnss_vel_slow_mps, math.hypot(fix[3].gm, fix[3].constant)), (p.boom_angle_rad, angle.white),
        (p.boom_ext_m, boom["extension"].white),
        (p.boom_angle_const_rad, angle.constant), (p.boom_ext_const_m, boom["extension"].constant),
    ]  # fmt: skip
    assert all(true <= said <= 1.5 * true for said, true in pairs), pairs
    assert p.gnss_vel_mps >= fix[3].white and p.att_rad >= 0.9 * lean


@pytest.mark.parametrize("scenario", ["refueling", "airdata"])
def test_no_paper_sensor_errs_by_more_than_is_believed(scenario: str) -> None:
    s, p = load_scenario(scenario).sensors.get("receiver", Suite()), believed("receiver")
    assert s.grade == "paper" and p.on
    assert p.rel_pos_m >= s.rel.pos_std_m and p.rel_vel_mps >= s.rel.vel_std_mps
    assert p.rel_const_m >= s.rel.pos_bias_std_m and p.rel_vel_slow_mps >= s.rel.vel_bias_std_mps
    assert p.gnss_pos_m >= s.gnss.pos_std_m and p.gnss_vel_mps >= s.gnss.vel_std_mps
    assert min(p.gnss_slow_m) >= s.gnss.pos_bias_std_m and p.gnss_vel_slow_mps >= s.gnss.vel_bias_std_mps


def test_off_by_name_lets_the_rest_stand_and_the_raw_fixes_come_with_the_tanker(tmp_path: Path) -> None:
    make_app(load_flight(PARAMS / "receiver.toml", {"integrity.on": False}))
    bare = tmp_path / "bare.toml"
    bare.write_text(
        '[app]\nname = "r"\nmission = "receiver"\naircraft = "learjet24"\nsysid = 2\n[integrity]\ngate = 7.0\n'
    )
    with pytest.raises(ConfigError, match=r"integrity\.gate = 7\.0: nothing obeys it without integrity\.on = true"):
        make_app(load_flight(bare, {}))
    assert load_flight(PARAMS / "tanker.toml").link.raw_fix
    assert believed("receiver_airdata").on and not believed("receiver_rendezvous").on


@pytest.mark.parametrize("name", MOMENTS)
def test_a_moment_is_judged_about_the_station_that_is_flown(name: str) -> None:
    m = MOMENTS[name]
    file = load_scenario(m.scenario).aircraft[1].mission
    station = load_flight(PARAMS / f"{file}.toml").tables["guid"][f"{m.phase}_m"]
    assert list(m.station_m) == station
