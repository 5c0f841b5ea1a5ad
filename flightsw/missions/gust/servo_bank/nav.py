"""Wind, lift scale and airspeed bias, and the servos behind the commands: a bank of servo models beside a bank of intensities.

One extended filter per servo model (bandwidth and delay), all at the turbulence intensity in force, tells how likely the model
is; the log-likelihoods are forgotten. On the surfaces of the best one fly the filters over turbulence intensity, mixed (IMM),
and they give the estimate. hoffmann.md 3.7. The commands must be told by `hear` before every `step`.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.bank import P_MIN, markov
from flightsw.kernels.linalg import cholesky, finite, inner
from flightsw.kernels.sampled import sampled
from flightsw.missions.gust import dynamics as g
from flightsw.missions.gust.estimate import GustEstimate, GustParams
from flightsw.missions.gust.readings import ANGLE_MAX, GustReadings
from flightsw.missions.gust.servo_bank import kernel as bk
from flightsw.missions.gust.servo_bank import states as st
from flightsw.missions.gust.servo_bank.believed import Believed, slow_by
from flightsw.missions.gust.servo_bank.params import AGE_MAX, ServoBankParams, ServosFound
from flightsw.missions.gust.servo_bank.vane import ANEW, LEAVE, VaneJump
from flightsw.missions.gust.servos import surface_limits

Array = np.ndarray
NZ = st.NZ
LATE_MAX = 20  # [samples] of a link (link.delay_ticks)


class ServoBankNav(GustReadings):
    """`hear` and `step` once per sample. `z` [11], `V` [11,11]: estimate and covariance; `chosen`: servo model in force."""

    def __init__(self, p: GustParams | None = None, b: ServoBankParams | None = None) -> None:
        super().__init__(p or GustParams())
        p, self.b = self.p, b or ServoBankParams()
        self.models = self.b.models
        c, k = len(self.models), len(p.scales)
        self._servo, self._air = slice(0, c), slice(c, c + k)  # filters per servo model, filters over intensity
        self._strongest = c + k - 1  # of the intensities
        self.Z, self.P = np.zeros((c + k, NZ)), np.zeros((c + k, NZ, NZ))
        self.of = np.zeros(c + k, dtype=np.int64)
        self.of[self._servo] = range(c)
        self._scales = np.array(p.scales)
        self._intensity = np.ones(c + k)
        self._intensity[self._air] = self._scales
        self.mu = np.full(k, 1.0 / k)
        self.z, self.V = np.zeros(NZ), np.zeros((NZ, NZ))
        self.ll = np.zeros(c)  # forgotten log-likelihoods
        self._nis, self._step_ll = np.zeros(c + k), np.zeros(c + k)
        self._wn = np.array([w for w, _ in self.models])
        self._extra = np.array([e for _, e in self.models], dtype=np.int64)
        self._base = 1
        self.now, self.rate, self.mean = np.zeros((c, g.NU)), np.zeros((c, g.NU)), np.zeros((c, g.NU))
        self._was = np.zeros((c, g.NU))
        self.sent = np.zeros((AGE_MAX + LATE_MAX + 1, g.NU))  # commands, newest first
        self._lim = surface_limits(p.aircraft)
        self._start = self._nominal()
        self.chosen = self._start
        self._clock = 0.0  # [s] of readings since the start
        self.vane = VaneJump(self.b.vane)
        self.servos = Believed(self)
        self._T = markov(k, p.dwell_s, 0.02)
        self._wind, self._rest = np.zeros((NZ, NZ)), np.zeros((NZ, NZ))
        self._dt = 0.0
        self._R = np.zeros((c + k, g.NY))
        self._W, self._M = np.zeros((g.W_N, NZ)), np.zeros((bk.M_N, NZ, NZ))
        self._a, self._S, self._C = np.zeros(g.AIR_N), np.zeros((st.S_N, NZ)), np.zeros((g.NY, NZ))
        self._w = np.zeros((bk.V_N, NZ))
        self._codes_z, self._r_z = np.zeros(1, dtype=np.int64), np.zeros(1)
        self._nu, self._Sy = np.zeros(g.NY), np.zeros((g.NY, g.NY))
        self._Z0, self._P0, self._mu0 = np.zeros((k, NZ)), np.zeros((k, NZ, NZ)), np.zeros(k)

    def _nominal(self) -> int:
        """Model nearest to the aircraft file's servos, with the least delay."""
        least = min(e for _, e in self.models)
        off = [
            (abs(math.log(w / self.p.aircraft.servo_wn_radps)), i) for i, (w, e) in enumerate(self.models) if e == least
        ]
        return min(off)[1]

    @property
    def x(self) -> Array:
        """Estimate [9] of gust/dynamics.py."""
        return np.asarray(self.z[: g.NX])

    @property
    def late(self) -> int:
        """Samples between a command and the servos, of the model in force."""
        return self._base + int(self._extra[self.chosen])

    @property
    def wn_radps(self) -> float:
        """Bandwidth of the model in force."""
        return float(self._wn[self.chosen])

    def found(self) -> ServosFound:
        """The model in force and what the two states say."""
        other = np.delete(self.ll, self.chosen)
        lead = float(self.ll[self.chosen] - other.max()) if len(other) else math.inf
        lift, bias = (math.sqrt(max(float(self.V[i, i]), 0.0)) for i in (st.LIFT, st.BIAS_V))
        settled = self.started and self._clock >= self.b.wait_s - 1e-9
        slow = slow_by(self.ll, 1.0 / self._wn + (self._base + self._extra) * self._dt, self.b.lag_most_s)
        return ServosFound(
            self.wn_radps, self.late, lead, settled, float(self.z[st.LIFT]), lift, float(self.z[st.BIAS_V]), bias, slow
        )

    def get_state(self) -> dict[str, Array]:
        """Copy of everything that changes."""
        names = ("Z", "P", "of", "mu", "z", "V", "ll", "now", "rate", "mean", "sent", "_was", "_nis", "_intensity")
        head = [self.started, self.restarts, self._whole, self.chosen, self._clock, self._base]
        head += [self.vane.out_s, self.vane.rest_s]
        return {n: getattr(self, n).copy() for n in names} | {
            "score": self.gate.score.copy(), "head": np.array(head, float),
        }  # fmt: skip

    def set_state(self, s: dict[str, Array]) -> None:
        """Restore a copy made by `get_state` of an object of the same parameters."""
        for name, value in s.items():
            if name not in ("score", "head"):
                getattr(self, name)[:] = value
        self.gate.score[:] = s["score"]
        started, restarts, whole, chosen, self._clock, base, self.vane.out_s, self.vane.rest_s = s["head"].tolist()
        self.started, self.restarts, self._whole = bool(started), int(restarts), int(whole)
        self.chosen, self._base = int(chosen), int(base)

    def hear(self, command: Array, late: int, dt: float) -> None:
        """The command [3] sent at the last sample, dt [s] ago, over a link that is `late` samples long: moves all servo
        models."""
        self._base = late
        self.sent[1:] = self.sent[:-1].copy()
        newest = slice(None, 1)
        self.sent[newest] = command
        self._was[:] = self.now
        if dt > 0.0 and math.isfinite(dt):
            age = np.minimum(self._extra + late, len(self.sent) - 1)
            bk.move_surfaces(
                self.now, self.rate, self.mean, self.sent, age, self._wn, self.p.aircraft.servo_zeta, self._lim, dt
            )

    def start(self, z: Array, P: Array) -> None:
        """Begin from the mean z [11] and covariance P [11,11]."""
        self.Z[:], self.P[:], self.z[:], self.V[:] = z, P, z, P
        self.mu[:] = 1.0 / len(self.mu)
        self.ll[:] = 0.0
        self.chosen, self._clock = self._start, 0.0
        self.of[self._air] = self.chosen
        self.gate.reset()
        self._whole = 0
        self.started = True

    def step(self, y: Array, ok: int, u: Array, dt: float, u_now: Array | None = None) -> GustEstimate:
        """One sample, as GustNav.step; of the controls u [3] only that they are finite matters: the surfaces are the models'."""
        m = self._read(y, ok)
        if not self.started:
            first = self._first(m, NZ)
            if isinstance(first, GustEstimate):
                return first
            z, P = first
            P[st.LIFT, st.LIFT], P[st.BIAS_V, st.BIAS_V] = self.b.lift_start**2, self.b.V_bias_start_mps**2
            self.start(z, P)
            return self._estimate(0)
        if not (dt > 0.0 and math.isfinite(dt) and np.isfinite(u).all()):
            return self._refused(f"dt = {dt}, controls {np.asarray(u).tolist()}: allowed > 0 and finite")
        self._model(dt)
        if len(self.mu) > 1:
            bk.mix(self.Z[self._air], self.P[self._air], self.mu, self._T, self._Z0, self._P0, self._mu0)
        self._intensity[self._servo] = self.scale
        bk.predict(
            self.Z, self.P, self.of, self.mean, self._intensity, self._wind, self._rest, self._par, dt, self._W, self._M
        )
        seen = m
        m = self._gated(self._vane_used(m, dt))
        self._left_out = seen - m
        if self._whole >= self.p.refused_max:
            return self._restart("readings disagree with the prediction for too long: restarts")
        if m > 0:
            self._loosen(m, dt)
            bk.correct(
                self.Z, self.P, self.of, self.now, self._par, self._codes, self._y, self._R, m, self._a, self._S, self._C,
                self._w, self._nis, self._step_ll,
            )  # fmt: skip
            bk.weigh(self.mu, self._step_ll[self._air], P_MIN)
        self._identify(m, dt)
        bk.combine(self.Z[self._air], self.P[self._air], self.mu, self.z, self.V)
        return self._estimate(m)

    def open_load(self) -> float:
        """Variance of a_z [m^2/s^4] that the estimate leaves open."""
        self._codes_z[:], self._r_z[:] = g.Y_AZ, 0.0
        bk.foresee(
            self.z, self.V, self.now[self.chosen], self._par, self._codes_z, self._r_z, self._r_z, 1, self._a, self._S, self._C,
            self._w[bk.V_READ], self._nu, self._Sy,
        )  # fmt: skip
        (variance,) = self._Sy[slice(None, 1), slice(None, 1)].ravel().tolist()
        return float(variance)

    @property
    def scale(self) -> float:
        """Turbulence intensity: probability-weighted, geometric."""
        return math.exp(sum(w * math.log(s) for w, s in zip(self.mu.tolist(), self.p.scales, strict=True)))

    def _identify(self, m: int, dt: float) -> None:
        """Forget, add, and change to a model that leads by enough: the filters over intensity go on from its filter."""
        self._clock += dt
        new = self._step_ll[self._servo]
        if m > 0 and finite(new):
            self.ll *= math.exp(-dt / self.b.forget_s)
            self.ll += new
            self.ll -= self.ll.max()  # only differences count, and they stay small numbers
        best = int(np.argmax(self.ll))
        if best != self.chosen and self.ll[best] > self.ll[self.chosen] + self.b.lead:
            self.chosen = best
            self.of[self._air] = best
            self.Z[self._air], self.P[self._air] = self.Z[best], self.P[best]

    def _gated(self, m: int) -> int:
        """Leave out readings that even the filter of the strongest turbulence does not expect; returns how many stay."""
        if m == 0:
            self._left_out = 0
            return 0
        self._foresee(self.Z[self._strongest], self.P[self._strongest], m)
        cholesky(self._Sy, m)
        return self._left(self.gate.kept(self._codes, self._nu, self._Sy, m), m)

    def _vane_used(self, m: int, dt: float) -> int:
        """Leave out a vane that jumps while the load does not, or seek its bias anew; returns how many readings stay."""
        codes = self._codes[:m].tolist()
        if g.Y_ALPHA not in codes or g.Y_AZ not in codes:
            return m
        bk.combine(self.Z[self._air], self.P[self._air], self.mu, self.z, self.V)
        self._foresee(self.z, self.V, m)
        places = codes.index(g.Y_ALPHA), codes.index(g.Y_AZ)
        vane, load = (abs(float(self._nu[i])) / math.sqrt(float(self._Sy[i, i])) for i in places)
        verdict = self.vane.judge(vane, load, dt)
        if verdict == ANEW:
            self.P[:, g.AB, g.AB] += self.b.vane.anew_rad**2
        if verdict != LEAVE:
            return m
        keep = [i for i, c in enumerate(codes) if c != g.Y_ALPHA]
        for a in (self._codes, self._y, self._r):
            a[: m - 1] = a[keep]
        return m - 1

    def _foresee(self, z: Array, V: Array, m: int) -> None:
        """Innovations and their covariance of the m readings for z [11], V [11,11] on the surfaces of the model in force."""
        bk.foresee(
            z, V, self.now[self.chosen], self._par, self._codes, self._y, self._r, m, self._a, self._S, self._C,
            self._w[bk.V_READ], self._nu, self._Sy,
        )  # fmt: skip

    def _loosen(self, m: int, dt: float) -> None:
        """Sigmas of the readings in every filter: a surface is where its model has it to within its rate times the slack."""
        self._R[:, :m] = self._r[:m]
        if self.b.servo_slack_s > 0.0:
            for i in np.flatnonzero(self._codes[:m] == g.Y_AZ):
                for f, c in enumerate(self.of):
                    d = self.linear.D[g.Y_AZ] * ((self.now[c] - self._was[c]) * (self.b.servo_slack_s / dt))
                    self._R[f, i] = math.sqrt(self._r[i] ** 2 + float(inner(d, d)))

    def _model(self, dt: float) -> None:
        """Noise over steps of dt [s]: turbulence of unit intensity, and the rest with the walks of the two states."""
        if dt == self._dt:
            return
        A, Br = self.linear.A, self.linear.Br
        intensity = np.zeros((g.NX, g.NX))
        for j in range(Br.shape[1]):
            intensity += Br[:, j : j + 1] * Br[:, j]
        nine = slice(None, g.NX)
        self._wind[nine, nine] = sampled(A, None, intensity, dt)[2]
        self._rest[nine, nine] = sampled(A, None, self.p.process.intensity(), dt)[2]
        self._rest[st.LIFT, st.LIFT] = self.b.lift_walk**2 * dt
        self._rest[st.BIAS_V, st.BIAS_V] = self.b.V_bias_walk**2 * dt
        self._T = markov(len(self.mu), self.p.dwell_s, dt)
        self._dt = dt

    def _estimate(self, m: int) -> GustEstimate:
        z = self.z
        if not max(abs(z[g.AW]), abs(z[g.AK])) < ANGLE_MAX or not finite(z):
            return self._restart("estimate beyond the model: restarts with the next sample")
        sigma = np.sqrt(np.maximum(np.diag(self.V)[: g.NX], 0.0))
        nis = float(inner(self.mu, self._nis[self._air])) if m > 0 else math.nan
        used = sum(1 << int(c) for c in self._codes[:m])
        return GustEstimate(
            True,
            "",
            self.x.copy(),
            sigma,
            nis,
            m,
            self.scale,
            tuple(self.mu.tolist()),
            used,
            self._left_out,
            self.found(),
        )
