"""Extended Kalman filter on the point interface: F and H by central differences of the owner's model.

The same model code then serves every filter of the family, and no hand-written Jacobian can disagree with it. The step
is a thousandth of a state's sigma: third-order terms enter with 1e-6 of what a sigma-point filter sees of them.
"""

from __future__ import annotations

from flightsw.filters.kalman import KalmanFilter


class ExtendedKalmanFilter(KalmanFilter):
    """First-order filter: mean through the model itself, covariance through its slope at the mean."""

    step = 1e-3  # [-] difference step in units of each state's sigma
