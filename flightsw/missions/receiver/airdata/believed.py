"""What the wake-position filter believes before it has read anything: noises, correlation times, sizes, first variances."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata import state as k
from flightsw.missions.receiver.airdata.params import WakePositionParams

Arr = NDArray[np.float64]


def noises(p: WakePositionParams) -> Arr:
    """Process noises q [7] of state.propagate."""
    flow = p.q_offset_flow
    return np.array([p.q_acc, p.q_scale_wing, p.q_scale_tail, p.q_height, p.q_offset_V, flow, flow])


def times(p: WakePositionParams) -> Arr:
    """Correlation times tau [6] s; that of turbulence goes by the airspeed."""
    return np.array([1.0, p.slow_tau_s, p.acc_tau_s, p.x_tau_s, p.aid_tau_s, p.lift_tau_s])


def sizes(p: WakePositionParams) -> Arr:
    """1-sigma [6] of the Gauss-Markov processes; that of x comes with each frame."""
    return np.array([p.gust_sigma, p.slow_sigma, p.acc_bias_sigma, 1.0, p.aid_slow_m, p.lift_sigma])


def variances(p: WakePositionParams, size: Arr) -> Arr:
    """Variance [28] of each state where a filter begins, zero of the position, which comes with the start; size [6] then."""
    out = np.zeros(k.N)
    out[k.SPEED] = p.start_v_sigma**2
    if p.scales:
        out[k.X_KW], out[k.X_KT] = p.scale_wing_sigma**2, p.scale_tail_sigma**2
    out[k.X_H] = p.height_sigma_m**2 if p.height else 0.0
    out[k.TURB], out[k.SLOW] = p.gust_sigma**2, p.slow_sigma**2
    out[k.X_ACC : k.X_X] = p.acc_bias_sigma**2
    out[k.X_X] = size[k.M_X] ** 2
    out[k.OFFSETS] = p.offset_flow**2
    out[k.X_OFF : k.X_OFF + kp.R_BETA] = p.offset_V**2
    out[k.AID] = p.aid_slow_m**2
    out[k.X_LIFT] = size[k.M_LIFT] ** 2
    return out
