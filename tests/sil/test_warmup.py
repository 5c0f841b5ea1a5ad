"""The warm-up is visible, uses both cores, and misses no kernel of the onboard software."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from hil_scripts.launch import kernel_cache, kernel_list, warmup
from hil_scripts.launch.places import ROOT
from hil_scripts.launch.procs import StopFlag

COMPILES = """
import os, sys, time
from pathlib import Path
for i in range(3):
    time.sleep(0.2)
    Path(os.environ["NUMBA_CACHE_DIR"], f"{os.getpid()}-{i}.nbc").touch()
"""


@pytest.fixture
def cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own, and lines without waiting."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(warmup, "PLAIN_EVERY_S", 0.0)
    monkeypatch.setattr(warmup, "CODE", COMPILES)
    return tmp_path


def warm(terminal: bool = False) -> tuple[bool, str]:
    out = io.StringIO()
    with StopFlag() as stop:
        return warmup.warm(Console(file=out, force_terminal=terminal, highlight=False), stop), out.getvalue()


@pytest.mark.parametrize("terminal", [False, True])
def test_a_cold_start_shows_how_many_kernels_are_ready(cold: Path, terminal: bool) -> None:
    ok, text = warm(terminal)
    assert ok and "kernels compiled" in text and "6 kernels ready" in text
    assert kernel_cache.is_warm()
    assert warm() == (True, "")  # and a warm one nothing


def test_kernels_of_another_processor_are_not_taken_for_warm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NUMBA_CPU_NAME", raising=False)
    here = kernel_cache.digest()
    assert here == kernel_cache.digest() and kernel_cache.processor().strip()
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert kernel_cache.digest() != here


def test_a_failure_is_told_and_not_taken_for_warm(cold: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warmup, "CODE", "raise SystemExit('no compiler here')")
    ok, text = warm()
    assert not ok and "compiling failed, exit code 1" in text and "no compiler here" in text
    assert not kernel_cache.is_warm()


def test_a_scenario_is_flown_by_one_of_the_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[str] = []
    monkeypatch.setattr("hil_scripts.launch.kernel_list.entries", list)
    monkeypatch.setattr("hil_scripts.launch.inproc.fly_a_little", lambda scenario, seconds: flown.append(scenario))
    for names in (["one"], ["one", "two"], ["two", "one"]):
        monkeypatch.setattr("sys.argv", ["-c", str(tmp_path), *names])
        exec(warmup.CODE, {})  # noqa: S102
    assert flown == ["one", "two"]


def test_every_kernel_of_the_list_is_compiled_once_and_callees_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And none is named that is no kernel any more: `python -m hil_scripts.launch.kernel_list` writes the list anew."""
    found = kernel_list.entries()
    kernels = {e.name: kernel_list.kernel(e.name) for e in found}
    assert [name for name, k in kernels.items() if k is None] == []
    assert [e for e in found if kernel_list.written(kernel_list.signature(e.types)) != e.types] == []
    done: list[kernel_list.Entry] = []
    names = {k: name for name, k in kernels.items()}
    for k in set(kernels.values()):
        monkeypatch.setattr(
            k, "compile", lambda types, k=k: done.append(kernel_list.Entry(names[k], str(kernel_list.written(types))))
        )
    for _ in range(2):
        kernel_list.compile_claimed(tmp_path)
    assert sorted(done) == found
    levels: dict[object, int] = {}
    order = [kernel_list.level(kernels[e.name], levels) for e in done]
    assert order == sorted(order) and order[-1] >= 4


def test_the_compiler_starts_without_what_no_kernel_uses_and_still_has_it() -> None:
    """scipy.linalg is imported by a kernel that needs BLAS, not by the first that is called."""
    code = """
import sys, numpy as np
from flightsw.compiler import numba
from flightsw.kernels.linalg import inner
A, b = np.arange(9.0).reshape(3, 3), np.array([1.0, -2.0, 0.5])
assert inner(b, b) == 5.25
early = "scipy.linalg" in sys.modules
assert np.array_equal(numba.njit(lambda A, b: A @ b)(A, b), A @ b)
print(early, "scipy.linalg" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


LATER = {  # mission -> module and kernels that a flight comes to some time after its start
    "rendezvous": (
        "flightsw.missions.rendezvous.estimator",
        ("kb.bank_predict", "kf.heard_fix", "kf.heard_range", "kr.judged_range"),
    ),
    "receiver": (
        "flightsw.missions.receiver.integrity",
        (
            "kernel.predict",
            "kernel.surprise",
            "kernel.sigmas",
            "judge_kernel.judged",
            "way_kernel.over",
            "rows_kernel.offered",
            "horizon_kernel.advanced",
            "horizon_kernel.expected",
        ),
    ),
}


@pytest.mark.parametrize("mission", LATER)
def test_the_warm_up_comes_to_what_a_flight_needs_later(mission: str) -> None:
    """A second range, the first relative measurement to be judged: nothing is compiled, nor loaded, in flight."""
    module, kernels = LATER[mission]
    code = f"""
import importlib
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
make_app(load_flight("flightsw/params/{mission}.toml")).warmup()
for name in {kernels}:
    at, _, function = name.partition(".")
    print(len(getattr(getattr(importlib.import_module("{module}"), at), function).signatures))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split() == ["1"] * len(kernels)


def test_types_a_list_cannot_hold_are_left_out() -> None:
    from numba.core import types as nt

    assert kernel_list.written((nt.Tuple((nt.float64, nt.int64)),)) is None
    assert kernel_list.written((nt.float64[::1, :], nt.literal(7))) == "float64[::1,:], 7"
