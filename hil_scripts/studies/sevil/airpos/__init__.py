"""Position in the tanker's wake by intersecting contours of the wake maps: Algorithms 1-16 of Sevil (2013), chapter 4.

`locate(algorithm, contours, readings)` is the entry; contours.py cuts the maps, intersect.py holds IM-1 and IM-2,
algorithms.py the table of algorithms, metrics.py the figures of merit. Pure functions of map and readings.
"""

from hil_scripts.studies.sevil.airpos.algorithms import ALGORITHMS, EPSILON_M, Algorithm, Crossings, decide, locate
from hil_scripts.studies.sevil.airpos.contours import Contours, Lines
from hil_scripts.studies.sevil.airpos.metrics import Metrics, evaluate, weights

__all__ = [
    "ALGORITHMS", "EPSILON_M", "Algorithm", "Contours", "Crossings", "Lines", "Metrics", "decide", "evaluate", "locate",
    "weights",
]  # fmt: skip
