"""Every compiled kernel of the refuelling application equals its plain-Python source to the bit, on seeded inputs.

The modules are searched, so a kernel added to one of them without a case here fails the first test.
"""

from __future__ import annotations

import copy
import importlib
import math
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


def unit9(r: Rng) -> np.ndarray:
    return np.linalg.qr(r.normal(size=(3, 3)))[0].ravel()


def free_state(r: Rng) -> np.ndarray:
    x = np.zeros(15)
    x[:3] = r.uniform(150, 220), r.uniform(-0.1, 0.1), r.uniform(-0.05, 0.1)
    x[3:6], x[6:9] = r.uniform(-0.2, 0.2, 3), r.uniform(-0.5, 0.5, 3)
    x[9:12], x[12:15] = r.uniform(-100, 100, 3), r.uniform(-15, 15, 3)
    return x


def turns(r: Rng, angles: int) -> list[float]:
    """Cosine and sine of each of so many small angles."""
    return [f(a) for a in r.uniform(-0.3, 0.3, angles) for f in (math.cos, math.sin)]


def looks(r: Rng) -> np.ndarray:
    """A ring of steps 0.05 s apart, of which step 529 is the last."""
    S = r.normal(0.0, 0.01, (512, 19))
    S[:, 9], S[:, 10] = 0.05 * (1.0 + (np.arange(512) - 18) % 512), 0.05
    return S


def controls(r: Rng) -> np.ndarray:
    return np.array([*r.uniform(-0.2, 0.2, 3), r.uniform(2e3, 1e4)])


def stage(r: Rng) -> np.ndarray:
    return np.concatenate((unit9(r), r.uniform(-0.1, 0.1, 6), r.uniform(-200, 200, 3)))


def lower(r: Rng, n: int) -> np.ndarray:
    return np.tril(r.normal(size=(n, n))) * 0.1 + np.eye(n)


def spd(r: Rng, n: int) -> np.ndarray:
    a = r.normal(size=(n, n))
    return a @ a.T + 0.1 * np.eye(n)


def points(r: Rng) -> np.ndarray:
    return np.array([free_state(r) for _ in range(31)])


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


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


def probe_args(r: Rng) -> Args:
    flow = [r.uniform(180, 200, 3), r.uniform(-0.1, 0.1, 3), r.uniform(-0.1, 0.1, 3)]
    return [*flow, np.array([1, 0, 1]), r.normal(size=(3, 3)), r.uniform(-0.2, 0.2, 3), z(3)]


def codes(r: Rng, top: int) -> np.ndarray:
    return r.permutation(top).astype(np.int64)


