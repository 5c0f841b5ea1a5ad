"""A frame that is handed over is read and never written: who has something to add or to take away hands on a frame of his own."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MAKERS = {
    "flightsw/icd/codec_receive.py",
    "flightsw/icd/codec_orders.py",
    "flightsw/process/node.py",
}  # fill the frame of the tick, before anyone has it
CHANGE = {"append", "extend", "clear", "insert", "pop", "remove", "update", "sort"}


def _name(t: ast.expr) -> str:
    """What an attribute or an element hangs on, "" for a plain name."""
    inner = t
    while isinstance(inner, (ast.Attribute, ast.Subscript)):
        inner = inner.value
    return inner.id if isinstance(inner, ast.Name) and inner is not t else ""


def edits(text: str) -> list[str]:
    """Assignments into, and calls that change, an argument that is a SensorFrame."""
    out = []
    for f in ast.walk(ast.parse(text)):
        if not isinstance(f, ast.FunctionDef):
            continue
        args = (*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs)
        frames = {a.arg for a in args if a.annotation is not None and "SensorFrame" in ast.unparse(a.annotation)}
        for n in ast.walk(f):
            stored = isinstance(n, (ast.Attribute, ast.Subscript)) and not isinstance(n.ctx, ast.Load)
            call = isinstance(n, ast.Call) and isinstance(n.func, ast.Attribute) and n.func.attr in CHANGE
            setter = isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id in ("setattr", "delattr")
            if (
                (stored and _name(n) in frames)
                or (call and _name(n.func) in frames)
                or (setter and ast.unparse(n.args[0]) in frames)
            ):
                out.append(f"{f.name}, line {n.lineno}: {ast.unparse(n)}")
    return out


def test_no_frame_is_edited_in_place() -> None:
    found = {str(p.relative_to(ROOT)): edits(p.read_text()) for p in sorted((ROOT / "flightsw").rglob("*.py"))}
    assert {p: e for p, e in found.items() if e and p not in MAKERS} == {}


@pytest.mark.parametrize(
    "line",
    ["f.air_bad |= 1", "f.air_V = (1.0,)", "f.peer.wind_n[0] = 1.0", "f.commands.clear()", "setattr(f, 'updated', 0)"],
)
def test_an_edit_would_be_found(line: str) -> None:
    assert edits(f"def step(self, f: SensorFrame) -> None:\n    {line}\n")
    assert not edits(f"def step(self, f: NavState) -> None:\n    {line}\n")
    assert not edits(
        "def step(self, f: SensorFrame) -> SensorFrame:\n    x = f.air_V\n    return replace(f, air_bad=1)\n"
    )
