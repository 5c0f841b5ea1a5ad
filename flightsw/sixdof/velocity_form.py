"""A 15-state estimator that works with inertial velocity in the place of wind (models.velocity_form) and reports wind."""

from __future__ import annotations

import numpy as np

from flightsw.filters.base import PointFilter
from flightsw.sixdof.layout import NX, WIND
from flightsw.sixdof.velocity_form_kernel import air_slope, exchange, shear


class VelocityForm:
    """Takes a filter into velocity form and back. Both ways are linear about the filter's own mean: nothing is lost."""

    def __init__(self, flt: PointFilter, sigma: np.ndarray) -> None:
        """flt: states 0..14 as layout.py, more may follow; outside `enter` .. `leave` entries 12..14 are wind. sigma [15] of the
        measurement channels, velocity last."""
        self.flt, self.sigma = flt, np.array(sigma, dtype=float)
        self._A = np.zeros((3, 6))
        self._points = np.zeros_like(flt.X)

    def start(self, S: np.ndarray) -> None:
        """Factor S [n,n] of a state read off the sensors once, in place.

        Column c < 15 is the error of reading c; wind has those of all it was computed from, and no prior of its own.
        """
        S[:NX, :] = 0.0
        S[:NX, :NX] = np.diag(self.sigma)
        air_slope(self.flt.x, self._A)
        shear(S, self._A, -1.0)

    def enter(self) -> None:
        """Mean and factor of the filter from wind to velocity."""
        self._turn(1.0)

    def leave(self) -> None:
        """Mean and factor of the filter from velocity to wind."""
        self._turn(-1.0)

    def _turn(self, sign: float) -> None:
        flt = self.flt
        air_slope(flt.x, self._A)
        S = flt.S.copy()
        shear(S, self._A, sign)
        exchange(flt.x.reshape(1, -1), sign)
        flt.set_factor(S)

    def noise(self, SQ: np.ndarray) -> None:
        """Noise factor SQ [n,nq] filled for wind, to velocity at the mean of the last `enter`, in place.

        A wind increment reaches V, beta, alpha and wind so that velocity stays: its rows become zero.
        """
        SQ[WIND, :NX] = 0.0  # what the last step left there
        shear(SQ, self._A, 1.0)

    def wind_points(self) -> np.ndarray:
        """The filter's points [k,n] with wind in entries 12..14; a copy."""
        self._points[:] = self.flt.X
        exchange(self._points, -1.0)
        return self._points
