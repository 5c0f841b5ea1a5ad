"""Turbulence met at several points of one aircraft: an isotropic frozen field, sampled exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_plant.rng import generator

Arr = NDArray[np.float64]


def dryden_tensor(r: Arr, L: float, sigma: float) -> Arr:
    """Covariance [..., 3, 3] of isotropic turbulence at separation r [..., 3] (m): sigma^2 ((f - g) r r^T / r^2 + g I).

    f = exp(-r/L), g = (1 - r/2L) exp(-r/L): the field whose one-dimensional spectra are the Dryden forms (MIL-F-8785C;
    Batchelor 1953, eq. 3.4.5). Along the track it gives the correlations of `sim_plant.wind.dryden`.
    """
    d = np.linalg.norm(r, axis=-1)[..., None, None]
    f = np.exp(-d / L)
    g = (1.0 - 0.5 * d / L) * f
    rr = r[..., :, None] * r[..., None, :] / np.maximum(d, 1e-12) ** 2
    return sigma**2 * ((f - g) * rr + g * np.eye(3))


def point_gusts(seed: int, V: float, L: float, sigma: float, dt: float, points: Arr, count: int) -> Arr:
    """Gusts [count, k, 3] (m/s) at `points` [k, 3] (m; x forward) carried through a frozen field at V [m/s], step dt [s].

    Circulant embedding of the exact covariance: spectra by FFT, factor by eigenvalues per frequency, one inverse FFT.
    The period is chosen beyond twice the series and ten length scales, so the wrap is far below rounding of the statistics.
    """
    k = len(points)
    m = 1 << int(np.ceil(np.log2(max(2 * count, 10.0 * L / (V * dt)))))
    lag = np.fft.fftfreq(m, 1.0 / m)
    cov = np.empty((m // 2 + 1, 3 * k, 3 * k), dtype=np.complex128)
    for i in range(k):
        for j in range(k):
            # place met by point i at step s + lag minus the one met by point j at step s
            r = np.broadcast_to(points[i] - points[j], (m, 3)).copy()
            r[:, 0] += V * dt * lag
            cov[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3] = np.fft.rfft(dryden_tensor(r, L, sigma), axis=0)
    w, u = np.linalg.eigh(0.5 * (cov + np.conj(np.swapaxes(cov, 1, 2))))
    g = generator(seed, "sevil.turbulence.points")
    z = g.standard_normal((m // 2 + 1, 3 * k, 2)) @ np.array([1.0, 1.0j])
    z[[0, -1]] = z[[0, -1]].real * np.sqrt(2.0)  # these two frequencies are real
    y = np.einsum("fij,fj->fi", u, np.sqrt(np.maximum(w, 0.0)) * z) * np.sqrt(0.5 * m)
    return np.ascontiguousarray(np.fft.irfft(y, m, axis=0)[:count].reshape(count, k, 3))
