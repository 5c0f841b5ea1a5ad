"""Bearing and position of the plant at rates of their own: when they come, how wrong they are, what a fault of the set does."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.strict import ConfigError
from flightsw.types import UPD_BEARING, UPD_POSITION, UPD_TACAN
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.sensors.config import NoiseCfg, Suite, Tacan
from sim_plant.sensors.suite import tacan_sensors
from sim_plant.sensors.tacan import BearingSensor, PositionSensor
from sim_plant.world import World

T = "sensors.tanker.tacan."
BEARING = {f"{T}bearing_std_deg": 1.0, f"{T}bearing_dt_s": 0.5}
LINK = {f"{T}link_std_m": 100.0, f"{T}link_dt_s": 0.1}


def heard(over: dict[str, Any], seconds: float, seed: int = 1) -> tuple[list[tuple], list[tuple], list[tuple]]:
    """(arrival, stamp, value, truth) of bearings and positions; (arrival, range, bearing, link) of replies."""
    w = World(load_scenario("rendezvous", over), seed)
    bearings, positions, replies = [], [], []
    for _ in range(round(seconds * 100)):
        f, ((_, other),), own = w.sense()[0], w.others(), w.truth(0)
        if f.updated & UPD_BEARING:
            d = np.array(other.pos_n) - np.array(own.pos_n)
            bearings.append((w.t_us, f.bearing_t_us, f.bearing, math.atan2(d[1], d[0]) - own.euler[0]))
        if f.updated & UPD_POSITION:
            positions.append((w.t_us, f.position_t_us, f.position, other.pos_n[:2]))
        if f.updated & UPD_TACAN:
            replies.append((w.t_us, f.tacan_range_m, f.tacan_bearing, f.tacan_link))
        w.step([w.trim_cmd(i) for i in range(len(w.members))])
    return bearings, positions, replies


def test_each_comes_at_its_own_times_and_none_with_a_range() -> None:
    bearings, positions, replies = heard(BEARING | LINK | {f"{T}interval_s": 1.0, f"{T}link_latency_ms": 150.0}, 2.2)
    assert [(t, s) for t, s, *_ in bearings] == [(k * 500_000, k * 500_000) for k in range(5)]
    assert [(t, s) for t, s, *_ in positions] == [(k * 100_000 + 150_000, k * 100_000) for k in range(21)]
    assert [t for t, *_ in replies] == [1_000_000, 2_000_000]
    assert all(b is None and at is None for _, _, b, at in replies)


def test_they_are_the_truth_but_for_their_errors() -> None:
    small = {f"{T}bearing_std_deg": 1e-6, f"{T}bearing_dt_s": 0.5, f"{T}link_std_m": 1e-6, f"{T}link_dt_s": 0.5}
    bearings, positions, _ = heard(small, 2.0)
    for _, _, got, want in bearings:
        assert math.remainder(got - want, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    for _, _, got, want in positions:
        assert got == pytest.approx(want, abs=1e-4)


def test_ranges_are_the_same_whatever_else_comes() -> None:
    _, _, plain = heard({f"{T}interval_s": 1.0}, 3.1)
    _, _, more = heard({f"{T}interval_s": 1.0} | BEARING | LINK, 3.1)
    assert [r[:2] for r in plain] == [r[:2] for r in more]


def sensors(cfg: Tacan, seed: int) -> tuple[BearingSensor, PositionSensor]:
    out = {s.group: s for s in tacan_sensors("t", Suite(tacan=cfg), NoiseCfg(), 100, seed, 0.0)}
    bearing, position = out["bearing"], out["position"]
    assert isinstance(bearing, BearingSensor) and isinstance(position, PositionSensor)
    return bearing, position


def test_errors_have_the_spread_and_the_correlation_they_are_given() -> None:
    cfg = Tacan(
        bearing_std_deg=2.0, bearing_dt_s=0.5, bearing_tau_s=5.0, link_std_m=80.0, link_dt_s=0.1, link_tau_s=2.0
    )
    for s, sigma, rho in zip(
        sensors(cfg, 3), (math.radians(2.0), 80.0), (math.exp(-0.1), math.exp(-0.05)), strict=True
    ):
        assert s.noise is not None
        e = np.array([s.noise.next()[0] for _ in range(60_000)])
        assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(rho, abs=0.01)
        assert np.std(e) == pytest.approx(sigma, rel=0.06)  # 3000 correlation times at least
    white, _ = sensors(
        Tacan(bearing_std_deg=2.0, bearing_dt_s=0.5, bearing_tau_s=0.0, link_std_m=8.0, link_dt_s=0.1), 3
    )
    assert white.noise is not None
    e = np.array([white.noise.next()[0] for _ in range(20_000)])
    assert np.corrcoef(e[1:], e[:-1])[0, 1] == pytest.approx(0.0, abs=0.03)
    cfg = Tacan(bearing_std_deg=1e-9, bearing_dt_s=1.0, bearing_bias_std_deg=0.3, link_std_m=1e-9, link_dt_s=1.0,
                link_bias_std_m=5.0)  # fmt: skip
    drawn = [[float(s.noise.next()[0]) for s in sensors(cfg, k) if s.noise is not None] for k in range(1500)]
    assert np.std(drawn, axis=0) == pytest.approx([math.radians(0.3), 5.0], rel=0.08)


def test_a_share_of_the_positions_is_lost_and_the_others_stay_what_they_are() -> None:
    _, every, _ = heard(LINK, 20.0)
    _, some, _ = heard(LINK | {f"{T}link_loss": 0.4}, 20.0)
    kept = {t: v for t, _, v, _ in some}
    assert 80 < len(kept) < 160 == len(every) - 40
    assert all(kept[t] == v for t, _, v, _ in every if t in kept)


def test_a_set_that_is_off_or_stuck_has_no_other_bearing_and_the_link_goes_on() -> None:
    for kind in ("dropout", "stuck"):
        fault = {"event": [{"t_s": 1.2, "target": "tanker", "sensor": "tacan", "kind": kind}]}
        bearings, positions, _ = heard(BEARING | LINK | fault, 3.0)
        after = [v for t, _, v, _ in bearings if t > 1_200_000]
        assert after == [] if kind == "dropout" else set(after) == {bearings[2][2]} and len(after) == 3
        assert len(positions) == 30


def test_a_bearing_is_clockwise_from_the_nose() -> None:
    from sim_plant.sensors.base import View

    v = View(0)
    v.s, v.o = [0.0] * 40, [0.0] * 60
    v.s[n.S_P : n.S_P + 3], v.o[n.O_EULER] = (0.0, 0.0, -7000.0), math.radians(170.0)
    v.target = (-1000.0, -1000.0, -6700.0)
    bearing, position = sensors(Tacan(bearing_std_deg=1.0, bearing_dt_s=1.0, link_std_m=1.0, link_dt_s=1.0), 1)
    assert bearing.sample(v, [0.0]) == pytest.approx(math.radians(55.0))
    assert position.sample(v, [3.0, -4.0]) == (-997.0, -1004.0)


@pytest.mark.parametrize(("over", "key"), [
    ({f"{T}bearing_dt_s": 1.0}, "bearing_dt_s"),
    ({f"{T}bearing_std_deg": 1.0, f"{T}bearing_dt_s": 0.333}, "bearing_dt_s"),
    ({f"{T}bearing_std_deg": 1.0, f"{T}bearing_tau_s": 4.0}, "bearing_tau_s"),
    ({f"{T}link_dt_s": 1.0}, "link_dt_s"),
    ({f"{T}link_std_m": 9.0, f"{T}link_latency_ms": 5.0}, "link_latency_ms"),
    ({f"{T}link_std_m": 9.0, f"{T}link_loss": 0.1}, "link_loss"),
    ({f"{T}link_std_m": 9.0, f"{T}link_tau_s": 0.1}, "link_tau_s"),
    (LINK | {f"{T}link_loss": 1.0}, "link_loss"),
])  # fmt: skip
def test_settings_nothing_obeys_are_refused_by_name(over: dict[str, Any], key: str) -> None:
    with pytest.raises(ConfigError, match=key):
        World(load_scenario("rendezvous", over), 1)
