"""What flies asks no linear algebra library and no vectorised function for numbers: their last digits depend on the processor.

OpenBLAS chooses its kernels by the processor's name, numpy its vectorised exp and sin by the processor's instructions; a run, its
replay and another machine would then differ. The source is searched, so that it holds for every option and not only for what a
test happens to fly; `tests/sil/test_processors.py` flies.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Studies of fault detection, of figures and of the source's constant gain: they judge data, nothing flies them.
NEVER_FLOWN = {
    "flightsw/missions/receiver/airdata/fdi/detectors.py",
    "hil_scripts/studies/sevil/isolation.py",
    "flightsw/missions/receiver/airdata/fdi/metrics.py",
    "flightsw/missions/receiver/airdata/fdi/parity.py",
    "hil_scripts/studies/sevil/two_faults.py",
    "hil_scripts/campaign/consistency.py",
    "hil_scripts/studies/sevil/metrics.py",
    "flightsw/missions/gust/design.py",
}
YET_USED = {"flightsw.missions.receiver.airdata.fdi.detectors.threshold_table"}  # chi-square quantiles, one by one
# scipy.optimize.root: MINPACK's own loops, no library below it
SCIPY = {"scipy.optimize": {"root"}}
PRODUCTS = {
    "dot",
    "vdot",
    "inner",
    "matmul",
    "tensordot",
    "einsum",
    "linalg",
    "polyfit",
    "convolve",
    "correlate",
    "cov",
}
VECTORISED = {
    "exp", "expm1", "exp2", "log", "log1p", "log2", "log10", "sin", "cos", "tan", "sinh", "cosh", "tanh", "arcsin", "arccos",
    "arctan", "arctan2", "hypot", "power", "cbrt",
}  # fmt: skip


def sources() -> list[Path]:
    files = [p for pkg in ("flightsw", "sim_plant") for p in sorted((ROOT / pkg).rglob("*.py"))]
    return [p for p in files if str(p.relative_to(ROOT)) not in NEVER_FLOWN]


def compiled(tree: ast.Module) -> set[ast.AST]:
    """Nodes inside functions under a `jit` decorator: their np.sin is the C library's, element by element."""
    found: set[ast.AST] = set()
    for f in ast.walk(tree):
        if isinstance(f, ast.FunctionDef) and any(
            isinstance(d, ast.Name) and d.id in ("jit", "jit_own") for d in f.decorator_list
        ):
            found.update(ast.walk(f))
    return found


def faults(text: str) -> list[str]:
    tree = ast.parse(text)
    inside = compiled(tree)
    out = []
    for n in ast.walk(tree):
        if isinstance(n, (ast.BinOp, ast.AugAssign)) and isinstance(n.op, ast.MatMult):
            out.append(f"{n.lineno}: @")
        elif isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name) and n.value.id == "np":
            if n.attr in PRODUCTS or (n.attr in VECTORISED and n not in inside):
                out.append(f"{n.lineno}: np.{n.attr}")
        elif isinstance(n, ast.Attribute) and n.attr == "dot":
            out.append(f"{n.lineno}: .dot")
        elif isinstance(n, ast.ImportFrom) and (n.module or "").startswith("scipy"):
            out += [f"{n.lineno}: {n.module}.{a.name}" for a in n.names if a.name not in SCIPY.get(n.module or "", ())]
        elif isinstance(n, ast.Import):
            out += [f"{n.lineno}: {a.name}" for a in n.names if a.name.split(".")[0] == "scipy"]
    return out


@pytest.mark.parametrize("path", sources(), ids=lambda p: str(p.relative_to(ROOT)))
def test_what_flies_sums_in_its_own_order(path: Path) -> None:
    assert faults(path.read_text()) == []


def test_what_is_not_flown_exists_and_is_imported_by_nothing_that_flies() -> None:
    for name in NEVER_FLOWN:
        assert (ROOT / name).is_file()
    modules = {name.removesuffix(".py").replace("/", ".") for name in NEVER_FLOWN}
    for path in sources():
        for n in ast.walk(ast.parse(path.read_text())):
            if isinstance(n, ast.ImportFrom) and n.module:
                named = {f"{n.module}.{a.name}" for a in n.names} - YET_USED
                used = {m for m in modules if any(x == m or x.startswith(m + ".") for x in named)}
                assert not used or path.name == "__init__.py", f"{path}: {used}"


@pytest.mark.parametrize(
    "line",
    [
        "y = A @ x", "y @= A", "y = np.dot(a, b)", "y = a.dot(b)", "y = np.linalg.norm(a)", "from scipy.linalg import expm",
        "import scipy.linalg", "y = np.exp(a)", "from scipy.optimize import least_squares",
    ],
)  # fmt: skip
def test_the_search_finds(line: str) -> None:
    assert len(faults(f"import numpy as np\n{line}\n")) == 1


def test_the_search_leaves_loops_alone() -> None:
    assert faults("@jit\ndef f(a):\n    return np.exp(a[0]) * math.sin(a[1])\n") == []
