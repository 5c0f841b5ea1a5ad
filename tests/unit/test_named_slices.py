"""States, measurements, noise columns and parameter vectors are addressed by name, not by number.

Every index that is a bare number is refused, whatever the array is called, but for arithmetic that counts axes: those names are
listed with their files.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (
    "flightsw/filters",
    "flightsw/planar",
    "flightsw/missions/gust",
    "flightsw/missions/receiver/airdata",
    "flightsw/missions/rendezvous",
    "flightsw/missions/windshear",
)
# vectors in space, points of a plane, direction cosines, bases of a null space, first row of a workspace, ends of a queue or list
ARITHMETIC = {
    "flightsw/filters/augmented.py": {"U"},
    "flightsw/filters/kalman.py": {"W"},
    "flightsw/filters/srukf.py": {"B"},
    "flightsw/filters/ukf.py": {"U"},
    "flightsw/missions/gust/design.py": {"sv"},
    "flightsw/missions/gust/servo_bank/nav.py": {"sent"},
    "flightsw/missions/gust/servos.py": {"fifo"},
    "flightsw/missions/receiver/airdata/contour/algorithms.py": {"one", "p", "probes"},
    "flightsw/missions/receiver/airdata/contour/contours.py": {"offsets", "points"},
    "flightsw/missions/receiver/airdata/contour/intersect.py": {"a", "b", "out"},
    "flightsw/missions/receiver/airdata/contour/position.py": {"pos_f", "y", "z"},
    "flightsw/missions/receiver/airdata/contour/wake_map.py": {"missing"},
    "flightsw/missions/receiver/airdata/expected.py": {"C"},
    "flightsw/missions/receiver/airdata/fdi/metrics.py": {"a"},
    "flightsw/missions/receiver/airdata/fdi/parity.py": {"T", "V", "u"},
    "flightsw/missions/receiver/airdata/fdi/parity_kernels.py": {"V", "h", "mu", "probes", "t", "w"},
    "flightsw/missions/receiver/airdata/params.py": {"idle"},
    "flightsw/missions/receiver/airdata/wake_kernel.py": {"C", "W", "e", "omega", "out", "probes", "w", "xi", "xi_dot"},
    "flightsw/missions/receiver/airdata/wake_model.py": {"C", "W", "at", "e", "fuselage", "span", "xi"},
}


def _number(n: ast.expr | None) -> bool:
    n = n.operand if isinstance(n, ast.UnaryOp) else n
    return isinstance(n, ast.Constant) and type(n.value) is int


def _bare(i: ast.expr) -> bool:
    """Whether an index holds a number that means something: an end of a slice does, a step does not."""
    if isinstance(i, ast.Tuple):
        return any(map(_bare, i.elts))
    if isinstance(i, ast.Slice):
        return _number(i.lower) or _number(i.upper)
    return _number(i)


def _name(n: ast.expr) -> str:
    """Name of an array, `x` of self._x and of x[i] too; "" for what has none."""
    while isinstance(n, ast.Subscript):
        n = n.value
    return n.id if isinstance(n, ast.Name) else n.attr.lstrip("_") if isinstance(n, ast.Attribute) else ""


def bare_indices(text: str, arithmetic: frozenset[str] = frozenset()) -> list[str]:
    """Places where an array that has a name is indexed by a number."""
    return [
        f"{n.lineno}: {ast.unparse(n)}"
        for n in ast.walk(ast.parse(text))
        if isinstance(n, ast.Subscript) and _bare(n.slice) and _name(n.value) not in arithmetic | {"shape", ""}
    ]


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_state_is_addressed_by_a_bare_number(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    assert files
    found = {}
    for p in files:
        name = str(p.relative_to(ROOT))
        found[name] = bare_indices(p.read_text(encoding="utf-8"), frozenset(ARITHMETIC.get(name, ())))
    assert {name: places for name, places in found.items() if places} == {}


def test_exceptions_are_needed() -> None:
    for name, names in ARITHMETIC.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        for one in names:
            assert bare_indices(text, frozenset(names - {one})), f"{name}: {one} is no longer indexed by number"


@pytest.mark.parametrize(
    "line", ["x[3] = 1.0", "a = P[0, k]", "self._y[3:6] = v", "d = X[i, -1]", "m = f.x[:2]", "b = s['head'][0]"]
)
def test_a_bare_index_would_be_found(line: str) -> None:
    assert len(bare_indices(line)) == 1


@pytest.mark.parametrize(
    "line",
    ["x[X_V] = 1.0", "n = P.shape[0]", "a = S[i, j]", "y = fuse(x)[0]", "b = x[::2]", "q[AIR] = v", "x[i + 1] = 0"],
)
def test_names_and_running_numbers_pass(line: str) -> None:
    assert bare_indices(line) == []
