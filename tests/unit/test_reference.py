"""The generated reference: pages are current, every key stands in them once, with what its class says of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import pytest

from flightsw.health import HealthParams
from flightsw.missions.base import find_mission
from flightsw.strict import OneOf, Range, to_dict
from hil_scripts.launch import reference
from hil_scripts.launch.fields import UNITS, comments, rows
from sim_plant.scenario import Scenario


@dataclass(frozen=True)
class Inner:
    """What an inner table says."""

    gain: float = 2.0  # [m/s] of nothing
    note: str | None = None


@dataclass(frozen=True)
class Base:
    q_mps: Annotated[float, Range(0.0)] = 1.0  # beside it


@dataclass(frozen=True)
class Made(Base):
    kind: Annotated[
        str,
        OneOf(("a", "b")),  # inside it
    ] = "a"
    must: Annotated[int, Range(1, 3)] = field(kw_only=True)
    inner: Inner = field(default_factory=lambda: Inner(gain=3.0))
    many: tuple[Inner, ...] = ()
    named: dict[str, Inner] = field(default_factory=dict)


def test_rows_of_a_made_up_class() -> None:
    got = {(r.table, r.key): r for r in rows(Made)}
    assert list(got) == [
        ("", "q_mps"), ("", "kind"), ("", "must"), ("inner", "gain"), ("inner", "note"), ("many[]", "gain"), ("many[]", "note"),
        ("named.<name>", "gain"), ("named.<name>", "note"),
    ]  # fmt: skip
    q = got["", "q_mps"]
    assert (q.kind, q.default, q.allowed, q.unit, q.text, q.about) == ("float", "1", ">= 0", "m/s", "beside it", "")
    assert (got["", "kind"].allowed, got["", "kind"].text) == ("`a`, `b`", "inside it")
    assert (got["", "must"].default, got["", "must"].allowed) == ("required", "1 to 3")
    g = got["inner", "gain"]
    assert (g.default, g.unit, g.text, g.about) == ("3", "m/s", "of nothing", "What an inner table says.")
    assert got["many[]", "gain"].default == "2" and got["inner", "note"].default == "not set"


def test_inherited_fields_keep_their_comments() -> None:
    assert comments(Made)["q_mps"] == "beside it"


def _leaves(tree: object, at: str = "") -> set[str]:
    if not isinstance(tree, dict) or not tree:
        return {at}
    return {x for k, v in tree.items() for x in _leaves(v, f"{at}.{k}" if at else k)}


@pytest.mark.parametrize("mission", sorted(reference.ours()))
def test_every_key_a_mission_has_is_in_the_reference(mission: str) -> None:
    """Against the converter's own idea of the tree, once each."""
    params = find_mission(mission, "test").params
    found = [f"{r.table}.{r.key}".lstrip(".") for r in rows(params, params())]
    assert len(found) == len(set(found))
    assert _leaves(to_dict(params())) <= set(found)


def test_units_are_those_of_the_suffixes_in_use() -> None:
    """A suffix that looks like a unit and has no entry would leave its keys without one."""
    keys = {r.key.rpartition("_")[2] for cls in (Scenario, HealthParams) for r in rows(cls) if "_" in r.key}
    keys |= {r.key.rpartition("_")[2] for s in reference.ours().values() for r in rows(s.params) if "_" in r.key}
    assert not {k for k in keys if k.endswith(("ps", "ps2", "deg", "hz", "rad"))} - {*UNITS, "steps"}


def test_pages_are_current() -> None:
    assert reference.stale() == [], "run python -m hil_scripts.launch.reference"


def test_a_page_out_of_date_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reference, "FOLDER", tmp_path / "reference")
    assert reference.main([]) == 0 and reference.main(["--check"]) == 0
    page = tmp_path / "reference" / "scenario.md"
    page.write_text(page.read_text() + "x")
    assert reference.main(["--check"]) == 1
    assert str(page) in capsys.readouterr().err
