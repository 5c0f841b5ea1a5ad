"""Wake and probe kernels against Biot-Savart quadrature, symmetry, potential-flow identities and hand geometry."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from flightsw.missions.receiver.airdata import wake_kernel as k
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector

V, RHO = 200.0, 0.58883  # [m/s], [kg/m^3]
WK = wake_vector(WakeParams())
PROBES = np.array([[6.0, 0.0, 0.0], [1.5, -5.4, 0.2], [1.5, 5.4, 0.2]])
LEVEL = np.zeros(3)
PITCHED = np.array([0.0, math.radians(3.0), 0.0])
LEFT, RIGHT = 1, 2

coordinate = st.tuples(st.floats(-80, 10), st.floats(-40, 40), st.floats(-20, 20))


def wind(x: float, y: float, z: float, wk: np.ndarray = WK, kw: float = 1.0, kt: float = 1.0) -> np.ndarray:
    out = np.zeros(3)
    k.wake_wind(
        *map(float, (x, y, z)), wk, float(kw), float(kt), V, RHO, out
    )  # of whole numbers it would be compiled anew
    return out


def readings(
    y: float, z: float, e: np.ndarray = PITCHED, probes: np.ndarray = PROBES, kw: float = 1.0, kt: float = 1.0
) -> np.ndarray:
    out = np.zeros(3 * len(probes))
    k.probe_readings(np.array([-35.5, y, z]), e, LEVEL, V, RHO, LEVEL, LEVEL, probes, WK, kw, kt, out)
    return out


def biot_savart(p: np.ndarray, a: np.ndarray, t: np.ndarray, length: float, gamma: float) -> np.ndarray:
    """Velocity at p of a straight filament from a along unit vector t, by numerical integration of the law itself."""

    def integrand(s: float, i: int) -> float:
        r = p - (a + s * t)
        return float(np.cross(t, r)[i] / (r @ r) ** 1.5)

    return (
        gamma
        / (4 * math.pi)
        * np.array([quad(integrand, 0, length, (i,), epsabs=1e-13, limit=400)[0] for i in range(3)])
    )


def test_closed_form_equals_direct_quadrature() -> None:
    """No core, no viscosity: the sum of three filaments integrated numerically, to 8 digits (sevil.md section 3)."""
    wk = wake_vector(WakeParams(core_wing_m=0.0, core_tail_m=0.0, nu_m2ps=0.0))
    rng = np.random.default_rng(1)
    for _ in range(12):
        p = rng.uniform((-60, -30, -10), (5, 30, 15))
        want = np.zeros(3)
        for at in (k.WK_WING_X, k.WK_TAIL_X):
            c, s, lift = wk[at : at + 3], wk[at + 3], wk[at + 5]
            gamma = lift / (RHO * V * s)
            left, right = c - (0, s / 2, 0), c + np.array((0, s / 2, 0))
            back = np.array((-1.0, 0, 0))
            want += biot_savart(p, left, back, math.inf, -gamma)
            want += biot_savart(p, left, np.array((0, 1.0, 0)), s, gamma)
            want += biot_savart(p, right, back, math.inf, gamma)
        assert wind(*p, wk) == pytest.approx(want, rel=1e-8, abs=1e-9)


def test_circulation_sign_downwash_between_the_tips_upwash_outside() -> None:
    """The wing alone: air sinks between the vortices and rises outside them; above the wing wake it flows inward."""
    assert wind(-35.5, 0, 0, kt=0.0)[2] > 3.0
    assert wind(-35.5, 25, 0, kt=0.0)[2] < -1.0
    assert wind(-35.5, -25, 0, kt=0.0)[2] < -1.0
    assert wind(-35.5, 8, -6, kt=0.0)[1] < 0 < wind(-35.5, 8, 6, kt=0.0)[1]
    assert wind(-35.5, 0, -1.5, kw=0.0)[2] < -1.0  # the tail carries a download: upwash behind it


def test_far_downstream_the_field_is_that_of_two_infinite_vortices() -> None:
    wk = wake_vector(WakeParams(core_wing_m=0.0, nu_m2ps=0.0))
    gamma = wk[k.WK_WING_LIFT] / (RHO * V * wk[k.WK_WING_SPACING])
    half = wk[k.WK_WING_SPACING] / 2
    assert wind(-1e7, 0, 0, wk, kt=0.0) == pytest.approx((0, 0, gamma / (math.pi * half)), rel=1e-6)


@given(coordinate)
def test_mirror_symmetry_of_the_field(p: tuple[float, float, float]) -> None:
    a, b = wind(*p), wind(p[0], -p[1], p[2])
    assert b == pytest.approx((a[0], -a[1], a[2]), abs=1e-12)


@given(coordinate, st.floats(0, 2), st.floats(0, 2))
def test_field_is_linear_in_the_two_circulations(p: tuple[float, float, float], kw: float, kt: float) -> None:
    parts = kw * wind(*p, kt=0.0) + kt * wind(*p, kw=0.0)
    assert wind(*p, kw=kw, kt=kt) == pytest.approx(parts, abs=1e-11)


@pytest.mark.parametrize("z", [0.0, -1.5])
def test_continuous_and_finite_across_the_cores(z: float) -> None:
    """Through both vortex cores and on the filaments themselves nothing jumps: the slope stays below Gamma/(2 pi rc^2)."""
    y = np.linspace(-25, 25, 20001)
    w = np.array([wind(-35.5, v, z) for v in y])
    assert np.isfinite(w).all()
    limit = 336.6 / (2 * math.pi * 0.8**2) + 57.1 / (2 * math.pi * 0.4**2)
    assert np.abs(np.diff(w, axis=0)).max() < 1.1 * limit * (y[1] - y[0])


@pytest.mark.parametrize("core", [0.0, 0.8])
def test_finite_on_every_filament_with_and_without_a_core(core: float) -> None:
    wk = wake_vector(WakeParams(core_wing_m=core, core_tail_m=core))
    y0 = WK[k.WK_WING_SPACING] / 2
    for p in [(0, 0, 0), (0, y0, 0), (-30, y0, 0), (-30, -y0, 0), (-18, 0, -1.5), (20, y0, 0)]:
        assert np.isfinite(wind(*p, wk)).all()


def test_ageing_removes_the_inner_field_only_downstream() -> None:
    """The Lamb-Oseen factor acts behind the bound vortex: ahead of it the viscosity does not matter."""
    old = wake_vector(WakeParams(nu_m2ps=5.0, core_wing_m=0.01))
    new = wake_vector(WakeParams(nu_m2ps=0.0, core_wing_m=0.01))
    y0 = WK[k.WK_WING_SPACING] / 2
    assert wind(5.0, 3.0, 1.0, old).tobytes() == wind(5.0, 3.0, 1.0, new).tobytes()
    assert abs(wind(-35.5, y0 + 0.2, 0, old, kt=0.0)[2]) < 0.2 * abs(wind(-35.5, y0 + 0.2, 0, new, kt=0.0)[2])


def test_field_is_irrotational_outside_the_cores() -> None:
    """At the point of sevil.md section 3.1: dWz/dy = 0.0526, dWy/dz = 0.0530, difference -0.0004 rad/s."""
    h = 1e-4
    dwz = (wind(-35.5, 2 + h, 8.5) - wind(-35.5, 2 - h, 8.5))[2] / (2 * h)
    dwy = (wind(-35.5, 2, 8.5 + h) - wind(-35.5, 2, 8.5 - h))[1] / (2 * h)
    assert (round(dwz, 4), round(dwy, 4), round(dwz - dwy, 4)) == (0.0526, 0.0530, -0.0004)


def test_readings_without_wake_are_plain_kinematics() -> None:
    """No circulation: u = R(V - w) + omega x rho with a rotation matrix from scipy, any attitude, rate and wind."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        e, omega, w, dot = rng.uniform(-0.3, 0.3, 3), rng.normal(size=3) * 0.1, rng.normal(size=3), rng.normal(size=3)
        out = np.zeros(9)
        k.probe_readings(rng.normal(size=3) * 20, e, dot, V, RHO, w, omega, PROBES, WK, 0.0, 0.0, out)
        C = Rotation.from_euler("ZYX", e).as_matrix().T
        for i, rho in enumerate(PROBES):
            u = C @ (np.array([V, 0, 0]) + dot - w) + np.cross(omega, rho)
            want = np.linalg.norm(u), math.asin(u[1] / np.linalg.norm(u)), math.atan2(u[2], u[0])
            assert out[i::3] == pytest.approx(want, rel=1e-12)


