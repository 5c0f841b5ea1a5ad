"""Bearings and positions at a rate of their own: fusion against filterpy, errors not averaged away, the estimate opened."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.linalg import expm
from scipy.stats import chi2

from flightsw.missions.rendezvous import aid_errors as ka
from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import leg as kl
from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous import straight as ks
from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous import turn_law as kg
from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import guidance_vector, meeting_vector
from flightsw.missions.rendezvous.params import Aids, RendezvousNavParams, eight_vector, fixes_vector
from flightsw.strict import ConfigError
from hil_scripts.studies.rivard.geometry import SETTINGS
from hil_scripts.studies.rivard.geometry_mc import NAV, run_geometry
from hil_scripts.studies.rivard.mc import KN, NM

Array = np.ndarray
V, N = 396.0 * KN, ka.N14
P = replace(NAV, receiver_mps=V, aids=Aids(on=True))
E, FP = eight_vector(P, -V), fixes_vector(P)


def discrete(dt: float) -> tuple[Array, Array]:
    """Transition and noise of the 14 states over dt by Van Loan's exponential, from the differential equations."""
    A, Q = np.zeros((N, N)), np.zeros((N, N))
    A[k8.X, k8.VC] = A[k8.X, k8.VF] = A[k8.Y, k8.VY] = 1.0
    fading = [(k8.VF, P.fluctuation_tau_s, P.fluctuation_sigma_mps), (k8.N, P.range_noise_tau_s, P.range_noise_sigma_m)]
    fading += [(ka.BN, P.aids.bearing_tau_s, math.radians(P.bearing_sigma_deg))]
    fading += [(c, P.aids.link_tau_s, P.datalink_sigma_m) for c in (ka.LXN, ka.LYN)]
    for i, tau, sigma in fading:
        A[i, i], Q[i, i] = -1.0 / tau, 2.0 * sigma * sigma / tau
    Q[k8.Y, k8.Y] = P.walk_m2ps
    M = expm(np.block([[-A, Q], [np.zeros((N, N)), A.T]]) * dt)
    F = M[N:, N:].T
    return F, F @ M[:N, N:]


def started(d: float = 55e3) -> tuple[Array, Array, Array]:
    m, C, lw = np.zeros((1, N)), np.zeros((1, N, N)), np.zeros(1)
    kb.bank_start(m, C, lw, d, 0.0, -9.6 * NM, 300.0, NM, 3.5, 1.0, E)
    return m, C, lw


def scratch() -> tuple[Array, Array, Array]:
    return np.zeros((1, k8.H_SIZE)), np.zeros(N), np.zeros(2)


def test_positions_at_any_times_as_filterpy_fuses_them() -> None:
    m, C, lw = started()
    ref = KalmanFilter(dim_x=N, dim_z=1)
    ref.x, ref.P = m[0].reshape(N, 1).copy(), C[0].copy()
    rng, D = np.random.default_rng(4), np.zeros(k8.D_SIZE)
    push = np.zeros((N, 1))
    for _ in range(40):
        dt = rng.uniform(0.05, 3.0)
        F, Q = discrete(dt)
        push[k8.X] = -V * dt
        ref.predict(F=F, Q=Q)
        ref.x = ref.x + push
        kb.bank_predict(m, C, lw, dt, E, D)
        for along, state, error in ((True, k8.X, ka.LXC), (False, k8.Y, ka.LYC)):
            z = m[0, state] + 100.0 * rng.standard_normal()
            H = np.zeros((1, N))
            H[0, [state, error, error + 1]] = 1.0
            ref.update(np.array([[z]]), R=np.array([[FP[kf.FP_RL]]]), H=H)
            nu = np.zeros(2)
            kb.bank_axis(m, C, lw, along, z, FP[kf.FP_RL], np.zeros((1, k8.H_SIZE)), np.zeros(N), nu)
            assert nu == pytest.approx([ref.y[0, 0], ref.S[0, 0]], rel=1e-8, abs=1e-6)
        scale = np.sqrt(np.diag(ref.P)) + 1e-12
        assert np.abs(m[0] - ref.x[:, 0]).max() < 1e-5
        assert np.abs((C[0] - ref.P) / np.outer(scale, scale)).max() < 1e-7


