"""The air-data studies: the onboard side of the flights, closed forms and theory, and a small run of each kind."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.stats import chi2, ncx2

from hil_scripts.campaign.registry import all_studies
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.sevil import dynamic as sevil_dynamic
from hil_scripts.studies.sevil import faults as sevil_faults
from hil_scripts.studies.sevil import fdi as sevil_fdi
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil import static as sevil_static
from hil_scripts.studies.sevil import study as sevil
from hil_scripts.studies.sevil import track as sevil_track
from hil_scripts.studies.sevil.flight import Conditions, fly_air

ALL_CASES = {c.name: c for c in sevil.TABLE.cases}


def test_onboard_expectation_is_what_the_plant_shows_in_still_air() -> None:
    """Two codes of one wake: they agree along a flight, with rates, motion and attitude."""
    f = fly_air(Conditions(legs_s=(2.0, 3.0, 3.0, 3.0, 2.0), turbulence_mps=0.0, wind_mps=(0.0, 0.0, 0.0)), 3)
    e = m.expected(f.xi, f.att, f.xi_dot, f.omega)
    assert np.allclose(e[:, :3], f.clean[:, :3], atol=1e-6) and np.allclose(e[:, 3:], f.clean[:, 3:], atol=1e-8)


def test_gust_of_a_window_is_the_integral_of_the_autocovariance() -> None:
    """Many samples: variance of the time mean, (1/T^2) times the double integral of R(t - s) (any textbook)."""
    T, L, V, s = 25.0, 533.4, 200.0, 0.39

    def variance(across: bool) -> float:
        def r(a: float, b: float) -> float:
            t = V * abs(a - b) / L
            return math.exp(-t) * (1.0 - 0.5 * t) if across else math.exp(-t)

        below = dblquad(lambda b, a: r(a, b), 0.0, T, 0.0, lambda a: a)[0]
        return 2.0 * below * s * s / T**2

    got = m.mean_gust_sigma(s, 5000, T / 5000)
    assert got == pytest.approx([math.sqrt(variance(False)), *[math.sqrt(variance(True))] * 2], rel=2e-3)
    assert m.mean_gust_sigma(s, 1, 0.05) == pytest.approx([s] * 3)


def test_position_covariance_is_that_of_many_draws() -> None:
    """J P J^T against the sample covariance of the expectation at scattered positions."""
    rng = np.random.default_rng(1)
    at, sigma = np.array([[-35.5, 1.0, 8.0]]), 0.02
    e = m.expected(at + sigma * rng.standard_normal((20_000, 3)), m.MAP_ATT)
    S = m.position_covariance(at, m.MAP_ATT, sigma)[0]
    for v in range(3):
        sample = np.cov(e[:, 3 * v : 3 * v + 3].T)
        assert np.allclose(sample, S[v], atol=0.04 * np.abs(S[v]).max())


def _run(case: Case, seed: int = 5, **more: object) -> RunResult:
    return sevil.run_case(Case(case.name, case.params | more), seed)


def test_static_clean_and_disturbed() -> None:
    clean = _run(ALL_CASES["static_clean"], points=40).values
    assert clean["diff.median_m"] < 1e-3 and clean["diff.available_pct"] == 100.0
    assert clean["A11.median_m"] < 5e-3
    rough = _run(ALL_CASES["static_all"], points=150)
    v = rough.values
    assert v["diff.rms_m"] < 0.5 < v["A11.rms_m"] and v["diff.available_pct"] == 100.0 > v["A11.available_pct"]
    assert v["diff.crlb_ratio"] == pytest.approx(1.0, abs=0.3)
    assert rough.traces["A11.position"].shape == (150, 2)


def test_algorithms_on_the_nodes_reproduce_the_specification() -> None:
    """sevil.md 8.1: cumulative errors on the small map's own nodes."""
    v = sevil_static.run_algorithms(sevil_static.ALGORITHM_STUDY.cases[0], 1).values
    for a, ce in ((1, 42.0), (2, 22.6), (8, 3.0), (11, 3.06), (15, 3.06)):
        assert v[f"A{a}.ce_m"] == pytest.approx(ce, abs=0.05)
    assert v["points.n"] == 441 and v["diff.worst_m"] < 1e-6


def test_fewer_channels_bound_is_larger() -> None:
    every, tips = (sevil_static.run_probes(Case("p", c.params | {"points": 10}), 2).values
                   for c in sevil_static.PROBES.cases if c.name in ("all", "tips"))  # fmt: skip
    assert tips["diff.crlb_m"] > 2.0 * every["diff.crlb_m"]


def test_flight_filter_beats_contours() -> None:
    r = _run(ALL_CASES["dynamic_all"], filters=["height"])
    v = r.values
    assert v["height.contact.rms_m"] < 0.6 < v["A11.contact.rms_m"]
    assert v["height.contact.available_pct"] == 100.0
    assert v["height.contact.nis"] == pytest.approx(9.0, abs=0.8)
    assert r.traces["height.sigma"].shape == r.traces["true"].shape


def test_plant_wake_changes_are_what_they_say() -> None:
    w = sevil_dynamic.plant_wake({"mass_factor": 0.9, "wing_z_m": 0.5, "tail_x_m": -2.0, "core_factor": 2.0})
    assert w.mass_kg == pytest.approx(1.08e5) and w.wing_m == (0.0, 0.0, 0.5) and w.tail_m == (-20.0, 0.0, -1.5)
    assert w.core_wing_m == 1.6 and w.core_tail_m == 0.8 and w.tail_download_frac == 0.055
    with pytest.raises(TypeError):
        sevil_dynamic.plant_wake({"weight": 1.0})


