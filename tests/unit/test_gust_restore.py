"""Snapshot and restore in mid-flight: the same readings then give the same bytes."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.missions.gust.estimate import BASIC, GustParams
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.law import GustAlleviation
from flightsw.missions.gust.servos import GustServos

TRIM = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
MAKERS = {
    "ekf": GustNav,
    "bank": lambda: GustNav(GustParams(scales=(0.01, 0.1, 1.0), mix=True)),
    "srukf": lambda: GustNav(GustParams(filter="srukf", scales=(0.1, 0.3))),
    "linear": lambda: GustNav(GustParams(filter="kalman", model="linear")),
    "printed": ConstantGainGust,
}


@pytest.mark.parametrize("kind", MAKERS)
def test_loop_continues_from_a_snapshot_as_if_it_had_not_stopped(kind: str) -> None:
    r = np.random.default_rng(1)
    y = TRIM + 0.02 * r.standard_normal((120, 7))

    def fly(parts: tuple, lo: int, hi: int) -> bytes:
        nav, law, servos = parts
        out = b""
        for i in range(lo, hi):
            nav.step(y[i], BASIC, servos.mean, 0.02, servos.now)
            servos.send(law.step(nav.x, servos))
            servos.step(0.02)
            out += nav.x.tobytes() + law.command.tobytes() + servos.now.tobytes()
        return out

    first = (MAKERS[kind](), GustAlleviation(), GustServos())
    fly(first, 0, 60)
    saved = [part.get_state() for part in first]
    went_on = fly(first, 60, 120)
    other = (MAKERS[kind](), GustAlleviation(), GustServos())
    for part, state in zip(other, saved, strict=True):
        part.set_state(state)
    assert fly(other, 60, 120) == went_on
    for part, state in zip(first, saved, strict=True):
        part.set_state(state)
    assert fly(first, 60, 120) == went_on
