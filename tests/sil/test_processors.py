"""One seed, one set of logs, whatever processor flies it.

The linear algebra library is told which processor's kernels to use, numpy which instructions it may. All scenarios fly half a
second each, in one process per setting: start-up designs, trims and every rate group. A setting this processor cannot run says
so and is left out. With PROCESSORS=all one more setting of the library flies, and the kernels are also compiled for no processor
in particular, which takes minutes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hil_scripts.launch import kernel_cache
from tests.sil.launch import TIMEOUT_S

pytestmark = pytest.mark.xdist_group("processors")
SCENARIOS = sorted(p.stem for p in (Path(kernel_cache.ROOT) / "sim_plant" / "scenarios").glob("*.toml"))
SECONDS = 0.5
# name of the kernels, what numpy has to do without
SETTINGS = {
    "Nehalem": {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"},
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
}
if os.environ.get("PROCESSORS") == "all":
    SETTINGS["Zen"] = {"OPENBLAS_CORETYPE": "Zen"}  # Haswell's kernels by another name, mostly
    SETTINGS["generic"] = {**SETTINGS["Nehalem"], "NUMBA_CPU_NAME": "generic"}
FLAGS = {"Haswell": "avx2", "Zen": "avx2", "SkylakeX": "avx512f"}
FLY = """
import hashlib, json, sys, tempfile
from pathlib import Path
from hil_scripts.launch.inproc import InProcess
from hil_scripts.launch.runfolder import make_folder, resolve
import numpy as np

out = {}
for name in sys.argv[2:]:
    with tempfile.TemporaryDirectory() as tmp:
        plan = resolve(name, 3, [], float(sys.argv[1]))
        run = make_folder(plan, Path(tmp) / "run")
        flight = InProcess(plan, run)
        while not flight.server.done:
            flight.tick()
        flight.finish()
        for log in sorted(run.glob("*.tlog")):
            out[f"{name}/{log.name}"] = hashlib.sha256(log.read_bytes()).hexdigest()
r = np.random.default_rng(1)
a, b = r.standard_normal((7, 9)), r.standard_normal((9, 5))
out["library"] = hashlib.sha256((a @ b).tobytes() + np.tanh(a).tobytes()).hexdigest()
print(json.dumps(out))
"""


def supported(setting: str) -> bool:
    """Whether this processor has the instructions of a setting's kernels; the library would fall back without a word."""
    try:
        flags = Path("/proc/cpuinfo").read_text()
    except OSError:
        return False
    return FLAGS.get(setting, "sse4_2") in flags.split()


@pytest.fixture(scope="module")
def flown() -> dict[str, dict[str, str]]:
    """Digest of every log and of a few library results by setting."""
    out = {}
    for setting, env in SETTINGS.items():
        if supported(setting):
            r = subprocess.run(
                [sys.executable, "-c", FLY, str(SECONDS), *SCENARIOS],
                capture_output=True, text=True, timeout=4 * TIMEOUT_S, env={**os.environ, **env}, check=False,
            )  # fmt: skip
            assert r.returncode == 0, f"{setting}: {r.stderr[-2000:]}"
            out[setting] = json.loads(r.stdout.splitlines()[-1])
    return out


@pytest.mark.parametrize("setting", [s for s in SETTINGS if s != "Nehalem"])
def test_every_log_has_the_same_bytes(flown: dict[str, dict[str, str]], setting: str) -> None:
    if setting not in flown or "Nehalem" not in flown:
        pytest.skip(f"this processor has no {FLAGS.get(setting, 'sse4_2')}")
    a, b = flown["Nehalem"], flown[setting]
    logs = sorted(k for k in a if k.endswith(".tlog"))
    assert len(logs) >= 3 * len(SCENARIOS) and sorted(b) == sorted(a)
    assert [k for k in logs if a[k] != b[k]] == []


def test_the_settings_make_a_difference(flown: dict[str, dict[str, str]]) -> None:
    """Or equal logs would prove nothing: the library's own product and tanh do differ between them."""
    if len(flown) < 2:
        pytest.skip("this processor runs one setting only")
    assert len({v["library"] for v in flown.values()}) > 1
