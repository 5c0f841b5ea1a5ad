"""Aircraft of the vertical plane in the scenario's air mass: obeyed in all components, on top of the wind of their own tables."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import alexis, twinjet
from flightsw.strict import ConfigError
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.wind.prevailing import sounding_table
from sim_plant.world import World

CALM = {f"aircraft.{a}.plant.wind": {"sigma_w_mps": 0.0, "sigma_u_mps": 0.0} for a in ("alexis", "reference")}
STILL = {
    "aircraft.twinjet.plant.sigma_u_mps": 0.0, "aircraft.twinjet.plant.sigma_w_mps": 0.0,
    "aircraft.twinjet.plant.burst.outflow_mps": 0.0,
}  # fmt: skip


def fly(name: str, over: dict[str, Any], seconds: float) -> tuple[list[Any], World]:
    """Truths of the first aircraft, tick by tick, with the trim commands held."""
    world = World(load_scenario(name, {"meta.duration_s": seconds, **over}))
    hold = [world.trim_cmd(i) for i in range(len(world.members))]
    out = []
    while not world.done:
        world.sense()
        out.append(world.truth(0))
        world.step(hold)  # type: ignore[arg-type]
    return out, world


@pytest.mark.parametrize("psi_deg", [0.0, 70.0])
def test_a_constant_wind_carries_the_small_uav_and_changes_nothing_else(psi_deg: float) -> None:
    """Galilean invariance: in a steady wind the flight through the air is the one of calm air, and the ground moves."""
    puff = {"axis": "down", "size_mps": 1.5, "start_s": 0.5, "length_s": 0.5, "shape": "ramp"}
    start = {"aircraft.alexis.start.psi_deg": psi_deg, "aircraft.alexis.plant.wind.gusts": [puff]}
    calm, _ = fly("gust", {**CALM, **start}, 4.0)
    windy, _ = fly("gust", {**CALM, **start, "wind.constant_mps": [6.0, -4.0]}, 4.0)
    for a, b in zip(calm, windy, strict=True):
        assert np.array(b.wind_n) - np.array(a.wind_n) == pytest.approx(np.array([6.0, -4.0, 0.0]), abs=1e-12)
        assert abs(b.V - a.V) < 1e-9 and abs(b.alpha - a.alpha) < 1e-9
        assert b.beta == pytest.approx(0.0, abs=1e-12)
        assert b.euler == pytest.approx(a.euler, abs=1e-9) and b.pos_n[2] == pytest.approx(a.pos_n[2], abs=1e-8)
        assert np.array(b.vel_n) - np.array(a.vel_n) == pytest.approx(np.array([6.0, -4.0, 0.0]), abs=1e-9)
        t = a.t_us * 1e-6
        assert np.array(b.pos_n) - np.array(a.pos_n) == pytest.approx(np.array([6.0 * t, -4.0 * t, 0.0]), abs=1e-7)
    assert abs(calm[-1].euler[1]) > 1e-3  # and it was a motion


def test_the_jet_starts_in_steady_flight_in_the_wind_of_its_height() -> None:
    """Speed over the ground is the scenario's; the wind is that of the ascent at 350 m."""
    table = sounding_table("sounding_oun_20181222_12z_uwyo.txt")
    over = {**STILL, "wind.prevailing": "sounding", "aircraft.twinjet.start.psi_deg": 30.0}
    truths, _ = fly("windshear", over, 1.0)
    first = truths[0]
    h, n, e = table.T
    want = np.interp(350.0, h, n), np.interp(350.0, h, e)
    assert first.wind_n[:2] == pytest.approx(want) and math.hypot(*want) > 1.0
    ahead = np.array([math.cos(math.radians(30.0)), math.sin(math.radians(30.0))])
    assert ahead @ np.array(first.vel_n[:2]) == pytest.approx(75.0)
    assert max(abs(t.euler[1] - first.euler[1]) for t in truths) < 1e-3 and first.beta == pytest.approx(0.0, abs=1e-12)


