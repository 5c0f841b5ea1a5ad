"""Onboard rotation kernels against scipy's Rotation, and their invariants."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    mul33,
    mul33_t,
    quat_from_euler,
    rotate_dcm,
    wrap_pi,
)

repeatable = settings(deadline=None, derandomize=True)  # no timed verdicts, the same examples every run
angle = st.floats(-math.pi, math.pi)
pitch = st.floats(-1.5, 1.5)
rate = st.floats(-3.0, 3.0)


def dcm(psi: float, theta: float, phi: float) -> np.ndarray:
    R = np.zeros(9)
    dcm_from_euler(psi, theta, phi, R)
    return R


def scipy_bn(psi: float, theta: float, phi: float) -> np.ndarray:
    """Navigation to body: scipy's intrinsic z-y'-x'' rotation takes body vectors to navigation axes, so its inverse."""
    return Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix().T


@repeatable
@given(angle, pitch, angle)
def test_matrix_from_euler_angles_is_scipys(psi: float, theta: float, phi: float) -> None:
    assert np.allclose(dcm(psi, theta, phi).reshape(3, 3), scipy_bn(psi, theta, phi), atol=1e-15)


@repeatable
@given(angle, pitch, angle)
def test_quaternion_from_euler_angles_is_scipys_scalar_first(psi: float, theta: float, phi: float) -> None:
    q = np.zeros(4)
    quat_from_euler(psi, theta, phi, q)
    want = Rotation.from_euler("ZYX", [psi, theta, phi]).as_quat(scalar_first=True)
    assert min(np.abs(q - want).max(), np.abs(q + want).max()) < 1e-15
    assert abs(np.linalg.norm(q) - 1.0) < 1e-15


@repeatable
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda x: np.linalg.norm(x) > 0.1))
def test_matrix_from_quaternion_is_scipys(values: list[float]) -> None:
    q, R = np.array(values) / np.linalg.norm(values), np.zeros(9)
    dcm_from_quat(q, R)
    # q_nb rotates body vectors to navigation axes, the matrix goes the other way
    assert np.allclose(R.reshape(3, 3), Rotation.from_quat(q, scalar_first=True).as_matrix().T, atol=1e-15)


@repeatable
@given(angle, pitch, angle)
def test_euler_angles_survive_the_matrix(psi: float, theta: float, phi: float) -> None:
    e = np.zeros(3)
    euler_from_dcm(dcm(psi, theta, phi), e)
    assert abs(wrap_pi(e[0] - psi)) < 1e-12
    assert abs(e[1] - theta) < 1e-12
    assert abs(wrap_pi(e[2] - phi)) < 1e-12


def test_euler_angles_stay_finite_when_rounding_leaves_the_unit_interval() -> None:
    R, e = dcm(0.3, math.pi / 2, 0.0), np.zeros(3)
    R[2] = -1.0 - 1e-12
    euler_from_dcm(R, e)
    assert np.isfinite(e).all()
    assert e[1] == math.pi / 2


@repeatable
@given(angle, pitch, angle, rate, rate, rate, st.floats(0.0, 2.0))
def test_turning_a_frame_is_scipys_rotation_vector(
    psi: float, theta: float, phi: float, p: float, q: float, r: float, dt: float
) -> None:
    R, out = dcm(psi, theta, phi), np.zeros(9)
    w = np.array([p, q, r])
    rotate_dcm(R, w, dt, out)
    want = Rotation.from_rotvec(w * dt).as_matrix().T @ R.reshape(3, 3)
    assert np.allclose(out.reshape(3, 3), want, atol=1e-11)


@repeatable
@given(angle, pitch, angle)
def test_turning_there_and_back_changes_nothing(psi: float, theta: float, phi: float) -> None:
    R, a, b = dcm(psi, theta, phi), np.zeros(9), np.zeros(9)
    w = np.array([0.3, -0.7, 1.1])
    rotate_dcm(R, w, 0.8, a)
    rotate_dcm(a, w, -0.8, b)
    assert np.allclose(b, R, atol=1e-14)
    assert np.allclose(a.reshape(3, 3) @ a.reshape(3, 3).T, np.eye(3), atol=1e-14)


def test_a_frame_that_does_not_turn_is_copied_exactly() -> None:
    R, out = dcm(0.4, 0.1, -0.2), np.zeros(9)
    rotate_dcm(R, np.zeros(3), 5.0, out)
    assert (out == R).all()


def test_products_are_numpys() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        A, B, C = rng.normal(size=9), rng.normal(size=9), np.zeros(9)
        mul33(A, B, C)
        assert np.allclose(C.reshape(3, 3), A.reshape(3, 3) @ B.reshape(3, 3), atol=1e-14)
        mul33_t(A, B, C)
        assert np.allclose(C.reshape(3, 3), A.reshape(3, 3) @ B.reshape(3, 3).T, atol=1e-14)


@repeatable
@given(st.floats(-1e4, 1e4))
def test_wrapping_keeps_the_direction_and_lands_in_one_turn(a: float) -> None:
    w = wrap_pi(a)
    assert -math.pi <= w <= math.pi
    assert abs(math.remainder(w - a, 2 * math.pi)) < 1e-11


@pytest.mark.parametrize(
    ("a", "want"), [(0.0, 0.0), (math.pi, -math.pi), (-math.pi, -math.pi), (3 * math.pi / 2, -math.pi / 2)]
)
def test_wrapping_at_the_seam(a: float, want: float) -> None:
    assert abs(wrap_pi(a) - want) < 1e-15
