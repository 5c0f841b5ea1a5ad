"""Seeded inputs of the kernels of bearings and positions at a rate of their own, for the bit test (test_onboard_bits.py)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from flightsw.missions.rendezvous import aid_errors as ka
from flightsw.missions.rendezvous import bank as kb
from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous.params import Aids, eight_vector, fixes_vector, plain_rules, rules_vector
from hil_scripts.studies.rivard.geometry_mc import NAV
from tests.kernels.rendezvous_cases import U, row, window, z

Rng = np.random.Generator
Args = list
M, K = 9, 6
P = replace(NAV, components=M, aids=Aids(on=True, kept=K))
E, FP, RP = eight_vector(P, U), fixes_vector(P), rules_vector(P)


def bank(r: Rng) -> Args:
    m, C, lw = z(M, ka.N14), z(M, ka.N14, ka.N14), z(M)
    kb.bank_start(m, C, lw, r.uniform(4e4, 6e4), 0.0, -17e3, r.normal() * 900, 1852.0, 3.5, 1.0, E)
    kb.bank_predict(m, C, lw, 10.0, E, z(8))
    for along, at in ((True, 4.4e4), (False, 200.0)):
        kb.bank_axis(m, C, lw, along, at + 100.0 * r.normal(), FP[kf.FP_RL], z(M, 8), z(ka.N14), z(2))
    return [m, C, lw]


def one(r: Rng) -> Args:
    m, C, _ = bank(r)
    return [m[2].copy(), C[2].copy()]


def heard(r: Rng, count: int) -> Args:
    """State, then room in which so much has been heard: positions and one range that was refused."""
    fs, kept, keptP, notes = z(kf.FS_N), z(K, M, ka.N14 + 2), z(K, M, ka.N14, ka.N14), z(K, kf.F_N)
    for i in range(count):
        kind = kf.IS_REFUSED if i == 1 else kf.IS_POSITION
        kf.note(fs, FP, *bank(r), kept, keptP, notes, 4.0 * i, kind, 4.4e4, 200.0, 2000.0, -17e3, E)
    fs[list(kf.FS_VAR)] = 3.0
    return [fs, kept, keptP, notes]


def tail() -> Args:
    return [E, z(M, 8), z(ka.N14), z(2)]


def a_range(r: Rng) -> Args:
    fs, kept, keptP, notes = heard(r, int(r.integers(1, 9)))
    rs = np.array([float(r.integers(1, 8)), float(r.integers(2)), 3e3, 5e4, 0.0, 0.0])
    d = r.choice([4.6e4, 4.9e4]) + r.normal() * 100.0
    head = [fs, FP, rs, RP, plain_rules(RP), *bank(r), window(r), kept, keptP, notes, 80.0, d, 2000.0, -17e3]
    return [*head, 0.0, 1852.0, 3.5, 1.0, True, *tail()]


def a_fix(r: Rng) -> Args:
    fs, kept, keptP, notes = heard(r, int(r.integers(1, 9)))
    kind, v, y = [(kf.IS_BEARING, 0.38, 0.0), (kf.IS_POSITION, 4.4e4, 200.0), (kf.IS_POSITION, 4.4e4, 3e3)][
        r.integers(3)
    ]
    head = [fs, FP, z(kr.RS_N), RP, *bank(r), window(r), kept, keptP, notes]
    return [*head, 40.0, kind, v, y, 2000.0, -17e3, True, *tail()]


def opened(r: Rng) -> Args:
    fs, kept, keptP, notes = heard(r, int(r.integers(2, 9)))
    return [fs, FP, RP, *bank(r), window(r), kept, keptP, notes, True, *tail()]


CASES: dict[str, Callable[[Rng], Args]] = {
    "missions.rendezvous.aid_errors.errors_start": lambda r: [z(ka.N14, ka.N14), E],
    "missions.rendezvous.aid_errors.errors_predict": lambda r: [*one(r), r.uniform(0.1, 20.0), E],
    "missions.rendezvous.aid_errors.aided_variance": lambda r: [*one(r), row(r), 3.0, int(r.choice([0, ka.BC, ka.LYC]))],
    "missions.rendezvous.aid_errors.aided_fuse": lambda r: [*one(r), row(r), 100.0, 4e4, z(ka.N14), ka.LXC],
    "missions.rendezvous.fix_rules.fixes_reset": lambda r: [r.normal(size=kf.FS_N)],
    "missions.rendezvous.fix_rules.stir": lambda r: [np.abs(r.normal(size=kf.FS_N)) * 30.0, FP, *bank(r), 20.0, E],
    "missions.rendezvous.fix_rules.sum_push": lambda r: [
        np.abs(r.normal(size=kf.FS_N)), int(r.integers(3)), r.normal(), 9.0, 5.0,
    ],
    "missions.rendezvous.fix_rules.fuse_heard": lambda r: [
        np.array([30.0, float(r.integers(4)), *((4.6e4, 0.0) if r.integers(2) else (0.4, 100.0)), 2000.0, -17e3]),
        np.abs(r.normal(size=kf.FS_N)), FP, *bank(r), True, *tail(),
    ],
    "missions.rendezvous.fix_rules.note": lambda r: [
        *(lambda h: [h[0], FP, *bank(r), *h[1:]])(heard(r, 3)), 20.0, kf.IS_BEARING, 0.4, 0.0, 2000.0, -17e3, E,
    ],
    "missions.rendezvous.fix_rules.reopen": opened,
    "missions.rendezvous.fix_rules.heard_fix": a_fix,
    "missions.rendezvous.fix_rules.heard_range": a_range,
}  # fmt: skip
