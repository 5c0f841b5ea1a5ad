"""The plant's one decorator for compiled kernels.

`fastmath=False` keeps compiled and interpreted results equal to the bit; `error_model="numpy"` keeps division free of
exception paths; no entry for C programs is made, which nobody calls and which takes a tenth of the compiling. With
NUMBA_DISABLE_JIT=1 the same functions run as plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from flightsw.compiler import numba

F = TypeVar("F", bound=Callable[..., Any])


def jit(func: F) -> F:
    """Compile `func` with the project's settings (cached on disk, strict floating point)."""
    return cast(F, numba.njit(cache=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True)(func))
