"""The onboard monitor: exclusion and re-admission of channels, few probes, bad readings, no model."""

from __future__ import annotations

import numpy as np
import pytest

from flightsw.missions.receiver.airdata.fdi.monitor import Fdi, FdiParams
from tests.unit.fdi_data import ALL, COMMON_SIGMA, E9, S0, fault, fly, readings


def test_quiet_air_gives_no_exclusion() -> None:
    """10 min at 20 Hz, common turbulence far above the noise."""
    n = 12_000
    wind = np.sin(np.arange(n)[:, None] / [200.0, 150.0, 90.0]) * [1.0, 0.01, 0.01]
    out = fly(Fdi(FdiParams()), readings(n, 11, common=wind), virtual=False)
    assert out[-1].exclusions == 0
    assert all(s.valid and s.alarm == 0 for s in out)


@pytest.mark.parametrize("channel", range(9))
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("virtual", [True, False])
def test_single_fault_is_excluded_and_readmitted(channel: int, sign: int, virtual: bool) -> None:
    f = Fdi(FdiParams())
    y = readings(300, 7 * channel + sign + 1)
    y[100:200] += fault(channel, sign=sign)
    out = fly(f, y, virtual=virtual)
    bit = 1 << channel
    assert all(s.excluded == 0 for s in out[:100])
    delay = next(k for k in range(100, 200) if out[k].excluded) - 99
    assert delay <= 4
    assert all(s.excluded == bit for s in out[104:200])
    assert all(s.isolated == bit and s.negative == (bit if sign < 0 else 0) for s in out[106:200])
    assert all(s.alarm == 1 << channel // 3 for s in out[106:200])
    back = next(k for k in range(200, 300) if out[k].excluded == 0)
    assert 219 <= back <= 240
    assert out[-1].exclusions == 1
    assert f.usable(ALL) == ALL


@pytest.mark.parametrize("virtual", [True, False])
def test_whole_probe_and_several_variables(virtual: bool) -> None:
    for channels in ((0, 3, 6), (4, 8), (1, 3, 8)):
        y = readings(200, channels[1])
        y[100:] += fault(*channels)
        out = fly(Fdi(FdiParams()), y, virtual=virtual)
        want = sum(1 << c for c in channels)
        assert all(s.excluded == want == s.isolated for s in out[106:])


def test_two_faults_of_one_variable_with_the_virtual_sensor() -> None:
    """(3, 3, 0): the first guess of a half-filled window is put right, the healthy probe comes back after its 20 samples."""
    for seed in range(10):
        y = readings(200, 50 + seed)
        y[100:, [0, 1]] += 3.0
        out = fly(Fdi(FdiParams()), y)
        assert all(s.excluded & 0b011 == 0b011 for s in out[108:])
        assert all(s.excluded == 0b011 for s in out[140:])
        assert sum(s.isolated == 0b011 for s in out[106:]) >= 92


def test_two_faults_are_decided_right_sample_by_sample() -> None:
    """100 flights, the error of the virtual sensor drawn once for each: at least 99 % of the samples after the window is full."""
    right = total = 0
    for seed in range(100):
        wind = np.random.default_rng(seed).normal(size=(1, 3)).repeat(160, axis=0) * COMMON_SIGMA
        y = readings(160, 4000 + seed, common=wind)
        y[100:, [0, 1]] += 3.0
        y[100:, 4] += np.radians(1.0)
        y[100:, 5] -= np.radians(1.0)
        out = fly(Fdi(FdiParams()), y)
        right += sum((s.isolated & 0b111 == 0b011) + (s.isolated >> 3 & 0b111 == 0b110) for s in out[105:])
        total += 2 * 55
    assert right / total >= 0.99


def test_a_second_fault_later() -> None:
    y = readings(300, 70)
    y[100:, 4] += np.radians(1.0)
    y[200:, 5] -= np.radians(1.0)
    out = fly(Fdi(FdiParams()), y)
    assert all(s.excluded == 1 << 4 for s in out[106:200])
    assert all(s.excluded == 3 << 4 for s in out[206:])


def test_two_faults_without_virtual_sensor_leave_nothing_trusted() -> None:
    """Opposite faults fit no single probe: nothing is isolated, the variable is not used until one explanation fits."""
    f = Fdi(FdiParams())
    y = readings(300, 8)
    y[100:200, 0] += 3.0
    y[100:200, 1] -= 3.0
    out = fly(f, y, virtual=False)
    assert all(s.excluded == 0b111 and s.isolated == 0 and s.alarm == 1 for s in out[110:200])
    assert out[-1].excluded == 0
    keep = Fdi(FdiParams(drop_unresolved=False))
    out = fly(keep, y, virtual=False)
    assert all(s.isolated == 0 and s.alarm == 1 for s in out[110:200])
    assert out[150].excluded & 0b100 == 0


def test_two_probes_left_detect_but_do_not_isolate() -> None:
    ok = ALL & ~(1 << 3)  # nose beta is off
    y = readings(300, 9)
    y[100:200, 5] += np.radians(1.0)
    f = Fdi(FdiParams())
    out = [*fly(f, y[:150], ok, virtual=False)]
    assert f.unresolved == 0b110 << 3
    assert all(s.alarm == 2 and s.isolated == 0 and s.excluded == 0b110 << 3 for s in out[106:])
    assert out[-1].gamma[1] > out[-1].threshold
    out = fly(f, y[150:], ok, virtual=False)
    assert out[-1].excluded == 0 and f.unresolved == 0
    # the virtual sensor tells which
    out = fly(Fdi(FdiParams()), y, ok)
    assert all(s.isolated == 1 << 5 == s.excluded for s in out[106:200])
    assert out[-1].excluded == 0


def test_one_probe_left_is_not_tested() -> None:
    ok = 0b001_111_111 & ~0b110_000_000
    out = fly(Fdi(FdiParams()), readings(50, 1, fault(6)), ok)
    assert out[-1].gamma[2] == 0.0 and out[-1].alarm == 0 and out[-1].valid
    out = fly(Fdi(FdiParams()), readings(50, 1), 0)
    assert out[-1].gamma == (0.0, 0.0, 0.0) and out[-1].excluded == 0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30, 0.0, -5.0])
