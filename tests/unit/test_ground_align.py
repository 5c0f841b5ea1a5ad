"""Truth at the times of estimates: against numpy and scipy, exact where stamps agree, nothing beyond the rows there are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from ground.align import GAP_US, align, seconds
from ground.columns import Table
from ground.link.packets import DTYPES, IDS

STEP_US = 50_000
Ints = NDArray[np.int64]


def truth(t_us: Ints) -> Table:
    """Rows with straight lines in every vector, a heading that passes +-180 deg and a flag."""
    rows = np.zeros(len(t_us), dtype=DTYPES[IDS["TRUTH"]])
    t = t_us * 1e-6
    rows["time_usec"] = t_us
    rows["pos_n"] = np.stack([100.0 * t, -3.0 * t, 0.0 * t], axis=1)
    psi = np.radians(170.0 + 40.0 * t)
    rows["q_nb"] = (
        np.stack([np.cos(psi / 2), 0 * t, 0 * t, np.sin(psi / 2)], axis=1) * np.where(t_us % 3 == 0, 1, -1)[:, None]
    )
    rows["boom_azimuth"] = (psi + np.pi) % (2 * np.pi) - np.pi
    rows["contact"] = t_us >= 400_000
    return Table(t_us, np.zeros(len(t_us), dtype=np.int64), rows)


@given(st.lists(st.integers(-100_000, 1_100_000), min_size=1, max_size=60))
def test_lines_circles_and_flags(times: list[int]) -> None:
    """Right to a microsecond of path; what lies outside the rows is left out and counted."""
    source = np.arange(0, 1_000_001, STEP_US)
    t_us = np.array(sorted(times), dtype=np.int64)
    a = align(source, t_us)
    inside = np.unique(t_us[(t_us >= 0) & (t_us <= 1_000_000)])
    assert t_us[a.at].tolist() == inside.tolist() and a.left_out == len(t_us) - len(inside)
    if not len(inside):
        return
    got, true = a.table(truth(source)), truth(inside)
    assert got.t_us.tolist() == got["time_usec"].tolist() == inside.tolist()
    np.testing.assert_allclose(got["pos_n"], true["pos_n"], atol=1e-9)
    apart = (
        Rotation.from_quat(got["q_nb"], scalar_first=True) * Rotation.from_quat(true["q_nb"], scalar_first=True).inv()
    )
    assert np.abs(apart.magnitude()).max() < 1e-6  # the chord against the arc, over 2 deg
    np.testing.assert_allclose(np.linalg.norm(got["q_nb"], axis=1), 1.0, atol=1e-12)
    turn = np.angle(np.exp(1j * (got["boom_azimuth"].astype(float) - true["boom_azimuth"])))
    assert np.abs(turn).max() < 1e-6
    assert got["contact"].tolist() == true["contact"].tolist()


def test_quaternions_against_slerp() -> None:
    rng = np.random.default_rng(1)
    steps = Rotation.from_rotvec(rng.normal(0.0, 0.05, (40, 3)))
    turns = [Rotation.identity()]
    for s in steps:
        turns.append(turns[-1] * s)
    source = np.arange(len(turns)) * STEP_US
    t_us = np.sort(rng.integers(0, source[-1], 200))
    a = align(source, t_us)
    q = a.quaternions(Rotation.concatenate(turns).as_quat(scalar_first=True) * rng.choice([-1, 1], (len(turns), 1)))
    want = Slerp(source, Rotation.concatenate(turns))(t_us[a.at])
    error = (Rotation.from_quat(q, scalar_first=True) * want.inv()).magnitude()
    assert error.max() < 2e-5  # theta^3 / (72 sqrt 3) at theta = 0.2 rad is 6e-5


def test_equal_stamps_give_the_rows_themselves() -> None:
    """To the bit, whatever lies around them; also where the rows are far apart."""
    source = np.array([0, 10, 5_000_000, 9_000_000])
    values = np.array([0.1, 0.2, np.nan, 0.3], dtype=np.float32)
    a = align(source, source)
    assert a.of(values).tobytes() == values.tobytes() and a.left_out == 0
    table = truth(source)
    assert a.table(table).rows.tobytes() == table.rows.tobytes()


def test_gaps_repeats_and_disorder_are_left_out() -> None:
    source = np.array([0, 50_000, 50_000, 100_000, 100_000 + GAP_US, 201_000 + 2 * GAP_US])
    t_us = np.array([-1, 0, 25_000, 75_000, 75_000, 150_000, 250_000, 400_000, 500_000])
    a = align(source, t_us)
    # 25 000: between two rows; 75 000: a repeated row before it, no neighbours; 250 000: in a gap too wide
    assert t_us[a.at].tolist() == [0, 25_000, 150_000] and a.left_out == 6
    assert a.of(source.astype(float)).tolist() == [0.0, 25_000.0, 150_000.0]
    assert len(align(np.empty(0, dtype=np.int64), t_us)) == 0


def test_time_is_the_same_however_irregular_the_samples() -> None:
    """20 s of contact, sampled regularly, and with a tenth of the samples missing here and there."""
    t_us = np.arange(0, 60_000_000, 100_000)
    mask = (t_us >= 20_000_000) & (t_us < 40_000_000)
    assert seconds(t_us, mask) == 200 * 0.1
    keep = np.random.default_rng(1).random(len(t_us)) > 0.1
    assert seconds(t_us[keep], mask[keep]) == pytest.approx(20.0, abs=0.3)
    assert seconds(t_us[:1], mask[:1]) == 0.0


def test_a_silence_counts_for_one_second() -> None:
    t_us = np.concatenate([np.arange(0, 10_000_000, 100_000), np.arange(50_000_000, 60_000_000, 100_000)])
    assert seconds(t_us, np.ones(len(t_us), dtype=bool)) == pytest.approx(10.0 + 0.9 + 10.0)
