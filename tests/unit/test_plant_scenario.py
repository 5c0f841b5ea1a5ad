"""Scenario files: strictness, references, round trip of the resolved file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flightsw.strict import ConfigError
from sim_plant.scenario import HERE, dump, load_scenario


@pytest.mark.parametrize("path", sorted(HERE.glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_scenarios_load_and_survive_the_resolved_file(path: Path, tmp_path: Path) -> None:
    sc = load_scenario(path.stem)
    out = tmp_path / "scenario.toml"
    out.write_text(dump(sc, sc.meta.seed))
    assert load_scenario(str(out)) == sc
    assert sc.meta.purpose


def test_overrides_reach_the_resolved_file(tmp_path: Path) -> None:
    sc = load_scenario("refueling", {"sensors.receiver.gnss.latency_ms": "100", "aircraft.tanker.fuel_kg": 60000})
    assert sc.suite("receiver").gnss.latency_ms == 100.0
    assert sc.suite("tanker").gnss.latency_ms == 0.0
    out = tmp_path / "scenario.toml"
    out.write_text(dump(sc, 99))
    back = load_scenario(str(out))
    assert back.meta.seed == 99 and back.sensors == sc.sensors and back.aircraft == sc.aircraft


@pytest.mark.parametrize(
    ("over", "text"),
    [
        ({"meta.sed": 1}, r"meta\.sed: unknown key; allowed: .*seed"),
        ({"wind.dryden.sigma_mps": -1.0}, r"wind\.dryden\.sigma_mps = -1\.0: allowed 0"),
        ({"wind.prevailing": "storm"}, r"wind\.prevailing = 'storm': allowed: constant, sounding"),
        ({"clock.base_rate_hz": 100.5}, r"clock\.base_rate_hz"),
        ({"aircraft": []}, r"at least one \[\[aircraft\]\]"),
        ({"aircraft.receiver.name": "tanker"}, r"names and sysid must be unique"),
        (
            {"aircraft.receiver.boom_to": "nobody"},
            r"aircraft\.receiver\.boom_to = 'nobody': allowed: the first aircraft, 'tanker'",
        ),
        ({"aircraft.tanker.boom_to": "tanker"}, r"none on the first aircraft"),
        ({"wind.wake.source": "receiver"}, r"wind\.wake\.source"),
        ({"sensors.nobody.imu.rate_hz": 50.0}, r"sensors\.nobody: no such aircraft; allowed: tanker, receiver"),
        (
            {"event": [{"t_s": 1.0, "kind": "command", "target": "receiver"}]},
            r"event\[0\]: a command event needs action",
        ),
        ({"event": [{"t_s": 1.0, "kind": "jam", "target": "receiver"}]}, r"event\[0\]: a jam event needs surface"),
        (
            {"event": [{"t_s": 1.0, "kind": "dropout", "target": "receiver"}]},
            r"event\[0\]: a dropout event needs sensor",
        ),
        (
            {"event": [{"t_s": 1.0, "kind": "bias", "target": "receiver", "sensor": "imu"}]},
            r"event\[0\]: a bias event needs value",
        ),
        ({"event": [{"t_s": 1.0, "kind": "jam", "target": "x", "surface": "rudder"}]}, r"event\[0\]\.target = 'x'"),
    ],
)
def test_bad_values_are_named(over: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        load_scenario("refueling", over)


def test_a_missing_scenario_names_what_exists() -> None:
    with pytest.raises(ConfigError, match=r"nowhere.*available: .*refueling"):
        load_scenario("nowhere")


def test_a_scenario_without_aircraft_file_is_refused(tmp_path: Path) -> None:
    p = tmp_path / "x.toml"
    p.write_text('[meta]\nname = "x"\nduration_s = 1.0\n[[aircraft]]\nname = "a"\nsysid = 1\n')
    with pytest.raises(ConfigError, match=r"aircraft\[0\]\.file: missing key"):
        load_scenario(str(p))


def test_an_unknown_aircraft_file_is_named() -> None:
    with pytest.raises(ConfigError, match=r"concorde.*available: .*kc135r"):
        load_scenario("refueling", {"aircraft.tanker.file": "concorde"}).load_aircraft()