def test_a_bearing_is_fused_with_its_errors_as_filterpy_does() -> None:
    m, C, lw = started()
    C[0, k8.X, k8.X], C[0, k8.Y, k8.Y] = 400.0, 900.0  # near enough for a straight line to be the whole truth
    C[0, k8.X, k8.Y] = C[0, k8.Y, k8.X] = 100.0
    C[0, :, k8.AE] = C[0, k8.AE, :] = C[0, :, k8.B] = C[0, k8.B, :] = C[0, :, k8.N] = C[0, k8.N, :] = 0.0
    ref = KalmanFilter(dim_x=N, dim_z=1)
    ref.x, ref.P = m[0].reshape(N, 1).copy(), C[0].copy()
    for z in (0.351, 0.353, 0.349):
        dx, dy = m[0, k8.X], m[0, k8.Y] + 9.6 * NM
        d2, H = dx * dx + dy * dy, np.zeros((1, N))
        H[0, [k8.X, k8.Y, ka.BC, ka.BN]] = -dy / d2, dx / d2, 1.0, 1.0
        at = math.atan2(dy, dx) + m[0, ka.BC] + m[0, ka.BN]
        ref.update(np.array([[z - at + (H @ ref.x)[0, 0]]]), R=np.array([[FP[kf.FP_RB]]]), H=H)
        kb.bank_bearing(m, C, lw, z, 0.0, -9.6 * NM, FP[kf.FP_RB], 0.0, *scratch())
        assert m[0] == pytest.approx(ref.x[:, 0], rel=1e-5, abs=1e-6)
        scale = np.sqrt(np.diag(ref.P)) + 1e-12
        assert np.abs((C[0] - ref.P) / np.outer(scale, scale)).max() < 1e-4


def fixed_often(white: bool, seed: int, seconds: int = 60) -> tuple[float, float]:
    """Error of y in sigma after a position each second with errors of the world's kind, and sigma itself [m]."""
    rng = np.random.default_rng(seed)
    n = k8.N8 if white else N
    e = E.copy()
    e[k8.E8_LC] = 30.0
    m, C, lw = np.zeros((1, n)), np.zeros((1, n, n)), np.zeros(1)
    kb.bank_start(m, C, lw, 55e3, 0.0, -9.6 * NM, 0.0, NM, 3.5, 1.0, e)
    y, vy = NM * rng.standard_normal(), P.drift_sigma_mps * rng.standard_normal()
    bias, noise, a = 30.0 * rng.standard_normal(), 100.0 * rng.standard_normal(), math.exp(-1.0 / 5.0)
    R, D = 1e4 if white else FP[kf.FP_RL], np.zeros(k8.D_SIZE)
    for _ in range(seconds):
        kb.bank_predict(m, C, lw, 1.0, e, D)
        y += vy + math.sqrt(P.walk_m2ps) * rng.standard_normal()
        noise = a * noise + 100.0 * math.sqrt(1.0 - a * a) * rng.standard_normal()
        kb.bank_axis(m, C, lw, False, y + bias + noise, R, np.zeros((1, k8.H_SIZE)), np.zeros(n), np.zeros(2))
    return (m[0, k8.Y] - y) / math.sqrt(C[0, k8.Y, k8.Y]), math.sqrt(C[0, k8.Y, k8.Y])


def test_what_comes_often_is_not_averaged_away() -> None:
    """Error over sigma, squared and summed, is chi-square with the errors as states; taken as white it is far beyond."""
    runs = 300
    lo, hi = chi2.ppf([1e-4, 1.0 - 1e-4], runs)
    right = np.array([fixed_often(False, s) for s in range(runs)])
    wrong = np.array([fixed_often(True, s) for s in range(runs)])
    assert lo < np.sum(right[:, 0] ** 2) < hi
    assert np.sum(wrong[:, 0] ** 2) > 2.0 * hi
    assert right[:, 1].min() > 30.0 > wrong[:, 1].max()  # no sooner than the constant error lets it


