"""A noise key beside a grade: obeyed as a term over it, dropped with the paper table it belongs to, or refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flightsw.strict import ConfigError
from sim_plant.dump import dump
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.sensors.config import Imu, Suite
from sim_plant.sensors.over import KEYS, LATENCY
from sim_plant.sensors.terms import FAMILIES, Group, grade_of, group_terms

ME = "sensors.receiver"


def terms(sc: Scenario, group: str) -> Group:
    suite = sc.suite("receiver")
    cfg = getattr(suite, group)
    out = group_terms(group, grade_of(cfg.grade, suite.grade), cfg.terms, "")
    assert out is not None
    return out


@pytest.mark.parametrize(("group", "key"), [(g, k) for g in KEYS for k in KEYS[g]])
def test_a_key_set_with_the_grade_is_the_one_term_it_stands_for(group: str, key: str) -> None:
    plain = load_scenario("refueling", {f"{ME}.grade": "tactical"})
    sc = load_scenario("refueling", {f"{ME}.grade": "tactical", f"{ME}.{group}.{key}": 0.125})
    got, was = terms(sc, group), terms(plain, group)
    for family in FAMILIES[group]:
        over = {t: 0.125 for f, t in KEYS[group][key] if f == family}
        over |= {"density": 0.0} if group == "imu" and "white" in over else {}
        assert vars(got.columns[family]) == vars(was.columns[family]) | over
    assert got.latency_ms == was.latency_ms


def test_latency_is_obeyed_and_the_record_of_the_run_reads_back(tmp_path: Path) -> None:
    sc = load_scenario("refueling", {f"{ME}.grade": "mems", f"{ME}.gnss": {LATENCY: 70.0, "vel_std_mps": 0.2}})
    assert terms(sc, "gnss").latency_ms == 70.0 and terms(sc, "gnss").columns["vel_v"].white == 0.2
    text = dump(sc, 1)
    (tmp_path / "scenario.toml").write_text(text)
    back = load_scenario(str(tmp_path / "scenario.toml"))
    assert back == sc and dump(back, 1) == text


def test_a_grade_from_outside_replaces_the_paper_numbers_of_the_file_and_not_what_is_set_with_it() -> None:
    plain = load_scenario("airdata", {f"{ME}.grade": "mems"})
    assert terms(plain, "air") == group_terms("air", "mems", {}, "") and plain.suite("receiver").air.V_std_mps == 0.2
    sc = load_scenario("airdata", {f"{ME}.grade": "mems", f"{ME}.air.V_std_mps": 0.447})
    assert terms(sc, "air").columns["V"].white == 0.447 and terms(sc, "air").columns["V"].gm == 0.6
    paper = load_scenario("airdata", {f"{ME}.imu.grade": "mems"})
    assert paper.suite("receiver").air.V_std_mps == 0.447


def test_keys_and_grade_of_one_file_are_both_obeyed(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(f'base = "{Path("refueling.toml")}"\n[{ME}]\ngrade = "tactical"\nbaro = {{ alt_std_m = 2.0 }}\n')
    (tmp_path / "refueling.toml").write_text((Path("sim_plant/scenarios/refueling.toml")).read_text())
    assert terms(load_scenario(str(own)), "baro").columns["alt"].white == 2.0
    assert terms(load_scenario(str(own), {f"{ME}.grade": "mems"}), "baro").columns["alt"].white == 2.0


@pytest.mark.parametrize(
    ("over", "says"),
    [
        ({"imu.gyro_std": 0.1, "imu.terms.gyro.white": 0.2}, "imu.gyro_std and .*imu.terms.gyro.white: both set"),
        ({"imu.gyro_std": 0.1, "imu.terms.gyro.density": 0.2}, "terms.gyro.density: both set"),
        ({"gnss.latency_ms": 5, "gnss.terms.latency_ms": 6}, "gnss.latency_ms and .*both set"),
        ({"imu.gyro_std": -0.1}, "gyro_std = -0.1: allowed 0 to inf"),
        ({"imu.gyro_std": "wide"}, "gyro_std = 'wide': expected float"),
        ({"gnss.vel_down_factor": 2.0}, "gnss.vel_down_factor = 2.0: nothing obeys it with .*gnss of grade 'tactical'"),
    ],
)
def test_what_cannot_be_obeyed_is_refused_by_name(over: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        load_scenario("refueling", {f"{ME}.grade": "tactical"} | {f"{ME}.{k}": v for k, v in over.items()})


def test_a_record_made_in_code_is_held_to_the_same() -> None:
    sc = load_scenario("refueling")
    suite = Suite(grade="mems", imu=Imu(gyro_std=0.5))
    with pytest.raises(ConfigError, match=r"receiver.imu.gyro_std = 0.5: nothing obeys it with .* of grade 'mems'"):
        Scenario(**(vars(sc) | {"sensors": {"receiver": suite}}))
