"""The windshear mission in the plant's aircraft without wire or sockets: it finds the wind, warns, gives up and survives;
commands, lost readings and selections."""

from __future__ import annotations

import copy
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import flightsw
from flightsw.aircraft import twinjet
from flightsw.app import FlightApp
from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.guidance import LAWS, PHASES
from flightsw.missions.windshear.mission import (
    BLIND,
    FIRST_PHASE,
    MAV_CMD_DO_GO_AROUND,
    MAV_CMD_USER_3,
    WindshearActuators,
)
from flightsw.missions.windshear.model import approach_trim
from flightsw.missions.windshear.reports import WindshearState
from flightsw.process.config import load_flight
from flightsw.strict import ConfigError
from flightsw.types import HF_AIR, HF_SAT, UPD_AIR, UPD_ATT, UPD_BARO, UPD_GNSS, UPD_IMU, Command, SensorFrame, Snapshot
from sim_plant.aircraft.twinjet.flight import TwinJet, TwinJetAir, TwinJetParams
from sim_plant.wind.microburst import MICROBURSTS

PARAMS = Path(flightsw.__file__).parent / "params"
DT = 0.02
ALL = UPD_IMU | UPD_AIR | UPD_ATT | UPD_BARO | UPD_GNSS
CALM = TwinJetAir(MICROBURSTS["none"], 0.5, 0.4)


def make(**over: object) -> FlightApp:
    cfg = load_flight(PARAMS / "windshear_paper.toml", {key.replace("__", "."): v for key, v in over.items()})
    a = cfg.app
    return FlightApp(
        a.mission, a.aircraft, cfg.tables, base_rate_hz=a.base_rate_hz, mission_rate_hz=a.mission_rate_hz,
        link_delay_ticks=cfg.link.delay_ticks,
    )  # fmt: skip


class Flight:
    """The application in the plant's aircraft, heading `psi` [rad], commands one sample late."""

    def __init__(
        self, app: FlightApp, air: TwinJetAir = CALM, seed: int = 3, psi: float = 0.0, duration_s: float = 110.0
    ) -> None:
        self.app, self.psi = app, psi
        self.jet = TwinJet(TwinJetParams(), air, seed, duration_s, DT)
        self.late = self.jet.controls.copy()
        self.armed = False
        self.rows: list[tuple[np.ndarray, Snapshot]] = []
        self.phases: list[str] = []

    def frame(self, updated: int = ALL) -> SensorFrame:
        h, vg, va, alpha, pitch, q, climb, ax, ah = (float(v) for v in self.jet.reading)
        t = (self.jet.k + 1) * 20_000
        c, s, cp, sp = math.cos(pitch / 2), math.sin(pitch / 2), math.cos(self.psi / 2), math.sin(self.psi / 2)
        n, e, up = math.cos(self.psi), math.sin(self.psi), ah + 9.81
        x = float(self.jet.truth[0])
        return SensorFrame(
            t_us=t, updated=updated, gyro_b=(0.0, q, 0.0),
            acc_b=(ax * math.cos(pitch) + up * math.sin(pitch), 0.0, ax * math.sin(pitch) - up * math.cos(pitch)),
            baro_alt_m=h, gnss_t_us=t, gnss_pos_n=(n * x, e * x, -h), gnss_vel_n=(n * vg, e * vg, -climb), air_t_us=t,
            air_mask=1, air_V=(va,), air_alpha=(alpha,), air_beta=(1e-5 * (self.jet.k % 7),), att_t_us=t,
            att_q_nb=(cp * c, -sp * s, cp * s, sp * c),
        )  # fmt: skip

    def tick(self, f: SensorFrame) -> Snapshot:
        truth = self.jet.truth.copy()
        c, snap = self.app.tick(f, DT)
        self.phases.append(self.app.mission.guidance.phase)
        self.rows.append((truth, snap))
        self.jet.step(self.late)
        if c.armed:
            self.late[:] = c.throttle * 107e3, c.elevator
        return snap

    def fly(self, seconds: float, updated: int = ALL) -> Snapshot:
        for _ in range(round(seconds / DT)):
            snap = self.tick(self.frame(updated))
        return snap

    def fork(self) -> Flight:
        """A flight that goes on from here by itself."""
        twin = copy.copy(self)
        twin.app, twin.jet, twin.late = copy.deepcopy((self.app, self.jet, self.late))
        twin.rows, twin.phases = list(self.rows), list(self.phases)
        return twin

    def order(self, command: int, param1: float = 0.0) -> Snapshot:
        f = self.frame()
        f.commands = [Command(command, (param1, 0, 0, 0, 0, 0, 0), 255, 190)]
        return self.tick(f)


