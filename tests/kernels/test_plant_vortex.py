"""Wake kernels against direct Biot-Savart quadrature and the figures of lee.md section 5 and aircraft-data.md 4."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from sim_plant.couplings.wake import WakeCoupling
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.wind.vortex import bound, horseshoe, leg, source_strength, wake_velocity
from sim_plant.world import World

STILL = {
    "wind.prevailing": "constant",
    "wind.dryden.sigma_mps": 0.0,
    "aircraft.tanker.aero_error_frac": 0.0,
    "aircraft.receiver.aero_error_frac": 0.0,
}


def filament(point: np.ndarray, start: np.ndarray, along: np.ndarray, length: float, gamma: float) -> np.ndarray:
    """Gamma / (4 pi) times the integral of dl x r / |r|^3 over a straight filament, each component by quadrature."""

    def part(s: float, axis: int) -> float:
        r = point - start - s * along
        return float(np.cross(along, r)[axis] / np.linalg.norm(r) ** 3)

    near = float((point - start) @ along)
    edges = sorted({0.0, length, *(min(max(near + d, 0.0), length) for d in (-50.0, 0.0, 50.0))})
    total = np.zeros(3)
    for axis in range(3):
        for a, b in pairwise(edges):
            total[axis] += quad(part, a, b, args=(axis,), epsabs=1e-13, epsrel=1e-11, limit=200)[0]
    return gamma / (4 * math.pi) * total


@pytest.mark.parametrize(
    "point", [(-35.5, 0.0, 8.5), (-59.0, 56.0, 0.0), (-38.0, -6.0, 9.0), (12.0, 3.0, -4.0), (-20.0, 30.0, 2.0)]
)
def test_horseshoe_equals_biot_savart_quadrature(point: tuple[float, float, float]) -> None:
    src = np.array([-0.3, 0.0, 0.5, 31.32, 1e-9])
    d = np.array([-math.cos(0.06), 0.01, -math.sin(0.06)])
    d /= np.linalg.norm(d)
    half, gamma = 0.5 * src[3], 330.0
    p = np.array(point)
    left, right = src[:3] - [0, half, 0], src[:3] + [0, half, 0]
    far = 2e5  # [m]; what lies beyond contributes about Gamma b / (4 pi far^2)
    expect = filament(p, right, d, far, gamma) - filament(p, left, d, far, gamma)
    expect += filament(p, left, np.array([0.0, 1.0, 0.0]), 2 * half, gamma)
    got = np.array(horseshoe(*p, src, 0, gamma, *d, 0.0, 195.0))
    assert np.allclose(got, expect, rtol=1e-7, atol=1e-8)


def test_core_and_ageing_only_weaken_the_filament() -> None:
    free = leg(-30.0, 2.0, 0.0, -1.0, 0.0, 0.0, 100.0, 1e-9, 0.0, 195.0)
    core = leg(-30.0, 2.0, 0.0, -1.0, 0.0, 0.0, 100.0, 1.2, 0.0, 195.0)
    aged = leg(-30.0, 2.0, 0.0, -1.0, 0.0, 0.0, 100.0, 1.2, 1.0, 195.0)
    assert core[2] / free[2] == pytest.approx(4.0 / (4.0 + 1.44), rel=1e-9)
    tau = 30.0 / 195.0
    assert aged[2] / core[2] == pytest.approx(1.0 - math.exp(-4.0 / (4.0 * tau)), rel=1e-9)


def test_velocity_is_finite_on_the_axes() -> None:
    assert leg(0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 100.0, 1.2, 1.0, 195.0) == (0.0, 0.0, 0.0)
    assert np.all(np.isfinite(leg(-10.0, 0.0, 0.0, -1.0, 0.0, 0.0, 100.0, 1.2, 1.0, 195.0)))
    assert np.all(np.isfinite(bound(0.0, 3.0, 0.0, 15.0, 100.0, 1.2)))


def _at(xi: tuple[float, float, float]) -> World:
    w = World(load_scenario("refueling", STILL | {"aircraft.receiver.start.xi_m": list(xi)}), 1)
    w.sense()
    return w


def _shed(w: World) -> tuple[np.ndarray, np.ndarray]:
    """Observation of the leader, and its wake's source vector."""
    return w.members[0].obs, next(c for c in w.couplings if isinstance(c, WakeCoupling)).source


def test_circulation_matches_the_reference() -> None:
    """Gamma0 = W / (rho V b0) = 327 m^2/s at 120 t, plus the 5 % the wing carries for the tail's download."""
    obs, source = _shed(_at((-35.5, 0.0, 8.5)))
    assert source_strength(obs, source)[0] == pytest.approx(327.0 * 1.05, rel=0.01)


def test_downwash_at_contact_and_upwash_at_observation() -> None:
    """lee.md section 5: effective 4.62 m/s down, -0.17 along, q_eff -0.027 rad/s at contact (V 190);
    0.5 up at observation."""
    w = _at((-35.5, 0.0, 8.5))
    t = w.truth(1)
    c = w.members[0].s
    assert 4.4 < t.wind_n[2] < 5.2
    assert abs(t.wind_n[1]) < 0.01
    assert -0.035 < t.wind_rot[1] < -0.018
    assert abs(t.wind_rot[0]) < 1e-3 and abs(t.wind_rot[2]) < 1e-3
    assert c[n.S_T] > 0
    assert -0.7 < _at((-59.13, 56.33, 0.0)).truth(1).wind_n[2] < -0.4


def test_tip_vortex_is_deadly_and_mirrored() -> None:
    obs, source = _shed(_at((-35.5, 0.0, 8.5)))
    right = wake_velocity(-35.5, 15.7, 3.0, obs, source)
    left = wake_velocity(-35.5, -15.7, 3.0, obs, source)
    assert abs(right[1]) > 7.0
    assert np.allclose(right, (left[0], -left[1], left[2]), rtol=1e-6)


def test_effective_rotation_of_rigidly_rotating_air_is_its_rate() -> None:
    """The slopes used for p, q, r return the rate of a field W = omega x r exactly, once, not twice (lee.md E23)."""
    x = _at((-35.5, 0.0, 8.5)).members[1].exposure
    assert x is not None
    pts, wt, ns, nf = x.points[: x.n_frame], x.weight, x.n_span, x.n_frame
    field = np.cross(np.array([0.1, -0.2, 0.3]), pts)
    p = wt[:ns, 1] @ field[:ns, 2]
    q = -wt[ns:nf, 2] @ field[ns:nf, 2]
    r = wt[ns:nf, 2] @ field[ns:nf, 1]
    assert np.allclose((p, q, r), (0.1, -0.2, 0.3), atol=1e-12)
    assert wt[:, 0].sum() == pytest.approx(1.0)