def test_impossible_readings_are_blamed_at_once(value: float) -> None:
    y = readings(60, 3)
    y[30:, 1] = value
    f = Fdi(FdiParams())
    out = fly(f, y)
    assert out[29].excluded == 0
    assert all(s.excluded == s.isolated == 0b010 and s.valid for s in out[30:])
    assert all(np.isfinite([*s.gamma, *s.residual]).all() for s in out)
    assert fly(f, readings(10, 4))[-1].excluded == 0b010
    assert fly(f, readings(30, 5))[-1].excluded == 0


def test_everything_nan_and_garbage() -> None:
    f = Fdi(FdiParams())
    out = fly(f, np.full((5, 9), np.nan))
    assert out[-1].excluded == ALL == out[-1].isolated
    assert f.usable(ALL) == 0
    assert fly(f, readings(60, 1))[-1].excluded == 0
    rng = np.random.default_rng(1)
    y = readings(400, 2)
    y[100:300, 0] = rng.uniform(0.0, 500.0, 200)  # in and out of range
    y[100:300, 7] = rng.uniform(-0.3, 0.3, 200)
    out = fly(Fdi(FdiParams()), y)
    want = 1 << 0 | 1 << 7
    assert all(s.excluded == want for s in out[104:300])
    assert out[-1].excluded == 0


def test_intermittent_channel_must_prove_itself_longer_each_time() -> None:
    f = Fdi(FdiParams())
    y = readings(3000, 6)
    on = (np.arange(3000) % 60) < 20
    on[2000:] = False
    y[on, 8] += np.radians(1.0)
    out = fly(f, y)
    used_bad = sum(bool(on[k]) and not out[k].excluded >> 8 & 1 for k in range(3000))
    assert out[-1].exclusions <= 3
    assert used_bad <= 8
    assert int(f.cnt[2, 2, 1]) in (40, 80)  # needed samples doubled
    assert out[-1].excluded == 0