@pytest.mark.parametrize("psi", [0.0, 2.0])
def test_a_calm_approach_stays_on_the_slope_with_an_estimate_of_itself(psi: float) -> None:
    flight = Flight(make(), psi=psi)
    s = flight.fly(12.0)
    w = s.report(WindshearState)
    assert w is not None and w.valid and s.cmd.armed and not w.caution and not w.accused
    assert s.guid.phase == FIRST_PHASE and w.channels == 9 and w.states == 15
    truth = flight.rows[-1][0]
    assert w.x[k.X] == pytest.approx(truth[0], abs=3.0) and w.x[k.H] == pytest.approx(truth[1], abs=1.0)
    assert w.x[k.VA] == pytest.approx(truth[2], abs=0.6) and w.x[k.T] == pytest.approx(truth[6] * 1e-3, abs=1.5)
    assert s.guid.alt_m == pytest.approx(350.0 - (w.x[k.X] + 4500.0) * math.tan(math.radians(3.0)), abs=3.0)
    assert w.x[k.H] == pytest.approx(s.guid.alt_m, abs=3.0)
    assert s.nav.euler[0] == pytest.approx(psi) and s.nav.vel_n[0] == pytest.approx(75.0 * math.cos(psi), abs=1.0)
    assert s.nav.vel_n[1] == pytest.approx(75.0 * math.sin(psi), abs=1.0)
    assert s.cmd.aileron == s.cmd.rudder == s.cmd.flap == 0.0


def test_a_severe_microburst_is_felt_warned_of_and_left() -> None:
    flight = Flight(make(), TwinJetAir(MICROBURSTS["severe"], 1.07, 0.77))
    flight.fly(100.0)
    height = np.array([t[1] for t, _ in flight.rows])
    assert height.min() > 25.0 and height[-1] > 150.0
    seen = list(dict.fromkeys(flight.phases))
    assert seen[0] == "approach" and seen[-1] == "clear" and "escape" in seen
    good = flight.rows[100:]
    e = np.array([[s.report(WindshearState).x[i] - t[i] for i in (k.WX, k.WH)] for t, s in good])
    assert (np.sqrt(np.mean(e * e, axis=0)) < (0.30, 0.22)).all()
    last = good[-1][1].report(WindshearState)
    assert last.abort and last.x[k.KL] == pytest.approx(1.0, abs=0.02) and last.x[k.KD] == pytest.approx(1.0, abs=0.02)
    assert good[-1][1].guid.phase == FIRST_PHASE + PHASES.index("clear")
    words = [t.text for _, s in flight.rows for t in s.texts]
    assert "wind shear: escape" in words and "shear behind, climbing away" in words


def _faulty(f: SensorFrame, kind: str, rng: np.random.Generator) -> SensorFrame:
    if kind == "airspeed +10":
        f.air_V = (f.air_V[0] + 10.0,)
    elif kind == "airspeed garbage":
        f.air_V = (f.air_V[0] + rng.uniform(-20.0, 20.0),)
    elif kind == "vane +6 deg":
        f.air_alpha = (f.air_alpha[0] + math.radians(6.0),)
    elif kind == "height +40":
        f.baro_alt_m += 40.0
    elif kind == "attitude no unit":
        f.att_q_nb = tuple(3.0 * x for x in f.att_q_nb)  # type: ignore[assignment]
    elif kind == "attitude NaN":
        f.att_q_nb = (math.nan,) * 4
    elif kind == "IMU lost":
        f.updated &= ~UPD_IMU
    elif kind == "GNSS and air lost":
        f.updated &= ~(UPD_GNSS | UPD_AIR)
    return f


@cache
def before_the_shear() -> Flight:
    flight = Flight(make(), TwinJetAir(MICROBURSTS["severe"], 1.07, 0.77), seed=1)
    flight.fly(48.0)
    return flight


