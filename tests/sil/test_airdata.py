"""Air data in closed loop, in process: a lying probe, a lost relative sensor, a lost data link; and the same bytes twice."""

from __future__ import annotations

import copy
import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flightsw.strict import ConfigError
from hil_scripts.launch.replay_cmd import replay_run
from hil_scripts.studies.integrity.snapshot import Flying
from hil_scripts.studies.sevil.loop_figures import figures
from hil_scripts.studies.sevil.loop_flight import BREAKAWAY, CONTACT, Setting, Track, Watched, fly, in_process, plan_of
from sim_plant.failures.script import Event as Failure

DEG = math.radians(1.0)
NEAR = (-38.0, 0.0, 6.7)  # [m] begin close to contact, which is reached at 26 s
T0 = 32.0  # [s] of what goes wrong
Event = dict[str, Any]
LOGS = ("link_tanker.tlog", "link_receiver.tlog", "tlm.tlog", "truth.tlog")


@cache
def sound() -> Watched:
    """Until something goes wrong: flights without settings of their own begin alike."""
    with in_process(plan_of(Setting(55.0, start_m=NEAR), 1)) as flying:
        before = Watched(flying)
        before.fly_to(T0)
    return before


def flight(*events: Event, seconds: float = 55.0, sets: tuple[str, ...] = ()) -> Track:
    """With events in the order of their times."""
    if sets:
        return fly(Setting(seconds, events, sets, start_m=NEAR), 1)
    on = copy.deepcopy(sound())
    assert isinstance(on.flight, Flying)
    for e in events:
        on.fly_to(e["t_s"])
        on.flight.inject(Failure(**{**e, "value": tuple(e.get("value", ()))}))
    return on.fly_to(seconds)


def fault(kind: str, index: int, channel: str = "", **more: Any) -> Event:
    return {"t_s": T0, "kind": kind, "target": "receiver", "sensor": "air", "index": index, "channel": channel,
            "for_s": 12.0, **more}  # fmt: skip


def rel_off(t_s: float = T0, for_s: float = 15.0) -> Event:
    return {"t_s": t_s, "kind": "off", "target": "receiver", "sensor": "rel", "for_s": for_s}


def link_off(for_s: float = 12.0) -> Event:
    return {"t_s": T0, "kind": "link_loss", "target": "tanker", "for_s": for_s}


def said(tr: Track, words: str) -> list[float]:
    return [t for t, text in tr.texts if words in text]


def test_a_lying_probe_is_excluded_and_comes_back() -> None:
    e = fault("bias", 0, value=[3.0, DEG, DEG])
    tr = flight(e)
    f = figures(tr, (e,))
    assert f["isolated"] == 1.0 and f["delay_samples"] <= 5 and f["readmitted"] == 1.0, f
    assert f["kept_out_pct"] > 99.0 and f["exclusions.wrong"] == 0.0 and f["exclusions.right"] == 3.0, f
    assert f["left_box"] == 0.0 and f["breakaway"] == 0.0 and f["fault.station.max_m"] < 1.0, f
    assert tr.valid[tr.t > 5.0].all() and f["fault.wake.rms_m.radial"] < 1.0, f


def test_a_channel_that_reads_nothing_is_lost_alone() -> None:
    e = fault("off", 2, "beta")
    f = figures(flight(e), (e,))
    assert f["isolated"] == 1.0 and f["exclusions.wrong"] == 0.0 and f["readmitted"] == 1.0, f
    assert f["left_box"] == 0.0 and f["breakaway"] == 0.0, f


def test_station_is_held_on_the_wake_while_the_relative_sensor_is_silent() -> None:
    e = rel_off()
    tr = flight(e)
    f = figures(tr, (e,))
    assert f["breakaway"] == 0.0 and f["held_s"] > 12.0, f
    assert f["held.station.rms_m.all"] < 1.0 and f["left_box"] == 0.0, f
    assert tr.rel_valid[(tr.t > T0) & (tr.phase == CONTACT)].all()


def test_without_the_wake_position_the_same_loss_breaks_away() -> None:
    tr = flight(rel_off(), seconds=37.0, sets=("receiver.airdata.fuse=false",))
    assert len(said(tr, "breakaway: relative sensor silent")) == 1, tr.texts


