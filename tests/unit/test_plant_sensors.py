"""Sensor errors: statistics, seeds, rates, latency, faults."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flightsw.strict import ConfigError
from flightsw.types import UPD_AIR, UPD_ATT, UPD_FUEL, UPD_GNSS, UPD_IMU, UPD_REL, SensorFrame
from sim_plant.rng import generator
from sim_plant.scenario import load_scenario
from sim_plant.sensors.onboard import turned
from sim_plant.sensors.rows import NoiseRows
from sim_plant.world import World

QUIET = {"noise.scale": 0.0, "noise.bias_scale": 0.0}


def run(seconds: float, over: dict[str, Any], seed: int = 1, i: int = 1) -> list[tuple[SensorFrame, Any]]:
    """Frames (copied) and truths of aircraft i in trimmed flight."""
    w = World(load_scenario("refueling", over), seed)
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    out = []
    for _ in range(round(seconds * 100)):
        f = w.sense()[i]
        copy = SensorFrame(**{k: getattr(f, k) for k in SensorFrame.__slots__})
        out.append((copy, w.truth(i)))
        w.step(cmds)
    return out


def test_generators_are_stable_and_independent() -> None:
    """The draws of (seed, name) are part of every stored result: they may never change."""
    a = generator(1, "tanker.imu.noise").standard_normal(3)
    assert np.array_equal(a, generator(1, "tanker.imu.noise").standard_normal(3))
    assert not np.allclose(a, generator(2, "tanker.imu.noise").standard_normal(3))
    assert not np.allclose(a, generator(1, "tanker.gnss.noise").standard_normal(3))


def test_white_noise_and_bias_have_the_set_spread() -> None:
    n = NoiseRows(1, "x", [0.5, 0.1], [0.0, 0.0])
    x = np.array([n.next() for _ in range(20000)])
    assert np.allclose(x.std(axis=0), [0.5, 0.1], rtol=0.02)
    assert np.max(np.abs(x.mean(axis=0))) < 0.015
    assert abs(np.corrcoef(x[1:, 0], x[:-1, 0])[0, 1]) < 0.03
    b = np.array([NoiseRows(s, "x", [1.0], [0.3]).bias[0] for s in range(500)])
    assert abs(b.std() / 0.3 - 1) < 0.1


def test_coloured_noise_is_gauss_markov_from_the_first_sample() -> None:
    n = NoiseRows(1, "x", [0.5], [0.0], tau_s=1.0, period_s=0.05)
    x = np.array([n.next()[0] for _ in range(200000)])
    assert abs(x.std() / 0.5 - 1) < 0.03
    assert np.corrcoef(x[1:], x[:-1])[0, 1] == pytest.approx(np.exp(-0.05), abs=0.003)
    assert np.corrcoef(x[20:], x[:-20])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.04)
    first = np.array([NoiseRows(s, "x", [1.0], [0.0], 5.0, 0.05).next()[0] for s in range(500)])
    assert abs(first.std() - 1) < 0.1


def test_sensors_without_error_read_the_truth() -> None:
    for f, t in run(0.3, QUIET):
        if f.updated & UPD_GNSS:
            assert f.gnss_pos_n == t.pos_n and f.gnss_vel_n == t.vel_n and f.gnss_t_us == t.t_us
            assert f.rel_pos_t == t.xi and f.rel_vel_t == t.xi_dot
            assert f.att_q_nb == pytest.approx(t.q_nb, abs=1e-15)
            assert f.baro_alt_m == -t.pos_n[2]
            assert abs(f.pressure_pa - 41003.0) < 60.0
        assert f.gyro_b == t.w_b


def test_accelerometer_reads_specific_force() -> None:
    """acc_n - g in body axes; level in trim close to -9.81 on z."""
    f, t = run(0.05, QUIET | {"wind.dryden.sigma_mps": 0.0})[0]
    q0, q1, q2, q3 = t.q_nb
    c = np.array(
        [
            [1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)],
            [2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)],
            [2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)],
        ]
    )
    assert np.allclose(f.acc_b, c.T @ (np.array(t.acc_n) - [0, 0, 9.80665]), atol=1e-12)
    assert f.acc_b[2] == pytest.approx(-9.81, abs=0.01)


def test_probe_sees_local_wake_and_rotation() -> None:
    """At contact the tip probes see the wake's sidewash mirrored; the nose probe turns with the aircraft."""
    over = QUIET | {"wind.dryden.sigma_mps": 0.0, "aircraft.receiver.start.xi_m": [-35.5, 0.0, 8.5]}
    w = World(load_scenario("refueling", over | {"wind.prevailing": "constant"}), 1)
    v = w.members[1]
    f = w.sense()[1]
    assert f.air_beta[1] == pytest.approx(-f.air_beta[2], abs=2e-4)
    assert abs(f.air_beta[1]) > 0.004
    before = f.air_alpha[0]
    v.s[5] = 0.1  # pitch rate: the nose rises, its alpha falls by q x / V
    w._sensed = False
    w.tick = 5
    assert w.sense()[1].air_alpha[0] - before == pytest.approx(-0.1 * 6.5 / 195.0, rel=0.02)


