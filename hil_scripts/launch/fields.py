"""Configuration dataclasses as rows of a table: key, default, limits, unit, and the comment beside the field in its source."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import io
import math
import re
import textwrap
import tokenize
import types
import typing
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from functools import cache
from typing import Annotated, Any, get_args, get_origin

from flightsw.plugins import OursOr, PartOf, ours
from flightsw.process.parameters import UNITS, wire_name
from flightsw.strict import IN_FLIGHT, Names, Range, bare, hints

IN_TEXT = re.compile(r"^\[([^\]]+)\]\s*")


@dataclass(frozen=True)
class Row:
    """One key that can be set. `table`: the dotted table it stands in, "" at the top; `about`: what its class says of itself."""

    table: str
    key: str
    kind: str
    default: str
    allowed: str
    unit: str
    text: str
    about: str
    wire: str = ""  # its name among MAVLink parameters; "" where it is none
    in_flight: bool = False


@cache
def comments(cls: type) -> dict[str, str]:
    """Comment beside, or in the lines of, each field of a dataclass and of those it inherits from. Empty where there is none."""
    out: dict[str, str] = {}
    for c in reversed(cls.__mro__):
        if not dataclasses.is_dataclass(c):
            continue
        source = textwrap.dedent(inspect.getsource(c))
        notes = {
            t.start[0]: t.string.lstrip("#").strip()
            for t in tokenize.generate_tokens(io.StringIO(source).readline)
            if t.type == tokenize.COMMENT and not t.string.startswith(("# fmt:", "# type:", "# noqa"))
        }
        (tree,) = ast.parse(source).body
        assert isinstance(tree, ast.ClassDef)
        for node in tree.body:
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
                out[node.target.id] = " ".join(notes[n] for n in lines if n in notes)
    return out


def rows(cls: type, default: Any = None, table: str = "") -> Iterator[Row]:
    """Every key of a configuration dataclass, own ones before those of its tables; `default`: a record with the defaults."""
    types_of, notes = hints(cls), comments(cls)
    about = "" if (cls.__doc__ or "").startswith(f"{cls.__name__}(") else " ".join((cls.__doc__ or "").split())
    tables = []
    for f in dataclasses.fields(cls):
        if not f.init:
            continue
        value = _default(f, default)
        inner, suffix = _inner(types_of[f.name])
        if inner is not None:
            name = f"{table}.{f.name}{suffix}" if table else f"{f.name}{suffix}"
            tables.append((inner, value if dataclasses.is_dataclass(value) else None, name))
            continue
        unit, text = UNITS.get(f.name.rpartition("_")[2], "") if "_" in f.name else "", notes.get(f.name, "")
        if m := IN_TEXT.match(text):
            unit, _, more = m[1].partition(", ")
            text = f"({more}) {text[m.end() :]}" if more else text[m.end() :]
        key = f"{table}.{f.name}" if table else f.name
        free = IN_FLIGHT in bare(types_of[f.name])[1]
        yield Row(
            table, f.name, _kind(types_of[f.name]), shown(value), _allowed(types_of[f.name]), unit, text, about,
            _wire(key, types_of[f.name], value), free,
        )  # fmt: skip
    for inner, record, name in tables:
        yield from rows(inner, record, name)


def _wire(key: str, tp: Any, value: Any) -> str:
    """Name on the wire: of a list the first and the last, of a text that is no choice none."""
    base, marks = bare(tp)
    if base is str:
        return wire_name(key) if any(isinstance(m, Names) for m in marks) else ""
    if base in (int, float, bool):
        return wire_name(key)
    if get_origin(base) in (tuple, list) and _kind(base).rpartition(" ")[2] in ("float", "int"):
        args = get_args(base)
        n = len(value) if isinstance(value, (tuple, list)) else len(args)
        return wire_name(f"{key}.0") + (f" ... {wire_name(f'{key}.{n - 1}')}" if n > 1 else "")
    return ""


def _default(f: dataclasses.Field[Any], base: Any) -> Any:
    if base is not None:
        return getattr(base, f.name)
    return f.default_factory() if f.default_factory is not MISSING else f.default


def _plain(tp: Any) -> Any:
    """A type without Annotated and without None."""
    if get_origin(tp) is Annotated:
        return _plain(get_args(tp)[0])
    if get_origin(tp) in (typing.Union, types.UnionType):
        return _plain(next(a for a in get_args(tp) if a is not type(None)))
    return tp


def _inner(tp: Any) -> tuple[type | None, str]:
    """Dataclass that is a table of its own, and how its name in a path ends: [] for each of a list, .<name> for any name."""
    tp = _plain(tp)
    if isinstance(tp, type) and dataclasses.is_dataclass(tp):
        return tp, ""
    args = get_args(tp)
    if get_origin(tp) in (tuple, list) and args and dataclasses.is_dataclass(_plain(args[0])):
        return _plain(args[0]), "[]"
    if get_origin(tp) is dict and len(args) == 2 and dataclasses.is_dataclass(_plain(args[1])):
        return _plain(args[1]), ".<name>"
    return None, ""


def _kind(tp: Any) -> str:
    tp = _plain(tp)
    origin, args = get_origin(tp), get_args(tp)
    if origin in (tuple, list):
        of = _kind(args[0])
        return f"list of {of}" if args[-1] is Ellipsis or origin is list else f"{len(args)} x {of}"
    if tp is dict or origin is dict:
        return "table"
    return {float: "float", int: "int", str: "text", bool: "true, false"}.get(tp, "any")


def _limits(tp: Any) -> Iterator[Range | Names]:
    for a in get_args(tp):
        if isinstance(a, (Range, Names)):
            yield a
        elif get_origin(a) is not None:
            yield from _limits(a)


def _allowed(tp: Any) -> str:
    out: list[str] = []
    for c in _limits(tp):
        if isinstance(c, Names):
            known = ours(c.group) if isinstance(c, PartOf) else c.allowed
            text = ", ".join(f"`{w}`" if w else '`""`' for w in known)
            text += ", or `package.module:Object`" if isinstance(c, (PartOf, OursOr)) else ""
        elif math.isinf(c.hi):
            text = f">= {c.lo:g}"
        elif math.isinf(c.lo):
            text = f"<= {c.hi:g}"
        else:
            text = f"{c.lo:g} to {c.hi:g}"
        if text not in out:
            out.append(text)
    return "; ".join(out)


def shown(value: Any) -> str:
    """A default as it would stand in TOML; "required" where there is none."""
    if value is MISSING:
        return "required"
    if value is None:
        return "not set"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(shown(v) for v in value) + "]"
    return "{}" if value == {} else str(value)
