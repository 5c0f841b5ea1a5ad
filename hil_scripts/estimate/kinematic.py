"""Wind estimator without an aerodynamic model: air data, attitude, body rates and ground velocity are all it needs.

States [12]: air-relative velocity u in body axes (V, beta, alpha are read off it), wind (N, E, D), specific force in body
axes (the sum of everything that is not gravity: wing, propulsion, tether), and the probe's errors (airspeed scale k, beta and
alpha offsets b, a). Between samples

    u_dot = -w x u + f + R_BI g,     W random walk,  f random walk,  probe errors random walk,

with u = R_BW [V,0,0], attitude R_BI and body rates w as known inputs. A wind increment dW enters u as -R_BI dW: the
-eps^-1 R_BI coupling of Lee's filter, re-formulated. In (V, beta, alpha) it holds to first order only, the sum R_BI^T u + W
is no longer kept exactly from step to step, and the filter takes the remainder for knowledge of the probe: 3 % of scale
uncertainty shrink to 0.4 % in straight flight, which can teach nothing. In u the process is linear.

Measured: ground velocity R_BI^T u + W, and (V, beta, alpha) of u + C (k, b, a). The velocity is used once, as a measurement;
its difference is nowhere an input, so that its noise does not appear twice.

The turn between samples is that of the attitude; the integrated rates fill in while no attitude comes, and judge it when it
does: an increment that disagrees with them is an attitude correction, not motion, and that step's noise u x d grows by the
disagreement. Turning by the rates alone would let a rate scale error of 2 % walk u away from R_BI (v - W) for good.

What is published uses a probe error only once the flight itself says more about it than the prior did (`published`): until then
it stays at zero with the prior's sigma, and wind and sigma are those of a probe taken as it reads whose errors are considered.

C is formed at the slow air velocity R_BI (v - W_slow) and not at u: with V (1 + k) the turbulence itself, seen in u,
would count as excitation of k, although it is the very noise k is weighed against (errors in variables). What identifies
k, b, a is the manoeuvre alone.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.filters.srukf import SquareRootUKF, row_norms
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import forward_sub, tria
from flightsw.kernels.rotations import dcm_from_euler, mul33_t, rotate_dcm, to_child, to_parent, vec3
from flightsw.kernels.sampled import multiply
from hil_scripts.estimate.kinematic_kernel import G0, measure, probe_matrix, propagate, published
from hil_scripts.estimate.kinematic_ports import KinematicInput, KinematicParams, KinematicState, Vec3

AIR, WIND, FORCE, PROBE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
N, M, NQ = 12, 6, 12
NO_AIR = (math.nan, math.nan, math.nan)


@jit
def innovate(
    Y: np.ndarray, m: int, w0c: float, wi: float, y: np.ndarray, r: np.ndarray,
    nu: np.ndarray, sd: np.ndarray, e: np.ndarray, L: np.ndarray, A: np.ndarray,
) -> float:  # fmt: skip
    """Innovation before gating: nu [m], its 1-sigma sd [m], whitened e [m] = L^-1 nu; returns the log-likelihood.

    Y [k,>=m] images, y, r [m] measured and 1-sigma; work L [6,6], A [6,k+6].
    """
    k = Y.shape[0]
    for a in range(m):
        c, s = Y[0, a], 0.0
        for i in range(1, k):
            s += Y[i, a] - c
        mean = c + wi * s
        nu[a] = y[a] - mean
        for i in range(1, k):
            A[a, i - 1] = math.sqrt(wi) * (Y[i, a] - mean)
        A[a, k - 1] = math.sqrt(w0c) * (c - mean)
        for b in range(m):
            A[a, k + b] = r[a] if a == b else 0.0
    tria(A, m, k + m, L)
    row_norms(L[:m, :m], sd[:m])
    for a in range(m):
        e[a] = nu[a]
    forward_sub(L, m, e)
    ll = 0.0
    for a in range(m):
        ll -= 0.5 * e[a] * e[a] + math.log(L[a, a]) + 0.9189385332046727  # log(2 pi) / 2
    return ll


__all__ = ["KinematicInput", "KinematicNav", "KinematicParams", "KinematicState"]


class KinematicNav:
    """The estimator as an onboard component: deterministic function of parameters, state and inputs."""

    def __init__(self, params: KinematicParams) -> None:
        self.p = params
        self.ukf = SquareRootUKF(N, M, NQ)
        self.out = KinematicState()
        self.started = False
        self._w0 = np.zeros(3)
        self._w, self._R, self._Rg, self._R0, self._E = np.zeros(3), np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(9)
        self._C, self._slow, self._fast = np.zeros(9), np.zeros(3), np.zeros(3)
        self._codes = np.zeros(M, dtype=np.int64)
        self._y, self._r, self._nu, self._sd, self._e = (np.zeros(M) for _ in range(5))
        self._L, self._A = np.zeros((M, M)), np.zeros((M, 2 * N + 1 + M))
        self._prior = np.array([params.probe_scale, params.probe_beta, params.probe_alpha])
        self._share = np.array(params.observed_share)
        self._shown, self._seen = np.zeros(3), np.zeros(3, dtype=np.int64)  # what the flight shows of the probe errors
        self._z, self._P = np.zeros(9), np.zeros((9, 9))  # published: u, wind, probe errors
        self._since = np.zeros(M)  # [s] how long each measurement has been refused without a break

    def reset(self) -> None:
        """Forget everything; the next usable sample starts the filter."""
        self.started = False
        self.out = KinematicState()

    def get_state(self) -> dict[str, np.ndarray]:
        """Copy of the state."""
        head = np.array([float(self.started), float(self.out.t_us)])
        return {"x": self.ukf.x.copy(), "S": self.ukf.S.copy(), "w": self._w0.copy(), "R": self._R.copy(),
                "since": self._since.copy(), "seen": self._seen.astype(float), "slow": self._slow.copy(), "C": self._C.copy(),
                "head": head}  # fmt: skip

    def set_state(self, s: dict[str, np.ndarray]) -> None:
        """Restore what `get_state` returned."""
        self.ukf.x[:], self.ukf.S[:], self._w0[:], self._R[:] = s["x"], s["S"], s["w"], s["R"]
        self._seen[:] = s["seen"]
        self._since[:], self._slow[:], self._C[:] = s["since"], s["slow"], s["C"]
        self.started, self.out.t_us = bool(s["head"][0]), int(s["head"][1])

    def step(self, f: KinematicInput) -> KinematicState:
        """One sample. Never raises on bad data: `valid` and `reason` of the returned state say what is wrong."""
        o, p = self.out, self.p
        att_ok = f.att_ok and all(map(math.isfinite, f.euler))
        if not all(map(math.isfinite, f.w_b)):
            o.valid, o.reason, o.codes = False, "body rate not finite", ()
            return o
        air = f.air if f.air_ok and (math.isnan(f.air[0]) or p.min_airspeed <= f.air[0] < math.inf) else NO_AIR
        vel_ok = f.vel_ok and all(map(math.isfinite, f.vel_n))
        dt = (f.t_us - o.t_us) * 1e-6
        if self.started and (dt <= 0.0 or dt > p.max_gap_s):
            if dt <= 0.0:
                o.valid, o.reason, o.codes = False, "time does not advance", ()
                return o
            self.started = False
        if not self.started:
            return self._start(f, air, att_ok and math.isfinite(air[0]) and vel_ok)
        self._predict(f, dt, att_ok)
        self._fuse(f, dt, air, vel_ok)
        x = self.ukf.x
        if not (np.isfinite(x).all() and np.isfinite(self.ukf.S).all() and p.min_airspeed < self.airspeed() < 400.0):
            self.started = False
            o.t_us, o.valid, o.reason = f.t_us, False, "estimate left its domain, starting again"
            return o
        return self._publish(f)

    def airspeed(self) -> float:
        """Estimated airspeed [m/s]."""
        x = self.ukf.x
        return math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])

    def _start(self, f: KinematicInput, air: Vec3, usable: bool) -> KinematicState:
        o, p, x = self.out, self.p, self.ukf.x
        o.t_us, o.codes = f.t_us, ()
        if not usable:
            o.valid, o.reason = False, "waiting for attitude, air data and ground velocity"
            return o
        V, (beta, r_beta), (alpha, r_alpha) = (
            air[0],
            *(
                (a, r) if math.isfinite(a) else (0.0, p.flow_sigma0)
                for a, r in ((air[1], p.r_beta), (air[2], p.r_alpha))
            ),
        )
        cb = math.cos(beta)
        u, u_n = V * np.array([math.cos(alpha) * cb, math.sin(beta), math.sin(alpha) * cb]), np.zeros(3)
        dcm_from_euler(*f.euler, self._R)
        to_parent(self._R, u, u_n)
        x[AIR], x[WIND], x[PROBE] = u, np.array(f.vel_n) - u_n, 0.0
        R = self._R.reshape(3, 3)
        x[FORCE] = np.cross(f.w_b, u) - G0 * R[:, 2]
        # what is wrong with u is wrong with the wind as well: the start covariance carries it, and needs no wide guess
        probe_matrix(u, self._C)
        C = self._C.reshape(3, 3)
        J = np.zeros((N, 12))
        J[PROBE, 0:3] = np.diag([p.probe_scale, p.probe_beta, p.probe_alpha])
        J[AIR, 0:3] = -C * np.diag(J[PROBE, 0:3])
        J[AIR, 3:6] = C * np.array([p.r_V / V, r_beta, r_alpha])
        J[WIND, 0:6] = -multiply(R.T, J[AIR, 0:6])
        J[WIND, 6:9] = np.eye(3) * p.r_vel
        J[FORCE, 9:12] = np.eye(3) * p.force_sigma0
        A = np.ascontiguousarray(J)
        tria(A, N, 12, self.ukf.S)
        self._since[:] = 0.0
        self._seen[:] = 0
        self._slow[:] = x[WIND]
        self._w0[:] = f.w_b
        self.started = True
        return self._publish(f)

    def _predict(self, f: KinematicInput, dt: float, att_ok: bool) -> None:
        p, x, SQ = self.p, self.ukf.x, self.ukf.SQ
        for i in range(3):
            self._w[i] = 0.5 * (self._w0[i] + f.w_b[i])
        self._w0[:], self._R0[:] = f.w_b, self._R
        rotate_dcm(self._R0, self._w, dt, self._Rg)
        s = p.r_rate * dt  # [rad] 1-sigma of the turn
        if att_ok:
            dcm_from_euler(*f.euler, self._R)
            mul33_t(self._R, self._Rg, self._E)  # attitude against rates: close to I - [d x]
            E = self._E
            d2 = (E[5] - E[7]) ** 2 + (E[6] - E[2]) ** 2 + (E[1] - E[3]) ** 2
            s = math.sqrt(p.r_att**2 + max(0.0, 0.25 * d2 / 3.0 - s * s))
        else:
            s = math.hypot(p.r_att, s)  # rates that stand in for an attitude are not better than one
            self._R[:] = self._Rg
        mul33_t(self._R, self._R0, self._E)
        rt = math.sqrt(dt)
        SQ[:] = 0.0
        SQ[AIR, 0:3] = self._R.reshape(3, 3) * (-p.q_wind * rt)
        SQ[3, 0] = SQ[4, 1] = SQ[5, 2] = p.q_wind * rt
        SQ[6, 3] = SQ[7, 4] = SQ[8, 5] = p.q_force * rt
        # turning by a small d changes u by u x d
        SQ[0, 7], SQ[0, 8] = -x[2] * s, x[1] * s
        SQ[1, 6], SQ[1, 8] = x[2] * s, -x[0] * s
        SQ[2, 6], SQ[2, 7] = -x[1] * s, x[0] * s
        for i, (q, on) in enumerate(
            ((p.q_scale, p.probe_scale), (p.q_offset, p.probe_beta), (p.q_offset, p.probe_alpha))
        ):
            SQ[9 + i, 9 + i] = q * rt if on > 0.0 else 0.0
        propagate(self.ukf.draw(), self._E, self._R0, self._R, dt)
        self.ukf.recombine()

    def _fuse(self, f: KinematicInput, dt: float, air: Vec3, vel_ok: bool) -> None:
        o, p, m = self.out, self.p, 0
        values, sigmas = (*air, *f.vel_n), (p.r_V, p.r_beta, p.r_alpha, p.r_vel, p.r_vel, p.r_vel)
        for c in range(M):
            if math.isfinite(values[c]) and (c < 3 or vel_ok):
                self._codes[m], self._y[m], self._r[m] = c, values[c], sigmas[c]
                m += 1
        o.codes, o.softened, o.refused, o.log_likelihood = tuple(self._codes[:m].tolist()), 0, 0, 0.0
        if m == 0:
            return
        ukf = self.ukf
        self._slow += (ukf.x[WIND] - self._slow) * min(1.0, dt / p.slow_s)
        # R (v - W_slow) with the predicted velocity: the noise of the measured one is in the innovation it would meet
        to_child(self._R, ukf.x[WIND] - self._slow, self._fast)
        probe_matrix(ukf.x[AIR] + self._fast, self._C)
        measure(ukf.draw(), self._R, self._C, self._codes, m, ukf.Y)
        o.log_likelihood = float(
            innovate(ukf.Y, m, ukf.w0c, ukf.wi, self._y, self._r, self._nu, self._sd, self._e, self._L, self._A)
        )
        o.innovation[:m], o.innovation_sigma[:m], o.whitened[:m] = self._nu[:m], self._sd[:m], self._e[:m]
        k = 0
        for j in range(m):
            c = self._codes[j]
            z = abs(self._nu[j]) / self._sd[j]
            if z > p.hard_gate and self._since[c] < p.lockout_s:
                self._since[c] += dt
                o.refused += 1
                continue
            if z <= p.hard_gate:
                self._since[c] = 0.0
            soft = z > p.soft_gate
            o.softened += soft
            # less weight: the whole innovation variance grows until the innovation is at the soft gate
            grow = self._sd[j] ** 2 * ((z / p.soft_gate) ** 2 - 1.0) if soft else 0.0
            self._codes[k], self._y[k], self._r[k] = c, self._y[j], math.sqrt(self._r[j] ** 2 + grow)
            k += 1
        if k:
            measure(ukf.X, self._R, self._C, self._codes, k, ukf.Y)
            ukf.correct(self._y, self._r, k)

    def _publish(self, f: KinematicInput) -> KinematicState:
        o, p, x, P = self.out, self.p, self._z, self._P
        published(self.ukf.x, self.ukf.S, self._prior, self._share, self._shown, self._seen, x, P)
        o.t_us, o.valid, o.reason = f.t_us, True, ""
        V = math.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        o.air = (V, math.asin(max(-1.0, min(1.0, x[1] / V))), math.atan2(x[2], x[0]))
        o.wind_n, o.force_b, o.probe = vec3(x[3:6]), vec3(self.ukf.x[FORCE]), vec3(x[6:9])
        b = (V * p.bias_att) ** 2 + p.bias_vel**2
        var = np.diag(P).tolist()
        o.wind_sigma = (math.sqrt(var[3] + b), math.sqrt(var[4] + b), math.sqrt(var[5] + b))
        o.probe_sigma = (math.sqrt(var[6]), math.sqrt(var[7]), math.sqrt(var[8]))
        o.probe_shown = vec3(self._shown)
        o.probe_held = (not self._seen[0], not self._seen[1], not self._seen[2])
        o.P[:] = P[3:, 3:]
        return o
