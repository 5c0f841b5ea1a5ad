"""Shared by all tests: one numerical thread, the launcher's kernel cache, ports that parallel workers do not share."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable

import hypothesis
import pytest

from hil_scripts import kernel_cache
from hil_scripts.procs import SINGLE_THREAD

# before numpy and numba are imported by any test
os.environ.update(SINGLE_THREAD)
if os.environ.get("NUMBA_DISABLE_JIT") != "1":
    kernel_cache.use()

# no deadline: the first call of a compiled kernel takes seconds; the same examples everywhere: a failure repeats
hypothesis.settings.register_profile("wakefield", deadline=None, derandomize=True)
hypothesis.settings.load_profile("wakefield")

FIRST_OFFSET = 3000
PER_WORKER = 600  # ports of one xdist worker
STEP = 30  # between two runs of a worker; never 39..42, 40 or 49..52: no port of one run is another port of the next


@pytest.fixture(scope="session")
def next_port_offset() -> Callable[[], int]:
    """Call it for a --port-offset no other test of this session uses."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    base = FIRST_OFFSET + PER_WORKER * int(worker[2:])
    counter = itertools.count()
    return lambda: base + STEP * (next(counter) % (PER_WORKER // STEP))


@pytest.fixture
def port_offset(next_port_offset: Callable[[], int]) -> int:
    """A --port-offset of this test's own."""
    return next_port_offset()
