"""The receiver's control law of Lee (2011) as printed, (2.41)-(2.47): twelve states, three integrals, six fixed gains.

Neither actuators nor delay nor disturbance are states of it; airspeed, sideslip and incidence are fed back as they are. Printed
are the structure and the rule (LQR at each of six nominal conditions), not the weights: `Weights` holds ours. Weights of the
interpolation as corrected (erratum E12); limits of the commands are those of the actuators, the integrals have none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_are

from flightsw.aircraft import Aircraft
from flightsw.sixdof.layout import POS
from flightsw.sixdof.lqr import Design
from flightsw.sixdof.schedule import GainSchedule
from flightsw.sixdof.trim import linearise_relative, trim_free, trim_relative

N = 12
TURNS = tuple(float(np.radians(v)) for v in (-1.7, 0.0, 1.7))  # [rad/s] Table 2.1 is lost: lee.md 5
SPEEDS = (180.0, 200.0)  # [m/s]
ALTITUDE = 7010.0  # [m]


@dataclass(frozen=True)
class Weights:
    """Bryson weights: the size of each deviation that counts as one unit. states [12] in the units of (2.32), integrals [3] m s,
    inputs [4] rad and N. Defaults: a common set, but airspeed, which pulls the receiver off its place in every
    gust, a tenth and the integrals, which take the wake's trim, three times as dear."""

    states: tuple[float, ...] = (20.0, 0.05, 0.05, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 2.0, 2.0, 2.0)
    integrals: tuple[float, ...] = (3.0, 3.0, 3.0)
    inputs: tuple[float, ...] = (0.1, 0.1, 0.1, 2000.0)

    def softer(self, factor: float) -> Weights:
        """The same with inputs that count factor times as much."""
        return Weights(self.states, self.integrals, tuple(v / factor for v in self.inputs))


def augmented(A: np.ndarray, B: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(2.45) of A [12,12], B [12,4] of (2.41): [A 0; C 0], [B; 0] with C = d(xi)/dx (2.43)."""
    Aa, Ba = np.zeros((N + 3, N + 3)), np.zeros((N + 3, B.shape[1]))
    Aa[:N, :N], Ba[:N] = A, B
    Aa[N:, POS] = np.eye(3)
    return Aa, Ba


def gains(A: np.ndarray, B: np.ndarray, w: Weights) -> np.ndarray:
    """[K_i K_e,i] [4,15] of (2.46): the minimum of int z'Qz + u'Ru over (2.45), Q and R of the weights."""
    Aa, Ba = augmented(A, B)
    size = np.array(w.inputs)  # inputs in units of their weights: newtons beside angles cost digits
    Q = np.diag(1.0 / np.square([*w.states, *w.integrals]))
    P = solve_continuous_are(Aa, Ba * size, Q, np.eye(len(size)))
    return np.asarray(size[:, None] * ((Ba * size).T @ P))


class PrintedLaw:
    """u = sum_i w_i(psi_dot_c, V_c) (u0_i - K_i (x - x0_i) - K_e,i e), de/dt = xi - xi_c."""

    def __init__(
        self, ac: Aircraft, tanker: Aircraft, mass_kg: tuple[float, float], xi: tuple[float, ...], w: Weights
    ) -> None:
        """mass_kg: receiver's and tanker's [kg]; xi [3] nominal place [m]. Raises TrimError, LinAlgError."""
        designs = []
        for yd in TURNS:
            for V in SPEEDS:
                tt = trim_free(tanker, mass_kg[1], ALTITUDE, V, yd)
                t = trim_relative(ac, mass_kg[0], tt, np.array(xi))
                A, B, _ = linearise_relative(ac, mass_kg[0], tt, t)
                K = gains(A[:N, :N], B[:N], w)
                designs.append(Design(K, np.concatenate((t.x[:N], np.zeros(3))), t.u, 0.0))
        self.sched = GainSchedule(designs, TURNS, SPEEDS)
        self.z, self.off = np.zeros(N + 3), np.zeros(N + 3)

    def step(self, x: np.ndarray, xi_c: np.ndarray, psi_dot_c: float, V_c: float, dt: float) -> np.ndarray:
        """Command u [4] (surfaces [rad], thrust [N], not limited) for x [12] of (2.32) and the commands: place xi_c [3] m, the
        tanker's turn rate [rad/s] and airspeed [m/s]; dt [s] since the last."""
        self.z[N:] += (x[POS] - xi_c) * dt
        self.z[:N] = x
        self.sched.set_condition(psi_dot_c, V_c)
        return self.sched.evaluate(self.z, self.off).copy()
