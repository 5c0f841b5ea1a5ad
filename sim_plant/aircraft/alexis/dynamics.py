"""Longitudinal flight of the small UAV ALEXIS in earth axes, nonlinear and linear, with its two servos.

State s [NS] of sim_plant.kernels.layout is not used: this aircraft moves in a vertical plane. State `f` [NF]: speed forward
and up over the ground [m/s], pitch angle [rad], pitch rate [rad/s], height [m]. The linear motion keeps the same state and
works with its deviations. Wind [2]: air moving down, air moving forward (tail wind) [m/s]. Controls [3]: elevator [rad]
(trailing edge down, nose down), throttle setting, flap [rad] (lifts). Equations: Hoffmann and Luckner (2010).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sim_plant.kernels import layout as n
from sim_plant.kernels.jit import jit
from sim_plant.kernels.servo import servo_step

Arr = NDArray[np.float64]

F_VX, F_VUP, F_PITCH, F_RATE, F_HEIGHT, NF = range(6)
W_DOWN, W_TAIL = 0, 1
# parameters: trim speed, gravity, lift and drag per mass, moment per inertia, thrust, which equations, stall incidence [rad]
(A_V, A_G, A_L0, A_LALPHA, A_LRATE, A_LELEV, A_LFLAP, A_D0, A_DALPHA, A_DRATE, A_DELEV, A_DFLAP, A_MRATE,
 A_MALPHA, A_MELEV, A_MFLAP, A_T0, A_TSET, A_LINEAR, A_STALL, NA) = range(21)  # fmt: skip
DROOP, LEFT = (
    0.5,
    0.5,
)  # of the slope of lift beyond the stall, downwards; of the lift by incidence that is left at the least
R_RATE, R_VANE, R_AIRSPEED, R_PITCH, R_HEIGHT, R_GROUND, R_VERTICAL, NR = range(8)


@jit
def stalled(alpha: float, stall: float) -> float:
    """Incidence [rad] whose lift on the straight curve is that at alpha, beyond the stall [rad]. Lift falls with half the slope,
    to half of what it was. Our choice: the source has no stall."""
    return math.copysign(max(stall - DROOP * (abs(alpha) - stall), LEFT * stall), alpha)


@jit
def specific_force(f: Arr, wind: Arr, c: Arr, a: Arr, out: Arr) -> None:
    """out [6] <- aerodynamic + thrust force per mass forward and up [m/s^2] (earth axes), pitch acceleration [rad/s^2], airspeed
    [m/s], incidence [rad], force per mass along body up [m/s^2]; state f [5], wind [2], controls c [3], parameters a [NA]."""
    vx, vup = f[F_VX] - wind[W_TAIL], f[F_VUP] + wind[W_DOWN]
    V = math.sqrt(vx * vx + vup * vup)
    ux, uup = vx / V, vup / V  # unit vector into the air stream
    alpha = f[F_PITCH] - math.atan2(vup, vx)
    v = V / a[A_V]
    r = f[F_RATE]
    lifting, beyond = alpha, 0.0
    if abs(alpha) > a[A_STALL]:
        lifting = stalled(alpha, a[A_STALL])
        beyond = abs(alpha - lifting)
    lift = v * (v * (a[A_L0] + a[A_LALPHA] * lifting + a[A_LELEV] * c[0] + a[A_LFLAP] * c[2]) + a[A_LRATE] * r)
    drag = v * (v * (a[A_D0] + a[A_DALPHA] * alpha + a[A_DELEV] * c[0] + a[A_DFLAP] * c[2]) + a[A_DRATE] * r)
    if beyond > 0.0:  # the force lost across the stream is found along it, as on a plate
        drag += v * v * a[A_LALPHA] * beyond * abs(math.sin(alpha))
    push = a[A_T0] + a[A_TSET] * c[1]
    cp, sp = math.cos(f[F_PITCH]), math.sin(f[F_PITCH])
    out[0] = push * cp - lift * uup - drag * ux
    out[1] = push * sp + lift * ux - drag * uup
    out[2] = v * (v * (a[A_MALPHA] * alpha + a[A_MELEV] * c[0] + a[A_MFLAP] * c[2]) + a[A_MRATE] * r)
    out[3] = V
    out[4] = alpha
    out[5] = out[1] * cp - out[0] * sp


@jit
def linear_force(f: Arr, wind: Arr, c: Arr, a: Arr, out: Arr) -> None:
    """The same six numbers to first order in the deviations from level trim; out[5] is then V times the path's turn rate, plus g.

    With path angle g and speed v both small, forward force is dv/dt + gravity g, up force V dg/dt + gravity.
    """
    V = a[A_V]
    path = f[F_VUP] / V
    dv = (f[F_VX] - V - wind[W_TAIL]) / V
    alpha = f[F_PITCH] - path - wind[W_DOWN] / V
    turn = alpha - (f[F_PITCH] - path)  # what the wind tilts the air stream by, negative down
    lift = a[A_LALPHA] * alpha + a[A_LRATE] * f[F_RATE] + a[A_LELEV] * c[0] + a[A_LFLAP] * c[2] + 2.0 * a[A_L0] * dv
    drag = a[A_DALPHA] * alpha + a[A_DRATE] * f[F_RATE] + a[A_DELEV] * c[0] + a[A_DFLAP] * c[2] + 2.0 * a[A_D0] * dv
    out[0] = a[A_TSET] * c[1] - drag + a[A_L0] * turn  # along the path
    out[1] = a[A_L0] + lift + a[A_T0] * alpha  # across the path: thrust and drag tilt together
    out[2] = a[A_MRATE] * f[F_RATE] + a[A_MALPHA] * alpha + a[A_MELEV] * c[0] + a[A_MFLAP] * c[2]
    out[3] = V * (1.0 + dv)
    out[4] = alpha
    out[5] = out[1]


@jit
def motion(f: Arr, wind: Arr, c: Arr, a: Arr, o: Arr, out: Arr) -> None:
    """out [5] <- rate of change of f [5]; o [6] receives the forces. a[A_LINEAR] > 0.5 chooses the linear equations."""
    if a[A_LINEAR] > 0.5:
        linear_force(f, wind, c, a, o)
        out[F_VX] = o[0] - a[A_G] * f[F_VUP] / a[A_V]
    else:
        specific_force(f, wind, c, a, o)
        out[F_VX] = o[0]
    out[F_VUP] = o[1] - a[A_G]
    out[F_PITCH] = f[F_RATE]
    out[F_RATE] = o[2]
    out[F_HEIGHT] = f[F_VUP]


@jit
def readings(f: Arr, wind: Arr, c: Arr, a: Arr, o: Arr, out: Arr) -> None:
    """out [7] <- what perfect instruments read: pitch rate, incidence, airspeed, pitch, height, ground speed, a_z (upward
    specific force less g, body axes)."""
    if a[A_LINEAR] > 0.5:
        linear_force(f, wind, c, a, o)
    else:
        specific_force(f, wind, c, a, o)
    out[R_RATE], out[R_VANE], out[R_AIRSPEED] = f[F_RATE], o[4], o[3]
    out[R_PITCH], out[R_HEIGHT], out[R_GROUND] = f[F_PITCH], f[F_HEIGHT], f[F_VX]
    out[R_VERTICAL] = o[5] - a[A_G]


@jit
def advance(
    f: Arr, s: Arr, servo: Arr, sc: Arr, command: Arr, direct: bool, wind: Arr, kick: Arr, a: Arr, h: float, W: Arr,
    vertical: Arr,
) -> None:  # fmt: skip
    """Advance f [5] and the servos by kick.shape[0] ticks of h [s], in place.

    s, sc, servo: state, command and parameter vectors of sim_plant.kernels.servo (first slot elevator, second flap), unused if
    `direct` (the surfaces are where the command [3] says). wind [ticks+1,2] at the ticks, linear between; kick [ticks,5] is
    added after every tick (process noise). vertical [ticks]: a_z at the beginning of each tick. W [8,7] workspace.
    """
    c, mid, r = W[5], W[6], W[7]
    sc[n.C_SURF], sc[n.C_SURF + 1] = command[0], command[2]
    c[1] = command[1]
    for k in range(kick.shape[0]):
        if direct:
            c[0], c[2] = command[0], command[2]
        else:
            c[0], c[2] = s[n.S_SURF], s[n.S_SURF + 1]
        readings(f, wind[k], c, a, W[4], W[0])
        vertical[k] = W[4, 5] - a[A_G]
        if not direct:
            servo_step(s, sc, servo, h)
            c[0], c[2] = 0.5 * (c[0] + s[n.S_SURF]), 0.5 * (c[2] + s[n.S_SURF + 1])
        for i in range(2):
            mid[i] = 0.5 * (wind[k, i] + wind[k + 1, i])
        motion(f, wind[k], c, a, W[4], W[0])
        for i in range(NF):
            r[i] = f[i] + 0.5 * h * W[0, i]
        motion(r, mid, c, a, W[4], W[1])
        for i in range(NF):
            r[i] = f[i] + 0.5 * h * W[1, i]
        motion(r, mid, c, a, W[4], W[2])
        for i in range(NF):
            r[i] = f[i] + h * W[2, i]
        motion(r, wind[k + 1], c, a, W[4], W[3])
        for i in range(NF):
            f[i] += h / 6.0 * (W[0, i] + 2.0 * W[1, i] + 2.0 * W[2, i] + W[3, i]) + kick[k, i]
