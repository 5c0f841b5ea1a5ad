"""Meetings from anywhere: study kernel against the onboard classes, predictions against turns flown, sides, course, rules."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flightsw.missions.rendezvous import meeting as km
from flightsw.missions.rendezvous import meeting_vectors as kv
from flightsw.missions.rendezvous import range_rules as kr
from flightsw.missions.rendezvous import turn_geometry as kt
from flightsw.missions.rendezvous.announce import announcements
from flightsw.missions.rendezvous.estimator import RangeEstimator
from flightsw.missions.rendezvous.frame import E_SIZE, E_VX, E_X
from flightsw.missions.rendezvous.guidance import (
    OwnState,
    RendezvousCommand,
    RendezvousGuidance,
    guidance_vector,
    meeting_vector,
)
from flightsw.missions.rendezvous.judging import judge_turn
from flightsw.missions.rendezvous.params import RangeRules, RendezvousNavParams
from flightsw.strict import ConfigError
from ground.report.rivard.anywhere import geometry_report
from hil_scripts.campaign.engine import run_campaign
from hil_scripts.campaign.study import Case
from hil_scripts.studies.rivard import geometry_kernel as gk
from hil_scripts.studies.rivard.geometry import SETTINGS, STUDY, pooled, run_batch
from hil_scripts.studies.rivard.geometry_mc import (
    GUIDANCE,
    NAV,
    GeometryCase,
    changed,
    run_geometry,
)
from hil_scripts.studies.rivard.mc import KN, NM
from sim_plant.couplings import traffic_kernel as tr
from tests.unit.rivard_flown import fly

V, G = 396.0 * KN, 9.80665


@pytest.mark.parametrize(
    "name",
    [
        "as_planned", "start_left_5_24", "set_first", "turn_towards_10_bearing", "turn_away_20", "cross_60",
        "turn_towards_10_bearing_own", "turn_away_30_link_own",
    ],
)  # fmt: skip
def test_onboard_classes_fly_the_meeting_of_the_study(name: str) -> None:
    c, i = SETTINGS[name][1], 5
    want = run_geometry(c, i + 1)[i]
    t, said, x, y, left = fly(c, i)
    assert t == pytest.approx(want[gk.R_END], abs=1e-6)
    assert said == want[gk.R_SAID] and (
        math.isinf(left) if math.isnan(want[gk.R_WARNED]) else left == want[gk.R_WARNED]
    )
    assert (x, y) == pytest.approx((want[gk.R_XE], want[gk.R_YE]), abs=1e-3)


def flown(offset_nm: float, far_nm: float, wind_y: float = 0.0, side: float = 1.0) -> dict[str, float]:
    """Everything known, no noise: predicted and reached misses at the roll-out [NM], what was said before the turn."""
    gd = RendezvousGuidance(GUIDANCE)
    q = np.zeros(tr.Q_N)
    q[tr.Q_WY], q[tr.Q_ROLL], q[tr.Q_ACC], q[tr.Q_G] = wind_y, math.radians(5.0), 0.5 * KN, G
    delta = math.asin(wind_y / V)
    tanker = np.array([0.0, -side * offset_nm * NM, -delta, 0.0, V])
    x0, u = math.sqrt(far_nm**2 - offset_nm**2) * NM, -V * math.cos(delta)
    out: dict[str, float] = {"said": 0}
    for k in range(2000):
        t = 0.5 * k
        before = gd.out.phase
        own = OwnState(*(float(v) for v in tanker), 0.0, wind_y)
        c = gd.step(own, (x0 + u * t, u, 0.0, 0.0), 0.0, 0.5 if k else 0.0)
        out["said"] += c.announced
        if before == "approach" and c.phase == "turn":
            out |= {"xp": gd.ms[kv.M_XP] / NM, "yp": gd.ms[kv.M_YP] / NM, "before": out["said"], "limited": c.limited}
        if c.phase in ("done", "leg") and "y" not in out:
            out |= {"x": c.miss_x_m / NM, "y": c.miss_y_m / NM}
        if c.phase == "done":
            return out | {"x_end": c.miss_x_m / NM, "y_end": c.miss_y_m / NM, "end_s": t}
        tr.tanker_step(tanker, c.bank, c.speed, 0.5, q)
    raise AssertionError("not over in 1000 s")


@pytest.mark.parametrize("far", [18.0, 24.0, 30.0, 40.0])
@pytest.mark.parametrize("offset", [0.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.6])
def test_turn_is_announced_where_flown_it_ends_off_the_track(offset: float, far: float) -> None:
    """Feasibility against brute force: the turn itself, flown from every start, without errors."""
    f = flown(offset, far)
    if f["limited"] and abs(f["yp"]) > 0.3:
        assert f["yp"] == pytest.approx(f["y"], abs=0.35)  # the speed flown in the turn moves it
    edge = 0.5 * GUIDANCE.meeting.announce
    if abs(abs(f["y"]) - edge) > 0.35:
        assert bool(int(f["before"]) & kv.SAY_LEG) == (abs(f["y"]) > edge)
    assert not int(f["before"]) & kv.SAY_FAR
    assert abs(f["x_end"]) < 0.5 and abs(f["y_end"]) < 0.3 and not int(f["said"]) & kv.SAY_MISSED


@pytest.mark.parametrize(("speed_sigma", "wind_sigma"), [(0.5, 0.0), (0.5, 1.2), (0.0, 4.0)])
def test_a_speed_is_called_beyond_the_trim_by_two_sigma_of_receiver_and_own_wind(
    speed_sigma: float, wind_sigma: float
) -> None:
    """Airspeed is speed over ground less wind, their errors independent: variances add."""
    meeting = replace(GUIDANCE.meeting, speed_sigma=2.0, wind_sigma_mps=wind_sigma)
    gp, mp, ms = guidance_vector(GUIDANCE), meeting_vector(meeting), np.zeros(kv.M_N)
    P4 = np.zeros((E_SIZE, E_SIZE))
    P4[E_VX, E_VX] = speed_sigma**2
    o = np.array([0.0, -10.0 * NM, 0.0, 0.0, V, 7.0, 0.0, 0.0])  # 7 m/s of wind from behind

    def said(beyond: float) -> bool:
        r = np.zeros(E_SIZE)
        r[E_X], r[E_VX] = 25.0 * NM, -(V + GUIDANCE.trim_mps + beyond) + 7.0
        return bool(
            judge_turn(ms, 0.0, o, r, P4, True, gp, mp, np.zeros(kt.T_N), np.zeros(8), np.zeros(4)) & kv.SAY_SPEED
        )

    edge = 2.0 * math.sqrt(speed_sigma**2 + wind_sigma**2)
    assert said(edge + 1e-6) and not said(edge - 1e-6)


def test_what_no_leg_reaches_is_announced_as_such() -> None:
    f = flown(9.6, 13.0)
    assert int(f["before"]) & kv.SAY_FAR and int(f["said"]) & kv.SAY_MISSED and f["x"] < -2.0


@pytest.mark.parametrize("offset", [3.0, 9.6])
def test_from_the_left_it_is_the_mirror_image(offset: float) -> None:
    right, left = flown(offset, 30.0), flown(offset, 30.0, side=-1.0)
    for key in ("x", "y", "x_end", "y_end", "end_s"):
        assert left[key] == pytest.approx(right[key], abs=1e-6)
    with_wind = flown(offset, 30.0, wind_y=20.0), flown(offset, 30.0, wind_y=-20.0, side=-1.0)
    assert with_wind[1]["y"] == pytest.approx(with_wind[0]["y"], abs=1e-6)


@pytest.mark.parametrize("knots", [-60.0, 0.0, 30.0, 60.0])
def test_offset_in_wind_is_that_of_the_triangle_of_velocities(knots: float) -> None:
    """From (55) a half turn at that bank, integrated in the wind, ends on the track with the drift correction on."""
    w, phi = knots * KN, math.radians(24.56)
    delta = math.asin(w / V)
    y, psi, dt = -kt.offset_for_bank(phi, V, delta, w, G), -delta, 1e-3
    rate = G * math.tan(phi) / V
    while psi < math.pi + delta:
        y += (V * math.sin(psi + 0.5 * rate * dt) + w) * dt
        psi += rate * dt
    assert y == pytest.approx(0.0, abs=2.0)
    assert V * math.sin(math.pi + delta) + w == pytest.approx(0.0, abs=1e-9)  # and it stays on it


def test_axes_of_its_own_course_bring_the_receiver_down_the_x_axis() -> None:
    o, r = np.array([1e4, -9e3, 0.3, 0.1, 204.0, 5.0, -12.0, 0.0]), np.array([3e4, -190.0, 2e3, 60.0])
    for side in (1.0, -1.0):
        o2, r2 = np.zeros(8), np.zeros(4)
        chi = math.atan2(-r[3], -r[1])
        km.own_course(o, r, side, chi, 204.0, o2, r2)
        assert r2[1] == pytest.approx(-math.hypot(190.0, 60.0)) and r2[3] == pytest.approx(0.0, abs=1e-9)
        assert math.hypot(r2[0] - o2[0], r2[2] - o2[1]) == pytest.approx(math.hypot(2e4, 1.1e4))
        assert math.hypot(o2[5], o2[6]) == pytest.approx(13.0)
        assert 204.0 * math.sin(math.pi + o2[7]) + o2[6] == pytest.approx(0.0, abs=1e-9)


def test_a_leg_over_a_lateral_miss_costs_its_tangent_of_the_half_angle() -> None:
    """Flown at angle a over y at the receiver's speed: |y|/sin(a) of path for |y|/tan(a) along the track."""
    y, a = 3000.0, math.radians(26.0)
    t = np.zeros(kt.T_N)
    t[kt.T_YM], t[kt.T_LIMITED] = -y, 1.0
    o, r = np.array([0.0, 0.0, 0.0, 0.0, 200.0, 0.0, 0.0, 0.0]), np.array([4e4, -200.0, 0.0, 0.0])
    lead = kt.join_lead(o, r, t, math.tan(0.5 * a), 463.0)
    assert lead * 400.0 == pytest.approx(y / math.sin(a) - y / math.tan(a))
    t[kt.T_YM] = -400.0
    assert kt.join_lead(o, r, t, math.tan(0.5 * a), 463.0) == 0.0


