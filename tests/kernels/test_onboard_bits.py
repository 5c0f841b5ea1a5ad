"""Every compiled kernel of the refuelling application equals its plain-Python source to the bit, on seeded inputs.

The modules are searched, so a kernel added to one of them without a case here fails the first test.
"""

from __future__ import annotations

import copy
import importlib
from collections.abc import Callable

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata.wake_model import WakeParams, stations, wake_vector
from flightsw.sixdof.actuators import surface_limits
from flightsw.sixdof.params import parameter_vector
from tests.kernels.aided_cases import CASES as AIDED
from tests.kernels.estimator_cases import CASES as ESTIMATOR
from tests.kernels.fdi_cases import CASES as FDI
from tests.kernels.gust_bank_cases import CASES as GUST_BANK
from tests.kernels.gust_cases import CASES as GUST_MISSION
from tests.kernels.rendezvous_cases import CASES as RENDEZVOUS
from tests.kernels.sixdof_cases import CASES as SIXDOF
from tests.kernels.sixdof_cases import turns, unit9, z
from tests.kernels.wake_position_cases import CASES as WAKE_POSITION
from tests.kernels.windcal_cases import CASES as WINDCAL
from tests.kernels.windshear_cases import CASES as WINDSHEAR

Rng = np.random.Generator
Args = list  # arguments of one call; arrays are outputs too
AC = load_aircraft("learjet24")
P = parameter_vector(AC, 5000.0)
LIM = surface_limits(AC)
WAKE = wake_vector(WakeParams(nu_m2ps=5.0))


def full(module: str) -> str:
    """Name to import: those of studies are given whole."""
    return module if module.startswith("hil_scripts.") else f"flightsw.{module}"


def kernels() -> dict[str, object]:
    """Compiled functions of the modules under test by qualified name (nothing when the compiler is off)."""
    out = {}
    for name in sorted({case.rsplit(".", 1)[0] for case in CASES}):
        module = importlib.import_module(full(name))
        for func, f in vars(module).items():
            if hasattr(f, "py_func") and f.py_func.__module__ == module.__name__:
                out[f"{name}.{func}"] = f
    return out


def lower(r: Rng, n: int) -> np.ndarray:
    return np.tril(r.normal(size=(n, n))) * 0.1 + np.eye(n)


def spd(r: Rng, n: int) -> np.ndarray:
    a = r.normal(size=(n, n))
    return a @ a.T + 0.1 * np.eye(n)


def correct_args(r: Rng) -> Args:
    n, m = 15, 12
    X = r.normal(size=(2 * n + 1, n))
    return [
        X,
        r.normal(size=(2 * n + 1, m)),
        r.normal(size=m),
        r.uniform(0.1, 1, m),
        m,
        0.0,
        2.0,
        0.5 / n,
        X[0].copy(),
        lower(r, n),
        z(m),
        z(n, m),
        z(m, m),
        z(n, 2 * n + 1 + m),
        z(n, 2 * n + 1 + m),
        z(m, 2 * n + 1),
    ]


