"""Wind estimator without an aerodynamic model: air data, attitude, body rates and ground velocity are all it needs.

States [12]: air-relative velocity (V, beta, alpha), wind (N, E, D), specific force in body axes (the sum of everything that
is not gravity: wing, propulsion, tether), and the probe's errors (airspeed scale, beta and alpha offsets). Between samples

    u_dot = -w x u + f + R_BI g,     W random walk,  f random walk,  probe errors random walk,

with u = R_BW [V,0,0], body rates w and attitude R_BI as known inputs. A wind increment dW enters (V, beta, alpha) through
-eps^-1 R_BI (Lee 2011, re-formulated: process noise of the wind and of the air-relative velocity are fully correlated).
Measured: ground velocity R_BI^T u + W, and (V, beta, alpha) of u + C (k, b, a). The velocity is used once, as a measurement;
its difference is nowhere an input, so that its noise does not appear twice. Attitude noise acts on the velocity equation as
V sigma_att; rate noise turns the air-relative velocity by sigma_rate dt.

Why C is formed at the slow air velocity R_BI (v - W_slow) and not at u: with V (1 + k) the turbulence itself, seen in u,
would count as excitation of k. It is correlated with the very noise it is weighed against, so each gust would bias k and
shrink its variance (errors in variables). What identifies k, b, a is the manoeuvre alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from flightsw.filters.srukf import SquareRootUKF, row_norms
from flightsw.kernels.jit import jit
from flightsw.kernels.linalg import forward_sub, tria
from flightsw.kernels.rotations import dcm_from_euler, rotate_dcm, vec3
from flightsw.models.airframe import air_jacobian
from flightsw.strict import Range

Pos = Annotated[float, Range(1e-12)]
NonNeg = Annotated[float, Range(0.0)]
Vec3 = tuple[float, float, float]

AIR, WIND, FORCE, PROBE = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
G0 = 9.80665  # [m/s^2]
N, M, NQ = 12, 6, 12


@dataclass(frozen=True)
class KinematicParams:
    """Tuning; process noise per sqrt(s), sensor values 1-sigma per sample. `probe_*` = 0 switches that probe state off."""

    q_wind: NonNeg = 1.2  # [m/s]
    q_force: NonNeg = 9.0  # [m/s^2]
    q_scale: NonNeg = 1e-4  # [-]
    q_offset: NonNeg = 1e-4  # [rad]
    r_V: Pos = 0.07  # [m/s]
    r_beta: Pos = 0.0035  # [rad]
    r_alpha: Pos = 0.0035  # [rad]
    r_vel: Pos = 0.03  # [m/s]
    r_att: NonNeg = 0.002  # [rad] sample-to-sample part of the attitude error
    r_rate: NonNeg = 0.02  # [rad/s]
    probe_scale: NonNeg = 0.03  # [-] start 1-sigma of the airspeed scale error
    probe_beta: NonNeg = 0.02  # [rad]
    probe_alpha: NonNeg = 0.02  # [rad]
    bias_att: NonNeg = 0.005  # [rad] slow attitude error, not a state: added to the reported wind uncertainty
    bias_vel: NonNeg = 0.1  # [m/s] slow velocity error, likewise
    slow_s: Pos = 10.0  # [s] time constant of the slow wind in the probe-error matrix
    wind_sigma0: Pos = 20.0  # [m/s]
    force_sigma0: Pos = 20.0  # [m/s^2]
    soft_gate: Pos = 3.0  # [-] innovation over its 1-sigma beyond which a measurement loses weight
    hard_gate: Pos = 6.0  # [-] and beyond which it is refused
    lockout_s: Pos = 0.5  # [s] refused for this long without a break: taken with less weight instead
    max_gap_s: Pos = 1.0  # [s] longer gap between inputs: start again
    min_airspeed: Pos = 3.0  # [m/s] below it the flow angles mean nothing


@dataclass(slots=True)
class KinematicInput:
    """One sample. euler (psi, theta, phi) [rad], w_b [rad/s] body, vel_n [m/s] NED, air (V [m/s], beta, alpha [rad])."""

    t_us: int = 0
    euler: Vec3 = (0.0, 0.0, 0.0)
    w_b: Vec3 = (0.0, 0.0, 0.0)
    vel_n: Vec3 = (0.0, 0.0, 0.0)
    air: Vec3 = (0.0, 0.0, 0.0)
    air_ok: bool = True
    vel_ok: bool = True


@dataclass(slots=True)
class KinematicState:
    """Estimate after a step. wind_sigma includes the slow errors that are no state; wind_P [3,3] is the filter's own."""

    t_us: int = 0
    valid: bool = False
    reason: str = "not started"
    air: Vec3 = (0.0, 0.0, 0.0)  # V [m/s], beta, alpha [rad]
    wind_n: Vec3 = (0.0, 0.0, 0.0)  # [m/s]
    wind_sigma: Vec3 = (0.0, 0.0, 0.0)  # [m/s]
    wind_P: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))  # [m^2/s^2]
    force_b: Vec3 = (0.0, 0.0, 0.0)  # [m/s^2]
    probe: Vec3 = (0.0, 0.0, 0.0)  # airspeed scale [-], beta, alpha offset [rad]
    probe_sigma: Vec3 = (0.0, 0.0, 0.0)
    codes: tuple[int, ...] = ()  # offered this step: 0..2 V, beta, alpha; 3..5 velocity N, E, D
    innovation: np.ndarray = field(default_factory=lambda: np.zeros(M))  # in the order of `codes`, before gating
    innovation_sigma: np.ndarray = field(default_factory=lambda: np.zeros(M))
    whitened: np.ndarray = field(default_factory=lambda: np.zeros(M))  # unit white when the model is right
    log_likelihood: float = 0.0
    softened: int = 0  # measurements that lost weight, this step
    refused: int = 0  # and that were refused


