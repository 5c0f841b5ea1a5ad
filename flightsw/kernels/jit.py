"""The one compiler decorator of the onboard software.

No fastmath and no parallel loops: compiled and plain Python must agree to the bit. NUMBA_DISABLE_JIT=1 runs every kernel
as plain Python. No entry for C programs is made of a kernel: nobody calls one, and a tenth of the compiling went into it.
"""

from __future__ import annotations

from flightsw.compiler import numba

jit = numba.njit(cache=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True)
