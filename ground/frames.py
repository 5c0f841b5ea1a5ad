"""Tables of pandas and polars, which are imported only where somebody asks for one."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

EXTRA = "data"  # optional dependencies of this project that bring them
KINDS = ("pandas", "polars")


def need(module: str) -> ModuleType:
    """A module of the extra. Raises ImportError naming the extra and how it is installed."""
    try:
        return importlib.import_module(module)
    except ImportError as e:
        raise ImportError(
            f"{module} is not installed: it comes with the extra `{EXTRA}`: pip install 'wakefield[{EXTRA}]', or pip install "
            f"{module.partition('.')[0]}"
        ) from e


class _Hidden(importlib.abc.MetaPathFinder):
    """Finds no pandas."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """None for others. Raises ImportError for pandas."""
        if name == "pandas":
            raise ImportError("not asked for")
        return None


def unasked() -> None:
    """Keep pyarrow from importing pandas, which takes a third of a second: it looks for it, once, at its first array. For a
    program that makes no table."""
    import pyarrow

    if "pandas" not in sys.modules:
        hidden = _Hidden()
        sys.meta_path.insert(0, hidden)
        try:
            pyarrow.array([0])
        finally:
            sys.meta_path.remove(hidden)


def frame(t: NDArray[np.float64], columns: dict[str, NDArray], kind: str) -> Any:
    """Columns [N] with times t [N] s: the index of a pandas table, the column `t` of a polars one. Raises ValueError for another
    kind, ImportError."""
    if kind == "pandas":
        pandas = need("pandas")
        return pandas.DataFrame(columns, index=pandas.Index(t, name="t"))
    if kind == "polars":
        values = {k: v.tolist() if v.dtype.kind == "O" else v for k, v in columns.items()}
        return need("polars").DataFrame({"t": t} | values)
    raise ValueError(f"kind = {kind!r}: allowed: {', '.join(KINDS)}")