def test_sums_of_white_innovations_have_the_spread_they_say() -> None:
    rng, over, n = np.random.default_rng(2), [], 4000
    for _ in range(n):
        fs = np.zeros(kf.FS_N)
        for t in np.cumsum(rng.uniform(0.2, 3.0, 12)):
            top = kf.sum_push(fs, kf.ALONG, rng.standard_normal(), t, 5.0)
        over.append(top)
    for q in (0.5, 0.9, 0.99):
        share = np.mean(np.array(over) > chi2.ppf(q, 1))
        assert share == pytest.approx(1.0 - q, abs=4.0 * math.sqrt(q * (1.0 - q) / n))


def drive(est: RangeEstimator, link: bool, turn_deg: float = 0.0, n: int = 130) -> list[float]:
    """Ranges every 10 s of a receiver on its plan that turns at 60 s at once, a position without noise each second: course errors
    [deg]."""
    x, y, a, out = 50e3, 0.0, 0.0, []
    for k in range(n):
        own = (V * k, -9.6 * NM)
        if k == 60:
            a = math.radians(turn_deg)
        if k:
            est.predict(1.0)
            x, y = x - V * math.cos(a), y - V * math.sin(a)
        d = (x - own[0], y - own[1])
        z = math.hypot(*d, 304.8 + (d[0] ** 2 + d[1] ** 2) / (2.0 * 3444.0 * NM))
        if k == 0:
            est.start(z, *own, 0.0, NM)
        elif k % 10 == 0:
            est.update(z, *own)
        if link:
            est.update(None, *own, 0.0, None, (x, y))
        out.append(math.degrees(math.atan2(-est.mean[3], -est.mean[1]) - a))
    return out


def test_ranges_alone_give_the_same_bits_with_and_without_room_for_the_errors() -> None:
    with_it, without = RangeEstimator(P), RangeEstimator(replace(P, aids=Aids()))
    assert drive(with_it, False, -20.0) == drive(without, False, -20.0)
    assert with_it.mean == without.mean and with_it.out.left_plan and not with_it.out.sided
    assert np.array_equal(with_it.covariance, without.covariance)


def test_a_turn_is_noticed_and_followed_between_the_ranges() -> None:
    est = RangeEstimator(P)
    error = drive(est, True, -30.0, 69)
    assert est.out.left_plan and est.out.alarm and abs(error[59]) < 2.0  # before a range that shows it
    est = RangeEstimator(P)
    error = drive(est, True, -30.0)
    assert max(map(abs, error[-20:])) < 3.0 and est.out.sided
    quiet = RangeEstimator(replace(P, aids=replace(P.aids, limit=0.0), rules=replace(P.rules, young_z=0.0), window_nis=1e9,
                                   window_drift=1e9, gate_nis=0.0))  # fmt: skip
    assert max(map(abs, drive(quiet, True, -30.0)[-20:])) > 6.0 and not quiet.out.left_plan


