"""The world as a whole: start in trim, command path, boom, fuel, determinism."""

from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np
import pytest

from flightsw.icd.codec import PlantCodec
from flightsw.strict import ConfigError
from flightsw.types import ActuatorCmd
from ground.link.packets import decode
from sim_plant.couplings.boom import BoomCoupling
from sim_plant.kernels import layout as n
from sim_plant.scenario import load_scenario
from sim_plant.truth import row_of
from sim_plant.world import AircraftLostError, World

CALM = {"wind.dryden.sigma_mps": 0.0}
AT_CONTACT = CALM | {"aircraft.receiver.start.xi_m": [-35.5, 0.0, 8.5], "wind.wake.source": ""}


def world(over: dict[str, Any] | None = None, seed: int = 1) -> World:
    return World(load_scenario("refueling", over or {}), seed)


def fly(w: World, ticks: int, latch: bool = False) -> None:
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    cmds[1].latch = latch
    for _ in range(ticks):
        w.sense()
        w.step(cmds)


def digest(over: dict[str, Any], seed: int, ticks: int = 300) -> str:
    w, h = world(over, seed), hashlib.sha256()
    cmds = [w.trim_cmd(0), w.trim_cmd(1)]
    for _ in range(ticks):
        h.update(repr(w.sense()).encode())
        w.step(cmds)
    h.update(repr((w.truth(0), w.truth(1))).encode())
    return h.hexdigest()


def test_same_seed_same_bytes_another_seed_differs() -> None:
    assert digest({}, 7) == digest({}, 7)
    assert digest({}, 7) != digest({}, 8)


def test_flight_starts_trimmed_where_the_scenario_says() -> None:
    w = world(CALM)
    w.sense()
    t, r = w.truth(0), w.truth(1)
    assert t.pos_n == (0.0, 0.0, -7010.0)
    assert pytest.approx(195.0, abs=1e-6) == t.V
    assert r.xi == pytest.approx((-59.13, 56.33, 0.0), abs=1e-6)
    assert r.xi_dot == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    for x in (t, r):
        assert np.allclose(x.acc_n, 0.0, atol=1e-4)
        assert abs(x.beta) < 1e-6
    assert np.hypot(t.wind_n[0], t.wind_n[1]) == pytest.approx(34.6, abs=0.3)


def test_trim_holds_for_a_while() -> None:
    w = world(CALM | {"wind.wake.source": ""})
    fly(w, 1000)
    assert w.truth(1).xi == pytest.approx((-59.13, 56.33, 0.0), abs=0.3)
    assert w.t_us == 10_000_000


def test_true_aerodynamics_differ_from_the_file_by_the_set_fraction() -> None:
    a, b = world(seed=1), world(seed=2)
    exact = world({"aircraft.tanker.aero_error_frac": 0.0})
    lo, hi = n.CL0, n.CN_DR + 1
    ref = exact.members[0].par
    used = ref[lo:hi] != 0
    ratio = a.members[0].par[lo:hi][used] / ref[lo:hi][used] - 1
    assert 0.05 < np.max(np.abs(ratio)) <= 0.1
    assert np.array_equal(a.members[0].par[hi:], ref[hi:])
    assert not np.allclose(a.members[0].par, b.members[0].par)
    other = World(load_scenario("refueling", {"aircraft.receiver.aero_error_frac": 0.0}), 1).members[1].par[lo:hi]
    assert not np.allclose(ratio, a.members[1].par[lo:hi][used] / other[used] - 1)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_commands_take_effect_after_the_delay(delay: int) -> None:
    w = world(CALM | {"link.actuator_delay_ticks": delay})
    base = w.trim_cmd(1)
    start = w.members[1].s[n.S_SURF + 1]
    moved = []
    for k in range(8):
        w.sense()
        cmd = ActuatorCmd(0, base.aileron, base.elevator + (0.05 if k >= 2 else 0.0), base.rudder, base.throttle)
        w.step([w.trim_cmd(0), cmd])
        moved.append(abs(w.members[1].s[n.S_SURF + 1] - start) > 1e-4)
    assert moved.index(True) == 2 + delay


def test_jitter_keeps_the_order_of_commands() -> None:
    w = world(CALM | {"link.actuator_jitter_ticks": 2})
    seen = []
    for k in range(200):
        w.sense()
        w.step([w.trim_cmd(0), ActuatorCmd(0, 0.0, k * 1e-4, 0.0, 0.5)])
        seen.append(w.members[1].c[1] * 1e4)
    lag = np.arange(200)[10:] - np.array(seen)[10:]
    assert np.all(np.diff(seen[10:]) > -1e-9)
    assert set(np.round(lag).astype(int)) <= {1, 2, 3} and len(set(np.round(lag))) > 1


def test_disarmed_missing_and_rubbish_commands_change_nothing() -> None:
    w = world(CALM)
    kept = w.members[1].path.current
    bad = [None, ActuatorCmd(0, 1.0, 1.0, 1.0, 1.0, armed=False), ActuatorCmd(0, math.nan, 0.0, 0.0, 0.5)]
    for cmd in bad * 3:
        w.sense()
        w.step([None, cmd])
    assert w.members[1].path.current == kept
    assert w.members[1].path.refused == 3