def test_wind_of_the_scenario_adds_to_the_tables_own() -> None:
    own, _ = fly("gust", {}, 3.0)
    both, _ = fly("gust", {"wind.constant_mps": [2.0, 3.0], "wind.sine": [SINE]}, 3.0)
    for a, b in zip(own, both, strict=True):
        t = a.t_us * 1e-6
        want = (2.0 + 0.5 * math.sin(math.pi * t), 3.0, 0.3 * math.sin(2.0 * math.pi * t / 1.5 + 0.2))
        assert np.array(b.wind_n) - np.array(a.wind_n) == pytest.approx(np.array(want), abs=1e-9)
    jet, _ = fly("windshear", {}, 2.0)
    windy, _ = fly("windshear", {"wind.sine": [SINE]}, 2.0)
    # the downburst at another place of another flight: near, not equal
    down = [b.wind_n[2] - a.wind_n[2] - 0.3 * math.sin(2.0 * math.pi * a.t_us * 1e-6 / 1.5 + 0.2)
            for a, b in zip(jet, windy, strict=True)]  # fmt: skip
    assert max(map(abs, down)) < 0.02


SINE = {"amplitude_mps": [0.5, 0.0, 0.3], "period_s": [2.0, 1.0, 1.5], "phase_rad": [0.0, 0.0, 0.2]}


@pytest.mark.parametrize(("name", "aircraft", "calm"), [("gust", "alexis", CALM), ("windshear", "twinjet", STILL)])
def test_a_cross_wind_acts_by_sideslip_with_the_files_side_force(
    name: str, aircraft: str, calm: dict[str, Any]
) -> None:
    """A cross wind that comes within 4 s: first-order lag of the sideways speed (closed form), sideslip between the two."""
    sine = {"amplitude_mps": [0.0, 3.0, 0.0], "period_s": [1.0, 16.0, 1.0]}
    truths, _ = fly(name, {**calm, "wind.sine": [sine]}, 4.0)
    if aircraft == "alexis":
        tau = 20.0 / -alexis().side.beta
    else:
        r = twinjet()
        tau = r.mass.kg / (0.5 * r.air.rho_kgpm3 * 75.1 * r.geometry.S_m2 * -r.side.CY_beta)
    w = 2.0 * math.pi / 16.0
    k = 3.0 / (1.0 + (w * tau) ** 2)
    for t in truths[::10]:
        s = t.t_us * 1e-6
        lagged = k * (math.sin(w * s) - w * tau * math.cos(w * s) + w * tau * math.exp(-s / tau))
        assert t.vel_n[1] == pytest.approx(lagged, abs=0.03)
        assert math.sin(t.beta) * t.V == pytest.approx(t.vel_n[1] - t.wind_n[1], abs=1e-9)
    assert truths[-1].beta < -0.005 and truths[-1].pos_n[1] > 0.1


def gusts(world: World, n: int) -> np.ndarray:
    """Rows (ahead, right, down) [m/s] on every aircraft of the vertical plane, [n, aircraft, 3]."""
    rows = []
    for k in range(n):
        world.air.begin()
        for m in world.members:
            world.air.step(m, k)
        rows.append([m.along(m.free) for m in world.members])  # type: ignore[attr-defined]
    return np.array(rows)


def test_turbulence_along_the_heading_with_the_published_intensity_and_scale() -> None:
    """MIL-F-8785C: sigma in all three; correlation exp(-V tau / L) along, (1 - V tau / 2L) exp(-V tau / L) across."""
    over = {
        "wind.dryden.sigma_mps": 1.5, "wind.dryden.V_mps": 20.0, "wind.dryden.L_m": 20.0, "wind.dryden.independent": True,
        "aircraft.reference.start.psi_deg": 120.0,
    }  # fmt: skip
    g = gusts(World(load_scenario("gust", over)), 120_000)[:, :, :]
    lag = 25  # half a second: V tau / L = 0.5
    for i in (0, 1):  # heading 0 and 120 deg
        # effective samples: 2400 s at an integral scale of about 1 s
        assert g[:, i].std(axis=0) == pytest.approx(1.5, rel=0.06)
        for axis, want in ((0, math.exp(-0.5)), (1, 0.75 * math.exp(-0.5)), (2, 0.75 * math.exp(-0.5))):
            x = g[:, i, axis]
            assert np.mean(x[lag:] * x[:-lag]) / np.mean(x * x) == pytest.approx(want, abs=0.05)
    cross = np.corrcoef(g.reshape(len(g), -1).T) - np.eye(6)
    assert np.abs(cross).max() < 0.08  # axes and aircraft each their own


