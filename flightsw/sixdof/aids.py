"""Aids of an aircraft's own sensors as compiled kernels: each function queues the rows of one sensor for the coming correction.

What a step is given comes packed in one array (`own_sensors`). A reading is carried from its sample time to now with the
modelled rates of change. Rows are told apart by sensor (refusal.py), which is how a sensor is judged, kept out and reported:
`TrustedCore.aids` has a status for each.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw import refusal as rd
from flightsw.kernels.jit import jit
from flightsw.kernels.rotations import wrap_pi
from flightsw.sixdof.estimator_core import R_ALPHA, R_BETA, R_EULER, R_POS, R_RATE, R_V
from flightsw.sixdof.gating import TrustedCore
from flightsw.sixdof.layout import M_ALPHA, M_BETA, M_EULER, M_POS, M_RATE, M_V, X_ALPHA, X_BETA, X_P, X_PSI, X_V, X_X
from flightsw.sixdof.measure import average_probes
from flightsw.types import UPD_AIR, UPD_ATT, UPD_GNSS, UPD_IMU, SensorFrame

# inputs of a step: its length [s] and the root of that, 1-sigma of the wind's increment [m/s], time now [us], which sensors are
# taken (a mask of the bits below), whether the gate refuses nothing for now
DT, RT, QW, NOW, USE, TAKING = range(6)
# ages [s]; how many samples the gyro's mean [rad/s] is of; what the gate alone is told of attitude [rad], position [m]; 1-sigma
# of the velocity [m/s]
AIR_AGE, GYRO_N, GYRO_AGE, GYRO = 6, 7, 8, 9
ATT_AGE, ATT_SLACK, ATT = 12, 13, 14
GNSS_AGE, POS_SLACK, VEL_SIGMA, GNSS_POS, GNSS_VEL = 18, 19, 20, 21, 24
PROBES = 27  # V [m/s], alpha, beta [rad] of every probe, then 1 for those that are good in all three

USE_AIR, USE_GYRO, USE_ATT, USE_POS, USE_VEL = 1, 2, 4, 8, 16


def own_sensors(
    c: TrustedCore, f: SensorFrame, updated: int, dt: float, sigma: float, peer_att: float = 0.0, more: int = 0
) -> tuple[float, ...]:
    """Inputs [PROBES + 4 probes] of a step of dt [s] from frame f, of which `updated` (UPD_*) is new and sound. sigma [m/s]: of
    GNSS velocity; peer_att [rad]: of the attitude that the own one is taken relative to; more: bits of others' for the mask."""
    p, t = c.p, f.t_us
    use = more | USE_AIR if updated & UPD_AIR else more
    if updated & UPD_IMU and f.gyro_count:
        use |= USE_GYRO
    if updated & UPD_ATT:
        use |= USE_ATT
    if updated & UPD_GNSS:
        use |= USE_POS | USE_VEL if p.velocity else USE_POS
    rt = dt**0.5 if dt > 0.0 else 0.0
    return (
        dt, rt, p.q_wind * rt, t, use, c.taking,
        (t - f.air_t_us) * 1e-6, f.gyro_count, f.gyro_age_s, *f.gyro_mean_b,
        (t - f.att_t_us) * 1e-6, math.hypot(c.drift(rd.ATT, p.bias_gyro), peer_att), *f.att_q_nb,
        (t - f.gnss_t_us) * 1e-6, c.drift(rd.GNSS_POS, p.bias_vel), sigma,
        *f.gnss_pos_n, *f.gnss_vel_n, *c.readings_of_probes(f),
    )  # fmt: skip


ROW_V, ROW_BETA, ROW_ALPHA = range(3)  # of the air data, first of all rows


