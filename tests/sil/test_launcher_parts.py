"""Pieces of the launcher without processes: bounds, TOML output, overrides, kernel cache, ports."""

from __future__ import annotations

import math
import socket
import tomllib
from pathlib import Path
from typing import Any

import pytest

from flightsw.strict import ConfigError
from hil_scripts.launch import kernel_cache, ports, tomlout, verdict
from hil_scripts.launch.runfolder import find_scenario, parse_sets


@pytest.mark.parametrize(
    ("bound", "value", "ok"),
    [
        (0.2, 0.2, True),
        (0.2, 0.21, False),
        (0.2, math.nan, False),
        (0.2, None, False),
        (0, True, False),
        ([1, 2], 1.5, True),
        ([1, 2], 2.5, False),
        ({"min": 95.0}, 96.0, True),
        ({"min": 95.0}, 94.0, False),
        ({"min": 1, "max": 2}, 3, False),
        ("completed", "completed", True),
        ("completed", "failed", False),
        (True, True, True),
    ],
)
def test_bounds(bound: Any, value: Any, ok: bool) -> None:
    (check,) = verdict.evaluate({"a.b": bound}, {"a.b": value})
    assert check.ok is ok


def test_nested_bounds_address_flat_summary_keys() -> None:
    checks = verdict.evaluate({"contact": {"error": {"x": 0.2, "y": {"min": 1.0}}}}, {"contact.error.x": 0.1})
    assert [(c.key, c.ok) for c in checks] == [("contact.error.x", True), ("contact.error.y", False)]


def test_a_bound_of_no_known_form_is_an_error() -> None:
    with pytest.raises(ConfigError, match=r"expect\.k"):
        verdict.evaluate({"k": [1, 2, 3]}, {"k": 1})


def test_toml_survives_a_round_trip() -> None:
    tree = {
        "s": 'quote " back\\slash \n line \x7f',
        "flag": True,
        "f": 0.1 + 0.2,
        "tiny": 5e-324,
        "n": -3,
        "list": [1.0, 2.5],
        "nested": [[1, 2], [3]],
        "empty": [],
        "t": {"dotted.key": 1, "sub": {"x": "y"}, "none": {}},
        "array": [{"name": "a", "start": {"v": 1.0}}, {"name": "b"}],
    }
    assert tomllib.loads(tomlout.dumps(tree)) == tree


def test_toml_names_the_key_it_cannot_write() -> None:
    with pytest.raises(TypeError, match=r"a\.b"):
        tomlout.dumps({"a": {"b": object()}})


def test_sets_are_sorted_by_owner() -> None:
    got = parse_sets(["plant.wind.dryden.sigma_mps=1.0", "receiver.nav.q_V = 0.5", "plant.meta.seed=3"])
    assert got == {"plant": {"wind.dryden.sigma_mps": "1.0", "meta.seed": "3"}, "receiver": {"nav.q_V": "0.5"}}


@pytest.mark.parametrize("text", ["plant=1", "plant.wind", "=3", "wind", "plant.=4"])
def test_malformed_set_is_named(text: str) -> None:
    with pytest.raises(ConfigError) as e:
        parse_sets([text])
    assert repr(text) in str(e.value)


def test_unknown_scenario_lists_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="refueling"):
        find_scenario("nonsense")


def test_editing_any_kernel_source_gives_a_new_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for pkg in kernel_cache.PACKAGES:
        (tmp_path / pkg).mkdir()
    source = tmp_path / "flightsw" / "k.py"
    source.write_text("from jit import jit\n")
    (tmp_path / "flightsw" / "plain.py").write_text("x = 1\n")
    monkeypatch.setattr(kernel_cache, "ROOT", tmp_path)
    before = kernel_cache.digest()
    assert kernel_cache.kernel_sources() == [source]
    (tmp_path / "flightsw" / "plain.py").write_text("x = 2\n")
    assert kernel_cache.digest() == before
    source.write_text("from jit import jit  # changed\n")
    assert kernel_cache.digest() != before


def test_busy_port_is_named_with_its_purpose(port_offset: int) -> None:
    need = ports.needed({1: "tanker", 2: "receiver"}, port_offset)
    assert len(need) == 6
    ports.check_free(need)
    port = next(p for p, purpose in need.items() if purpose == "plant link of receiver")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        s.bind((ports.HOST, port))
        with pytest.raises(ports.PortBusyError, match=rf"{port} \(plant link of receiver\)"):
            ports.check_free(need)
        with pytest.raises(ports.PortBusyError, match="no free block"):
            ports.free_offset({1: "tanker", 2: "receiver"}, [port_offset])


def test_port_beyond_the_range_is_named() -> None:
    with pytest.raises(ports.PortBusyError, match="out of range"):
        ports.check_free(ports.needed({1: "a"}, 60000))
