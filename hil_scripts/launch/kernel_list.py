"""The list of kernels that missions of this project compile, and compiling it on several cores at once.

A flight compiles a kernel when it first calls it, one after the other; from a list, two processes share the work. The list is a
hint: what is missing in it compiles in flight, what it names and is no kernel any more is passed over (a test tells of both).
`python -m hil_scripts.launch.kernel_list` writes it anew.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

LIST = Path(__file__).with_name("kernels.txt")
SECONDS = 4.0  # [s] simulated of each scenario; long enough for every rate group of the plant


class Entry(NamedTuple):
    """A function by `package.module.name` and the types it is compiled for, as numba writes them: `float64[:,::1], int64, 7`."""

    name: str
    types: str


def entries(path: Path = LIST) -> list[Entry]:
    """The kernels of a list. Raises OSError if it cannot be read, ValueError for a line that is not `name(types)`."""
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        name, bracket, types = line.partition("(")
        if not bracket or not types.endswith(")"):
            raise ValueError(f"{path}, line {number}: '{line}' is not a name and its types in brackets")
        found.append(Entry(name, types[:-1]))
    return found


def kernel(name: str) -> Any:
    """The compiled function of that name, None if there is none."""
    module, _, function = name.rpartition(".")
    try:
        found = getattr(importlib.import_module(module), function, None)
    except ImportError:
        return None
    return found if hasattr(found, "py_func") else None


def signature(types: str) -> tuple[Any, ...]:
    """numba's types of an entry; a bare number or truth value is one fixed at compile time."""
    from numba.core import types as nt

    names = vars(nt)
    read = eval(f"({types},)" if types else "()", names)  # own file, as executable as this one
    return tuple(names["literal"](t) if isinstance(t, bool | int) else t for t in read)


def written(types: tuple[Any, ...]) -> str | None:
    """The opposite of `signature`, None where a type is neither number, array, tuple of numbers nor fixed number."""
    words = []
    for t in types:
        word = str(getattr(t, "literal_value", t)).replace("bool", "boolean")
        if hasattr(t, "layout"):
            axes = [":"] * t.ndim
            if t.layout in "CF":
                axes[-1 if t.layout == "C" else 0] = "::1"
            word = f"{t.dtype}[{','.join(axes)}]"
        elif hasattr(t, "count"):  # a tuple of numbers of one type
            word = f"UniTuple({t.dtype}, {t.count})"
        words.append(word)
    text = ", ".join(words)
    try:
        return text if signature(text) == types else None
    except (NameError, SyntaxError, TypeError):
        return None


def level(function: Any, known: dict[Any, int]) -> int:
    """How deep calls of kernels go below a kernel: 0 where it calls none. Those of a level can be compiled side by side."""
    if function not in known:
        known[function] = 0  # no kernel here calls itself
        known[function] = max((level(f, known) + 1 for f in _called(function.py_func)), default=0)
    return known[function]


def _called(function: Any) -> Iterator[Any]:
    names = function.__code__.co_names
    for name in names:
        found = function.__globals__.get(name)
        if isinstance(found, ModuleType):
            yield from (f for n in names if hasattr(f := getattr(found, n, None), "py_func"))
        elif hasattr(found, "py_func"):
            yield found


def bulk(function: Any) -> int:
    """Bytes of code of a kernel and of all it calls, a callee once for every call: what takes long to compile has many."""
    return len(function.py_func.__code__.co_code) + sum(bulk(f) for f in _called(function.py_func))


def compile_claimed(claims: Path) -> None:
    """Compile what is in the list and no other process that looks into the folder `claims` has begun: callees first, of a level
    the long ones, so that no process comes to the next level, and compiles a callee there, while another is still at it."""
    known: dict[Any, int] = {}
    work = [(level(k, known), -bulk(k), e, k) for e in entries() if (k := kernel(e.name)) is not None]
    for place, (*_, entry, function) in enumerate(sorted(work, key=lambda w: w[:3])):
        try:
            os.close(os.open(claims / f"kernel-{place}", os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            continue
        function.compile(signature(entry.types))


def record(scenarios: list[str]) -> list[Entry]:
    """What the flights of these scenarios compile in this process, callees and all; run where nothing is compiled yet."""
    from numba.core import event

    from hil_scripts.launch.inproc import fly_a_little

    found = set()

    class Seen(event.Listener):  # type: ignore[misc]
        """Notes every kernel that is compiled."""

        def on_start(self, event: Any) -> None:
            """Nothing is known yet."""

        def on_end(self, event: Any) -> None:
            """Its name and the types it was compiled for."""
            function = event.data["dispatcher"].py_func
            name = f"{function.__module__}.{function.__name__}"
            if kernel(name) is event.data["dispatcher"] and (types := written(event.data["args"])) is not None:
                found.add(Entry(name, types))

    with event.install_listener("numba:compile", Seen()):
        for scenario in scenarios:
            fly_a_little(scenario, SECONDS)
    return sorted(found)


def main() -> None:
    """Write the list anew, from flights of all scenarios in a process that finds nothing compiled."""
    from hil_scripts.launch.runfolder import scenario_names

    found = record(scenario_names())
    LIST.write_text("".join(f"{e.name}({e.types})\n" for e in found), encoding="utf-8")
    print(f"{LIST}: {len(found)} kernels")


if __name__ == "__main__":
    if "--here" in sys.argv:
        main()
    else:
        with tempfile.TemporaryDirectory(prefix="wakefield-") as folder:
            again = [sys.executable, "-m", "hil_scripts.launch.kernel_list", "--here"]
            sys.exit(subprocess.run(again, env={**os.environ, "NUMBA_CACHE_DIR": folder}, check=False).returncode)
