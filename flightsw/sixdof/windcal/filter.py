"""The wind and what the aircraft's own sensors add to it: a linear filter on the wind triangle, w = v - C u.

States (layout.py): wind in a slow part and gusts; lasting errors of airspeed, vanes, attitude reference and satellite velocity;
behind another aircraft the wind of its wake, which banks with both. That is held in own body axes, not in the leader's a degree
or two off: own roll answers gusts, and through that angle the answers would pass for evidence. Straight flight cannot tell a wind
from a constant error; a turn can, and what it has taught stays. Readings are used at the time they are of.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.linalg import inner, matvec
from flightsw.kernels.rotations import vec3
from flightsw.sixdof.windcal.histories import Histories
from flightsw.sixdof.windcal.kernel import correct, expected, gust_size, model, predict, push, raw_wind, total
from flightsw.sixdof.windcal.layout import (
    ALPHA,
    ALPHA_GM,
    ATT,
    ATT_GM,
    BETA,
    BETA_GM,
    GUST,
    N_BEHIND,
    N_FREE,
    OFFSET,
    OFFSET_GM,
    SCALE,
    SLOW,
    SLOW_D,
    SLOW_E,
    SLOW_N,
    VEL,
    WAKE,
    Z_ALPHA,
    Z_V,
)
from flightsw.sixdof.windcal.params import WindCalParams
from flightsw.sixdof.windcal.record import WindReport
from flightsw.types import NavState, SensorFrame, Text

START_MPS = 20.0  # [m/s] of a wind nothing is known of
TRAIL = 21  # raw winds held: one second at 20 Hz
LEARNT_S = 20.0  # [s] of readings the first belief in the size of gusts is worth
STALE_S = 2.0  # [s] without a reading taken: the wind is not given out


class WindCalibrator:
    """Wind and calibration of one aircraft."""

    def __init__(self, p: WindCalParams, probe_x_m: float, behind: bool) -> None:
        """probe_x_m [m]: mean place of the probes ahead of the centre of gravity; behind: another aircraft's wake is met."""
        self.p, self.probe_x = p, probe_x_m
        n = N_BEHIND if behind else N_FREE
        self.x, self.P = np.zeros(n), np.zeros((n, n))
        self.tau, self.sd = np.full(n, np.inf), np.zeros(n)
        self._f, self._q = np.ones(n), np.zeros(n)
        self.h, self.H, self._nu, self._r = np.zeros(3), np.zeros((3, n)), np.zeros(3), np.zeros(3)
        self._use, self._W = np.zeros(3, dtype=np.int64), np.zeros(n)
        self.wind, self.cov = np.zeros(3), np.zeros((3, 3))
        self.out = WindReport()
        self.texts: list[Text] = []
        self._begin()

    def _begin(self) -> None:
        """Nothing is known."""
        self.past = Histories()
        self.t = math.nan  # [s] what the state is of
        self.trail = np.full((TRAIL, 4), np.nan)
        self.sums = np.array([self.p.gust_mps**2, 1.0]) * (LEARNT_S * 20.0 * 1.8)
        self.probes = 0
        self.taken_t = -math.inf  # [s] when all readings that might be were taken
        self.off_s = 0.0  # [s] a reading has been refused without a break

    # --- one step -----------------------------------------------------------------------------------------------------
    def step(
        self, f: SensorFrame, updated: int, air: np.ndarray | None, probes: int, out: int = 0
    ) -> None:  # fmt: skip
        """Take in frame f: `updated` what is new and sound in it; air [3] mean of `probes` probes (V [m/s], beta, alpha [rad]) at
        the centre of gravity, None if there is none; out: bit k = entry k of it is not to be used."""
        h, p = self.past, self.p
        if not h.take(f, updated, air):
            return
        t = h.align(p.V_lag_s, p.vane_lag_s)
        if math.isnan(t):
            return
        V = float(h.z[Z_V])
        if not 20.0 < V < 400.0:
            return
        # the probes are ahead: what they feel reaches the aircraft as a whole later
        t += self.probe_x / V
        if math.isnan(self.t):
            self._start(t, probes)
        self._learn(t, V)
        dt = max(t - self.t, 0.0)
        self._model(dt)
        predict(self.x, self.P, self._f, self._q)
        self.t = max(t, self.t)
        if probes != self.probes:
            self._regroup(probes)
        self._correct(probes, out, dt)

    def _start(self, t: float, probes: int) -> None:
        """First reading: prior of every state."""
        p, h, sd, tau = self.p, self.past, self.sd, self.tau
        self.t = self.taken_t = t
        self.probes = probes
        share = 1.0 / math.sqrt(probes)
        sd[:] = 0.0
        sd[GUST] = math.sqrt(self.sums[0] / self.sums[1])
        sd[SLOW_D], tau[SLOW_D] = p.slow_down_mps, p.slow_down_tau_s
        sd[SCALE], sd[OFFSET], sd[OFFSET_GM] = p.V_scale * share, p.V_offset_mps * share, p.V_gm_mps * share
        upwash = p.vane_scale * abs(float(h.z[Z_ALPHA]))
        sd[ALPHA], sd[BETA] = math.hypot(p.vane_offset, upwash) * share, p.vane_offset * share
        sd[ALPHA_GM] = sd[BETA_GM] = p.vane_gm * share
        sd[ATT : ATT + 3], sd[ATT_GM : ATT_GM + 3] = p.att_constant, p.att_gm
        sd[VEL : VEL + 3] = p.vel_mps
        tau[OFFSET_GM] = p.V_gm_tau_s
        tau[ALPHA_GM] = tau[BETA_GM] = p.vane_gm_tau_s
        tau[ATT_GM : ATT_GM + 3] = p.att_gm_tau_s
        tau[VEL : VEL + 3] = p.vel_tau_s
        if len(sd) > WAKE:
            sd[WAKE : WAKE + 2], tau[WAKE : WAKE + 2] = p.wake_side_mps, p.wake_side_tau_s
            sd[WAKE + 2], tau[WAKE + 2] = p.wake_down_mps, p.wake_down_tau_s
        self.x[:] = 0.0
        self.P[:] = np.diag(sd * sd)
        self.P[SLOW_N, SLOW_N] = self.P[SLOW_E, SLOW_E] = START_MPS**2
        raw_wind(h.z, h.v, h.R, self.wind)
        self.x[SLOW_N:SLOW_D] = self.wind[:2]  # a place to linearise at; its error is START_MPS all the same

    def _learn(self, t: float, V: float) -> None:
        """Size of gusts from the raw wind's differences."""
        h, p = self.past, self.p
        row = np.empty(4)
        row[0] = t
        raw_wind(h.z, h.v, h.R, row[1:])
        push(self.trail, row)
        dt = float(self.trail[-1, 0] - self.trail[-2, 0])
        if dt > 0.0:
            gust_size(self.trail, p.gust_L_m, V, math.exp(-dt / p.gust_learn_s), self.sums)
        self.sd[GUST] = self.gust_sigma
        self.tau[GUST] = p.gust_L_m / V

    @property
    def gust_sigma(self) -> float:
        """[m/s] per axis, as learnt."""
        return math.sqrt(max(self.sums[0] / self.sums[1], 1e-4))

    def _model(self, dt: float) -> None:
        """Factors and noise of a step of dt [s]."""
        model(dt, self.tau, self.sd, self.p.slow_q_mps, self._f, self._q)

    def _regroup(self, probes: int) -> None:
        """Another number of probes has another mean error."""
        p = self.p
        more = abs(1.0 / probes - 1.0 / self.probes)
        self.probes = probes
        upwash = p.vane_scale * abs(float(self.past.z[Z_ALPHA]))
        alpha = math.hypot(p.vane_offset, upwash)
        for i, s in ((SCALE, p.V_scale), (OFFSET, p.V_offset_mps), (ALPHA, alpha), (BETA, p.vane_offset)):
            self.P[i, i] += s * s * more
        for i, s in ((OFFSET_GM, p.V_gm_mps), (ALPHA_GM, p.vane_gm), (BETA_GM, p.vane_gm)):
            self.P[i, i] += s * s * more
            self.sd[i] = s / math.sqrt(probes)

    def _correct(self, probes: int, out: int, dt: float) -> None:
        h, p, o, use = self.past, self.p, self.out, self._use
        expected(self.x, h.v, h.R, self.h, self.H)
        r, V = self._r, float(h.z[Z_V])
        vane = p.vane_white**2 / probes + p.att_white**2 + (p.vel_white_mps / V) ** 2
        r[0], r[1], r[2] = p.V_white_mps**2 / probes + p.vel_white_mps**2, vane, vane
        np.subtract(h.z, self.h, out=self._nu)
        for k in range(3):
            use[k] = 0 if out >> k & 1 else 1
        o.nis = float(correct(self.x, self.P, self.H, self._nu, r, use, p.gate_sigma, self._W))
        refused = int(np.count_nonzero(use == 1))
        o.nis_dof = int(np.count_nonzero(use == 2))
        o.refused += refused
        self.off_s = self.off_s + min(dt, 1.0) if refused else 0.0
        if not refused and o.nis_dof:
            self.taken_t = self.t
        sane = math.isfinite(float(self.x.sum()) + float(self.P.sum()))
        if not sane or self.off_s > p.restart_s:
            o.restarts += 1
            self.texts.append(Text(4, "air data contradict the wind estimate, it begins anew"))
            self._begin()

    # --- what is published --------------------------------------------------------------------------------------------
    def publish(self, nav: NavState) -> None:
        """The wind of the moment into nav: with gusts and wake, and its 1-sigma; the record `out` of the same time."""
        o = self.out
        o.t_us = nav.t_us
        now = nav.t_us * 1e-6
        if math.isnan(self.t):
            o.valid = nav.wind_valid = False
            return
        h = self.past
        self._model(max(now - self.t, 0.0))
        total(self.x, self.P, self._f, self._q, h.now, self.wind, self.cov)
        nav.wind_n = vec3(self.wind)
        s = [math.sqrt(max(float(self.cov[i, i]), 0.0)) for i in range(3)]
        nav.wind_sigma = (s[0], s[1], s[2])
        sound = nav.valid and max(s) <= self.p.sigma_max_mps and now - self.taken_t <= STALE_S
        o.valid = nav.wind_valid = sound

    def tell(self) -> list[Text]:
        """Messages since the last call."""
        out, self.texts = self.texts, []
        return out

    def report(self) -> WindReport:
        """The record of the moment, its calibration filled in."""
        o, x, P = self.out, self.x, self.P
        o.wind, c = vec3(x[SLOW]), P[SLOW, SLOW].tolist()
        o.wind_cov = (c[0][0], c[0][1], c[0][2], c[1][1], c[1][2], c[2][2])
        o.gust = self.gust_sigma
        o.scale, o.scale_sigma = float(x[SCALE]), _root(P[SCALE, SCALE])
        o.offset, o.offset_sigma = float(x[OFFSET]), _root(P[OFFSET, OFFSET])
        a = self._W
        a[:] = 0.0
        a[SCALE], a[OFFSET], a[OFFSET_GM] = float(self.past.z[Z_V]), 1.0, 1.0
        o.airspeed, o.airspeed_sigma = self._along(a)
        (a0, s0), (b0, s1) = self._pair(ALPHA, ALPHA_GM), self._pair(BETA, BETA_GM)
        o.vanes, o.vanes_sigma = (a0, b0), (s0, s1)
        (a0, s0), (b0, s1), (c0, s2) = (self._pair(ATT + k, ATT_GM + k) for k in range(3))
        o.attitude, o.attitude_sigma = (a0, b0, c0), (s0, s1, s2)
        return o

    def _pair(self, i: int, j: int) -> tuple[float, float]:
        P = self.P
        return float(self.x[i] + self.x[j]), _root(P[i, i] + 2.0 * P[i, j] + P[j, j])

    def _along(self, a: np.ndarray) -> tuple[float, float]:
        """Value and sigma of the sum of a [n] times the state."""
        b = np.zeros(len(a))
        matvec(self.P, a, b)
        return float(inner(a, self.x)), _root(inner(a, b))


def _root(variance: float) -> float:
    return math.sqrt(max(float(variance), 0.0))
