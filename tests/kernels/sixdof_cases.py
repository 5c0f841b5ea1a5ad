"""Seeded inputs of the kernels of six-degree-of-freedom flight, for test_onboard_bits.py."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.actuators import surface_limits
from flightsw.sixdof.params import parameter_vector

Rng = np.random.Generator
Args = list  # arguments of one call; arrays are outputs too
AC = load_aircraft("learjet24")
P = parameter_vector(AC, 5000.0)
LIM = surface_limits(AC)


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


SETTINGS = np.array([0.3, 1.0, 1.0, 1e-4, 1e-5, 1e-7, 2.0])  # of looks.py


def moments(r: Rng) -> np.ndarray:
    """What moments.py has learnt."""
    return np.concatenate((r.normal(0.0, 0.01, 3), r.uniform(0.01, 1.0, 3), r.normal(size=3), z(9)))


def controls(r: Rng) -> np.ndarray:
    return np.array([*r.uniform(-0.2, 0.2, 3), r.uniform(2e3, 1e4)])


def flown(r: Rng, *turning: object) -> Args:
    """Airspeed and flow, what tells of the turning, controls, density, the file's numbers, and room for what comes of them."""
    return [r.uniform(150, 220), *r.uniform(-0.1, 0.1, 2), *turning, controls(r), 0.59, P, z(9)]


def reading(r: Rng) -> list[object]:
    """An attitude 0.05 s ago, the rates since, and a reading of it 0.02 s old."""
    return [unit9(r), 0.05, *r.normal(0.0, 0.1, 3), 1.0, *r.normal(0.0, 0.01, 3), 0.02]


def since(r: Rng) -> list[object]:
    """What the gyro has turned in 0.05 s, and the flow and controls of then."""
    return [*r.normal(0.0, 0.01, 3), 0.05, r.uniform(150, 220), *r.uniform(-0.1, 0.1, 2), 7010.0, controls(r)]


def stage(r: Rng) -> np.ndarray:
    return np.concatenate((unit9(r), r.uniform(-0.1, 0.1, 6), r.uniform(-200, 200, 3)))


def points(r: Rng) -> np.ndarray:
    return np.array([free_state(r) for _ in range(31)])


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def probe_args(r: Rng) -> Args:
    flow = [r.uniform(180, 200, 3), r.uniform(-0.1, 0.1, 3), r.uniform(-0.1, 0.1, 3)]
    return [*flow, np.array([1, 0, 1]), r.normal(size=(3, 3)), r.uniform(-0.2, 0.2, 3), z(3)]


def codes(r: Rng, top: int) -> np.ndarray:
    return r.permutation(top).astype(np.int64)


def condition(r: Rng) -> Args:
    """Turn rate and airspeed, nodes and weights of the designs."""
    return [r.uniform(-0.04, 0.04), r.uniform(170, 210), np.array([-0.03, 0.0, 0.03]), np.array([180.0, 200.0]), z(6)]


def designs(r: Rng) -> Args:
    """Six of them: gains, states and commands of their trims."""
    return [r.normal(size=(6, 4, 26)), r.normal(size=(6, 26)), r.normal(size=(6, 4))]


CASES: dict[str, Callable[[Rng], Args]] = {
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
    "sixdof.forces.force_moment": lambda r: flown(r, *r.uniform(-0.2, 0.2, 3)),
    "sixdof.forces.moment_rates": lambda r: flown(r, r.uniform(-0.2, 0.2, 3)),
    "sixdof.forces.spin": lambda r: [*r.normal(size=3), *r.uniform(-0.2, 0.2, 3), P],
    "sixdof.forces.loads": lambda r: flown(r, *turns(r, 2), *r.uniform(-0.2, 0.2, 3)),
    "sixdof.forces.rigid": lambda r: [
        r.uniform(150, 220),
        *turns(r, 2),
        *r.uniform(-0.2, 0.2, 3),
        r.normal(size=9),
        *r.normal(size=3),
        P,
        z(6),
    ],
    "sixdof.moments.learn": lambda r: [moments(r), 0.1],
    "sixdof.looks.before": lambda r: [looks(r), 530, r.uniform(0.1, 1.0)],
    "sixdof.looks.beyond": reading,
    "sixdof.looks.apart": lambda r: [looks(r), 530, 505, SETTINGS, 5],
    "sixdof.looks.written": lambda r: [looks(r), 530, r.normal(0.0, 0.01, 3), *since(r)],
    "sixdof.looks.lacking": lambda r: [looks(r), 530, P, moments(r), z(3)],
    "sixdof.looks.learnt": lambda r: [*r.normal(0.0, 0.01, 3), 0.1, SETTINGS.copy(), 0.1, moments(r)],
    "sixdof.looks.turned": lambda r: [looks(r), 530, 505, *r.normal(0.0, 0.05, 3), P, moments(r)],
    "sixdof.looks.looked": lambda r: [looks(r), 530, *reading(r), *since(r), SETTINGS, 5, P, moments(r), z(9)],
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
    "sixdof.schedule.weights": condition,
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
        *condition(r),
        *designs(r),
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
        *condition(r),
        *designs(r),
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
        *designs(r),
        r.normal(size=6),
        r.normal(size=26),
        r.normal(size=26),
        z(4),
    ],
    "sixdof.schedule.shares": lambda r: [
        *designs(r),
        r.normal(size=6),
        r.normal(size=26),
        r.normal(size=26),
        19,
        22,
        z(3, 4),
    ],
}
