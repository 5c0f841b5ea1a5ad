"""The application as a whole on frames made by hand: guard, bad data, determinism, snapshot and resume."""

from __future__ import annotations

import copy
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import flightsw
from flightsw.app import FlightApp
from flightsw.kernels.atmosphere import calibrated_airspeed
from flightsw.process.config import load_flight
from flightsw.sixdof.actuators import surface_limits
from flightsw.types import (
    HF_ACT,
    HF_SAT,
    UPD_AIR,
    UPD_ATT,
    UPD_BARO,
    UPD_FUEL,
    UPD_GNSS,
    UPD_IMU,
    UPD_PEER,
    UPD_REL,
    ActuatorCmd,
    Command,
    SensorFrame,
    Snapshot,
)

PARAMS = Path(flightsw.__file__).parent / "params"
DT = 0.01
XI = np.array([-59.13, 56.33, 0.0])


def new_app(who: str) -> FlightApp:
    cfg = load_flight(PARAMS / f"{who}.toml")
    return FlightApp(
        cfg.app.mission,
        cfg.app.aircraft,
        cfg.tables,
        base_rate_hz=cfg.app.base_rate_hz,
        mission_rate_hz=cfg.app.mission_rate_hz,
        link_delay_ticks=cfg.link.delay_ticks,
    )


@pytest.fixture(scope="module")
def designed() -> dict[str, FlightApp]:
    """One application per mission, designed once; tests take deep copies."""
    return {who: new_app(who) for who in ("tanker", "receiver")}


class Feed:
    """Noisy sensors of an aircraft in straight level flight at 195 m/s in 7 m/s of wind, with the tanker alongside."""

    def __init__(self, who: str, seed: int = 1) -> None:
        self.who, self.rng, self.k = who, np.random.default_rng(seed), 0
        self.theta = 0.06 if who == "tanker" else 0.02
        self.probes = 1 if who == "tanker" else 3
        self.wind = np.array([4.0, -6.0, 0.0])
        self.vel = np.array([195.0, 0.0, 0.0]) + self.wind

    def noise(self, sigma: float) -> tuple[float, float, float]:
        a, b, c = (float(v) for v in sigma * self.rng.normal(size=3))
        return a, b, c

    def _add(self, v: np.ndarray, sigma: float) -> tuple[float, float, float]:
        a, b, c = (float(x) for x in v + sigma * self.rng.normal(size=3))
        return a, b, c

    def frame(self) -> SensorFrame:
        """The next tick's frame."""
        t = self.k * DT
        f = SensorFrame(t_us=self.k * 10_000, updated=UPD_IMU)
        self.k += 1
        f.gyro_b = self.noise(1e-3)
        f.acc_b = self._add(np.array([9.80665 * math.sin(self.theta), 0.0, -9.80665 * math.cos(self.theta)]), 0.05)
        pos = np.array([0.0, 0.0, -7010.0]) + self.vel * t
        if (self.k - 1) % 5 == 0:
            f.updated |= UPD_AIR | UPD_ATT | UPD_GNSS | UPD_FUEL
            f.air_t_us = f.att_t_us = f.gnss_t_us = f.fuel_t_us = f.t_us
            f.air_mask = (1 << self.probes) - 1
            f.air_V = tuple(195.0 + 0.2 * self.rng.normal(size=self.probes))
            f.air_alpha = tuple(self.theta + 0.003 * self.rng.normal(size=self.probes))
            f.air_beta = tuple(0.003 * self.rng.normal(size=self.probes))
            h = 0.5 * self.theta + 1e-4 * self.rng.normal()
            f.att_q_nb = (math.cos(h), 1e-4 * self.rng.normal(), math.sin(h), 0.0)
            f.gnss_pos_n, f.gnss_vel_n = self._add(pos, 0.5), self._add(self.vel, 0.1)
            f.fuel_kg = 75000.0 if self.who == "tanker" else 1800.0
            if self.who == "receiver":
                f.updated |= UPD_REL | UPD_PEER
                f.rel_t_us, f.rel_valid = f.t_us, True
                f.rel_pos_t, f.rel_vel_t = self._add(XI, 0.1), self.noise(0.05)
                p = f.peer
                p.t_us, p.w_b, p.q_nb = f.t_us, self.noise(1e-4), (math.cos(0.03), 0.0, math.sin(0.03), 0.0)
                p.vel_n, p.pos_n = self._add(self.vel, 0.02), tuple(pos - XI)
        if self.k == 350:
            f.commands = [Command(31010, (5.0, *[0.0] * 6), 255, 190), Command(178, (0.0, 200.0, *[0.0] * 5), 255, 190)]
        return f


def record(cmd: ActuatorCmd, s: Snapshot) -> tuple:
    """Everything a tick gave, as plain values."""
    return (
        dataclasses.astuple(cmd),
        dataclasses.astuple(s.nav),
        dataclasses.astuple(s.guid),
        [getattr(s.health, f.name) for f in dataclasses.fields(s.health) if f.name != "judged"],
        (s.health.refused, s.health.ratios),  # what `judged` is read for
        [dataclasses.astuple(t) for t in s.texts],
        [dataclasses.astuple(a) for a in s.acks],
    )