@jit
def averaged(s: np.ndarray, pos: np.ndarray, w: np.ndarray, air: np.ndarray) -> int:
    """air [3] <- as average_probes, of the inputs s [PROBES + 4 k]; pos [k,3], w [3] as there; how many probes."""
    k = pos.shape[0]
    i, j, n = PROBES + k, PROBES + 2 * k, PROBES + 3 * k
    return average_probes(s[PROBES:i], s[i:j], s[j:n], s[n : n + k], pos, w, air)


@jit
def air_data(
    s: np.ndarray, tune: np.ndarray, n: int, air: np.ndarray, d: np.ndarray,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> int:  # fmt: skip
    """Air data [3] averaged over n probes, as the first rows of codes, y, r, group, slack (EstimatorCore.rows); s inputs, tune
    [8] of the core, d [15] rates of the state. Returns how many rows there are, as all of these do."""
    age, share = s[AIR_AGE], 1.0 / math.sqrt(n)
    codes[ROW_V], codes[ROW_BETA], codes[ROW_ALPHA] = M_V, M_BETA, M_ALPHA
    group[ROW_V], group[ROW_BETA], group[ROW_ALPHA] = rd.V, rd.BETA, rd.ALPHA
    y[ROW_V] = air[ROW_V] + d[X_V] * age
    y[ROW_BETA] = air[ROW_BETA] + d[X_BETA] * age
    y[ROW_ALPHA] = air[ROW_ALPHA] + d[X_ALPHA] * age
    r[ROW_V], r[ROW_BETA], r[ROW_ALPHA] = tune[R_V] * share, tune[R_BETA] * share, tune[R_ALPHA] * share
    slack[ROW_V] = slack[ROW_BETA] = slack[ROW_ALPHA] = 0.0
    return 3


@jit
def gyro(
    s: np.ndarray, tune: np.ndarray, d: np.ndarray, m: int,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> int:  # fmt: skip
    """Mean gyro reading, from the middle of its window, from row m on."""
    sigma = tune[R_RATE] / math.sqrt(s[GYRO_N])
    for i in range(3):
        codes[m], group[m] = M_RATE + i, rd.GYRO
        y[m], r[m], slack[m] = s[GYRO + i] + d[X_P + i] * s[GYRO_AGE], sigma, 0.0
        m += 1
    return m


@jit
def attitude(
    s: np.ndarray, tune: np.ndarray, e: np.ndarray, x: np.ndarray, d: np.ndarray, m: int,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> int:  # fmt: skip
    """Angles e [3] of the attitude reference about the state x [15]."""
    for i in range(3):
        # the measured angle is brought near the state: psi stays unwrapped, only the innovation is wrapped
        near = x[X_PSI + i]
        codes[m], group[m] = M_EULER + i, rd.ATT
        y[m] = near + wrap_pi(e[i] + d[X_PSI + i] * s[ATT_AGE] - near)
        r[m], slack[m] = tune[R_EULER], s[ATT_SLACK]
        m += 1
    return m


@jit
def gnss_position(
    s: np.ndarray, tune: np.ndarray, d: np.ndarray, m: int,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> int:  # fmt: skip
    """Own position NED."""
    for i in range(3):
        codes[m], group[m] = M_POS + i, rd.GNSS_POS
        y[m], r[m], slack[m] = s[GNSS_POS + i] + d[X_X + i] * s[GNSS_AGE], tune[R_POS], s[POS_SLACK]
        m += 1
    return m


@jit
def gnss_velocity(
    s: np.ndarray, code: int, acc: np.ndarray, m: int,
    codes: np.ndarray, y: np.ndarray, r: np.ndarray, group: np.ndarray, slack: np.ndarray,
) -> int:  # fmt: skip
    """Own inertial velocity NED, measurement codes from `code`; acc [3] modelled acceleration [m/s^2]."""
    for i in range(3):
        codes[m], group[m] = code + i, rd.GNSS_VEL
        y[m], r[m], slack[m] = s[GNSS_VEL + i] + acc[i] * s[GNSS_AGE], s[VEL_SIGMA], 0.0
        m += 1
    return m
