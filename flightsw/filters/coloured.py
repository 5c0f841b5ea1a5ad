"""Exponentially correlated measurement noise, three ways: scaled R, measurement differencing, noise states.

Noise model v_k = e v_{k-1} + s sqrt(1-e^2) n_k, e = exp(-T/tau) (Lee 2011 (2.58)-(2.61); sections 3.5, 4.4; lee.md 3.6, 3.7).
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.gauss_markov import first_order
from flightsw.kernels.jit import jit

Array = np.ndarray
TWO_PI = 2.0 * math.pi
FORMS = ("exact", "printed")  # of measurement differencing


def scaled_sigma(s: float, T: float, tau: float) -> float:
    """1-sigma of the white noise with the same spectral density at zero frequency: s sqrt((1+e)/(1-e)).

    s 1-sigma of the coloured noise, T sample period [s] > 0, tau [s]; tau <= 0 means white (s is returned). The sum of
    s^2 e^|k| over all lags is s^2 (1+e)/(1-e). Raises ValueError for T <= 0.
    """
    if not T > 0.0:
        raise ValueError(f"sample period T = {T}; allowed > 0")
    if tau <= 0.0:
        return s
    return s / math.sqrt(math.tanh(0.5 * T / tau))  # (1-e)/(1+e) = tanh(T/2tau), no cancellation for T << tau


@jit
def difference(
    y: np.ndarray, last: np.ndarray, angle: np.ndarray, T: float, cf: np.ndarray, cx: np.ndarray, out: np.ndarray
) -> None:
    """out [k] <- cf (y - last)/T + cx y; rows with angle != 0 are unwrapped first, so y near +-pi gives no jump.

    y [k] new, last [k] previous readings; last becomes y (unwrapped where it is an angle).
    """
    for i in range(y.shape[0]):
        d = y[i] - last[i]
        if angle[i] != 0:
            d -= TWO_PI * math.floor(d / TWO_PI + 0.5)
        now = last[i] + d
        out[i] = cf[i] * d / T + cx[i] * now
        last[i] = now


class Differencer:
    """Turns readings y_k into yN_k = cf (y_k - y_{k-1})/T + cx y_k, whose noise is white; state: the last reading.

    The filter predicts yN with h(x) = cf f(x) + cx x, f(x) the modelled rate of the row (lee.md 3.7):
    - form "printed": cf = 1, cx = 1/tau (Lee (3.22), Euler). A share (e/tau - (1-e)/T) of the noise stays, O(T/tau^2).
    - form "exact": cf = e, cx = (1-e)/T, that is yN = (y_k - e y_{k-1})/T: the noise is removed to the last bit.
    """

    def __init__(self, s: Array, tau: Array, *, angle: Array | None = None, form: str = "exact") -> None:
        """s [k] 1-sigma and tau [k] time constant [s] of each row; angle [k] true for rows that wrap (rad).

        Raises ValueError for unequal lengths, non-positive s or tau, or an unknown form.
        """
        self.s, self.tau = np.array(s, dtype=float), np.array(tau, dtype=float)
        k = len(self.s)
        self.angle = np.zeros(k, dtype=np.int64) if angle is None else np.array(angle, dtype=np.int64)
        if self.tau.shape != (k,) or self.angle.shape != (k,):
            raise ValueError(f"s, tau, angle of lengths {k}, {self.tau.size}, {self.angle.size}; allowed: equal")
        if not ((self.s > 0.0).all() and (self.tau > 0.0).all()):
            raise ValueError(f"s = {self.s.tolist()}, tau = {self.tau.tolist()}; allowed > 0")
        if form not in FORMS:
            raise ValueError(f"form = {form!r}; allowed: {', '.join(FORMS)}")
        self.form = form
        self.last = np.zeros(k)
        self.primed = False
        self.y = np.zeros(k)
        self.r = np.zeros(k)
        self.cf, self.cx = np.ones(k), np.zeros(k)

    def reset(self) -> None:
        """Forget the last reading: the next one primes again (after a dropout or a restart)."""
        self.primed = False

    def push(self, y: Array, T: float) -> bool:
        """New readings y [k], T [s] after the previous ones. True when `y`, `r`, `cf`, `cx` [k] hold a measurement.

        The first reading, or one with T <= 0, only primes. r is the 1-sigma of yN without any wind increment.
        """
        if not self.primed or T <= 0.0:
            self.last[:] = y
            self.primed = True
            return False
        self._coefficients(T)
        difference(np.asarray(y, dtype=float), self.last, self.angle, T, self.cf, self.cx, self.y)
        return True

    def _coefficients(self, T: float) -> None:
        for i, (s, tau) in enumerate(zip(self.s.tolist(), self.tau.tolist(), strict=True)):
            e, q = first_order(T, tau, s)
            self.r[i] = q / T
            if self.form == "exact":
                self.cf[i] = e
                self.cx[i] = -math.expm1(-T / tau) / T
            else:
                self.cx[i] = 1.0 / tau

    def inflated(self, q: Array, T: float) -> Array:
        """1-sigma [k] of yN for rows whose rate contains a wind increment of intensity q [k] per sqrt(s), in row units.

        sqrt(r^2 + (cf q)^2/T) (lee.md trap 6): q_w for airspeed, q_w/V for the flow angles, 0 elsewhere. This noise is
        correlated with the process noise of the same step; treating it as independent is not optimal, though nearly honest
        (study lee_removal on the linear tanker: wind error up to a quarter more, 1.03 of the filter's own sigma).
        """
        return np.sqrt(self.r**2 + (self.cf * q) ** 2 / T)


class NoiseStates:
    """Layout that appends one Gauss-Markov state per coloured channel behind n physical states.

    Indices n .. n+k-1 hold the noise of channels 0 .. k-1; their process noise uses columns nq .. nq+k-1 of SQ.
    """

    def __init__(self, n: int, nq: int, s: Array, tau: Array) -> None:
        """n physical states, nq physical noise columns; s [k] 1-sigma, tau [k] [s] of the channels.

        Raises ValueError for unequal lengths or non-positive values.
        """
        self.s, self.tau = np.array(s, dtype=float), np.array(tau, dtype=float)
        if self.s.shape != self.tau.shape or not ((self.s > 0.0).all() and (self.tau > 0.0).all()):
            raise ValueError(f"s = {self.s.tolist()}, tau = {self.tau.tolist()}; allowed: equal lengths, all > 0")
        self.n, self.nq, self.k = n, nq, len(self.s)
        self.n_total, self.nq_total = n + self.k, nq + self.k
        self.states = slice(n, n + self.k)

    def start(self, x: Array, S: Array, read: bool = False) -> None:
        """Initial noise states: zero mean into x [n+k], stationary factor diag(s) into S [n+k,n+k].

        read: the physical state was taken from one reading of every channel, and column c < k of S holds what the reading
        error s_c did to it. A state read as y = x + v is wrong by +v, so its error and the noise state's (estimate less
        truth, -v) are one random number with two signs; kept apart, the same reading would count twice.
        """
        x[self.states] = 0.0
        S[self.states, :] = 0.0
        S[:, self.states] = 0.0
        S[self.states, slice(0, self.k) if read else self.states] = np.diag(-self.s if read else self.s)

    def propagate(self, X: Array, T: float) -> None:
        """Noise columns of the points X [p,n+k] decay over T [s], in place."""
        X[:, self.states] *= [math.exp(-T / tau) for tau in self.tau.tolist()]

    def fill(self, SQ: Array, T: float) -> None:
        """Process noise s sqrt(1-e^2) of the noise states into SQ [n+k, nq+k]."""
        for c in range(self.k):
            SQ[self.n + c, self.nq + c] = first_order(T, float(self.tau[c]), float(self.s[c]))[1]

    def add(self, X: Array, Y: Array, column: int, channel: int) -> None:
        """Image of a measurement gets its channel's noise: Y[:, column] += X[:, n+channel]."""
        Y[:, column] += X[:, self.n + channel]
