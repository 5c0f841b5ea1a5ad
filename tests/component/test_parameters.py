"""Parameters on the wire: their names, the protocol, and changes in flight."""

from __future__ import annotations

import math
import random
import re
import string
import tomllib
from pathlib import Path
from typing import Any

import pytest

from flightsw import plugins
from flightsw.condition import ConditionParams
from flightsw.health import HealthParams
from flightsw.icd import wire
from flightsw.icd.dialect import VALUES
from flightsw.missions.base import MissionSpec
from flightsw.process.config import AppConfig, LinkConfig, OriginConfig
from flightsw.process.node import Node
from flightsw.process.paramdesk import SETTINGS_MAX
from flightsw.process.parameters import NAMES, Parameter, parameters, wire_name
from flightsw.process.recorder import LinkRecorder
from flightsw.process.replay import replay

from .flight_fakes import FakeApp, config, fields
from .test_services import GCS, Bench

MISSIONS = plugins.parts(plugins.MISSIONS, MissionSpec)


def of_mission(name: str) -> list[Parameter]:
    """All parameters of a mission with its defaults."""
    own = (("app", AppConfig("x", name, "x", 1)), ("origin", OriginConfig()), ("link", LinkConfig()))
    rest = (("health", HealthParams()), ("condition", ConditionParams()), ("", MISSIONS[name].params()))
    return parameters((*own, *rest))


@pytest.mark.parametrize("mission", sorted(MISSIONS))
def test_names_are_distinct_short_and_by_the_rule(mission: str) -> None:
    """Every parameter of every mission has a name that MAVProxy, QGroundControl and MAVSDK can address."""
    found = of_mission(mission)
    names = [p.name for p in found]
    assert len(found) > 90 and len(set(names)) == len(names)
    for p in found:
        assert re.fullmatch(r"[A-Z][A-Z0-9_]{0,15}", p.name) and p.name == wire_name(p.key), p
    free = [p for p in found if p.in_flight]
    assert len(free) >= 10
    assert all(math.isfinite(p.lo) and math.isfinite(p.hi) for p in free)


def test_no_hand_made_name_is_idle() -> None:
    keys = {p.key for m in MISSIONS for p in of_mission(m)}
    assert set(NAMES) <= keys


def test_any_key_gives_a_name() -> None:
    """Of tables in tables, each name of up to four words."""
    r = random.Random(1)

    def name(first: str, later: str, most: int) -> str:
        words = [(first, most), *[(later, 9)] * r.randint(0, 3)]
        return "_".join("".join(r.choices(letters, k=r.randint(1, n))) for letters, n in words)

    for _ in range(3000):
        inner = (name(string.ascii_letters, string.ascii_lowercase + string.digits, 9) for _ in range(r.randint(0, 4)))
        key = ".".join((name(string.ascii_lowercase, string.ascii_lowercase, 12), *inner))
        assert 1 <= len(wire_name(key)) <= 16 and wire_name(key) == wire_name(key).upper(), key


def put(b: Bench, name: str, value: float, sysid: int = 255) -> tuple[list[float], list[int], list[str]]:
    """Values, errors and texts that answer a PARAM_SET."""
    send = wire.Sender(sysid, 190)
    out = b.tick(send.named("PARAM_SET", target_system=2, param_id=name, param_value=value, param_type=9), n=2)
    values = [float(f["param_value"]) for f in fields(out, "PARAM_VALUE") if f["param_id"] == name]
    said = [t["text"] for t in fields(out, "STATUSTEXT")]
    return values, [f["error"] for f in fields(out, "PARAM_ERROR")], said


def test_the_list_is_complete_typed_and_paced() -> None:
    b = Bench()
    n = len(b.node.services.parameters.all)
    out = b.tick(GCS.named("PARAM_REQUEST_LIST", target_system=2), n=80)
    got = fields(out, "PARAM_VALUE")
    assert [g["param_index"] for g in got] == list(range(n)) and {g["param_count"] for g in got} == {n}
    values = {g["param_id"]: g["param_value"] for g in got}
    assert values["CTRL_W_POS_2"] == pytest.approx(0.4) and values["APP_SYSID"] == 2.0
    assert (values["CTRL_LAW"], values["CTRL_STEPS"], values["CTRL_ON"], values["CTRL_FREE"]) == (1.0, 2.0, 0.0, -1.0)
    assert "CTRL_FILE" not in values and {g["param_type"] for g in got} == {VALUES["MAV_PARAM_TYPE_REAL32"]}


def test_one_is_read_by_name_and_by_index_and_an_unknown_one_is_said_not_to_be() -> None:
    b = Bench()

    def read(**k: Any) -> bytes:
        return b.tick(GCS.named("PARAM_REQUEST_READ", target_system=2, **k))

    [by_name] = fields(read(param_id="APP_SYSID", param_index=-1), "PARAM_VALUE")
    [by_index] = fields(read(param_index=by_name["param_index"]), "PARAM_VALUE")
    assert by_name == by_index
    for ask in ({"param_id": "NO_SUCH", "param_index": -1}, {"param_id": "", "param_index": 30_000}):
        out = read(**ask)
        [error] = fields(out, "PARAM_ERROR")
        assert not fields(out, "PARAM_VALUE") and error["error"] == VALUES["MAV_PARAM_ERROR_DOES_NOT_EXIST"]
        assert {k: error[k] for k in ask} == ask and error["target_system"] == 255


