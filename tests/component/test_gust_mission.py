"""The gust mission on readings made by hand, and in the plant's small UAV where they must hang together: which law flies, what
it does about a gust, and what is refused."""

from __future__ import annotations

import copy
import math
from pathlib import Path

import numpy as np
import pytest

import flightsw
from flightsw.app import FlightApp
from flightsw.condition import ConditionParams
from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimators import ESTIMATORS, GustNavTable, make_gust_nav
from flightsw.missions.gust.laws import LAWS, GustCtrlTable, GustLaws
from flightsw.missions.gust.mission import ALLEVIATION, HOLD, MAV_CMD_USER_2
from flightsw.missions.gust.model import Turbulence, published
from flightsw.missions.gust.reports import GustState
from flightsw.missions.gust.servos import GustServos
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError
from flightsw.types import HF_AIR, HF_SAT, UPD_AIR, UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, Command, SensorFrame, Snapshot
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams
from sim_plant.wind.planar import Gust, PlanarWind

PARAMS = Path(flightsw.__file__).parent / "params"
DT = 0.02
ALL = UPD_IMU | UPD_AIR | UPD_ATT | UPD_BARO | UPD_GNSS


def make(**over: object) -> FlightApp:
    cfg = load_flight(PARAMS / "gust.toml", {key.replace("__", "."): v for key, v in over.items()})
    a = cfg.app
    return FlightApp(
        a.mission, a.aircraft, cfg.tables, base_rate_hz=a.base_rate_hz, mission_rate_hz=a.mission_rate_hz,
        link_delay_ticks=cfg.link.delay_ticks,
    )  # fmt: skip


@pytest.fixture(scope="module")
def designed() -> FlightApp:
    """The shipped application; tests take deep copies."""
    return make()


class Feed:
    """Noisy readings of straight flight at 20 m/s and 100 m, heading `psi`, in calm air."""

    def __init__(self, seed: int = 1, psi: float = 0.0) -> None:
        self.rng, self.k, self.psi = np.random.default_rng(seed), 0, psi

    def frame(self, updated: int = ALL) -> SensorFrame:
        self.k += 1
        t = self.k * 20_000
        n = self.rng.standard_normal(12)
        th = 0.0035 * n[3]
        c, s, cp, sp = math.cos(th / 2), math.sin(th / 2), math.cos(self.psi / 2), math.sin(self.psi / 2)
        v = 20.0 + 0.2 * n[5]
        return SensorFrame(
            t_us=t, updated=updated, gyro_b=(0.01 * n[6], 0.01 * n[0], 0.01 * n[7]), acc_b=(0.0, 0.0, -9.81 + 0.3 * n[8]),
            baro_alt_m=100.0 + n[4], gnss_t_us=t, gnss_pos_n=(20.0 * t * 1e-6, 0.0, -100.0 + n[9]),
            gnss_vel_n=(v * math.cos(self.psi), v * math.sin(self.psi), 0.0), air_t_us=t, air_mask=1, air_V=(20.0 + 0.35 * n[2],),
            air_alpha=(0.0087 * n[1],), air_beta=(0.001 * n[10],), att_t_us=t, att_q_nb=(cp * c, -sp * s, cp * s, sp * c),
        )  # fmt: skip

    def fly(self, app: FlightApp, seconds: float, updated: int = ALL) -> Snapshot:
        for _ in range(round(seconds / DT)):
            snap = app.tick(self.frame(updated), DT)[1]
        return snap


def sink(app: FlightApp, size_mps: float, until_s: float, seed: int = 3) -> Snapshot:
    """Fly the plant's UAV into air that sinks with size_mps, reached within 0.3 s from 5 s on; the state at until_s."""
    plant = Alexis(AlexisParams(), PlanarWind(0.0, 0.0, gusts=(Gust("down", size_mps, 5.0, 0.3),)), seed, until_s + 1.0)
    late, cmd = np.zeros(3), np.zeros(3)
    for i in range(round(until_s / DT) + 1):
        q, alpha, V, pitch, height, ground, a_z = plant.reading
        gnss = UPD_GNSS if plant.fresh >> k.Y_GROUND & 1 else 0
        f = SensorFrame(
            t_us=(i + 1) * 20_000, updated=(ALL & ~UPD_GNSS) | gnss, gyro_b=(1e-5 * (i % 7), q, 0.0),
            acc_b=(0.0, 0.0, -a_z - 9.81), baro_alt_m=height, gnss_vel_n=(ground, 0.0, 0.0), air_mask=1, air_V=(V,),
            air_alpha=(alpha,), air_beta=(1e-5 * (i % 7),), att_q_nb=(math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0),
        )  # fmt: skip
        f.air_t_us = f.att_t_us = f.gnss_t_us = f.t_us
        c, snap = app.tick(f, DT)
        late[:] = cmd
        cmd[:] = c.elevator, (c.throttle - 0.5) * 460.0, c.flap
        plant.step(late)
    return snap


