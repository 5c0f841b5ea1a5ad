"""Wind felt as incidence and speed, and the vane's bias, from vane, airspeed, gyro, attitude and height: sampled filters.

One class runs the linear discrete filter (kind "kalman" on the linear model), EKF, UKF and square-root filters on the
nonlinear model, alone or as a bank over turbulence intensity. Optional channels: ground speed and vertical specific force.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.bank import FilterBank, markov
from flightsw.filters.base import CovarianceFilter, PointFilter
from flightsw.filters.covariance import chol_psd
from flightsw.filters.factory import make_filter
from flightsw.kernels.discrete import discretise
from flightsw.kernels.linalg import finite, inner
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import GustEstimate, GustParams
from flightsw.missions.gust.readings import ANGLE_MAX, GustReadings

Array = np.ndarray


class GustNav(GustReadings):
    """`step` once per sample. Attributes `x` [9], `P` [9,9] are the combined estimate."""

    def __init__(self, p: GustParams | None = None) -> None:
        """Raises ValueError for a filter kind unknown to the factory."""
        p = p or GustParams()
        super().__init__(p)
        self.filters: list[PointFilter] = [make_filter(p.filter, k.NX, k.NY, k.NX) for _ in p.scales]
        *_, self.strongest = self.filters  # of the turbulence intensities
        self.bank = FilterBank(self.filters, p.scales, np.eye(len(p.scales)), mix=p.mix)
        self._W, self._a, self._w = np.zeros((k.W_N, k.NX)), np.zeros(k.AIR_N), np.zeros(k.NX)
        self._F, self._G = np.zeros((k.NX, k.NX)), np.zeros((k.NX, k.NU))
        self._SQ = np.zeros((len(p.scales), k.NX, k.NX))
        self._dt = 0.0
        self._was = np.zeros(k.NU)
        self._nis = np.zeros(len(p.scales))

    @property
    def x(self) -> Array:
        """Estimate [9]."""
        return self.bank.x

    @property
    def P(self) -> Array:
        """Covariance [9,9] of the combined estimate."""
        return self.strongest.P if len(self.filters) == 1 else self.bank.P

    def start(self, x: Array, P: Array) -> None:
        """Begin from the mean x [9] and covariance P [9,9] (the next `step` predicts from there)."""
        S = np.zeros((k.NX, k.NX))
        chol_psd(np.ascontiguousarray(P, dtype=float), k.NX, S)
        self.bank.start(np.asarray(x, dtype=float), S)
        self.gate.reset()
        self._whole = 0
        self.started = True

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        spread = [f.P if isinstance(f, CovarianceFilter) else f.S for f in self.filters]
        return {
            "x": np.array([f.x for f in self.filters]), "spread": np.array(spread), "combined": self.bank.x.copy(),
            "mu": self.bank.mu.copy(), "nis": self._nis.copy(), "score": self.gate.score.copy(), "was": self._was.copy(),
            "head": np.array([self.started, self.restarts, self._whole], float),
        }  # fmt: skip

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state` of an object of the same parameters."""
        for i, f in enumerate(self.filters):
            f.x[:] = s["x"][i]
            (f.P if isinstance(f, CovarianceFilter) else f.S)[:] = s["spread"][i]
        self.bank.x[:], self.bank.mu[:], self._nis[:] = s["combined"], s["mu"], s["nis"]
        self.gate.score[:], self._was[:] = s["score"], s["was"]
        started, restarts, whole = s["head"].tolist()
        self.started, self.restarts, self._whole = bool(started), int(restarts), int(whole)

    def step(self, y: Array, ok: int, u: Array, dt: float, u_now: Array | None = None) -> GustEstimate:
        """One sample: y [7] as it is read (q, alpha, V_A, Theta, H, ground speed, a_z), bit c of `ok` set where y[c] is usable.

        u [3]: mean controls since the previous sample, u_now [3]: at this sample (default u), both as deviations from trim
        in rad and units of the throttle setting; dt [s] since the previous sample. V_A, H and ground speed are absolute.
        """
        m = self._read(y, ok)
        if not self.started:
            first = self._first(m, k.NX)
            if isinstance(first, GustEstimate):
                return first
            self.start(*first)
            return self._estimate(0)
        if not (dt > 0.0 and math.isfinite(dt) and np.isfinite(u).all()):
            return self._refused(f"dt = {dt}, controls {np.asarray(u).tolist()}: allowed > 0 and finite")
        u = np.ascontiguousarray(u, dtype=float)
        now = u if u_now is None or not np.isfinite(u_now).all() else np.ascontiguousarray(u_now, dtype=float)
        self._model(dt)
        self._loosen(m, now, dt)
        if len(self.filters) > 1:
            self.bank.mix()
        for i, f in enumerate(self.filters):
            f.draw()
            if self.p.model == "linear":
                k.propagate_linear(f.X, self._F, self._G, u, self._w)
            else:
                k.propagate(f.X, u, self._par, dt, self._W)
            f.SQ[:] = self._SQ[i]
            f.recombine()
        m = self._gated(m, now)
        if self._whole >= self.p.refused_max:
            return self._restart("readings disagree with the prediction for too long: restarts")
        if m > 0:
            for i, f in enumerate(self.filters):
                self._nis[i] = self._correct(f, m, now)
        if len(self.filters) > 1:
            self.bank.weigh(m)
        else:
            self.bank.x[:] = self.strongest.x
        return self._estimate(m)

    def _correct(self, f: PointFilter, m: int, now: Array) -> float:
        f.draw()
        if self.p.model == "linear":
            k.measure_linear(f.X, self.linear.C, self.linear.D, now, self._codes, m, f.Y)
        else:
            k.measure(f.X, self._codes, m, now, self._par, self._a, f.Y)
        return f.correct(self._y, self._r, m)

    def _gated(self, m: int, now: Array) -> int:
        """Leave out readings that even the filter of the strongest turbulence does not expect; returns how many stay."""
        if m == 0:
            self._left_out = 0
            return 0
        f = self.strongest
        spread = f.P if isinstance(f, CovarianceFilter) else f.S
        x0, was = f.x.copy(), spread.copy()
        self._correct(f, m, now)
        keep = self.gate.kept(self._codes, f.nu, f.Sy, m)
        f.x[:], spread[:] = x0, was
        return self._left(keep, m)

    def _loosen(self, m: int, now: Array, dt: float) -> None:
        """Vertical acceleration of surfaces that are not quite where they are believed: 1 cm/s^2 of a_z is 0.003 deg of alpha_W,
        and the law would feed a faster or slower servo's own motion back through it."""
        rate = (now - self._was) / dt
        self._was[:] = now
        for i in range(m):
            if self._codes[i] == k.Y_AZ:
                d = self.linear.D[k.Y_AZ] * rate * self.p.servo_slack_s
                self._r[i] = math.sqrt(self._r[i] ** 2 + float(inner(d, d)))

    def _model(self, dt: float) -> None:
        """Transition and noise factors for steps of dt [s]."""
        if dt == self._dt:
            return
        n = k.NX
        A, B, W = self.linear.A, self.linear.B, np.zeros((4, n, n))
        wind, rest, S = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
        discretise(A, B, self.p.process.intensity(), dt, self._F, self._G, rest, W)
        Br = self.linear.Br
        intensity = np.zeros((n, n))
        for j in range(2):
            intensity += Br[:, j : j + 1] * Br[:, j]
        discretise(A, B, intensity, dt, self._F, self._G, wind, W)
        for i, s in enumerate(self.p.scales):
            chol_psd(s * s * wind + rest, n, S)
            self._SQ[i] = S
        self.bank.T = markov(len(self.p.scales), self.p.dwell_s, dt)
        self._dt = dt

    def _estimate(self, m: int) -> GustEstimate:
        x = self.bank.x
        if not max(abs(x[k.AW]), abs(x[k.AK])) < ANGLE_MAX or not finite(x):
            return self._restart("estimate beyond the model: restarts with the next sample")
        P = self.P
        sigma = np.sqrt(np.maximum(np.diag(P), 0.0))
        mu = self.bank.mu
        nis = float(inner(mu, self._nis)) if m > 0 else math.nan
        scale = self.bank.q
        used = sum(1 << int(c) for c in self._codes[:m])
        return GustEstimate(True, "", x.copy(), sigma, nis, m, scale, tuple(mu.tolist()), used, self._left_out)