def test_lost_link_in_straight_flight_is_bridged() -> None:
    e = link_off()
    tr = flight(e)
    f = figures(tr, (e,))
    assert f["breakaway"] == 0.0 and f["held_s"] > 10.0 and f["left_box"] == 0.0, (f, tr.texts)
    assert f["exclusions.wrong"] == 0.0 and f["held.station.max_m"] < 1.5, f
    assert not tr.held[-1] and tr.phase[-1] == CONTACT and tr.rel_valid[-1]


def test_lost_link_in_a_turn_breaks_away() -> None:
    tr = flight(link_off(), seconds=42.0, sets=("tanker.guid.first_leg_s=22",))
    away = said(tr, "breakaway: tanker data link silent")
    assert len(away) == 1 and T0 + 0.9 < away[0] < T0 + 1.5, tr.texts
    assert not tr.valid[tr.t > T0 + 1.5].any()  # nobody knows where that wake is
    assert not tr.excluded.any()


def test_both_lost_breaks_away() -> None:
    tr = flight(link_off(), rel_off(T0 + 2.0, 10.0), seconds=40.0)
    assert len(said(tr, "breakaway")) == 1 and tr.phase[-1] == BREAKAWAY, tr.texts
    away = tr.t[np.flatnonzero(tr.phase == BREAKAWAY)[0]]
    assert T0 + 3.5 < away < T0 + 5.0


def by(algorithm: str) -> tuple[str, ...]:
    return (f"receiver.airdata.position.method={algorithm}",)


def test_the_algorithms_of_the_print_fly_and_hold_no_station() -> None:
    """Their positions are told, valid or not, in place of the filter's; 15 finds fewer than 11; as uncertain as they are, they
    do not stand in for the relative sensor."""
    share = {}
    for name in ("algorithm_11", "algorithm_15"):
        tr = flight(rel_off(29.0), seconds=34.0, sets=by(name))
        there = (tr.t > 20.0) & (tr.t < 29.0)
        share[name] = float(tr.valid[there].mean())
        ok = there & tr.valid
        assert all((np.isfinite(tr.wake[there, i]) == tr.valid[there]).all() for i in (1, 2))
        assert np.median(np.hypot(*(tr.wake - tr.xi)[ok, 1:].T)) < 2.5
        away = said(tr, "breakaway: relative sensor silent")
        assert len(away) == 1 and 29.0 < away[0] < 32.5 and not tr.held.any(), tr.texts
    assert 0.05 < share["algorithm_15"] < share["algorithm_11"] < 1.0, share


def test_a_flight_by_contours_replays_from_its_readings_and_the_map_in_its_folder(tmp_path: Path) -> None:
    """What the onboard software is given on its link gives every output again: nothing else went in."""
    run = tmp_path / "run"
    tr = fly(Setting(6.0, (), by("algorithm_11"), start_m=(-35.6, 0.0, 6.9)), 4, keep=run)
    assert tr.valid.any()
    assert sorted(p.name for p in (run / "data").iterdir()) == ["contact.npz", "contact.toml"]
    assert (
        tomllib.loads((run / "flight_receiver.toml").read_text())["airdata"]["position"]["contours"]["map"]
        == "data/contact.toml"
    )
    for name, report in replay_run(run).items():
        assert report.ok, (name, report.lines())
    (run / "data" / "contact.npz").unlink()
    with pytest.raises(ConfigError, match=r"contact\.toml"):
        replay_run(run)


@pytest.fixture(scope="module")
def twice(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The same flight with a fault and a lost sensor, twice."""
    base = tmp_path_factory.mktemp("airdata")
    e = ({**fault("garbage", 1, "alpha", value=[2.0 * DEG]), "t_s": 6.0, "for_s": 3.0}, rel_off(10.0, 2.0))
    runs = [base / "a", base / "b"]
    for run in runs:
        fly(Setting(14.0, e, start_m=NEAR), 4, keep=run)
    return runs


@pytest.mark.parametrize("log", LOGS)
def test_one_seed_gives_the_same_bytes(twice: list[Path], log: str) -> None:
    assert (twice[0] / log).read_bytes() == (twice[1] / log).read_bytes()


def test_replay_repeats_every_output(twice: list[Path]) -> None:
    for name, report in replay_run(twice[0]).items():
        assert report.ok, (name, report.lines())
