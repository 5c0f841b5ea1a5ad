"""The one compiler decorator of the onboard software, and the only importer of numba there.

No fastmath and no parallel loops: compiled and plain Python must agree to the bit. NUMBA_DISABLE_JIT=1 runs every kernel
as plain Python.
"""

from __future__ import annotations

import numba

jit = numba.njit(cache=True, fastmath=False, error_model="numpy")
