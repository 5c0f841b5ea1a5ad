"""The two compiler decorators of the onboard software.

No fastmath and no parallel loops: compiled and plain Python must agree to the bit. NUMBA_DISABLE_JIT=1 runs every kernel
as plain Python. No entry for C programs is made of a kernel: nobody calls one, and a tenth of the compiling went into it.

`jit` is for kernels that make no arrays. Theirs are taken as they are, without counting who holds them, which takes as long as
a small kernel's work: whoever calls holds them. `jit_own` is for kernels that make arrays of their own; others may call them.
"""

from __future__ import annotations

from flightsw.compiler import numba

jit_own = numba.njit(cache=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True, _nrt=True)
jit = numba.njit(cache=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True, _nrt=False)
