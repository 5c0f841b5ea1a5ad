"""The bank's verdict and the rows it goes by, each one compiled call, against the rules as they are written down."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.integrity import judge_kernel, kernel
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.layout import AT, GNSS, GV, NB, OB, RC, REL, ROWS, RS, RV, WAKE, D, G, U
from flightsw.missions.receiver.integrity.layout import BOOM as BOOM_SOURCE
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.readings import Readings
from flightsw.missions.receiver.integrity.waiting import Reading, Waiting
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import PeerFix, PeerState, SensorFrame

P = IntegrityParams()
BOOM = (12.19, -0.52)


def flying(rng: np.random.Generator) -> Bank:
    """A bank whose filters lie apart, one of them by much now and then."""
    bank = Bank(P, BOOM)
    bank.start(0, np.array([59.0, -20.0, 6.0]), np.zeros(3), (-59.0, 20.0, 6.0))
    for m in range(1, bank.size):
        root = 0.1 * rng.standard_normal((bank.n, bank.n))
        bank.P[m] += root @ root.T
    bank.X += rng.standard_normal(bank.X.shape) * rng.choice([0.1, 30.0, 100.0])
    bank.L[:], bank.born_L[:] = rng.normal(0.0, 12.0, bank.size), rng.normal(0.0, 3.0, len(bank.born_L))
    bank.stand(150_000, judge_kernel.stand(bank.X, np.eye(3).ravel(), -59.0, 20.0, 6.0, 0.15, bank.place), 0.3)
    return bank


@pytest.mark.parametrize("live", [0, 1, 2, 3, 5, 7])
def test_levels_tests_and_likelihoods_are_those_of_the_rules(live: int) -> None:
    """separation.md 3 to 5: every standing filter that has heard its source bounds, the forks of those that live accuse."""
    blamed = set()
    for seed in range(40):
        rng = np.random.default_rng(seed)
        bank, heard = flying(rng), live | int(rng.integers(8))
        run = rng.integers(0, P.alarm_steps, bank.size)
        bank._run[:] = run
        v = bank.judge(live, heard)
        off, own, z = bank._off, bank._own, bank._z
        some = [k for k in range(WAKE) if live >> k & 1]
        beyond = np.where(z > P.k_alarm, run + 1, 0)
        failed = (z > P.k_once) | (beyond >= P.alarm_steps)
        bounds = [
            P.k_fault_free * own[0],
            *(off[1 + k] + P.k_missed * own[1 + k] for k in range(WAKE) if heard >> k & 1),
        ]
        assert v.pl == tuple(np.max(bounds, axis=0).tolist())
        ratio, scores, disagree, who, top = [0.0] * 4, [0.0] * 4, False, -1, 0.0
        asked = {1 + k for k in range(WAKE) if heard >> k & 1}
        for k in some:
            ratio[k] = z[1 + k] / P.k_alarm if heard >> k & 1 else 0.0
            disagree = disagree or bool(len(some) > 1 and heard >> k & 1 and failed[1 + k])
        for slot in range(len(bank.slots) if len(some) > 1 else 0):
            first = 1 + WAKE * (1 + slot)
            said = {k: float(bank.L[first + k] - (bank.L[0] - bank.born_L[slot])) for k in some}
            asked |= {first + k for k in some}
            for k in some:
                ratio[k] = max(ratio[k], z[first + k] / P.k_alarm, said[k] / P.llr_alarm)
                disagree = disagree or bool(failed[first + k])
            second, best = sorted(said.values())[-2:]
            if best > P.llr_alarm:
                disagree = True
                if best > second + P.llr_ahead and best > top:
                    who = max(said, key=said.__getitem__)
            scores = [max(scores[k], said.get(k, 0.0)) for k in range(4)]
            top = max(scores)
        assert (v.ratio, v.scores, v.disagree, v.blamed) == (tuple(ratio), scores, disagree, who)
        assert all(bank._run[m] == (beyond[m] if m in asked else run[m]) for m in range(bank.size))
        blamed.add(who)
    assert blamed > {-1} if len(some) > 1 else blamed == {-1}


def test_the_place_in_tanker_axes_turns_with_the_attitudes_error() -> None:
    """xi = exp(-[a x]) C d to first order in a."""
    rng = np.random.default_rng(2)
    C, d, lead = Rotation.from_rotvec([0.1, 0.2, -0.4]).as_matrix(), rng.normal(0.0, 30.0, 3), 0.15
    X, place = np.zeros((1, NB)), np.full((3, NB), 7.0)
    place[:, 9:] = place[:, 6:9] = 0.0
    a = X[0, AT] = 1e-5 * rng.standard_normal(3)
    xi = judge_kernel.stand(X, C.ravel(), *d.tolist(), lead, place)
    np.testing.assert_allclose(xi, Rotation.from_rotvec(-a).as_matrix().T @ C @ d, rtol=0.0, atol=1e-7)
    x = np.zeros(NB)
    x[D], x[U], x[AT] = d, rng.standard_normal(3), a
    np.testing.assert_allclose(place @ x, np.array(xi) + lead * C @ x[U], rtol=0.0, atol=1e-7)


def offered(rows: Readings, source: int, f: SensorFrame, peer: PeerTracker, t_us: int, d: np.ndarray) -> Reading | None:
    """The reading of one source at t_us of a receiver at d [3] m NED; None: there is none. It is as far off as a reading is that
    the bank is asked about by itself."""
    bank, waiting, path = Bank(P, BOOM), Waiting(NB), np.array([[float(t_us), *d, 0.0, 0.0, 0.0]])
    bank.start(t_us - 100_000, d, np.zeros(3), (1.0, 2.0, 3.0))
    for k in range(20):  # more of them than there is room for at first
        waiting.wait(waiting.place(WAKE, k, 1))
    said = rows.offer(1 << source, f, peer, waiting, bank, path, 1, 0.1)
    if not said:
        return None
    ((who, when, k, off),) = said
    assert (who, when) == (source, t_us) and off == bank.surprise(waiting[k], path, 1, 0.1)
    return waiting[k]


def test_a_relative_reading_is_what_the_sensor_would_read() -> None:
    """H times a state is the reading of that state; the tanker turns and moves on by its last sample."""
    ac, rng = load_aircraft("learjet24"), np.random.default_rng(3)
    rows, peer = Readings(P, load_aircraft("kc135r"), ac), PeerTracker()
    q = Rotation.from_rotvec([0.05, -0.1, 0.3])
    x, y, z, w = q.as_quat().tolist()
    rate = np.array([0.01, -0.02, 0.03])
    peer.take(PeerState(t_us=1_000_000, q_nb=(w, x, y, z), w_b=tuple(rate.tolist())))
    f = SensorFrame(
        t_us=1_100_000, rel_t_us=1_060_000, rel_valid=True, rel_pos_t=(-59.0, 20.0, 6.0), rel_vel_t=(0.1, 0.2, 0.3)
    )
    C = (q * Rotation.from_rotvec(0.06 * rate)).as_matrix().T
    d, u = C.T @ np.array([-58.0, 21.0, 7.0]), rng.standard_normal(3)
    got = offered(rows, REL, f, peer, f.rel_t_us, d)
    assert got is not None
    state = np.zeros(NB)
    state[D], state[U] = d, u
    state[RS], state[RC], state[RV] = rng.standard_normal((3, 3))
    xi = C @ d
    want = [*(xi + state[RS] + state[RC]), *(C @ u - np.cross(rate, xi) + state[RV])]
    np.testing.assert_allclose(got.H @ state + [0, 0, 0, *-np.cross(rate, xi)], want, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(got.y, [*f.rel_pos_t, *(f.rel_vel_t + np.cross(rate, xi))], rtol=0.0, atol=1e-10)
    vel = P.rel_vel_mps**2 + P.rate_radps**2 * float(xi @ xi)
    np.testing.assert_allclose(got.r, [P.rel_pos_m**2] * 3 + [vel] * 3, rtol=1e-10)
    assert (got.source, got.t_us, got.count) == (REL, f.rel_t_us, 6)


def test_a_difference_of_fixes_is_of_one_instant() -> None:
    """The own fix nearest to the tanker's, of two as near the older, carried to its time; none where none is near."""
    rows, rng, state = (
        Readings(P, load_aircraft("kc135r"), load_aircraft("learjet24")),
        np.random.default_rng(5),
        np.zeros(NB),
    )
    own = {k * 40_000: rng.standard_normal((2, 3)) for k in range(20)}
    for t_us, (pos, vel) in own.items():
        rows.own(SensorFrame(gnss_t_us=t_us, gnss_pos_n=tuple(pos.tolist()), gnss_vel_n=tuple(vel.tolist())))
    other = rng.standard_normal((2, 3))
    for t_us, of in ((610_000, 600_000), (740_000, 720_000), (820_000, 760_000), (821_000, None), (259_000, None)):
        fix = PeerFix(t_us, tuple(other[0].tolist()), tuple(other[1].tolist()))
        got = offered(rows, GNSS, SensorFrame(t_us=900_000, fix=fix), PeerTracker(), t_us, np.zeros(3))
        if of is None:
            assert got is None
            continue
        assert got is not None and got.count == 6
        pos, vel = own[of]
        np.testing.assert_allclose(got.y, [*(pos + vel * (t_us - of) * 1e-6 - other[0]), *(vel - other[1])], atol=1e-12)
        state[D], state[U], state[G], state[GV] = rng.standard_normal((4, 3))
        np.testing.assert_allclose(got.H @ state, [*(state[D] + state[G]), *(state[U] + state[GV])], atol=1e-12)
        np.testing.assert_allclose(got.r, [2.0 * P.gnss_pos_m**2] * 3 + [2.0 * P.gnss_vel_mps**2] * 3, rtol=1e-12)


