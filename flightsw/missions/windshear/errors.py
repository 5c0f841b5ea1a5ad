"""What the filter with 26 states learns of its instruments and its aircraft besides: offsets, thrust, pitching moment.

An offset of the airspeed is no state: the only thing that would show it is the dynamic pressure in the pitching moment, and a
moment model a tenth wrong then puts metres per second into the wind. It is considered instead: it stands in the published sigma
of wind and airspeed and moves no estimate; nor is one of the attitude, which nothing tells from a path that is steeper. jing.md
7.3."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.strict import Range

Array = np.ndarray
DEG = math.pi / 180.0
NonNeg = Annotated[float, Range(0.0)]
Time = Annotated[float, Range(0.1, 1000.0)]
LEAST_RADIO_M = 0.0  # heights below are the ground's


@dataclass(frozen=True)
class ErrorParams:
    """1-sigma at the start of each error state and its walk per root second; decay of the wind's rates; the radio altimeter; what
    the airspeed is considered to be wrong by."""

    accel_mps2: NonNeg = 0.2
    accel_walk: NonNeg = 1e-3
    vane_rad: NonNeg = 1.0 * DEG
    vane_walk: NonNeg = 1e-4
    gyro_radps: NonNeg = 1e-4
    gyro_walk: NonNeg = 0.0
    climb_mps: NonNeg = 0.5
    climb_walk: NonNeg = 1e-3
    baro_m: NonNeg = 15.0
    baro_walk: NonNeg = 0.02
    thrust: NonNeg = 0.05
    thrust_walk: NonNeg = 0.05
    moment: NonNeg = 0.1
    moment_walk: NonNeg = 1e-4
    drag_walk: NonNeg = 3e-4  # of the scale of drag, in place of noise.scale
    radio_scale: NonNeg = 0.01
    radio_scale_walk: NonNeg = 1e-6
    # white noise per sample that stands for a radio altimeter's slow errors, at the ground and growing to root two at radio_far_m
    radio_m: Annotated[float, Range(0.01)] = 4.0
    radio_far_m: Annotated[float, Range(1.0)] = 300.0
    # rates of the wind die out: an error of theirs cannot grow without bound where nothing shows it
    fade_rate_s: Time = 5.0
    fade_second_s: Time = 5.0
    # lag of airspeed and vane; 0: none
    airspeed_lag_s: Annotated[float, Range(0.0, 2.0)] = 0.0
    vane_lag_s: Annotated[float, Range(0.0, 2.0)] = 0.0
    late_samples: Annotated[int, Range(0, 5)] = 0  # all readings are that old; of velocities by their time stamp
    # considered: offset and factor less one of the airspeed and of the height, offset of the attitude
    airspeed_mps: NonNeg = 0.5
    airspeed_frac: NonNeg = 0.01
    height_m: NonNeg = 0.0
    height_frac: NonNeg = 0.0
    attitude_rad: NonNeg = 0.0

    def start(self) -> tuple[Array, Array]:
        """Mean and 1-sigma [8] of the error states at the start, in the order of dynamics.py; lags and gyro apart."""
        mean = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0])
        return mean, np.array(
            [self.accel_mps2, self.accel_mps2, self.vane_rad, self.climb_mps, self.baro_m]
            + [self.thrust, self.moment, self.radio_scale]
        )

    def walks(self) -> Array:
        """Growth [8] per root second."""
        return np.array(
            [self.accel_walk, self.accel_walk, self.vane_walk, self.climb_walk, self.baro_walk]
            + [self.thrust_walk, self.moment_walk, self.radio_scale_walk]
        )

    def radio_sigma(self, height_m: float) -> float:
        """1-sigma [m] of one sample of the radio altimeter at this height [m]."""
        far = max(height_m, LEAST_RADIO_M) / self.radio_far_m
        return self.radio_m * math.sqrt(1.0 + far * far)

    def airspeed_sigma(self, V: float) -> float:
        """1-sigma [m/s] the airspeed V [m/s] is considered to be wrong by."""
        return math.hypot(self.airspeed_mps, self.airspeed_frac * V)

    def consider(self, s: Array, V: float, h: float, step_x: float, step_h: float) -> None:
        """Into the 1-sigma s [26] of a state at airspeed V [m/s], height h [m]: what is not estimated, and the steps [m/s] the
        wind may have made along and up since the readings were taken."""
        speed, tilt = self.airspeed_sigma(V), self.attitude_rad
        s[k.H] = math.hypot(s[k.H], self.height_m + self.height_frac * max(h, 0.0))
        s[k.VA] = math.sqrt(s[k.VA] ** 2 + speed**2 + step_x**2)
        s[k.WX] = math.sqrt(s[k.WX] ** 2 + speed**2 + step_x**2)
        s[k.GA] = math.sqrt(s[k.GA] ** 2 + tilt**2 + (step_h / V) ** 2)
        s[k.AL] = math.hypot(s[k.AL], step_h / V)
        s[k.WH] = math.sqrt(s[k.WH] ** 2 + (V * tilt) ** 2 + step_h**2)


def fading(par: Array, p: ErrorParams) -> None:
    """Into the parameter vector [NP]: the wind's rates die out, the air data lag."""
    par[k.P_FADE1], par[k.P_FADE2] = 1.0 / p.fade_rate_s, 1.0 / p.fade_second_s
    par[k.P_LAGV], par[k.P_LAGA] = p.airspeed_lag_s, p.vane_lag_s


def with_errors(Q: Array, p: ErrorParams, dt: float) -> Array:
    """Process covariance [26,26] of a step dt [s] from that of the 15 states Q [15,15]."""
    out = np.zeros((k.NE, k.NE))
    out[: k.NX, : k.NX] = Q
    out[k.KD, k.KD] = p.drag_walk**2 * dt
    out[range(k.NX, k.L_VA), range(k.NX, k.L_VA)] = p.walks() ** 2 * dt
    out[k.B_Q, k.B_Q] = p.gyro_walk**2 * dt
    return out


def extended(x: Array, sigma: Array, p: ErrorParams) -> tuple[Array, Array]:
    """Mean and 1-sigma [26] of a start known by its 15 states x [>=15], sigma [>=15]."""
    mean, spread = p.start()
    lagging = [k.VA, k.AL]
    return (
        np.concatenate([x[: k.NX], mean, x[lagging], [0.0]]),
        np.concatenate([sigma[: k.NX], spread, sigma[lagging], [p.gyro_radps]]),
    )


def raise_cold(s: Array, V: float, p: ErrorParams) -> None:
    """1-sigma s [>=15] of a state read off the instruments at airspeed V [m/s], raised by what these may be wrong by."""
    s[k.GA], s[k.AL] = math.hypot(s[k.GA], p.vane_rad), math.hypot(s[k.AL], p.vane_rad)
    s[k.H] = math.hypot(s[k.H], p.baro_m)
    s[k.WH] = math.sqrt(s[k.WH] ** 2 + (V * p.vane_rad) ** 2 + p.climb_mps**2)