def straight(
    bad: dict[int, float], stuck_from: int = 99, n: int = 12, nav: RendezvousNavParams = NAV
) -> RangeEstimator:
    """Ranges of a receiver exactly on plan, some of them off by metres, or repeated from one on."""
    est, own, z = RangeEstimator(nav), (0.0, -9.6 * NM), 0.0
    est.verdicts = []  # type: ignore[attr-defined]
    for k in range(n):
        x, tx = 50_000.0 - V * 10.0 * k, V * 10.0 * k
        if k < stuck_from:
            z = math.hypot(x - tx, own[1], 304.8 + ((x - tx) ** 2 + own[1] ** 2) / (2.0 * 3444.0 * NM)) + bad.get(
                k, 0.0
            )
        if k == 0:
            est.start(z, tx, own[1], 0.0, NM)
            continue
        est.predict(10.0)
        est.update(z, tx, own[1])
        est.verdicts.append(est.out.verdict)  # type: ignore[attr-defined]
    est.error = math.hypot(est.mean[0] - x, est.mean[2])  # type: ignore[attr-defined]
    return est


@pytest.mark.parametrize(("bad", "verdicts"), [
    ({}, {}),
    ({5: 5000.0}, {5: kr.REFUSED}),
    ({0: 5000.0}, {1: kr.REFUSED, 2: kr.RESTARTED}),
    ({1: -3000.0}, {1: kr.REFUSED}),
    ({2: 5000.0, 3: -5000.0}, {2: kr.REFUSED, 3: kr.REFUSED}),
])  # fmt: skip
def test_wild_ranges_are_refused_and_a_bad_first_one_starts_it_again(bad: dict, verdicts: dict) -> None:
    est = straight(bad)
    assert est.verdicts == [verdicts.get(k, kr.USED) for k in range(1, 12)]  # type: ignore[attr-defined]
    assert est.error < 500.0 and not est.out.alarm  # type: ignore[attr-defined]


