"""The filter's work in one step of an estimator, put together from parts that its parameters choose.

An estimator brings its motion and its sensors. What both kinds of aircraft have in common is chosen here: how the wind moves,
in which form the state is kept, states beyond the 15, colour of the measurement noise. No part knows another.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flightsw.filters.srukf import SquareRootUKF
from flightsw.sixdof.coloured_noise import Colour, colour_states
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.sixdof.gust_states import GUSTS, GustStates
from flightsw.sixdof.layout import BEYOND, EULER, NX, WIND
from flightsw.sixdof.velocity_form import VelocityForm
from flightsw.sixdof.velocity_form_kernel import exchange
from flightsw.sixdof.wind_noise import WindNoise
from flightsw.types import SensorFrame


class Motion(Protocol):
    """Prediction model."""

    def start(self, f: SensorFrame) -> None:
        """The estimate has been taken from frame f."""

    def carry(self, X: np.ndarray, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """Carry the points X [k,>=15] over dt [s] in place; f the frame at the end, u [4] mean controls, rho [kg/m^3]."""


class Sensors(Protocol):
    """Measurement model."""

    def expect(self, X: np.ndarray, c: EstimatorCore) -> None:
        """ukf.Y [k,>=m] <- what the queued rows of `c` should read at the points X [k,>=15], which hold wind; the rows'
        order may change."""

    def differenced(
        self, X: np.ndarray, c: EstimatorCore, f: SensorFrame, u: np.ndarray, dt: float, cf: float, cx: float, m: int
    ) -> None:  # fmt: skip
        """The first m columns of ukf.Y [k,>=m] <- cf dh/dt + cx h: what differencing turns a reading h into."""


class States(Protocol):
    """States beyond the 15, with a process of their own."""

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """What is known of them at the start, into the state x [n] and the factor S [n,n] in place."""

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """Carry them over dt [s] in the points X [k,n], and fill their columns of the noise factor SQ [n,nq]."""


class DecayingWind:
    """A motion whose wind is a Gauss-Markov process and not a random walk."""

    def __init__(self, motion: Motion, tau_s: float) -> None:
        self.motion, self.tau_s = motion, tau_s

    def start(self, f: SensorFrame) -> None:
        """As the motion's."""
        self.motion.start(f)

    def carry(self, X: np.ndarray, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """As the motion's; then the wind of X decays."""
        self.motion.carry(X, f, u, rho, dt)
        X[:, WIND] *= math.exp(-dt / self.tau_s)


class Turbulence:
    """The gust states of an estimator, and what they do to its wind."""

    def __init__(self, core: EstimatorCore, first: int, heading: Callable[[], float] | None, wind: bool) -> None:
        """first: index of the first of them; heading, wind: as GustStates.propagate."""
        self.core, self.gusts, self.heading, self.wind = core, GustStates(first, core.p), heading, wind

    def start(self, x: np.ndarray, S: np.ndarray) -> None:
        """As States."""
        self.gusts.start(x, S)

    def propagate(self, X: np.ndarray, SQ: np.ndarray, dt: float) -> None:
        """As States, about the mean the step started from."""
        c = self.core
        self.gusts.propagate(
            X, SQ, c.ukf.x, c.wind_jacobian, dt, None if self.heading is None else self.heading(), self.wind
        )


@dataclass(frozen=True)
class Extras:
    """How many states follow the 15, in this order: the estimator's own, those of measurement noise, those of turbulence."""

    own: int
    noise: int
    gusts: int

    @classmethod
    def of(cls, p: NavParams, channels: int, own: int = 0) -> Extras:
        """What the parameters ask for, with so many measurement channels."""
        return cls(own, colour_states(p, channels), GUSTS if p.wind_model == "dryden" else 0)

    @property
    def total(self) -> int:
        """All of them."""
        return self.own + self.noise + self.gusts

    @property
    def first_noise(self) -> int:
        """Index of the first noise state."""
        return NX + self.own

    @property
    def first_gust(self) -> int:
        """Index of the first turbulence state."""
        return NX + self.own + self.noise


class Parts:
    """Prediction and correction of one estimator's filter."""

    def __init__(
        self, core: EstimatorCore, e: Extras, motion: Motion, sensors: Sensors, sigma: np.ndarray,
        own: States | None = None, heading: Callable[[], float] | None = None,
    ) -> None:  # fmt: skip
        """core: made with e.total states more; sigma [c] 1-sigma of the measurement channels; own: the estimator's own states;
        heading [rad]: the aircraft's, where entry 6 of the state is another angle."""
        p = core.p
        velocity = p.state_form == "velocity"
        self.core, self.sensors = core, sensors
        self.motion = DecayingWind(motion, p.wind_tau_s) if p.wind_model == "gauss_markov" else motion
        self.form = VelocityForm(core.ukf, sigma) if velocity else None  # None: the state is kept as wind
        self.colour = Colour(p, sigma, EULER, e.first_noise, read=velocity)
        gusts = Turbulence(core, e.first_gust, heading, not velocity) if e.gusts else None
        self.states: list[States] = [s for s in (own, gusts, self.colour if e.noise else None) if s]
        self.wind_noise = WindNoise(core, e.first_gust + BEYOND, e.gusts)
        self._white = self.colour.mode == "ignored"
        self._complete = (
            not self.states and not velocity
        )  # a factor of independent errors is all there is to start with
        # a filter, a motion and sensors, and nothing besides: what a step in one compiled call does
        self.plain = (
            type(core.ukf) is SquareRootUKF and self._white and self._complete and self.motion is motion
            and self.wind_noise.adapter is None
        )  # fmt: skip
        self._dt = 0.0

    def start(self, f: SensorFrame) -> None:
        """The filter's 15 states have been taken from frame f, their errors independent: the rest of what is known."""
        self.motion.start(f)
        self.colour.reset()
        self.wind_noise.reset()
        if self._complete:
            return
        ukf = self.core.ukf
        S = ukf.S.copy()
        if self.form is not None:
            self.form.start(S)
        for s in self.states:
            s.start(ukf.x, S)
        ukf.set_factor(S)

    def predict(self, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """Time update over dt [s], with the core's noise factor filled; arguments as Motion.carry."""
        ukf, form, self._dt = self.core.ukf, self.form, dt
        if form is not None:
            form.enter()
        ukf.draw()
        X, SQ = ukf.X, ukf.SQ
        if form is not None:
            exchange(X, -1.0)
        self.motion.carry(X, f, u, rho, dt)
        if form is not None:
            exchange(X, 1.0)
        for s in self.states:
            s.propagate(X, SQ, dt)
        self.wind_noise.fill(SQ)
        if form is not None:
            form.noise(SQ)
        ukf.recombine()
        if form is not None:
            form.leave()

    def correct(self, f: SensorFrame, u: np.ndarray) -> float:
        """Measurement update with the core's queued rows, readings of frame f; returns NIS."""
        c, form, colour, nis = self.core, self.form, self.colour, 0.0
        if form is not None:
            form.enter()
        if self._white:  # the usual case
            c.ukf.draw()
            self.sensors.expect(self._points(), c)
            nis = c.update()
        elif colour.arrange(c, self._dt, f.gyro_count):
            c.ukf.draw()
            self.sensors.expect(self._points(), c)
            if (d := colour.diff) is not None:
                m = int((c.codes[: c.m] < colour.channels).sum())
                self.sensors.differenced(self._points(), c, f, u, self._dt, float(d.cf[0]), float(d.cx[0]), m)
            colour.whiten(c)
            nis = c.update()
        if form is not None:
            form.leave()
        self.wind_noise.update(self._dt)
        return nis

    def _points(self) -> np.ndarray:
        """The filter's points [k,n], with wind in entries 12..14."""
        return self.core.ukf.X if self.form is None else self.form.wind_points()
