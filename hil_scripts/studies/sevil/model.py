"""The onboard side of the air-data studies: expected readings of the onboard wake model along a flight, the receiver with
the probes of sevil.md section 4, and the statistics of turbulence averaged over a window. Frame and reading order as in
`sevil_flight`; nothing here touches the plant.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from flightsw.aircraft import Aircraft, load_aircraft
from flightsw.kernels.jit import jit_own
from flightsw.missions.receiver.airdata.contour.contours import Contours
from flightsw.missions.receiver.airdata.contour.wake_map import SEVIL_PROBES, load_map
from flightsw.missions.receiver.airdata.wake_kernel import probe_readings
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector

Arr = NDArray[np.float64]
RHO, V_MPS = 0.58883, 200.0  # [kg/m^3], [m/s] sevil.md section 4
CONTACT_X = -35.5  # [m] x of the maps
LIGHT = 0.39  # [m/s] turbulence
GUST_L = 533.4  # [m]
MAP_ATT = np.array([0.0, math.radians(3.0), 0.0])  # psi, theta, phi of the maps [rad]
SIGMA = np.array([math.sqrt(0.2), math.radians(math.sqrt(0.002)), math.radians(math.sqrt(0.002))])  # V, beta, alpha
PROBES = np.array(SEVIL_PROBES)
VARIABLES = ("V", "beta", "alpha")


@cache
def receiver() -> Aircraft:
    """The Learjet's record with the probe places of sevil.md section 4."""
    ac = load_aircraft("learjet24")
    return replace(ac, probe=tuple(replace(p, position_m=q) for p, q in zip(ac.probe, SEVIL_PROBES, strict=True)))


@cache
def contours(name: str) -> Contours:
    """Contours of a stored map, built once per process."""
    return Contours(load_map(name))


@jit_own
def _series(xi: Arr, att: Arr, xi_dot: Arr, omega: Arr, probes: Arr, wk: Arr, V: float, rho: float, out: Arr) -> None:
    none = np.zeros(3)
    for i in range(xi.shape[0]):
        probe_readings(xi[i], att[i], xi_dot[i], V, rho, none, omega[i], probes, wk, 1.0, 1.0, out[i])


def expected(
    xi: Arr, att: Arr, xi_dot: Arr | None = None, omega: Arr | None = None, wake: WakeParams | None = None
) -> Arr:
    """Readings [N,9] the onboard model expects at xi [N,3] (F) with attitude att [N,3] or [3] (psi, theta, phi rel. to F);
    xi_dot [N,3] m/s in F and omega [N,3] rad/s in body axes, zero if None."""
    n = len(xi)

    def rows(a: Arr | None) -> Arr:  # writable, whatever is given: one compiled kernel
        return np.array(np.broadcast_to(0.0 if a is None else a, (n, 3)), np.float64, order="C")

    out = np.empty((n, 9))
    wk = wake_vector(wake or WakeParams())
    _series(np.ascontiguousarray(xi), rows(att), rows(xi_dot), rows(omega), PROBES, wk, V_MPS, RHO, out)
    return out


def position_covariance(xi: Arr, att: Arr, sigma: float, step: float = 0.01) -> Arr:
    """J P J^T [N,3,3,3] by variable (second axis) of the expected readings for position errors of `sigma` [m] per axis,
    J = d e / d xi by central differences of `step` [m]."""
    J = np.empty((len(xi), 9, 3))
    for a in range(3):
        d = np.zeros(3)
        d[a] = step
        J[:, :, a] = (expected(xi + d, att) - expected(xi - d, att)) / (2.0 * step)
    by = J.reshape(len(xi), 3, 3, 3)
    return np.asarray(sigma**2 * np.einsum("nvik,nvjk->nvij", by, by))


def mean_gust_sigma(sigma: float, n: int, dt: float, V: float = V_MPS, L: float = GUST_L) -> Arr:
    """Standard deviation [3] (u, v, w) [m/s] of Dryden turbulence averaged over n samples dt [s] apart.

    Autocovariances sigma^2 exp(-V t/L) along the path and sigma^2 exp(-V t/L) (1 - V t/(2L)) across; the mean of a
    stationary Gaussian process is Gaussian with the mean of the covariance matrix as variance.
    """
    k = np.arange(n)
    weight = np.where(k == 0, n, 2 * (n - k)) / n**2
    decay = np.exp(-V * k * dt / L)
    along, across = float(weight @ decay), float(weight @ (decay * (1.0 - V * k * dt / (2.0 * L))))
    return sigma * np.sqrt([along, across, across])