CASES: dict[str, Callable[[Rng], Args]] = {
    **ESTIMATOR,
    **FDI,
    **GUST_MISSION,
    **GUST_BANK,
    **RENDEZVOUS,
    **SIXDOF,
    **AIDED,
    **WAKE_POSITION,
    **WINDCAL,
    **WINDSHEAR,
    "kernels.atmosphere.temperature": lambda r: [r.uniform(0, 2e4)],
    "kernels.atmosphere.density": lambda r: [r.uniform(0, 2e4)],
    "kernels.atmosphere.pressure": lambda r: [r.uniform(0, 2e4)],
    "kernels.atmosphere.calibrated_airspeed": lambda r: [r.uniform(1, 290), r.uniform(-500, 2e4)],
    "kernels.atmosphere.sound_speed": lambda r: [r.uniform(0, 2e4)],
    "kernels.discrete.discretise": lambda r: [
        r.normal(size=(9, 9)) * 5.0,
        r.normal(size=(9, 3)),
        np.diag(r.uniform(0, 1, 9)),
        0.02,
        z(9, 9),
        z(9, 3),
        z(9, 9),
        z(4, 9, 9),
    ],
    "kernels.discrete.riccati": lambda r: [
        r.normal(size=(6, 6)) * 0.5,
        np.diag(r.uniform(0.1, 1, 6)),
        np.diag(r.uniform(0.1, 1, 6)),
    ],
    "kernels.discrete._symmetric_sum": lambda r: [np.diag(r.uniform(0.1, 1, 6)), r.normal(size=(6, 6))],
    "kernels.discrete.spectral_radius": lambda r: [r.normal(size=(6, 6))],
    "kernels.products.block_product": lambda r: [r.normal(size=(6, 6)), r.normal(size=(5, 8)), 5, 4, 7, z(6, 8)],
    "kernels.linalg.product": lambda r: [r.normal(size=(4, 6)), r.normal(size=(6, 7)), z(4, 7)],
    "kernels.products.add_symmetric": lambda r: [*[r.normal(size=(7, 5))] * 2, 6, 4, spd(r, 7)],
    "kernels.products.symmetric": lambda r: [*[r.normal(size=(7, 5))] * 2, 6, 4, z(7, 7)],
    "kernels.products.product_t": lambda r: [r.normal(size=(7, 5)), r.normal(size=(4, 6)), 6, 3, 4, z(7, 4)],
    "kernels.linalg.finite": lambda r: [r.normal(size=3)],
    "kernels.linalg.matvec": lambda r: [r.normal(size=(6, 6)), r.normal(size=6), z(6)],
    "kernels.linalg.vecmat": lambda r: [r.normal(size=4), r.normal(size=(4, 6)), z(6)],
    "kernels.linalg.inner": lambda r: [r.normal(size=9), r.normal(size=9)],
    "kernels.linalg.gram": lambda r: [r.normal(size=(6, 6)), z(6, 6)],
    "kernels.linalg.solve": lambda r: [r.normal(size=(6, 6)), r.normal(size=(6, 3))],
    "kernels.linalg.tria": lambda r: [r.normal(size=(15, 49)), 15, 49, z(15, 15)],
    "kernels.linalg.cholesky": lambda r: [spd(r, 5), 4],
    "kernels.linalg.forward_sub": lambda r: [lower(r, 12), 12, r.normal(size=12)],
    "kernels.linalg.backward_sub_t": lambda r: [lower(r, 12), 12, r.normal(size=12)],
    "kernels.rotations.dcm_from_euler": lambda r: [*r.uniform(-1.5, 1.5, 3), z(9)],
    "kernels.rotations.dcm_of_turns": lambda r: [*turns(r, 3), z(9)],
    "kernels.rotations.euler_from_dcm": lambda r: [unit9(r), z(3)],
    "kernels.rotations.dcm_from_quat": lambda r: [r.normal(size=4), z(9)],
    "kernels.rotations.quat_from_euler": lambda r: [*r.uniform(-1.5, 1.5, 3), z(4)],
    "kernels.rotations.mul33": lambda r: [r.normal(size=9), r.normal(size=9), z(9)],
    "kernels.rotations.mul33_t": lambda r: [r.normal(size=9), r.normal(size=9), z(9)],
    "kernels.rotations.to_parent": lambda r: [unit9(r), r.normal(size=3), z(3)],
    "kernels.rotations.to_child": lambda r: [unit9(r), r.normal(size=3), z(3)],
    "kernels.rotations.rotate_dcm": lambda r: [unit9(r), r.normal(size=3), r.uniform(0, 0.3), z(9)],
    "kernels.rotations.turn": lambda r: [unit9(r), *r.normal(size=3), r.uniform(0, 0.3)],
    "kernels.rotations.wrap_pi": lambda r: [r.uniform(-50, 50)],
    "missions.receiver.airdata.wake_kernel.horseshoe": lambda r: [*r.uniform(-40, 10, 3), 15.7, 0.8, 300.0, 2.0, 200.0],
    "missions.receiver.airdata.wake_kernel.wake_wind": lambda r: [
        *r.uniform(-40, 10, 3),
        WAKE,
        1.1,
        0.9,
        200.0,
        0.59,
        z(3),
    ],
    "missions.receiver.airdata.wake_kernel.probe_readings": lambda r: [
        r.uniform(-40, 10, 3),
        *r.normal(size=(2, 3)) * 0.1,
        200.0,
        0.59,
        *r.normal(size=(2, 3)) * 0.1,
        r.normal(size=(3, 3)) * 5,
        WAKE,
        1.1,
        0.9,
        z(9),
    ],
    "missions.receiver.airdata.wake_model.effective_wind": lambda r: [
        r.uniform(-40, 10, 3),
        r.normal(size=3) * 0.1,
        200.0,
        0.59,
        *stations(),
        WAKE,
        1.1,
        0.9,
        z(6),
    ],
    "missions.receiver.airdata.contour.intersect.crossings": lambda r: [
        r.uniform(-5, 5, (12, 2)),
        np.array([0, 5, 12]),
        r.uniform(-5, 5, (9, 2)),
        np.array([0, 9]),
        1e-6,
        z(50, 2),
    ],
    "missions.receiver.airdata.contour.intersect.nearest_pair": lambda r: [
        r.normal(size=(7, 2)),
        r.normal(size=(5, 2)),
        False,
        z(2),
    ],
    "filters.correction.cross_covariance": lambda r: [spd(r, 6), r.normal(size=(4, 6)), 3, z(6, 4)],
    "filters.correction.innovation_covariance": lambda r: [r.normal(size=(4, 6)), r.normal(size=(6, 4)), 3, spd(r, 4)],
    "filters.correction.joseph": lambda r: [
        spd(r, 6),
        r.normal(size=(4, 6)),
        3,
        *r.normal(size=(2, 6, 4)),
        z(6, 6),
        z(6, 6),
    ],
    "filters.correction.scalar_update": lambda r: [r.normal(size=6), spd(r, 6), r.normal(size=6), r.normal(), 2.0],
    "filters.correction.state_update": lambda r: [
        r.normal(size=6),
        spd(r, 6),
        2,
        int(r.choice([-1, 4])),
        r.normal(),
        0.3,
        r.choice([1e-9, 1e9]),
        np.array([0, 0, 0, 1, 0, 0]),
        z(6),
        z(6),
    ],
    "filters.srukf.draw": lambda r: [r.normal(size=15), lower(r, 15), 3.9, z(31, 15)],
    "filters.srukf._weighted_mean": lambda r: [r.normal(size=(31, 15)), 15, 0.0, 1 / 30, z(15)],
    "filters.srukf.recombine": lambda r: [
        r.normal(size=(31, 15)),
        0.0,
        2.0,
        1 / 30,
        r.normal(size=(15, 18)),
        z(15),
        z(15, 15),
        z(15, 49),
    ],
    "filters.srukf.correct": correct_args,
    "filters.srukf.row_norms": lambda r: [lower(r, 15), z(15)],
}


def test_every_kernel_has_a_case() -> None:
    missing = sorted(set(kernels()) - set(CASES))
    assert not missing, f"add seeded inputs for {missing}"


@pytest.mark.parametrize("name", CASES)
def test_compiled_and_plain_python_agree_to_the_bit(name: str) -> None:
    module, func = name.rsplit(".", 1)
    compiled = getattr(importlib.import_module(full(module)), func)
    plain = getattr(compiled, "py_func", compiled)
    for seed in range(3):
        a = CASES[name](np.random.default_rng(seed))
        b = copy.deepcopy(a)
        assert compiled(*a) == plain(*b)
        for x, y in zip(a, b, strict=True):
            if isinstance(x, np.ndarray):
                assert np.isfinite(x).all()
                assert x.tobytes() == y.tobytes(), f"{name}, seed {seed}: differs by {np.abs(x - y).max():.3g}"
