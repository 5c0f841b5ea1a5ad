"""Rough air: what is learnt of it from made-up gusts, when it is too rough, what the law for it asks for, who has the command."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flightsw.aircraft import load_aircraft
from flightsw.icd.codec_flight import FlightCodec
from flightsw.kernels.rotations import quat_from_euler
from flightsw.missions.receiver.integrity.params import IntegrityParams
from flightsw.missions.receiver.mission import ReceiverMission, ReceiverParams
from flightsw.missions.tanker.mission import TankerAirParams, TankerMission, TankerParams
from flightsw.sixdof.actuators import ActuatorModel
from flightsw.sixdof.recovery.given import Felt, Rejoin
from flightsw.sixdof.recovery.given import RecoveryParams as Recovery
from flightsw.sixdof.recovery.law import RecoveryLaw
from flightsw.sixdof.recovery.protection import HOLDING, Protection
from flightsw.sixdof.recovery.readings import Readings
from flightsw.sixdof.recovery.rough import RoughAirLaw
from flightsw.sixdof.recovery.turbulence import RoughAirParams, Turbulence
from flightsw.strict import ConfigError
from flightsw.types import HF_ROUGH, UPD_AIR, UPD_ATT, UPD_BARO, UPD_IMU, Health, NavState, SensorFrame, Vec3
from sim_plant.wind.dryden import DrydenSeries

FELT = Felt(np.zeros(4), None)
AC = load_aircraft("learjet24")
DT, V, H, L = 0.05, 195.0, 7010.0, 533.4
NEW = UPD_IMU | UPD_BARO | UPD_AIR | UPD_ATT
GOOD, LOST = Health(), NavState()
P = RoughAirParams()
NOISE = (0.27, 0.0014, 0.0014)  # [m/s], [rad] of what a probe reads: P.noise_mps of a difference


def frame(gust: Vec3 = (0.0, 0.0, 0.0), pitch: float = 0.03, *, bank: float = 0.0, load: float = 1.0) -> SensorFrame:
    """What is read on a straight path, pitch and bank [rad], in a gust [m/s, NED] that does not move the aircraft."""
    q = np.zeros(4)
    quat_from_euler(0.0, pitch, bank, q)
    f = SensorFrame(updated=NEW, gyro_count=5, baro_alt_m=H)
    f.att_q_nb = (float(q[0]), float(q[1]), float(q[2]), float(q[3]))
    f.acc_mean_b = (9.80665 * math.sin(pitch), 0.0, -9.80665 * math.cos(pitch) * load)
    n, e, d = V - gust[0], -gust[1], -gust[2]
    x, z = n * math.cos(pitch) - d * math.sin(pitch), n * math.sin(pitch) + d * math.cos(pitch)
    speed = math.hypot(x, e, z)
    f.air_mask, f.air_V = 7, (speed,) * 3
    f.air_alpha, f.air_beta = (math.atan2(z, x),) * 3, (math.asin(e / speed),) * 3
    return f


def noisy(f: SensorFrame, rng: np.random.Generator) -> SensorFrame:
    """The same with white noise, alike on all probes."""
    a, b, c = rng.standard_normal(3) * NOISE
    f.air_V, f.air_alpha, f.air_beta = (f.air_V[0] + a,) * 3, (f.air_alpha[0] + b,) * 3, (f.air_beta[0] + c,) * 3
    return f


def gusts(sigma: float, seed: int, t_s: float) -> np.ndarray:
    """Dryden gusts [n,3] at every step."""
    series, rows = DrydenSeries(seed, "gusts", V, L, sigma, DT), []
    while sum(map(len, rows)) < t_s / DT:
        rows.append(series.advance().copy())
    return np.concatenate(rows)[: round(t_s / DT)]


def learnt(sigma: float, seed: int = 1, t_s: float = 60.0, p: RoughAirParams = P) -> tuple[np.ndarray, Turbulence]:
    """Intensity [n] at every step of a flight through gusts of this 1 sigma, and what learnt it."""
    s, air, rng = Readings(AC, H), Turbulence(p), np.random.default_rng(seed)
    out = []
    for g in gusts(sigma, seed, t_s):
        s.step(noisy(frame((g[0], g[1], g[2])), rng), NEW, GOOD, DT)
        air.step(s, True, DT)
        out.append(air.sigma)
    return np.array(out), air


# --- what is learnt ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sigma", [0.94, 2.1, 6.22])
def test_the_intensity_of_made_up_gusts_is_found(sigma: float) -> None:
    for seed in (1, 2, 3):
        got = learnt(sigma, seed)[0][round(P.window_s / DT) :]
        assert got.mean() == pytest.approx(sigma, rel=0.12) and got.std() < 0.2 * sigma


def test_calm_air_a_mean_wind_and_its_noise_are_no_turbulence() -> None:
    assert learnt(0.0)[0].max() < 0.5


def test_severe_air_is_told_within_seconds_and_moderate_air_never() -> None:
    for seed in range(5):
        severe, air = learnt(6.22, seed, 5.0)
        assert air.rough and np.argmax(severe > P.bear_mps) * DT < 3.0
        assert not learnt(2.1, seed, 120.0)[1].rough


def test_a_vane_that_lies_does_not_make_the_air_rough() -> None:
    s, air, rng = Readings(AC, H), Turbulence(P), np.random.default_rng(1)
    for _ in range(400):
        f = frame()
        f.air_alpha = (f.air_alpha[0] + 0.03 * rng.standard_normal(),) * 3
        s.step(f, NEW, GOOD, DT)
        air.step(s, True, DT)
    assert air.sigma < 0.5 and not air.rough


def test_it_is_calm_again_after_a_while_below_a_part_of_the_limit() -> None:
    s, p = Readings(AC, H), replace(P, calm_s=5.0)
    air, told = Turbulence(p), []
    for sigma, t_s in ((6.22, 20.0), (0.9 * p.bear_mps, 20.0), (0.5, 20.0)):
        for g in gusts(sigma, 7, t_s):
            s.step(frame((g[0], g[1], g[2])), NEW, GOOD, DT)
            air.step(s, True, DT)
            told += [t.text for t in air.tell()]
        if sigma > p.ease_frac * p.bear_mps:
            assert air.rough  # too rough for contact, and then not calm enough
    assert not air.rough
    assert [t.split()[0] for t in told] == ["turbulence"] * 2 and told[0].endswith("allowed 3.5") and "calm" in told[1]


def test_nothing_is_learnt_while_it_tumbles_or_without_airspeed() -> None:
    s, air = Readings(AC, H), Turbulence(P)
    for g in gusts(6.22, 1, 10.0):
        s.step(frame((g[0], g[1], g[2])), NEW, GOOD, DT)
        air.step(s, False, DT)
    assert air.sigma == 0.0


# --- the law -----------------------------------------------------------------------------------------------------------


def command(f: SensorFrame, climb: float | None = 0.0, path: float = 0.0, steps: int = 1) -> tuple[np.ndarray, float]:
    s, law = Readings(AC, H), RoughAirLaw(AC, P, RecoveryLaw(AC).terms)
    s.step(f, NEW, GOOD, DT)
    law.begin(s, 0.0)
    for _ in range(steps):
        s.step(f, NEW, GOOD, DT)
        out = law.step(s, climb, path, DT)
    return out


def test_a_gust_moves_no_elevator_and_no_throttle() -> None:
    calm, up = command(frame(), steps=2), command(frame((0.0, 0.0, -15.0), load=2.5), steps=2)
    assert abs(up[0][1] - calm[0][1]) < math.radians(0.1)
    s, law = Readings(AC, H), RoughAirLaw(AC, P, RecoveryLaw(AC).terms)
    s.step(frame(), NEW, GOOD, DT)
    law.begin(s, 0.0)
    before = law.step(s, 0.0, 0.0, DT)[0]
    s.step(frame((-10.0, 0.0, 0.0)), NEW, GOOD, DT)
    after = law.step(s, 0.0, 0.0, DT)[0]
    assert abs(after[3] - before[3]) < 0.02 * 12000.0 and abs(after[1] - before[1]) < math.radians(0.1)


def test_it_holds_attitude_and_comes_to_its_path_slowly() -> None:
    level = command(frame())[0]
    assert command(frame(pitch=0.1))[0][1] > level[1] > command(frame(pitch=-0.05))[0][1]  # + is nose down
    assert command(frame(bank=0.3))[0][0] < 0.0 < command(frame(bank=-0.3))[0][0]
    assert command(frame(), climb=10.0, steps=40)[0][1] > command(frame(), climb=-10.0, steps=40)[0][1]
    now, later = command(frame(), path=-0.05)[0], command(frame(), path=-0.05, steps=40)[0]
    assert abs(now[1] - level[1]) < math.radians(0.1) < later[1] - level[1]


def test_it_slows_to_its_airspeed() -> None:
    fast, slow = command(frame(), steps=200), command(frame((20.0, 0.0, 0.0)), steps=200)
    assert fast[1] < slow[1] and fast[0][3] < slow[0][3]


# --- who has the command -----------------------------------------------------------------------------------------------


def test_the_command_is_taken_in_rough_air_and_given_back_in_calm() -> None:
    g = Protection(AC, H, DT, replace(P, calm_s=2.0))
    rejoin, taken, held = Rejoin(V=V), -1.0, -1.0
    for i, w in enumerate([*gusts(6.22, 3, 10.0), *np.zeros((800, 3))]):
        g.step(frame((w[0], w[1], w[2])), LOST, NEW, GOOD, rejoin, FELT, DT)
        taken = i * DT if g.began else taken
        held = i * DT if g._phase == HOLDING and held < 0.0 else held
    assert 1.0 < taken < 4.0 and g.active and held > 10.0 + 2.0
    assert any("turbulence" in t.text for t in g.texts)


def test_air_is_never_too_rough_for_a_protection_that_is_not_told() -> None:
    g = Protection(AC, H, DT)
    for w in gusts(6.22, 3, 10.0):
        g.step(frame((w[0], w[1], w[2])), LOST, NEW, GOOD, Rejoin(), FELT, DT)
    assert not g.active and not g.texts


def test_outside_the_envelope_recovery_has_it_whatever_the_air() -> None:
    g = Protection(AC, H, DT, P)
    for w in gusts(6.22, 3, 5.0):
        g.step(frame((w[0], w[1], w[2])), LOST, NEW, GOOD, Rejoin(), FELT, DT)
    assert g.riding
    g.readings = Readings(AC, H)  # the reference is believed at once
    g.step(frame(bank=1.6), LOST, NEW, GOOD, Rejoin(), FELT, DT)
    assert g.active and not g.riding and "bank" in g.why


# --- its keys ----------------------------------------------------------------------------------------------------------


def mission(air: RoughAirParams, bounds: bool = False, recovery: bool = True) -> ReceiverMission:
    p = replace(ReceiverParams(), rough_air=air, integrity=IntegrityParams(on=bounds), recovery=Recovery(recovery))
    return ReceiverMission(AC, p, DT)


@pytest.mark.parametrize(
    ("air", "recovery", "named"),
    [
        (RoughAirParams(bear_mps=2.0), True, "rough_air.bear_mps = 2.0"),
        (RoughAirParams(on=True), False, "rough_air.on = True"),
        (RoughAirParams(on=True, V_mps=120.0), True, "rough_air.V_mps = 120"),
    ],
)
def test_what_nothing_would_obey_is_refused_by_name(air: RoughAirParams, recovery: bool, named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        mission(air, recovery=recovery)


def test_with_bounds_and_no_recovery_nothing_of_it_may_be_set() -> None:
    with pytest.raises(ConfigError, match=r"rough_air\.bear_mps = 2\.0: nothing obeys it without recovery\.on"):
        mission(RoughAirParams(bear_mps=2.0), bounds=True, recovery=False)
    assert mission(RoughAirParams(), bounds=True, recovery=False).guard is None


def test_it_is_on_with_bounds_and_off_without() -> None:
    def on(m: ReceiverMission) -> bool:
        return m.guard is not None and m.guard.air is not None

    assert on(mission(RoughAirParams(), bounds=True)) and not on(mission(RoughAirParams()))
    assert on(mission(RoughAirParams(on=True))) and not on(mission(RoughAirParams(on=False), bounds=True))


# --- the tanker --------------------------------------------------------------------------------------------------------


def tanker(air: TankerAirParams, recovery: bool = True) -> TankerMission:
    return TankerMission(
        load_aircraft("kc135r"), replace(TankerParams(), rough_air=air, recovery=Recovery(recovery)), DT
    )


def through(m: TankerMission, sigma: float, t_s: float) -> list[str]:
    """What the tanker says of the air in gusts of this 1 sigma."""
    rng, act, said = np.random.default_rng(3), ActuatorModel(load_aircraft("kc135r"), 1), []
    for w in gusts(sigma, 3, t_s):
        m.step(noisy(frame((w[0], w[1], w[2])), rng), act, NEW, GOOD, DT)
        said += [t.text for t in m.texts() if "turbulence" in t.text]
    return said


def test_a_tanker_tells_of_rough_air_and_flies_on() -> None:
    m = tanker(TankerAirParams())
    assert through(m, 6.22, 8.0) and m.faults == HF_ROUGH and not m.recovering
    assert through(tanker(TankerAirParams()), 2.1, 20.0) == []
    off = tanker(TankerAirParams(on=False))
    assert through(off, 6.22, 8.0) == [] and off.faults == 0


def test_a_tanker_refuses_what_nothing_would_obey() -> None:
    with pytest.raises(ConfigError, match=r"rough_air\.bear_mps = 2\.0: nothing obeys it without recovery\.on"):
        tanker(TankerAirParams(bear_mps=2.0), recovery=False)
    assert tanker(TankerAirParams(), recovery=False).air is None


@pytest.mark.parametrize("bounds", [True, False])
def test_a_receiver_leaves_a_tanker_in_rough_air(bounds: bool) -> None:
    """The flag goes over the link as the tanker sends it; the receiver goes by it where it leaves for rough air itself."""
    codec = FlightCodec(load_aircraft("kc135r"), 1)
    for flags in (0, HF_ROUGH):
        got = SensorFrame()
        FlightCodec(AC, 2, peer_sysid=1).decode(codec.peer(NavState(t_us=40_000, valid=True), flags), got)
        assert got.peer.flags == flags
        m, nav = mission(RoughAirParams(on=True), bounds=bounds), NavState(valid=True)
        m.nav.peer.take(got.peer)
        m._guarded(frame(), nav, NEW, GOOD, np.zeros(4), DT)
        assert nav.rel_doubt == ("the tanker's air is too rough" if flags else "")
    deaf = mission(RoughAirParams(on=False), bounds=bounds)
    deaf.nav.peer.take(got.peer)
    deaf._guarded(frame(), nav := NavState(valid=True), NEW, GOOD, np.zeros(4), DT)
    assert nav.rel_doubt == ""
