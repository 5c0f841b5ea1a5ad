"""Onboard wake parameters and effective wind: figures of sevil.md sections 3 and 4, rigid rotation, errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.missions.receiver.airdata import wake_kernel as k
from flightsw.missions.receiver.airdata.wake_model import (
    WakeParams,
    circulation,
    effective_wind,
    stations,
    wake_params_of,
    wake_vector,
)
from flightsw.strict import ConfigError, convert

V, RHO = 200.0, 0.58883  # [m/s], [kg/m^3]
WK = wake_vector(WakeParams())
SPAN, FUSELAGE = stations()


def effective(xi: tuple[float, float, float], e: tuple[float, float, float], wk: np.ndarray = WK) -> np.ndarray:
    out = np.zeros(6)
    effective_wind(np.array(xi), np.array(e), V, RHO, SPAN, FUSELAGE, wk, 1.0, 1.0, out)
    return out


def curl_x(p: tuple[float, float, float], wk: np.ndarray) -> float:
    """dWz/dy - dWy/dz at a point by central differences."""
    h, W = 1e-3, np.zeros((4, 3))
    for out, dy, dz in zip(W, (h, -h, 0, 0), (0, 0, h, -h), strict=True):
        k.wake_wind(p[0], p[1] + dy, p[2] + dz, wk, 1.0, 1.0, V, RHO, out)
    return float((W[0, 2] - W[1, 2] - W[2, 1] + W[3, 1]) / (2 * h))


def test_circulation_of_the_published_tanker() -> None:
    """Gamma 336.58 and -57.03 m^2/s (sevil.md section 4); they carry weight: L = rho V Gamma spacing."""
    wing, tail = circulation(WK, V, RHO)
    assert (round(wing, 2), round(tail, 2)) == (336.58, -57.03)
    lift = RHO * V * (wing * math.pi / 4 * 39.88 + tail * math.pi / 4 * 12.27)
    assert lift == pytest.approx(1.2e5 * 9.80665, rel=1e-12)


def test_effective_wind_at_the_printed_point() -> None:
    """p_eff 0.031 rad/s and W_eff (0.08, 0.48, 4.96) m/s at (-35.5, 2, 8.5) (sevil.md section 3.1)."""
    out = effective((-35.5, 2.0, 8.5), (0.0, 0.0, 0.0))
    assert [round(v, 2) for v in out[:3]] == [0.08, 0.48, 4.96]
    assert round(out[3], 3) == 0.031


def test_e15_slope_instead_of_curl() -> None:
    """Erratum E15: the printed curl (2.37-2.39) cancels in the irrotational wake, the slope over the span does not; in
    air that turns like a rigid body (inside one thick core) the slope gives the rate and the printed form twice it.
    """
    printed, slope = curl_x((-35.5, 2.0, 8.5), WK), effective((-35.5, 2.0, 8.5), (0.0, 0.0, 0.0))[3]
    assert abs(printed) < 0.02 * slope
    # one filament along x through the origin: the partner a thousand kilometres away; rate Gamma / (2 pi core^2)
    core, gamma, wk = 400.0, 336.58, WK.copy()
    wk[k.WK_WING_Y], wk[k.WK_WING_SPACING], wk[k.WK_WING_CORE] = -5e5, 1e6, core
    wk[k.WK_WING_LIFT], wk[k.WK_TAIL_LIFT], wk[k.WK_NU] = gamma * RHO * V * 1e6, 0.0, 0.0
    rate = -gamma / (2 * math.pi * core**2)  # the right-hand filament turns the air left wing down
    assert effective((-1e8, 0.0, 0.0), (0.0, 0.0, 0.0), wk)[3] == pytest.approx(rate, rel=1e-3)
    assert curl_x((-1e8, 0.0, 0.0), wk) == pytest.approx(2 * rate, rel=1e-3)


def test_effective_wind_is_antisymmetric_across_the_plane_of_symmetry() -> None:
    a, b = effective((-35.5, 3.0, 7.0), (0.0, 0.05, 0.0)), effective((-35.5, -3.0, 7.0), (0.0, 0.05, 0.0))
    assert b == pytest.approx(a * np.array([1, -1, 1, -1, 1, -1]), abs=1e-13)


def test_slopes_equal_a_polynomial_fit() -> None:
    """Least-squares slopes against numpy.polyfit of the same samples."""
    out = effective((-35.5, 2.0, 6.0), (0.0, 0.0, 0.0))
    W = np.zeros((11, 3))
    for i, s in enumerate(SPAN):
        k.wake_wind(-35.5, 2.0 + s[1], 6.0, WK, 1.0, 1.0, V, RHO, W[i])
    assert out[3] == pytest.approx(np.polyfit(SPAN[:, 1], W[:, 2], 1)[0], rel=1e-10)
    for i, s in enumerate(FUSELAGE):
        k.wake_wind(-35.5 + s[0], 2.0, 6.0, WK, 1.0, 1.0, V, RHO, W[i])
    assert out[4] == pytest.approx(-np.polyfit(FUSELAGE[:, 0], W[:, 2], 1)[0], rel=1e-9)
    assert out[5] == pytest.approx(np.polyfit(FUSELAGE[:, 0], W[:, 1], 1)[0], rel=1e-9)


def test_parameters_from_the_tanker_record() -> None:
    p = wake_params_of(load_aircraft("kc135r"), 1.1e5)
    assert (p.mass_kg, p.wing_span_m, p.tail_span_m) == (1.1e5, 39.88, 12.27)
    assert p.tail_m == (-17.8, 0.0, -2.5)
    assert p.core_wing_m == WakeParams().core_wing_m


def test_parameters_out_of_range_name_the_field() -> None:
    with pytest.raises(ConfigError, match=r"core_wing_m = -0.1: allowed 0 to 10"):
        convert({"core_wing_m": -0.1}, WakeParams, "wake.toml")
