"""Flight files: what is read, what is refused and how it is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from flightsw.app import check
from flightsw.process.config import flight_tree, load_flight, parse_target
from flightsw.strict import ConfigError

GOOD = """
[app]
name = "receiver"
mission = "receiver"
aircraft = "learjet24"
sysid = 2
[nav]
q = 0.1
"""


def write(tmp_path: Path, text: str) -> Path:
    p = tmp_path / "flight.toml"
    p.write_text(text)
    return p


def test_good_file_and_overrides(tmp_path: Path) -> None:
    cfg = load_flight(write(tmp_path, GOOD), {"link.peer_timeout_s": "1.5", "nav.q": "0.2", "app.sysid": 7})
    assert (cfg.app.sysid, cfg.link.peer_timeout_s, cfg.tables, cfg.period_us) == (7, 1.5, {"nav": {"q": 0.2}}, 10_000)


def test_raw_fixes_are_refused_where_nobody_would_send_them(tmp_path: Path) -> None:
    over = {"link.raw_fix": True}
    with pytest.raises(ConfigError, match=r"raw_fix = true: allowed with broadcast_peer = true"):
        load_flight(write(tmp_path, GOOD), over)
    assert load_flight(write(tmp_path, GOOD), over | {"link.broadcast_peer": True}).link.raw_fix


@pytest.mark.parametrize("name", ["tanker", "receiver"])
def test_shipped_files_load_and_survive_a_round_trip(name: str, tmp_path: Path) -> None:
    import flightsw
    from hil_scripts.launch import tomlout

    cfg = load_flight(Path(flightsw.__file__).parent / "params" / f"{name}.toml")
    assert cfg.app.mission == name
    assert load_flight(write(tmp_path, tomlout.dumps(flight_tree(cfg)))) == cfg


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"app.speed": "3"}, r"app\.speed: unknown key"),
        ({"app.sysid": "0"}, r"app\.sysid = 0: allowed 1 to 250"),
        ({"app.sysid": "1.5"}, r"app\.sysid = 1\.5: expected int"),
        ({"app.base_rate_hz": "105"}, r"base_rate_hz = 105: allowed: multiples of 10"),
        ({"app.base_rate_hz": "30"}, r"multiple of 4 us"),
        ({"app.mission_rate_hz": "30"}, r"mission_rate_hz = 30: must divide"),
        ({"origin.lat_deg": "91"}, r"origin\.lat_deg = 91"),
        ({"origin.lat_deg": "nan"}, r"origin\.lat_deg = nan"),
        ({"link.targets": '["here"]'}, r"'here': expected host:port"),
        ({"link.targets": '["127.0.0.1:0"]'}, r"port of 1 to 65535"),
        ({"telemetry.rates_hz.NAV_STATE": "-1"}, r"NAV_STATE = -1\.0: allowed 0 to 1000"),
    ],
)
def test_bad_value_is_named(change: dict[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=message) as e:
        load_flight(write(tmp_path, GOOD), change)
    assert "flight.toml" in str(e.value)


def test_a_table_of_no_mission_is_named(tmp_path: Path) -> None:
    cfg = load_flight(write(tmp_path, GOOD), {"wrong.x": "3"})
    with pytest.raises(ConfigError, match=r"here: wrong: unknown key; allowed: tanker, nav, ctrl, guid, airdata"):
        check(cfg.app.mission, cfg.tables, cfg.app.base_rate_hz, cfg.app.mission_rate_hz, "here")


@pytest.mark.parametrize("key", ["name", "mission", "aircraft", "sysid"])
def test_missing_key_is_named(key: str, tmp_path: Path) -> None:
    text = "\n".join(line for line in GOOD.splitlines() if not line.startswith(key))
    with pytest.raises(ConfigError, match=rf"app\.{key}: missing key"):
        load_flight(write(tmp_path, text))


def test_missing_and_malformed_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.toml: cannot be read"):
        load_flight(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="not valid TOML"):
        load_flight(write(tmp_path, "[app"))


def test_target() -> None:
    assert parse_target("10.0.0.1:14550") == ("10.0.0.1", 14550)
