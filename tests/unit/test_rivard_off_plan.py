"""A receiver that has left its plan: spread over turns and speeds, straight to the place ahead of it, what is announced."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsw.missions.rendezvous import full_order as k8
from flightsw.missions.rendezvous import judging as kj
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous import straight as ks
from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous.bank import bank_match
from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.guidance import meeting_vector
from flightsw.missions.rendezvous.params import RangeRules, RendezvousNavParams, eight_vector
from flightsw.strict import ConfigError
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard.first_range import trade
from hil_scripts.studies.rivard.geometry import SETTINGS, outside
from hil_scripts.studies.rivard.geometry_mc import GUIDANCE, NAV, changed, run_geometry
from hil_scripts.studies.rivard.mc import KN, NM
from sim_plant.couplings import traffic_kernel as tr

V, G, SEP, ROLL = 396.0 * KN, 9.80665, 2.0 * NM, math.radians(5.0)
FULL, LAST, NEAR = math.radians(30.0), math.radians(25.0), 0.15
X, Y, VX, VY = k8.X, k8.Y, k8.VC, k8.VY


def tanker(psi: float, v: float = V, wind: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    return np.array([0.0, 0.0, psi, FULL, v, *wind, math.asin(wind[1] / V)])


def test_components_stand_for_turns_and_speeds_begun_at_any_time() -> None:
    """Each component against draws: course and speed of it, flown for a uniform time of the last 40 s."""
    M, since, turn, pace = 15, 40.0, math.radians(40.0), 30.0
    turned = M - M // 4
    m, P, lw = np.zeros((M, 8)), np.zeros((M, 8, 8)), np.zeros(M)
    e = eight_vector(NAV, -V)
    kr.fan_out(m, P, lw, turn, pace, turned, 0.5 * since, since * since / 12.0, e)
    rng, n = np.random.default_rng(3), 200_000
    da, db = 2.0 * turn / (turned - 1), 2.0 * pace / (M - turned - 1)
    for i in range(M):
        a = (-turn + da * i if i < turned else 0.0) + 0.9 * da * rng.standard_normal(n)
        b = (-pace + db * (i - turned) + 0.9 * db * rng.standard_normal(n)) if i >= turned else np.zeros(n)
        # a left turn of one that flies to -x brings it to -y; faster is more to -x
        vx, vy = -(V + b) * np.cos(a), -(V + b) * np.sin(a)
        t = rng.uniform(0.0, since, n)
        drawn = np.stack([(vx + V) * t, vx + V, vy * t, vy])
        got = m[i, [X, VX, Y, VY]]
        sigma = np.sqrt(np.diag(P[i])[[X, VX, Y, VY]])
        assert np.abs(got - drawn.mean(axis=1)).max() < 2.5 * V * da * da * since  # what a straight line leaves out
        if abs(a.mean()) > da or i >= turned:
            assert sigma[[1, 3]] == pytest.approx(drawn.std(axis=1)[[1, 3]], rel=0.08, abs=0.5)
            assert sigma[[0, 2]] == pytest.approx(drawn.std(axis=1)[[0, 2]], rel=0.08, abs=25.0)
    assert (lw == 0.0).all() and np.linalg.eigvalsh(P).min() > -1e-6


def ranges(est: RangeEstimator, deg: float, n: int, at: int = 6) -> list[float]:
    """Course error [deg] after each of n ranges without noise, of a receiver that turns at once by deg at range `at`."""
    u, off, errors = np.array([-V, 0.0]), -9.6 * NM, []
    p, own = np.array([50_000.0, 0.0]), np.array([0.0, off])
    a = math.radians(deg)
    for k in range(n):
        d = p - own
        z = math.hypot(*d, 304.8 + float(d @ d) / (2.0 * 3444.0 * NM))
        if k == 0:
            est.start(z, *own, 0.0, NM)
        else:
            est.predict(10.0)
            est.update(z, *own)
        _, vx, _, vy = est.mean
        truth = deg if k > at else 0.0
        errors.append(math.degrees(math.atan2(-vy, -vx)) - truth)
        if k == at:
            u = -V * np.array([math.cos(a), math.sin(a)])
        p = p + 10.0 * u
        psi = math.radians(max(0.0, 15.0 * (k - 4)))  # the tanker turns as it would
        own = own + 10.0 * V * np.array([math.cos(psi), math.sin(psi)])
    return errors


@pytest.mark.parametrize("deg", [-30.0, -20.0, -10.0, 20.0])
def test_course_flown_is_found_from_ranges(deg: float) -> None:
    """Within eight ranges of the turn; by the estimate opened as it stands it is not."""
    spread = RangeEstimator(replace(NAV, receiver_mps=V))
    error = ranges(spread, deg, 15)
    assert spread.out.left_plan and max(map(abs, error[-2:])) < 5.0
    rules = replace(NAV.rules, open_back=0, open_turn_deg=0.0, open_speed_mps=0.0)
    plain = RangeEstimator(replace(NAV, rules=rules))
    assert max(map(abs, ranges(plain, deg, 15)[-2:])) > max(map(abs, error[-2:]))


def test_estimate_goes_back_to_the_oldest_kept() -> None:
    """Kept four times and opened: the moments are those of the oldest, carried on without any range since, and wider."""
    M, e = 15, eight_vector(NAV, -V)
    rp, rs = RangeEstimator(NAV).rules, np.zeros(kr.RS_N)
    kept, keptP = np.zeros((4, M, 10)), np.zeros((4, M, 8, 8))
    for k in range(6):
        m = np.zeros((M, 8))
        m[:, X], m[:, VX], m[:, Y] = 1000.0 * k, 1.0, 10.0 * k
        kr.keep(m, np.tile(np.eye(8), (M, 1, 1)), np.zeros(M), 10.0 * k, rs, kept, keptP)
    m, P, lw = np.zeros((M, 8)), np.tile(np.eye(8), (M, 1, 1)), np.zeros(M)
    kr.leave_plan(m, P, lw, 50.0, rp, rs, kept, keptP, e)
    turned = M - M // 4
    mid = m[[turned // 2 - 1, turned // 2]].mean(axis=0)  # half a spacing to either side of no turn
    assert mid[Y] == pytest.approx(20.0, abs=1.0)  # of 20 s: two were overwritten
    assert mid[X] == pytest.approx(2000.0 + 30.0 * (1.0 - V), abs=20.0)
    mean, C = np.zeros(8), np.zeros((8, 8))
    bank_match(m, P, lw, mean, C)
    assert math.sqrt(C[VY, VY]) == pytest.approx(V * math.radians(40.0) / math.sqrt(3.0), rel=0.25)


def flown(o: np.ndarray, r: np.ndarray, h: float, straight_s: float, fast: float) -> np.ndarray:
    """Miss [2] [m] of arc, straight part and arc, integrated, once wings are level: the place ahead less the tanker."""
    psi, p, t, dt = float(o[kt.O_PSI]), np.zeros(2), 0.0, 0.01
    wind, end = np.array([o[kt.O_WX], o[kt.O_WY]]), math.pi + float(o[kt.O_DELTA])

    def leg(v: float, to: float, phi: float) -> None:
        nonlocal psi, p, t
        while psi < to - 1e-9:
            step = min(G * math.tan(phi) / v * dt, to - psi)
            h = step * v / (G * math.tan(phi))
            p = p + h * (v * np.array([math.cos(psi + 0.5 * step), math.sin(psi + 0.5 * step)]) + wind)
            psi, t = psi + step, t + h

    leg(float(o[kt.O_V]), h, FULL)
    p = p + straight_s * (fast * np.array([math.cos(h), math.sin(h)]) + wind)
    t += straight_s
    leg(fast, end, LAST)
    t_out = kt.ramp_straight(LAST, ROLL)
    p = p + t_out * (fast * np.array([math.cos(end), math.sin(end)]) + wind)
    t += t_out
    return np.array([r[0] + r[1] * t - SEP, r[2] + r[3] * t]) - p


@pytest.mark.parametrize(("h", "straight_s", "wind"), [
    (2.0, 60.0, (0.0, 0.0)), (2.7, 90.0, (0.0, 0.0)), (1.2, 30.0, (5.0, -15.0)), (2.4, 40.0, (-8.0, 12.0)),
])  # fmt: skip
def test_straight_course_meets_the_place(h: float, straight_s: float, wind: tuple[float, float]) -> None:
    """Heading and time of a path integrated step by step come out of where it ends."""
    o, fast, out = tanker(1.0, wind=wind), V + 20.0 * KN, np.zeros(2)
    r = np.array([SEP, -V * math.cos(o[kt.O_DELTA]) + wind[0], 0.0, 0.0])
    r[[0, 2]] -= flown(o, r, h, straight_s, fast)
    ks.straight_course(o, r, fast, FULL, LAST, NEAR, SEP, ROLL, G, out)
    assert out == pytest.approx([h, straight_s], abs=0.02)


@pytest.mark.parametrize(("x", "y"), [(9.0, 9.0), (4.0, 9.0), (3.0, 14.0), (11.0, 12.0)])
def test_two_arcs_are_late_where_none_of_them_meets_the_place(x: float, y: float) -> None:
    """`behind` against the arcs themselves, the second as wide as the track asks, by bisection."""
    o, r = tanker(1.0), np.array([x * NM + SEP, -V, y * NM, 0.0])
    o[kt.O_PHI] = 0.0  # no roll-out: the arcs alone
    low, mid = V * V / (G * math.tan(FULL)), 0.5 * (1.0 + math.pi)

    def miss(r2: float) -> tuple[float, float]:
        at = np.zeros(2)
        got = np.zeros(2)
        for a, b, radius in ((1.0, mid, low), (mid, math.pi, r2)):
            ks.arc(a, b, radius, V, -V, 0.0, at)
            got += at
        return x * NM - got[0], y * NM - got[1]

    lo, hi = low, 1e3 * low
    for _ in range(80):
        half = 0.5 * (lo + hi)
        lo, hi = (half, hi) if miss(half)[1] > 0.0 else (lo, half)
    assert ks.behind(o, r, FULL, SEP, 0.0, G) == pytest.approx(miss(lo)[0], abs=1.0)


def test_behind_a_faster_receiver_the_heading_falls_back_least() -> None:
    """No course meets it; of all the one flown loses least along the track on the way to it."""
    o = tanker(2.0)
    pace, fast = V + 60.0 * KN, V + 20.0 * KN
    r, out = np.array([SEP, -pace, 8.0 * NM, 0.0]), np.zeros(2)
    ks.straight_course(o, r, fast, FULL, LAST, NEAR, SEP, ROLL, G, out)
    h = np.linspace(2.0, math.pi - NEAR, 20_000)
    assert out[0] == pytest.approx(h[np.argmin((pace + fast * np.cos(h)) / (fast * np.sin(h)))], abs=2e-3)


@pytest.mark.parametrize(("x", "y"), [(0.0, 6.0), (-1.0, 6.0), (-1.0, -6.0), (-3.0, 1.0)])
def test_leg_that_is_behind_keeps_its_line_of_sight(x: float, y: float) -> None:
    a = ks.leg_angle(x * NM, y * NM, -V, 0.0, 0.0, V + 20.0 * KN)
    h = math.pi - math.copysign(a, y)
    closing = (V + 20.0 * KN) * np.array([math.cos(h), math.sin(h)]) + np.array([V, 0.0])
    assert float(closing @ np.array([x, y])) > 0.0
    assert abs(closing[0] * y - closing[1] * x) / math.hypot(*closing) / math.hypot(x, y) < 1e-9
    assert ks.leg_angle(x * NM, y * NM, -V - 12.0, 0.0, 0.0, V + 20.0 * KN) == 0.5 * math.pi


def test_sigma_of_a_miss_grows_with_the_velocitys() -> None:
    """Against the same rotation and propagation as matrices."""
    a = np.random.default_rng(1).normal(size=(4, 4))
    P, chi, t, s = a @ a.T, 0.4, 90.0, np.zeros(2)
    kj.spread(P, chi, t, s)
    c, d = math.cos(chi), math.sin(chi)
    H = np.array([[c, c * t, d, d * t], [-d, -d * t, c, c * t]])
    assert s == pytest.approx(np.sqrt(np.diag(H @ P @ H.T)))


@pytest.mark.parametrize(("x", "y", "mirror", "missed"), [
    (0.5, 0.2, True, False), (1.5, 0.0, True, True), (-3.9, 0.1, True, False), (-3.9, 0.1, False, True),
    (-3.9, 0.6, True, True), (-1.5, 0.0, True, True), (-6.0, 0.0, True, True),
])  # fmt: skip
def test_mirror_image_of_ranges_is_not_called_a_miss(x: float, y: float, mirror: bool, missed: bool) -> None:
    """4 - 3.9 NM: as far behind the tanker as the estimate has it ahead, the receiver is 0.1 NM off its place."""
    assert kj.missed(x * NM, y * NM, SEP, mirror, meeting_vector(GUIDANCE.meeting)) is missed


@pytest.mark.parametrize("changes", [
    {"open_back": 0}, {"open_turn_deg": 0.0}, {"open_speed_mps": 0.0}, {"open_back": 0, "open_turn_deg": 0.0},
])  # fmt: skip
def test_a_spread_that_cannot_be_is_refused(changes: dict) -> None:
    with pytest.raises(ConfigError, match=r"rules\.open_"):
        replace(NAV, rules=replace(NAV.rules, **changes))
    for other in ({"estimator": "ukf8"}, {"components": 7}):
        with pytest.raises(ConfigError, match="open_back = 4"):
            replace(NAV, **other)
    RendezvousNavParams(estimator="ukf8", rules=RangeRules())


def test_defaults_open_the_estimate_as_it_stands() -> None:
    """With the defaults of the new keys the variances are added and nothing else is touched."""
    p = replace(NAV, rules=RangeRules(open=True))
    M, est = 15, RangeEstimator(p)
    rng = np.random.default_rng(2)
    m, P, lw = rng.normal(size=(M, 8)), np.tile(np.eye(8), (M, 1, 1)), np.zeros(M)
    before = m.copy()
    kr.leave_plan(m, P, lw, 50.0, est.rules, np.zeros(kr.RS_N), est.memory, est.memoryP, est.e8)
    want = np.ones(8)
    want[[X, Y]] += 100.0**2, 300.0**2
    want[[VX, VY]] += (15.0 * KN) ** 2, (50.0 * KN) ** 2
    assert (m == before).all() and P[3] == pytest.approx(np.diag(want))


@pytest.mark.parametrize(("name", "share"), [
    ("turn_away_5", 0.14), ("turn_away_10", 0.12), ("turn_away_20", 0.12), ("turn_towards_30_link", 0.08),
])  # fmt: skip
def test_a_receiver_that_turns_is_met(name: str, share: float) -> None:
    """Bounds are those of 128 meetings at 99.9 %; opened as it stands and by two arcs a quarter to two thirds end outside."""
    rows = run_geometry(SETTINGS[name][1], 128, 11)
    assert np.mean(outside(rows[:, [gk.R_X, gk.R_Y]].T)) < share


def test_late_behind_a_receiver_that_has_turned_it_goes_straight() -> None:
    c = SETTINGS["turn_away_20_link"][1]
    late = [np.sqrt(np.mean(run_geometry(k, 128, 12)[:, gk.R_XR] ** 2)) for k in (c, changed(c, meet_straight=False))]
    assert late[0] < 0.75 * late[1] and late[0] < 0.45 * NM


def test_trade_of_the_first_range_is_the_normal_one() -> None:
    """Two normal populations 1.5 apart: told and false of the threshold against the normal distribution."""
    from scipy.stats import norm

    rng = np.random.default_rng(4)
    near, far = rng.standard_normal(400_000) - 1.5, rng.standard_normal(400_000)
    inside = np.ones(400_000, dtype=bool)
    false_near, said, false_far = trade((near, ~inside), (far, inside), 0.9)
    assert false_near == 0.0 and said == false_far == pytest.approx(norm.cdf(norm.ppf(0.9) - 1.5), abs=3e-3)


def test_known_from_then_on() -> None:
    """Setting of the bound: guidance reads the truth from known_s on, and the receiver's own course with it."""
    c = SETTINGS["turn_away_30_known_60"][1]
    rows = run_geometry(c, 32, 5)
    assert np.median(np.abs(rows[:, gk.R_YR])) < 0.05 * NM and c.truth.turn_at_s == c.known_s == 60.0
    assert tr.P_MT and np.isfinite(rows[:, gk.R_X]).all()
