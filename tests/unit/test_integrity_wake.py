"""The wake position as a source of the bank: what it adds, whom it convicts, and that nobody teaches it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.integrity.integrity import Integrity
from flightsw.missions.receiver.integrity.layout import BOOM, FW, GNSS, OW, REL, WAKE
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.refuel import CONTACT, PRECONTACT
from flightsw.missions.receiver.tanker_link import PeerTracker
from flightsw.types import UPD_FIX, UPD_GNSS, UPD_REL, Health
from tests.unit.integrity_draws import DT, PLACES, Fault, WakeSeen, frames

DRAWS = 3


@dataclass
class Flown:
    """Step by step: error of the bank and bound [N,3] m; sources in use [N]; texts with their times."""

    error: np.ndarray
    pl: np.ndarray
    used: np.ndarray
    bank: Integrity
    texts: list[tuple[float, str]] = field(default_factory=list)


def fly(
    seed: int, seconds: float, phase: int, fault: Fault | None = None, wake: bool = True,
    silent: tuple[float, int] = (np.inf, 0), p: IntegrityParams | None = None,
) -> Flown:  # fmt: skip
    """A draw on a station of `phase`, wandering by 0.3 m; silent: from then on [s] these UPD_* are not there, and no boom."""
    n = round(seconds / DT)
    bank = Integrity(p or IntegrityParams(on=True), load_aircraft("kc135r"), load_aircraft("learjet24"), wake)
    true = PLACES[phase] + 0.3 * np.sin(np.arange(n)[:, None] * DT * np.array([0.2, 0.25, 0.3]))
    peer, air = PeerTracker(), WakeSeen(seed, fault if fault and fault.source == "wake" else None)
    rows, texts = [], []
    for i, (f, sample) in enumerate(frames(seed, true, phase, fault, np.zeros((n, 3)), True)):
        if i % 2 == 0:
            peer.take(sample)
        if i * DT >= silent[0]:
            f.updated &= ~silent[1]
            f.rel_valid, f.boom_contact = f.rel_valid and not silent[1] & UPD_REL, False
        bank.step(f, f.updated, Health(), peer, phase, air.rows(f.t_us, true[i]))
        rows.append((*(np.array(bank.out.pos) - true[i]), *bank.out.pl, bank.out.used))
        texts += [(i * DT, x.text) for x in bank.texts[len(texts) :]]
    a = np.array(rows)
    return Flown(a[:, :3], a[:, 3:6], a[:, 6].astype(int), bank, texts)


@pytest.mark.parametrize("phase", [PRECONTACT, CONTACT], ids=["pre-contact", "contact"])
def test_with_sound_sources_it_makes_the_bound_smaller_across_and_nobody_is_accused(phase: int) -> None:
    with_, without = [], []
    for seed in range(DRAWS):
        got, before = fly(seed, 40.0, phase), fly(seed, 40.0, phase, wake=False)
        for s in (got, before):
            assert s.texts == [] and (np.abs(s.error) <= s.pl).all()
        assert got.used[-1] >> WAKE & 1 and not before.used[-1] >> WAKE & 1
        with_.append(got.pl[400:].mean(axis=0))
        without.append(before.pl[400:].mean(axis=0))
    a, b = np.mean(with_, axis=0), np.mean(without, axis=0)
    if phase == PRECONTACT:
        assert (a[1:] < 0.99 * b[1:]).all() and a[0] == pytest.approx(b[0], rel=0.05)
    else:
        assert (a < 1.03 * b).all()


WALKS = {  # fault: (who is left out in the end)
    "rel walks down": (Fault("rel", 2, walk=0.3, whole=True), REL),
    "rel walks ahead": (Fault("rel", 0, walk=0.3, whole=True), None),
    "gnss walks aside": (Fault("gnss", 1, walk=0.3, whole=True), GNSS),
    "gnss walks ahead": (Fault("gnss", 0, walk=0.3, whole=True), None),
    "wake steps": (Fault("wake", 2, step=8.0), WAKE),
    "wake walks": (Fault("wake", 1, walk=0.3), WAKE),
}


@pytest.mark.parametrize("name", WALKS)
def test_of_three_the_one_that_walks_across_is_found_and_along_nobody_is_blamed(name: str) -> None:
    """Pre-contact, without boom: two sources there cannot tell who walks. The third tells nothing along the tanker's path."""
    fault, out = WALKS[name]
    s = fly(11, 60.0, PRECONTACT, fault)
    assert s.bank.excluded == (0 if out is None else 1 << out), s.texts
    assert s.texts and s.texts[0][0] >= fault.at_s
    assert (np.abs(s.error) <= s.pl).all()
    if out is None:
        assert s.bank.over


def test_who_is_left_out_of_a_filter_teaches_it_nothing_of_the_wake_position() -> None:
    """Two flights that differ by the relative sensor's constant error only: what the filter without it makes of the wake's
    error is the same, what the filter with it makes is not."""
    states = []
    for off in (0.0, 0.4):
        s = fly(3, 30.0, PRECONTACT, Fault("rel", 2, step=off, at_s=0.0), p=IntegrityParams(on=True, rel_const_m=0.5))
        assert s.bank.excluded == 0
        states.append(s.bank.bank.X[:, OW].copy())
    moved = np.abs(states[1] - states[0])[:, 1]
    assert moved[0] > 0.1 and moved[1 + REL] < 0.01


def test_without_relative_sensor_and_boom_it_bounds_what_is_across_and_not_what_is_along() -> None:
    """GNSS left: a minute later the bound across is one to fly by and holds; along, where nothing bears it out, it is none."""
    for seed in range(DRAWS):
        s = fly(20 + seed, 80.0, CONTACT, silent=(20.0, UPD_REL))
        assert s.texts == [] and (np.abs(s.error) <= s.pl).all()
        assert s.used[-1] == 1 << GNSS | 1 << WAKE
        assert (s.pl[-1][1:] < 3.0).all() and s.pl[-1][0] > 20.0
    alone = fly(20, 40.0, CONTACT, silent=(20.0, UPD_REL), wake=False)
    assert (alone.pl[-1] > 20.0).all()


def test_alone_it_vouches_for_nothing() -> None:
    s = fly(5, 40.0, CONTACT, silent=(20.0, UPD_REL | UPD_GNSS | UPD_FIX))
    assert s.used[-1] == 1 << WAKE and (np.abs(s.error) <= s.pl).all()
    assert (s.pl[-1] > 20.0).all() and s.bank.over and not s.bank.rel_confirmed


def test_other_rows_have_another_lasting_error() -> None:
    bank = fly(6, 20.0, CONTACT).bank
    filters = bank.bank
    assert (np.diagonal(filters.P[0])[OW] < 0.5).all()
    filters.wake_anew(np.array([4.0, 9.0]))
    for m in range(filters.size):
        np.testing.assert_allclose(np.diagonal(filters.P[m])[OW], (4.0, 9.0))
        assert not filters.X[m, OW].any() and not filters.X[m, FW].any() and not filters.P[m, OW, :3].any()


@pytest.mark.parametrize("wake", [None, False])
def test_it_is_off_where_the_file_says_so(wake: bool | None) -> None:
    s = fly(1, 12.0, CONTACT, p=IntegrityParams(on=True, wake=wake))
    assert bool(s.used[-1] >> WAKE & 1) == (wake is None) and s.used[-1] >> BOOM & 1
