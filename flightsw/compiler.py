"""numba, imported the short way, for the two modules that compile kernels (flightsw.kernels.jit, sim_plant.kernels.jit).

Before its first kernel numba asks whether there is BLAS and imports all of scipy.linalg to see, which is an eighth of a second
of every start. No kernel of this project calls BLAS; compiling one that did would ask again.
"""

from __future__ import annotations

from importlib import import_module

import numba
from numba.np import linalg


def _unasked() -> None:
    """Import what asks, and answer yes: numba without scipy is not installed here. A numba that asks otherwise is left alone."""
    ask = getattr(linalg, "ensure_blas", None)
    if ask is None:
        return
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = ask


if not numba.config.DISABLE_JIT:
    _unasked()