def test_ranges_that_agree_against_an_old_estimate_open_it() -> None:
    est = straight(dict.fromkeys(range(7, 20), 3000.0))
    assert est.verdicts[6:8] == [kr.REFUSED, kr.OPENED]  # type: ignore[attr-defined]
    assert est.out.left_plan and est.out.alarm


def test_a_set_that_stands_still_is_not_believed() -> None:
    est = straight({}, stuck_from=6)
    assert est.verdicts[5:] == [kr.STUCK] * 6 and est.out.refused == 6  # type: ignore[attr-defined]
    assert est.error < 500.0 and not est.out.left_plan  # type: ignore[attr-defined]


def test_rules_are_refused_of_a_filter_that_has_none() -> None:
    with pytest.raises(ConfigError, match="ekf3"):
        replace(NAV, estimator="ekf3")
    RendezvousNavParams(estimator="ekf3", rules=RangeRules())


def test_announcements_are_short_texts() -> None:
    c = RendezvousCommand(announced=15, miss_x_m=-12.0 * NM, miss_y_m=-10.0 * NM)
    texts = announcements(c)
    assert [t.severity for t in texts] == [4, 4, 4] and all(len(t.text) <= 50 for t in texts)
    assert announcements(RendezvousCommand()) == []
    assert announcements(replace_said(kv.SAY_LEG))[0].text.endswith("leg")