@pytest.mark.parametrize(
    "kind",
    ["airspeed +10", "airspeed garbage", "vane +6 deg", "height +40", "attitude no unit", "attitude NaN", "IMU lost",
     "GNSS and air lost"],
)  # fmt: skip
def test_one_bad_sensor_from_before_the_shear_on_is_flown_without(kind: str) -> None:
    flight = before_the_shear().fork()
    rng = np.random.default_rng(4)
    for _ in range(round(40.0 / DT)):
        s = flight.tick(_faulty(flight.frame(), kind, rng))
        assert s.nav.valid and all(math.isfinite(v) for v in (*s.nav.euler, *s.nav.vel_n, *s.nav.wind_n, *s.nav.pos_n))
    assert min(t[1] for t, _ in flight.rows) > 25.0 and flight.rows[-1][0][1] > 60.0
    e = np.array([[s.report(WindshearState).x[i] - t[i] for i in (k.WX, k.WH)] for t, s in flight.rows[2400:]])
    assert (np.sqrt(np.mean(e * e, axis=0)) < (0.6, 0.5)).all()
    assert flight.app.mission.nav.restarts == 0
    if "lost" not in kind and "attitude" not in kind:
        assert any(t.text.startswith("estimator: refused") for _, s in flight.rows for t in s.texts)


def test_without_any_reading_the_approach_is_given_up() -> None:
    """Nothing but attitude and pitch rate from 100 m on, with an estimator that cannot start on them: no frozen controls."""
    flight = Flight(make(), CALM)
    flight.fly(10.0)
    flight.app.mission.nav.started = False
    s = flight.fly(4.0, UPD_IMU | UPD_ATT)
    assert not s.nav.valid and s.cmd.throttle > 0.8
    words = [t.text for _, r in flight.rows for t in r.texts]
    assert BLIND in words
    s = flight.fly(6.0, UPD_IMU | UPD_ATT)
    truth = flight.rows[-1][0]
    assert truth[2] > 60.0 and truth[1] > flight.rows[500][0][1] - 20.0 and truth[3] > 0.02  # flies, and climbs
    s = flight.fly(3.0)
    assert s.nav.valid and flight.phases[-1] in ("escape", "clear")


def test_published_sigma_of_the_pitch_is_that_of_the_sum() -> None:
    """Pitch is measured to 0.05 deg; path and incidence, each worse known, are anticorrelated."""
    flight = Flight(make())
    s = flight.fly(8.0)
    assert s.report(WindshearState) is not None
    assert s.nav.att_sigma[1] < math.radians(0.05) < s.report(WindshearState).sigma[k.AL]
    e = [r.nav.euler[1] - (t[3] + t[4]) for t, r in flight.rows[100:]]
    assert 0.4 < float(np.std(e)) / s.nav.att_sigma[1] < 1.6


def test_the_ground_gives_the_approach_up() -> None:
    flight = Flight(make())
    flight.fly(5.0)
    s = flight.order(MAV_CMD_DO_GO_AROUND)
    assert s.acks[0].result == 0 and flight.phases[-1] in ("escape", "clear")
    assert "climbing away" in [t.text for _, r in flight.rows for t in r.texts]
    s = flight.order(MAV_CMD_USER_3, float(LAWS.index("continue")))
    assert s.acks[0].result == 2 and flight.app.mission.guidance.p.escape.law == "managed"
    s = flight.fly(20.0)
    assert s.report(WindshearState) is not None and not s.report(WindshearState).abort  # no hazard said so
    assert flight.phases[-1] == "clear" and s.nav.vel_n[2] < -5.0


def test_the_ground_chooses_the_law_and_a_wrong_number_is_refused() -> None:
    flight = Flight(make())
    flight.fly(1.0)
    for law in (1, 4, 0):
        s = flight.order(MAV_CMD_USER_3, float(law))
        assert s.acks[0].result == 0 and s.report(WindshearState) is not None and s.report(WindshearState).law == law
        if LAWS[law] == "continue":
            assert flight.order(MAV_CMD_DO_GO_AROUND).acks[0].result == 2
    for bad in (5.0, -1.0, 1.2, math.nan):
        assert flight.order(MAV_CMD_USER_3, bad).acks[0].result == 2
    for foreign in (178, 31010, 31011):  # hold (1) to the receiver is the pitch law here, if it were taken
        assert flight.order(foreign, 1.0).acks[0].result == 3
    assert flight.app.mission.guidance.p.escape.law == "managed"
    assert flight.phases[-1] == "approach"


@pytest.mark.parametrize(("law", "mode"), [("pitch", 2), ("climb", 1), ("open", 3), ("managed", 1)])
def test_every_law_demands_what_it_is_called(law: str, mode: int) -> None:
    flight = Flight(make(guid__escape__law=law))
    flight.fly(4.0)
    s = flight.order(MAV_CMD_DO_GO_AROUND)
    assert s.report(WindshearState) is not None and s.report(WindshearState).mode == mode
    s = flight.fly(2.0)
    assert s.cmd.throttle > 0.8
    if law == "pitch":
        assert s.report(WindshearState) is not None and s.report(WindshearState).pitch == pytest.approx(
            math.radians(15.0)
        )


