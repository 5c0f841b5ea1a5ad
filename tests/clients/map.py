"""MAVProxy whose map has no window: arguments are a file, then MAVProxy and its own. What its map module tells the window to draw
is written to the file, a JSON line each: [what, name, arguments, options]. The module itself is MAVProxy's.
"""

from __future__ import annotations

import json
import runpy
import sys
from collections.abc import Callable
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

WINDOW = "MAVProxy.modules.mavproxy_map.mp_slipmap"


class Window(ModuleType):
    """The module of the window, and the window: every call is written down. Shapes are their kind and what they were made of."""

    def __init__(self, out: Path) -> None:
        super().__init__(WINDOW)
        self._file = out.open("w", buffering=1)
        self.MPSlipMap = lambda **_: self
        self.mission_arcs = lambda *_: None

    def icon(self, name: str) -> str:
        """A picture, by its name."""
        return name

    def is_alive(self) -> bool:
        """Nobody closes it."""
        return True

    def add_object(self, shape: tuple[str, tuple[Any, ...], dict[str, Any]]) -> None:
        """A new shape."""
        self._note(*shape)

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("__"):
            raise AttributeError(name)
        if name.startswith("Slip"):
            return lambda *args, **more: (name, args, more)
        return lambda *args, **more: self._note(name, args, more)

    def _note(self, what: str, args: tuple[Any, ...], more: dict[str, Any]) -> None:
        print(json.dumps([what, args[0] if args else "", args[1:], more], default=str), file=self._file)


class Instead(MetaPathFinder, Loader):
    """Imports the window given in the place of MAVProxy's, so that its package has it like any module of its own."""

    def __init__(self, window: Window) -> None:
        self._window = window

    def find_spec(self, name: str, path: object, target: object = None) -> ModuleSpec | None:
        """The window alone."""
        return ModuleSpec(name, self) if name == WINDOW else None

    def create_module(self, spec: ModuleSpec) -> Window:
        """As it is."""
        return self._window

    def exec_module(self, module: ModuleType) -> None:
        """It is made already."""


def main() -> None:
    """MAVProxy, its window taken away."""
    sys.meta_path.insert(0, Instead(Window(Path(sys.argv[1]))))
    del sys.argv[:2]
    runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    main()