def replace_said(said: int) -> RendezvousCommand:
    return RendezvousCommand(announced=said, miss_x_m=100.0, miss_y_m=-3000.0)


def test_campaign_pools_its_batches() -> None:
    small = [run_batch(Case("x", {"setting": "start_right_5_30", "batch": 40}), s).values for s in (1, 2)]
    out = pooled(small)
    assert out["meetings"] == 80 and out["unfinished.mean"] == 0.0
    assert 0.0 <= out["end.outside.mean"] <= 0.15 < out["rollout.outside.mean"]  # type: ignore[operator]
    assert out["told.outside.mean"] <= 1.0  # type: ignore[operator]
    assert {c.params["setting"] for c in STUDY.cases} == set(SETTINGS)
    with pytest.raises(ValueError, match="allowed"):
        run_batch(Case("x", {"setting": "nowhere", "batch": 4}), 1)


def test_a_receiver_that_turns_is_met_where_it_is_heard() -> None:
    """With bearings, after a turn of 10 deg away: within the box, in axes of the course it really flies."""
    rows = run_geometry(SETTINGS["turn_away_10_bearing"][1], 64)
    assert np.isfinite(rows[:, gk.R_WARNED]).all()
    assert np.sqrt(np.mean(rows[:, gk.R_XR] ** 2)) < 0.35 * NM and np.sqrt(np.mean(rows[:, gk.R_YR] ** 2)) < 0.08 * NM


def test_known_state_with_a_turning_receiver_is_met_too() -> None:
    """The velocity of the manoeuvre is part of what is known."""
    c = changed(GeometryCase(known_s=0.0), truth_turn_at_s=20.0, truth_turn_deg=-10.0)
    rows = run_geometry(c, 32)
    assert np.abs(rows[:, gk.R_YR]).max() < 0.1 * NM and np.abs(rows[:, gk.R_XR]).max() < 0.3 * NM


def test_report_has_every_kind_of_case(tmp_path: Path) -> None:
    small = replace(
        STUDY,
        cases=tuple(
            Case(c.name, c.params | {"batch": 8})
            for c in STUDY.cases
            if c.name in ("as_planned", "cross_60", "start_left_5_24", "close_15", "set_first")
        ),
    )
    run_campaign(small, 1, 1, tmp_path / "c", workers=0, progress=False)
    page = geometry_report([tmp_path / "c"], tmp_path).read_text()
    for words in (
        "As planned",
        "Crosswind",
        "Starts off the plan",
        "geometry forbids",
        "Faults of the set",
        "cross_60",
    ):
        assert words in page
