"""Output error: the most likely parameters of a flight, by Gauss and Newton's steps with Levenberg and Marquardt's damping
(docs/sources/identification.md 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil_scripts.identify.flight.model import FlightModel

Arr = NDArray[np.float64]
STEPS, ENOUGH = 10, 0.1  # at most, twice as many with gusts; last step in standard errors
DAMPING, MOST = 1e-6, 1e6
LEAST_SIGMA = 1e-9
SAME = 0.05  # [-] of the gusts' intensity, from step to step


class NotFittedError(RuntimeError):
    """The search came to no end; the text says where it stood."""


@dataclass(frozen=True)
class Fit:
    """Parameters [size]; residuals [m] and slopes [m, size] per channel at them; noise of each channel, 1 sigma; steps taken."""

    x: Arr
    residuals: list[Arr]
    slopes: list[Arr]
    sigma: Arr
    steps: int


def noise(residuals: list[Arr]) -> Arr:
    """RMS of each channel."""
    return np.array([max(float(np.sqrt(np.mean(r * r))), LEAST_SIGMA) for r in residuals])


def quadratic(m: FlightModel, x: Arr) -> float:
    """Squares of what was known before."""
    return float((x - m.mean) @ m.known @ (x - m.mean))


def cost(m: FlightModel, x: Arr, r: list[Arr], sigma: Arr) -> float:
    """Half the weighted squares with noise sigma, those of what was known before included; infinite where the model is lost."""
    total = sum(float(a @ a) / s**2 for a, s in zip(r, sigma, strict=True))
    total += quadratic(m, x)
    return 0.5 * total if np.isfinite(total) else float("inf")


def likelihood(m: FlightModel, x: Arr) -> float:
    """What is made least of: noise of the channels unknown."""
    r = m.residuals(x)
    s = noise(r)
    value = sum(len(a) * float(np.log(v)) for a, v in zip(r, s, strict=True)) + 0.5 * quadratic(m, x)
    return value if np.isfinite(value) else float("inf")


def information(m: FlightModel, slopes: list[Arr], sigma: Arr) -> Arr:
    """M [size, size] of identification.md 3, with what was known before."""
    out = m.known.copy()
    for a, s in zip(slopes, sigma, strict=True):
        out += a.T @ a / s**2
    return out


def solve(M: Arr, g: Arr) -> Arr:
    """M^-1 g, M scaled to a unit diagonal first."""
    d = 1.0 / np.sqrt(np.diag(M))
    return np.asarray(d * np.linalg.solve(M * np.outer(d, d), d * g))


def inverse(M: Arr) -> Arr:
    """Of a symmetric positive matrix, scaled to a unit diagonal first."""
    d = 1.0 / np.sqrt(np.diag(M))
    return np.asarray(np.outer(d, d) * np.linalg.inv(M * np.outer(d, d)))


def fit(m: FlightModel, x0: Arr) -> Fit:
    """From x0. Raises NotFittedError."""
    x = x0.copy()
    r = m.residuals(x)
    lam = DAMPING
    most = STEPS if m.gusts is None else 2 * STEPS
    for step in range(1, most + 1):
        sigma = noise(r)
        S = m.slopes(x, r)
        M = information(m, S, sigma)
        g = -m.known @ (x - m.mean)
        for a, b, s in zip(S, r, sigma, strict=True):
            g += a.T @ b / s**2
        now = cost(m, x, r, sigma)
        while True:
            d = solve(M + lam * np.diag(np.diag(M)), g)
            tried = m.residuals(x + d)
            if cost(m, x + d, tried, sigma) <= now:
                break
            lam = max(10.0 * lam, 1e-4)
            if lam > MOST:
                raise NotFittedError(f"no step betters the fit after {step}")
        x, r, lam = x + d, tried, max(0.1 * lam, DAMPING)
        C = inverse(M)
        errors, changed = np.sqrt(np.diag(C)), 0.0
        if m.gusts is not None:
            at = m.size - 3 * m.gusts.knots
            changed = m.gusts.learn(x[at:], C[at:, at:])
            m.expect_gusts()
        if lam <= 1e-3 and changed < SAME and float(np.max(np.abs(d) / errors)) < ENOUGH:
            return Fit(x, r, m.slopes(x, r), noise(r), step)
    raise NotFittedError(f"not settled after {most} steps")
