"""What the wind estimate is told of wind and sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from flightsw.strict import Range

Sigma = Annotated[float, Range(0.0, 1e3)]
Positive = Annotated[float, Range(1e-6, 1e3)]
Time = Annotated[float, Range(0.1, 1e5)]
Lag = Annotated[float, Range(0.0, 0.5)]


@dataclass(frozen=True)
class WindCalParams:
    """[wind_calibration] of a tanker's or receiver's flight file. Sigmas of air data are those of one probe.

    The defaults are for sensors of the tactical class (docs/grades.md), a tenth to a fifth larger than its figures, because no
    sensor is known to the digit; for others give theirs.
    """

    on: bool = False  # false: nothing is estimated, and nothing else here may be set
    slow_q_mps: Sigma = 0.08  # [m/s] per sqrt(s) of the slow wind, horizontally
    slow_down_mps: Positive = 0.18  # [m/s] of its vertical part, stationary
    slow_down_tau_s: Time = 100.0
    gust_mps: Positive = 0.9  # [m/s] of gusts before they are learnt, per axis
    gust_L_m: Annotated[float, Range(1.0, 1e4)] = 500.0  # [m] their scale length
    gust_learn_s: Time = 60.0  # over which their size is learnt
    V_white_mps: Positive = 0.34  # [m/s] airspeed, per reading
    V_gm_mps: Sigma = 0.34
    V_gm_tau_s: Time = 35.0
    V_offset_mps: Sigma = 0.57
    V_scale: Annotated[float, Range(0.0, 0.2)] = 0.0115
    V_lag_s: Lag = 0.1
    vane_white: Annotated[float, Range(1e-6, 0.1)] = 0.002  # [rad] incidence and sideslip, per reading
    vane_gm: Annotated[float, Range(0.0, 0.1)] = 0.002
    vane_gm_tau_s: Time = 23.0
    vane_offset: Annotated[float, Range(0.0, 0.1)] = 0.004
    vane_scale: Annotated[float, Range(0.0, 0.2)] = 0.034  # [-] upwash: of the incidence
    vane_lag_s: Lag = 0.05
    att_white: Annotated[float, Range(0.0, 0.1)] = 0.0004  # [rad] attitude reference, about each body axis
    att_gm: Annotated[float, Range(0.0, 0.1)] = 0.002
    att_gm_tau_s: Time = 110.0
    att_constant: Annotated[float, Range(0.0, 0.1)] = 0.002
    vel_mps: Sigma = 0.0065  # [m/s] satellite velocity, slowly varying
    vel_tau_s: Time = 80.0
    vel_white_mps: Sigma = 0.012  # [m/s] per fix
    wake_side_mps: Sigma = 0.45  # [m/s] behind another aircraft: wind of its wake along own x and y axes
    wake_side_tau_s: Time = 20.0
    wake_down_mps: Sigma = 5.0  # [m/s] along the z axis
    wake_down_tau_s: Time = 300.0
    gate_sigma: Annotated[float, Range(3.0, 20.0)] = 6.0  # [-] a reading farther off is left out
    restart_s: Time = 5.0  # [s] without a reading taken while they come: the estimate begins anew
    sigma_max_mps: Positive = 8.0  # [m/s] beyond: the wind is not given out