@jit
def propagate(X: np.ndarray, w: np.ndarray, R: np.ndarray, dt: float, E: np.ndarray, B: np.ndarray) -> None:
    """Points X [k,12] <- dt [s] later. w [3] mean body rate, R [9] NED to body in the middle of the step; work E, B [9].

    Half the acceleration, the exact turn of the axes, the other half (second order in dt).
    """
    for i in range(9):
        B[i] = 1.0 if i % 4 == 0 else 0.0
    rotate_dcm(B, w, dt, E)
    h = 0.5 * dt
    for s in range(X.shape[0]):
        x = X[s]
        V, b, a = x[0], x[1], x[2]
        cb = math.cos(b)
        ax, ay, az = x[6] + R[2] * 9.80665, x[7] + R[5] * 9.80665, x[8] + R[8] * 9.80665
        u0 = V * math.cos(a) * cb + h * ax
        u1 = V * math.sin(b) + h * ay
        u2 = V * math.sin(a) * cb + h * az
        v0 = E[0] * u0 + E[1] * u1 + E[2] * u2 + h * ax
        v1 = E[3] * u0 + E[4] * u1 + E[5] * u2 + h * ay
        v2 = E[6] * u0 + E[7] * u1 + E[8] * u2 + h * az
        n = max(math.sqrt(v0 * v0 + v1 * v1 + v2 * v2), 1e-6)
        x[0] = n
        x[1] = math.asin(max(-1.0, min(1.0, v1 / n)))
        x[2] = math.atan2(v2, v0)


@jit
def probe_matrix(u: np.ndarray, C: np.ndarray) -> None:
    """C [9] <- velocity error in body axes per unit airspeed scale, beta and alpha offset, at air velocity u [3] (body)."""
    V = max(math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), 1e-6)
    h = max(math.sqrt(u[0] * u[0] + u[2] * u[2]), 1e-6)  # V cos(beta)
    t = u[1] / h
    C[0], C[3], C[6] = u[0], u[1], u[2]
    C[1], C[4], C[7] = -u[0] * t, h, -u[2] * t
    C[2], C[5], C[8] = -u[2], 0.0, u[0]


@jit
def measure(X: np.ndarray, R: np.ndarray, C: np.ndarray, codes: np.ndarray, m: int, Y: np.ndarray) -> None:
    """Y [k,:m] <- what the sensors `codes` [m] (0..2 air data, 3..5 ground velocity NED) read at points X [k,12].

    R [9] NED to body; C [9] probe-error matrix (`probe_matrix`).
    """
    for s in range(X.shape[0]):
        x = X[s]
        cb = math.cos(x[1])
        u0, u1, u2 = x[0] * math.cos(x[2]) * cb, x[0] * math.sin(x[1]), x[0] * math.sin(x[2]) * cb
        a0 = u0 + C[0] * x[9] + C[1] * x[10] + C[2] * x[11]
        a1 = u1 + C[3] * x[9] + C[4] * x[10] + C[5] * x[11]
        a2 = u2 + C[6] * x[9] + C[7] * x[10] + C[8] * x[11]
        V = max(math.sqrt(a0 * a0 + a1 * a1 + a2 * a2), 1e-6)
        for j in range(m):
            c = codes[j]
            if c == 0:
                Y[s, j] = V
            elif c == 1:
                Y[s, j] = math.asin(max(-1.0, min(1.0, a1 / V)))
            elif c == 2:
                Y[s, j] = math.atan2(a2, a0)
            else:
                i = c - 3
                Y[s, j] = R[i] * u0 + R[3 + i] * u1 + R[6 + i] * u2 + x[c]


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


