"""Shared by all tests: one numerical thread, the launcher's kernel cache, ports that parallel workers do not share, and how the
tests are dealt out to the workers."""

from __future__ import annotations

import contextlib
import gc
import importlib
import itertools
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import hypothesis
import pytest
import typer.main
import typer.testing

from hil_scripts.launch import kernel_cache, ports
from hil_scripts.launch.procs import SINGLE_THREAD

ROOT = Path(__file__).resolve().parent.parent

# before numpy and numba are imported by any test
os.environ.update(SINGLE_THREAD)
if os.environ.get("NUMBA_DISABLE_JIT") != "1":
    kernel_cache.use()


@cache
def _command(app: typer.Typer, commands: int) -> Any:
    """The command line of a program with so many commands."""
    return typer.main.get_command(app)


# put together once, not at every call of it
typer.testing._get_command = lambda app: _command(app, len(app.registered_commands))

# no deadline: the first call of a compiled kernel takes seconds; the same examples everywhere: a failure repeats
hypothesis.settings.register_profile("wakefield", deadline=None, derandomize=True)
hypothesis.settings.load_profile("wakefield")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Each worker imports a part of the test modules of its own first: those that start together on a fresh checkout rewrite
    the assertions of one part each and read the others' byte code for the rest."""
    gc.disable()  # of what is imported and collected nothing goes
    worker, count = (os.environ.get(f"PYTEST_XDIST_WORKER{end}", none) for end, none in (("", "gw0"), ("_COUNT", "1")))
    if worker != "gw0" and session.config.args == ["tests"]:  # the first part is where the collection begins
        files = sorted(ROOT.joinpath("tests").rglob("test_*.py"))
        for path in files[int(worker[2:]) * len(files) // int(count) :]:
            with contextlib.suppress(Exception):  # told when it is collected
                importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Deal the tests out by tests/scheduling.py."""
    from tests.scheduling import Units

    config.option.loadscopereorder = False  # the order is that of the collection
    return Units(config, log)


def pytest_collection_finish(session: pytest.Session) -> None:
    """What has been imported and collected stays: the garbage collector need not look through it again and again."""
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)
    gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long units first, where there are several workers."""
    if hasattr(config, "workerinput"):
        from tests.scheduling import rank, unit

        items.sort(key=lambda item: rank(unit(item.nodeid)))


FIRST_OFFSET = 3000
PER_WORKER = 600  # ports of one xdist worker
STEP = 30  # between two runs of a worker; never 39..42, 40 or 49..52: no port of one run is another port of the next


@pytest.fixture(scope="session")
def next_port_offset() -> Callable[[], int]:
    """Call it for a --port-offset no other test of this session uses, nor any other program now."""
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    base = FIRST_OFFSET + PER_WORKER * int(worker[2:])
    offsets = itertools.cycle(range(base, base + PER_WORKER, STEP))
    everyone = {sysid: f"aircraft {sysid}" for sysid in range(1, 6)}

    def one() -> int:
        return ports.free_offset(everyone, itertools.islice(offsets, PER_WORKER // STEP))

    return one


@pytest.fixture(scope="module")
def small_pictures() -> Iterator[None]:
    """Figures of reports with a tenth of their pixels, axes where they fall: tests read pages, not pictures."""
    from ground.report import figures

    with pytest.MonkeyPatch.context() as m:
        m.setattr(figures, "DPI", 40)
        m.setattr(figures, "LAYOUT", None)
        yield


@pytest.fixture
def port_offset(next_port_offset: Callable[[], int]) -> int:
    """A --port-offset of this test's own."""
    return next_port_offset()
