"""Truth of a meeting: the receiver's stochastic motion, the range an air-to-air TACAN gives, the kinematic tanker.

Axes: x from the control point to where the receiver comes from, y to the left of x seen from above, heading and bank
counter-clockwise (left) positive; SI units. Receiver and TACAN: Rivard (1982), section III. Noise is discretised exactly,
for steps of any length; the caller supplies unit normals, so the kernels hold no generator.
"""

from __future__ import annotations

import math

import numpy as np

from sim_plant.kernels.jit import jit

# receiver state s [8]
S_X, S_VC, S_VF, S_Y, S_VY, S_AE, S_B, S_N = 0, 1, 2, 3, 4, 5, 6, 7

# parameters p of receiver and TACAN
P_U = 0  # along-track ground velocity of a receiver without deviation [m/s], negative
P_SC, P_SF, P_TF = 1, 2, 3  # constant and fluctuating velocity sigma [m/s], correlation time [s]
P_SY0, P_SVY, P_QY = 4, 5, 6  # lateral sigma [m], drift sigma [m/s], random walk [m^2/s]
P_A0, P_SA, P_RE = 7, 8, 9  # altitude separation, its sigma, earth radius [m]
P_SB, P_SN, P_TN = 10, 11, 12  # constant and correlated range error [m], correlation time [s]
P_X0 = 13  # first position of the receiver [m]
# manoeuvre: start [s], heading change [rad] (left positive), rate [rad/s], airspeed change [m/s], acceleration [m/s^2],
# airspeed [m/s]
P_MT, P_MA, P_MR, P_MV, P_MD, P_VR = 14, 15, 16, 17, 18, 19
P_N = 20

# tanker state c [5]: x, y [m], heading [rad] (unwrapped), bank [rad], airspeed [m/s]
C_X, C_Y, C_PSI, C_PHI, C_V = 0, 1, 2, 3, 4
# tanker parameters q: wind [m/s], roll rate [rad/s] (0: at once), acceleration [m/s^2], bank error [rad], speed error [m/s],
# gravity
Q_WX, Q_WY, Q_ROLL, Q_ACC, Q_BANK, Q_SPEED, Q_G = 0, 1, 2, 3, 4, 5, 6
Q_N = 7


@jit
def receiver_start(z: np.ndarray, p: np.ndarray, s: np.ndarray) -> None:
    """s [8] <- a receiver of this population, from unit normals z [7]."""
    s[S_X] = p[P_X0]
    s[S_VC] = p[P_SC] * z[0]
    s[S_VF] = p[P_SF] * z[1]
    s[S_Y] = p[P_SY0] * z[2]
    s[S_VY] = p[P_SVY] * z[3]
    s[S_AE] = p[P_SA] * z[4]
    s[S_B] = p[P_SB] * z[5]
    s[S_N] = p[P_SN] * z[6]


@jit
def discrete(dt: float, p: np.ndarray, D: np.ndarray) -> None:
    """D [8] <- exact discretisation over dt [s]: v_xf decay, x per v_xf, v_xf noise, x per that, x, y noise, n decay, noise.

    The velocity's noise is sigma sqrt(1 - a^2) z1; the displacement follows it with slope tau tanh(dt/2tau) and keeps the
    variance 2 sigma^2 tau (dt - 2 tau tanh(dt/2tau)) of its own.
    """
    tau, sigma = p[P_TF], p[P_SF]
    h = 0.5 * dt / tau
    th = math.tanh(h)
    # h - tanh h, by its series while the difference would cancel
    if h < 0.03:
        k = h * h
        gap = h * k * (1.0 / 3.0 + k * (-2.0 / 15.0 + k * (17.0 / 315.0 - k * 62.0 / 2835.0)))
    else:
        gap = h - th
    D[0] = math.exp(-2.0 * h)
    D[1] = -tau * math.expm1(-2.0 * h)
    D[2] = sigma * math.sqrt(-math.expm1(-4.0 * h))
    D[3] = tau * th
    D[4] = 2.0 * sigma * tau * math.sqrt(gap)
    D[5] = math.sqrt(p[P_QY] * dt)
    D[6] = math.exp(-dt / p[P_TN])
    D[7] = p[P_SN] * math.sqrt(-math.expm1(-2.0 * dt / p[P_TN]))


@jit
def _manoeuvre(t: float, p: np.ndarray, d: np.ndarray) -> None:
    """d [2] <- displacement at time t [s] that the receiver's manoeuvre adds: one turn, one change of speed."""
    d[0] = d[1] = 0.0
    dt = t - p[P_MT]
    if dt <= 0.0:
        return
    if p[P_MV] != 0.0:
        ramp = abs(p[P_MV]) / p[P_MD]
        d[0] -= p[P_MV] * (0.5 * dt * dt / ramp if dt < ramp else dt - 0.5 * ramp)
    if p[P_MA] != 0.0:
        w = math.copysign(p[P_MR], p[P_MA])
        end = p[P_MA] / w
        b = dt if dt < end else end
        # nominal course is -x; a left turn by a goes to (-cos a, -sin a)
        d[0] += p[P_VR] * (b - math.sin(w * b) / w)
        d[1] -= p[P_VR] * (1.0 - math.cos(w * b)) / w
        if dt > end:
            d[0] += p[P_VR] * (1.0 - math.cos(p[P_MA])) * (dt - end)
            d[1] -= p[P_VR] * math.sin(p[P_MA]) * (dt - end)


