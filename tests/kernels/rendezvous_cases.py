"""Seeded inputs of the rendezvous kernels for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous import range_filter as k3
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous.guidance import (
    MeetingParams,
    RendezvousGuidanceParams,
    guidance_vector,
    meeting_vector,
)
from flightsw.missions.rendezvous.params import (
    RangeRules,
    RendezvousNavParams,
    eight_vector,
    new_window,
    rules_vector,
    three_vector,
)

Rng = np.random.Generator
Args = list
NM = 1852.0
U = -203.7
E3 = three_vector(RendezvousNavParams(estimator="ekf3"), U)
E8 = eight_vector(RendezvousNavParams(), U)
M = 5


def z(*shape: int) -> np.ndarray:
    return np.zeros(shape)


def three(r: Rng) -> list[np.ndarray]:
    A = r.normal(size=(3, 3)) * np.array([500.0, 5.0, 900.0])[:, None]
    P = A @ A.T + np.diag([1e4, 1.0, 1e4])
    x, i = np.zeros(3), [k3.S3_X, k3.S3_V, k3.S3_Y]
    x[i] = r.uniform(2e4, 5e4), r.normal() * 5, r.normal() * 900
    Q = np.zeros((3, 3))
    Q[np.ix_(i, i)] = P
    return [x, Q]


def bank(r: Rng) -> list[np.ndarray]:
    m, P, lw = z(M, 8), z(M, 8, 8), z(M)
    kb.bank_start(m, P, lw, r.uniform(4e4, 6e4), 0.0, -17e3, r.normal() * 900, 1852.0, 3.5, 1.0, E8)
    D = z(8)
    kb.bank_predict(m, P, lw, 10.0, E8, D)
    return [m, P, lw]


def one(r: Rng) -> list[np.ndarray]:
    m, P, _ = bank(r)
    return [m[2].copy(), P[2].copy()]


def row(r: Rng) -> np.ndarray:
    return np.array([*r.uniform(-1, 1, 5), r.uniform(1e4, 5e4), r.uniform(0, 100), 0.0])


def own(r: Rng) -> np.ndarray:
    o = [*r.uniform(-1e4, 1e4, 2), r.uniform(0, 3), r.uniform(0, 0.5), r.uniform(190, 215), *r.normal(size=2) * 10]
    return np.array([*o, o[-1] / 204.0])


def target(r: Rng) -> np.ndarray:
    return np.array([r.uniform(1e4, 3e4), U + r.normal() * 5, r.uniform(9e3, 2e4), r.normal()])


def step_args(r: Rng) -> Args:
    p = RendezvousGuidanceParams(law=("cross_track", "closed_loop", "two_arc")[int(r.integers(3))])
    gs = z(13)
    gs[0] = float(r.integers(4))
    return [gs, own(r), target(r), 3e4, 0.5, guidance_vector(p), z(9), z(2)]


def turn(r: Rng) -> np.ndarray:
    return np.array([r.uniform(0.1, 0.5), 100.0, r.normal() * 2e3, 0.0, 0.0, 0.0, r.uniform(0.1, 3), 9e3, 7.3e3])


RULES = rules_vector(
    RendezvousNavParams(
        gate_nis=25.0,
        rules=RangeRules(
            believed=2, repeat_m=0.1, young_z=3.7, open=True, open_back=4, open_turn_deg=40.0, open_speed_mps=30.0
        ),
    )
)
MEET = RendezvousGuidanceParams(
    offset_bank_deg=24.5,
    meeting=MeetingParams(
        on=True, straight=True, straight_again=True, doubt=True, leg_sided_s=600.0, leg_sided_share=0.4, speed_sigma=2.0
    ),
)
GP, MP = guidance_vector(MEET), meeting_vector(MEET.meeting)


def window(r: Rng) -> np.ndarray:
    w = new_window(RendezvousNavParams())
    for _ in range(int(r.integers(1, 9))):
        k3.window_push(w, r.normal() * 2.0)
    return w


def judged_args(r: Rng) -> Args:
    m, P, lw = bank(r)
    rs = np.array([float(r.integers(1, 8)), float(r.integers(2)), r.normal() * 3e3, 5e4, 0.0, float(r.integers(8))])
    z0 = r.choice([4.8e4, 5e4, 6e4]) + r.normal() * 300.0
    head = [rs, RULES, m, P, lw, window(r), *memory(r), 80.0, z0, 2000.0, -17e3, 0.0, 1852.0, 3.5, 1.0]
    return [*head, bool(r.integers(2)), E8, z(M, 8), z(8), z(2)]


def memory(r: Rng) -> Args:
    """Four estimates kept, 40 to 70 s old."""
    kept, keptP = z(4, M, 10), z(4, M, 8, 8)
    for i in range(4):
        m, P, lw = bank(r)
        kept[i, :, :8], kept[i, :, 8], kept[i, :, 9], keptP[i] = m, lw, 10.0 * (i + 1), P
    return [kept, keptP]


def ranked(r: Rng) -> np.ndarray:
    return np.array([3.0, 0.0, 0.0, 5e4, 0.0, float(r.integers(8))])


def cov4(r: Rng) -> np.ndarray:
    a = r.normal(size=(4, 4)) * np.array([[300.0], [10.0], [300.0], [10.0]])
    return a @ a.T


def late(r: Rng) -> np.ndarray:
    """A tanker in its turn, 10 NM abeam."""
    return np.array([0.0, 0.0, r.uniform(0.5, 2.5), 0.4, r.uniform(190, 215), 3.0, 2.0, 0.01])


def meeting_state(r: Rng) -> np.ndarray:
    ms = z(kv.M_N)
    ms[kv.M_SIDE] = r.choice([-1.0, 0.0, 1.0])
    ms[kv.M_AWAY] = float(r.integers(2)) if ms[kv.M_SIDE] else 0.0
    ms[kv.M_OUT] = float(r.integers(2))
    ms[kv.M_WAY] = float(r.integers(3))
    return ms


def meeting_args(r: Rng) -> Args:
    gs = z(13)
    gs[0] = float(r.integers(5))
    gs[9] = r.uniform(0.0, 400.0)
    o = own(r)
    o[2] = r.uniform(-3.1, 3.1)
    told = [bool(r.integers(2)), bool(r.integers(2))]
    out = [meeting_state(r), gs, o, target(r), cov4(r), *told, 3e4, 0.5, GP, MP]
    return [*out, z(9), z(2), z(8), z(4), z(8), z(4)]


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.rendezvous.range_filter.ahead": lambda r: [r.uniform(1e4, 5e4), r.uniform(-2e4, 2e4), 305.0],
    "missions.rendezvous.range_filter.ekf3_start": lambda r: [
        *three(r),
        r.uniform(3e4, 6e4),
        100.0,
        -17e3,
        r.normal() * 900,
        1852.0,
        E3,
    ],
    "missions.rendezvous.range_filter.ekf3_predict": lambda r: [*three(r), r.uniform(0.01, 20), E3],
    "missions.rendezvous.range_filter.ekf3_fuse": lambda r: [
        *three(r),
        *r.uniform(-1, 1, 2),
        r.normal() * 200,
        3e4,
        z(2),
    ],
    "missions.rendezvous.range_filter.ekf3_range": lambda r: [
        *three(r),
        r.uniform(3e4, 6e4),
        0.0,
        -17e3,
        r.choice([0.0, 9.0]),
        E3,
        z(2),
    ],
    "missions.rendezvous.range_filter.wrap": lambda r: [r.uniform(-50, 50)],
    "missions.rendezvous.range_filter.ekf3_bearing": lambda r: [*three(r), r.uniform(0, 1), 0.0, -17e3, 1e-3, z(2)],
    "missions.rendezvous.range_filter.ekf3_position": lambda r: [
        *three(r),
        r.uniform(2e4, 5e4),
        r.normal() * 900,
        1e4,
        z(2),
    ],
    "missions.rendezvous.range_filter.window_push": lambda r: [
        np.concatenate((new_window(RendezvousNavParams())[:7], r.normal(size=6))),
        r.normal(),
    ],
    "missions.rendezvous.full_order.discretise": lambda r: [10.0 ** r.uniform(-2, 2), E8, z(8)],
    "missions.rendezvous.full_order.eight_mean": lambda r: [one(r)[0], 10.0, U, r.uniform(0, 1, 8)],
    "missions.rendezvous.full_order.eight_predict": lambda r: [*one(r), 10.0, U, r.uniform(0, 1, 8)],
    "missions.rendezvous.full_order.eight_start": lambda r: [
        *one(r),
        5e4,
        0.0,
        -17e3,
        r.normal() * 900,
        800.0,
        1.0,
        E8,
    ],
    "missions.rendezvous.full_order.slant": lambda r: [*r.uniform(-5e4, 5e4, 2), 305.0, 6.4e6],
    "missions.rendezvous.full_order.range_ekf": lambda r: [*one(r), 0.0, -17e3, E8, z(8)],
    "missions.rendezvous.full_order.quadrature": lambda r: [
        *one(r),
        0.0,
        -17e3,
        bool(r.integers(2)),
        305.0,
        6.4e6,
        z(8),
    ],
    "missions.rendezvous.full_order.range_quadrature": lambda r: [*one(r), 0.0, -17e3, E8, z(8)],
    "missions.rendezvous.full_order.innovation_variance": lambda r: [one(r)[1], row(r), 3.0],
    "missions.rendezvous.full_order.eight_fuse": lambda r: [*one(r), row(r), r.normal() * 100, 4e4, z(8)],
    "missions.rendezvous.bank.bank_start": lambda r: [
        *bank(r),
        r.uniform(4e4, 6e4),
        0.0,
        -17e3,
        0.0,
        1852.0,
        3.5,
        1.0,
        E8,
    ],
    "missions.rendezvous.bank.bank_predict": lambda r: [*bank(r), r.uniform(0.1, 20), E8, z(8)],
    "missions.rendezvous.bank._fuse_all": lambda r: [
        *bank(r),
        5e4,
        False,
        0.0,
        np.array([[0.9, 0.3, 0.0, 1.0, 1.0, 5e4 + 50 * r.normal(), 0.0, 4e4, 0.0] for _ in range(M)]),
        z(8),
        z(2),
        0,
    ],
    "missions.rendezvous.bank.bank_range": lambda r: [
        *bank(r),
        r.uniform(4e4, 5e4),
        2000.0,
        -17e3,
        bool(r.integers(2)),
        0.0,
        E8,
        z(M, 8),
        z(8),
        z(2),
    ],
    "missions.rendezvous.bank.bank_bearing": lambda r: [
        *bank(r),
        r.uniform(0.2, 0.5),
        2000.0,
        -17e3,
        1e-3,
        0.0,
        z(M, 8),
        z(8),
        z(2),
    ],
    "missions.rendezvous.bank.bank_position": lambda r: [*bank(r), 4.5e4, 300.0, 1e4, z(M, 8), z(8), z(2)],
    "missions.rendezvous.bank.bank_axis": lambda r: [*bank(r), bool(r.integers(2)), 300.0, 1e4, z(M, 8), z(8), z(2)],
    "missions.rendezvous.bank.bank_match": lambda r: [*bank(r), z(8), z(8, 8)],
    "missions.rendezvous.bank.bank_mean": lambda r: [bank(r)[0], bank(r)[2], z(8)],
    "missions.rendezvous.bank.reduce_four": lambda r: [*one(r), U, z(4), z(4, 4)],
    "missions.rendezvous.turn_geometry.offset_for_bank": lambda r: [r.uniform(0.3, 0.5), 204.0, 0.1, 20.0, 9.80665],
    "missions.rendezvous.turn_geometry.rollout_lead": lambda r: [r.uniform(-0.5, 0.5), 204.0, 0.087, 9.80665],
    "missions.rendezvous.turn_geometry.ramp_straight": lambda r: [r.uniform(-0.5, 0.5), 0.087],
    "missions.rendezvous.turn_geometry.turn_point": lambda r: [
        own(r),
        target(r),
        0.52,
        0.017,
        3704.0,
        float(r.choice([0.0, 0.087])),
        bool(r.integers(2)),
        9.80665,
        z(9),
    ],
    "missions.rendezvous.turn_geometry.closed_loop_bank": lambda r: [
        turn(r),
        3.0,
        204.0,
        0.52,
        bool(r.integers(2)),
        9.80665,
    ],
    "missions.rendezvous.turn_geometry.two_arcs": lambda r: [
        own(r),
        target(r),
        0.52,
        3704.0,
        0.01,
        0.087,
        9.80665,
        z(2),
    ],
    "missions.rendezvous.turn_law.guidance_reset": lambda r: [
        r.normal(size=13),
        guidance_vector(RendezvousGuidanceParams()),
    ],
    "missions.rendezvous.turn_law.heading_bank": lambda r: [r.normal(), 204.0, 0.2, 0.4, 9.80665],
    "missions.rendezvous.turn_law.approach_bank": lambda r: [
        own(r),
        target(r),
        z(13),
        guidance_vector(RendezvousGuidanceParams()),
    ],
    "missions.rendezvous.turn_law._turn_bank": lambda r: [
        own(r),
        target(r),
        turn(r),
        z(13),
        guidance_vector(RendezvousGuidanceParams()),
        z(2),
    ],
    "missions.rendezvous.turn_law.guidance_step": step_args,
    "missions.rendezvous.turn_geometry.join_lead": lambda r: [
        own(r),
        target(r),
        np.array([0.5, 100.0, 0.0, -r.uniform(0, 9e3), 0.0, float(r.integers(2)), 3.0, 7e3, 7e3]),
        0.23,
        463.0,
    ],
    "missions.rendezvous.range_rules.rules_reset": lambda r: [r.normal(size=kr.RS_N), 5e4],
    "missions.rendezvous.range_rules.window_reset": lambda r: [window(r)],
    "missions.rendezvous.range_rules.young_alarm": lambda r: [window(r), 3.7],
    "missions.rendezvous.range_rules.open_up": lambda r: [*bank(r)[1:], RULES, 20.0],
    "missions.rendezvous.range_rules.fan_out": lambda r: [
        *bank(r),
        0.7,
        30.0,
        int(r.choice([0, M - 2])),
        r.uniform(10, 40),
        100.0,
        E8,
    ],
    "missions.rendezvous.range_rules.keep": lambda r: [*bank(r), 50.0, ranked(r), *memory(r)],
    "missions.rendezvous.range_rules.keep_as": lambda r: [*bank(r), 50.0, int(r.integers(4)), *memory(r)],
    "missions.rendezvous.range_rules.restore": lambda r: [*bank(r), int(r.integers(4)), *memory(r)],
    "missions.rendezvous.range_rules.leave_plan": lambda r: [*bank(r), 80.0, RULES, ranked(r), *memory(r), E8],
    "missions.rendezvous.range_rules.judged_range": judged_args,
    "missions.rendezvous.meeting.meeting_reset": lambda r: [r.normal(size=kv.M_N)],
    "missions.rendezvous.meeting.own_course": lambda r: [
        own(r),
        target(r),
        float(r.choice([-1.0, 1.0])),
        r.normal(),
        204.0,
        z(8),
        z(4),
    ],
    "missions.rendezvous.meeting.choose_side": lambda r: [meeting_state(r), own(r), target(r), GP, MP],
    "missions.rendezvous.judging.outside": lambda r: [*r.normal(size=2) * 2e3, 300.0, 700.0, MP],
    "missions.rendezvous.judging.beyond": lambda r: [*r.normal(size=2) * 1e3, 0.5, MP],
    "missions.rendezvous.judging.less": lambda r: [r.normal() * 1e3, 800.0],
    "missions.rendezvous.judging.judge_turn": lambda r: [
        meeting_state(r),
        r.uniform(0, 10),
        own(r),
        target(r),
        cov4(r),
        bool(r.integers(2)),
        GP,
        MP,
        z(9),
        z(8),
        z(4),
    ],
    "missions.rendezvous.meeting.tight_speed": lambda r: [own(r), target(r), turn(r), GP],
    "missions.rendezvous.leg.fly_leg": lambda r: [meeting_state(r), z(13), own(r), target(r), 300.0, GP, MP],
    "missions.rendezvous.leg.leg_limit": lambda r: [
        meeting_state(r),
        z(13),
        own(r),
        target(r),
        bool(r.integers(2)),
        GP,
        MP,
    ],
    "missions.rendezvous.leg.leg_share": lambda r: [float(r.choice([300.0, 600.0])), MP],
    "missions.rendezvous.meeting.meeting_step": meeting_args,
    "missions.rendezvous.judging.missed": lambda r: [*r.normal(size=2) * 3e3, 3704.0, bool(r.integers(2)), MP],
    "missions.rendezvous.judging.spread": lambda r: [cov4(r), r.normal(), 100.0, z(2)],
    "missions.rendezvous.judging.speed_sigma": lambda r: [cov4(r), r.normal()],
    "missions.rendezvous.straight.behind": lambda r: [late(r), target(r), 0.52, 3704.0, 0.087, 9.80665],
    "missions.rendezvous.straight.arc": lambda r: [r.uniform(0, 3), 3.1, 7e3, 204.0, -200.0, 5.0, z(2)],
    "missions.rendezvous.straight.straight_course": lambda r: [
        late(r),
        target(r),
        r.choice([195.0, 214.0]),
        0.52,
        0.43,
        0.15,
        3704.0,
        0.087,
        9.80665,
        z(2),
    ],
    "missions.rendezvous.straight.late_turn": lambda r: [
        meeting_state(r),
        z(13),
        late(r),
        target(r),
        turn(r),
        GP,
        bool(r.integers(2)),
        z(2),
    ],
    "missions.rendezvous.straight.leg_angle": lambda r: [*r.normal(size=2) * 3e3, -204.0, 3.0, 0.02, 214.0],
}
