"""Compiled kernels into memory before a deadline needs them.

numba loads a kernel from its cache at the first call, for 2 to 10 ms. What the warm-up's level flight does not call (a turn, a
fault, a contact) would do so in flight, and a tick of 2.5 or 10 ms would be missed for it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any

from flightsw import plugins
from flightsw.compiler import numba

DISPATCHER = numba.core.dispatcher.Dispatcher


def kernels(packages: Iterable[str]) -> list[Any]:
    """Every kernel that an imported module of these top packages names, once each, in the order of their names."""
    tops = set(packages)
    found: dict[int, Any] = {}
    for name in sorted(sys.modules):
        if name.partition(".")[0] in tops:
            for part in vars(sys.modules[name]).values():
                if isinstance(part, DISPATCHER):
                    found[id(part)] = part
    return list(found.values())


def preload(program: str) -> int:
    """Load every form of the `kernels` of a program, and of packages that bring parts of it, that numba's cache holds.

    Returns how many were loaded. What was never compiled is left to its first call, and so is all of it without a cache."""
    n = 0
    for kernel in kernels({program, *plugins.packages()}):
        file = getattr(kernel._cache, "_cache_file", None)  # of numba: no public way leads to what a cache holds
        for signature, *_ in () if file is None else file._load_index():
            if signature not in kernel.overloads:
                kernel.compile(signature)
                n += 1
    return n
