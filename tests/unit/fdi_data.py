"""Readings of three probes with known statistics, for the tests of the air-data monitor."""

from __future__ import annotations

import numpy as np
from scipy.stats import binomtest

from flightsw.missions.receiver.airdata.fdi.monitor import Fdi
from flightsw.missions.receiver.airdata.reports import FdiStatus

SIGMA_V = float(np.sqrt(0.2))  # [m/s] Sevil 2013
SIGMA_A = float(np.radians(np.sqrt(0.002)))  # [rad]
SIGMA9 = np.repeat([SIGMA_V, SIGMA_A, SIGMA_A], 3)
E9 = np.array([199.6, 200.4, 200.1, 0.0, 0.031, -0.029, 0.05, 0.036, 0.034])  # [m/s, rad] of the kind met at contact
ALL = 0x1FF  # all nine channels
ZERO3, S0 = np.zeros(3), np.zeros((9, 9))
BIG = np.repeat([3.0, np.radians(1.0), np.radians(1.0)], 3)  # faults of the source by channel
COMMON_SIGMA = np.array([0.39, *np.radians([0.15, 0.15])])


def readings(n: int, seed: int, fault: np.ndarray | None = None, common: np.ndarray | None = None) -> np.ndarray:
    """[n,9] expected readings + white noise + a fault [9] + a common value per variable [n,3]."""
    y = E9 + np.random.default_rng(seed).normal(size=(n, 9)) * SIGMA9
    if common is not None:
        y += np.repeat(common, 3, axis=1)
    return y if fault is None else y + fault


def noise3(n: int, seed: int, sigma: float = SIGMA_V) -> np.ndarray:
    """[n,3] white noise of one variable."""
    return np.random.default_rng(seed).normal(0.0, sigma, (n, 3))


def consistent(k: int, n: int, p: float, confidence: float = 0.999) -> bool:
    """Whether k successes in n trials agree with probability p (Clopper-Pearson interval)."""
    ci = binomtest(int(k), n).proportion_ci(confidence)
    return ci.low <= p <= ci.high


def fly(f: Fdi, y: np.ndarray, ok: np.ndarray | int = ALL, virtual: bool = True, **kw: object) -> list[FdiStatus]:
    """Feed readings y [n,9] with the right expectation."""
    masks = np.broadcast_to(ok, len(y))
    c = (ZERO3, COMMON_SIGMA) if virtual else (None, None)
    args = {"e": E9, "S": S0, **kw}
    return [f.step(y[k], int(masks[k]), args["e"], args["S"], *c, t_us=50_000 * k) for k in range(len(y))]  # type: ignore[arg-type]


def fault(*channels: int, sign: int = 1) -> np.ndarray:
    out = np.zeros(9)
    out[list(channels)] = sign * BIG[list(channels)]
    return out