def fly(app: FlightApp, frames: list[SensorFrame]) -> list[tuple]:
    return [record(*app.tick(copy.deepcopy(f), DT)) for f in frames]


def feed(who: str, n: int, seed: int = 1) -> list[SensorFrame]:
    source = Feed(who, seed)
    return [source.frame() for _ in range(n)]


# --- determinism -----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_same_frames_same_bits(designed: dict[str, FlightApp], who: str) -> None:
    """Two applications designed separately, fed the same frames, including commands."""
    frames = feed(who, 500)
    a, b = fly(copy.deepcopy(designed[who]), frames), fly(new_app(who), frames)
    assert a == b
    assert a[-1][1][1] is True  # navigation became valid on these frames
    assert a != fly(copy.deepcopy(designed[who]), feed(who, 500, seed=2))


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_a_copy_made_in_flight_goes_on_with_the_same_bits(designed: dict[str, FlightApp], who: str) -> None:
    frames, app = feed(who, 600), copy.deepcopy(designed[who])
    fly(app, frames[:303])  # between two slow steps
    resumed = copy.deepcopy(app)
    assert fly(app, frames[303:]) == fly(resumed, frames[303:])


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_navigation_finds_attitude_airspeed_and_wind(designed: dict[str, FlightApp], who: str) -> None:
    """Inputs by hand with a known answer: 195 m/s, wind (4, -6, 0) m/s."""
    app = copy.deepcopy(designed[who])
    fly(app, feed(who, 500))  # no longer: the feed does not answer the commands, which the model then takes for real
    n = app.nav
    assert n.valid and abs(n.V - 195.0) < 0.5
    assert np.abs(np.subtract(n.wind_n, [4.0, -6.0, 0.0]))[:2].max() < 1.0
    if who == "tanker":
        assert abs(n.euler[1] - 0.06) < 0.01 and abs(n.wind_n[2]) < 1.0
    else:
        assert n.rel_valid and np.abs(np.subtract(n.rel_pos_t, XI)).max() < 0.3


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_between_two_steps_of_the_mission_the_command_is_the_last_ones_but_for_its_time(
    designed: dict[str, FlightApp], who: str
) -> None:
    """And the snapshot says which it is."""
    app, source = copy.deepcopy(designed[who]), Feed(who)
    said, new = (), []
    for k in range(400):
        cmd, snap = app.tick(source.frame(), DT)
        assert cmd.t_us == snap.t_us == 10_000 * k and snap.commanded == (k % 5 == 0)
        now = dataclasses.astuple(dataclasses.replace(cmd, t_us=0))
        if snap.commanded:
            new.append(now)
        else:
            assert now == said
        said = now
    assert len(set(new)) > 20  # the law has flown


