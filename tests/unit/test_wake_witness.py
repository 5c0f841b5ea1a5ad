"""Rows of the air data for the bank of relative position: the place itself, its noise and lasting error, what does not enter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata import expected as kp
from flightsw.missions.receiver.airdata.params import WakePositionParams
from flightsw.missions.receiver.airdata.wake_model import WakeParams, wake_vector
from flightsw.missions.receiver.airdata.witness import WakeRows, WakeWitness

PROBES = np.array([q.position_m for q in load_aircraft("learjet24").probe])
WK = wake_vector(WakeParams(mass_kg=119000.0, wing_m=(-0.27, 0.0, 0.52), tail_m=(-17.92, 0.0, -1.47)))
P = WakePositionParams(offset_V=0.3, offset_flow=1.75e-3)
SIGMA = np.repeat([P.sigma_V, P.sigma_beta, P.sigma_alpha], 3)
AT = np.array([-35.6, 0.3, 8.9])  # contact [m, F]
ALL, NO_AIR = 0x1FF, np.zeros((9, 9))
C = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # NED to F: heading east


def frame(x: float) -> np.ndarray:
    g = np.zeros(kp.G_SIZE)
    g[kp.G_X], g[kp.ATTITUDE], g[kp.G_V], g[kp.G_RHO] = x, (0.0, 0.05, 0.0), 195.0, 0.59
    return g


def readings(at: np.ndarray, wind: tuple[float, float, float] = (0.0, 0.0, 0.0), **wake: float) -> np.ndarray:
    """What sound probes read at a place [3] m, F; wake: circulation factors and height that are other than believed."""
    p, h = np.zeros(10), np.zeros(9)
    p[kp.P_Y], p[kp.P_Z], p[kp.P_W :] = at[1], at[2], wind
    p[kp.P_KW], p[kp.P_KT], p[kp.P_H] = 1.0 + wake.get("kw", 0.0), 1.0 + wake.get("kt", 0.0), wake.get("h", 0.0)
    kp.expected(p, frame(at[0]), PROBES, WK, False, h, np.empty((0, 0)))
    return h


def rows(w: WakeWitness, y: np.ndarray, near: np.ndarray = AT, use: int = ALL, own: np.ndarray = NO_AIR) -> WakeRows:
    got = w.step(1, y, use, frame(near[0]), WK, near, own, C)
    assert got is not None
    return got


def off(got: WakeRows, at: np.ndarray) -> np.ndarray:
    return np.asarray(got.y - got.H @ C.T @ at)


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (2.0, -3.0, 2.0)])
def test_the_rows_hold_at_the_true_place_whatever_the_wind_common_to_the_probes(
    wind: tuple[float, float, float],
) -> None:
    """Slopes taken half a metre aside in y and z, two along: the rows are of the place, not of where they were taken."""
    for d in ([0.0, 0.0, 0.0], [0.0, 0.4, -0.3], [2.0, 0.0, 0.3]):
        got = rows(WakeWitness(PROBES, P), readings(AT, wind), AT + np.array(d))
        assert np.abs(off(got, AT)).max() < 0.1
    assert np.abs(np.linalg.det((got.H @ C.T)[:, 1:])) == pytest.approx(1.0, abs=0.05)  # across and down, a turn


def test_what_is_along_the_path_does_not_show() -> None:
    """Two metres ahead or behind move the rows by centimetres: no witness of that axis. A step aside shows whole."""
    w = WakeWitness(PROBES, P)
    H = rows(w, readings(AT)).H @ C.T
    assert np.abs(H[:, 0]).max() < 0.07 and np.linalg.norm(H[:, 1:], axis=0).min() > 0.9


def test_noise_and_lasting_error_are_as_large_as_said() -> None:
    rng, n = np.random.default_rng(1), 1500
    w, noise, lasting = WakeWitness(PROBES, P), [], []
    for _ in range(n):
        noise.append(off(got := rows(w, readings(AT) + SIGMA * rng.standard_normal(9)), AT))
        kw, kt, h = np.array([P.scale_wing_sigma, P.scale_tail_sigma, P.height_sigma_m]) * rng.standard_normal(3)
        fixed = np.repeat([P.offset_V, P.offset_flow, P.offset_flow], 3) * rng.standard_normal(9)
        lasting.append(off(rows(w, readings(AT, kw=kw, kt=kt, h=h) + fixed), AT))
    low, high = chi2.ppf((1e-3, 1.0 - 1e-3), n) / n
    for e, said in ((noise, got.r), (lasting, got.lasting)):
        ratio = np.var(e, axis=0) / said
        assert (low < ratio).all() and (ratio < high).all()
    assert abs(np.corrcoef(np.array(noise).T)[0, 1]) < 3.3 / np.sqrt(n)
    assert w.number == 1


def test_air_of_each_probe_is_noise() -> None:
    own = np.diag((3.0 * SIGMA) ** 2)
    w = WakeWitness(PROBES, P)
    calm, rough = rows(w, readings(AT)), w.step(1, readings(AT), ALL, frame(AT[0]), WK, AT, 0.1 * own, C)
    assert rough is not None
    np.testing.assert_allclose(rough.r, 1.9 * calm.r, rtol=1e-9)
    assert w.step(1, readings(AT), ALL, frame(AT[0]), WK, AT, own, C) is None  # more noise than is of use


def test_other_probes_and_another_place_are_other_rows() -> None:
    w, out = WakeWitness(PROBES, P), ALL & ~(1 << kp.R_V + 1)
    assert rows(w, readings(AT)).number == rows(w, readings(AT)).number == 1
    wrong = readings(AT)
    wrong[kp.R_V + 1] = 0.0
    got = rows(w, wrong, use=out)
    assert got.number == 2 and np.abs(off(got, AT)).max() < 0.1
    wrong[kp.R_V + 1] = np.nan
    assert rows(w, wrong).number == 2  # refused by its value: the same channels
    behind = AT + np.array([-3.5, 0.0, 0.0])
    assert rows(w, readings(behind), behind, out).number == 3


def test_too_few_readings_or_a_place_without_a_gradient_tell_nothing() -> None:
    w = WakeWitness(PROBES, P)
    assert w.step(1, readings(AT), 0x7, frame(AT[0]), WK, AT, NO_AIR, C) is None
    far = np.array([-59.0, 56.0, 5.0])
    assert w.step(1, readings(far), ALL, frame(far[0]), WK, far, NO_AIR, C) is None
    assert rows(w, readings(AT)).number == 1
