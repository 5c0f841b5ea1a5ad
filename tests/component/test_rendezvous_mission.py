"""Onboard side of the rendezvous, part by part: taking replies in, the pilot's commands, the mission's order."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.rendezvous.frame import RendezvousFrame
from flightsw.missions.rendezvous.guidance import OwnState, RendezvousGuidanceParams
from flightsw.missions.rendezvous.mission import RDV_APPROACH, SPEC, RendezvousMission
from flightsw.missions.rendezvous.params import NM, RendezvousNavParams
from flightsw.missions.rendezvous.pilot import PilotParams, RendezvousPilot
from flightsw.missions.rendezvous.track import ReceiverTrack, RendezvousFrameParams, TrackParams
from flightsw.process.application import make_app
from flightsw.process.config import load_flight
from flightsw.types import UPD_RADAR, UPD_TACAN, Command, NavState, SensorFrame
from hil_scripts.launch.places import PARAMS

DT = 0.05
V = 203.7
BIG = PilotParams(guidance=RendezvousGuidanceParams(trim_mps=0.0))


def nav_at(
    frame: RendezvousFrame, x: float, y: float, psi: float, bank: float = 0.0, wind: tuple[float, float] = (0.0, 0.0)
):
    """A tanker in R as navigation would describe it; psi its course through the air, wind in R."""
    n, e = frame.to_n(x, y)
    vn, ve = frame.vector_to_n(V * math.cos(psi) + wind[0], V * math.sin(psi) + wind[1])
    wn, we = frame.vector_to_n(*wind)
    heading = frame.heading(psi)
    return NavState(
        valid=True, V=V, pos_n=(n, e, -7010.0), vel_n=(vn, ve, 0.0), wind_n=(wn, we, 0.0), euler=(heading, 0.03, -bank)
    )  # fmt: skip


def fly_past(
    track: ReceiverTrack,
    seconds: float,
    latency_s: float = 0.0,
    psi: float = 0.2,
    bearing: bool = False,
    y0: float = 900.0,
):
    """A tanker in R from (0, -17 km), a receiver from (50 km, 900 m) at -V; ranges every 5 s, answered latency_s late."""
    ranges: dict[int, tuple[int, float, float]] = {}
    f = SensorFrame()
    for k in range(round(seconds / DT) + 1):
        t = k * DT
        own = (V * math.cos(psi) * t, -17_000.0 + V * math.sin(psi) * t)
        at = (50_000.0 - V * t, 900.0)
        d = (at[0] - own[0], at[1] - own[1])
        if k % 100 == 20:
            los = math.atan2(d[1], d[0])
            drop = math.hypot(*d) ** 2 / (2.0 * 3444.0 * NM)
            ranges[k + round(latency_s / DT)] = (round(t * 1e6), math.hypot(*d, 304.8 + drop), psi - los)
        f.t_us, f.updated = round(t * 1e6), 0
        f.tacan_bearing = None
        if k in ranges:
            f.tacan_t_us, f.tacan_range_m, b = ranges.pop(k)
            f.tacan_bearing = b if bearing else None
            f.updated = UPD_TACAN
        if k == 10:
            f.radar_y_m, f.radar_sigma_m, f.updated = 0.0, 1852.0, f.updated | UPD_RADAR
        track.step(f, nav_at(track.frame, *own, psi), f.updated)
    return at


@pytest.mark.parametrize("heading", [0.0, 90.0, 217.0])
def test_estimate_does_not_depend_on_where_the_track_points(heading: float) -> None:
    p = TrackParams(RendezvousNavParams(components=15), RendezvousFrameParams(5_000.0, -8_000.0, heading))
    track = ReceiverTrack(p)
    at = fly_past(track, 61.0, bearing=True)
    plain = ReceiverTrack(TrackParams(RendezvousNavParams(components=15)))
    fly_past(plain, 61.0, bearing=True)
    assert track.out.valid and track.out.mean == pytest.approx(plain.out.mean, rel=1e-6, abs=1e-3)
    assert track.out.mean[0] == pytest.approx(at[0], abs=300.0) and track.out.mean[2] == pytest.approx(at[1], abs=300.0)
    assert track.out.own == pytest.approx(plain.out.own, rel=1e-9, abs=1e-6)
    assert sum(track.out.weights) == pytest.approx(1.0) and len(track.out.xs) == 15
    P = np.zeros((4, 4))
    P[np.triu_indices(4)] = track.out.cov
    assert np.linalg.eigvalsh(P + P.T - np.diag(np.diag(P)))[0] > -1e-6


def test_late_reply_is_fused_where_the_tanker_was() -> None:
    prompt, late = (ReceiverTrack(TrackParams(RendezvousNavParams(components=15))) for _ in range(2))
    fly_past(prompt, 58.0)
    fly_past(late, 58.0, latency_s=1.5)
    assert late.out.mean == pytest.approx(prompt.out.mean, abs=2.0)
    assert late.out.cov == pytest.approx(prompt.out.cov, rel=0.02)


def test_first_range_waits_for_the_radar_and_no_longer_than_told() -> None:
    track = ReceiverTrack(TrackParams(radar_wait_s=3.0))
    f = SensorFrame(tacan_range_m=50e3)
    said = []
    for k in range(100):
        f.t_us = f.tacan_t_us = k * 50_000
        track.step(f, nav_at(track.frame, V * k * DT, -17e3, 0.0), UPD_TACAN if k % 10 == 5 else 0)
        if track.ready:
            said.append(f.t_us)
    assert said[0] == 3_250_000  # first reply after 3 s
    assert "TACAN: receiver at 27.0 NM" in [t.text for t in track.texts]


def test_receiver_that_turns_away_and_a_silent_set_are_reported() -> None:
    track = ReceiverTrack(TrackParams(RendezvousNavParams(components=15), lost_s=20.0))
    f = SensorFrame(radar_y_m=0.0, radar_sigma_m=1852.0)
    x, y = 50_000.0, 0.0
    texts: list[tuple[float, str, int]] = []
    for k in range(4000):
        t = k * DT
        a = math.radians(max(0.0, min(40.0, 1.5 * (t - 60.0))))
        x, y = x - V * math.cos(a) * DT, y - V * math.sin(a) * DT
        own = (0.0, -17_000.0 + V * t)
        f.t_us = f.tacan_t_us = round(t * 1e6)
        f.tacan_range_m = math.hypot(x - own[0], y - own[1], 304.8)
        bits = (UPD_TACAN if k % 100 == 20 and t < 150.0 else 0) | (UPD_RADAR if k == 3 else 0)
        track.step(f, nav_at(track.frame, *own, math.pi / 2), bits)
        texts += [(t, m.text, m.severity) for m in track.texts]
        track.texts = []
    warned = [q for q in texts if q[1].startswith("receiver not as planned")]
    assert warned and 60.0 < warned[0][0] < 140.0 and warned[0][2] == 4
    assert [q[0] for q in texts if q[1] == "TACAN: no range"] == [pytest.approx(146.0 + 20.0, abs=0.1)]
    assert all(len(q[1]) <= 50 for q in texts)


def meet(response_s: float, lag_s: float, y: float = 0.0) -> tuple[float, float, OwnState]:
    """Misses of a pilot that knows the receiver's state, on an aircraft that follows bank and speed lag_s late."""
    pilot = RendezvousPilot(
        PilotParams(guidance=RendezvousGuidanceParams(trim_mps=0.0, offset_m=9.0 * NM), response_s=response_s)
    )
    own, late = OwnState(0.0, -9.0 * NM, 0.0, 0.0, V), [0.0] * round(lag_s / DT)
    t, x = 0.0, 52_000.0
    banks = []
    while pilot.phase != "done" or abs(own.bank) > 1e-3:
        pilot.step(own, (x - V * t, -V, y, 0.0), math.inf, DT)
        banks.append((pilot.bank, pilot.psi_dot))
        late.append(pilot.bank)
        own.bank = late.pop(0)
        turn = 9.80665 * math.tan(own.bank) / V * DT
        own.x, own.y = own.x + V * DT * math.cos(own.psi + 0.5 * turn), own.y + V * DT * math.sin(own.psi + 0.5 * turn)
        own.psi += turn
        t += DT
        assert t < 400.0
    steps = np.diff([b for b, _ in banks])
    assert np.abs(steps).max() <= math.radians(5.0) * DT + 1e-12
    assert all(math.isclose(r, -9.80665 * math.tan(b) / V, abs_tol=1e-12) for b, r in banks)
    return x - V * t - 2.0 * NM - own.x, y - own.y, own


