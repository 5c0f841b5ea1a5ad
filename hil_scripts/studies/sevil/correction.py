"""Air-data readings without the part that the aircraft's own rotation puts on them (Sevil 2013, 5.4)."""

from __future__ import annotations

import numpy as np

from flightsw.missions.receiver.airdata.fdi.parity_kernels import take_off_rotation

Array = np.ndarray


def correct_rotation(Y: Array, omega: Array, probes: Array) -> Array:
    """Readings [N,9] (V1..3 [m/s], beta1..3, alpha1..3 [rad]) as they would be without rotation (eq. 5.34 to 5.37).

    Y [N,9], omega [N,3] inertial body rates [rad/s], probes [3,3] body positions [m]. Eq. 5.35 is right as printed only with
    the source's own S (eq. 2.8, minus the usual cross-product matrix): what is subtracted is omega x rho.
    """
    out = np.empty((len(Y), 9))
    for k in range(len(Y)):
        take_off_rotation(Y[k], omega[k], probes, out[k])
    return out