def test_dropouts_do_not_disturb() -> None:
    rng = np.random.default_rng(3)
    ok = ALL & ~(1 << rng.integers(0, 9, 4000)) & ~(1 << rng.integers(0, 9, 4000))
    out = fly(Fdi(FdiParams()), readings(4000, 12), ok, virtual=False)
    assert out[-1].exclusions == 0
    y = readings(4000, 13)
    y[1000:, 4] += np.radians(1.0)
    out = fly(Fdi(FdiParams()), y, ok)
    assert all(s.excluded == 1 << 4 for s in out[1010:])


def test_without_model_the_monitor_holds() -> None:
    """In the wake equal readings are no fault: no expectation, no new verdict; what is excluded stays out."""
    y = readings(100, 5)
    y[:50, 4] += np.radians(1.0)
    f = Fdi(FdiParams())
    assert fly(f, y[:50])[-1].excluded == 1 << 4
    out = fly(f, y[50:], e=None, S=None)
    assert all(not s.valid and s.alarm == 0 and s.gamma == (0.0, 0.0, 0.0) and s.excluded == 1 << 4 for s in out)
    assert fly(f, readings(60, 6))[-1].excluded == 0
    g = Fdi(FdiParams(without_model="plain"))
    flat = readings(100, 7) - E9 + np.repeat([200.0, 0.0, 0.05], 3)
    out = fly(g, flat, e=None, S=None)
    assert all(s.excluded == 0 and not s.valid for s in out)
    assert max(s.gamma[1] for s in out) > 0.0
    # coming back into the model the window starts afresh
    assert all(s.excluded == 0 for s in fly(g, readings(50, 8)))


@pytest.mark.parametrize("what", ["e", "S", "indefinite"])
def test_bad_expectation_is_no_expectation(what: str) -> None:
    kw = {"e": np.where(np.arange(9) == 4, np.nan, E9)} if what == "e" else {"S": np.full((9, 9), np.nan)}
    if what == "indefinite":
        kw = {"S": -np.eye(9)}
    f = Fdi(FdiParams())
    out = fly(f, readings(20, 1, fault(1)), **kw)
    assert all(not s.valid and s.excluded == 0 and s.alarm == 0 for s in out)
    assert fly(f, readings(20, 2, fault(1)))[-1].excluded == 0b010


def test_virtual_sensor_is_optional_by_variable() -> None:
    f = Fdi(FdiParams())
    y = readings(60, 3)
    y[:, [0, 1]] += 3.0
    y[:, [3, 4]] += np.radians(1.0)
    c, s = np.array([0.0, np.nan, 0.0]), np.array([0.39, 0.003, 0.0])
    for k in range(60):
        out = f.step(y[k], ALL, E9, S0, c, s)
    assert out.isolated & 0b111 == 0b011
    assert out.isolated >> 3 == 0b100  # without it the third is blamed


def test_lasting_differences_widen_the_test() -> None:
    """Probe biases of 0.2 deg (1 sigma) would be alarms; with bias_* they are not, and a fault of 2 deg still is."""
    p = FdiParams(bias_beta=np.radians(0.2), bias_alpha=np.radians(0.2))
    y = readings(200, 3)
    y[:, 3:6] += np.radians([0.3, -0.2, 0.1])
    assert fly(Fdi(FdiParams()), y)[-1].excluded != 0
    assert fly(Fdi(p), y)[-1].exclusions == 0
    y[100:, 5] -= np.radians(2.0)
    assert fly(Fdi(p), y)[-1].excluded == 1 << 5


def test_swapped_wing_tips_are_noticed() -> None:
    """Expected readings with left and right exchanged: the sideslip of the tips disagrees at once."""
    e = E9.copy()
    e[[1, 2, 4, 5, 7, 8]] = E9[[2, 1, 5, 4, 8, 7]]
    out = fly(Fdi(FdiParams()), readings(10, 3), e=e)
    assert out[-1].alarm >> 1 & 1
    left = fly(Fdi(FdiParams()), readings(10, 3, fault(4)))
    assert left[-1].excluded == 1 << 4
