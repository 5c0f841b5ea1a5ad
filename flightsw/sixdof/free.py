"""Motion and sensors of a free aircraft, as its estimator may choose them (sixdof/parts.py)."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.atmosphere import density
from flightsw.refusal import GateParams
from flightsw.sixdof.estimator_core import EstimatorCore, NavParams
from flightsw.sixdof.layout import NX, X_Z
from flightsw.sixdof.measure import measure_free
from flightsw.sixdof.motion import propagate_free
from flightsw.sixdof.sensed import measure_differenced, propagate_sensed
from flightsw.strict import ConfigError
from flightsw.types import SensorFrame

RECEIVERS = ("r_own_vel", "rot_sigma", "rot_tau_s", "rot_q_rate", "r_peer_rate", "bias_rel", "peer_att")


def check(p: NavParams) -> None:
    """Raises ConfigError for what only a receiver has, and for what does not go together."""
    for name in ("rotational_wind", "local_probes"):
        if getattr(p, name):
            raise ConfigError(f"nav.{name} = true: allowed for a receiver only")
    for name in RECEIVERS:
        if getattr(p, name) != getattr(NavParams, name):
            raise ConfigError(f"nav.{name} = {getattr(p, name):g}: allowed for a receiver only")
    if p.gate.peer_wind_sigma != GateParams.peer_wind_sigma:
        raise ConfigError(f"nav.gate.peer_wind_sigma = {p.gate.peer_wind_sigma:g}: allowed for a receiver only")
    if p.state_form == "velocity" and p.adapt_wind != "off":
        raise ConfigError(f"nav.adapt_wind = {p.adapt_wind!r}: allowed with state_form = velocity: off")


class Aerodynamic:
    """Forces and moments of the aerodynamic model alone."""

    def __init__(self, core: EstimatorCore) -> None:
        self.core = core
        self._work = np.zeros((5, NX))

    def start(self, f: SensorFrame) -> None:
        """Nothing is remembered."""

    def carry(self, X: np.ndarray, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """As Motion."""
        propagate_free(X, u, rho, self.core.P, dt, self._work)


class Sensed:
    """Translation from the accelerometers; rotation from the aerodynamic moments ("hybrid"), from the differenced gyro
    ("inertial") or as a random walk ("random_rates")."""

    def __init__(self, core: EstimatorCore) -> None:
        self.core = core
        self._sensed = np.zeros(6)  # specific force [m/s^2], angular acceleration [rad/s^2]
        self._acc, self._gyro = np.zeros(3), np.zeros(3)
        self._work = np.zeros((5, NX))

    def start(self, f: SensorFrame) -> None:
        """Readings at the start of the first step."""
        self._acc[:], self._gyro[:] = f.acc_b, f.gyro_mean_b

    def carry(self, X: np.ndarray, f: SensorFrame, u: np.ndarray, rho: float, dt: float) -> None:
        """As Motion."""
        c, model = self.core, self.core.p.model
        acc, gyro = np.array(f.acc_b), np.array(f.gyro_mean_b)
        self._sensed[:3] = 0.5 * (self._acc + acc)
        self._sensed[3:] = (gyro - self._gyro) / dt if model == "inertial" else 0.0
        self._acc, self._gyro = acc, gyro
        propagate_sensed(X, u, rho, c.P, self._sensed, model != "hybrid", dt, self._work)


class FreeSensors:
    """What a free aircraft's sensors read: measure.measure_free."""

    def expect(self, X: np.ndarray, c: EstimatorCore) -> None:
        """As Sensors."""
        measure_free(X, c.codes, c.m, c.ukf.Y)

    def differenced(
        self, X: np.ndarray, c: EstimatorCore, f: SensorFrame, u: np.ndarray, dt: float, cf: float, cx: float, m: int
    ) -> None:  # fmt: skip
        """As Sensors."""
        measure_differenced(X, c.codes, m, u, density(-c.ukf.x[X_Z]), c.P, cf, cx, c.ukf.Y)
