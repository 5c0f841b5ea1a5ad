"""Aircraft with equations of their own in the plant's world: registered, sensed, jammed, judged; the small UAV as the first."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from flightsw.aircraft import Aircraft, load_aircraft, load_airframe
from flightsw.icd.codec import FlightCodec, PlantCodec
from flightsw.strict import ConfigError
from flightsw.types import UPD_AIR, UPD_BARO, UPD_FUEL, UPD_GNSS, UPD_IMU, UPD_MAG, ActuatorCmd, Command
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams
from sim_plant.aircraft.alexis.kind import KIND
from sim_plant.aircraft.alexis.member import PERFECT, AlexisTable
from sim_plant.scenario import Scenario, dump, load_scenario
from sim_plant.sensors.base import Sensor
from sim_plant.wind.planar import PlanarWind
from sim_plant.world import AircraftLostError, World

QUIET = {"noise.scale": 0.0, "noise.bias_scale": 0.0}


def gust(over: dict[str, Any] | None = None) -> Scenario:
    return load_scenario("gust", over or {})


def trimmed(w: World) -> list[ActuatorCmd]:
    return [w.trim_cmd(i) for i in range(len(w.members))]


def test_calm_air_and_trim_keep_the_small_uav_where_it_is() -> None:
    calm = {f"aircraft.{a}.plant.wind": {"sigma_w_mps": 0.0, "sigma_u_mps": 0.0} for a in ("alexis", "reference")}
    w = World(gust(calm | QUIET))
    for _ in range(250):
        frames = w.sense()
        w.step(trimmed(w))
    f = frames[0]
    assert f.gyro_b[1] == pytest.approx(0.0, abs=1e-12) and f.acc_b == pytest.approx((0.0, 0.0, -9.81), abs=1e-9)
    assert f.air_V[0] == pytest.approx(20.0) and f.baro_alt_m == pytest.approx(100.0)
    assert w.truth(0).pos_n == pytest.approx((20.0 * 5.0, 0.0, -100.0))


def test_the_world_flies_the_aircraft_of_the_pure_plant() -> None:
    """The same flight with nothing in between: same wind, same servos, commands one sample late."""
    sc = gust(QUIET)
    w = World(sc)
    table = sc.aircraft[0].plant["wind"]
    wind = PlanarWind(**{key: v for key, v in table.items() if key != "gusts"})
    sc = gust(QUIET | {"aircraft.alexis.plant.wind.gusts": [], "aircraft.reference.plant.wind.gusts": []})
    w = World(sc)
    pure = Alexis(AlexisParams(sensors=PERFECT), wind, sc.meta.seed, sc.meta.duration_s, 0.02, 4)
    rng = np.random.default_rng(1)
    late = np.zeros(3)
    for _ in range(200):
        w.sense()
        t = w.truth(0)
        assert t.w_b[1] == pure.truth[3] and t.alpha == pure.reading[1] and -t.pos_n[2] == pure.reading[4]
        assert t.wind_n[2] / 20.0 == pytest.approx(pure.truth[1], abs=1e-12) and t.wind_n[0] == pure.truth[2]
        e, f = 0.02 * rng.standard_normal(2)
        w.step([ActuatorCmd(w.t_us, 0.0, e, 0.0, 0.5, flap=f), None])
        pure.step(late)
        late = np.array([e, 0.0, f])


def test_two_of_them_meet_the_same_wind_and_read_it_with_their_own_errors() -> None:
    w = World(gust())
    for _ in range(100):
        a, b = w.sense()
        assert w.truth(0).wind_n == w.truth(1).wind_n
        assert a.air_V != b.air_V
        w.step(trimmed(w))


def test_heading_turns_path_and_wind_together() -> None:
    over = {f"aircraft.{a}.start.psi_deg": 90.0 for a in ("alexis", "reference")}
    north, east = World(gust(QUIET)), World(gust(QUIET | over))
    for w in (north, east):
        for _ in range(50):
            w.sense()
            w.step(trimmed(w))
    a, b = north.truth(0), east.truth(0)
    assert b.pos_n[1] == pytest.approx(a.pos_n[0]) and b.wind_n[1] == pytest.approx(a.wind_n[0])
    assert b.euler[0] == pytest.approx(math.pi / 2) and b.euler[1] == a.euler[1]


def test_accelerometer_reads_what_moves_the_aircraft() -> None:
    """Specific force turned to earth axes and gravity give the change of velocity."""
    smooth = {"axis": "down", "size_mps": 3.0, "start_s": 0.2, "length_s": 1.0, "shape": "one_cosine"}
    air = {"sigma_w_mps": 0.0, "sigma_u_mps": 0.0, "gusts": [smooth]}
    w = World(gust(QUIET | {f"aircraft.{a}.plant.wind": air for a in ("alexis", "reference")}))
    before = None
    for _ in range(80):
        f = w.sense()[0]
        t = w.truth(0)
        th = t.euler[1]
        down = f.acc_b[2] * math.cos(th) - f.acc_b[0] * math.sin(th) + 9.81
        if before is not None:
            mean = 0.5 * (before[1] + down)
            assert (t.vel_n[2] - before[0]) / 0.02 == pytest.approx(mean, abs=0.02)
        before = t.vel_n[2], down
        w.step([ActuatorCmd(w.t_us, 0.0, 0.0, 0.0, 0.5), None])


def test_sensors_are_those_it_carries() -> None:
    w = World(gust())
    assert [s.group for s in w.members[0].sensors] == ["imu", "baro", "gnss", "att", "air"]
    updated = 0
    for _ in range(20):
        updated |= w.sense()[0].updated
        w.step(trimmed(w))
    assert updated & (UPD_IMU | UPD_BARO | UPD_GNSS | UPD_AIR) == UPD_IMU | UPD_BARO | UPD_GNSS | UPD_AIR
    assert not updated & (UPD_MAG | UPD_FUEL)


def test_vane_bias_and_injected_failures_reach_the_probe() -> None:
    w = World(gust(QUIET))
    bias = []
    for k in range(700):
        f = w.sense()[0]
        bias.append(f.air_alpha[0] - w.truth(0).alpha)
        if k == 650:  # off, airspeed unit, first probe
            assert w.command(0, Command(420, (8.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0), 255, 190)).verdict.result == 0
        w.step(trimmed(w))
    assert max(map(abs, bias[:599])) < 1e-12 and bias[601] == pytest.approx(math.radians(1.0), abs=1e-6)
    assert not w.members[0].frame.air_mask & 1 and w.members[1].frame.air_mask & 1


def test_jam_freezes_elevator_or_flap() -> None:
    sc = gust()
    for surface, slot in (("elevator", 1), ("aileron", 0)):  # the flap answers to the name of what it has no other of
        jam = {"t_s": 0.5, "kind": "jam", "target": "alexis", "surface": surface}
        w = World(load_scenario("gust", {"event": [jam]}))
        at = []
        for _ in range(60):
            w.sense()
            at.append(w.truth(0).controls[slot])
            w.step([ActuatorCmd(w.t_us, 0.0, 0.1, 0.0, 0.5, flap=0.1), None])
        assert at[24] > 0.05 and len(set(at[26:])) == 1
    assert sc.aircraft[0].model == "alexis"


def test_the_ground_ends_the_run() -> None:
    w = World(gust())
    with pytest.raises(AircraftLostError, match="alexis hit the ground"):
        for _ in range(3000):
            w.sense()
            w.step([ActuatorCmd(w.t_us, 0.0, 0.02, 0.0, 0.3), None])


@pytest.mark.parametrize(
    ("over", "match"),
    [
        ({"aircraft.alexis.model": "balloon"}, "allowed: alexis, jsbsim, polynomial, sixdof, twinjet"),
        ({"aircraft.alexis.boom_to": "reference"}, "boom_to"),
        ({"aircraft.reference.start.relative_to": "alexis"}, "relative_to.*none with model = 'alexis'"),
        ({"aircraft.reference.tacan_to": "alexis"}, "tacan_to"),
        ({"wind.wake.source": "alexis"}, "wake.source"),
        ({"aircraft.alexis.model": "sixdof"}, "plant: model = 'sixdof' has none"),
    ],
)
def test_a_scenario_that_makes_no_sense_is_refused(over: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        gust(over)


@pytest.mark.parametrize(
    ("over", "match"),
    [
        ({"aircraft.alexis.plant.wing": 1.0}, r"aircraft\.alexis\.plant: wing: unknown key"),
        ({"aircraft.alexis.plant.lift_factor": 9.0}, "lift_factor = 9.0: allowed 0.1 to 3"),
        ({"aircraft.alexis.plant.wind.gusts": [{"axis": "side", "size_mps": 1.0, "start_s": 0.0, "length_s": 1.0}]}, "gust axis"),
        ({"aircraft.alexis.plant.wind.gusts": [{"axis": "down", "size_mps": 99.0, "start_s": 0.0, "length_s": 1.0}]},
         r"gusts\[0\]\.size_mps = 99\.0: allowed -50 to 50"),
        ({"aircraft.alexis.plant.wind.L_w_m": 0.0}, r"wind\.L_w_m = 0\.0: allowed 1 to 5000"),
        ({"aircraft.alexis.plant.wind.L_u_m": -1.0}, r"wind\.L_u_m = -1\.0: allowed 1 to 5000"),
        ({"aircraft.alexis.plant.wind.sigma_w_mps": -1.0}, r"wind\.sigma_w_mps = -1\.0: allowed 0 to 50"),
        ({"aircraft.alexis.plant.wind.sigma_u_mps": math.nan}, r"wind\.sigma_u_mps = nan: expected a finite number"),
        ({"aircraft.alexis.plant.wind.steady_tail_mps": 20.0}, r"wind\.steady_tail_mps = 20\.0: allowed -15 to 15"),
        ({"aircraft.alexis.plant.wind.steps": [[5.0, 1.0], [2.0, 0.0]]}, r"wind: steps\[1\]: time 2\.0 after 5\.0; allowed"),
        ({"aircraft.alexis.plant.wind.steps": [[5.0, -1.0]]}, r"wind: steps\[0\]: factor -1\.0; allowed >= 0"),
        ({"aircraft.alexis.plant.servo.zeta": 1.0}, r"servo\.zeta = 1\.0: allowed 0\.05 to 0\.99"),
        ({"aircraft.alexis.plant.servo.wn_radps": 0.0}, r"servo\.wn_radps = 0\.0: allowed 1 to 500"),
        ({"aircraft.alexis.plant.servo.rate_degps": math.nan}, r"servo\.rate_degps = nan: expected a finite number"),
        ({"aircraft.alexis.plant.servo.flap_deg": -20.0}, r"servo\.flap_deg = -20\.0: allowed 0 to 60"),
    ],
)  # fmt: skip
def test_a_wrong_table_of_a_model_is_named_before_anything_is_written(over: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        gust(over).load_aircraft()


def test_another_speed_at_the_start_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"start\.V_mps = 25\.0: allowed: 20"):
        World(gust({"aircraft.alexis.start.V_mps": 25.0}))


def test_the_resolved_scenario_reads_back() -> None:
    sc = gust()
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as tmp:
        path = Path(tmp) / "scenario.toml"
        path.write_text(dump(sc, 1))
        assert load_scenario(str(path)) == sc


def test_aircraft_records() -> None:
    uav = load_airframe("alexis")
    assert not isinstance(uav, Aircraft) and uav.controls.flap_deg == (-20.0, 20.0)
    assert isinstance(load_airframe("kc135r"), Aircraft)
    with pytest.raises(ConfigError, match=r"meta.model = 'alexis': allowed here: 'sixdof'"):
        load_aircraft("alexis")


def test_flap_command_travels_over_the_wire_and_costs_the_others_nothing() -> None:
    uav = load_airframe("alexis")
    cmd = ActuatorCmd(20_000, 0.0, 0.1, 0.0, 0.5, flap=-0.2)
    got = PlantCodec(uav, 3).decode_reply(FlightCodec(uav, 3).actuators(cmd)).cmd
    assert (
        got is not None and got.flap == pytest.approx(-0.2, rel=1e-6) and got.elevator == pytest.approx(0.1, rel=1e-6)
    )
    jet = load_aircraft("learjet24")
    plain = FlightCodec(jet, 2).actuators(ActuatorCmd(10_000, 0.01, 0.02, 0.03, 0.5))
    back = PlantCodec(jet, 2).decode_reply(plain).cmd
    assert back is not None and back.flap == 0.0


def test_table_and_class_agree() -> None:
    assert KIND.table() is AlexisTable
    assert all(issubclass(s.__class__, Sensor) for s in World(gust()).members[0].sensors)
