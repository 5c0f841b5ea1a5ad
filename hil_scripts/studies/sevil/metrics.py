"""Figures of merit of a position algorithm over a grid: CE, ER and their weighted forms (Sevil 2013, 4.1-4.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Arr = NDArray[np.float64]
CONTACT = (0.0, 8.5)  # [m] (y, z) in F


@dataclass(frozen=True)
class Metrics:
    """n points, of which `estimated` have a position. Errors are distances in the y-z plane over those [m]."""

    n: int
    estimated: int
    ce_m: float  # cumulative error (4.1)
    er: float  # [-] estimation ratio M / N (4.2): 1 is best
    none: float  # [-] 1 - ER: 0 is best; what the source's figures plot (erratum E9)
    wce_m: float  # weighted cumulative error (4.3)
    wer: float  # [-] weighted estimation ratio as printed, over N (4.4): cannot reach 1
    wer_normalised: float  # [-] the same over the sum of all weights (erratum E17)
    rms_m: float
    median_m: float
    worst_m: float


def weights(points: Arr, centre: tuple[float, float] = CONTACT, half_width_m: float = 2.0) -> Arr:
    """Weight [n] of positions [n, 2]: 1 at `centre`, falling linearly to 0.1 at the edge of a square grid (pyramid).

    The source gives the end values only; the pyramid is our choice. Outside the grid the weight stays 0.1.
    """
    d = np.max(np.abs(points - np.asarray(centre)), axis=1)
    return np.maximum(1.0 - 0.9 * d / half_width_m, 0.1)


def evaluate(truth: Arr, estimate: Arr, weight: Arr | None = None) -> Metrics:
    """Metrics of positions `estimate` [n, 2] against `truth` [n, 2] = (y, z) [m]; NaN rows have no estimate.

    weight [n]: as `weights`, which is the default. Raises ValueError when the shapes differ.
    """
    if truth.shape != estimate.shape or truth.ndim != 2 or truth.shape[1] != 2:
        raise ValueError(f"estimate: shape {estimate.shape}; allowed: that of truth, {truth.shape}, as [n, 2]")
    w = weights(truth) if weight is None else weight
    have = np.isfinite(estimate).all(axis=1)
    e = np.hypot(*(estimate[have] - truth[have]).T)
    n, m = len(truth), int(have.sum())
    return Metrics(
        n=n,
        estimated=m,
        ce_m=float(e.sum()),
        er=m / n if n else 0.0,
        none=1.0 - m / n if n else 1.0,
        wce_m=float((w[have] * e).sum()),
        wer=float(w[have].sum() / n) if n else 0.0,
        wer_normalised=float(w[have].sum() / w.sum()) if n else 0.0,
        rms_m=float(np.sqrt(np.mean(e**2))) if m else float("nan"),
        median_m=float(np.median(e)) if m else float("nan"),
        worst_m=float(e.max()) if m else float("nan"),
    )
