"""State-like vectors are addressed by name: a bare number in their index, or for a measurement code, is found here."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.sixdof import layout
from flightsw.sixdof.params import parameter_vector

ROOT = Path(__file__).resolve().parents[2] / "flightsw"
FILES = sorted(
    {*ROOT.glob("sixdof/**/*.py"), *ROOT.glob("missions/receiver/*.py"), *ROOT.glob("missions/tanker/**/*.py")}
)
# by the last part of the name, leading underscore off: states and points, rates, factors, readings by code, tanker stages, design
# states, parameters
VECTORS = {"x", "xx", "X", "d", "S", "SQ", "h", "dh", "tk", "tks", "TKS", "stages", "z", "z0", "P", "codes"}
STAGES = {"tk"}  # begins with a rotation matrix, row by row: arithmetic on its nine entries is no layout


def bare(index: ast.expr, least: int = 0) -> bool:
    """Whether an index holds a number of at least `least` and no name of a place."""
    if isinstance(index, ast.Tuple):
        return any(bare(e, least) for e in index.elts)
    if isinstance(index, ast.Slice):
        return any(bare(e, least) for e in (index.lower, index.upper) if e is not None)
    parts = list(ast.walk(index))
    named = any(isinstance(n, ast.Name) and n.id.isupper() for n in parts)
    named |= any(isinstance(n, ast.Attribute) and n.attr.isupper() for n in parts)
    numbers = [n.value for n in parts if isinstance(n, ast.Constant) and type(n.value) is int]
    return not named and any(abs(n) >= least for n in numbers)


def _queues_a_row(n: ast.Call) -> bool:
    return isinstance(n.func, ast.Attribute) and n.func.attr == "add" and len(n.args) > 3


def faults(text: str) -> Iterator[tuple[int, str]]:
    """Line and text of each bare number."""
    for n in ast.walk(ast.parse(text)):
        if isinstance(n, ast.Subscript):
            base = (
                n.value.id
                if isinstance(n.value, ast.Name)
                else n.value.attr
                if isinstance(n.value, ast.Attribute)
                else ""
            )
            name = base.lstrip("_")
            if name in VECTORS and bare(n.slice, layout.TK_P if name in STAGES else 0):
                yield n.lineno, ast.unparse(n)
        elif isinstance(n, ast.Call) and _queues_a_row(n) and bare(n.args[0]):
            yield n.lineno, ast.unparse(n)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_bare_number_addresses_a_state(path: Path) -> None:
    assert list(faults(path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    "line",
    [
        "a = x[3]", "nav.core.ukf.x[12:15] = 0", "X[:, 12:15] += dW", "SQ[0:3, X_P] = G", "self._d[9 + i]", "tk[15 + i]",
        "tk[9:12]", "self._tks[2]", "S[:3, AIR] = 0", "v = d[2:]", "c.add(9 + i, y, r, GYRO)", "q = P[33]", "x[-1]",
    ],
)  # fmt: skip
def test_a_bare_number_would_be_found(line: str) -> None:
    assert [n for n, _ in faults(f"def f():\n    {line}\n")] == [2]


@pytest.mark.parametrize(
    "line",
    [
        "x[X_P + 1]", "X[:, WIND] += dW", "tk[3 * i + 2]", "tk[8]", "x[i]", "w[2]", "R[3]", "c.add(M_POS + i, y, r, GYRO)",
        "P[pv.CL0]",
    ],
)  # fmt: skip
def test_names_and_rotations_are_let_pass(line: str) -> None:
    assert list(faults(f"def f():\n    {line}\n")) == []


def test_names_lie_side_by_side() -> None:
    """Every entry of the state and of a tanker stage has one name; slices cover them without a gap."""
    x = [getattr(layout, n) for n in vars(layout) if n.startswith("X_")]
    assert sorted(x) == list(range(layout.NX_ROT))
    v = np.arange(layout.NX_ROT)
    parts = (layout.AIR, layout.RATE, layout.EULER, layout.POS, layout.WIND, layout.ROT)
    assert np.concatenate([v[s] for s in parts]).tolist() == v.tolist()
    stage = np.arange(layout.TK)
    parts = (layout.TK_DCM, layout.TK_RATE, layout.TK_RATE_DOT, layout.TK_VEL)
    assert np.concatenate([stage[s] for s in parts]).tolist() == stage.tolist()
    assert layout.N_WN - layout.NX == 0 and layout.X_PE + layout.BEYOND == layout.N_WD + 1
    assert len(parameter_vector(load_aircraft("learjet24"), 5000.0)) == 34
