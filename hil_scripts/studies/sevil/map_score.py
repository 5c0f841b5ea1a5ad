"""What the contour algorithms make of a map's own readings: on its nodes, and between them where the map is taken as linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata.contour.algorithms import ALGORITHMS, Crossings, locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.wake_map import WakeMap
from hil_scripts.studies.sevil.metrics import evaluate
from sim_plant.rng import generator

Arr = NDArray[np.float64]
SIGMA = (
    math.sqrt(0.2),
    math.radians(math.sqrt(0.002)),
    math.radians(math.sqrt(0.002)),
)  # V, beta, alpha (sevil.md section 4)
SAMPLES = 20  # of a mean over 1 s


def middles(m: WakeMap) -> tuple[Arr, Arr]:
    """Middle of every cell [n,2] and the readings there [n,9]: means of its corners."""
    y, z = 0.5 * (m.y[1:] + m.y[:-1]), 0.5 * (m.z[1:] + m.z[:-1])
    r = m.readings
    at = 0.25 * (r[:, 1:, 1:] + r[:, 1:, :-1] + r[:, :-1, 1:] + r[:, :-1, :-1])
    Y, Z = np.meshgrid(y, z)
    return np.stack([Y.ravel(), Z.ravel()], axis=1), at.reshape(len(r), -1).T


def score(m: WakeMap, noise: float = 0.0, seed: int = 1) -> list[str]:
    """Lines of a table: algorithm, RMS error [m], share without a position [%], on the nodes and in the cells' middles; noise:
    multiple of the source's noise variance, mean over 1 s."""
    sets = {"nodes": (m.nodes(), m.readings.reshape(len(m.readings), -1).T), "middles": middles(m)}
    cut, g = Contours(m), generator(seed, "sevil.noise")
    got = {}
    for name, (points, clean) in sets.items():
        readings = clean + g.standard_normal(clean.shape) * np.repeat(SIGMA, 3) * math.sqrt(noise / SAMPLES)
        found = np.full((len(ALGORITHMS), len(points), 2), np.nan)
        for i, row in enumerate(readings):
            crossed = Crossings(cut, row)
            for k, a in enumerate(ALGORITHMS):
                at = locate(a, crossed)
                found[k, i] = (math.nan, math.nan) if at is None else at
        got[name] = [evaluate(points, f) for f in found]
    out = [
        f"{len(sets['nodes'][0])} nodes; RMS error [m] and share without a position [%]",
        "algorithm  nodes         middles",
    ]
    for k, a in enumerate(ALGORITHMS):
        cells = (f"{s[k].rms_m:6.2f} {100.0 * s[k].none:5.1f}" for s in got.values())
        out.append(f"{a:9d}  " + "  ".join(cells))
    return out