def test_wake_is_read_where_the_probe_is() -> None:
    e = np.array([0.2, -0.1, 0.3])
    C = Rotation.from_euler("ZYX", e).as_matrix().T
    out = np.zeros(9)
    xi = np.array([-35.5, 1.0, 6.0])
    k.probe_readings(xi, e, LEVEL, V, RHO, LEVEL, LEVEL, PROBES, WK, 1.0, 1.0, out)
    for i, rho in enumerate(PROBES):
        u = C @ (np.array([V, 0, 0]) - wind(*(xi + C.T @ rho)))
        assert out[i] == pytest.approx(np.linalg.norm(u), rel=1e-13)
        assert out[6 + i] == pytest.approx(math.atan2(u[2], u[0]), rel=1e-11)


@given(st.floats(-20, 20), st.floats(-6, 14))
def test_left_right_symmetry_of_the_readings(y: float, z: float) -> None:
    """V and alpha of the left probe at y are those of the right one at -y, sideslip with the other sign (sevil.md trap 3)."""
    a, b = readings(y, z), readings(-y, z)
    swap = [0, 2, 1]
    assert b[:3] == pytest.approx(a[:3][swap], abs=1e-11)
    assert b[3:6] == pytest.approx(-a[3:6][swap], abs=1e-13)
    assert b[6:] == pytest.approx(a[6:][swap], abs=1e-13)
    assert readings(0.0, z)[3] == pytest.approx(0.0, abs=1e-15)


def test_sign_at_one_metre_right_catches_swapped_tips() -> None:
    """At y = +1 the air under the wing wake flows outward: the nose reads negative sideslip, left > 0 > right, and the
    right tip, nearer its vortex, reads the larger sideslip and the smaller incidence. Swapped tips mirror y silently.
    """
    r = readings(1.0, 8.5)
    beta, alpha = r[3:6], r[6:9]

    def consistent(b: np.ndarray, a: np.ndarray) -> bool:
        return b[0] < 0 < b[LEFT] and b[RIGHT] < 0 and abs(b[RIGHT]) > abs(b[LEFT]) and a[RIGHT] < a[LEFT]

    assert consistent(beta, alpha)
    swapped = readings(1.0, 8.5, probes=PROBES[[0, 2, 1]])
    assert not consistent(swapped[3:6], swapped[6:9])
    assert np.degrees(beta) == pytest.approx([-0.0463, 0.2626, -0.4518], abs=5e-5)


def test_compiled_signature_accepts_any_number_of_probes() -> None:
    one = readings(1.0, 8.5, probes=PROBES[:1])
    assert one.shape == (3,)
    assert one == pytest.approx(readings(1.0, 8.5)[::3], rel=0, abs=0)
