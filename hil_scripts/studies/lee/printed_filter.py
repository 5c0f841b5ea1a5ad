"""The estimators of Lee (2011) as printed, tanker's and receiver's: a square-root unscented filter of twelve states and wind.

White noise: (4.4), (4.8) and (6.13), (6.15), every state read and the calculated wind, (4.6) or (6.14), averaged (4.7). Coloured
noise: (4.13) and (6.19), the readings differenced, no calculated wind. The printed rate of the wind cancels:
what is left of (4.1) and (6.6) is a random walk driven by Q. Corrected: E7, E16-E19. Q and the window are not printed: `Tune`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flightsw.filters.coloured import Differencer
from flightsw.filters.factory import make_filter
from flightsw.kernels.rotations import dcm_from_euler
from flightsw.sixdof.layout import AIR, EULER, NX, POS, RATE
from flightsw.sixdof.motion import air_velocity

N = 12
SPEED = 190.0  # [m/s] that makes an angle of the air data a speed


@dataclass(frozen=True)
class Tune:
    """What is not printed. q_*: roots of Q per sqrt(s); window: 2n + 1 samples; start_mps: 1-sigma of the wind at the start."""

    q_wind: float = 0.33  # [m/s]; V alike, beta and alpha over 190 m/s
    q_rate: float = 0.1  # [rad/s]
    q_euler: float = 1e-3  # [rad]
    q_pos: float = 0.05  # [m]
    window: int = 1
    start_mps: float = 20.0

    def root(self) -> np.ndarray:
        """Diagonal of the root of Q [15]."""
        a = self.q_wind / SPEED
        return np.array(
            [self.q_wind, a, a, *[self.q_rate] * 3, *[self.q_euler] * 3, *[self.q_pos] * 3, *[self.q_wind] * 3]
        )


@dataclass(frozen=True)
class Model:
    """Right-hand side over the coming step. carry(X [k,15], dt): one Runge-Kutta step of every row in place; rates(x [15]):
    dx/dt [15] at its end."""

    carry: Callable[[np.ndarray, float], None]
    rates: Callable[[np.ndarray], np.ndarray]


def dcm(e: np.ndarray) -> np.ndarray:
    """Parent to body [3,3] of psi, theta, phi e [3]."""
    R = np.empty(9)
    dcm_from_euler(float(e[0]), float(e[1]), float(e[2]), R)
    return R.reshape(3, 3)


def free_wind(y: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(4.6): wind [3] NED of readings y [12] and inertial velocity v [3]."""
    return np.asarray(v - dcm(y[EULER]).T @ np.array(air_velocity(*y[AIR])))


def relative_wind(y: np.ndarray, xi_dot: np.ndarray, y_t: np.ndarray, v_t: np.ndarray) -> np.ndarray:
    """(6.14) after E7: wind [3] NED of the receiver's readings y [12], xi_dot [3], the tanker's y_t [12] and velocity v_t [3]."""
    u_a = dcm(y[EULER]).T @ np.array(air_velocity(*y[AIR]))
    return np.asarray(v_t + dcm(y_t[EULER]).T @ (xi_dot + np.cross(y_t[RATE], y[POS]) - u_a))


def spread(fun: Callable[[np.ndarray], np.ndarray], z: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """1-sigma [m] of fun(z [k]) -> [m] for independent errors sigma [k] of z, to first order: as section 4.3 pre-computes it."""
    J = [(fun(z + e) - fun(z - e)) / 2.0 for e in np.diag(sigma)]
    return np.asarray(np.sqrt(np.sum(np.square(J), axis=0)))


class PrintedEstimator:
    """Filter of one aircraft; which one is the business of the Model it is given at each step."""

    def __init__(self, sigma: np.ndarray, wind_sigma: np.ndarray, tune: Tune, tau_s: float, unwrapped: bool) -> None:
        """sigma [12] of the readings, wind_sigma [3] of one calculated wind, tau_s [s] colour of the noise (0: white); unwrapped:
        heading is the tanker's, which goes round."""
        self.sigma, self.tune = np.asarray(sigma), tune
        self.flt = make_filter("srukf_printed", NX, NX, NX)
        self._last: deque[np.ndarray] = deque(maxlen=tune.window)
        self._wind_sigma = wind_sigma
        angle = np.zeros(N)
        angle[6] = float(unwrapped)
        self.diff = Differencer(self.sigma, np.full(N, tau_s), angle=angle, form="printed") if tau_s > 0.0 else None

    def start(self, y: np.ndarray, wind: np.ndarray) -> None:
        """From one reading of every sensor, y [12], and the wind [3] calculated of it."""
        self.flt.x[:] = np.concatenate((y, wind))
        self.flt.set_factor(np.diag([*self.sigma, *[self.tune.start_mps] * 3]))
        self._last.clear()
        if self.diff is not None:
            self.diff.reset()
            self.diff.push(y, 0.0)

    def step(self, m: Model, y: np.ndarray, wind: np.ndarray, dt: float) -> np.ndarray:
        """State [15] at the end of a step of dt [s]; y [12] the readings then, wind [3] calculated of them."""
        flt = self.flt
        np.fill_diagonal(flt.SQ, self.tune.root() * np.sqrt(dt))
        flt.draw()
        m.carry(flt.X, dt)
        flt.recombine()
        flt.draw()
        if self.diff is None:
            self._last.append(wind)
            flt.Y[:] = flt.X
            r = np.concatenate((self.sigma, self._wind_sigma / np.sqrt(len(self._last))))
            flt.correct(np.concatenate((y, np.mean(self._last, axis=0))), r, NX)
        elif self.diff.push(y, dt):
            for X, Y in zip(flt.X, flt.Y, strict=True):
                Y[:N] = m.rates(X)[:N] + self.diff.cx * X[:N]
            flt.correct(self.diff.y, self.diff.r, N)
        return np.asarray(flt.x)

    @property
    def sigmas(self) -> np.ndarray:
        """1-sigma [15]."""
        return np.array(self.flt.sigmas())
