"""The receiver's way from the tanker while the protection has it: to which side."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.kernels.rotations import quat_from_euler
from flightsw.missions.receiver.rejoin import behind
from flightsw.types import NavState, PeerState, SensorFrame


def side(bank_deg: float, y_m: float, seen: bool = True) -> float:
    """+1 right, -1 left, behind a tanker banked so, y_m to the right of its plane of symmetry."""
    q = np.zeros(4)
    quat_from_euler(0.7, 0.03, math.radians(bank_deg), q)
    peer = PeerState(t_us=10_000_000, q_nb=(float(q[0]), float(q[1]), float(q[2]), float(q[3])))
    f = SensorFrame(t_us=10_050_000, gnss_t_us=10_000_000, peer=peer)
    f.rel_valid, f.rel_t_us, f.rel_pos_t = seen, 10_000_000, (-35.0, y_m, 8.0)
    return behind(f, NavState()).side


@pytest.mark.parametrize(
    ("bank_deg", "y_m", "way"),
    [(0.0, 0.0, 1.0), (0.0, -3.0, -1.0), (0.0, 3.0, 1.0), (30.0, 0.0, -1.0), (30.0, 3.0, -1.0), (-30.0, 0.0, 1.0),
     (-30.0, -3.0, 1.0), (30.0, 8.0, 1.0), (-30.0, -8.0, -1.0)],
)  # fmt: skip
def test_it_leads_away_from_the_tanker_and_close_to_it_out_of_its_turn(bank_deg: float, y_m: float, way: float) -> None:
    assert side(bank_deg, y_m) == way


def test_unseen_it_leads_out_of_the_turn() -> None:
    assert side(30.0, 8.0, seen=False) == -1.0