# --- guard -----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("where", range(5))
def test_a_non_finite_command_is_replaced_by_the_last_good_one_and_reported(
    designed: dict[str, FlightApp], bad: float, where: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    app, source = copy.deepcopy(designed["tanker"]), Feed("tanker")
    for _ in range(401):
        cmd, _ = app.tick(source.frame(), DT)
    good = (cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle)
    step = app.mission.step

    def broken(*args):  # type: ignore[no-untyped-def]
        nav, g, u, throttle = step(*args)
        u = u.copy()
        if where < 4:
            u[where] = bad
        return nav, g, u, bad if where >= 3 else throttle

    monkeypatch.setattr(app.mission, "step", broken)
    texts = []
    for _ in range(50):
        cmd, snap = app.tick(source.frame(), DT)
        assert (cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle) == good
        texts += [t.text for t in snap.texts]
        assert np.isfinite(app.act.pos).all() and math.isfinite(app.act.thrust)
    assert snap.health.failed & HF_ACT
    assert texts.count("non-finite actuator command replaced") == 1
    monkeypatch.setattr(app.mission, "step", step)
    for _ in range(50):
        cmd, _ = app.tick(source.frame(), DT)
    assert (cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle) != good  # the law flies again
    assert math.isfinite(cmd.aileron + cmd.elevator + cmd.rudder + cmd.throttle)


@pytest.mark.parametrize("who", ["tanker", "receiver"])
def test_one_non_finite_estimate_does_not_poison_the_control_law(
    designed: dict[str, FlightApp], who: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guard bridges one bad step; the law itself must come back when its inputs do."""
    app, source = copy.deepcopy(designed[who]), Feed(who)
    for _ in range(401):
        app.tick(source.frame(), DT)
    step = app.mission.nav.step

    def bad(*args):  # type: ignore[no-untyped-def]
        nav = dataclasses.replace(step(*args))
        nav.w_b, nav.rel_vel_t = (math.nan, 0.0, 0.0), (math.nan, 0.0, 0.0)
        return nav

    monkeypatch.setattr(app.mission.nav, "step", bad)
    for _ in range(5):
        cmd, _ = app.tick(source.frame(), DT)
        assert math.isfinite(cmd.aileron + cmd.elevator + cmd.rudder + cmd.throttle)
    monkeypatch.setattr(app.mission.nav, "step", step)
    seen = set()
    for _ in range(50):
        cmd, _ = app.tick(source.frame(), DT)
        seen.add((cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle))
    assert len(seen) > 1, "commands stay frozen after one bad estimate"
    assert np.isfinite(app.u).all()


FIELDS = {
    "gyro_b": UPD_IMU,
    "acc_b": UPD_IMU,
    "air_V": UPD_AIR,
    "air_alpha": UPD_AIR,
    "att_q_nb": UPD_ATT,
    "gnss_pos_n": UPD_GNSS,
    "gnss_vel_n": UPD_GNSS,
    "rel_pos_t": UPD_REL,
    "rel_vel_t": UPD_REL,
    "fuel_kg": UPD_FUEL,
    "peer.q_nb": UPD_PEER,
    "peer.w_b": UPD_PEER,
    "peer.vel_n": UPD_PEER,
    "peer.acc_n": UPD_PEER,
    "peer.pos_n": UPD_PEER,
}


@pytest.mark.parametrize("field", FIELDS)
def test_rubbish_in_any_field_never_raises_and_never_reaches_the_actuators(
    designed: dict[str, FlightApp], field: str
) -> None:
    app, source = copy.deepcopy(designed["receiver"]), Feed("receiver")
    lim = surface_limits(app.ac)
    for k in range(1500):
        f = source.frame()
        if 400 <= k < 500 and f.updated & FIELDS[field]:
            owner, name = (f.peer, field[5:]) if "." in field else (f, field)
            value = getattr(owner, name)
            setattr(owner, name, math.nan if isinstance(value, float) else tuple(math.nan for _ in value))
        cmd, snap = app.tick(f, DT)
        assert math.isfinite(cmd.aileron + cmd.elevator + cmd.rudder + cmd.throttle)
        surfaces = np.array([cmd.aileron, cmd.elevator, cmd.rudder])
        assert (surfaces >= lim[:, 0]).all() and (surfaces <= lim[:, 1]).all()
        assert 0.0 <= cmd.throttle <= 1.0
    # a second of rubbish, ten of good data: everything is back
    assert snap.nav.valid, snap.nav.reason
    assert np.isfinite(dataclasses.astuple(snap.nav)[3:6]).all()
    assert np.abs(np.subtract(snap.nav.rel_pos_t, XI)).max() < 1.0
    assert snap.health.failed & ~(HF_SAT | HF_ACT) == 0, snap.health.reason


# --- commands and timing ---------------------------------------------------------------------------------
def test_every_command_is_answered_to_its_sender(designed: dict[str, FlightApp]) -> None:
    for who, action, speed in (("receiver", 0, 3), ("tanker", 3, 0)):
        app, acks = copy.deepcopy(designed[who]), []
        for f in feed(who, 360):
            _, snap = app.tick(f, DT)
            acks += snap.acks
        assert [(a.command, a.target_system, a.target_component) for a in acks] == [(31010, 255, 190), (178, 255, 190)]
        assert [a.result for a in acks] == [action, speed], who


def test_calibrated_airspeed_is_by_static_pressure_and_without_it_by_altitude(designed: dict[str, FlightApp]) -> None:
    app, read = copy.deepcopy(designed["tanker"]), Feed("tanker")
    for k in range(900):
        f = read.frame()
        if 300 <= k < 500 and k % 5 == 0:  # pressure altitude 500 m above the true one: a warm day
            f.baro_alt_m, f.updated = 7510.0, f.updated | UPD_BARO
        elif k >= 300:
            f.baro_alt_m = 7510.0
        nav = app.tick(f, DT)[1].nav
        if k in (290, 450, 890):
            high = 7510.0 if k == 450 else -nav.pos_n[2]
            assert nav.valid and nav.V_cal == pytest.approx(calibrated_airspeed(nav.V, high), rel=1e-6)
            assert nav.V_cal == pytest.approx(135.3 if k == 450 else 139.0, abs=1.0)


def test_until_navigation_is_valid_the_trim_is_commanded(designed: dict[str, FlightApp]) -> None:
    for who in ("tanker", "receiver"):
        app = copy.deepcopy(designed[who])
        cmds = []
        for k in range(100):
            cmd, snap = app.tick(SensorFrame(t_us=10_000 * k), DT)
            cmds.append((cmd.aileron, cmd.elevator, cmd.rudder, cmd.throttle))
            assert not snap.nav.valid and snap.nav.reason
        assert len(set(cmds)) == 1
        assert abs(cmds[0][0]) < 1e-6 and 0.2 < cmds[0][3] < 0.9 and not cmd.latch


def test_slow_groups_run_at_their_rate_whatever_ticks_are_missing(designed: dict[str, FlightApp]) -> None:
    app = copy.deepcopy(designed["tanker"])
    stamps = []
    for k, f in enumerate(feed("tanker", 400)):
        if k % 7 == 3:
            continue  # a lost tick
        app.tick(f, DT)
        stamps.append(app.nav.t_us)
    assert max(np.diff(stamps)) <= 60_000
    assert len(set(stamps)) == 80