def test_wrong_weight_is_learnt() -> None:
    v = _run(ALL_CASES["mismatch_weight_-10"], filters=["fixed", "height"]).values
    assert v["true.scale_wing"] == pytest.approx(0.9) and v["height.scale_wing"] == pytest.approx(0.9, abs=0.04)
    assert v["height.contact.rms_m"] < v["fixed.contact.rms_m"]


def test_solo_table_is_theory() -> None:
    """60 000 samples: 1 % false alarms, noncentral chi-square (lambda 30) true alarms of V within four sampling sigmas."""
    v = _run(ALL_CASES["fdi_solo"], detectors=["plain"]).values
    for var in m.VARIABLES:
        assert v[f"plain.{var}.fap_pct"] == pytest.approx(1.0, abs=4 * 100 * math.sqrt(0.01 * 0.99 / 60_000))
    p = float(ncx2.sf(chi2.isf(0.01, 2), 2, 30.0))
    assert v["plain.V.tap_pct"] == pytest.approx(100 * p, abs=4 * 100 * math.sqrt(p * (1 - p) / 20_000))


def test_refuelling_table_shows_the_printed_method_fail_in_turbulence() -> None:
    legs = (60.0, 30.0, 80.0, 40.0, 60.0)
    case = ALL_CASES["fdi_refuelling"]
    v = _run(case, detectors=["plain", "printed", "additive", "windowed"], legs_s=legs, faults=False).values
    assert v["plain.beta.fap_after_pct"] > 99.0 and v["printed.beta.fap_during_pct"] > 30.0
    assert v["additive.beta.fap_during_pct"] < 2.0 and v["windowed.beta.fap_pct"] < 0.1


def test_low_readings_are_isolated_and_never_as_printed() -> None:
    v = _run(ALL_CASES["fdi_negative"], detectors=["windowed"]).values
    for var in m.VARIABLES:
        assert v[f"windowed.{var}.isolated_pct"] > 99.0 and v[f"windowed.{var}.isolated_printed_pct"] < 1.0


def test_cusum_blames_who_crossed_first() -> None:
    """Sums that have reached their cap are alike; the probe of the first crossing is the right one."""
    v = _run(ALL_CASES["fdi_solo"], detectors=["cusum"]).values
    assert min(v[f"cusum.{var}.isolated_pct"] for var in m.VARIABLES) > 99.0


def test_sweep_follows_the_noncentral_chi_square() -> None:
    case = next(c for c in sevil_faults.SWEEPS.cases if c.name == "fault_1.5")
    v = sevil_fdi.run_sweep(Case("x", case.params | {"duration_s": 200.0}), 2).values
    theory = 100 * ncx2.sf(chi2.isf(0.01, 2), 2, 2.0 / 3.0 * 1.5**2 / 0.2)
    assert v["V.tap_theory_pct"] == pytest.approx(theory) and v["V.tap_pct"] == pytest.approx(theory, abs=3.5)


def test_covariance_of_the_position_restores_the_false_alarms() -> None:
    case = Case("p", sevil_faults.POSITION.cases[2].params)
    v = sevil_fdi.run_position(case, 2).values
    assert v["without.beta.fap_after_pct"] > 3.0 and v["with_jpj.beta.fap_after_pct"] == pytest.approx(0.8, abs=0.5)


def test_two_faults_need_the_virtual_sensor() -> None:
    v = _run(ALL_CASES["two_same_V"], windows=2000).values
    assert v["virtual.correct_pct"] > 99.0 and v["three_probes.correct_pct"] < 1.0


def test_whole_nose_probe_is_excluded_and_comes_back() -> None:
    v = _run(ALL_CASES["integrated_nose"]).values
    assert v["with_fdi.isolated"] == 1.0 and v["with_fdi.delay_samples"] <= 5.0 and v["with_fdi.readmitted"] == 1.0
    assert v["with_fdi.false_exclusion"] == 0.0 and v["with_fdi.fault.rms_m"] < 1.0
    assert v["without_fdi.fault.valid_pct"] < 50.0


def test_single_sample_alarms_at_the_prior_are_near_one_percent() -> None:
    v = _run(ALL_CASES["integrated_none"]).values
    assert 0.3 < v["single.beta.fap_contact_pct"] < 2.0 and v["with_fdi.false_exclusion"] == 0.0


def test_same_seed_same_figures() -> None:
    """Equal to the bit, NaN included."""
    a, b = (_run(ALL_CASES["static_all"], points=10).values for _ in range(2))
    assert a.keys() == b.keys() and np.array_equal(list(a.values()), list(b.values()), equal_nan=True)


def test_errors_without_any_position() -> None:
    assert sevil_track.errors(np.full((4, 2), np.nan)) == {"available_pct": 0.0}


def test_every_study_is_known_to_the_launcher() -> None:
    known = all_studies()
    mine = [s.name for mod in (sevil, sevil_static, sevil_dynamic, sevil_faults) for s in mod.STUDIES]
    assert len(set(mine)) == len(mine) == 10 and set(mine) <= known.keys()


def test_unknown_detector_is_named() -> None:
    with pytest.raises(ValueError, match="detector 'magic'; allowed: plain"):
        sevil_fdi.Detectors(fly_air(Conditions(legs_s=(1.0, 0.0, 0.0, 0.0, 1.0)), 1), ()).run(
            "magic", np.zeros((40, 9)), 0
        )