def test_a_latched_boom_reads_where_its_tip_is() -> None:
    """Pivot and boom less the receptacle's lever, turned by both attitudes, is the position, the boom's fixed error with it."""
    tanker, ac = load_aircraft("kc135r"), load_aircraft("learjet24")
    boom, receptacle = tanker.boom, ac.receptacle
    assert boom is not None and receptacle is not None
    rows, peer, rate = Readings(P, tanker, ac), PeerTracker(), np.array([0.01, -0.02, 0.03])
    q, own = Rotation.from_rotvec([0.05, -0.1, 0.3]), Rotation.from_rotvec([-0.02, 0.08, 0.4])
    x, y, z, w = q.as_quat().tolist()
    peer.take(PeerState(t_us=1_000_000, q_nb=(w, x, y, z), w_b=tuple(rate.tolist())))
    x, y, z, w = own.as_quat().tolist()
    f = SensorFrame(
        t_us=1_100_000,
        boom_t_us=1_060_000,
        boom_elevation=-0.5,
        boom_azimuth=0.1,
        boom_extension_m=4.0,
        att_q_nb=(w, x, y, z),
    )
    now = q * Rotation.from_rotvec(0.06 * rate)
    length = boom.length_retracted_m + 4.0
    tip = length * np.array([-math.cos(-0.5) * math.cos(0.1), math.cos(-0.5) * math.sin(0.1), -math.sin(-0.5)])
    xi = boom.pivot_m + tip - now.inv().apply(own.apply(receptacle.position_m))
    state = np.zeros(NB)
    state[D], state[OB] = now.apply(xi), (0.03, -0.02, 0.01)
    got = offered(rows, BOOM_SOURCE, f, peer, f.boom_t_us, state[D])
    assert got is not None and (got.source, got.t_us, got.count) == (BOOM_SOURCE, f.boom_t_us, 3)
    np.testing.assert_allclose(got.y[:3], xi, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose((got.H @ state)[:3], xi + state[OB], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(got.r[:3], (P.boom_angle_rad * length) ** 2 + P.boom_ext_m**2, rtol=1e-12)


def test_a_reading_of_later_is_judged_as_by_a_bank_that_has_come_there() -> None:
    """Rows moved back in time and innovations against filter 0, in one call and in two."""
    rng, bank = np.random.default_rng(4), Bank(P, BOOM)
    bank.start(1_000_000, rng.standard_normal(3), rng.standard_normal(3), (1.0, 2.0, 3.0))
    H, y, r = rng.standard_normal((ROWS, NB)), rng.standard_normal(ROWS), rng.uniform(1.0, 2.0, ROWS)
    now, then = rng.standard_normal((2, 3)), rng.standard_normal((2, 3))
    reading, tau, density = Reading(REL, 1_200_000, H, y, r, ROWS), 0.2, 0.7
    path = np.array([[1_000_000.0, *then.ravel()], [1_200_000.0, *now.ravel()]])
    got = bank.surprise(reading, path, 2, density)
    H0, y0, r0, z = np.empty_like(H), np.empty(ROWS), np.empty(ROWS), np.empty(ROWS)
    gained = now[0] - then[0] - tau * then[1]
    kernel.ahead(H, y, r, tau, *gained.tolist(), *(now[1] - then[1]).tolist(), density**2 * tau, H0, y0, r0)
    assert got == pytest.approx(kernel.innovations(bank.X[0], bank.P[0], H0, y0, r0, ROWS, z), rel=1e-12)
    np.testing.assert_allclose(bank.z, z, rtol=1e-12)
    assert math.isfinite(got)
