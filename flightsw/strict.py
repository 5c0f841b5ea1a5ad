"""Strict typed TOML: every key known, every value of the right type and in range, errors that name the key.

Configuration is plain frozen dataclasses. Limits are written beside the field:

    rate_hz: Annotated[float, Range(1.0, 1000.0)] = 100.0
"""

from __future__ import annotations

import dataclasses
import math
import tomllib
import types
import typing
from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

from flightsw.tables import tables

T = TypeVar("T")
Tree = dict[str, Any]  # a parsed TOML table


class ConfigError(ValueError):
    """A configuration value is unknown, missing, of the wrong type or out of range. The text names key and value."""


def near(word: object, known: Iterable[str]) -> str:
    """The words "; did you mean 'x'?" for the name of `known` closest to what was written, "" if none is close."""
    lower = {k.lower(): k for k in known}
    found = get_close_matches(str(word).lower(), lower, n=1)
    return f"; did you mean {lower[found[0]]!r}?" if found else ""


@dataclass(frozen=True)
class Range:
    """Closed interval a number (or every number of a list) must lie in."""

    lo: float = -math.inf
    hi: float = math.inf


class Names:
    """A limit to certain strings: those `allowed`, and whatever else is admitted."""

    allowed: tuple[str, ...]

    def admits(self, value: str) -> bool:
        """Whether a value may be taken."""
        return value in self.allowed


@dataclass(frozen=True)
class OneOf(Names):
    """The strings a value may take."""

    allowed: tuple[str, ...]


class InFlight:
    """Mark of a key that may be changed in flight: what reads it does so anew at every step."""


IN_FLIGHT = InFlight()


