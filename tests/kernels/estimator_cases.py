"""Seeded inputs of the kernels an estimator's step is made of, for test_onboard_bits.py."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver import relative_kernel as rk
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.sixdof import aids
from flightsw.sixdof.estimator import AirframeNav
from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.free_kernel import FREE_OUT

Rng = np.random.Generator
Args = list  # arguments of one call; arrays are outputs too
AC = load_aircraft("learjet24")
V, H = 195.0, 7010.0


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def quat(r: Rng) -> np.ndarray:
    q = np.array([1.0, *r.normal(0.0, 0.02, 3)])
    return q / np.sqrt((q * q).sum())


def own(r: Rng) -> np.ndarray:
    """Inputs with news of every sensor."""
    k = len(AC.probe)
    s = z(aids.PROBES + 4 * k)
    s[: aids.AIR_AGE] = 0.05, 0.05**0.5, 0.1, 5e6, 31, 0.0
    s[aids.AIR_AGE], s[aids.GYRO_N], s[aids.GYRO_AGE], s[aids.ATT_AGE], s[aids.GNSS_AGE] = 0.01, 5.0, 0.02, 0.01, 0.03
    s[aids.GYRO : aids.GYRO + 3], s[aids.ATT : aids.ATT + 4] = r.normal(0.0, 0.01, 3), quat(r)
    s[aids.ATT_SLACK], s[aids.POS_SLACK], s[aids.VEL_SIGMA] = r.uniform(0.0, 0.1, 3)
    s[aids.GNSS_POS : aids.GNSS_POS + 3] = r.normal((0.0, 0.0, -H), 1.0)
    s[aids.GNSS_VEL : aids.GNSS_VEL + 3] = r.normal((V, 0.0, 0.0), 0.1)
    s[aids.PROBES :] = *r.normal(V, 0.1, k), *r.normal(0.03, 2e-3, k), *r.normal(0.0, 2e-3, k), *[1.0] * k
    return s


def relative(r: Rng) -> np.ndarray:
    """The same of a receiver."""
    s = np.concatenate((z(rk.OWN), own(r)))
    s[rk.STAGES : rk.STAGES + 3], s[rk.HEIGHT], s[rk.REL_AGE], s[rk.REL_SLACK] = (0.03, 0.055, 0.08), H, 0.01, 0.1
    s[rk.REL_POS : rk.REL_POS + 3], s[rk.REL_VEL : rk.REL_VEL + 3] = (
        r.normal((-59.0, 20.0, 6.0), 0.2),
        r.normal(0.0, 0.1, 3),
    )
    s[rk.OWN + aids.USE] = 127
    return s


def rows() -> Args:
    return [np.zeros(20, dtype=np.int64), z(20), z(20), np.zeros(20, dtype=np.int64), z(20)]


def flying(nav: AirframeNav | RelativeNav, r: Rng, place: tuple[float, ...]) -> Args:
    """What the whole step of an estimator works on, its state as in flight at `place`."""
    x = nav.core.ukf.x
    x[:] = V, 0.0, 0.03, *r.normal(0.0, 0.01, 6), *place, *r.normal(0.0, 5.0, 3)
    nav.core.start_factor()
    assert nav._whole is not None
    return [r.normal(0.0, 0.02, 4) + np.array([0.0, 0.0, 0.0, 5e3]), *nav._whole]


def behind(r: Rng) -> Args:
    nav = RelativeNav(AC, NavParams())
    nav.peer._v[:], nav.peer._R[:] = (V, 0.0, 0.0), np.eye(3).ravel()
    return [relative(r), *flying(nav, r, (-59.0, 20.0, 6.0))]


def tune() -> np.ndarray:
    return AirframeNav(AC, NavParams()).core.tune


def state(r: Rng) -> np.ndarray:
    return np.array([V, 0.0, 0.03, *r.normal(0.0, 0.02, 6), -59.0, 20.0, 6.0, *r.normal(0.0, 5.0, 3)])


def tanker(r: Rng) -> np.ndarray:
    return np.array([*np.linalg.qr(r.normal(size=(3, 3)))[0].ravel(), *r.normal(0.0, 0.1, 6), V, 0.0, 0.0])


POS = np.array([p.position_m for p in AC.probe], dtype=float)
CASES: dict[str, Callable[[Rng], Args]] = {
    "sixdof.aids.averaged": lambda r: [own(r), POS, r.normal(0.0, 0.1, 3), z(3)],
    "sixdof.aids.air_data": lambda r: [own(r), tune(), 2, r.normal(size=3), r.normal(size=15), *rows()],
    "sixdof.aids.gyro": lambda r: [own(r), tune(), r.normal(size=15), 3, *rows()],
    "sixdof.aids.attitude": lambda r: [own(r), tune(), r.normal(size=3), state(r), r.normal(size=15), 3, *rows()],
    "sixdof.aids.gnss_position": lambda r: [own(r), tune(), r.normal(size=15), 3, *rows()],
    "sixdof.aids.gnss_velocity": lambda r: [own(r), 12, r.normal(size=3), 3, *rows()],
    "sixdof.free_kernel.free_rows": lambda r: [
        own(r), tune(), state(r), r.normal(size=15), r.normal(size=9), z(9), POS, z(3), z(3), *rows(),
    ],
    "sixdof.free_kernel.free_told": lambda r: [state(r), r.normal(size=15), r.normal(size=9), z(9), z(FREE_OUT)],
    "sixdof.free_kernel.free_step": lambda r: [own(r), *flying(AirframeNav(AC, NavParams()), r, (0.0, 0.0, -H))],
    "missions.receiver.relative_kernel.inertial_rates": lambda r: [state(r), r.normal(size=9), tanker(r), z(3)],
    "missions.receiver.relative_kernel.attitude_behind": lambda r: [quat(r), tanker(r), z(9)],
    "missions.receiver.relative_kernel.relative_rows": lambda r: [
        relative(r), tune(), state(r), r.normal(size=15), r.normal(size=9), tanker(r)[:9].copy(), z(9), tanker(r), POS, z(3),
        z(3), *rows(),
    ],
    "missions.receiver.relative_kernel.relative_told": lambda r: [
        state(r), r.normal(size=15), r.normal(size=9), tanker(r)[:9].copy(), z(9), tanker(r), r.normal(size=3), z(3),
        z(rk.RELATIVE_OUT),
    ],
    "missions.receiver.relative_kernel.relative_step": behind,
}  # fmt: skip
