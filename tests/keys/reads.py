"""Which fields of configuration records are read by name, and by whom: reads are recorded while flights are built and flown.

Not counted: what copies, prints, shows, compares or checks a record as a whole (dataclasses, strict, parameters, refusals), and
a record's own checks in __post_init__.
"""

from __future__ import annotations

import dataclasses
import sys
import typing
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from flightsw.strict import hints

GENERIC = (
    "/dataclasses.py", "/flightsw/strict.py", "/sim_plant/obeyed.py", "/flightsw/process/parameters.py", "/copy.py", "/pickle.py",
    "<string>",
)  # fmt: skip


def records(cls: Any, found: set[type] | None = None) -> set[type]:
    """`cls` and every dataclass in the types of its fields, theirs included."""
    found = set() if found is None else found
    if dataclasses.is_dataclass(cls) and isinstance(cls, type) and cls not in found:
        found.add(cls)
        for tp in hints(cls).values():
            for part in _parts(tp):
                records(part, found)
    return found


def _parts(tp: Any) -> Iterator[Any]:
    yield tp
    for a in typing.get_args(tp):
        yield from _parts(a)


class Reads:
    """`seen`: (class, field) read so far."""

    def __init__(self, classes: set[type]) -> None:
        self.classes = classes
        self.seen: set[tuple[type, str]] = set()
        self._held = {
            c: {name: {p for p in _parts(tp) if isinstance(p, type)} for name, tp in hints(c).items()} for c in classes
        }
        self._parts = {c: classes & set().union(*v.values()) for c, v in self._held.items()}

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Record reads of the classes' fields while inside."""
        before = {}
        for cls in self.classes:
            before[cls] = cls.__dict__.get("__getattribute__")
            cls.__getattribute__ = self._reader(cls)  # type: ignore[method-assign, assignment]
        try:
            yield
        finally:
            for cls, old in before.items():
                if old is None:
                    del cls.__getattribute__
                else:
                    cls.__getattribute__ = old  # type: ignore[method-assign]

    def _reader(self, cls: type) -> Any:
        names = {f.name for f in dataclasses.fields(cls)}
        seen, plain, frame = self.seen, object.__getattribute__, sys._getframe

        def read(obj: Any, name: str) -> Any:
            if name in names and (type(obj), name) not in seen:
                code = frame(1).f_code
                if code.co_name != "__post_init__" and not code.co_filename.endswith(GENERIC):
                    seen.add((type(obj), name))
            return plain(obj, name)

        return read

    def holders(self, cls: type) -> set[str]:
        """Names of the record, its bases and heirs, and of the records that hold one of them."""
        found, last = {c for c in self.classes if issubclass(c, cls) or issubclass(cls, c)}, 0
        while len(found) > last:
            last = len(found)
            for c in self.classes:
                if self._parts[c] & found or any(issubclass(f, c) or issubclass(c, f) for f in found):
                    found.add(c)
        return {b.__name__ for c in found for b in c.__mro__ if dataclasses.is_dataclass(b)}

    def places(self, cls: type) -> set[str]:
        """Names of the fields in which records hold this one."""
        out = set()
        for held in self._held.values():
            out |= {name for name, parts in held.items() if any(issubclass(p, cls) for p in parts)}
        return out

    def unread(self) -> list[tuple[type, str]]:
        """Fields of the classes that nothing has read; read of an heir or a base counts."""
        out = []
        for cls in self.classes:
            for f in dataclasses.fields(cls):
                family = {c for c in self.classes if issubclass(c, cls) or issubclass(cls, c)}
                if f.init and not any((c, f.name) in self.seen for c in family):
                    out.append((cls, f.name))
        return sorted(out, key=lambda u: (u[0].__name__, u[1]))