def test_level_flight_in_calm_air_gives_small_commands_and_a_valid_estimate(designed: FlightApp) -> None:
    s = sink(copy.deepcopy(designed), 0.0, 6.0)
    g = s.report(GustState)
    assert g is not None and g.valid and s.cmd.armed
    assert s.guid.phase == ALLEVIATION and LAWS[g.law] == "alleviation"
    assert abs(g.x[k.AW]) < math.radians(0.5) and abs(g.x[k.AB]) < math.radians(0.5)
    assert len(g.weights) == 4 and sum(g.weights) == pytest.approx(1.0)
    assert g.channels in (6, 7)  # every reading, GNSS included as often as it is new
    assert abs(s.cmd.elevator) < math.radians(2.0) and abs(s.cmd.flap) < math.radians(5.0)
    assert s.cmd.throttle == pytest.approx(0.5, abs=0.1)
    assert s.cmd.aileron == s.cmd.rudder == 0.0


def test_sinking_air_lowers_the_flap(designed: FlightApp) -> None:
    """Sinking air takes incidence away; the flap gives lift back before the flight path has bent."""
    s = sink(copy.deepcopy(designed), 1.5, 5.5)
    assert s.report(GustState) is not None
    assert math.degrees(s.report(GustState).x[k.AW]) == pytest.approx(math.degrees(1.5 / 20.0), abs=1.2)
    assert s.cmd.flap > math.radians(2.5)
    assert abs(s.report(GustState).x[k.H]) < 1.0
    assert s.nav.wind_n[2] == pytest.approx(20.0 * s.report(GustState).x[k.AW])


@pytest.mark.parametrize("psi", [0.0, 2.0])
def test_published_state_is_that_of_the_readings(designed: FlightApp, psi: float) -> None:
    app = copy.deepcopy(designed)
    s = Feed(psi=psi).fly(app, 4.0)
    assert s.nav.euler[0] == pytest.approx(psi)
    assert pytest.approx(20.0, abs=0.5) == s.nav.V
    assert s.nav.vel_n[0] == pytest.approx(20.0 * math.cos(psi), abs=0.5)
    assert s.nav.vel_n[1] == pytest.approx(20.0 * math.sin(psi), abs=0.5)
    assert s.nav.pos_n[2] == pytest.approx(-100.0, abs=1.5)
    w, x, y, z = s.nav.q_nb
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(psi)


def test_the_ground_chooses_the_law_and_a_wrong_number_is_refused() -> None:
    app = make(nav__servo_bank__wait_s=0.0)
    feed = Feed()
    feed.fly(app, 2.0)
    for law, phase in ((0.0, HOLD), (2.0, ALLEVIATION), (1.0, ALLEVIATION)):
        f = feed.frame()
        f.commands = [Command(MAV_CMD_USER_2, (law, 0, 0, 0, 0, 0, 0), 255, 190)]
        s = app.tick(f, DT)[1]
        assert s.acks[0].result == 0
        assert s.guid.phase == phase and s.report(GustState) is not None and s.report(GustState).law == int(law)
        if law == 2.0:
            assert s.cmd.flap == 0.0
    for bad in (3.0, -1.0, 0.5, math.nan, math.inf):
        f = feed.frame()
        f.commands = [Command(MAV_CMD_USER_2, (bad, 0, 0, 0, 0, 0, 0), 255, 190)]
        a = app.tick(f, DT)[1].acks[0]
        assert a.result == 2 and a.reason == f"law {bad:g}: allowed 0 hold, 1 alleviation, 2 elevator"
    flying = app.mission.ctrl.law
    for foreign in (178, 191, 31010, 31012):  # hold (1) to the receiver is alleviation here, if it were taken
        f = feed.frame()
        f.commands = [Command(foreign, (1.0, *[0.0] * 6), 255, 190)]
        a = app.tick(f, DT)[1].acks[0]
        assert a.result == 3 and "not one of this mission" in a.reason and app.mission.ctrl.law == flying


