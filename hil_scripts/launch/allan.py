"""Allan deviation of the plant's inertial sensors against their terms, and its picture. Source: IEEE Std 952, annex C."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hil_scripts.launch.plate import plates
from sim_plant.sensors.errors import Errors
from sim_plant.sensors.terms import GRADES, PAPER, Terms, group_terms

Arr = NDArray[np.float64]
RATE_HZ = 100.0
GRADED = tuple(g for g in GRADES if g != PAPER)


def deviation(x: Arr, m: NDArray[np.int64]) -> Arr:
    """Overlapping Allan deviation [u] of samples `x` [n, u] at cluster lengths `m` [k, samples]."""
    s = np.concatenate([[0.0], np.cumsum(x)])
    out = [np.sqrt(0.5 * np.mean(((s[2 * i :] - 2.0 * s[i:-i] + s[: -2 * i]) / i) ** 2)) for i in m.tolist()]
    return np.array(out)


def theory(t: Terms, tau: Arr) -> Arr:
    """Allan deviation [u] at cluster times tau [s] of the terms: density N^2 / tau; Gauss-Markov (sigma, T)
    2 sigma^2 T / tau (1 - T / (2 tau) (3 - 4 e^(-tau/T) + e^(-2 tau/T))); walk K^2 tau / 3. White per sample and the quantum are
    not in it: no grade's inertial unit has the first, and the second is small beside the density at these rates."""
    r = t.tau_s / tau
    gm = 2.0 * t.gm**2 * r * (1.0 - 0.5 * r * (3.0 - 4.0 * np.exp(-1.0 / r) + np.exp(-2.0 / r)))
    return np.asarray(np.sqrt(t.density**2 / tau + gm + t.walk**2 * tau / 3.0), dtype=np.float64)


def curve(grade: str, family: str, seed: int, hours: float) -> tuple[Arr, Arr, Arr]:
    """Cluster times [k, s], deviation of the three axes of `family` (gyro, acc) at rest [k, 3], degrees of freedom [k].

    The freedom is that of independent clusters, n / m - 1: the overlapping estimate has no less.
    """
    terms = group_terms("imu", grade, {}, "")
    assert terms is not None
    draws = Errors(seed, "allan", "imu", terms, 1.0 / RATE_HZ, 0, 1.0, 1.0).draws
    n = round(hours * 3600.0 * RATE_HZ)
    x = draws[0 if family == "gyro" else 1][1].block(n)
    m = np.unique(np.round(np.geomspace(10, n / 12, 14)).astype(np.int64))
    got = np.stack([deviation(x[:, j], m) for j in range(3)], axis=1)
    return m / RATE_HZ, got, n / m - 1.0


def draw(out: Path, hours: float = 4.0) -> list[Path]:
    """Picture of every grade's gyro and accelerometer beside its closed form, one file per theme; the files written."""
    names = {"gyro": "gyro [rad/s]", "acc": "accelerometer [m/s²]"}
    curves = {(g, f): curve(g, f, 1, hours) for g in GRADED for f in names}

    def panels(axes: list[Any]) -> None:
        for ax, (family, title) in zip(axes, names.items(), strict=True):
            for i, grade in enumerate(GRADED):
                tau, got, _ = curves[grade, family]
                terms = group_terms("imu", grade, {}, "")
                assert terms is not None
                ax.loglog(tau, theory(terms.columns[family], tau), color=f"C{i}", lw=1.5, label=f"{grade}, closed form")
                ax.loglog(tau, got, ".", color=f"C{i}", ms=5)
            ax.set(xlabel="cluster time [s]", title=f"Allan deviation, {title}")
        axes[0].legend(frameon=False)

    return plates(out, "allan", panels)
