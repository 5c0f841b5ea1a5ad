"""State of the jet transport and the wind along its path: discrete EKF, UKF and square-root cubature filters.

13 states as in Jing et al. (2007) (24), (26), 15 with the scales of lift and drag (the default: a wrong aerodynamic model is
learnt instead of being covered by fictitious noise), or 26 with the errors of instruments, thrust and moment (errors.py). Sampled
form; the continuous one of seed (39)-(43) is in continuous.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.aircraft import TwinJet, twinjet
from flightsw.filters.adaptive import AdaptParams, NoiseAdapter
from flightsw.filters.covariance import chol_psd
from flightsw.filters.factory import make_filter
from flightsw.filters.gating import ChannelGate
from flightsw.kernels.linalg import finite
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.errors import ErrorParams, extended, fading, raise_cold, with_errors
from flightsw.missions.windshear.model import (
    DEG,
    WindshearNoise,
    WindshearSensors,
    parameter_vector,
    process_covariance,
)
from flightsw.strict import OneOf, Range

Array = np.ndarray
ALL = (1 << k.NY) - 1
RADIO = 1 << k.Y_RA
NO_ACCELEROMETERS = ALL & ~(1 << k.Y_XDD | 1 << k.Y_HDD)
START = (k.Y_H, k.Y_VG, k.Y_VA, k.Y_AL, k.Y_TH, k.Y_Q, k.Y_HD)  # readings a cold start needs
CONTINUOUS = ("ukf_printed", "ukf_43", "ukf_continuous")  # continuous.py
NAMES = ("h", "Vg", "Va", "alpha", "theta", "q", "h'", "x''", "h''", "radio height")


@dataclass(frozen=True)
class WindshearParams:
    """Tuning of WindshearNav."""

    filter: Annotated[str, OneOf(("ekf", "ukf", "srckf", "srukf", *CONTINUOUS))] = "ekf"
    states: Annotated[int, Range(13, k.NE)] = 15
    # scales of lift and drag: as believed at the start, and for good with 13 states
    lift_scale: Annotated[float, Range(0.5, 2.0)] = 1.0
    drag_scale: Annotated[float, Range(0.5, 2.0)] = 1.0
    sensors: WindshearSensors = field(default_factory=WindshearSensors)
    noise: WindshearNoise = field(default_factory=WindshearNoise)
    # turbulence: white steps of the wind beside its smooth rates [m/s/sqrt(s)], along x
    adaptive: bool = True
    turbulence: Annotated[float, Range(0.0, 20.0)] = 0.02  # constant where it is not adaptive, else at the start
    turbulence_range: tuple[float, float] = (0.005, 4.0)
    turbulence_up: Annotated[float, Range(0.0, 10.0)] = 2.0  # ratio of the vertical to the horizontal one
    # the wind's third rates grow with its first: root of their density times 1 + gain |rate|, a low pass through a core needs it
    wind_gain_s2pm: Annotated[float, Range(0.0, 10.0)] = 1.0
    wind_gain_max: Annotated[float, Range(1.0, 100.0)] = 5.0
    channels: Annotated[int, Range(1, ALL)] = ALL  # bit per reading that is used at all
    spread: Annotated[float, Range(0.1, 1.0)] = 0.5  # a of the UKF's sigma points; b = 2, kappa = 0
    gate: Annotated[float, Range(1.0)] = 25.0  # NIS per reading above which a sample is refused
    refused_max: Annotated[int, Range(1, 10000)] = 25  # samples refused in a row before a cold start
    channel_gate: Annotated[float, Range(1.0)] = 6.0  # sigma of its innovation above which one reading is refused
    channels_most: Annotated[int, Range(1, k.NY)] = 3  # out at once; beyond, the filter is in doubt
    start_scale_sigma: Annotated[float, Range(0.0, 1.0)] = 0.1
    errors: ErrorParams = field(default_factory=ErrorParams)  # of 26 states

    def __post_init__(self) -> None:
        if self.states not in (13, k.NX, k.NE):
            raise ValueError(f"states = {self.states}; allowed: 13, 15, 26")
        plain = self.states == 13 and not self.adaptive and self.turbulence == self.wind_gain_s2pm == 0.0
        if self.filter in CONTINUOUS and not plain:
            raise ValueError(
                f"filter = {self.filter}; allowed only with states = 13, adaptive = false, turbulence = 0, wind_gain_s2pm = 0"
            )
        lo, hi = self.turbulence_range
        if self.adaptive and not 0.0 < lo <= self.turbulence <= hi:
            raise ValueError(f"turbulence = {self.turbulence}, range {lo} to {hi}; allowed: inside, > 0")


def start_sigma(p: WindshearParams) -> Array:
    """1-sigma [15] of an approach that is known well at the start: jing.md 7.1."""
    return np.array(
        [1.0, 1.0, 0.5, 0.3 * DEG, 0.3 * DEG, 0.05 * DEG, 1.0, 0.5, 0.5, 0.3, 0.3, 0.1, 0.1] + [p.start_scale_sigma] * 2
    )


@dataclass(frozen=True)
class WindshearEstimate:
    """x and 1-sigma, [15] or with 26 states [26] (dynamics.py; with 13 states the scales are the believed ones), hazard index F,
    NIS of the step over `channels` readings. `reason`: why it is not valid, or which readings it does without."""

    valid: bool
    reason: str
    x: Array
    sigma: Array
    F: float
    nis: float
    channels: int


class WindshearNav:
    """`step` once per sample. `x` [15 or 26] is the present estimate, `P` [n,n] its covariance (n = 13, 15 or 26)."""

    def __init__(self, p: WindshearParams | None = None, ac: TwinJet | None = None) -> None:
        """ac: record of the aircraft (default: as published). Raises ValueError for parameters no filter can run."""
        self.p = p = p or WindshearParams()
        ac = ac or twinjet()
        self._g = ac.air.gravity_mps2
        self.n = n = p.states
        self.errs = errs = p.errors if n == k.NE else None
        self._par = parameter_vector(ac, p.lift_scale, p.drag_scale)
        self._r9 = p.sensors.sigmas()
        kind = "ukf" if p.filter in CONTINUOUS else p.filter
        self.f = make_filter(kind, n, k.NZ, n + 2, alpha=p.spread if kind == "ukf" else 1.0)
        lo, hi = p.turbulence_range
        self.adapter = NoiseAdapter(p.turbulence, k.WX, 2, AdaptParams(q_min=lo, q_max=hi)) if p.adaptive else None
        self.gate = ChannelGate(k.NZ, p.channel_gate, p.channels_most)
        self._codes = np.zeros(k.NZ, dtype=np.int64)
        self._y, self._r = np.zeros(k.NZ), np.zeros(k.NZ)
        self._W = np.zeros((2, n))
        self._SQ, self._dt = np.zeros((n, n)), 0.0
        self.x = np.zeros(max(n, k.NX))
        self.x[k.KL], self.x[k.KD] = p.lift_scale, p.drag_scale
        if errs is not None:
            self.x[k.NX : k.L_VA] = errs.start()[0]
            fading(self._par, errs)
        self.sigma = np.zeros(len(self.x))  # as last published
        self.started = False
        self.restarts = 0
        self._refused = 0

    @property
    def turbulence(self) -> float:
        """Intensity of the white wind steps in force [m/s/sqrt(s)]."""
        return self.adapter.q if self.adapter is not None else self.p.turbulence

    @property
    def P(self) -> Array:
        """Covariance [n,n]."""
        return self.f.P

    def start(self, x: Array, sigma: Array) -> None:
        """Begin from the mean x [15 or 26] and independent 1-sigma of the same length; entries beyond the filter's states are
        ignored, error states that are missing begin as by default."""
        if self.errs is not None and len(x) < k.NE:
            x, sigma = extended(x, sigma, self.errs)
        self.x[: self.n] = x[: self.n]
        self.f.x[:] = x[: self.n]
        self.f.set_factor(np.diag(np.asarray(sigma, dtype=float)[: self.n]))
        if self.adapter is not None:
            self.adapter.reset()
        self.gate.reset()
        self.started, self._refused = True, 0

    def step(self, z: Array, ok: int, u: Array, dt: float) -> WindshearEstimate:
        """One sample: readings z [9 or 10] (h, Vg, Va, alpha, theta, q, h', x'', h'', height by radio; SI, rad), bit c of `ok`
        set where z[c] is usable.

        u [2]: thrust command [kN] and elevator [rad] in force since the previous sample, dt [s] ago, and still at this one.
        """
        m = self._read(z, ok)
        if not (math.isfinite(u[k.TC]) and math.isfinite(u[k.DE])):
            return self._not_valid(f"controls {u[k.TC]}, {u[k.DE]}: allowed finite")
        if not self.started:
            return self._cold(m, u)
        if not (dt > 0.0 and math.isfinite(dt)):
            return self._not_valid(f"dt = {dt}; allowed > 0")
        return self._advance(m, u, dt)

    def _advance(self, m: int, u: Array, dt: float) -> WindshearEstimate:
        """To this sample and corrected by its m readings."""
        self._noise(dt)
        f = self.f
        f.draw()
        k.propagate(f.X, u, self._par, dt, self._W)
        f.SQ[:, : self.n] = self._SQ
        f.SQ[:, k.WX : k.KL] *= self._wind_factor()
        qx, root = self.turbulence, math.sqrt(dt)
        qh = qx * self.p.turbulence_up
        k.turbulence_columns(f.x, qx * root, qh * root, self.n, f.SQ)
        drift = k.turbulence_drift(f.x, qx, qh) * dt
        f.recombine()
        f.x[k.VA] += drift
        return self._correct(m, u, dt)

    def _read(self, z: Array, ok: int) -> int:
        e = self.errs
        ok &= self.p.channels if e is None else self.p.channels | RADIO
        m = 0
        for c in range(k.NY):
            if ok >> c & 1 and math.isfinite(z[c]):
                self._codes[m], self._y[m], self._r[m] = c, z[c], self._r9[c]
                m += 1
        if e is not None and ok & RADIO and math.isfinite(z[k.Y_RA]):
            self._codes[m], self._y[m], self._r[m] = k.Y_RA, z[k.Y_RA], e.radio_sigma(z[k.Y_RA])
            m += 1
        return m

    def _noise(self, dt: float) -> None:
        if dt != self._dt:
            Q = process_covariance(self.p.noise, min(self.n, k.NX), dt)
            chol_psd(Q if self.errs is None else with_errors(Q, self.errs, dt), self.n, self._SQ)
            self._dt = dt

    def _wind_factor(self) -> float:
        rate = math.hypot(float(self.f.x[k.WXD]), float(self.f.x[k.WHD]))
        return min(1.0 + self.p.wind_gain_s2pm * rate, self.p.wind_gain_max)

    def _correct(self, m: int, u: Array, dt: float) -> WindshearEstimate:
        f = self.f
        nis = math.nan
        if m > 0:
            x0, S0 = f.x.copy(), f.S.copy()
            nis = self._measure(m, u)
            keep = self.gate.kept(self._codes, f.nu, f.Sy, m)
            if keep is not None and 0 < len(keep) < m:
                f.x[:] = x0
                f.set_factor(S0)
                for a in (self._codes, self._y, self._r):
                    a[: len(keep)] = a[keep]
                m = len(keep)
                nis = self._measure(m, u)
            if keep is None or len(keep) == 0 or not 0.0 <= nis <= self.p.gate * m:
                f.x[:] = x0
                f.set_factor(S0)
                self._refused += 1
                m = 0
                if self._refused >= self.p.refused_max:
                    return self._restart("readings disagree with the prediction for too long: starts anew")
            else:
                self._refused = 0
                if self.adapter is not None:
                    self.adapter.update(f, m, dt)
        if not finite(f.x) or not f.x[k.VA] > 10.0:
            return self._restart("estimate not finite: starts anew")
        return self._estimate(nis, m)

    def _measure(self, m: int, u: Array) -> float:
        f = self.f
        f.draw()
        k.measure(f.X, self._codes, m, u, self._par, f.Y)
        return f.correct(self._y, self._r, m)

    def _estimate(self, nis: float, m: int) -> WindshearEstimate:
        n, s = self.n, self.sigma
        self.x[:n] = self.f.x
        s[:n] = self.f.sigmas()
        if self.errs is not None:
            step = self.turbulence * math.sqrt(self.errs.late_samples * self._dt)
            self.errs.consider(s, float(self.x[k.VA]), float(self.x[k.H]), step, step * self.p.turbulence_up)
        F = k.f_factor(self.x, self._g)
        out = [NAMES[c] for c in self.gate.benched]
        reason = "refused: " + ", ".join(out) if out else ""
        return WindshearEstimate(True, reason, self.x.copy(), s.copy(), F, nis, m)

    def _cold(self, m: int, u: Array) -> WindshearEstimate:
        """First sample: path, speed and wind from the readings, ten times as uncertain, then corrected by the same sample."""
        seen = {int(c): float(v) for c, v in zip(self._codes[:m], self._y[:m], strict=True)}
        missing = [NAMES[c] for c in START if c not in seen]
        if missing:
            return self._not_valid("waits for " + ", ".join(missing))
        if not seen[k.Y_VA] > 10.0:
            return self._not_valid(f"waits for flight: airspeed {seen[k.Y_VA]:.1f} m/s")
        r, x, s = self._r9, self.x.copy(), np.zeros(len(self.x))
        V, gamma = seen[k.Y_VA], seen[k.Y_TH] - seen[k.Y_AL]
        x[: k.WXD] = (
            x[k.X], seen[k.Y_H], V, gamma, seen[k.Y_AL], seen[k.Y_Q], u[k.TC],
            seen[k.Y_VG] - V * math.cos(gamma), seen[k.Y_HD] - V * math.sin(gamma),
        )  # fmt: skip
        x[k.WXD : k.KL] = 0.0
        a = 10.0 * r[k.Y_AL]
        s[: k.KL] = (
            1.0, 10.0 * r[k.Y_H], 10.0 * r[k.Y_VA], a, a, 10.0 * r[k.Y_Q], 15.0,
            10.0 * r[k.Y_VG], V * a, 1.0, 1.0, 0.3, 0.3,
        )  # fmt: skip
        believed = np.array([self.p.lift_scale, self.p.drag_scale])
        if not (np.abs(x[k.KL : k.NX] - believed) <= 3.0 * self.p.start_scale_sigma).all():
            x[k.KL : k.NX] = believed  # else a restart keeps what was learnt of the aircraft
        s[k.KL] = s[k.KD] = self.p.start_scale_sigma
        if self.errs is not None:
            raise_cold(s, V, self.errs)
            if k.Y_RA in seen:
                x[k.H], s[k.H] = (
                    seen[k.Y_RA],
                    self.errs.radio_sigma(seen[k.Y_RA]) + self.errs.radio_scale * seen[k.Y_RA],
                )
            x, s = extended(x, s, self.errs)
        self.start(x, s)
        return self._correct(m, u, 0.0)

    def place(self, x_m: float) -> None:
        """Set the along-track position [m] (no reading gives it; it is dead-reckoned from here)."""
        self.x[k.X] = x_m
        self.f.x[k.X] = x_m

    def _restart(self, reason: str) -> WindshearEstimate:
        self.started = False
        self.restarts += 1
        self._refused = 0
        return self._not_valid(reason)

    def _not_valid(self, reason: str) -> WindshearEstimate:
        return WindshearEstimate(False, reason, self.x.copy(), np.full(len(self.x), math.inf), math.nan, math.nan, 0)
