"""The receiver of a rendezvous and the TACAN that sees it: closed forms, seeds, settings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from flightsw.strict import ConfigError
from flightsw.types import UPD_RADAR, UPD_TACAN
from sim_plant.couplings.traffic import Traffic
from sim_plant.couplings.traffic_config import Track, TrafficCfg
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.sensors.base import View
from sim_plant.sensors.config import Tacan
from sim_plant.sensors.rows import NoiseRows
from sim_plant.sensors.tacan import TacanSensor
from sim_plant.world import World

EAST = Track(100.0, -200.0, 90.0)
STILL = TrafficCfg(
    on=True, y_sigma_m=0.0, velocity_sigma_mps=0.0, fluctuation_sigma_mps=0.0, drift_sigma_mps=0.0, walk_m2ps=0.0,
    altitude_sigma_m=0.0,
)  # fmt: skip


def flown(cfg: TrafficCfg, seed: int, steps: int, dt: float, track: Track = EAST) -> Traffic:
    t = Traffic(cfg, track, (0.0, 0.0), seed, dt)
    for _ in range(steps):
        t.advance()
    return t


def test_spread_of_the_population_is_that_of_the_closed_form() -> None:
    cfg, runs, T = TrafficCfg(on=True), 600, 120.0
    at = np.array([flown(cfg, s, 12, T / 12).position for s in range(runs)])
    x, y = at[:, 1] + 200.0, at[:, 0] - 100.0  # +x east, +y north
    tau = cfg.fluctuation_tau_s
    ou = 2.0 * cfg.fluctuation_sigma_mps**2 * tau * (T - tau * (1.0 - math.exp(-T / tau)))
    want_x = cfg.velocity_sigma_mps**2 * T * T + ou
    want_y = cfg.y_sigma_m**2 + cfg.drift_sigma_mps**2 * T * T + cfg.walk_m2ps * T
    lo, hi = chi2.ppf([1e-4, 1.0 - 1e-4], runs - 1) / (runs - 1)
    assert lo < np.var(x, ddof=1) / want_x < hi
    assert lo < np.var(y, ddof=1) / want_y < hi
    assert np.mean(x) == pytest.approx(cfg.x_m - cfg.V_mps * T, abs=4.0 * math.sqrt(want_x / runs))
    assert lo < np.var(at[:, 2], ddof=1) / cfg.altitude_sigma_m**2 < hi


def test_receiver_holds_its_track_in_wind() -> None:
    t = Traffic(STILL, EAST, (12.0, -5.0), 1, 0.5)
    for _ in range(100):
        t.advance()
    north, east, _ = t.position
    assert north == pytest.approx(100.0, abs=1e-6)
    assert east == pytest.approx(-200.0 + STILL.x_m - 50.0 * (math.sqrt(STILL.V_mps**2 - 144.0) + 5.0), rel=1e-12)
    ((sysid, truth),) = t.others(World(load_scenario("rendezvous"), 1).truth(0))
    assert sysid == STILL.sysid
    assert pytest.approx(STILL.V_mps, rel=1e-12) == truth.V
    assert truth.vel_n[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("turn", "change"), [(30.0, 0.0), (-20.0, 0.0), (0.0, 15.0), (0.0, -8.0)])
def test_velocity_is_the_rate_of_position_through_a_manoeuvre(turn: float, change: float) -> None:
    cfg = replace(STILL, manoeuvre_at_s=10.0, turn_deg=turn, speed_change_mps=change)
    t = Traffic(cfg, EAST, (0.0, 0.0), 1, 0.01)
    before, checked = np.array(t.position), 0
    for k in range(6000):
        v0 = np.array(t.velocity)
        t.advance()
        now, v1 = np.array(t.position), np.array(t.velocity)
        if k % 500 == 250:
            assert np.allclose((now - before) / 0.01, 0.5 * (v0 + v1), atol=2e-3)
            checked += 1
        before = now
    assert checked == 12
    speed = math.hypot(*t.velocity[:2])
    assert speed == pytest.approx(cfg.V_mps + change, rel=1e-9)
    course = math.degrees(math.atan2(t.velocity[1], t.velocity[0]))
    assert math.remainder(course - (270.0 - turn), 360.0) == pytest.approx(
        0.0, abs=1e-6
    )  # a left turn is against the clock


def sensor(cfg: Tacan, seed: int = 1, std: float = 0.0, bias: float = 0.0) -> TacanSensor:
    return TacanSensor("t", cfg, 100, NoiseRows(seed, "t.tacan", [std], [bias], cfg.tau_s, cfg.interval_s), seed)


def view(own: tuple[float, float, float], target: tuple[float, float, float], psi: float) -> View:
    v = View(0)
    v.s, v.o = [0.0] * 40, [0.0] * 60
    v.s[n.S_P : n.S_P + 3] = own
    v.o[n.O_EULER] = psi
    v.target = target
    return v


def test_slant_range_and_bearing_of_a_known_geometry() -> None:
    s = sensor(Tacan(bearing_std_deg=1e-9))
    v = view((1000.0, 2000.0, -7000.0), (1000.0, 42_000.0, -6700.0), math.radians(30.0))
    distance, bearing, _ = s.sample(v, [0.0])
    drop = 40_000.0**2 / (2.0 * 3444.0 * 1852.0)  # fall of the earth to second order
    assert distance == pytest.approx(math.hypot(40_000.0, 300.0 + drop), abs=1e-3)
    assert bearing == pytest.approx(math.radians(60.0), abs=1e-9)
    assert sensor(Tacan()).sample(v, [7.0])[1] is None


def test_range_error_is_a_bias_and_noise_of_the_given_correlation() -> None:
    cfg = Tacan(interval_s=2.0)
    s = sensor(cfg, 5, cfg.std_m, 0.0)
    assert s.noise is not None
    e = np.array([s.noise.next()[0] for _ in range(20_000)])
    a = math.exp(-2.0 / 3.6)
    assert np.std(e) == pytest.approx(cfg.std_m, rel=0.03)
    assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(a, abs=0.02)
    bias = [float(NoiseRows(s, "t.tacan", [1.0], [185.2], 3.6, 10.0).bias[0]) for s in range(2000)]
    assert np.std(bias) == pytest.approx(185.2, rel=0.05)


def test_share_of_unanswered_interrogations() -> None:
    s = sensor(Tacan(dropout=0.3))
    v = view((0.0, 0.0, -7000.0), (30_000.0, 0.0, -6700.0), 0.0)
    lost = sum(s.sample(v, [0.0])[0] is None for _ in range(4000))
    assert lost / 4000 == pytest.approx(0.3, abs=0.03)


def replies(over: dict[str, Any], seconds: float, seed: int = 1, scenario: str = "rendezvous") -> list[tuple]:
    w = World(load_scenario(scenario, over), seed)
    out = []
    for _ in range(round(seconds * 100)):
        f = w.sense()[0]
        if f.updated & UPD_TACAN:
            out.append((w.t_us, f.tacan_t_us, f.tacan_range_m, f.tacan_bearing))
        if f.updated & UPD_RADAR:
            out.append((w.t_us, f.radar_y_m, f.radar_sigma_m))
        w.step([w.trim_cmd(i) for i in range(len(w.members))])
    return out


def test_replies_come_at_their_times_with_their_time_of_validity() -> None:
    got = replies({"sensors.tanker.tacan.interval_s": 1.0, "sensors.tanker.tacan.latency_ms": 300.0}, 4.0)
    assert got[0] == (500_000, 0.0, 1852.0)
    assert [(t, v) for t, v, *_ in got[1:]] == [(1_300_000, 1_000_000), (2_300_000, 2_000_000), (3_300_000, 3_000_000)]


def test_lost_replies_do_not_reshuffle_the_others() -> None:
    every = {r[0]: r[2] for r in replies({"sensors.tanker.tacan.interval_s": 0.5}, 10.0)[1:]}
    some = {
        r[0]: r[2]
        for r in replies({"sensors.tanker.tacan.interval_s": 0.5, "sensors.tanker.tacan.dropout": 0.5}, 10.0)[1:]
    }
    assert every.keys() == some.keys() and 3 < sum(v is None for v in some.values()) < 16
    assert all(some[k] in (None, every[k]) for k in every)


def test_tacan_and_radar_on_another_aircraft_of_the_scenario() -> None:
    over = {
        "aircraft.tanker.tacan_to": "receiver", "sensors.tanker.radar.sigma_m": 500.0, "sensors.tanker.tacan.std_m": 0.0,
        "sensors.tanker.tacan.bias_std_m": 0.0, "sensors.tanker.tacan.interval_s": 1.0, "track.heading_deg": 180.0,
    }  # fmt: skip
    w = World(load_scenario("refueling", over), 3)
    for _ in range(101):
        f = w.sense()[0]
        w.step([w.trim_cmd(0), w.trim_cmd(1)])
        if f.updated & UPD_RADAR:
            # +x south: +y east
            assert f.radar_sigma_m == 500.0 and 1.0 < abs(f.radar_y_m - 56.3) < 2500.0
    assert f.tacan_range_m == pytest.approx(math.hypot(59.13, 56.33), abs=0.5)


def test_without_a_sigma_nobody_reads_the_radar() -> None:
    over = {"aircraft.tanker.tacan_to": "receiver"}
    assert all(len(r) == 4 for r in replies(over, 2.0, scenario="refueling"))


@pytest.mark.parametrize(
    ("over", "key"),
    [
        ({"aircraft.tanker.tacan_to": "nobody"}, "tacan_to"),
        ({"aircraft.tanker.tacan_to": "tanker"}, "tacan_to"),
        ({"traffic.on": False}, "tacan_to"),
        ({"traffic.sysid": 1}, "traffic.name"),
        ({"sensors.tanker.tacan.dropout": 1.5}, "dropout"),
        ({"sensors.tanker.tacan.interval_s": 1.0, "sensors.tanker.tacan.latency_ms": 1500.0}, "latency_ms"),
        ({"sensors.tanker.tacan.interval_s": 0.333}, "rate_hz"),
        ({"traffic.turn_deg": "left"}, "turn_deg"),
    ],
)
def test_bad_settings_are_refused_by_name(over: dict[str, Any], key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        World(load_scenario("rendezvous", over), 1)


def test_same_seed_same_receiver_and_truth_in_the_log() -> None:
    a, b, c = (World(load_scenario("rendezvous"), s) for s in (4, 4, 5))
    for w in (a, b, c):
        for _ in range(50):
            w.sense()
            w.step([w.trim_cmd(0)])
    assert a.others() == b.others() != c.others()
    ((_, t),), own = a.others(), a.truth(0)
    d = np.array(t.pos_n) - np.array(own.pos_n)
    assert math.dist(t.xi, (0.0, 0.0, 0.0)) == pytest.approx(np.linalg.norm(d), rel=1e-12)
    # seen from a tanker flying east: ahead, and below
    assert t.xi[0] == pytest.approx(d[1], rel=1e-2) and t.xi[2] > 0.0
    assert World(load_scenario("refueling"), 1).others() == []
