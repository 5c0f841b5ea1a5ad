"""The bank behind now: the order it takes readings in, their age, how much motion it expects, one call or step by step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.receiver.integrity import horizon_kernel, kernel, unrest
from flightsw.missions.receiver.integrity.bank import Bank
from flightsw.missions.receiver.integrity.horizon import Horizon
from flightsw.missions.receiver.integrity.layout import AB, B_AT, BOOM, GNSS, NB, REL, ROWS, WAKE, D, U
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.integrity.waiting import NUMBER, ROOM, Waiting, earliest
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import UPD_FIX, UPD_IMU, Gain, PeerFix, PeerState, SensorFrame

P = IntegrityParams()


def test_readings_are_taken_by_their_time_and_of_one_time_as_they_came() -> None:
    """As a stable sort has them, more of them than there is room for at first; of one that is dropped none is taken."""
    rng, waiting = np.random.default_rng(1), Waiting(NB)
    came = [(int(rng.integers(10)), int(rng.integers(3)), k) for k in range(3 * ROOM)]
    for t_us, source, k in came:
        place = waiting.place(source, t_us, ROWS)
        waiting.y[place, 0] = k
        waiting.wait(place)
    waiting.drop(1)
    taken = []
    while (k := earliest(waiting.when)) >= 0:
        got = waiting[k]
        taken.append((got.t_us, got.source, int(got.y[0])))
        waiting.when[k, NUMBER] = -1
    assert taken == sorted((x for x in came if x[1] != 1), key=lambda x: x[0])
    waiting.wait(waiting.place(REL, 5, ROWS))
    assert (
        waiting[0].source == REL and not waiting[0].y.any() and (waiting[0].r == 1.0).all() and not waiting[0].H.any()
    )
    waiting.clear()
    assert earliest(waiting.when) < 0


def test_rows_of_an_older_sample_are_numpys_to_the_bit() -> None:
    rng, age = np.random.default_rng(2), 0.07
    for _ in range(50):
        H, y, a = rng.standard_normal((ROWS, NB)), rng.standard_normal(ROWS), rng.standard_normal(3)
        old, x = H.copy(), y.copy()
        at, by = H[:, D].copy(), H[:, U].copy()
        H[:, U] -= age * at
        H[:, AB] += 0.5 * age * age * at - age * by
        y += ((age * by - 0.5 * age * age * at) * a).sum(axis=1)
        horizon_kernel.seen_from(old, x, age, a)
        assert (old == H).all() and (x == y).all()


@pytest.mark.parametrize("sound", [(True, True), (True, False), (False, True), (False, False)])
def test_the_density_learnt_is_that_of_the_rule(sound: tuple[bool, bool]) -> None:
    """Products of successive innovations, bounded, in the logarithm of the variance; the least of the sources that are sound."""
    learns, rng = unrest.Unrest(P), np.random.default_rng(3)
    top = 2.0 * math.log(P.accel_most / P.accel)
    log, last = [2.0 * math.log(P.accel_start / P.accel)] * 2, np.zeros((2, 3))
    assert learns.density == pytest.approx(P.accel_start)
    for k in range(3000):
        source, z = int(rng.choice([REL, GNSS, BOOM])), rng.standard_normal(ROWS)
        z += 2.0 * math.sin(k / 300.0)
        unrest.hear(learns.learnt, source, z, *sound)
        if source != BOOM:
            now = z[3:]
            turn = float(now @ last[source] - 0.2 * now @ now) / 3.0
            log[source] = float(np.clip(log[source] + 0.01 * np.clip(turn, -2.0, 2.0), 0.0, top))
            last[source] = now
        least = min(log) if sound[0] == sound[1] else log[0] if sound[0] else log[1]
        assert learns.density == pytest.approx(P.accel * math.exp(0.5 * least), rel=1e-9)


def test_one_call_is_step_by_step() -> None:
    """Steps of one length and of others, forks that begin anew, late readings: to the bit as one by one."""
    p, rng = IntegrityParams(fork_s=(0.3, 0.7)), np.random.default_rng(4)
    h, peer = Horizon(p, Bank(p, (12.19, -0.52), wake=True)), PeerTracker()
    twin, way = Bank(p, (12.19, -0.52), wake=True), h._way
    learns = unrest.Unrest(p)
    peer.take(PeerState(t_us=1_000_000, vel_n=(200.0, 0.0, 0.0)))
    d, u = rng.standard_normal(3), rng.standard_normal(3)
    for bank in (h.bank, twin):
        bank.start(1_000_000 - h._lag_us, d, u, (1.0, 2.0, 3.0))
    waits: list[tuple[int, int, np.ndarray, np.ndarray]] = []
    last: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def walk(to_us: int) -> None:
        nonlocal last
        while twin.t_us < to_us:
            end = min(to_us, twin.t_us + 50_000)
            last = way.over(twin.t_us, end, peer)
            blind = max(learns.density, p.accel_blind if way.felt else p.accel_most)
            twin.predict(end, last, learns.density if way.known else blind)

    for k in range(1, 60):
        now = 1_000_000 + 50_000 * k
        acc, gained = rng.standard_normal((2, 3))
        f = SensorFrame(t_us=now, gyro_count=5, att_t_us=now, acc_mean_b=tuple(acc.tolist()))
        f.fix = PeerFix(gain=Gain(now, 0.05, tuple(gained.tolist())))
        h.feel(f, (UPD_IMU if k % 7 else 0) | (UPD_FIX if k % 5 else 0))
        was = way.felt, way.known
        for t_us, source, H, y in sorted((w for w in waits if w[0] <= now - h._lag_us), key=lambda w: w[0]):
            walk(t_us)
            if (age := (twin.t_us - t_us) * 1e-6) > 0.0:
                horizon_kernel.seen_from(H, y, age, np.array(last))
            before = twin.L.copy()
            X, P, L, left_out, by_wake, *_ = twin.arrays
            kernel.heard(X, P, L, left_out, 1 << source, H, y, np.ones(ROWS), ROWS, twin.z)
            if source == WAKE:
                by_wake += L - before
            unrest.hear(learns.learnt, source, twin.z, True, False)
        walk(now - h._lag_us)
        waits = [w for w in waits if w[0] > now - h._lag_us]
        way.felt, way.known = was
        h.advance(now, peer, 1 << REL)
        for part in ("X", "P", "L", "left_out", "_by_wake", "_q", "born_us", "born_L", "z"):
            assert np.array_equal(getattr(h.bank, part), getattr(twin, part))
        assert h.unrest.density == learns.density and h.bank.t_us == twin.t_us
        for source in (REL, GNSS, WAKE):
            # now and then off the grid of the steps, or later than the bank waits for it
            t_us = now - int(rng.choice([0, 0, 20_000, 180_000]))
            H, y = np.zeros((ROWS, twin.n)), rng.standard_normal(ROWS)
            H[:, :B_AT] = rng.standard_normal((ROWS, B_AT))
            waits.append((t_us, source, H, y))
            place = h.waiting.place(source, t_us, ROWS)
            h.waiting.H[place], h.waiting.y[place] = H, y
            h.waiting.wait(place)
