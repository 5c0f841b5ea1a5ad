"""Parity residuals of three redundant probes: null space, normalisation, test statistic (Sevil 2013, 5.1, 5.2; sevil.md 6).

Arrays of N samples at once; one variable at a time. The onboard monitor uses the kernels of parity_kernels.py instead; a test
holds the two together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray

PARITY: Array = np.array(
    [[np.sqrt(2.0 / 3.0), -1.0 / np.sqrt(6.0), -1.0 / np.sqrt(6.0)], [0.0, 1.0 / np.sqrt(2.0), -1.0 / np.sqrt(2.0)]]
)
PARITY.setflags(write=False)


@dataclass(frozen=True)
class Residuals:
    """Normalised parity residuals: t [N,2] with unit covariance, mu [N or 1,2,3] directions of the probes, gamma [N]."""

    t: Array
    mu: Array
    gamma: Array


def null_space(h: Array) -> Array:
    """Orthonormal V [...,2,3] with V h = 0 of h [...,3] (eq. 5.3; erratum E6: V h, not V h^T).

    Equal entries give PARITY. A zero vector has no direction: PARITY is returned there.
    """
    h = np.asarray(h, dtype=float)
    size = np.linalg.norm(h, axis=-1, keepdims=True)
    u = np.where(size > 0.0, h / np.where(size > 0.0, size, 1.0), np.sqrt(1.0 / 3.0))
    pivot = np.where(np.abs(u[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    v1 = pivot - u * np.sum(pivot * u, axis=-1, keepdims=True)
    v1 /= np.linalg.norm(v1, axis=-1, keepdims=True)
    return np.stack((v1, np.cross(u, v1)), axis=-2)


def normalise(T: Array, V: Array, C: Array) -> Residuals:
    """Residuals T [N,2] = V r with V [...,2,3] and covariance C [...,3,3] of r, normalised by V C V^T = G^T G (eq. 5.7, 5.8).

    G^T is the lower Cholesky factor. gamma = |t|^2 is the same for every basis V of the null space. Raises
    numpy.linalg.LinAlgError when a V C V^T is not positive definite.
    """
    CV = C @ np.swapaxes(V, -1, -2)
    a, b, d = (np.sum(V[..., i, :] * CV[..., :, j], axis=-1) for i, j in ((0, 0), (1, 0), (1, 1)))
    e = d - b * b / np.where(a > 0.0, a, 1.0)
    if not (np.all(a > 0.0) and np.all(e > 0.0)):
        raise np.linalg.LinAlgError("V C V^T is not positive definite")
    l0, l1 = np.sqrt(a), np.sqrt(e)
    k = b / a  # row 2 of G^-T takes this much of row 1
    mu = np.stack((V[..., 0, :] / l0[..., None], (V[..., 1, :] - k[..., None] * V[..., 0, :]) / l1[..., None]), axis=-2)
    t = np.stack((T[..., 0] / l0, (T[..., 1] - k * T[..., 0]) / l1), axis=-1)
    return Residuals(t, mu if mu.ndim == 3 else mu[None], np.sum(t * t, axis=-1))


def covariance(sigma: Array | float, S: Array | None = None) -> Array:
    """diag(sigma^2) + S: [3,3] or [N,3,3]. sigma: 1-sigma of one reading, one for all probes or [3]; S covariance of the
    expectation, J P J^T for a position covariance P and J = d e / d xi (sevil.md 6)."""
    R = np.diag(np.broadcast_to(np.asarray(sigma, dtype=float) ** 2, (3,)))
    return R if S is None else R + S


def plain(Y: Array, sigma: Array | float, V: Array = PARITY) -> Residuals:
    """Residuals of readings Y [N,3] that should all be equal (eq. 5.4 to 5.8)."""
    Y = np.asarray(Y, dtype=float)
    return normalise(Y @ V.T, V, covariance(sigma))


def additive(Y: Array, E: Array, sigma: Array | float, S: Array | None = None, V: Array = PARITY) -> Residuals:
    """Residuals of Y - E, E [N,3] or [3] readings expected at the relative position (sevil.md 6, robust form recommended).

    S [3,3] or [N,3,3]: covariance of E (J P J^T).
    """
    return normalise((np.asarray(Y, dtype=float) - E) @ V.T, V, covariance(sigma, S))


def multiplicative(Y: Array, E: Array, sigma: Array | float) -> Residuals:
    """Residuals of Y [N,3] in the null space of the expected readings E [N,3] themselves (eq. 5.24 to 5.28 as printed).

    Ill-posed where the expected values cross zero (erratum E2): kept for comparison.
    """
    V = null_space(np.broadcast_to(E, np.shape(Y)))
    return normalise(np.einsum("nij,nj->ni", V, np.asarray(Y, dtype=float)), V, covariance(sigma))