def read_toml(path: str | Path, _above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Parse a TOML file. `base = "other.toml"` takes everything from that file beside it, key by key, and changes it.

    Raises ConfigError naming the file if it is missing, unreadable, malformed or its own base.
    """
    here = Path(path).resolve()
    try:
        data = tables(Path(path).read_bytes())
    except OSError as e:
        raise ConfigError(f"{path}: cannot be read: {e.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise ConfigError(f"{path}: not valid TOML: {e}") from None
    base = data.pop("base", None)
    if base is None:
        return data
    if not isinstance(base, str) or here in _above:
        raise ConfigError(f"{path}: base = {base!r}: allowed: the name of another file that is not based on this one")
    return _merge(read_toml(here.parent / base, (*_above, here)), data)


def _merge(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    """Tables are merged key by key; anything else of `own` replaces what `base` has."""
    for k, v in own.items():
        if isinstance(v, dict) and isinstance(base.get(k), dict):
            _merge(base[k], v)
        else:
            base[k] = v
    return base


def load(path: str | Path, cls: type[T], overrides: dict[str, Any] | None = None) -> T:
    """Read `path` into dataclass `cls`; `overrides` maps dotted keys to values (strings are parsed as TOML values).

    Raises ConfigError naming file, key, value and what is allowed.
    """
    data = read_toml(path)
    apply_overrides(data, overrides or {}, str(path))
    return convert(data, cls, str(path))


def apply_overrides(data: dict[str, Any], overrides: dict[str, Any], where: str) -> None:
    """Set dotted keys in a parsed TOML tree in place; `a.0.b` indexes arrays of tables. Raises ConfigError."""
    for key, raw in overrides.items():
        value = parse_value(raw) if isinstance(raw, str) else raw
        node: Any = data
        parts = key.split(".")
        for i, part in enumerate(parts[:-1]):
            if isinstance(node, list):
                node = _list_item(node, part, key, where)
            else:
                nxt = node.setdefault(part, {})
                if not isinstance(nxt, (dict, list)):
                    raise ConfigError(
                        f"{where}: override {key!r}: {'.'.join(parts[: i + 1])!r} is a value, not a table"
                    )
                node = nxt
        if isinstance(node, list):
            raise ConfigError(f"{where}: override {key!r} ends in a list; name a key of one of its entries")
        node[parts[-1]] = value


def _list_item(node: list[Any], part: str, key: str, where: str) -> Any:
    """Entry of an array of tables by index or by its `name`."""
    if part.isdigit() and int(part) < len(node):
        return node[int(part)]
    for item in node:
        if isinstance(item, dict) and item.get("name") == part:
            return item
    names = [str(i.get("name", k)) if isinstance(i, dict) else str(k) for k, i in enumerate(node)]
    raise ConfigError(
        f"{where}: override {key!r}: no entry {part!r}; allowed: {', '.join(names) or 'none'}{near(part, names)}"
    )


def parse_value(text: str) -> Any:
    """A TOML value from a command line; a bare word is a string."""
    try:
        return tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        return text


def convert(data: Any, cls: type[T], where: str) -> T:
    """Convert a parsed TOML tree to `cls`, checking it whole. Raises ConfigError."""
    return typing.cast(T, _convert(data, cls, where, ""))


def to_dict(obj: Any) -> Any:
    """The inverse of `convert`: plain dicts and lists of a configuration dataclass (None left out)."""
    if dataclasses.is_dataclass(obj) and not isinstance(obj, type):
        return {f.name: to_dict(v) for f in dataclasses.fields(obj) if (v := getattr(obj, f.name)) is not None}
    if isinstance(obj, (list, tuple)):
        return [to_dict(v) for v in obj]
    if isinstance(obj, dict):
        return {k: to_dict(v) for k, v in obj.items() if v is not None}
    return obj


def changed(value: Any, default: Any, but: tuple[str, ...] = ()) -> tuple[str, Any] | None:
    """First key (dotted) and value in which a configuration record differs from its defaults, leaving out the keys `but`
    (dotted; a table's own leaves out all of it)."""
    if not dataclasses.is_dataclass(value):
        return None if value == default else ("", value)
    for f in dataclasses.fields(value):
        if f.name in but:
            continue
        below = tuple(b.removeprefix(f"{f.name}.") for b in but if b.startswith(f"{f.name}."))
        found = changed(getattr(value, f.name), getattr(default, f.name), below)
        if found is not None:
            return (f"{f.name}.{found[0]}" if found[0] else f.name), found[1]
    return None


def _at(where: str, key: str) -> str:
    return f"{where}: {key}" if key else where


def _convert(v: Any, tp: Any, where: str, key: str, base: Any = None) -> Any:
    """base: the record a table changes; without one it changes the defaults of its class."""
    origin, args = get_origin(tp), get_args(tp)
    if origin is Annotated:
        out = _convert(v, args[0], where, key, base)
        for c in args[1:]:
            _check(out, c, where, key)
        return out
    if origin in (typing.Union, types.UnionType):
        return None if v is None else _convert(v, next(a for a in args if a is not type(None)), where, key, base)
    if dataclasses.is_dataclass(tp):
        return _convert_table(v, tp, where, key, base)
    if origin in (tuple, list):
        return _convert_list(v, origin, args, where, key)
    if origin is dict or tp is dict:
        if not isinstance(v, dict):
            raise ConfigError(f"{_at(where, key)} = {v!r}: expected a table")
        return {k: _convert(x, args[1], where, f"{key}.{k}") if args else x for k, x in v.items()}
    if tp is float and isinstance(v, int) and not isinstance(v, bool):
        return float(v)
    if tp is float and isinstance(v, float) and not math.isfinite(v):
        raise ConfigError(f"{_at(where, key)} = {v!r}: expected a finite number")
    if tp is Any:
        return v
    if not isinstance(v, tp) or (tp is int and isinstance(v, bool)):
        raise ConfigError(f"{_at(where, key)} = {v!r}: expected {tp.__name__}, got {type(v).__name__}")
    return v


def _convert_list(v: Any, origin: Any, args: tuple[Any, ...], where: str, key: str) -> Any:
    if not isinstance(v, list):
        raise ConfigError(f"{_at(where, key)} = {v!r}: expected a list")
    if origin is tuple and args[-1] is not Ellipsis:
        if len(v) != len(args):
            raise ConfigError(f"{_at(where, key)} = {v!r}: expected {len(args)} values, got {len(v)}")
        return tuple(_convert(x, a, where, f"{key}[{i}]") for i, (x, a) in enumerate(zip(v, args, strict=True)))
    return origin(_convert(x, args[0], where, f"{key}[{i}]") for i, x in enumerate(v))


def _default(f: dataclasses.Field[Any], base: Any) -> Any:
    """What a field is if nobody sets it: as in `base`, else as in its class; MISSING if it must be set."""
    if base is not None:
        return getattr(base, f.name)
    return f.default_factory() if f.default_factory is not dataclasses.MISSING else f.default


def _convert_table(v: Any, cls: Any, where: str, key: str, base: Any) -> Any:
    if not isinstance(v, dict):
        raise ConfigError(f"{_at(where, key)} = {v!r}: expected a table")
    types_of = hints(cls)
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}
    for k in v:
        if k not in fields:
            at = _at(where, f"{key}.{k}" if key else k)
            raise ConfigError(f"{at}: unknown key; allowed: {', '.join(fields)}{near(k, fields)}")
    out = {}
    for name, f in fields.items():
        sub = f"{key}.{name}" if key else name
        own = _default(f, base)
        if name in v:
            # a table that sets some keys of a record leaves the others as this record's own default has them
            out[name] = _convert(v[name], types_of[name], where, sub, own if dataclasses.is_dataclass(own) else None)
        elif own is dataclasses.MISSING:
            raise ConfigError(f"{_at(where, sub)}: missing key")
        else:
            out[name] = own
    try:
        return cls(**out)
    except ConfigError:
        raise
    except ValueError as e:
        raise ConfigError(f"{_at(where, key)}: {e}") from None


def _check(v: Any, c: Any, where: str, key: str) -> None:
    if isinstance(c, Range):
        for x in v if isinstance(v, (list, tuple)) else (v,):
            if x is not None and not c.lo <= x <= c.hi:
                raise ConfigError(f"{_at(where, key)} = {x!r}: allowed {c.lo:g} to {c.hi:g}")
    elif isinstance(c, Names) and not c.admits(v):
        raise ConfigError(f"{_at(where, key)} = {v!r}: allowed: {', '.join(c.allowed)}{near(v, c.allowed)}")


@cache
def hints(cls: type) -> dict[str, Any]:
    """Types of the fields of a dataclass, limits and marks with them."""
    return typing.get_type_hints(cls, include_extras=True)


def bare(tp: Any) -> tuple[Any, list[Any]]:
    """A type without its limits and without None, and the limits and marks."""
    marks: list[Any] = []
    while True:
        if get_origin(tp) is Annotated:
            marks += tp.__metadata__
            tp = tp.__origin__
        elif get_origin(tp) in (typing.Union, types.UnionType):
            tp = next(a for a in get_args(tp) if a is not type(None))
        else:
            return tp, marks


def replaced(record: Any, path: list[str], value: Any) -> Any:
    """The record with one value changed; it checks itself anew. Raises ValueError, and KeyError for a path that leads nowhere."""
    head, rest = path[0], path[1:]
    if isinstance(record, (tuple, list)):
        items = list(record)
        items[int(head)] = replaced(items[int(head)], rest, value) if rest else value
        return type(record)(items)
    if not dataclasses.is_dataclass(record) or isinstance(record, type) or head not in hints(type(record)):
        raise KeyError(head)
    return dataclasses.replace(record, **{head: replaced(getattr(record, head), rest, value) if rest else value})