@pytest.mark.parametrize(
    ("name", "value", "error", "why"),
    [
        ("CTRL_GAIN", 2.5, "VALUE_OUT_OF_RANGE", "CTRL_GAIN = 2.5: allowed 0 to 2"),
        ("CTRL_GAIN", math.nan, "VALUE_OUT_OF_RANGE", "CTRL_GAIN = nan: a finite number is needed"),
        ("CTRL_GAIN", 0.5, "PERMISSION_DENIED", "CTRL_GAIN: cannot be flown"),
        ("CTRL_LAW", 3.0, "VALUE_OUT_OF_RANGE", "CTRL_LAW = 3: allowed 0 hold, 1 fly, 2 land"),
        ("CTRL_LAW", 0.5, "VALUE_OUT_OF_RANGE", "CTRL_LAW = 0.5: allowed 0 hold, 1 fly, 2 land"),
        ("CTRL_STEPS", 6.0, "VALUE_OUT_OF_RANGE", "CTRL_STEPS = 6: allowed whole numbers 1 to 5"),
        ("CTRL_ON", 2.0, "VALUE_OUT_OF_RANGE", "CTRL_ON = 2: allowed 0, 1"),
        ("CTRL_W_POS_1", 0.4, "READ_ONLY", "CTRL_W_POS_1: not to be changed in flight"),
    ],
)
def test_a_refusal_gives_the_value_in_force_and_says_why(name: str, value: float, error: str, why: str) -> None:
    b = Bench()
    before = b.app.params
    [was] = [p.value for p in b.node.services.parameters.all if p.name == name]
    values, errors, said = put(b, name, value)
    assert values == [pytest.approx(was)] and errors == [VALUES[f"MAV_PARAM_ERROR_{error}"]] and said == [why]
    assert b.app.params is before


def test_who_is_no_operator_may_read_and_not_set() -> None:
    b = Bench()
    values, errors, said = put(b, "CTRL_GAIN", 0.25, sysid=77)
    assert values == [1.0] and errors == [VALUES["MAV_PARAM_ERROR_PERMISSION_DENIED"]]
    assert said[0] == "CTRL_GAIN: system 77 is no operator" and b.node.services.strangers == 1


def test_a_change_acts_from_its_tick_on_is_journalled_and_replays(tmp_path: Path) -> None:
    """The tick that takes the packet in commands with the new gain; the log of it, replayed, gives the same bytes."""
    b = Bench()
    log = LinkRecorder(tmp_path / "link_x.tlog", 2)
    gains = []
    for k in range(8):
        ask = (
            [GCS.named("PARAM_SET", target_system=2, param_id="CTRL_GAIN", param_value=0.7, param_type=9)]
            if k == 4
            else []
        )
        reply = b.node.step([b.plant.at(k)], None, ask)
        telemetry = b.node.after()
        log.inbound(b.node.t_us, b.node.take_heard())
        log.outbound(b.node.t_us, reply, telemetry)
        log.settled(b.node.take_settled())
        gains.append(b.app.gain)
    log.close()
    assert gains == [1.0] * 4 + [0.7] * 4  # 0.7, not the 32 bits nearest to it
    [entry] = tomllib.loads((tmp_path / "params_x.toml").read_text())["set"]
    assert entry == {"t_s": 0.04, "key": "ctrl.gain", "value": 0.7, "system": 255, "component": 190}
    again = Node(config(), FakeApp())
    report = replay(tmp_path / "link_x.tlog", again)
    assert report.ok and report.ticks == 8, report.lines()
    assert isinstance(again.app, FakeApp) and again.app.gain == 0.7
    [p] = [p for p in again.services.parameters.all if p.name == "CTRL_GAIN"]
    assert p.value == 0.7


def test_a_word_a_switch_and_a_whole_number_arrive_as_what_they_are() -> None:
    b = Bench()
    for name, value, got in (("CTRL_LAW", 2.0, "land"), ("CTRL_ON", 1.0, True), ("CTRL_STEPS", 5.0, 5)):
        values, errors, said = put(b, name, value)
        key = name.removeprefix("CTRL_").lower()
        now = getattr(b.app.params.ctrl, key)
        assert (
            (values, errors) == ([value], [])
            and now == got
            and type(now) is type(got)
            and said[0].startswith(f"{name} ")
        )


def test_a_flood_of_changes_is_bounded() -> None:
    b = Bench()
    one = GCS.named("PARAM_SET", target_system=2, param_id="CTRL_GAIN", param_value=0.7, param_type=9)
    b.tick(*[one * 8] * 4)
    assert b.node.services.parameters.excess == 32 - SETTINGS_MAX
