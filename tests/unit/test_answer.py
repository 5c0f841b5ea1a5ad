"""What of a surface's deflection lasts: a gyro that jumps makes a moment of one step, a surface one that stays."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.sixdof.recovery.answer import ELEVATOR, Answer

DT = 0.05


def lasts(off: list[float]) -> float:
    """Of the elevator, off by so much [rad] in the last steps."""
    a = Answer(load_aircraft("kc135r"), DT)
    a._off[: len(off), ELEVATOR] = off
    a._n = len(off)
    return a._lasts(ELEVATOR)


def test_one_step_of_a_gyro_that_jumps_is_no_deflection() -> None:
    assert lasts([0.0, 0.0, 0.0, 0.0, 0.0, -0.9]) == 0.0


@pytest.mark.parametrize("x", [0.1, -0.2])
def test_a_deflection_that_stays_is_one(x: float) -> None:
    assert lasts([x] * 6) == pytest.approx(x)
    assert np.sign(lasts([0.0, 0.0, 0.0, 0.3 * x, 0.6 * x, x])) == np.sign(x)
