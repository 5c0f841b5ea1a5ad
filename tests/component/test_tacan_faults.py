"""A faulty TACAN of the plant, told and judged by the tanker's track: stuck, spiked, silent; bearing and data link used."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from flightsw.missions.rendezvous import fix_rules as kf
from flightsw.missions.rendezvous.frame import E_Y
from flightsw.missions.rendezvous.params import Aids, RangeRules, RendezvousNavParams
from flightsw.missions.rendezvous.track import ReceiverTrack, RendezvousFrameParams, TrackParams
from flightsw.types import NavState
from sim_plant.scenario import load_scenario
from sim_plant.world import World

NAV = RendezvousNavParams(
    components=15, gate_nis=25.0, rules=RangeRules(believed=2, repeat_m=0.1, young_z=3.7, open=True)
)
EVERY = {"sensors.tanker.tacan.interval_s": 2.0}


def track(
    seconds: float, over: dict[str, Any], *faults: dict[str, Any], nav: RendezvousNavParams = NAV, **params: Any
) -> tuple[ReceiverTrack, list[str], Any]:
    """The track after so long, what it said, and the receiver's true place in R; navigation is perfect."""
    events = [{"target": "tanker", "sensor": "tacan", **f} for f in faults]
    w = World(load_scenario("rendezvous", EVERY | over | ({"event": events} if events else {})), 1)
    t = ReceiverTrack(TrackParams(nav, RendezvousFrameParams(heading_deg=90.0), lost_s=5.0, **params))
    said: list[str] = []
    for k in range(round(seconds * 100)):
        f = w.sense()[0]
        bits = f.updated if k % 5 == 0 else bits | f.updated  # type: ignore[has-type]  # noqa: F821
        if k % 5 == 4:
            own = w.truth(0)
            now = NavState(valid=True, V=own.V, pos_n=own.pos_n, vel_n=own.vel_n, wind_n=own.wind_n, euler=own.euler)
            t.step(f, now, bits)
            said += [x.text for x in t.texts]
            t.texts = []
        w.step([w.trim_cmd(i) for i in range(len(w.members))])
    ((_, other),) = w.others()
    return t, said, t.frame.to_r(other.pos_n[0], other.pos_n[1])


def test_a_set_that_sticks_is_told_and_not_believed() -> None:
    t, said, at = track(20.0, {}, {"t_s": 8.0, "kind": "stuck"})
    assert "TACAN: range stands still, refused" in said and "TACAN: no range" in said
    assert t.out.refused >= 4 and abs(t.out.mean[0] - at[0]) < 1500.0


def test_a_spike_is_refused_and_told() -> None:
    t, said, at = track(16.0, {}, {"t_s": 8.0, "kind": "spike", "value": [5000.0]})
    assert said.count("TACAN: range refused") == 1 and t.out.refused == 1 and not t.out.alarm
    assert abs(t.out.mean[0] - at[0]) < 1500.0


def test_a_bias_that_comes_for_good_is_warned_of() -> None:
    _, said, _ = track(24.0, {}, {"t_s": 12.0, "kind": "bias", "value": [2000.0]})
    assert "receiver not as planned: check course and speed" in said


OWN = replace(NAV, rules=replace(NAV.rules, open_back=4, open_turn_deg=40.0, open_speed_mps=30.0), aids=Aids(on=True))


@pytest.mark.parametrize("sensor", ["bearing", "link"])
def test_what_comes_by_itself_is_used_between_the_ranges(sensor: str) -> None:
    at = "sensors.tanker.tacan."
    over = {
        "bearing": {f"{at}bearing_std_deg": 0.5, f"{at}bearing_dt_s": 0.1, f"{at}bearing_tau_s": 5.0},
        "link": {f"{at}link_std_m": 50.0, f"{at}link_dt_s": 0.1, f"{at}link_tau_s": 5.0, f"{at}link_latency_ms": 150.0},
    }[sensor] | {f"{at}interval_s": 20.0}
    nav = replace(OWN, bearing_sigma_deg=0.5, datalink_sigma_m=50.0)
    t, _, where = track(14.0, over, nav=nav)
    assert t.out.updates == 1 and t.est.out.sided
    assert t.est.fixes[kf.FS_COUNT] == 13  # one a second from the first range on, at 1 s
    sigma = math.sqrt(t.est.last_covariance[E_Y, E_Y])
    assert sigma < 450.0 and abs(t.out.mean[2] - where[1]) < 3.5 * sigma
    every, _, _ = track(14.0, over, nav=nav, aid_every_s=0.0)
    assert every.est.fixes[kf.FS_COUNT] > 125  # each
    none, _, _ = track(14.0, over, nav=nav, use_bearing=False, use_link=False)
    assert none.est.fixes[kf.FS_COUNT] == 0 and not none.est.out.sided


@pytest.mark.parametrize("sensor", ["bearing", "link"])
def test_bearing_and_data_link_are_used_where_they_are_fitted(sensor: str) -> None:
    over = {
        "bearing": {"sensors.tanker.tacan.bearing_std_deg": 0.5, "sensors.tanker.tacan.bearing_bias_std_deg": 0.1},
        "link": {"sensors.tanker.tacan.link_std_m": 50.0, "sensors.tanker.tacan.link_bias_std_m": 5.0},
    }[sensor]
    with_it, _, at = track(14.0, over)
    without, _, _ = track(14.0, over, use_bearing=False, use_link=False)
    sigma, plain = (math.sqrt(e.est.last_covariance[E_Y, E_Y]) for e in (with_it, without))
    assert sigma < 0.4 * plain
    assert abs(with_it.out.mean[2] - at[1]) < 3.5 * sigma and math.isfinite(at[0])
