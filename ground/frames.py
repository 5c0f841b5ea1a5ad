"""Tables of pandas and polars, which are imported only where somebody asks for one."""

from __future__ import annotations

import importlib
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
