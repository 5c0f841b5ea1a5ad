"""Rows of the relative sensor's reading and of the boom's, each in one call (readings.py)."""

from __future__ import annotations

import numpy as np

from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import dcm_from_quat, mul33_t, to_parent
from flightsw.missions.receiver.integrity.layout import B_AT, B_D, B_OB, B_RC, B_RS, B_RV, B_U
from flightsw.missions.receiver.tanker_link import carried
from flightsw.sixdof.layout import TK_DCM, TK_P, TK_Q, TK_R

# of what a latched boom is reckoned from: pivot and lever [3] m, attitude quaternion [4] of the receiver, and room for what is
# worked out of them, attitude [9], turn from the tanker [9], lever in the tanker's axes [3]
PIVOT, LEVER, QUAT, ATT, TURN, ARM, LATCHED = 0, 3, 6, 10, 19, 28, 31


@jit
def in_tanker_axes(tk: np.ndarray, dx: float, dy: float, dz: float, H: np.ndarray) -> tuple[float, float, float]:
    """First three rows of H [>=3,n] <- the position in tanker axes by the attitude C of tk [18], xi = C d - (C d) x a; C d."""
    x = tk[0] * dx + tk[1] * dy + tk[2] * dz
    y = tk[3] * dx + tk[4] * dy + tk[5] * dz
    z = tk[6] * dx + tk[7] * dy + tk[8] * dz
    for i in range(3):
        for j in range(3):
            H[i, B_D + j] = tk[3 * i + j]
    H[0, B_AT], H[0, B_AT + 1], H[0, B_AT + 2] = -0.0, z, -y
    H[1, B_AT], H[1, B_AT + 1], H[1, B_AT + 2] = -z, -0.0, x
    H[2, B_AT], H[2, B_AT + 1], H[2, B_AT + 2] = y, -x, -0.0
    return x, y, z


@jit
def relative(
    R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float, dx: float, dy: float, dz: float,
    px: float, py: float, pz: float, vx: float, vy: float, vz: float, pos2: float, vel2: float, rate2: float,
    tk: np.ndarray, H: np.ndarray, y: np.ndarray, r: np.ndarray,
) -> None:  # fmt: skip
    """H [6,n], which is zero, y, r [6] <- rows of the relative position (px, py, pz) [m] and velocity (vx, vy, vz) [m/s].

    R, w, v, a, dt as `carried`, which gives tk [18]; (dx, dy, dz) [m] NED: where the receiver is, near enough for what turns with
    it; variances of noise pos2 [m^2], vel2 [m^2/s^2] and of the tanker's rates rate2 [rad^2/s^2].
    """
    carried(R, w, v, a, dt, tk)
    x0, x1, x2 = in_tanker_axes(tk, dx, dy, dz, H)
    for i in range(3):
        H[i, B_RS + i] = H[i, B_RC + i] = H[3 + i, B_RV + i] = 1.0
        for j in range(3):
            H[3 + i, B_U + j] = tk[3 * i + j]
    p, q, s = tk[TK_P], tk[TK_Q], tk[TK_R]
    y[0], y[1], y[2] = px, py, pz
    y[3], y[4], y[5] = vx + (q * x2 - s * x1), vy + (s * x0 - p * x2), vz + (p * x1 - q * x0)
    far2 = x0 * x0 + x1 * x1 + x2 * x2
    r[0] = r[1] = r[2] = pos2
    r[3] = r[4] = r[5] = vel2 + rate2 * far2


@jit
def latched(
    R: np.ndarray, w: np.ndarray, v: np.ndarray, a: np.ndarray, dt: float, dx: float, dy: float, dz: float,
    x: float, y: float, z: float, noise2: float, s: np.ndarray, tk: np.ndarray, H: np.ndarray, out: np.ndarray, r: np.ndarray,
) -> None:  # fmt: skip
    """H [>=3,n], which is zero, out, r [>=3] <- rows of a boom (x, y, z) [m] long in the tanker's axes, with noise2 [m^2].

    R, w, v, a, dt, (dx, dy, dz), tk as `relative`; s [LATCHED]: pivot, lever and attitude, the rest is written.
    """
    carried(R, w, v, a, dt, tk)
    in_tanker_axes(tk, dx, dy, dz, H)
    dcm_from_quat(s[QUAT:ATT], s[ATT:TURN])
    mul33_t(s[ATT:TURN], tk[TK_DCM], s[TURN:ARM])
    to_parent(s[TURN:ARM], s[LEVER:QUAT], s[ARM:])
    for i, along in enumerate((x, y, z)):
        H[i, B_OB + i] = 1.0
        out[i] = s[PIVOT + i] + along - s[ARM + i]
        r[i] = noise2