class KinematicNav:
    """The estimator as an onboard component: deterministic function of parameters, state and inputs."""

    def __init__(self, params: KinematicParams) -> None:
        self.p = params
        self.ukf = SquareRootUKF(N, M, NQ)
        self.out = KinematicState()
        self.started = False
        self._w0, self._e0 = np.zeros(3), np.zeros(3)
        self._w, self._R, self._Rm, self._E, self._B = np.zeros(3), np.zeros(9), np.zeros(9), np.zeros(9), np.zeros(9)
        self._G, self._C, self._slow = np.zeros((3, 3)), np.zeros(9), np.zeros(3)
        self._codes = np.zeros(M, dtype=np.int64)
        self._y, self._r, self._nu, self._sd, self._e = (np.zeros(M) for _ in range(5))
        self._L, self._A = np.zeros((M, M)), np.zeros((M, 2 * N + 1 + M))
        self._since = np.zeros(M)  # [s] how long each measurement has been refused without a break

    def reset(self) -> None:
        """Forget everything; the next usable sample starts the filter."""
        self.started = False
        self.out = KinematicState()

    def get_state(self) -> dict[str, np.ndarray]:
        """Copy of the state."""
        head = np.array([float(self.started), float(self.out.t_us)])
        return {"x": self.ukf.x.copy(), "S": self.ukf.S.copy(), "w": self._w0.copy(), "e": self._e0.copy(),
                "since": self._since.copy(), "slow": self._slow.copy(), "C": self._C.copy(), "head": head}  # fmt: skip

    def set_state(self, s: dict[str, np.ndarray]) -> None:
        """Restore what `get_state` returned."""
        self.ukf.x[:], self.ukf.S[:], self._w0[:], self._e0[:] = s["x"], s["S"], s["w"], s["e"]
        self._since[:], self._slow[:], self._C[:] = s["since"], s["slow"], s["C"]
        self.started, self.out.t_us = bool(s["head"][0]), int(s["head"][1])

    def step(self, f: KinematicInput) -> KinematicState:
        """One sample. Never raises on bad data: `valid` and `reason` of the returned state say what is wrong."""
        o, p = self.out, self.p
        if not all(map(math.isfinite, (*f.euler, *f.w_b))):
            o.valid, o.reason, o.codes = False, "attitude or body rate not finite", ()
            return o
        air_ok = f.air_ok and all(map(math.isfinite, f.air)) and f.air[0] >= p.min_airspeed
        vel_ok = f.vel_ok and all(map(math.isfinite, f.vel_n))
        dt = (f.t_us - o.t_us) * 1e-6
        if self.started and (dt <= 0.0 or dt > p.max_gap_s):
            if dt <= 0.0:
                o.valid, o.reason, o.codes = False, "time does not advance", ()
                return o
            self.started = False
        if not self.started:
            return self._start(f, air_ok and vel_ok)
        self._predict(f, dt)
        self._fuse(f, dt, air_ok, vel_ok)
        x = self.ukf.x
        if not (np.isfinite(x).all() and np.isfinite(self.ukf.S).all() and p.min_airspeed < x[0] < 400.0):
            self.started = False
            o.t_us, o.valid, o.reason = f.t_us, False, "estimate left its domain, starting again"
            return o
        return self._publish(f)

    def _start(self, f: KinematicInput, usable: bool) -> KinematicState:
        o, p, x = self.out, self.p, self.ukf.x
        o.t_us, o.codes = f.t_us, ()
        if not usable:
            o.valid, o.reason = False, "waiting for air data and ground velocity"
            return o
        x[:] = 0.0
        x[AIR] = f.air
        dcm_from_euler(*f.euler, self._R)
        cb = math.cos(f.air[1])
        u = f.air[0] * np.array([math.cos(f.air[2]) * cb, math.sin(f.air[1]), math.sin(f.air[2]) * cb])
        R = self._R.reshape(3, 3)
        x[WIND] = np.array(f.vel_n) - R.T @ u
        x[FORCE] = np.cross(f.w_b, u) - G0 * R[:, 2]
        sd = [math.hypot(p.r_V, f.air[0] * p.probe_scale), math.hypot(p.r_beta, p.probe_beta)]
        sd += [math.hypot(p.r_alpha, p.probe_alpha), *[p.wind_sigma0] * 3, *[p.force_sigma0] * 3]
        self.ukf.S[:] = np.diag([*sd, p.probe_scale, p.probe_beta, p.probe_alpha])
        self._since[:] = 0.0
        self._slow[:] = x[WIND]
        probe_matrix(u, self._C)
        self._w0[:], self._e0[:] = f.w_b, f.euler
        self.started = True
        return self._publish(f)

    def _predict(self, f: KinematicInput, dt: float) -> None:
        p, x, SQ = self.p, self.ukf.x, self.ukf.SQ
        for i in range(3):
            self._w[i] = 0.5 * (self._w0[i] + f.w_b[i])
        dcm_from_euler(*self._e0, self._R)
        rotate_dcm(self._R, self._w, 0.5 * dt, self._Rm)
        self._w0[:], self._e0[:] = f.w_b, f.euler
        rt = math.sqrt(dt)
        SQ[:] = 0.0
        air_jacobian(x[0], x[1], x[2], self._Rm, self._G)
        SQ[AIR, 0:3] = self._G * (p.q_wind * rt)
        SQ[3, 0] = SQ[4, 1] = SQ[5, 2] = p.q_wind * rt
        SQ[6, 3] = SQ[7, 4] = SQ[8, 5] = p.q_force * rt
        s = p.r_rate * dt  # [rad] the rate noise is white from sample to sample
        # turning by the small angle d changes u by -d x u: no change of V, and to first order alpha by d_q, beta by -d_r
        ca, sa, tb = math.cos(x[2]), math.sin(x[2]), math.tan(x[1])
        SQ[1, 6], SQ[1, 8] = s * sa, -s * ca
        SQ[2, 6], SQ[2, 7], SQ[2, 8] = -s * ca * tb, s, -s * sa * tb
        for i, (q, on) in enumerate(((p.q_scale, p.probe_scale), (p.q_offset, p.probe_beta), (p.q_offset, p.probe_alpha))):
            SQ[9 + i, 9 + i] = q * rt if on > 0.0 else 0.0
        propagate(self.ukf.draw(), self._w, self._Rm, dt, self._E, self._B)
        self.ukf.recombine()

    def _fuse(self, f: KinematicInput, dt: float, air_ok: bool, vel_ok: bool) -> None:
        o, p, m = self.out, self.p, 0
        s_vel = math.hypot(p.r_vel, self.ukf.x[0] * p.r_att)
        values, sigmas = (*f.air, *f.vel_n), (p.r_V, p.r_beta, p.r_alpha, s_vel, s_vel, s_vel)
        for c in range(M):
            if air_ok if c < 3 else vel_ok:
                self._codes[m], self._y[m], self._r[m] = c, values[c], sigmas[c]
                m += 1
        o.codes, o.softened, o.refused, o.log_likelihood = tuple(self._codes[:m].tolist()), 0, 0, 0.0
        if m == 0:
            return
        dcm_from_euler(*f.euler, self._R)
        ukf = self.ukf
        self._slow += (ukf.x[WIND] - self._slow) * min(1.0, dt / p.slow_s)
        if vel_ok:
            probe_matrix(self._R.reshape(3, 3) @ (np.array(f.vel_n) - self._slow), self._C)
        measure(ukf.draw(), self._R, self._C, self._codes, m, ukf.Y)
        o.log_likelihood = float(innovate(ukf.Y, m, ukf.w0c, ukf.wi, self._y, self._r, self._nu, self._sd, self._e, self._L, self._A))
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
        o, p, x = self.out, self.p, self.ukf.x
        o.t_us, o.valid, o.reason = f.t_us, True, ""
        o.air, o.wind_n, o.force_b, o.probe = vec3(x[AIR]), vec3(x[WIND]), vec3(x[FORCE]), vec3(x[PROBE])
        s = self.ukf.sigmas()
        b = (x[0] * p.bias_att) ** 2 + p.bias_vel**2
        o.wind_sigma = (math.sqrt(s[3] ** 2 + b), math.sqrt(s[4] ** 2 + b), math.sqrt(s[5] ** 2 + b))
        o.probe_sigma = (s[9], s[10], s[11])
        SW = self.ukf.S[WIND]
        o.wind_P[:] = SW @ SW.T
        return o