def test_jammed_surface_ignores_commands() -> None:
    event = {"t_s": 0.05, "kind": "jam", "target": "receiver", "surface": "rudder", "for_s": 0.1}
    w = world(CALM | {"event": [event]})
    pos = []
    for k in range(30):
        w.sense()
        w.step([w.trim_cmd(0), ActuatorCmd(0, 0.0, 0.03, 0.002 * k, 0.5)])
        pos.append(w.members[1].s[n.S_SURF + 2])
    assert pos[5] == pos[14] and pos[4] != pos[5 - 2] and pos[20] > pos[14]


def test_nominal_contact_position_is_mid_envelope() -> None:
    w = world(AT_CONTACT | {"aircraft.tanker.aero_error_frac": 0.0, "aircraft.receiver.aero_error_frac": 0.0})
    w.sense()
    t = w.truth(1)
    assert t.inside and not t.contact
    assert math.degrees(t.boom_elevation) == pytest.approx(-30.0, abs=2.0)
    assert t.boom_azimuth == pytest.approx(0.0, abs=1e-3)
    assert t.boom_extension == pytest.approx(3.66, abs=0.3)


def boom(w: World) -> BoomCoupling:
    return next(c for c in w.couplings if isinstance(c, BoomCoupling))


def test_contact_needs_a_second_of_calm_with_the_latch_and_moves_fuel() -> None:
    w = world(AT_CONTACT)
    fly(w, 300)
    assert w.truth(1).inside and not w.truth(1).contact  # no latch, no contact
    mass = [w.truth(i).mass for i in (0, 1)]
    fly(w, 100, latch=True)
    assert not w.truth(1).contact
    fly(w, 5, latch=True)
    assert w.truth(1).contact and w.truth(0).contact
    m1 = [w.truth(i).mass for i in (0, 1)]
    fly(w, 200, latch=True)
    m2 = [w.truth(i).mass for i in (0, 1)]
    assert m2[1] - m1[1] == pytest.approx(2 * (2.5 - 0.16), abs=0.1)  # transfer less own burn
    assert m2[0] - m1[0] == pytest.approx(-2 * (2.5 + 1.2), abs=0.2)
    assert m1[0] < mass[0]
    frames = w.sense()
    assert frames[0].boom_contact and frames[1].boom_contact
    fly(w, 5, latch=False)
    assert not w.truth(1).contact
    assert boom(w).reason == "latch released"


def test_transfer_stops_at_the_mass_limit() -> None:
    w = world(AT_CONTACT | {"aircraft.receiver.fuel_kg": 2900.0})
    fly(w, 120, latch=True)
    assert w.truth(1).contact
    before = w.truth(1).fuel_kg
    fly(w, 100, latch=True)
    assert w.truth(1).fuel_kg <= before  # tanks full: burning only, topped up in drops
    assert w.truth(1).fuel_kg > 2899.0


def test_leaving_the_envelope_disconnects() -> None:
    w = world(AT_CONTACT)
    fly(w, 150, latch=True)
    assert w.truth(1).contact
    cmd = w.trim_cmd(1)
    cmd.latch, cmd.throttle = True, 0.0
    for _ in range(600):
        w.sense()
        w.step([w.trim_cmd(0), cmd])
    assert not w.truth(1).contact
    assert boom(w).reason in ("outside the envelope", "radial rate over the limit")


def test_a_row_of_the_truth_log_is_the_truth_under_the_names_of_the_message() -> None:
    w = world(AT_CONTACT)
    fly(w, 150, latch=True)
    for i, m in enumerate(w.members):
        t = w.truth(i)
        assert row_of(m) == t.row
        assert t.contact and t.inside
        sent = decode(PlantCodec(m.ac, m.cfg.sysid).truth(t.t_us, t.row))
        for k, v in sent.items():
            assert np.allclose(v, getattr(t, {"time_usec": "t_us"}.get(k, k)), rtol=1e-6, atol=0.0), k


def test_scripted_commands_arrive_at_their_tick() -> None:
    event = {"t_s": 0.1, "kind": "command", "target": "receiver", "action": "contact"}
    speed = {"t_s": 0.1, "kind": "command", "target": "tanker", "command": 178, "params": [0, 190.0]}
    w = world({"event": [event, speed]})
    for k in range(15):
        t, r = w.sense()
        assert bool(r.commands) == bool(t.commands) == (k == 10)
        if k == 10:
            assert r.commands[0].command == 31010 and r.commands[0].params[0] == 3.0
            assert r.commands[0].src_system == 255
            assert t.commands[0].command == 178 and t.commands[0].params[:2] == (0, 190.0)
        w.step([None, None])


def test_impossible_start_is_named() -> None:
    with pytest.raises(ConfigError, match="no trim at airspeed 60"):
        world({"aircraft.tanker.start.V_mps": 60.0})


def test_an_aircraft_on_the_ground_ends_the_run_and_is_named() -> None:
    low = CALM | {"wind.prevailing": "constant", "aircraft.tanker.start.pos_n_m": [0.0, 0.0, -150.0]}
    w = world(low | {"aircraft.receiver.start.xi_m": [-59.0, 56.0, 0.0]})
    dive = w.trim_cmd(1)
    dive.elevator, dive.throttle = dive.elevator + 0.01, 0.0
    with pytest.raises(AircraftLostError, match=r"receiver hit the ground at t = \d"):
        for _ in range(3000):
            w.sense()
            w.step([w.trim_cmd(0), dive])


def test_a_state_that_is_not_finite_ends_the_run_and_is_named() -> None:
    w = world()
    w.sense()
    w.members[0].s[n.S_V] = math.nan
    w.step([None, None])
    with pytest.raises(AircraftLostError, match="tanker has left the model"):
        for _ in range(3):
            w.sense()
            w.step([None, None])