def test_measured_errors_match_the_scenario() -> None:
    data = run(60.0, {})
    gyro = np.array([np.subtract(f.gyro_b, t.w_b) for f, t in data])
    assert np.allclose(gyro.std(axis=0), 0.0131, rtol=0.05)
    rows = [(f, t) for f, t in data if f.updated & UPD_GNSS]
    assert len(rows) == 1200
    pos = np.array([np.subtract(f.gnss_pos_n, t.pos_n) for f, t in rows])
    vel = np.array([np.subtract(f.gnss_vel_n, t.vel_n) for f, t in rows])
    rel = np.array([np.subtract(f.rel_pos_t, t.xi) for f, t in rows])
    assert np.allclose(pos.std(axis=0), 0.5, rtol=0.1) and np.allclose(vel.std(axis=0), 0.1, rtol=0.1)
    assert np.allclose(rel.std(axis=0), 0.5, rtol=0.1)
    assert np.max(np.abs(pos.mean(axis=0))) < 4.0 and np.max(np.abs(rel.mean(axis=0))) < 0.25
    att = np.array([np.abs(np.dot(f.att_q_nb, t.q_nb)) for f, t in rows])
    angle = 2 * np.arccos(np.clip(att, -1, 1))
    assert np.sqrt(np.mean(angle**2)) == pytest.approx(0.0035 * np.sqrt(3), rel=0.3)


def test_attitude_error_is_a_rotation_about_the_body_axes() -> None:
    q = turned([1.0, 0.0, 0.0, 0.0], [0.0, 0.2, 0.0])
    assert q == pytest.approx((np.cos(0.1), 0.0, np.sin(0.1), 0.0))


def test_rates_and_common_ticks() -> None:
    data = run(1.0, {})
    for bit, count in ((UPD_IMU, 100), (UPD_GNSS, 20), (UPD_AIR, 20), (UPD_ATT, 20), (UPD_REL, 20), (UPD_FUEL, 1)):
        ticks = [k for k, (f, _) in enumerate(data) if f.updated & bit]
        assert len(ticks) == count
        assert count != 20 or all(k % 5 == 0 for k in ticks)


def test_latency_delivers_the_past_with_its_own_stamp() -> None:
    over = QUIET | {"sensors.receiver.gnss.latency_ms": 120.0}
    data = run(1.0, over)
    got = [(k, f) for k, (f, _) in enumerate(data) if f.updated & UPD_GNSS]
    assert got[0][0] == 12
    for k, f in got:
        assert f.gnss_t_us == (k - 12) * 10000
        assert f.gnss_pos_n == data[k - 12][1].pos_n


