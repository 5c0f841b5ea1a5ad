"""Calculated measurement of wind (CMW): wind from measured quantities alone, causal moving mean (Lee 2011, 4.7, 4.8 and 6.14)."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from flightsw.kernels.rotations import dcm_from_quat, to_parent
from flightsw.refusal import GNSS_VEL
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.sixdof.layout import X_V
from flightsw.sixdof.motion import air_velocity
from flightsw.types import SensorFrame


def single_sigma(p: NavParams, V: float) -> float:
    """1-sigma [m/s] of one unaveraged component at airspeed V [m/s], the three directions averaged."""
    angles = (p.r_beta**2 + p.r_alpha**2) / 2 + p.r_euler**2
    return math.sqrt(p.r_vel**2 + p.r_V**2 / 3 + V**2 * angles * 2 / 3)


def calculated_wind(f: SensorFrame, air: np.ndarray) -> np.ndarray:
    """Wind [3] NED [m/s] of a free aircraft: v - R_BI^T u_a from measured quantities (Lee 4.7); air [3] V, beta, alpha."""
    R, ua = np.zeros(9), np.zeros(3)
    dcm_from_quat(np.array(f.att_q_nb), R)
    to_parent(R, np.array(air_velocity(*air)), ua)
    return np.array(f.gnss_vel_n) - ua


class CalculatedWind:
    """Mean of the last NavParams.cmw_samples calculated winds, queued as three measurements of the wind states.

    Its rows are judged and reported as those of GNSS velocity, which they are made of. The pre-computed variance of the mean is
    used (errata E19: the printed noise is zero). Successive means share samples; the filter is told nothing of that, as printed.
    """

    def __init__(self, p: NavParams, code: int) -> None:
        """code: first of the three measurement codes."""
        self.p, self.code = p, code
        self._last: deque[np.ndarray] = deque(maxlen=p.cmw_samples)

    def reset(self) -> None:
        """Forget the samples."""
        self._last.clear()

    def queue(self, core: EstimatorCore, wind: np.ndarray) -> None:
        """Take one calculated wind [3] NED [m/s] and queue the mean."""
        self._last.append(wind)
        n = len(self._last)
        mean = np.mean(self._last, axis=0)
        r = math.sqrt(single_sigma(self.p, core.air[X_V]) ** 2 / n)
        for i in range(3):
            core.add(self.code + i, float(mean[i]), r, GNSS_VEL)
