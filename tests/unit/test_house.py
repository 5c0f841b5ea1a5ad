"""The shape of the house: rooms and trunk, who may know whom, and seams without holes."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from flightsw import plugins
from flightsw.missions.base import MissionSpec
from tests.scheduling import HEAVY

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = ("flightsw", "sim_plant", "ground", "hil_scripts")
MISSIONS = sorted(p.name for p in (ROOT / "flightsw" / "missions").iterdir() if (p / "__init__.py").exists())
# shared by all missions; what lies in missions/, aircraft/<kind>/, views/, studies/, report/<work>/ is somebody's room
TRUNK = (
    "flightsw/*.py", "flightsw/process/*.py", "flightsw/icd/*.py", "flightsw/filters/*.py", "flightsw/kernels/*.py",
    "flightsw/missions/base.py", "flightsw/missions/__init__.py", "hil_scripts/*.py", "hil_scripts/launch/*.py",
    "hil_scripts/campaign/*.py",
)  # fmt: skip
# a word that is a mission's name and means something else where it stands
MEANT = {
    ("flightsw/icd/codec_receive.py", "receiver"): "what receives",
    ("flightsw/icd/codec_flight.py", "receiver"): "what receives",
    ("hil_scripts/sil.py", "receiver"): "an aircraft's name in an example of the help",
}
# contracts and those who use them: no Any, no getattr
SEAMS = (
    "flightsw/missions/base.py", "flightsw/app.py", "flightsw/process/node.py", "flightsw/process/telemetry.py",
    "flightsw/sixdof/autopilot.py", "flightsw/missions/tanker/racetrack.py", "flightsw/missions/receiver/guidances.py",
    "flightsw/missions/receiver/station_keeping.py", "flightsw/missions/gust/laws.py", "flightsw/missions/windshear/control.py",
    "flightsw/missions/windshear/path.py",
)  # fmt: skip


def trunk() -> list[Path]:
    """Shared source files."""
    return sorted(p for pattern in TRUNK for p in ROOT.glob(pattern))


def words(path: Path) -> Iterator[str]:
    """Identifiers and texts of a source file, cut into words; comments and docstrings are talk and may name whom they like."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    talk = {
        node.body[0].value.lineno
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None
        and isinstance(node.body[0], ast.Expr)
    }  # fmt: skip
    for t in tokenize.generate_tokens(io.StringIO(text).readline):
        if t.type == tokenize.NAME or (t.type == tokenize.STRING and t.start[0] not in talk):
            yield from re.findall(r"[a-z]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", t.string).lower())


def named(path: Path) -> set[str]:
    """Missions a shared file names."""
    where = str(path.relative_to(ROOT))
    return {w for w in words(path) if w in MISSIONS and (where, w) not in MEANT}


@pytest.mark.parametrize("path", trunk(), ids=lambda p: str(p.relative_to(ROOT)))
def test_shared_files_name_no_mission(path: Path) -> None:
    assert named(path) == set()


def test_a_name_would_be_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.py").write_text('"""About the tanker."""\nclass TankerThing:\n    x = "gust"  # receiver\n')
    monkeypatch.setattr("tests.unit.test_house.ROOT", tmp_path)
    assert named(tmp_path / "a.py") == {"tanker", "gust"}


def statements(block: ast.AST) -> Iterator[ast.AST]:
    """All statements of a block, those for type checking alone left out; what is inside a statement is none."""
    for part in ("body", "orelse", "finalbody", "handlers", "cases"):
        for n in getattr(block, part, ()):
            if not (isinstance(n, ast.If) and isinstance(n.test, ast.Name) and n.test.id == "TYPE_CHECKING"):
                yield n
                yield from statements(n)


@cache
def graph() -> dict[str, set[str]]:
    """Module -> modules of the four programs it imports, those for type checking alone left out."""
    modules = {}
    for top in PROGRAMS:
        for p in (ROOT / top).rglob("*.py"):
            name = ".".join(p.relative_to(ROOT).with_suffix("").parts)
            modules[name.removesuffix(".__init__")] = p
    out: dict[str, set[str]] = {}
    for name, p in modules.items():
        found = set()
        for n in statements(ast.parse(p.read_text(encoding="utf-8"))):
            if isinstance(n, ast.Import):
                found |= {a.name for a in n.names}
            elif isinstance(n, ast.ImportFrom) and n.module:
                found |= {f"{n.module}.{a.name}" for a in n.names} | {n.module}
        out[name] = {f for f in found if f in modules} - {name}
    return out


def closure(roots: set[str]) -> set[str]:
    """Everything a set of modules imports, itself included."""
    seen: set[str] = set()
    todo = list(roots)
    while todo:
        m = todo.pop()
        if m not in seen:
            seen.add(m)
            todo += graph().get(m, set())
    return seen


def test_no_trunk_module_serves_one_mission_only() -> None:
    """What one mission alone reaches lies in that mission's folder. The process and the application reach everything they need
    without any mission."""
    specs = {e.value.partition(":")[0] for e in plugins.declared(plugins.MISSIONS).values()}
    rooms = {name: {s for s in specs if s.startswith(f"flightsw.missions.{name}.")} for name in MISSIONS}
    assert all(rooms.values())
    reached = {name: closure(roots) for name, roots in rooms.items()}
    process = closure({"flightsw.__main__", "flightsw.process.node", "flightsw.process.replay", "flightsw.process.accounts",
                       "flightsw.app", "flightsw.icd.gen"})  # fmt: skip
    lonely = {}
    for m in graph():
        if m.startswith("flightsw.") and not m.startswith("flightsw.missions.") and m not in process:
            users = sorted(n for n, r in reached.items() if m in r)
            package = any(other.startswith(f"{m}.") for other in graph())
            if len(users) < 2 and not package:
                lonely[m] = users
    assert lonely == {}


def test_imports_open_no_circle() -> None:
    g = graph()
    circles = sorted(m for m in g if any(m in closure({d}) for d in g[m]))
    assert circles == []


@pytest.mark.parametrize("where", SEAMS)
def test_seams_are_typed(where: str) -> None:
    names = {t.string for t in tokenize.generate_tokens(io.StringIO((ROOT / where).read_text()).readline)}
    assert not names & {"Any", "getattr", "hasattr"}


def test_every_mission_is_found_and_calls_itself_by_its_name() -> None:
    found = plugins.parts(plugins.MISSIONS, MissionSpec)
    assert {s.name for s in found.values()} == set(found)
    assert {"tanker", "receiver", "rendezvous", "receiver_rendezvous", "gust", "windshear"} <= set(found)


@pytest.mark.parametrize("path", HEAVY)
def test_what_is_dealt_out_first_exists(path: str) -> None:
    assert "def test_" in (ROOT / path).read_text(encoding="utf-8")