def test_the_quick_alerting_aborts_before_the_pair() -> None:
    at = {}
    for on in ("abort", "caution"):
        flight = Flight(make(guid__hazard__abort_on=on), TwinJetAir(MICROBURSTS["severe"]))
        flight.fly(62.0)
        at[on] = next(i for i, phase in enumerate(flight.phases) if phase == "escape") * DT
    assert 45.0 < at["caution"] < at["abort"] < 60.0


def test_without_airspeed_and_vane_it_waits_and_keeps_its_trim() -> None:
    flight = Flight(make())
    s = flight.fly(0.5, ALL & ~UPD_AIR)
    assert not s.nav.valid and s.guid.phase == 0 and "Va" in s.nav.reason and not s.cmd.armed
    s = flight.fly(3.0)
    assert s.nav.valid and s.cmd.armed
    assert s.report(WindshearState) is not None and s.report(WindshearState).x[k.X] == pytest.approx(
        flight.rows[-1][0][0], abs=4.0
    )


def test_lost_air_data_is_reported_and_the_estimate_goes_on() -> None:
    flight = Flight(make())
    flight.fly(8.0)
    s = flight.fly(1.0, ALL & ~UPD_AIR)
    assert s.nav.valid and s.health.failed & HF_AIR
    assert s.report(WindshearState) is not None and s.report(WindshearState).channels == 7
    assert math.isfinite(s.cmd.elevator + s.cmd.throttle)


def test_a_wrong_model_makes_the_monitor_speak() -> None:
    """13 states believe their aerodynamics: with 25 % wrong lift and drag their wind is not that of the kinematic filter."""
    wrong = {"nav__states": 13, "nav__lift_scale": 1.25, "nav__drag_scale": 1.25, "nav__adaptive": False,
             "nav__gate": 1e6}  # fmt: skip
    flight = Flight(make(**wrong))
    flight.fly(20.0)
    assert any(s.report(WindshearState).accused for _, s in flight.rows)
    assert any(t.text == "wind of estimator and monitor differ" for _, s in flight.rows for t in s.texts)


def test_commands_take_force_a_sample_late() -> None:
    act = WindshearActuators(1)
    act.reset(np.array([0.0, 0.02, 0.0]), 40e3)
    act.step(np.array([0.0, 0.05, 0.0, 50e3]), DT)
    assert act.now.tolist() == [40.0, 0.02]
    act.step(np.array([0.0, 0.06, 0.0, 60e3]), DT)
    assert act.now.tolist() == [50.0, 0.05]
    direct = WindshearActuators(0)
    direct.step(np.array([0.0, 0.05, 0.0, 50e3]), DT)
    assert direct.now.tolist() == [50.0, 0.05]


def test_the_trim_it_begins_with_is_that_of_the_plant() -> None:
    jet = TwinJet(TwinJetParams(), TwinJetAir(), 1, 1.0, DT)
    thrust, elevator = approach_trim(twinjet(), 75.0 / math.cos(math.radians(3.0)), -math.radians(3.0))
    assert (thrust, elevator) == pytest.approx((jet.controls[0] * 1e-3, jet.controls[1]), rel=1e-6)


def test_an_elevator_at_its_limit_is_told() -> None:
    app = make()
    app.mission.ctrl.u[1] = 0.35
    assert app.mission.saturated
    flight = Flight(make())
    s = flight.fly(1.0)
    assert not s.health.failed & HF_SAT


def test_the_same_readings_give_the_same_commands() -> None:
    one, two = (Flight(make()) for _ in range(2))
    one.fly(3.0)
    two.fly(3.0)
    assert [s.cmd.t_us for _, s in one.rows] == [s.cmd.t_us for _, s in two.rows]
    assert np.array_equal(one.late, two.late)
    again = copy.deepcopy(one)
    a, b = one.fly(1.0), again.fly(1.0)
    assert (
        a.report(WindshearState) is not None
        and b.report(WindshearState) is not None
        and a.report(WindshearState).x == b.report(WindshearState).x
    )


def test_a_wrong_selection_is_named() -> None:
    with pytest.raises(ConfigError, match="filter"):
        make(nav__filter="magic")
    with pytest.raises(ConfigError, match="states"):
        make(nav__states=14)
    with pytest.raises(ConfigError, match="law"):
        make(guid__escape__law="pray")
