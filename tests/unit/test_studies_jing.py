"""The wind-shear studies in short form: their figures on known inputs, and the verdicts they exist for, on few runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.estimator import WindshearParams
from hil_scripts.campaign.registry import all_studies
from hil_scripts.campaign.study import Case
from hil_scripts.studies.jing import draw as jing_draw
from hil_scripts.studies.jing import escape as jing_escape
from hil_scripts.studies.jing import flight as jf
from hil_scripts.studies.jing import study as jing
from sim_plant.aircraft.twinjet.flight import TwinJetAir, TwinJetParams
from sim_plant.wind.microburst import MICROBURSTS


def made(n: int) -> jf.Flight:
    z = np.zeros(n)
    wide = [np.zeros((n, 15)), np.zeros((n, 15)), np.ones((n, 15))]
    return jf.Flight(
        *wide, z + 1.0, z.copy(), z + 0.01, z, z, np.zeros(n, dtype=np.int64), np.zeros((n, 2)), wide[0], wide[0]
    )


def test_studies_are_known_to_the_campaign_command() -> None:
    known = all_studies()
    for name in ("jing", "jing_model_error", "jing_escape", "jing_survival", "jing_alerts"):
        assert name in known


def test_errors_of_a_made_flight() -> None:
    r = made(400)
    r.x[:, k.WX], r.x[:, k.WH] = 0.3, np.where(np.arange(400) < 100, 3.0, 0.0)
    e = jf.wind_errors(r)
    assert e["w_x.rms_mps"] == pytest.approx(0.3)
    assert e["w_h.rms_mps"] == pytest.approx(1.5)
    assert e["w_h.inside_2sigma"] == pytest.approx(0.75)
    assert e["F.rms"] == pytest.approx(0.01)
    assert jf.wind_errors(r, 2.0)["w_h.rms_mps"] == 0.0


def test_height_apart_is_taken_at_the_same_range() -> None:
    a, b = made(1000), made(1000)
    a.truth[:, k.X], b.truth[:, k.X] = np.linspace(0.0, 1000.0, 1000), np.linspace(0.0, 2000.0, 1000)
    a.truth[:, k.H], b.truth[:, k.H] = 100.0 + 0.1 * a.truth[:, k.X] + 2.0, 100.0 + 0.1 * b.truth[:, k.X]
    assert jf.height_apart(a, b) == pytest.approx((2.0, 2.0))


def test_draws_stay_in_their_bounds_and_repeat() -> None:
    for seed in range(50):
        b, p = jing_draw.draw(seed)
        assert jing_draw.draw(seed) == (b, p)
        assert 500.0 <= b.radius_m <= 1500.0 and 16.0 <= b.outflow_mps <= 36.0 and 0.0 <= b.offset_m <= 300.0
        core = p.height_m + p.x_m * math.tan(math.radians(3.0))
        assert 30.0 <= core <= 220.0
    assert [jing_draw.class_of(f) for f in (-0.1, 0.1, 0.3, 0.449, 0.45, 2.0)] == [
        "low", "low", "middle", "middle", "high", "high",
    ]  # fmt: skip


def test_branches_equal_flights_of_their_own() -> None:
    """A law flown from the trunk gives the bytes of the same law flown from the start."""
    sky = TwinJetAir(MICROBURSTS["seed"], 0.5, 0.5)
    start = TwinJetParams(x_m=-2000.0, height_m=200.0)

    def plan(name: str) -> jf.FlightPlan:
        return jf.FlightPlan(sky, start, WindshearParams(), jing.law(name), duration_s=45.0)

    trunk = jf.Loop(plan("managed"), 3)
    trunk.run(to_abort=True)
    assert 0 < trunk.i < 45 / jf.DT
    for name in ("pitch_15", "managed"):
        a, b = trunk.branch(jing.law(name)).run(), jf.fly(plan(name), 3)
        assert b.abort_index > trunk.i
        assert a.truth.tobytes() == b.truth.tobytes() and a.u.tobytes() == b.u.tobytes()


def test_escape_table_with_perfect_state() -> None:
    """Least heights of jing.md 6.3 (an independent program) within a few metres, and who hits the ground."""
    want = {
        ("seed", 300.0): {"open_loop": None, "climb_5": 69.0, "pitch_15": 53.0, "managed_45": 49.0},
        ("severe", 350.0): {"climb_5": None, "pitch_15": None, "managed_45": 53.0},
    }
    for (burst, h), laws in want.items():
        for name, least in laws.items():
            r = jing.perfect(burst, h, name)
            assert r.lost is (least is None), (burst, h, name)
            if least is not None:
                assert r.truth[:, k.H].min() == pytest.approx(least, abs=4.0), (burst, h, name)


def test_survival_run_reports_every_law_and_one_class() -> None:
    case = jing_escape.SURVIVAL.cases[1]
    v = jing_escape.run_survival(Case(case.name, case.params | {"laws": ["managed", "pitch_15"]}), 12).values
    assert sum(v[f"class.{c}"] for c in ("low", "middle", "high")) == 1.0
    assert v["managed.survived"] in (0.0, 1.0)
    assert v["managed_less_pitch_15"] == v["managed.survived"] - v["pitch_15.survived"]
    assert sum(key.startswith("managed.") and key.endswith(".survived") for key in v) == 2


def test_encounter_with_the_filter_meets_its_figures() -> None:
    case = next(c for c in jing.MODEL_ERROR.cases if c.name == "ekf15")
    v = jing.run_encounter(case, 1).values
    assert v["w_x.rms_mps"] < 0.15 and v["w_h.rms_mps"] < 0.07 and v["F.rms"] < 0.014
    assert v["height_apart.rms_m"] < 7.0 and v["lost"] == 0.0
    assert v["lift_scale"] == pytest.approx(1.0, abs=0.01)
