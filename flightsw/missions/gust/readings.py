"""What the sampled gust estimators share: the readings of a sample, which of them may correct, the start and the refusals."""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.gating import ChannelGate
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import GustEstimate, GustParams
from flightsw.missions.gust.model import LinearModel, linear_model, parameter_vector

Array = np.ndarray
ANGLE_MAX = 1.2  # [rad] of an incidence; the linear study goes to 0.7 in turbulence of the full intensity


class GustReadings:
    """Readings, gate and start of an estimator with the tuning `p`."""

    def __init__(self, p: GustParams) -> None:
        self.p = p
        self.linear: LinearModel = linear_model(p.aircraft, p.turbulence)
        self._par = parameter_vector(p.aircraft, p.turbulence)
        self._r7 = p.sensors.sigmas()
        self._codes = np.zeros(k.NY, dtype=np.int64)
        self._y, self._r = np.zeros(k.NY), np.zeros(k.NY)
        self.gate = ChannelGate(k.NY, p.channel_gate, p.channels_most)
        self._left_out, self._whole = 0, 0  # readings of this sample; samples in a row
        self.started = False
        self.restarts = 0

    def stationary(self, scale: float) -> Array:
        """Covariance [3,3] of the wind states in stationary turbulence of relative intensity `scale`."""
        t, V0 = self.p.turbulence, self.p.aircraft.V0_mps
        ww, s2 = V0 / t.L_w_m, (scale * t.sigma_w_mps / V0) ** 2
        # Lyapunov equation of the observer form
        P = np.diag([(2.0 - math.sqrt(3.0)) * ww * ww * s2, s2, (scale * t.sigma_u_mps) ** 2])
        P[k.X1, k.AW] = P[k.AW, k.X1] = 0.5 * ww * s2
        return P

    def _read(self, y: Array, ok: int) -> int:
        """Usable channels into codes, deviations and sigmas; returns how many."""
        m = 0
        ac = self.p.aircraft
        for c in range(k.NY):
            if ok >> c & 1 and math.isfinite(y[c]):
                trim = ac.V0_mps if c in (k.Y_VA, k.Y_GROUND) else ac.H0_m if c == k.Y_H else 0.0
                self._codes[m], self._y[m], self._r[m] = c, y[c] - trim, self._r7[c]
                m += 1
        return m

    def _left(self, keep: Array | None, m: int) -> int:
        """Leave out what the gate does not keep of the m readings (`ChannelGate.kept`); returns how many stay."""
        n = 0 if keep is None else len(keep)
        self._left_out = m - n
        self._whole = self._whole + 1 if n == 0 else 0
        if keep is not None and n < m:
            for a in (self._codes, self._y, self._r):
                a[:n] = a[keep]
        return n

    def _first(self, m: int, n: int) -> tuple[Array, Array] | GustEstimate:
        """First sample: x [n], P [n,n] with attitude, height and flight path from the readings, wind and bias from nothing;
        nothing at all beyond the nine states. The refusal while a reading it needs is missing."""
        seen = {int(c): float(v) for c, v in zip(self._codes[:m], self._y[:m], strict=True)}
        missing = [
            name for c, name in ((k.Y_Q, "q"), (k.Y_ALPHA, "alpha"), (k.Y_TH, "Theta"), (k.Y_H, "H")) if c not in seen
        ]
        if missing:
            return self._refused("waits for " + ", ".join(missing))
        p, x, P = self.p, np.zeros(n), np.zeros((n, n))
        x[[k.Q, k.AK, k.TH, k.H]] = seen[k.Y_Q], seen[k.Y_ALPHA], seen[k.Y_TH], seen[k.Y_H]
        P[k.WIND, k.WIND] = self.stationary(max(p.scales))
        spread = [p.start_q_radps, p.start_alpha_rad, p.start_V_mps, p.sensors.Theta, p.sensors.H, p.start_bias_rad]
        P[range(k.Q, k.NX), range(k.Q, k.NX)] = np.square(spread)
        # alpha_K was read through the vane: its error holds the wind's and the vane's bias
        P[k.AK, k.AK] += P[k.AW, k.AW] + P[k.AB, k.AB]
        P[k.AK, k.AB] = P[k.AB, k.AK] = -P[k.AB, k.AB]
        P[k.AK, k.AW] = P[k.AW, k.AK] = P[k.AW, k.AW]
        P[k.AK, k.X1] = P[k.X1, k.AK] = P[k.AW, k.X1]
        return x, P

    def _restart(self, reason: str) -> GustEstimate:
        self.started = False
        self.restarts += 1
        return self._refused(reason)

    def _refused(self, reason: str) -> GustEstimate:
        z = np.zeros(k.NX)
        return GustEstimate(False, reason, z, np.full(k.NX, math.inf), math.nan, 0, max(self.p.scales), ())