def test_known_lag_of_the_aircraft_is_flown_out() -> None:
    ideal, known, unknown = meet(0.0, 0.0), meet(1.8, 1.8), meet(0.0, 1.8)
    for x, y, own in (ideal, known):
        assert abs(x) < 120.0 and abs(y) < 60.0 and own.psi == pytest.approx(math.pi, abs=0.03)
    assert math.hypot(unknown[0], unknown[1]) > 2.0 * math.hypot(known[0], known[1])


def test_before_the_first_range_the_wings_stay_level() -> None:
    pilot = RendezvousPilot(BIG)
    own = OwnState(0.0, -17e3, 0.1, 0.0, V)
    for _ in range(50):
        pilot.step(own, None, math.inf, DT)
    assert (
        pilot.bank == 0.0 and pilot.psi_dot == 0.0 and BIG.guidance.speed_mps == pilot.V and pilot.phase == "approach"
    )


def test_mission_composes_from_its_flight_file_and_takes_no_speed_before_roll_out() -> None:
    app = make_app(load_flight(PARAMS / "rendezvous.toml"))
    m = app.mission  # type: ignore[attr-defined]
    assert isinstance(m, RendezvousMission)
    assert m.obey(Command(178, (0.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0), 255, 190))[0] == 1
    assert 31010 not in SPEC.commands
    app.warmup()  # type: ignore[attr-defined]
    m.joined = True
    assert m.obey(Command(178, (0.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0), 255, 190))[0] == 0
    assert m.obey(Command(178, (0.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0), 255, 190))[0] == 2
    assert RDV_APPROACH == 13
