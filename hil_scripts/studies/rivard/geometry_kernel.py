"""Many meetings of any geometry, compiled: the plant's truth kernels and the onboard steps with their rules, one event loop.

Beside the loop of the printed tables (kernel.py): faults of the TACAN, bearings and a data link with errors that stay, with
every range or at rates of their own (own_rate.py), the leg after the turn, and what is announced. The onboard steps are those of
RangeEstimator and RendezvousGuidance, kernel for kernel.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import meeting as km
from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous import turn_law as kg
from hil_scripts.studies.rivard import own_rate as ko
from sim_plant.couplings import traffic_kernel as tr

jit = numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy", no_cfunc_wrapper=True)

# setting sp
(
    SP_MEAS,  # [s] between ranges
    SP_GUID,  # [s] between guidance steps
    SP_TMAX,
    SP_KNOWN,  # [s] from which on guidance reads the truth
    SP_BEARING,  # [rad] sigma of a bearing, 0: none; of its constant error; what the software believes
    SP_BEARING_BIAS,
    SP_BEARING_R,
    SP_LINK,  # [m] the same of the data-linked position
    SP_LINK_BIAS,
    SP_LINK_R,
    SP_PSI0,
    SP_Y0,
    SP_YHAT,
    SP_SIGY,
    SP_SHIFT,
    SP_SPAN,
    SP_WX,  # [m/s] wind
    SP_WY,
    SP_WIND_ERR,  # [m/s] sigma of the own wind's error
    SP_VR,  # [m/s] receiver's planned airspeed
    SP_FAULT0,  # [s] a faulty set from, to; added to its ranges [m]; 1: it repeats the last range; 1: it is silent
    SP_FAULT1,
    SP_ADD,
    SP_STUCK,
    SP_SILENT,
    SP_LOST,  # [s] without a range that is used: told
    SP_BEARING_DT,  # [s] between bearings, correlation time of their error; 0: one with every range, white
    SP_BEARING_TAU,
    SP_LINK_DT,  # [s] the same of the position
    SP_LINK_TAU,
    SP_LINK_LATE,  # [s] until it is there
    SP_LINK_GONE,  # normal quantile of the share of positions that never are
    SP_N,
) = range(33)
# result row; R_DONE 1 finished, 0 out of time. Misses in axes of the receiver's course: at the roll-out, at the end, as
# estimated at the end, as predicted at the turn; R_FASTER: true airspeed of the receiver less the tanker's at the turn
(
    R_DONE, R_TURN, R_ROLLED, R_XR, R_YR, R_END, R_X, R_Y, R_XE, R_YE, R_XP, R_YP, R_WARNED, R_SAID_BEFORE, R_SAID, R_REFUSED,
    R_RESTARTED, R_OPENED, R_SILENT, R_FASTER, R_N,
) = range(21)  # fmt: skip


@jit
def miss(
    s: np.ndarray, c: np.ndarray, t: float, p: np.ndarray, v: np.ndarray, separation: float, out: np.ndarray
) -> None:
    """out [2] <- misses [m] along and across the course over ground the receiver truly flies at t [s]."""
    tr.manoeuvre_velocity(t, p, v)
    chi = math.atan2(-v[1], -(p[tr.P_U] + v[0]))
    cc, ss = math.cos(chi), math.sin(chi)
    dx, dy = s[tr.S_X] - c[0], s[tr.S_Y] - c[1]
    out[0], out[1] = cc * dx + ss * dy - separation, cc * dy - ss * dx


@jit
def fly(
    W: np.ndarray, Z: np.ndarray, V: np.ndarray, U: np.ndarray, p: np.ndarray, q: np.ndarray, sp: np.ndarray, e0: np.ndarray,
    gp: np.ndarray, mp: np.ndarray, rp: np.ndarray, plain: np.ndarray, fp: np.ndarray, M: int, window0: np.ndarray,
    kept: np.ndarray, keptP: np.ndarray, heard: np.ndarray, before0: np.ndarray, beforeP: np.ndarray, out: np.ndarray,
) -> None:  # fmt: skip
    """Fly out.shape[0] meetings. W [n, 8 + 4 steps], Z [n, 3 + 3 steps], V [n, 2] unit normals of receiver, sensors, wind; U
    [n, 3 + draws] of what comes at a rate of its own (own_rate.py).

    p [20], q [7] truth of receiver and tanker; sp [32] setting; e0 [19], gp, mp, rp, plain, fp, window0 onboard parameters; M
    components; kept to beforeP: room for estimates, their last size that of a component. out [n, 20]: R_*, SI.
    """
    n = kept.shape[2] - 2
    m, P, lw = np.zeros((M, n)), np.zeros((M, n, n)), np.zeros(M)
    wk, k, nu, D = np.zeros((M, k8.H_SIZE)), np.zeros(n), np.zeros(2), np.zeros(k8.D_SIZE)
    mean8, C8, r4, P4 = np.zeros(n), np.zeros((n, n)), np.zeros(4), np.zeros((4, 4))
    fs, own = np.zeros(kf.FS_N), np.zeros(ko.A_N)
    b_own, l_own = sp[SP_BEARING_DT] > 0.0, sp[SP_LINK_DT] > 0.0
    s, c, t13 = np.zeros(8), np.zeros(5), np.zeros(13)
    o, gs, ms, rs = np.zeros(8), np.zeros(kg.G_N), np.zeros(kv.M_N), np.zeros(kr.RS_N)
    turn, radii, o2, r2, o3, r3, v2, xy = (
        np.zeros(9), np.zeros(2), np.zeros(8), np.zeros(4), np.zeros(8), np.zeros(4), np.zeros(2), np.zeros(2)
    )  # fmt: skip
    e, w = e0.copy(), window0.copy()
    mdt, gdt, sep = sp[SP_MEAS], sp[SP_GUID], gp[kg.GP_SEP]
    hermite = M > 0  # true; the word itself would have all that is called compiled once more, for it alone
    for run in range(out.shape[0]):
        row = out[run]
        for j in range(R_N):
            row[j] = math.nan
        row[R_DONE] = row[R_SAID] = row[R_SAID_BEFORE] = row[R_REFUSED] = row[R_RESTARTED] = row[R_OPENED] = row[
            R_SILENT
        ] = 0.0
        tr.receiver_start(W[run], p, s)
        o[5] = sp[SP_WX] + sp[SP_WIND_ERR] * V[run, 0]
        o[6] = sp[SP_WY] + sp[SP_WIND_ERR] * V[run, 1]
        o[7] = math.asin(o[6] / gp[kg.GP_V])
        e[k8.E8_U] = -sp[SP_VR] * math.cos(math.asin(o[6] / sp[SP_VR])) + o[5]
        kg.guidance_reset(gs, gp)
        km.meeting_reset(ms)
        c[0], c[1], c[2], c[3], c[4] = 0.0, sp[SP_Y0], sp[SP_PSI0], 0.0, gp[kg.GP_V]
        for j in range(w.shape[0]):
            w[j] = window0[j]
        t, t_true, t_g, te, z, said = 0.0, 0.0, 0.0, math.inf, 0.0, 0
        i_meas, i_guid, i_draw, t_f, t_used = 0, 0, 0, 0.0, 0.0
        ko.start(own, U[run], sp[SP_BEARING], sp[SP_LINK])
        kf.fixes_reset(fs)
        i_b, i_l, t_sent, t_due, z_x, z_y = 0, 0, 0.0, math.inf, 0.0, 0.0
        while True:
            tm, tg = mdt * i_meas, gdt * i_guid
            tb = sp[SP_BEARING_DT] * i_b if b_own else math.inf
            tl = sp[SP_LINK_DT] * i_l if l_own else math.inf
            tn = min(min(min(tm, tg), te), min(min(tb, tl), t_due))
            if tn > sp[SP_TMAX]:
                break
            tr.tanker_step(c, gs[kg.G_BANK], gs[kg.G_V], tn - t, q)
            t = tn
            if t >= tm:
                tr.receiver_step(s, t_true, t - t_true, W[run], 8 + 4 * i_draw, p, t13)
                faulty = sp[SP_FAULT0] <= t < sp[SP_FAULT1]
                i_draw += 1
                t_true = t
                if i_meas > 0:
                    kb.bank_predict(m, P, lw, t - t_f if b_own or l_own else mdt, e, D)
                t_f = t
                if not (faulty and sp[SP_STUCK] > 0.0):
                    z = tr.tacan_range(s, c[0], c[1], p) + (sp[SP_ADD] if faulty else 0.0)
                silent = faulty and sp[SP_SILENT] > 0.0
                if i_meas == 0:
                    kb.bank_start(m, P, lw, z, c[0], c[1], sp[SP_YHAT], sp[SP_SIGY], sp[SP_SPAN], sp[SP_SHIFT], e)
                    kr.rules_reset(rs, z)
                elif not silent:
                    if fs[kf.FS_COUNT] > 0.0:
                        verdict = kf.heard_range(
                            fs, fp, rs, rp, plain, m, P, lw, w, before0, beforeP, heard, t, z, c[0], c[1], sp[SP_YHAT],
                            sp[SP_SIGY], sp[SP_SPAN], sp[SP_SHIFT], hermite, e, wk, k, nu,
                        )  # fmt: skip
                    else:
                        verdict = kr.judged_range(
                            rs, rp, m, P, lw, w, kept, keptP, t, z, c[0], c[1], sp[SP_YHAT], sp[SP_SIGY], sp[SP_SPAN],
                            sp[SP_SHIFT], hermite, e, wk, k, nu,
                        )  # fmt: skip
                    row[R_REFUSED] += 1.0 if verdict == kr.REFUSED or verdict == kr.STUCK else 0.0
                    if verdict != kr.REFUSED and verdict != kr.STUCK:
                        t_used = t
                    row[R_RESTARTED] += 1.0 if verdict == kr.RESTARTED else 0.0
                    if verdict == kr.OPENED:
                        row[R_OPENED] += 1.0
                        if math.isnan(row[R_WARNED]):
                            row[R_WARNED] = t
                if t - t_used > sp[SP_LOST]:
                    row[R_SILENT] = 1.0
                if sp[SP_BEARING] > 0.0 and not (silent or b_own):
                    z_b = tr.tacan_bearing(s, c[0], c[1]) + sp[SP_BEARING_BIAS] * Z[run, 0]
                    z_b += sp[SP_BEARING] * Z[run, 3 + 3 * i_meas]
                    kb.bank_bearing(m, P, lw, z_b, c[0], c[1], sp[SP_BEARING_R], 0.0, wk, k, nu)
                if sp[SP_LINK] > 0.0 and not l_own:
                    z_x = s[0] + sp[SP_LINK_BIAS] * Z[run, 1] + sp[SP_LINK] * Z[run, 4 + 3 * i_meas]
                    z_y = s[3] + sp[SP_LINK_BIAS] * Z[run, 2] + sp[SP_LINK] * Z[run, 5 + 3 * i_meas]
                    kb.bank_position(m, P, lw, z_x, z_y, sp[SP_LINK_R], wk, k, nu)
                kb.bank_match(m, P, lw, mean8, C8)
                kb.reduce_four(mean8, C8, e[k8.E8_U], r4, P4)
                i_meas += 1
            if t >= min(min(tb, tl), t_due):
                new_fix, opened = False, False
                if t >= min(tb, tl) and t > t_true:
                    tr.receiver_step(s, t_true, t - t_true, W[run], 8 + 4 * i_draw, p, t13)
                    i_draw += 1
                    t_true = t
                if t >= tb:
                    ko.fade(own, ko.A_B, 1, sp[SP_BEARING_DT], sp[SP_BEARING_TAU], sp[SP_BEARING], U[run])
                    i_b += 1
                    if not (sp[SP_FAULT0] <= t < sp[SP_FAULT1] and sp[SP_SILENT] > 0.0):
                        z_b = tr.tacan_bearing(s, c[0], c[1]) + sp[SP_BEARING_BIAS] * Z[run, 0] + own[ko.A_B]
                        kb.bank_predict(m, P, lw, t - t_f, e, D)
                        t_f, new_fix = t, True
                        verdict = kf.heard_fix(
                            fs, fp, rs, rp, m, P, lw, w, before0, beforeP, heard, t, kf.IS_BEARING, z_b, 0.0, c[0], c[1], hermite,
                            e, wk, k, nu,
                        )  # fmt: skip
                        opened = verdict == kf.OPENED
                if t >= tl:
                    ko.fade(own, ko.A_X, 2, sp[SP_LINK_DT], sp[SP_LINK_TAU], sp[SP_LINK], U[run])
                    i_l += 1
                    z_x, z_y = (
                        s[0] + sp[SP_LINK_BIAS] * Z[run, 1] + own[ko.A_X],
                        s[3] + sp[SP_LINK_BIAS] * Z[run, 2] + own[ko.A_Y],
                    )
                    t_sent, t_due = t, t + sp[SP_LINK_LATE] if ko.draw(own, U[run]) > sp[SP_LINK_GONE] else math.inf
                if t >= t_due:
                    t_due, new_fix = math.inf, True
                    if t_sent > t_f:
                        kb.bank_predict(m, P, lw, t_sent - t_f, e, D)
                        t_f = t_sent
                    verdict = kf.heard_fix(
                        fs, fp, rs, rp, m, P, lw, w, before0, beforeP, heard, t_sent, kf.IS_POSITION, z_x, z_y, c[0], c[1],
                        hermite, e, wk, k, nu,
                    )  # fmt: skip
                    opened = opened or verdict == kf.OPENED
                if opened:
                    row[R_OPENED] += 1.0
                    if math.isnan(row[R_WARNED]):
                        row[R_WARNED] = t
                if new_fix:
                    kb.bank_match(m, P, lw, mean8, C8)
                    kb.reduce_four(mean8, C8, e[k8.E8_U], r4, P4)
            if not (t >= tg or t >= te):
                continue
            i_guid += 1 if t >= tg else 0
            ahead = t - t_true
            if t >= sp[SP_KNOWN]:
                tr.manoeuvre_velocity(t_true, p, v2)
                v = p[tr.P_U] + s[1] + s[2] + v2[0]
                r4[0], r4[1], r4[2], r4[3] = s[0] + v * ahead, v, s[3] + (s[4] + v2[1]) * ahead, s[4] + v2[1]
            else:
                ahead = t - t_f
                k8.discretise(ahead, e, D)
                r4[0] = mean8[0] + (e[k8.E8_U] + mean8[1]) * ahead + D[k8.D_XF] * mean8[2]
                r4[1] = e[k8.E8_U] + mean8[1] + D[k8.D_F] * mean8[2]
                r4[2], r4[3] = mean8[3] + mean8[4] * ahead, mean8[4]
            o[0], o[1], o[2], o[3], o[4] = c[0], c[1], c[2], c[3], c[4]
            before = gs[kg.G_PHASE]
            follow = t >= sp[SP_KNOWN] or rs[kr.RS_OPENED] > 0.0
            sided = sp[SP_BEARING] > 0.0 or sp[SP_LINK] > 0.0
            new = km.meeting_step(
                ms, gs, o, r4, P4, follow, sided, z, t - t_g, gp, mp, turn, radii, o2, r2, o3, r3
            )  # fmt: skip
            t_g, said = t, said + new
            if before == kg.APPROACH and (gs[kg.G_PHASE] != kg.APPROACH):
                row[R_TURN], row[R_SAID_BEFORE] = t, said
                row[R_XP], row[R_YP] = ms[kv.M_XP], ms[kv.M_YP]
                tr.manoeuvre_velocity(t_true, p, v2)
                pace = math.hypot(p[tr.P_U] + s[1] + s[2] + v2[0] - sp[SP_WX], s[4] + v2[1] - sp[SP_WY])
                row[R_FASTER] = pace - gp[kg.GP_V]
            te = math.inf
            phase = gs[kg.G_PHASE]
            if before != phase and (phase == kg.DONE or phase == kv.LEG):
                tr.receiver_step(s, t_true, t - t_true, W[run], 8 + 4 * i_draw, p, t13)
                t_true = t
                i_draw += 1
                miss(s, c, t, p, v2, sep, xy)
                if before != kv.LEG:
                    row[R_ROLLED], row[R_XR], row[R_YR] = t, xy[0], xy[1]
                if phase == kg.DONE:
                    row[R_DONE], row[R_END], row[R_X], row[R_Y], row[R_SAID] = 1.0, t, xy[0], xy[1], said
                    row[R_XE], row[R_YE] = gs[kg.G_XM], gs[kg.G_YM]
                    break
            te = t + max(gs[kg.G_WAIT], 1e-4)
