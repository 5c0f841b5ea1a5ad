"""Failures of surfaces, engines, fuel and radio, faults of any sensor, and an aircraft that is not as its file says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.strict import ConfigError
from flightsw.types import ACCEPTED
from sim_plant.aircraft.sixdof.eom import inertia
from sim_plant.failures.actuators import Bent, Held
from sim_plant.failures.judge import judge
from sim_plant.failures.numbers import Fitted
from sim_plant.failures.parts import power_of
from sim_plant.failures.script import Event
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.sensors.base import View
from sim_plant.world import World

TICKS, START = 60, 20
FITTED = Fitted(
    3, 20.0, {"baro": 10.0, "gnss": 10.0, "imu": 100.0}, ("aileron", "elevator"), True, {"baro": 1, "gnss": 6, "imu": 6}, 2, True
)  # fmt: skip


def fly(event: dict[str, Any] | None = None, **over: Any) -> tuple[World, list[Any]]:
    """The receiver under its trim command, a failure from tick START on; its state and GNSS tick by tick."""
    events = [{"t_s": START / 100, "target": "receiver", **event}] if event else []
    w = World(load_scenario("refueling", {"event": events, **over}), 1)
    rows = []
    for _ in range(TICKS):
        f = w.sense()[1]
        rows.append((w.members[1].s.copy(), f.gnss_pos_n, f.gnss_t_us, w.link_up(1)))
        w.step([w.trim_cmd(0), w.trim_cmd(1)])
    return w, rows


@pytest.fixture(scope="module")
def clean() -> list[Any]:
    return fly()[1]


def test_an_engine_out_takes_its_share_and_turns_towards_itself(clean: list[Any]) -> None:
    w, rows = fly({"kind": "engine_off", "index": 0})
    lag, t = w.members[1].par[n.P_TAU], (TICKS - 1 - START) / 100
    full = clean[-1][0][n.S_T]
    left = 0.5 + 0.5 * 2.718281828459045 ** (-t / lag)
    assert rows[-1][0][n.S_T] == pytest.approx(full * left, rel=2e-3)
    assert rows[-1][0][n.S_YAW] == pytest.approx(-1.4 * full * (1.0 - left), rel=5e-3)  # left engine, 1.4 m out
    assert rows[-1][0][n.S_W + 2] < clean[-1][0][n.S_W + 2]


def test_surfaces_run_away_float_and_creep(clean: list[Any]) -> None:
    at, par = n.S_SURF + 2, fly()[0].members[1].par
    away = fly({"kind": "hardover", "surface": "rudder"})[1]
    assert away[START + 20][0][at] > 0.1 and (away[START][0] == clean[START][0]).all()
    assert away[-1][0][at] <= par[n.P_HI + 2]
    still = fly({"kind": "float", "surface": "elevator", "value": [0.0]})[1]
    assert (still[-1][0] == clean[-1][0]).all()  # it does not give way: it stays as commanded


def bent(kind: str, value: float, x: np.ndarray) -> np.ndarray:
    """What the servo of a failing elevator is told, 100 times a second, for the commands x [rad]."""
    e = Event(t_s=0.0, kind=kind, target="receiver", surface="elevator", value=(value,))
    fault, view = Bent(e, load_aircraft("learjet24").controls, 0.01), View(0)
    return np.array([fault.act(float(a), view) for a in x])


def test_play_is_a_loop_of_its_gap_and_a_slow_surface_a_ramp() -> None:
    """A command of amplitude A with a gap g moves the surface by A - g/2 to both sides, in a loop of area 2 g (A - g/2)."""
    x, gap = 0.05 * np.sin(np.linspace(0.0, 6.0 * np.pi, 6001)), 0.02
    y = bent("play", gap, x)[-2001:]
    assert y.max() == pytest.approx(0.05 - gap / 2, abs=1e-6) and y.min() == pytest.approx(gap / 2 - 0.05, abs=1e-6)
    assert abs(np.trapezoid(y, x[-2001:])) == pytest.approx(2.0 * gap * (0.05 - gap / 2), rel=1e-3)
    y = bent("slow", 0.1, np.r_[np.zeros(1), np.full(99, 0.05)])
    assert np.allclose(y, np.minimum(0.1 * 0.01 * np.arange(100), 0.05), atol=1e-12)


def test_losses_of_one_engine_multiply_and_a_stuck_throttle_stays() -> None:
    loss = [
        Event(t_s=0.0, kind="thrust_loss", target="receiver", index=i, value=(v,)) for i, v in ((0, 0.5), (-1, 0.2))
    ]
    assert power_of(2, loss) == pytest.approx([0.5 * 0.8, 0.8])
    held = Held()
    assert [held.act(x, View(0)) for x in (0.4, 0.9, 0.0)] == [0.4] * 3


def test_fuel_leaks_and_the_radio_comes_and_goes(clean: list[Any]) -> None:
    rows = fly({"kind": "leak", "value": [4.0]})[1]
    lost = clean[-1][0][n.S_FUEL] - rows[-1][0][n.S_FUEL]
    assert lost == pytest.approx(4.0 * (TICKS - 1 - START) / 100, rel=1e-3)
    up = [r[3] for r in fly({"kind": "link_poor", "value": [0.5]})[1]]
    assert all(up[:START]) and 5 < sum(up[START:]) < TICKS - START - 5


def test_frozen_readings_keep_their_noise_and_wrong_stamps_are_off(clean: list[Any]) -> None:
    late = fly({"kind": "stamp", "sensor": "gnss", "value": [1.0]})[1]
    assert late[-1][2] - clean[-1][2] == 1_000_000 and late[-1][1] == clean[-1][1]
    frozen = [r[1][0] for r in fly({"kind": "frozen", "sensor": "gnss"})[1]]
    assert len(set(frozen[START + 15 :])) > 2  # noise
    assert abs(frozen[-1] - clean[-1][1][0]) > 30.0  # 195 m/s go by


def test_mismatch_and_the_full_airframe_move_the_trim() -> None:
    heavy = fly(**{"aircraft.receiver.mismatch.mass": 1.2})[0].members[1]
    assert heavy.view.o[n.O_MASS] == pytest.approx(3200.0 * 1.2 + heavy.view.s[n.S_FUEL])
    other = dict.fromkeys(("thrust", "lag", "servo", "inertia"), 1.5)
    a, b = (fly(**{"aircraft.receiver.mismatch": m})[0].members[1].par for m in ({}, other))
    assert all(b[i] == pytest.approx(1.5 * a[i]) for i in (n.P_T0, n.P_TAU, n.P_WN))
    assert inertia(5000.0, b) == pytest.approx([1.5 * x for x in inertia(5000.0, a)])
    with pytest.raises(ConfigError, match=r"mismatch\.servo"):
        load_scenario("windshear", {f"aircraft.{load_scenario('windshear').aircraft[0].name}.mismatch.servo": 2.0})


@pytest.mark.parametrize(
    ("params", "word"),
    [
        ((101, 1, 1), "engine 1: engine_off"), ((101, 4, 0, 0, 0.3), "engines: thrust_loss 0.3"), ((101, 2), "throttle_stuck"),
        ((102, 68, 2, 0, -1), "elevator: hardover -1"), ((102, 5, 1), "aileron: slow"), ((100, 5, 0, 0, 2), "fuel: leak 2"),
        ((105, 7), "radio: link_poor 0.5"), ((3, 4), "baro: bias"), ((4, 5, 0, 2, 0.3), "gnss column 2: drift"),
        ((4, 67), "gnss: stamp"), ((0, 66), "imu: frozen"),
    ],
)  # fmt: skip
def test_every_part_can_be_made_to_fail(params: tuple[float, ...], word: str) -> None:
    v = judge(420, params, "receiver", FITTED)
    assert v.result == ACCEPTED and word in v.text and v.event is not None


@pytest.mark.parametrize(
    ("params", "why"),
    [
        ((101, 1, 3), "instance 3"), ((101, 2, 1), "of all engines"), ((102, 68, 2, 0, 0.5), "1 or -1"),
        ((3, 67), "no time of their own"),
        ((4, 4, 0, 0, 2.0), "without a channel"), ((4, 4, 0, 7), "channel 7"), ((105, 68), "of the radio: allowed"),
        ((101, 4, 0, 0, 1.5), "a share of 0 to 1"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_the_reason(params: tuple[float, ...], why: str) -> None:
    v = judge(420, params, "receiver", FITTED)
    assert v.result != ACCEPTED and why in v.text
