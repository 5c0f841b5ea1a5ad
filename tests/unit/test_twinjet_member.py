"""The twin-jet in the plant's world: the flight of the pure plant, consistent truth and readings, refused tables."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_airframe
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.strict import ConfigError
from flightsw.types import ActuatorCmd
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams
from sim_plant.aircraft.twinjet.member import PERFECT
from sim_plant.kernels.layout import S_T
from sim_plant.scenario import Scenario, load_scenario
from sim_plant.wind.microburst import Microburst
from sim_plant.world import AircraftLostError, World

QUIET = {"noise.scale": 0.0, "noise.bias_scale": 0.0}
FULL_N = 107e3
PLANT = "aircraft.twinjet.plant"


def windshear(over: dict[str, Any] | None = None) -> Scenario:
    return load_scenario("windshear_paper", over or {})


def test_the_world_flies_the_aircraft_of_the_pure_plant() -> None:
    """The same flight with nothing in between: same downburst, same turbulence, commands one sample late."""
    sc = windshear(QUIET)
    w = World(sc)
    air = TwinJetAir(Microburst(26.5, 915.0, 46.0), 1.07, 0.77)
    pure = TwinJet(TwinJetParams(sensors=PERFECT), air, sc.meta.seed, sc.meta.duration_s + 0.02, 0.02)
    late = pure.controls.copy()
    rng = np.random.default_rng(2)
    for _ in range(500):
        f = w.sense()[0]
        t = w.truth(0)
        assert (f.baro_alt_m, f.air_V[0], f.air_alpha[0]) == pytest.approx(
            (pure.reading[0], pure.reading[2], pure.reading[3]), abs=1e-6
        )
        assert (t.pos_n[0], -t.pos_n[2]) == pytest.approx((pure.truth[0], pure.truth[1]), abs=1e-9)
        assert (t.wind_n[0], -t.wind_n[2]) == pytest.approx((pure.truth[7], pure.truth[8]))
        share, elevator = 0.4 + 0.1 * rng.standard_normal(), 0.02 * rng.standard_normal()
        w.step([ActuatorCmd(w.t_us, 0.0, elevator, 0.0, share)])
        pure.step(late)
        late[:] = share * FULL_N, elevator


def test_accelerometer_turned_back_gives_the_acceleration() -> None:
    w = World(windshear(QUIET))
    before = None
    for _ in range(100):
        f, t = w.sense()[0], w.truth(0)
        th = t.euler[1]
        along = f.acc_b[0] * math.cos(th) + f.acc_b[2] * math.sin(th)
        rise = f.acc_b[0] * math.sin(th) - f.acc_b[2] * math.cos(th) - 9.81
        assert (along, rise) == pytest.approx((t.acc_n[0], -t.acc_n[2]), abs=1e-9)
        if before is not None:
            assert (t.vel_n[0] - before[0]) / 0.02 == pytest.approx(0.5 * (before[1] + along), abs=0.02)
        before = t.vel_n[0], along
        w.step([w.trim_cmd(0)])


def test_calm_air_and_trim_keep_it_on_the_slope_whatever_the_heading() -> None:
    calm = {f"{PLANT}.sigma_u_mps": 0.0, f"{PLANT}.sigma_w_mps": 0.0, f"{PLANT}.burst.outflow_mps": 0.0}
    for psi in (0.0, 90.0):
        start = {"aircraft.twinjet.start.psi_deg": psi, "aircraft.twinjet.start.pos_n_m": [-100.0, 20.0, -350.0]}
        w = World(windshear(calm | QUIET | start))
        for _ in range(250):
            w.sense()
            w.step([w.trim_cmd(0)])
        t = w.truth(0)
        c, s = math.cos(math.radians(psi)), math.sin(math.radians(psi))
        assert t.pos_n == pytest.approx(
            (-100.0 + 375.0 * c, 20.0 + 375.0 * s, -350.0 + 375.0 * math.tan(math.radians(3.0))), abs=0.05
        )
        assert (
            t.euler[0] == pytest.approx(math.radians(psi))
            and pytest.approx(75.0 / math.cos(math.radians(3.0)), abs=0.01) == t.V
        )


def test_vertical_gnss_speed_has_its_own_noise() -> None:
    w = World(windshear())
    e = []
    for _ in range(1500):
        f, t = w.sense()[0], w.truth(0)
        e.append((f.gnss_vel_n[0] - t.vel_n[0], f.gnss_vel_n[2] - t.vel_n[2]))
        w.step([w.trim_cmd(0)])
    assert np.std(e, axis=0) == pytest.approx([1.09728, 0.1524], rel=0.08)


def test_a_jammed_elevator_stays() -> None:
    jam = {"t_s": 0.5, "kind": "jam", "target": "twinjet", "surface": "elevator"}
    w = World(windshear({"event": [jam]}))
    at = []
    for k in range(60):
        w.sense()
        at.append(w.truth(0).controls[1])
        w.step([ActuatorCmd(w.t_us, 0.0, 0.001 * k, 0.0, 0.4)])
    assert len(set(at[2:24])) > 20 and len(set(at[27:])) == 1


@pytest.mark.parametrize(("engines", "left"), [((0,), 0.5), ((0, 1), 0.0)])
def test_an_engine_out_takes_its_share_with_the_lag(engines: tuple[int, ...], left: float) -> None:
    events = [{"t_s": 0.2, "kind": "engine_off", "target": "twinjet", "index": i} for i in engines]
    w = World(windshear(QUIET | {f"{PLANT}.sigma_u_mps": 0.0, f"{PLANT}.sigma_w_mps": 0.0, "event": events}))
    cmd, lag, thrust = w.trim_cmd(0), load_airframe("twinjet").engine.lag_s, []  # type: ignore[attr-defined]
    for _ in range(120):
        w.sense()
        thrust.append(w.members[0].view.s[S_T])
        w.step([cmd])
    t = 0.02 * np.arange(109)
    assert np.allclose(thrust[:11], thrust[0], rtol=1e-9)
    assert np.allclose(thrust[11:], thrust[0] * (left + (1.0 - left) * np.exp(-(t + 0.02) / lag)), rtol=2e-3)


def test_the_ground_ends_the_run() -> None:
    w = World(windshear())
    with pytest.raises(AircraftLostError, match="twinjet hit the ground"):
        for _ in range(5400):
            w.sense()
            w.step([ActuatorCmd(w.t_us, 0.0, 0.08, 0.0, 0.0)])


@pytest.mark.parametrize(
    ("over", "match"),
    [
        ({f"{PLANT}.wing": 1.0}, "wing: unknown key"),
        ({f"{PLANT}.lift_factor": 9.0}, "lift_factor = 9.0: allowed 0.1 to 3"),
        ({f"{PLANT}.burst.radius_m": -1.0}, "radius_m = -1.0; allowed > 0"),
        ({f"{PLANT}.burst.outflow_mps": 200.0}, "outflow_mps = 200.0; allowed 0 to 100"),
    ],
)
def test_a_wrong_table_is_named_before_anything_is_written(over: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        windshear(over).load_aircraft()


def test_a_start_without_steady_flight_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"aircraft\.twinjet\.start\.V_mps = 20: steady flight there takes"):
        World(windshear({"aircraft.twinjet.start.V_mps": 20.0}))


def test_elevator_and_throttle_travel_over_the_wire() -> None:
    jet = load_airframe("twinjet")
    assert not isinstance(jet, Aircraft)
    got = PlantCodec(jet, 5).decode_reply(FlightCodec(jet, 5).actuators(ActuatorCmd(20_000, 0.0, -0.3, 0.0, 0.7))).cmd
    assert got is not None and (got.elevator, got.throttle) == pytest.approx((-0.3, 0.7), rel=1e-6)
