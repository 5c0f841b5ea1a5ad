"""The plant's two decorators for compiled kernels.

`fastmath=False` keeps compiled and interpreted results equal to the bit; `error_model="numpy"` keeps division free of
exception paths; no entry for C programs is made, which nobody calls and which takes a tenth of the compiling. Arrays are taken
as they are, without counting who holds them, which takes as long as a small kernel's work: whoever calls holds them. With
NUMBA_DISABLE_JIT=1 the same functions run as plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from flightsw.compiler import numba

F = TypeVar("F", bound=Callable[..., Any])


def jit(func: F) -> F:
    """Compile `func` with the project's settings (cached on disk, strict floating point). It makes no arrays."""
    return cast(F, _compiler(_nrt=False)(func))


def jit_own(func: F) -> F:
    """The same of one that makes arrays of its own; others may call it."""
    return cast(F, _compiler(_nrt=True)(func))


def _compiler(**more: bool) -> Any:
    return numba.njit(cache=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True, **more)
