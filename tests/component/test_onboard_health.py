"""Health monitor: ages, ranges, stuck sensors, recovery. Frames by hand, no plant."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from flightsw.health import AIR_ALPHA, AIR_V, WHOLE_PROBE, HealthMonitor, HealthParams
from flightsw.types import (
    HF_AIR,
    HF_ATT,
    HF_GNSS,
    HF_IMU,
    HF_PEER,
    HF_REL,
    UPD_AIR,
    UPD_ATT,
    UPD_GNSS,
    UPD_IMU,
    UPD_PEER,
    UPD_RADALT,
    UPD_REL,
    SensorFrame,
)

ALL = HF_IMU | HF_AIR | HF_ATT | HF_GNSS | HF_REL | HF_PEER
GROUPS = {
    "IMU": (HF_IMU, UPD_IMU, 0.1),
    "air data": (HF_AIR, UPD_AIR, 0.3),
    "attitude": (HF_ATT, UPD_ATT, 0.3),
    "GNSS": (HF_GNSS, UPD_GNSS, 0.5),
    "relative nav": (HF_REL, UPD_REL, 0.5),
    "data link": (HF_PEER, UPD_PEER, 0.5),
}
FIELDS = {
    UPD_IMU: ("gyro_b", "acc_b"),
    UPD_AIR: ("air_V", "air_alpha", "air_beta"),
    UPD_ATT: ("att_q_nb",),
    UPD_GNSS: ("gnss_pos_n", "gnss_vel_n"),
    UPD_REL: ("rel_pos_t", "rel_vel_t"),
}
EVERY = UPD_IMU | UPD_AIR | UPD_ATT | UPD_GNSS | UPD_REL | UPD_PEER


def frame(t_us: int, updated: int = EVERY) -> SensorFrame:
    """A plausible sample of every group; a small change from tick to tick stands for noise."""
    e = 1e-6 * (t_us % 977)
    f = SensorFrame(t_us=t_us, updated=updated)
    f.gyro_b, f.acc_b = (e, 0.0, 0.0), (0.1 + e, 0.0, -9.81)
    f.air_V, f.air_alpha, f.air_beta = (195.0 + e, 195.1 + e), (0.05 + e, 0.05 + e), (e, 0.001 + e)
    f.air_mask = 0b11
    f.att_q_nb = (math.cos(e), math.sin(e), 0.0, 0.0)
    f.gnss_pos_n, f.gnss_vel_n = (100.0 + e, 0.0, -7010.0), (195.0, e, 0.0)
    f.rel_valid, f.rel_pos_t, f.rel_vel_t = True, (-59.0 + e, 56.0, 0.0), (0.0, e, 0.0)
    f.air_t_us = f.att_t_us = f.gnss_t_us = f.rel_t_us = t_us
    f.peer.t_us, f.peer.vel_n, f.peer.q_nb = t_us, (195.0 + e, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    return f


def monitor(watch: int = ALL, **params: float) -> HealthMonitor:
    m = HealthMonitor(HealthParams(**params), watch)
    m.step(frame(0))
    return m


@pytest.mark.parametrize("name", GROUPS)
def test_a_silent_group_is_lost_at_its_age_and_back_with_the_next_good_sample(name: str) -> None:
    flag, upd, age = GROUPS[name]
    m, silent = monitor(), EVERY & ~upd
    last_good = round(age * 1e6)
    for t in range(10_000, last_good + 1, 10_000):
        assert m.step(frame(t, silent))[1].failed == 0
    _, h = m.step(frame(last_good + 10_000, silent))
    assert h.failed == flag
    assert h.reason == name
    assert [t.text for t in m.texts] == [f"{name} lost"]
    m.step(frame(last_good + 20_000, silent))
    assert len(m.texts) == 1  # said once
    _, h = m.step(frame(last_good + 30_000))
    assert h.failed == 0 and h.reason == ""
    assert m.texts[-1].text == f"{name} back"


STAMPS = {HF_AIR: "air_t_us", HF_ATT: "att_t_us", HF_GNSS: "gnss_t_us", HF_REL: "rel_t_us"}


@pytest.mark.parametrize("name", [k for k in GROUPS if k != "IMU"])
def test_a_sample_older_than_its_age_by_its_stamp_is_refused_however_often_it_comes(name: str) -> None:
    flag, upd, age = GROUPS[name]
    m = monitor()
    for t in range(10_000, 2_000_001, 10_000):
        f = frame(t)
        owner, field = (f.peer, "t_us") if flag == HF_PEER else (f, STAMPS[flag])
        setattr(owner, field, t - round(age * 1e6))
        taken, h = m.step(f)
        assert taken.updated & upd and h.failed == 0  # as old as allowed
        setattr(owner, field, t - round(age * 1e6) - 1)
        taken, h = m.step(f)
        assert not taken.updated & upd
    assert h.rejected == 200
    for t in range(2_010_000, 3_000_001, 10_000):
        f = frame(t)
        setattr(f.peer if flag == HF_PEER else f, field, t - 1_000_000)
        taken, h = m.step(f)
        assert not taken.updated & upd
    assert h.failed == flag and h.rejected == 300


def test_groups_the_mission_does_not_need_are_not_reported() -> None:
    m = monitor(HF_IMU)
    for t in range(10_000, 2_000_000, 10_000):
        _, h = m.step(frame(t, UPD_IMU))
    assert h.failed == 0


def test_a_group_that_never_came_gets_five_seconds() -> None:
    m = HealthMonitor(HealthParams(), HF_PEER)
    for t in range(0, 5_500_001, 10_000):
        assert m.step(frame(t, EVERY & ~UPD_PEER))[1].failed == 0
    assert m.step(frame(5_510_000, EVERY & ~UPD_PEER))[1].failed == HF_PEER


BAD = {
    "gyro range": (UPD_IMU, "gyro_b", (0.0, 6.5, 0.0)),
    "gyro nan": (UPD_IMU, "gyro_b", (0.0, math.nan, 0.0)),
    "acceleration range": (UPD_IMU, "acc_b", (0.0, 0.0, -200.0)),
    "acceleration inf": (UPD_IMU, "acc_b", (math.inf, 0.0, 0.0)),
    "airspeed nan": (UPD_AIR, "air_V", (math.nan, math.nan)),
    "airspeed low": (UPD_AIR, "air_V", (5.0, 5.0)),
    "alpha range": (UPD_AIR, "air_alpha", (0.8, -0.8)),
    "beta nan": (UPD_AIR, "air_beta", (math.nan, math.nan)),
    "quaternion zero": (UPD_ATT, "att_q_nb", (0.0, 0.0, 0.0, 0.0)),
    "quaternion nan": (UPD_ATT, "att_q_nb", (math.nan, 0.0, 0.0, 0.0)),
    "GNSS speed": (UPD_GNSS, "gnss_vel_n", (700.0, 0.0, 0.0)),
    "GNSS velocity nan": (UPD_GNSS, "gnss_vel_n", (math.nan, 0.0, 0.0)),
    "GNSS position nan": (UPD_GNSS, "gnss_pos_n", (0.0, math.nan, 0.0)),
    "relative range": (UPD_REL, "rel_pos_t", (6000.0, 0.0, 0.0)),
    "relative invalid": (UPD_REL, "rel_valid", False),
    "relative position nan": (UPD_REL, "rel_pos_t", (0.0, 0.0, math.nan)),
    "relative velocity nan": (UPD_REL, "rel_vel_t", (0.0, 0.0, math.nan)),
    "peer quaternion": (UPD_PEER, "peer.q_nb", (0.0, 0.0, 0.0, 0.0)),
    "peer velocity": (UPD_PEER, "peer.vel_n", (0.0, 900.0, 0.0)),
    "peer position nan": (UPD_PEER, "peer.pos_n", (math.nan, 0.0, 0.0)),
    "peer acceleration nan": (UPD_PEER, "peer.acc_n", (math.nan, 0.0, 0.0)),
    "peer rates nan": (UPD_PEER, "peer.w_b", (math.nan, 0.0, 0.0)),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_sample_is_taken_out_of_the_frame_and_counted(case: str) -> None:
    upd, field, value = BAD[case]
    m, f = monitor(), frame(10_000)
    owner, name = (f.peer, field[5:]) if field.startswith("peer.") else (f, field)
    setattr(owner, name, value)
    f, h = m.step(f)
    assert f.updated == EVERY & ~upd
    assert h.rejected == 1
    assert h.failed == 0  # one bad sample is not a lost sensor
    assert m.step(frame(20_000))[1].failed == 0


def test_one_probe_out_of_range_leaves_the_others_in_use() -> None:
    m, f = monitor(), frame(10_000)
    f.air_V = (195.0, 3.0)
    f, _ = m.step(f)
    assert f.updated & UPD_AIR
    assert f.air_bad == 0b10  # airspeed of the second probe; its flow angles may still serve


def test_readings_taken_one_by_one_outlive_their_neighbours() -> None:
    """A mission on airspeed and incidence keeps the airspeed of a probe whose vane is bad, and needs no sideslip at all."""
    for used, alive in ((AIR_V | AIR_ALPHA, True), (AIR_ALPHA, False), (WHOLE_PROBE, False)):
        m = HealthMonitor(HealthParams(), ALL, used)
        m.step(frame(0))
        for i in range(1, 60):
            f = frame(10_000 * i)
            f.air_V, f.air_alpha, f.air_beta, f.air_mask = (195.0 + 1e-6 * i,), (0.9,), (0.0,), 1
            f, h = m.step(f)
        assert bool(f.updated & UPD_AIR) is alive
        assert bool(h.failed & HF_AIR) is not alive
        assert f.air_bad == 1 << 3 | 1 << 6  # sideslip stuck, incidence out of range
    f.air_V = (math.nan,)
    f, _ = HealthMonitor(HealthParams(), ALL, AIR_V | AIR_ALPHA).step(f)
    assert not f.updated & UPD_AIR


@pytest.mark.parametrize("name", GROUPS)
def test_a_stuck_group_is_refused_after_ten_repeats_then_lost_and_recovers(name: str) -> None:
    flag, upd, age = GROUPS[name]
    m, t0 = monitor(), 10_000
    held = frame(t0)
    accepted = 0
    t = t0
    for k in range(200):
        t = t0 + 10_000 * k
        f = frame(t)
        for field in FIELDS.get(upd, ()):
            setattr(f, field, getattr(held, field))
        if upd == UPD_PEER:
            f.peer.vel_n, f.peer.q_nb = held.peer.vel_n, held.peer.q_nb
        f, h = m.step(f)
        accepted += bool(f.updated & upd)
        if h.failed:
            break
    assert accepted == 10  # the first and nine repeats
    assert h.failed == flag
    # age runs from the last sample that was believed
    assert t - (t0 + 90_000) == pytest.approx(age * 1e6 + 10_000, abs=1)
    assert m.step(frame(t + 10_000))[1].failed == 0


@pytest.mark.parametrize(
    ("case", "fields"),
    [("gyro frozen, accelerometer alive", ("gyro_b",)), ("one probe frozen", ())],
)
def test_part_of_a_group_stuck_is_not_hidden_by_the_rest(case: str, fields: tuple[str, ...]) -> None:
    m, held = monitor(), frame(10_000)
    for k in range(100):
        f = frame(10_000 * (k + 1))
        for name in fields:
            setattr(f, name, getattr(held, name))
        if not fields:
            e = 1e-5 * k
            f.air_V, f.air_alpha, f.air_beta = (197.0, 195.0 + e), (0.05, 0.05 + e), (0.0, e)
        f, _ = m.step(f)
    if fields:
        assert not f.updated & UPD_IMU, case
    else:
        assert f.updated & UPD_AIR, case
        assert f.air_bad == 0b001001001, case


@pytest.mark.parametrize("other", [False, True])
def test_imu_samples_are_refused_by_the_length_of_their_runs(other: bool) -> None:
    """Of values that often repeat, gyroscopes and accelerometers apart; with another channel that repeats all the time or not."""
    r, m = np.random.default_rng(4), HealthMonitor(HealthParams(stuck_samples=3), HF_IMU)
    drawn = [np.repeat(r.permutation(200) * 1e-3, r.integers(1, 7, 200))[:400].tolist() for _ in range(2)]
    runs = [[k for _, g in itertools.groupby(d) for k, _ in enumerate(g)] for d in drawn]
    passed = 0
    for k, (w, a) in enumerate(zip(*drawn, strict=True)):
        f = frame(10_000 * k, UPD_IMU | (UPD_RADALT if other else 0))
        f.gyro_b, f.acc_b, f.radalt_m = (w, 0.0, 0.0), (0.0, a, -9.81), 50.0
        taken = bool(m.step(f)[0].updated & UPD_IMU)
        assert taken == (max(run[k] for run in runs) < 3)
        passed += taken
    assert 100 < passed < 300


def test_air_data_are_judged_reading_by_reading_whatever_they_are() -> None:
    """Rows drawn with repeats, NaN, infinities and values at and beyond the limits, against the rule for a single reading."""
    rng, p = np.random.default_rng(5), HealthParams(stuck_samples=2)
    fast, flow = (
        [19.9, 20.0, 200.0, 400.0, 400.1, math.nan, math.inf],
        [0.7, -0.7, 0.69, 0.1, -0.69, math.nan, -math.inf],
    )
    for used in (WHOLE_PROBE, AIR_V | AIR_ALPHA):
        h, last, same, judged = HealthMonitor(p, ALL, used), [math.nan] * 6, [0] * 6, set()
        for k in range(3000):
            calm = rng.random() < 0.6
            new = [200.0, 210.0, 0.1, -0.1, 0.2, -0.2]
            new = [v + 1e-3 * rng.random() for v in new]
            if not calm:
                new = [rng.choice(fast if i < 2 else flow) if rng.random() < 0.3 else v for i, v in enumerate(new)]
                new = [last[i] if rng.random() < 0.3 else v for i, v in enumerate(new)]
            same = [n + 1 if v == old else 0 for n, v, old in zip(same, new, last, strict=True)]
            last = new
            out_of_range = [not 20.0 <= v <= 400.0 for v in new[:2]] + [not abs(v) < 0.7 for v in new[2:]]
            lost = [
                n >= 2 or out for n, out in zip(same, out_of_range, strict=True)
            ]  # airspeeds, sideslips, incidences
            f = frame(10_000 * k, UPD_AIR)
            f.air_V, f.air_beta, f.air_alpha = tuple(new[:2]), tuple(new[2:4]), tuple(new[4:])
            f.air_mask = int(rng.integers(0, 4))
            got, _ = h.step(f)
            bad = sum(1 << 3 * (i // 2) + i % 2 for i in range(6) if lost[i])
            needed = (0, 4) if used else (0, 2, 4)
            serves = [f.air_mask >> i & 1 and (any if used else all)(not lost[c + i] for c in needed) for i in (0, 1)]
            assert (got.air_bad, bool(got.updated & UPD_AIR)) == (bad, any(serves)), k
            judged.add((bad == 0, any(serves)))
        assert len(judged) == 4
