"""Many rendezvous, compiled: the plant's truth kernels and the onboard kernels joined by one event loop.

The loop runs measurement, delivery, guidance and phase events at their exact times; truth is moved to the instants a range
is taken and to the roll-out. It releases the interpreter lock, so blocks of rendezvous run in threads; each rendezvous reads
its own rows of normals and nothing else, so the split over threads does not matter. All compiled callees live in modules the
kernel cache watches.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous import turn_law as kg
from flightsw.missions.rendezvous.frame import E_VX, E_VY, E_X, E_Y
from sim_plant.couplings import traffic_kernel as tr

jit = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True)

ahead3, ekf3_start, ekf3_predict = k3.ahead, k3.ekf3_start, k3.ekf3_predict
ekf3_range, ekf3_bearing, ekf3_position, window_push = (
    k3.ekf3_range,
    k3.ekf3_bearing,
    k3.ekf3_position,
    k3.window_push,
)

E_OF = (E_Y, E_VX, E_X)  # where the states of the three-state filter stand in the estimate

# schedule sp
(
    SP_MEAS,  # [s] between ranges
    SP_GUID,  # [s] between guidance steps; 0: after each update
    SP_EXACT,  # 1: the turn starts when due (rule A), 0: at a guidance step (rule B)
    SP_TMAX,
    SP_KIND,  # 0 truth, 1 three-state filter, 2 full order linearised, 3 by quadrature
    SP_TRUE,  # 1: guidance reads the truth although a filter runs
    SP_BEARING,  # [rad] sigma of a bearing, 0: none
    SP_LINK,  # [m] sigma of the data-linked position, 0: none
    SP_PSI0,
    SP_Y0,
    SP_YHAT,
    SP_SIGY,
    SP_SHIFT,
    SP_DROP,  # a range is lost when its normal is below this
    SP_OUT0,  # outage from, to [s]
    SP_OUT1,
    SP_LATENCY,  # [s]
    SP_STAMPED,  # 1: the software knows the time of validity
    SP_GATE,
    SP_VT,  # airspeed of the tanker [m/s], the wind the software believes [m/s], airspeed of the receiver [m/s]
    SP_WX,
    SP_WY,
    SP_VR,
    SP_WIND_ERR,  # [m/s] sigma of the error of that wind
    SP_BANK_ERR,  # [rad]
    SP_SPEED_ERR,  # [m/s]
    SP_SPAN,  # half width of the bank in sigma
) = range(27)
SP_N = 27

# result row; R_DONE: 1 finished, 0 out of time, -1 out of normals
R_DONE, R_TIME, R_XM, R_YM, R_TURN, R_ALARM, R_REFUSED, R_SPEED, R_BANK = range(9)
R_N = 9
# sample row: errors of x, v_x, y; their sigma; NEES/3; 1 when taken
Q_N = 8

_LATE = 1e-9


@jit
def nees3(e0: float, e1: float, e2: float, P: np.ndarray) -> float:
    """e^T P^-1 e of (x, v_x, y) with the leading covariance P [>=3, >=3], by cofactors."""
    a, b, c, d, f, g = P[0, 0], P[0, 1], P[0, 2], P[1, 1], P[1, 2], P[2, 2]
    A, B, C = d * g - f * f, c * f - b * g, b * f - c * d
    det = a * A + b * B + c * C
    D, E, F = a * g - c * c, b * c - a * f, a * d - b * b
    return (e0 * (A * e0 + B * e1 + C * e2) + e1 * (B * e0 + D * e1 + E * e2) + e2 * (C * e0 + E * e1 + F * e2)) / det


@jit
def fly(
    W: np.ndarray,
    Z: np.ndarray,
    V: np.ndarray,
    p: np.ndarray,
    q0: np.ndarray,
    sp: np.ndarray,
    e30: np.ndarray,
    e80: np.ndarray,
    gp: np.ndarray,
    M: int,
    window0: np.ndarray,
    times: np.ndarray,
    out: np.ndarray,
    samples: np.ndarray,
    states: np.ndarray,
) -> None:
    """Fly out.shape[0] rendezvous. W [n, 8 + 4 steps], Z [n, 4 steps], V [n, 4] unit normals of receiver, sensors and tanker.

    p [20], q0 [7] truth of receiver and tanker; sp [27] schedule; e30, e80, gp, window0 onboard parameters; M components.
    out [n, 9]; samples [n, times or 0, 8] just after the update at each time; states [n, times, 16]: estimate of v_xc v_xf
    v_yc a_e b (0 for the three-state filter), their true values and the predicted sigma.
    """
    m, P, lw = np.zeros((M, 8)), np.zeros((M, 8, 8)), np.zeros(M)
    wk, k, nu, D = np.zeros((M, k8.H_SIZE)), np.zeros(8), np.zeros(2), np.zeros(k8.D_SIZE)
    mean8, C8, r4, P4 = np.zeros(8), np.zeros((8, 8)), np.zeros(4), np.zeros((4, 4))
    x3, P3, s, c, t4 = np.zeros(k3.S3_N), np.zeros((k3.S3_N, k3.S3_N)), np.zeros(8), np.zeros(5), np.zeros(13)
    o, gs, turn, radii, v2 = np.zeros(8), np.zeros(kg.G_N), np.zeros(9), np.zeros(2), np.zeros(2)
    e3, e8, q, w = e30.copy(), e80.copy(), q0.copy(), window0.copy()
    mdt, gdt, kind, tmax = sp[SP_MEAS], sp[SP_GUID], int(sp[SP_KIND]), sp[SP_TMAX]
    roll, lat, stamped = q0[tr.Q_ROLL], sp[SP_LATENCY], sp[SP_STAMPED] > 0.0
    steps = (W.shape[1] - 8) // 4
    sensors = Z.shape[1] > 0
    for run in range(out.shape[0]):
        tr.receiver_start(W[run], p, s)
        o[5] = sp[SP_WX] + sp[SP_WIND_ERR] * V[run, 0]
        o[6] = sp[SP_WY] + sp[SP_WIND_ERR] * V[run, 1]
        o[7] = math.asin(o[6] / sp[SP_VT])
        e3[k3.E3_U] = e8[k8.E8_U] = -sp[SP_VR] * math.cos(math.asin(o[6] / sp[SP_VR])) + o[5]
        q[tr.Q_BANK], q[tr.Q_SPEED] = sp[SP_BANK_ERR] * V[run, 2], sp[SP_SPEED_ERR] * V[run, 3]
        kg.guidance_reset(gs, gp)
        c[0], c[1], c[2], c[3], c[4] = 0.0, sp[SP_Y0], sp[SP_PSI0], 0.0, gp[kg.GP_V]
        for j in range(w.shape[0]):
            w[j] = window0[j]
        t, t_true, t_f, t_g, te = 0.0, 0.0, 0.0, 0.0, math.inf
        i_meas, i_guid, i_draw, i_q = 0, 0, 0, 0
        t_arrive, own_x, own_y, z_r, z_b, z_x, z_y = math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        shown, started, lost = math.inf, False, False
        for j in range(R_N):
            out[run, j] = math.nan
        out[run, R_DONE], out[run, R_REFUSED] = 0.0, 0.0
        while True:
            tm = mdt * i_meas
            tg = gdt * i_guid if gdt > 0.0 else math.inf
            tn = min(min(tm, tg), min(te, t_arrive))
            if tn > tmax:
                break
            if i_draw >= steps - 1:
                out[run, R_DONE] = -1.0
                break
            tr.tanker_step(c, gs[kg.G_BANK], gs[kg.G_V], tn - t, q)
            t = tn
            due = False
            if t >= tm:
                tr.receiver_step(s, t_true, t - t_true, W[run], 8 + 4 * i_draw, p, t4)
                t_true = t
                lost = sensors and i_meas > 0 and Z[run, 4 * i_draw + 3] < sp[SP_DROP]
                lost = lost or sp[SP_OUT0] <= t < sp[SP_OUT1]
                own_x, own_y = c[0], c[1]
                z_r = tr.tacan_range(s, own_x, own_y, p)
                if sp[SP_BEARING] > 0.0:
                    z_b = tr.tacan_bearing(s, own_x, own_y) + sp[SP_BEARING] * Z[run, 4 * i_draw]
                if sp[SP_LINK] > 0.0:
                    z_x = s[0] + sp[SP_LINK] * Z[run, 4 * i_draw + 1]
                    z_y = s[3] + sp[SP_LINK] * Z[run, 4 * i_draw + 2]
                i_draw += 1
                i_meas += 1
                t_arrive = t + lat if started else t
            if t >= t_arrive:
                t_arrive = math.inf
                t_z = t_true if stamped else t
                if not stamped:
                    own_x, own_y = c[0], c[1]
                if not started:
                    if kind == 1:
                        ekf3_start(x3, P3, z_r, own_x, own_y, sp[SP_YHAT], sp[SP_SIGY], e3)
                    elif kind > 1:
                        kb.bank_start(
                            m, P, lw, z_r, own_x, own_y, sp[SP_YHAT], sp[SP_SIGY], sp[SP_SPAN], sp[SP_SHIFT], e8
                        )
                    started = True
                elif kind > 0:
                    if kind == 1:
                        ekf3_predict(x3, P3, t_z - t_f, e3)
                    else:
                        kb.bank_predict(m, P, lw, t_z - t_f, e8, D)
                    if not lost:
                        if kind == 1:
                            used = ekf3_range(x3, P3, z_r, own_x, own_y, sp[SP_GATE], e3, nu)
                        else:
                            used = kb.bank_range(m, P, lw, z_r, own_x, own_y, kind == 3, sp[SP_GATE], e8, wk, k, nu)
                        window_push(w, nu[k3.NU] / math.sqrt(nu[k3.NU_VAR]))
                        if not used:
                            out[run, R_REFUSED] += 1.0
                        if w[k3.W_ALARM] > 0.0 and math.isnan(out[run, R_ALARM]):
                            out[run, R_ALARM] = t
                if kind > 0 and not lost:
                    if sp[SP_BEARING] > 0.0:
                        R = sp[SP_BEARING] * sp[SP_BEARING]
                        if kind == 1:
                            ekf3_bearing(x3, P3, z_b, own_x, own_y, R, nu)
                        else:
                            kb.bank_bearing(m, P, lw, z_b, own_x, own_y, R, 0.0, wk, k, nu)
                    if sp[SP_LINK] > 0.0:
                        R = sp[SP_LINK] * sp[SP_LINK]
                        if kind == 1:
                            ekf3_position(x3, P3, z_x, z_y, R, nu)
                        else:
                            kb.bank_position(m, P, lw, z_x, z_y, R, wk, k, nu)
                t_f = t_z
                if not lost:
                    shown = z_r
                if kind > 1:
                    kb.bank_mean(m, lw, mean8)
                if kind > 0 and i_q < samples.shape[1] and t >= times[i_q] - _LATE:
                    if kind == 1:
                        r4[E_X], r4[E_VX], r4[E_Y] = x3[k3.S3_X], e3[k3.E3_U] + x3[k3.S3_V], x3[k3.S3_Y]
                        for a in range(3):
                            for b in range(3):
                                P4[E_OF[a], E_OF[b]] = P3[a, b]
                    else:
                        kb.bank_match(m, P, lw, mean8, C8)
                        kb.reduce_four(mean8, C8, e8[k8.E8_U], r4, P4)
                        for j in range(5):
                            i = (1, 2, 4, 5, 6)[j]
                            states[run, i_q, j], states[run, i_q, 5 + j] = mean8[i], s[i]
                            states[run, i_q, 10 + j] = math.sqrt(C8[i, i])
                    e0, e1, e2 = s[0] - r4[0], p[tr.P_U] + s[1] + s[2] - r4[1], s[3] - r4[2]
                    row = samples[run, i_q]
                    row[0], row[1], row[2] = e0, e1, e2
                    row[3], row[4], row[5] = math.sqrt(P4[0, 0]), math.sqrt(P4[1, 1]), math.sqrt(P4[2, 2])
                    row[6] = nees3(e0, e1, e2, P4) / 3.0
                    row[7] = 1.0
                    i_q += 1
                due = gdt == 0.0
            if t >= tg:
                i_guid += 1
                due = True
            if t >= te:
                due = True
            if not (due and started):
                continue
            # the estimate at the present
            if kind == 0 or sp[SP_TRUE] > 0.0:
                tr.manoeuvre_velocity(t_true, p, v2)
                v, vy = p[tr.P_U] + s[1] + s[2] + v2[0], s[4] + v2[1]
                r4[0], r4[1], r4[2], r4[3] = s[0] + v * (t - t_true), v, s[3] + vy * (t - t_true), vy
            elif kind == 1:
                v = e3[k3.E3_U] + x3[k3.S3_V]
                r4[E_X], r4[E_VX], r4[E_Y], r4[E_VY] = x3[k3.S3_X] + v * (t - t_f), v, x3[k3.S3_Y], 0.0
            else:
                k8.discretise(t - t_f, e8, D)
                r4[0] = mean8[0] + (e8[k8.E8_U] + mean8[1]) * (t - t_f) + D[0] * mean8[2]
                r4[1] = e8[k8.E8_U] + mean8[1] + D[1] * mean8[2]
                r4[2], r4[3] = mean8[3] + mean8[4] * (t - t_f), mean8[4]
            o[0], o[1], o[2], o[3], o[4] = c[0], c[1], c[2], c[3], c[4]
            before = gs[kg.G_PHASE]
            kg.guidance_step(gs, o, r4, shown, t - t_g, gp, turn, radii)
            t_g = t
            if before == kg.APPROACH and gs[kg.G_PHASE] > kg.APPROACH:
                out[run, R_TURN] = t
            te = math.inf
            if gs[kg.G_PHASE] == kg.DONE:
                if roll > 0.0 and c[3] != 0.0:
                    rest = abs(c[3]) / roll
                    tr.tanker_step(c, -q[tr.Q_BANK], gs[kg.G_V], rest, q)
                    t += rest
                tr.receiver_step(s, t_true, t - t_true, W[run], 8 + 4 * i_draw, p, t4)
                out[run, R_DONE], out[run, R_TIME] = 1.0, t
                out[run, R_XM] = s[0] - gp[kg.GP_SEP] - c[0]
                out[run, R_YM] = s[3] - c[1]
                out[run, R_SPEED], out[run, R_BANK] = c[4], c[3]
                break
            if gs[kg.G_PHASE] != kg.APPROACH or sp[SP_EXACT] > 0.0:
                te = t + max(gs[kg.G_WAIT], 1e-4)