def test_noise_factor_scales_noise_and_leaves_bias() -> None:
    def first(over: dict[str, Any]) -> np.ndarray:
        f, t = run(0.01, over)[0]
        return np.subtract(f.gnss_pos_n, t.pos_n)

    bias = first({"noise.scale": 0.0})
    one, three = first({}) - bias, first({"noise.scale": 3.0}) - bias
    assert np.allclose(three, 3.0 * one)
    assert np.max(np.abs(bias)) > 0.05


def test_a_new_sensor_does_not_reshuffle_the_others() -> None:
    with_rel = run(0.5, {})
    without = run(0.5, {"aircraft.receiver.rel_nav_to": ""})
    for (a, _), (b, _) in zip(with_rel, without, strict=True):
        assert a.gyro_b == b.gyro_b and a.gnss_pos_n == b.gnss_pos_n and a.air_V == b.air_V


def _event(**kw: Any) -> dict[str, Any]:
    return {"event": [{"t_s": 0.2, "target": "receiver", **kw}]}


def test_dropout_silences_a_sensor_and_leaves_the_rest_of_the_run() -> None:
    ref = run(1.0, {})
    data = run(1.0, _event(kind="dropout", sensor="gnss", for_s=0.5))
    ticks = [k for k, (f, _) in enumerate(data) if f.updated & UPD_GNSS]
    assert ticks == [k for k in range(0, 100, 5) if not 20 <= k < 70]
    assert data[80][0].gnss_pos_n == ref[80][0].gnss_pos_n


def test_bias_spike_and_stuck() -> None:
    ref = run(1.0, {})
    biased = run(1.0, _event(kind="bias", sensor="rel", for_s=0.5, value=[5.0, 0, 0, 0, 0, 0]))
    spiked = run(1.0, _event(kind="spike", sensor="gnss", value=[100.0]))
    stuck = run(1.0, _event(kind="stuck", sensor="att", for_s=0.5))
    for k in range(0, 100, 5):
        hit = 20 <= k < 70
        assert biased[k][0].rel_pos_t[0] - ref[k][0].rel_pos_t[0] == pytest.approx(5.0 if hit else 0.0)
        assert spiked[k][0].gnss_pos_n[0] - ref[k][0].gnss_pos_n[0] == pytest.approx(100.0 if k == 20 else 0.0)
        assert (stuck[k][0].att_q_nb == ref[15 if hit else k][0].att_q_nb) and stuck[k][0].att_t_us == k * 10000


def test_single_probe_faults() -> None:
    ref = run(0.5, {})
    off = run(0.5, _event(kind="dropout", sensor="air", index=1))
    stuck = run(0.5, _event(kind="stuck", sensor="air", index=2))
    biased = run(0.5, _event(kind="bias", sensor="air", index=0, value=[3.0, 0.0, 0.0]))
    assert off[15][0].air_mask == 7 and off[20][0].air_mask == 5
    assert stuck[40][0].air_V[2] == ref[15][0].air_V[2] and stuck[40][0].air_V[0] == ref[40][0].air_V[0]
    assert biased[40][0].air_V[0] - ref[40][0].air_V[0] == pytest.approx(3.0)
    assert biased[40][0].air_V[1] == ref[40][0].air_V[1]


@pytest.mark.parametrize(
    ("over", "text"),
    [
        ({"sensors.receiver.gnss.rate_hz": 30.0}, r"sensors\.receiver\.gnss\.rate_hz = 30"),
        (_event(kind="bias", sensor="rel", value=[1.0, 2.0]), r"event\[0\]\.value.*1 or 6 values, got 2"),
        ({"event": [{"t_s": 1.0, "target": "tanker", "kind": "dropout", "sensor": "rel"}]}, r"tanker carries imu"),
    ],
)
def test_impossible_sensor_settings_are_named(over: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        World(load_scenario("refueling", over), 1)