def test_without_the_vane_the_hold_flies_until_there_is_an_estimate(designed: FlightApp) -> None:
    app = copy.deepcopy(designed)
    feed = Feed()
    s = feed.fly(app, 1.0, ALL & ~UPD_AIR)
    assert not s.nav.valid and s.guid.phase == 0 and "alpha" in s.nav.reason
    assert not s.cmd.armed  # keeps the trim it came in
    s = feed.fly(app, 3.0)
    assert s.nav.valid and s.cmd.armed


def test_lost_readings_are_reported_and_the_estimate_goes_on(designed: FlightApp) -> None:
    app = copy.deepcopy(designed)
    feed = Feed()
    feed.fly(app, 6.0)
    s = feed.fly(app, 1.0, ALL & ~UPD_AIR)
    assert s.nav.valid and s.health.failed & HF_AIR
    assert s.report(GustState) is not None and s.report(GustState).channels < 6
    assert math.isfinite(s.cmd.elevator + s.cmd.flap + s.cmd.throttle)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_finds_sinking_air(estimator: str) -> None:
    s = sink(make(nav__estimator=estimator), 1.5, 5.8)
    g = s.report(GustState)
    assert g is not None and ESTIMATORS[g.estimator] == estimator
    assert math.degrees(g.x[k.AW]) == pytest.approx(math.degrees(1.5 / 20.0), abs=1.2)
    assert math.isnan(g.sigma[k.AW]) == estimator.startswith("printed")


def test_a_saved_state_gives_the_same_bits_again() -> None:
    for name in ESTIMATORS:
        p = GustNavTable(estimator=name)
        one, two = make_gust_nav(p), make_gust_nav(p)
        rng = np.random.default_rng(5)
        y = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
        rows = y + rng.standard_normal((80, 7)) * np.array([0.01, 0.009, 0.35, 0.004, 1.0, 0.2, 0.3])
        u = np.zeros(3)
        for row in rows[:50]:
            one.step(row, p.channels, u, DT)
        two.set_state(copy.deepcopy(one.get_state()))
        for row in rows[50:]:
            a, b = one.step(row, p.channels, u, DT), two.step(row, p.channels, u, DT)
            assert np.array_equal(a.x, b.x)


def test_a_longer_command_path_makes_another_gain() -> None:
    """Gains belong to the delay they were made for: two samples late is another design, not the same one used wrongly."""
    ac, t = published(), Turbulence()
    one, two = (GustLaws(GustCtrlTable(), ac, t, DT, n) for n in (1, 2))
    y = np.array([0.0, 0.0, 20.0, 0.0, 100.0, 20.0, 0.0])
    x = np.zeros(k.NX)
    x[k.AW] = 0.05
    a = one.step(x, y, GustServos(ac, late_steps=1)).copy()
    b = two.step(x, y, GustServos(ac, late_steps=2)).copy()
    assert not np.allclose(a, b)
    cfg = load_flight(PARAMS / "gust.toml", {"link.delay_ticks": 2})
    app = FlightApp("gust", "alexis", cfg.tables, base_rate_hz=50, mission_rate_hz=50, link_delay_ticks=2)
    feed = Feed()
    feed.fly(app, 0.1)
    assert app.mission._late == 2


def test_saturation_is_told(designed: FlightApp) -> None:
    app = copy.deepcopy(designed)
    app.condition.p = ConditionParams(saturated_s=0.1)
    s = sink(app, 9.0, 5.5)
    assert abs(s.cmd.flap) == pytest.approx(math.radians(20.0)) and app.mission.saturated
    assert s.health.flags & HF_SAT


def test_a_wrong_key_or_choice_is_named() -> None:
    with pytest.raises(ConfigError, match=r"estimator.*printed, linear, ekf, ukf, bank"):
        make(nav__estimator="imm")
    with pytest.raises(ConfigError, match=r"law.*hold, alleviation, elevator"):
        make(ctrl__law="none")
    with pytest.raises(ConfigError, match="unknown key"):
        make(nav__scalez=1.0)


def test_warm_up_leaves_the_application_as_it_was(designed: FlightApp) -> None:
    app, other = copy.deepcopy(designed), copy.deepcopy(designed)
    app.warmup()
    a, b = Feed().fly(app, 1.0), Feed().fly(other, 1.0)
    assert a.report(GustState) == b.report(GustState) and a.cmd == b.cmd
