"""Which of three probes is faulty, from normalised residuals (Sevil 2013, eq. 5.16 to 5.22; erratum E1)."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def cosines(t: Array, mu: Array) -> Array:
    """Cosines [N,3] of the angles between residuals t [N,2] and probe directions mu [N or 1,2,3]; zero residual: 0."""
    dot = np.einsum("...i,...ij->...j", t, mu)
    size = np.linalg.norm(t, axis=-1)[..., None] * np.linalg.norm(mu, axis=-2)
    return np.where(size > 0.0, dot / np.where(size > 0.0, size, 1.0), 0.0)


def angle_difference(t: Array, mu: Array) -> Array:
    """The source's index theta_i [N,3] = |t/|t| - mu_i/|mu_i|| = sqrt(2 - 2 cos) in [0, 2] (eq. 5.18, 5.21)."""
    return np.sqrt(np.maximum(2.0 - 2.0 * cosines(t, mu), 0.0))


def isolate_printed(t: Array, mu: Array) -> Array:
    """Probe [N] by the smallest angle difference as printed (eq. 5.22). Blames a wrong probe for every low reading (E1)."""
    return np.argmin(angle_difference(t, mu), axis=-1)


def isolate(t: Array, mu: Array) -> tuple[Array, Array]:
    """(probe [N], sign [N] +1 reads high, -1 low) by the largest |cos|.

    With t and mu normalised by the full covariance, gamma cos^2 is the Mahalanobis gain of a single-column fit (see fit_gain),
    so this holds for unequal covariance too.
    """
    c = cosines(t, mu)
    probe = np.argmax(np.abs(c), axis=-1)
    sign = np.where(np.take_along_axis(c, probe[..., None], axis=-1)[..., 0] < 0.0, -1, 1)
    return probe, sign


def fit_gain(T: Array, V: Array, S: Array) -> tuple[Array, Array]:
    """(gain [N,3], fault [N,3]) of blaming each probe alone: raw residuals T [N,2] = V r, their covariance S [...,2,2].

    gain_i = (V_i^T S^-1 T)^2 / (V_i^T S^-1 V_i) is how much gamma falls, fault_i = (V_i^T S^-1 T) / (V_i^T S^-1 V_i) the most
    likely size (sevil.md 6).
    """
    W = np.linalg.inv(S)
    num = np.einsum("...ji,...jk,...k->...i", V, W, T)
    den = np.einsum("...ji,...jk,...ki->...i", V, W, V)
    return num * num / den, num / den


def isolate_mahalanobis(T: Array, V: Array, S: Array) -> tuple[Array, Array]:
    """(probe [N], fault [N]) by the largest gain of fit_gain; arguments as there."""
    gain, fault = fit_gain(T, V, S)
    probe = np.argmax(gain, axis=-1)
    return probe, np.take_along_axis(np.broadcast_to(fault, gain.shape), probe[..., None], axis=-1)[..., 0]