def test_opened_it_is_what_was_kept_spread_and_fused_again() -> None:
    """`reopen` against the same steps one by one."""
    M, K = 9, 20
    p = replace(P, components=M, aids=Aids(on=True, kept=K))
    est = RangeEstimator(p)
    drive(est, True, n=50)
    before = est.get_state()
    n, t = int(est.fixes[kf.FS_COUNT]), est.t
    j = next(i for i in range(n - 1, 0, -1) if t - est.heard[i % K, kf.F_T] >= p.aids.back_s)
    m, C, lw = (est.before[j % K, :, :N].copy(), est.beforeP[j % K].copy(), est.before[j % K, :, kr.KEPT_LW].copy())
    fs, past, D = est.fixes.copy(), est.heard[j % K, kf.F_T], np.zeros(k8.D_SIZE)
    kr.fan_out(m, C, lw, math.radians(40.0), 30.0, M - M // 4, 0.0, p.aids.back_s**2 / 3.0, est.e8)
    kr.open_up(C, lw, est.rules, 0.0)
    fs[kf.FS_STIRRED], fs[kf.FS_UNTIL] = past, t + p.aids.noisy_s
    for i in range(j, n):
        f = est.heard[i % K]
        if f[kf.F_T] > past:
            kb.bank_predict(m, C, lw, f[kf.F_T] - past, est.e8, D)
            past = f[kf.F_T]
        kf.stir(fs, est.fp, m, C, lw, past, est.e8)
        kf.fuse_heard(f, fs, est.fp, m, C, lw, True, est.e8, est._wk, est._k, est._nu)
    kf.reopen(
        est.fixes, est.fp, est.rules, est.m, est.P, est.lw, est.window, est.before, est.beforeP, est.heard, True, est.e8,
        est._wk, est._k, est._nu,
    )  # fmt: skip
    assert np.array_equal(est.m, m) and np.array_equal(est.P, C) and np.array_equal(est.lw, lw)
    assert est.fixes[list(kf.FS_SUM)].tolist() == [0.0] * 3
    est.set_state(before)
    assert est.fixes[kf.FS_COUNT] == n and np.array_equal(est.m, before["m"])


def test_a_position_older_than_the_estimate_is_carried_on_to_it() -> None:
    late, prompt = RangeEstimator(P), RangeEstimator(P)
    for est in (late, prompt):
        drive(est, True, n=31)
        est.predict(1.0)
    vx, at = late.mean[1], (50e3 - 31.0 * V, 0.0)
    own = (V * 31.0, -9.6 * NM)
    prompt.update(None, *own, 0.0, None, at)
    late.update(None, *own, 0.0, None, at)
    prompt.update(None, *own, 0.0, None, at)
    late.update(None, *own, 0.4, None, (at[0] - 0.4 * vx, at[1]))
    assert late.mean == pytest.approx(prompt.mean, abs=0.2)


def test_rules_of_their_own_are_refused_where_nothing_obeys_them() -> None:
    with pytest.raises(ConfigError, match=r"aids\.on"):
        replace(NAV, aids=Aids(limit=3.0))
    with pytest.raises(ConfigError, match=r"aids\.on"):
        RendezvousNavParams(aids=Aids(on=True))
    with pytest.raises(ValueError, match="aids"):
        run_geometry(replace(SETTINGS["turn_away_30_link_own"][1], nav=NAV), 1)
    with pytest.raises(ValueError, match="link_late_s"):
        run_geometry(replace(SETTINGS["turn_away_30_link_own"][1], link_late_s=1.5), 1)


OWN = SETTINGS["turn_away_30_link_own"][1].guid


@pytest.mark.parametrize(
    ("behind", "faster", "sided", "longer"),
    [(800.0, 5.0, True, True), (800.0, 5.0, False, False), (800.0, 12.0, True, False), (8e3, 5.0, True, False),
     (-800.0, -5.0, True, True), (-800.0, -12.0, True, False)],
)  # fmt: skip
def test_a_leg_lasts_longer_only_where_it_gets_there(behind: float, faster: float, sided: bool, longer: bool) -> None:
    gp, mp, ms, gs = guidance_vector(OWN), meeting_vector(OWN.meeting), np.zeros(kv.M_N), np.zeros(kg.G_N)
    o = np.array([0.0, 0.0, math.pi, 0.0, V, 0.0, 0.0, 0.0])
    r = np.array([gp[kg.GP_SEP] - behind, -(V + faster), 0.0, 0.0])
    limit = kl.leg_limit(ms, gs, o, r, sided, gp, mp)
    assert limit == (600.0 if longer else 300.0)
    assert kl.leg_share(limit, mp) == (0.4 if longer else 1.0)


def test_the_last_arc_of_a_late_turn_is_broken_off_where_much_is_left() -> None:
    """A tanker that an estimate since corrected has sent onto its last arc, 5 NM behind: straight on again, or never."""
    gp = guidance_vector(OWN)
    o = np.array([0.0, 0.0, 1.5, math.radians(20.0), V, 0.0, 0.0, 0.0])
    r = np.array([-4.0 * NM, -V, 6.0 * NM, 0.0])
    t = np.zeros(kt.T_N)
    t[kt.T_DPSI], t[kt.T_BANK] = math.pi - 1.5, 0.3
    for again, way in ((True, kv.STRAIGHT), (False, kv.LAST)):
        ms, gs = np.zeros(kv.M_N), np.zeros(kg.G_N)
        ms[kv.M_WAY] = kv.LAST
        assert ks.late_turn(ms, gs, o, r, t, gp, again, np.zeros(2))
        assert ms[kv.M_WAY] == way