@jit
def manoeuvre_velocity(t: float, p: np.ndarray, v: np.ndarray) -> None:
    """v [2] <- velocity [m/s] at time t [s] that the receiver's manoeuvre adds: the rate of `_manoeuvre`."""
    v[0] = v[1] = 0.0
    dt = t - p[P_MT]
    if dt <= 0.0:
        return
    if p[P_MV] != 0.0:
        v[0] -= math.copysign(min(p[P_MD] * dt, abs(p[P_MV])), p[P_MV])
    if p[P_MA] != 0.0:
        turned = math.copysign(min(p[P_MR] * dt, abs(p[P_MA])), p[P_MA])
        v[0] += p[P_VR] * (1.0 - math.cos(turned))
        v[1] -= p[P_VR] * math.sin(turned)


@jit
def receiver_step(s: np.ndarray, t: float, dt: float, z: np.ndarray, at: int, p: np.ndarray, wk: np.ndarray) -> None:
    """Move the receiver and the TACAN's errors s [8] from t [s] by dt [s] with the unit normals z[at] to z[at + 3].

    wk [13] scratch; wk[12] is the step its discretisation belongs to: set it to 0 when p changes.
    """
    if dt <= 0.0:
        return
    if wk[12] != dt:
        discrete(dt, p, wk)
        wk[12] = dt
    e = wk[2] * z[at]
    s[S_X] += (p[P_U] + s[S_VC]) * dt + wk[1] * s[S_VF] + wk[3] * e + wk[4] * z[at + 1]
    s[S_VF] = wk[0] * s[S_VF] + e
    s[S_Y] += s[S_VY] * dt + wk[5] * z[at + 2]
    s[S_N] = wk[6] * s[S_N] + wk[7] * z[at + 3]
    if p[P_MV] != 0.0 or p[P_MA] != 0.0:
        _manoeuvre(t, p, wk[8:10])
        _manoeuvre(t + dt, p, wk[10:12])
        s[S_X] += wk[10] - wk[8]
        s[S_Y] += wk[11] - wk[9]


@jit
def tacan_range(s: np.ndarray, x_t: float, y_t: float, p: np.ndarray) -> float:
    """Slant range [m] the set on a tanker at (x_t, y_t) [m] shows: true distance over the curved earth, plus its errors."""
    dx, dy = s[S_X] - x_t, s[S_Y] - y_t
    h2 = dx * dx + dy * dy
    k = math.sin(0.5 * math.sqrt(h2) / p[P_RE])
    a = p[P_A0] + s[S_AE] + 2.0 * p[P_RE] * k * k
    return math.sqrt(h2 + a * a) + s[S_B] + s[S_N]


@jit
def tacan_bearing(s: np.ndarray, x_t: float, y_t: float) -> float:
    """Line of sight [rad] from a tanker at (x_t, y_t) [m] to the receiver, counter-clockwise from +x, without error."""
    return math.atan2(s[S_Y] - y_t, s[S_X] - x_t)


@jit
def tanker_step(c: np.ndarray, bank: float, speed: float, dt: float, q: np.ndarray) -> None:
    """Fly the kinematic tanker c [5] for dt [s] towards commanded bank [rad] and airspeed [m/s]; wind in q [7].

    Constant bank and speed is a circular arc, taken as one chord of length v dt sinc(turn/2) at the mean heading; while
    either changes the step is cut to 0.05 s.
    """
    left = dt
    goal, fast = bank + q[Q_BANK], speed + q[Q_SPEED]
    if q[Q_ROLL] <= 0.0:
        c[C_PHI] = goal
    while left > 0.0:
        steady = c[C_PHI] == goal and c[C_V] == fast
        h = left if steady else min(left, 0.05)
        phi0, v0 = c[C_PHI], c[C_V]
        if phi0 != goal:
            most = q[Q_ROLL] * h
            c[C_PHI] = goal if abs(goal - phi0) <= most else phi0 + math.copysign(most, goal - phi0)
        if v0 != fast:
            most = q[Q_ACC] * h
            c[C_V] = fast if abs(fast - v0) <= most else v0 + math.copysign(most, fast - v0)
        v = 0.5 * (v0 + c[C_V])
        if steady:
            mean = math.tan(phi0) if phi0 != 0.0 else 0.0
        else:
            mean = 0.5 * (math.tan(phi0) + math.tan(c[C_PHI]))
        turn = q[Q_G] * mean / v * h
        half = 0.5 * turn
        chord = v * h * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        c[C_X] += chord * math.cos(c[C_PSI] + half) + q[Q_WX] * h
        c[C_Y] += chord * math.sin(c[C_PSI] + half) + q[Q_WY] * h
        c[C_PSI] += turn
        left -= h