CASES: dict[str, Callable[[Rng], Args]] = {
    **ESTIMATOR,
    **FDI,
    **GUST_MISSION,
    **GUST_BANK,
    **RENDEZVOUS,
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
    "kernels.linalg.product": lambda r: [r.normal(size=(4, 6)), r.normal(size=(6, 3)), z(4, 3)],
    "kernels.linalg.matvec": lambda r: [r.normal(size=(4, 6)), r.normal(size=6), z(4)],
    "kernels.linalg.vecmat": lambda r: [r.normal(size=4), r.normal(size=(4, 6)), z(6)],
    "kernels.linalg.inner": lambda r: [r.normal(size=9), r.normal(size=9)],
    "kernels.linalg.gram": lambda r: [r.normal(size=(4, 6)), z(4, 4)],
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
    "sixdof.actuators.servo_step": lambda r: [
        r.normal(size=3) * 0.1,
        r.normal(size=3),
        r.normal(size=3),
        LIM,
        20.0,
        0.7,
        0.01,
    ],
    "sixdof.actuators.actuators_step": lambda r: [
        r.normal(size=(2, 4)),
        r.normal(size=4),
        r.normal(size=3) * 0.1,
        r.normal(size=3),
        r.normal(size=1),
        z(4),
        LIM,
        20.0,
        0.7,
        1.2,
        0.01,
    ],
    "sixdof.forces.force_moment": lambda r: [
        r.uniform(150, 220),
        *r.uniform(-0.1, 0.1, 2),
        *r.uniform(-0.2, 0.2, 3),
        controls(r),
        0.59,
        P,
        z(9),
    ],
    "sixdof.forces.moment_rates": lambda r: [
        r.uniform(150, 220),
        *r.uniform(-0.1, 0.1, 2),
        r.uniform(-0.2, 0.2, 3),
        controls(r),
        0.59,
        P,
        z(9),
    ],
    "sixdof.forces.spin": lambda r: [*r.normal(size=3), *r.uniform(-0.2, 0.2, 3), P],
    "sixdof.forces.loads": lambda r: [
        r.uniform(150, 220),
        *r.uniform(-0.1, 0.1, 2),
        *turns(r, 2),
        *r.uniform(-0.2, 0.2, 3),
        controls(r),
        0.59,
        P,
        z(9),
    ],
    "sixdof.forces.rigid": lambda r: [
        r.uniform(150, 220),
        *turns(r, 2),
        *r.uniform(-0.2, 0.2, 3),
        r.normal(size=9),
        *r.normal(size=3),
        P,
        z(6),
    ],
    "sixdof.moments.learn": lambda r: [r.normal(size=3), 0.1, r.normal(size=3), r.uniform(0.01, 1.0, 3)],
    "sixdof.looks.before": lambda r: [looks(r), 530, r.uniform(0.1, 1.0)],
    "sixdof.looks.apart": lambda r: [looks(r), 530, 505, 1e-5, 1e-4, 5, 2.0],
    "sixdof.looks.turned": lambda r: [looks(r), 530, 505, *r.normal(0.0, 0.05, 3), P, r.normal(0.0, 0.01, 3), z(9)],
    "sixdof.looks.looked": lambda r: [
        looks(r),
        530,
        *r.normal(0.0, 0.01, 6),
        0.05,
        r.uniform(150, 220),
        *r.uniform(-0.1, 0.1, 2),
        7010.0,
        controls(r),
        np.array([0.3, 1.0]),
        1.0,
        1e-5,
        1e-4,
        5,
        2.0,
        P,
        z(3),
        np.full(3, 0.1),
        z(3),
        z(9),
        z(7),
    ],
    "sixdof.motion.air_velocity": lambda r: [r.uniform(150, 220), *r.uniform(-0.1, 0.1, 2)],
    "sixdof.sensed.sensed_rates": lambda r: [
        free_state(r),
        controls(r),
        0.59,
        P,
        r.normal(size=6),
        bool(r.integers(2)),
        z(9),
        z(9),
        z(15),
    ],
    "sixdof.sensed.propagate_sensed": lambda r: [
        points(r),
        controls(r),
        0.59,
        P,
        r.normal(size=6),
        bool(r.integers(2)),
        0.05,
        z(5, 15),
    ],
    "sixdof.sensed.measure_differenced": lambda r: [
        points(r),
        codes(r, 15),
        15,
        controls(r),
        0.59,
        P,
        0.9,
        0.05,
        z(31, 15),
    ],
    "sixdof.motion.euler_rates": lambda r: [*r.uniform(-0.3, 0.3, 3), r.uniform(-1, 1), 0.8, *turns(r, 1), z(3)],
    "sixdof.motion.free_rates": lambda r: [free_state(r), controls(r), 0.59, P, z(9), z(9), z(15)],
    "sixdof.motion.relative_rates": lambda r: [free_state(r), controls(r), 0.59, P, stage(r), z(9), z(9), z(15)],
    "sixdof.motion.relative_velocity": lambda r: [free_state(r), stage(r), unit9(r), z(3)],
    "sixdof.motion._apart": lambda r: [free_state(r), *r.uniform(-10, 200, 3), stage(r), z(3)],
    "sixdof.motion._moves_alike": lambda r: [free_state(r), free_state(r)[:9].copy()],
    "sixdof.motion._beside": lambda r: [
        free_state(r),
        r.normal(size=(4, 3)),
        np.array([stage(r) for _ in range(3)]),
        0.05,
        z(5, 15),
    ],
    "sixdof.motion.free_motion": lambda r: [free_state(r), controls(r), 0.59, P, z(9), z(9), z(15)],
    "sixdof.motion.relative_motion": lambda r: [free_state(r), controls(r), 0.59, P, stage(r), z(9), z(9), z(15)],
    "sixdof.motion.propagate_free": lambda r: [points(r), controls(r), 0.59, P, 0.05, z(5, 15)],
    "sixdof.motion.propagate_relative": lambda r: [
        points(r),
        controls(r),
        0.59,
        P,
        np.array([stage(r) for _ in range(3)]),
        0.05,
        z(5, 15),
    ],
    "sixdof.motion.air_jacobian": lambda r: [r.uniform(150, 220), *r.uniform(-0.1, 0.1, 2), unit9(r), z(3, 3)],
    "sixdof.velocity_form_kernel.exchange": lambda r: [points(r), float(r.choice([-1.0, 1.0]))],
    "sixdof.velocity_form_kernel.air_slope": lambda r: [free_state(r), z(3, 6)],
    "sixdof.velocity_form_kernel.shear": lambda r: [r.normal(size=(20, 23)), r.normal(size=(3, 6)), 1.0],
    "sixdof.measure.measure_free": lambda r: [points(r), codes(r, 15), 15, z(31, 15)],
    "sixdof.measure.measure_relative": lambda r: [points(r), codes(r, 18), 18, stage(r), z(31, 18)],
    "sixdof.measure.average_probes": probe_args,
    "sixdof.schedule.weights": lambda r: [
        r.uniform(-0.04, 0.04),
        r.uniform(170, 210),
        np.array([-0.03, 0.0, 0.03]),
        np.array([180.0, 200.0]),
        z(6),
    ],
    "sixdof.schedule.integrated": lambda r: [
        r.normal(size=3),
        0.05,
        bool(r.integers(2)),
        r.uniform(0.0, 1.0, 3),
        r.normal(size=3),
        z(3),
        z(3),
    ],
    "sixdof.schedule.blended": lambda r: [
        r.uniform(-0.04, 0.04),
        r.uniform(170, 210),
        np.array([-0.03, 0.0, 0.03]),
        np.array([180.0, 200.0]),
        z(6),
        r.normal(size=(6, 4, 26)),
        r.normal(size=(6, 26)),
        r.normal(size=(6, 4)),
        z(4),
        z(3, 4),
        r.normal(size=26),
        z(26),
        19,
        22,
        0.3,
        r.normal(size=4),
        r.normal(size=(3, 4)),
    ],
    "sixdof.schedule.closed": lambda r: [
        r.uniform(-0.04, 0.04),
        r.uniform(170, 210),
        np.array([-0.03, 0.0, 0.03]),
        np.array([180.0, 200.0]),
        z(6),
        r.normal(size=(6, 4, 26)),
        r.normal(size=(6, 26)),
        r.normal(size=(6, 4)),
        z(4),
        z(3, 4),
        r.normal(size=26),
        z(26),
        12,
        r.normal(size=3),
        r.normal(size=3),
        5e3,
        r.normal(size=(1, 4)),
        r.normal(size=3),
        0.05,
        False,
        np.ones(3),
        r.normal(size=3),
        z(3),
        z(3),
    ],
    "sixdof.schedule.scheduled": lambda r: [
        r.normal(size=(6, 4, 26)),
        r.normal(size=(6, 26)),
        r.normal(size=(6, 4)),
        r.normal(size=6),
        r.normal(size=26),
        r.normal(size=26),
        z(4),
    ],
    "sixdof.schedule.shares": lambda r: [
        r.normal(size=(6, 4, 26)),
        r.normal(size=(6, 26)),
        r.normal(size=(6, 4)),
        r.normal(size=6),
        r.normal(size=26),
        r.normal(size=26),
        19,
        22,
        z(3, 4),
    ],
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
