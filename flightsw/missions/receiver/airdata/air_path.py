"""Geometry and motion for the wake position: the tanker's air-path axes F, own attitude, rates and acceleration in them.

F: origin tanker cg, x along the tanker's velocity through the air, y right, z down. All of it from the tanker's transmitted
estimate, own inertial sensors and the relative estimate.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.kernels.atmosphere import G0
from flightsw.kernels.rotations import (
    dcm_from_euler,
    dcm_from_quat,
    euler_from_dcm,
    mul33,
    mul33_t,
    rotate_dcm,
    to_child,
    to_parent,
    vec3,
)
from flightsw.missions.receiver.estimator import RelativeNav
from flightsw.types import NavState, SensorFrame, Vec3

ACC_TAU_S = 20.0  # [s] over which the tanker's modelled acceleration is corrected by its transmitted velocity
AIR_TAU_S = 0.3  # [s] smoothing of the tanker's transmitted flow angles
LIFT_TAU_S = 0.1  # [s] and of its load factor
# the tanker at an instant [18]: attitude (body to navigation, by rows), body rates [rad/s], inertial velocity [m/s, NED]
ATTITUDE, RATE, VELOCITY = slice(0, 9), slice(9, 12), slice(15, 18)
ALPHA, BETA = 0, 1  # of its flow angles
DOWN = 2  # third axis


class AirPath:
    """The frame F at the newest air-data sample."""

    def __init__(self) -> None:
        self.R_tf = np.zeros(9)  # F to tanker body, used with to_parent as body to F
        self.flow = np.zeros(2)  # tanker's alpha, beta, smoothed [rad]
        self.V_T = 200.0  # [m/s] its airspeed
        self.load = 1.0  # [-] its load factor
        self.w_t = np.zeros(3)  # [rad/s] its body rates
        self.att = np.zeros(3)  # [rad] psi, theta, phi of the own body relative to F
        self.omega: Vec3 = (0.0, 0.0, 0.0)  # [rad/s] own body rates
        self.x, self.xd = np.zeros(3), np.zeros(3)  # [m], [m/s] own position and its rate in F
        self.acc: Vec3 = (0.0, 0.0, 0.0)  # [m/s^2] its second rate
        self.swing = np.zeros(3)  # [m/s, F] w_T x xi
        self._wind, self._v_t, self._acc_bias = np.zeros(3), np.zeros(3), np.zeros(3)
        self._have_flow = False
        self._tk, self._R, self._R_rf, self._q = np.zeros(18), np.zeros(9), np.zeros(9), np.zeros(4)
        self._v, self._a, self._rel_acc = np.zeros(3), np.zeros(3), np.zeros(3)

    def to_f(self, v: np.ndarray | Vec3) -> np.ndarray:
        """v [3] in tanker body axes, to F."""
        out = np.zeros(3)
        to_parent(self.R_tf, np.asarray(v, dtype=float), out)
        return out

    @property
    def C_nt(self) -> np.ndarray:
        """NED to tanker body [9] at the sample."""
        return self._tk[ATTITUDE]

    def update(self, f: SensorFrame, rel: RelativeNav, dt: float, gyro: bool) -> None:
        """Everything at the air-data sample of `f`, dt [s] after the last; gyro: `f` has mean rates and accelerations."""
        nav = rel.out
        tk = self._tk
        rel.peer.stage(f.air_t_us, tk)
        if not rel.peer.coasting:
            self._wind[:] = rel.peer.wind
        if self._have_flow and 0.0 < dt < 0.2 and not rel.peer.coasting:
            gap = (tk[VELOCITY] - self._v_t) / dt - rel.peer.acceleration - self._acc_bias
            self._acc_bias += dt / ACC_TAU_S * np.clip(gap, -5.0, 5.0)
        self._v_t[:] = tk[VELOCITY]
        to_child(tk[ATTITUDE], tk[VELOCITY] - self._wind, self._v)
        u, v, w = self._v.tolist()
        s = math.sqrt(u * u + v * v + w * w)
        k = min(dt / AIR_TAU_S, 1.0) if self._have_flow else 1.0
        self._have_flow = True
        self.flow[ALPHA] += k * (math.atan2(w, u) - self.flow[ALPHA])
        self.flow[BETA] += k * (math.asin(max(-1.0, min(1.0, v / max(s, 1.0)))) - self.flow[BETA])
        self.V_T += k * (s - self.V_T)
        self.w_t += k * (tk[RATE] - self.w_t)
        # body = R2(alpha) R3(-beta) F
        dcm_from_euler(-self.flow[BETA], self.flow[ALPHA], 0.0, self.R_tf)
        self._v[:] = rel.peer.acceleration
        self._v[DOWN] -= G0
        to_child(tk[ATTITUDE], self._v, self._a)
        to_parent(self.R_tf, self._a, self._v)
        k = min(dt / LIFT_TAU_S, 1.0)
        self.load += k * (min(max(-float(self._v[DOWN]) / G0, 0.3), 3.0) - self.load)
        self._q[:] = nav.q_nb
        dcm_from_quat(self._q, self._R)
        self._v[:] = f.gyro_mean_b if gyro else nav.w_b
        if gyro:
            self._v += rel.rate_change * f.gyro_age_s
        self.omega = vec3(self._v)
        rotate_dcm(self._R, self._v, (f.air_t_us - nav.t_us) * 1e-6, self._R_rf)
        self._R[:] = self._R_rf
        # own inertial acceleration less the tanker's, to tanker axes, to F
        to_parent(self._R, np.array(f.acc_mean_b if gyro else f.acc_b), self._v)
        self._v[DOWN] += G0
        self._v -= rel.peer.acceleration + self._acc_bias
        to_child(tk[ATTITUDE], self._v, self._a)
        to_parent(self.R_tf, self._a, self._v)
        self._rel_acc = self._v.copy()
        mul33_t(self._R, tk[ATTITUDE], self._R_rf)  # tanker body to own body
        mul33(self._R_rf, self.R_tf, self._R)
        euler_from_dcm(self._R, self.att)
        self._place(nav, f)

    def _place(self, nav: NavState, f: SensorFrame) -> None:
        """Position and rate from the relative estimate carried to the readings; acceleration in turning axes."""
        lead = (f.air_t_us - nav.t_us) * 1e-6
        x = self.to_f(np.array(nav.rel_pos_t) + np.array(nav.rel_vel_t) * lead)
        xd, w = self.to_f(nav.rel_vel_t), self.to_f(self.w_t)
        self.x, self.xd, self.swing = x, xd, cross(w, x)
        # d2(xi)/dt2 in axes turning at w: a - 2 w x v - w x (w x xi)
        self.acc = vec3(self._rel_acc - cross(w, 2.0 * xd + self.swing))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b, both [3]."""
    (ax, ay, az), (bx, by, bz) = a, b
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def across(v: np.ndarray) -> tuple[float, float]:
    """y and z of a vector [3] in F."""
    _, y, z = v.tolist()
    return y, z


def rate_slopes(probes: np.ndarray) -> np.ndarray:
    """[9,3] change of the readings with own body rates: V [m/s], and V times the flow angles, per rad/s; probes [3,3] [m]."""
    x, y, z = probes.T
    o = np.zeros(3)
    rows = [np.stack([o, z, -y], 1), np.stack([-z, o, x], 1), np.stack([y, -x, o], 1)]
    return np.vstack(rows)
