"""Parts that are found, not imported: missions, kinds of aircraft and types of their records, views, studies and estimators, of
this project or of any other installed package, by the entry points both declare the same way.

A group's table in pyproject.toml: `name = "package.module:OBJECT"`. Where one part is named in a configuration,
`package.module:Class` does as well and needs no table.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from types import FunctionType
from typing import ParamSpec, TypeVar, cast

from flightsw.strict import ConfigError, Names, changed, near

GROUPS = tuple(
    f"wakefield.{group}"
    for group in ("missions", "aircraft", "records", "views", "studies", "estimators", "benches", "dialects")
)
MISSIONS, AIRCRAFT, RECORDS, VIEWS, STUDIES, ESTIMATORS, BENCHES, DIALECTS = GROUPS
EVERY_KEY: tuple[str, ...] = ("*",)  # `obeys` of a part that reads its whole table
PROGRAMS = ("flightsw", "sim_plant", "ground", "hil_scripts")  # packages of this project
T = TypeVar("T")
P = ParamSpec("P")


@dataclass(frozen=True)
class PartOf(Names):
    """The limit of a key that names a part: one declared in a group, or `package.module:Object`."""

    group: str

    @property
    def allowed(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names declared by whatever is installed."""
        return tuple(declared(self.group))

    def admits(self, value: str) -> bool:
        """Whether it is a declared name or the form of an undeclared one."""
        return ":" in value or super().admits(value)


@dataclass(frozen=True)
class OursOr(Names):
    """The limit of a key that names a part of one place: one of ours, or `package.module:Class` (`made`)."""

    allowed: tuple[str, ...]

    def admits(self, value: str) -> bool:
        """Whether it is one of ours or the form of anybody else's."""
        return ":" in value or super().admits(value)


@cache
def _installed() -> EntryPoints:
    """Every entry point of every installed package: reading their tables takes longer than all that is done with them."""
    return cast(EntryPoints, entry_points())  # Python 3.11 hands out a class of its own, which selects the same


@cache
def declared(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name, sorted. Raises ConfigError for a name two packages declare."""
    found: dict[str, EntryPoint] = {}
    for e in sorted(_installed().select(group=group), key=lambda e: e.name):
        other = found.setdefault(e.name, e)
        if other.value != e.value:
            raise ConfigError(f"{group}: {e.name!r} is declared by {_owner(other)} and by {_owner(e)}")
    return found


def look_again() -> None:
    """Forget what is installed: a package has come or gone."""
    _installed.cache_clear()
    declared.cache_clear()


def ours(group: str) -> tuple[str, ...]:
    """Names this project itself declares in a group."""
    return tuple(n for n, e in declared(group).items() if e.value.partition(".")[0] in PROGRAMS)


def packages() -> set[str]:
    """Top packages of others that declare a part in any group."""
    tops = {e.value.partition(":")[0].partition(".")[0] for group in GROUPS for e in declared(group).values()}
    return tops - set(PROGRAMS)


def _owner(e: EntryPoint) -> str:
    return f"{e.dist.name if e.dist else 'an unnamed package'} ({e.value})"


def part(group: str, name: str, kind: type[T], at: str) -> T:
    """The part a configuration calls `name` at the key `at`: declared in `group`, or `package.module:Object`.

    Raises ConfigError naming the key and what is allowed if there is none, it cannot be imported, or it is no `kind`.
    """
    module, colon, attribute = name.partition(":")
    known = declared(group)
    if not colon:
        if name not in known:
            raise ConfigError(
                f"{at} = {name!r}: allowed: {', '.join(known)}, or package.module:Object{near(name, known)}"
            )
        module, _, attribute = known[name].value.partition(":")
    found = _imported(module, attribute, f"{at} = {name!r}")
    if not isinstance(found, kind):
        raise ConfigError(
            f"{at} = {name!r}: {module}:{attribute} is a {type(found).__name__}; allowed: a {kind.__name__}"
        )
    return found


def _imported(module: str, attribute: str, what: str) -> object:
    """An object of a module. Raises ConfigError that begins with `what`."""
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as e:
        raise ConfigError(f"{what}: cannot be imported: {e}") from e


def made(
    ours: Mapping[str, Callable[P, T]], contract: type[T], name: str, at: str, *args: P.args, **kwargs: P.kwargs
) -> T:
    """The part of one place a configuration calls `name` at the key `at`, made from args: one of `ours`, or
    `package.module:Class`. contract: the Protocol it must fulfil.

    Raises ConfigError naming the key for one that does not exist, cannot be imported or made from that, or is no `contract`;
    whatever its making raises.
    """
    what, (module, colon, attribute) = f"{at} = {name!r}", name.partition(":")
    if not colon:
        if name not in ours:
            raise ConfigError(f"{what}: allowed: {', '.join(ours)}, or package.module:Class{near(name, ours)}")
        return ours[name](*args, **kwargs)
    build = _imported(module, attribute, what)
    if not callable(build):
        raise ConfigError(f"{what}: is {build!r}; allowed: a class that is a {contract.__name__}")
    wanted = {n: m for c in reversed(contract.__mro__) for n, m in {**inspect.get_annotations(c), **vars(c)}.items()
              if not n.startswith("_")}  # fmt: skip

    def lacking(part: object, names: Iterable[str]) -> None:
        if lacks := sorted(n for n in names if not hasattr(part, n)):
            raise ConfigError(f"{what}: lacks {', '.join(lacks)} of {contract.__module__}.{contract.__name__}")

    if isinstance(build, type):  # another kind of thing may take the same arguments, and fail on them
        lacking(build, (n for n, m in wanted.items() if isinstance(m, FunctionType)))
    _refuse_call(build, what, *args, **kwargs)
    new = build(*args, **kwargs)
    lacking(new, wanted)
    for n, m in wanted.items():
        if isinstance(m, FunctionType):
            _refuse_call(getattr(new, n), f"{what}: {n}", *list(inspect.signature(m).parameters)[1:])
    if not isinstance(new, contract):
        raise ConfigError(f"{what}: is no {contract.__module__}.{contract.__name__}")
    return new


def refuse_ignored(place: str, name: str, obeys: tuple[str, ...], record: object, default: object = None) -> None:
    """Raises ConfigError for a key of a table that somebody else's part does not obey and that is not as by default.

    place: key that names the part, in the table; obeys: keys read (dotted, a table's own for all of it), or EVERY_KEY; default:
    the record where nobody sets a key, None: as its class has it.
    """
    table, _, key = place.rpartition(".")
    if ":" not in name or EVERY_KEY[0] in obeys:
        return
    if (idle := changed(record, type(record)() if default is None else default, (key, *obeys))) is not None:
        raise ConfigError(
            f"{table}.{idle[0]} = {idle[1]!r}: not obeyed by {place} = {name!r}, which obeys {', '.join(obeys) or 'none'}; "
            "allowed: left out"
        )


def _refuse_call(f: Callable[..., object], what: str, *args: object, **kwargs: object) -> None:
    """Raises ConfigError that begins with `what` if f does not take these arguments."""
    if not callable(f):
        raise ConfigError(f"{what} is {f!r}; allowed: a method")
    try:
        inspect.signature(f).bind(*args, **kwargs)
    except TypeError as e:
        raise ConfigError(f"{what} takes {inspect.signature(f)}: {e}") from None


def parts(group: str, kind: type[T]) -> dict[str, T]:
    """Every part declared in a group, by name. Raises ConfigError naming what cannot be imported or is no `kind`."""
    return {name: part(group, name, kind, group) for name in declared(group)}