def test_both_small_uavs_meet_the_same_turbulence_unless_told_otherwise() -> None:
    over = {"wind.dryden.sigma_mps": 1.0, "wind.dryden.step": [{"t_s": 1.0, "sigma_mps": 0.0}]}
    g = gusts(World(load_scenario("gust", over)), 100)
    assert np.array_equal(g[:, 0], g[:, 1]) and g[:49].std() > 0.1 and not g[51:].any()
    turned = gusts(World(load_scenario("gust", {**over, "aircraft.reference.start.psi_deg": 90.0})), 40)
    # one air, whatever the heading; its axes are those of the first
    assert turned[:, 1, 0] == pytest.approx(turned[:, 0, 1]) and turned[:, 1, 1] == pytest.approx(-turned[:, 0, 0])
    ned = gusts(
        World(load_scenario("gust", {**over, "wind.dryden.axes": "ned", "aircraft.reference.start.psi_deg": 90.0})), 40
    )
    assert ned[:, 1, 0] == pytest.approx(ned[:, 0, 1]) and ned[:, 1, 1] == pytest.approx(-ned[:, 0, 0])


def test_the_downburst_stays_where_it_is_when_the_jet_drifts() -> None:
    _, world = fly("windshear", {"wind.constant_mps": [0.0, 8.0], "aircraft.twinjet.plant.burst.offset_m": 30.0}, 2.0)
    assert world.members[0].flight.m[1] == pytest.approx(30.0 - 16.0, abs=1e-6)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "over", "text"),
    [
        ("gust", {"wind.wake.source": "alexis"}, r"wind\.wake\.source = 'alexis': allowed: aircraft of model"),
        ("gust", {"wind.wake.core_wing_m": 2.0}, r"wind\.wake\.core_wing_m = 2\.0: nothing obeys it without wind\.wake\.source"),
        ("windshear", {"wind.sounding": "other.txt"}, r"wind\.sounding = 'other\.txt': nothing obeys it with"),
        ("refueling", {"wind.constant_mps": [15.0, -8.0]}, r"wind\.constant_mps = \(15\.0, -8\.0\): nothing obeys it with"),
        ("windshear", {"wind.dryden.independent": True}, r"wind\.dryden\.independent = True: nothing obeys it"),
        ("windshear", {"link.radio_loss": 0.1}, r"link\.radio_loss = 0\.1: nothing obeys it with one aircraft"),
        ("gust", {"sensors.alexis.fuel.std_kg": 1.0}, r"sensors\.alexis\.fuel\.std_kg = 1\.0: nothing obeys it"),
        ("gust", {"aircraft.alexis.fuel_kg": 1.0}, r"aircraft\.alexis\.fuel_kg = 1\.0: nothing obeys it"),
        ("gust", {"aircraft.alexis.aero_error_frac": 0.1}, r"aircraft\.alexis\.aero_error_frac = 0\.1: nothing obeys it"),
        ("refueling", {"aircraft.receiver.start.V_mps": 180.0}, r"aircraft\.receiver\.start\.V_mps = 180\.0: nothing obeys it"),
        ("refueling", {"aircraft.tanker.start.xi_m": [1.0, 0.0, 0.0]}, r"aircraft\.tanker\.start\.xi_m = "),
        ("refueling", {"traffic.y_m": 5.0}, r"traffic\.y_m = 5\.0: nothing obeys it while traffic\.on = false"),
        ("refueling", {"traffic.on": True, "traffic.sysid": 9}, r"traffic\.on = true: allowed with an aircraft"),
        ("rendezvous", {"refuel.capture_s": 5.0}, r"refuel\.capture_s = 5\.0: nothing obeys it"),
        ("rendezvous", {"sensors.tanker.radar.sigma_m": 5.0}, r"sensors\.tanker\.radar\.sigma_m = 5\.0: nothing obeys it of"),
        ("refueling", {"clock.truth_hz": 33}, r"clock\.truth_hz = 33: allowed: base_rate_hz = 100 divided"),
    ],
)  # fmt: skip
def test_what_cannot_be_obeyed_is_refused_by_name(name: str, over: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        load_scenario(name, over)


def test_wake_among_aircraft_that_cannot_feel_it_and_a_surface_that_is_not_there() -> None:
    wake: Scenario = load_scenario("refueling")
    assert wake.wind.wake.source == "tanker"
    jam = {"t_s": 1.0, "kind": "jam", "target": "twinjet", "surface": "rudder"}
    with pytest.raises(
        ConfigError, match=r"event\[0\]\.surface = 'rudder': twinjet \(model = 'twinjet'\) has elevator"
    ):
        World(load_scenario("windshear", {"event": [jam]}))
