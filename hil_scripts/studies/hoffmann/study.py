"""Hoffmann and Luckner (2010): printed gains, cases 1 and 2, nonlinear flight, spectra, consistency, observability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.design import discrete_gain, kalman_bucy, pbh_rank
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.model import ProcessNoise, linear_model, published
from flightsw.missions.gust.printed import (
    E_VK_ALPHAW_PRINTED,
    H_DIGIT,
    H_PRINTED,
    SIGMA_MISPRINTS,
    SIGMA_PRINTED,
    THETA,
    XI_BACK_FITTED,
    XI_PRINTED,
)
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.campaign.table import statistics
from hil_scripts.studies.hoffmann import flight as hf
from sim_plant.aircraft.alexis.flight import AlexisParams, AlexisSensors
from sim_plant.wind.planar import Gust

RATIO_HZ = (0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
# per kind of flight: name, state and start of the record [s]. The ramp of alpha_W stands at the very end of what is left out
WINDOWS: dict[str, tuple[tuple[str, int, float], ...]] = {
    "case1": (("alpha_w", k.AW, hf.DROP_S), ("v_w", k.VW, hf.DROP_S)),
    "case2": (("alpha_w", k.AW, hf.DROP_S), ("v_w", k.VW, hf.DROP_S), ("alpha_w_ramp", k.AW, 0.0)),
    "nonlinear": (),
}
PRINTED_XI = ProcessNoise(0.6 * hf.DEG, 0.5 * hf.DEG, 0.35, 0.2 * hf.DEG, 1.0, 0.2 * hf.DEG)


def run_gains(case: Case, seed: int) -> RunResult:
    """Riccati solution of the case's noise and E sign against the printed gain and covariance, entry by entry."""
    E = np.array(published().E)
    if case.params["E"] == "printed":
        E[2, 0] = E_VK_ALPHAW_PRINTED
    m = linear_model(E=E)
    Xi = XI_BACK_FITTED if case.params["noise"] == "back_fitted" else XI_PRINTED
    K, S = kalman_bucy(m.A, m.C[:5], Xi, THETA)
    off = np.abs(K - H_PRINTED) / np.abs(H_PRINTED)
    rounds = np.abs(K - H_PRINTED) <= 0.5 * H_DIGIT
    corrected = SIGMA_PRINTED.copy()
    for at, v in SIGMA_MISPRINTS.items():
        corrected[at] = v
    close = np.abs(S - corrected) <= np.maximum(0.03 * np.abs(corrected), 1.5e-4)
    slow = np.sort(np.abs(np.linalg.eigvals(m.A - H_PRINTED @ m.C[:5])))
    values: dict[str, float] = {
        "entries": float(K.size),
        "within_5pct": float(np.sum(off <= 0.05)),
        "within_5pct_or_rounding": float(np.sum((off <= 0.05) | rounds)),
        "within_1pct": float(np.sum(off <= 0.01)),
        "median_pct": 100.0 * float(np.median(off)),
        "worst_pct": 100.0 * float(off.max()),
        "negative_sign_within_5pct": float(np.sum(np.abs(-K - H_PRINTED) <= 0.05 * np.abs(H_PRINTED))),
        "sigma_entries_met": float(np.sum(close)),
        "sigma.alpha_w_deg": math.degrees(math.sqrt(S[1, 1])),
        "sigma.v_w_mps": math.sqrt(S[2, 2]),
        "sigma.bias_deg": math.degrees(math.sqrt(S[8, 8])),
        "slow_pole_1_radps": float(slow[0]),
        "slow_pole_2_radps": float(slow[1]),
    }
    for i in range(9):
        for j in range(5):
            values[f"gain_{i + 1}_{j + 1}.computed"] = float(K[i, j])
            values[f"gain_{i + 1}_{j + 1}.printed"] = float(H_PRINTED[i, j])
    return RunResult(values, {"K": K, "H_printed": H_PRINTED, "Sigma": S, "Sigma_printed": SIGMA_PRINTED})


def run_observability(case: Case, seed: int) -> RunResult:
    """Rank after seed (12) for sets of outputs, and the steady sigma of the discrete filter with each."""
    m = linear_model()
    sets = {
        "all": [0, 1, 2, 3, 4], "no_q": [1, 2, 3, 4], "no_alpha": [0, 2, 3, 4], "no_V_A": [0, 1, 3, 4],
        "no_Theta": [0, 1, 2, 4], "no_H": [0, 1, 2, 3], "ground": [0, 1, 2, 3, 4, 5], "a_z": [0, 1, 2, 3, 4, 6],
    }  # fmt: skip
    R7 = np.square(GustNav().p.sensors.sigmas())
    R7[k.Y_GROUND] *= 10.0  # 5 Hz at 50 Hz: the same information per second
    Xi = m.Br @ m.Br.T + ProcessNoise().intensity()
    constant = m.A.copy()
    constant[:3] = 0.0
    constant[1, 0] = 1.0  # wind poles at zero: wind as it is stays
    values: dict[str, float] = {}
    for name, rows in sets.items():
        C = m.C[rows]
        rank, least = pbh_rank(m.A, C)
        values[f"{name}.rank"], values[f"{name}.least_singular"] = float(rank), least
        values[f"{name}.constant_wind_rank"] = float(pbh_rank(constant, C)[0])
        if rank == 9:
            P = discrete_gain(m.A, C, Xi, np.diag(R7[rows]), hf.DT)[1]
            values[f"{name}.sigma.alpha_w_deg"] = math.degrees(math.sqrt(P[1, 1]))
            values[f"{name}.sigma.v_w_mps"] = math.sqrt(P[2, 2])
    return RunResult(values)


def _plan(p: dict[str, Any]) -> hf.FlightPlan:
    T, scale = float(p["duration_s"]), float(p.get("scale", 1.0))
    kind = p["kind"]
    if kind == "case1":
        noise = (PRINTED_XI.q, PRINTED_XI.alpha_K, PRINTED_XI.V_K, PRINTED_XI.Theta, PRINTED_XI.H)
        plant = AlexisParams(
            linear=True,
            direct=True,
            sensors=hf.BIAS_STEP,
            noise=noise if p.get("xi") else (0.0,) * 5,  # type: ignore[arg-type]
        )
        return hf.FlightPlan(T, hf.wind(scale), plant, hf.blocks)
    if kind == "case2":
        gusts = (Gust("down", 20.0 * 5.0 * hf.DEG, 2.0, 0.5), Gust("tail", 5.0, 17.0, 0.5))
        return hf.FlightPlan(T, hf.wind(0.0, gusts=gusts), AlexisParams(linear=True, direct=True))
    plant = AlexisParams(direct=True, sensors=AlexisSensors(bias_deg=1.0, bias_at_s=12.0))
    return hf.FlightPlan(T, hf.wind(scale), plant, hf.blocks, (0.02, 0.02, 0.5, 0.02, 1.0))


def _estimators(p: dict[str, Any]) -> dict[str, tuple[GustNav | ConstantGainGust, int]]:
    kind, scale = p["kind"], float(p.get("scale", 1.0))
    basic = hf.SENSORS["basic"]
    out: dict[str, tuple[GustNav | ConstantGainGust, int]] = {
        name: (hf.continuous(name), basic) for name in ("printed", "printed_joined")
    }
    if kind == "nonlinear":
        out["discrete"] = hf.discrete(scale), basic
        for name in ("ekf", "ukf", "srckf"):
            out[name] = hf.nonlinear(name, (scale,)), basic
        out["ekf_ground"] = hf.nonlinear("ekf", (scale,)), hf.SENSORS["ground"]
        out["ekf_vertical"] = hf.nonlinear("ekf", (scale,)), hf.SENSORS["vertical"]
        out["ekf_bank"] = hf.nonlinear("ekf", (0.01, 0.1, 0.3, 1.0)), basic
        return out
    if p.get("xi"):
        out["discrete"] = hf.discrete(scale, process=PRINTED_XI), basic
        return out
    out["discrete"] = hf.discrete(scale), basic
    if kind == "case1" and not p.get("spectra"):
        for name in ("xi_printed", "xi_printed_e", "bucy_unscaled", "bucy"):
            out[name] = hf.continuous(name), basic
    return out


def run_case(case: Case, seed: int) -> RunResult:
    """One flight and every estimator of the case on its readings."""
    p = case.params
    r = hf.fly(_plan(p), seed)
    values: dict[str, float] = {}
    traces = {"t": r.t, "truth": r.truth, "y": r.y}
    for name, (est, channels) in _estimators(p).items():
        track = hf.estimate(est, r, channels, known_start=p["kind"] != "nonlinear", nees=p["kind"] == "nonlinear")
        values |= {f"{name}.{key}": v for key, v in hf.errors(r, track.x).items()}
        for what, column, after_s in WINDOWS[p["kind"]]:
            for key, v in hf.spectra(r, track.x, column, RATIO_HZ, after_s).items():
                values[f"{name}.{what}.{key}"] = v
        if p["kind"] == "nonlinear" and isinstance(est, GustNav):
            values[f"{name}.nees_over_n"] = float(np.nanmean(track.nees[r.t >= 1.0]))
            values[f"{name}.nis_over_m"] = float(np.nanmean(track.nis))
        traces[f"{name}.x"], traces[f"{name}.sigma"] = track.x, track.sigma
    if p.get("spectra"):
        traces = {}
    return RunResult(values, traces)


def pooled(rows: Sequence[Mapping[str, float]]) -> dict[str, float | int | None]:
    """Statistics over runs of every value; `pooled`: standard deviations about the mean of all runs, and ratio, phase and
    coherence from spectra averaged over runs."""
    out: dict[str, float | int | None] = {}
    for name in sorted({key for row in rows for key in row}):
        out |= {f"{name}.{s}": v for s, v in statistics([row[name] for row in rows if name in row], False).items()}
    mean = {key.removesuffix(".mean"): v for key, v in out.items() if key.endswith(".mean") and v is not None}
    for name in mean:
        head, _, last = name.rpartition(".")
        if last.startswith("std_"):
            square, centre = (
                out[f"{head}.{last.replace('std', 'rms')}.rms"],
                mean[f"{head}.{last.replace('std', 'mean')}"],
            )
            out[f"{name}.pooled"] = math.sqrt(max(0.0, float(square or 0.0) ** 2 - centre**2))
        elif last.startswith("tt_"):
            hz = last.removeprefix("tt_")
            sums = [mean[f"{head}.{part}_{hz}"] for part in ("tt", "ee", "te_re", "te_im")]
            for key, v in zip((f"ratio_{hz}", f"phase_{hz}_deg", f"coherence_{hz}"), hf.transfer(*sums), strict=True):
                out[f"{head}.{key}.pooled"] = v
    return out


def run_consistency(case: Case, seed: int) -> RunResult:
    """Linear plant with exactly the noise the filter expects: NEES/9 and NIS/5."""
    scale = float(case.params["scale"])
    plant = AlexisParams(
        linear=True, direct=True, noise=hf.PLANT_NOISE, sensors=AlexisSensors(bias_walk=0.2, bias_start_deg=0.1)
    )
    r = hf.fly(hf.FlightPlan(float(case.params["duration_s"]), hf.wind(scale), plant), seed)
    track = hf.estimate(hf.discrete(scale), r, known_start=True, nees=True)
    early = r.t < 12.0
    return RunResult(
        {
            "nees_over_n": float(np.nanmean(track.nees)),
            "nees_over_n_early": float(np.nanmean(track.nees[early])),
            "nees_over_n_late": float(np.nanmean(track.nees[~early])),
            "nis_over_m": float(np.nanmean(track.nis)),
        }
    )


GAINS = Study(
    name="hoffmann_gains",
    title="The printed gain and covariance",
    purpose="Riccati design with back-fitted and with printed noise against the 45 printed gains and 81 covariances",
    cases=(
        Case("back_fitted", {"noise": "back_fitted", "E": "corrected"}),
        Case("printed_noise", {"noise": "printed", "E": "corrected"}),
        Case("back_fitted_printed_e", {"noise": "back_fitted", "E": "printed"}),
    ),
    run=run_gains,
    default_runs=1,
)
OBSERVABILITY = Study(
    name="hoffmann_observability",
    title="What can be observed",
    purpose="rank and smallest singular value per set of outputs, with the wind model and in constant wind",
    cases=(Case("linear"),),
    run=run_observability,
    default_runs=1,
)
CASES = Study(
    name="hoffmann",
    title="Cases 1 and 2 and the nonlinear aircraft",
    purpose="error of wind and bias of every estimator on the same readings",
    cases=(
        Case("case1", {"kind": "case1", "duration_s": 60.0}),
        Case("case1_xi", {"kind": "case1", "duration_s": 60.0, "xi": True}),
        Case("case2", {"kind": "case2", "duration_s": 30.0}),
        Case("nonlinear", {"kind": "nonlinear", "duration_s": 30.0, "scale": 0.3}),
    ),
    run=run_case,
    default_runs=40,
    pool=pooled,
)
SPECTRA = Study(
    name="hoffmann_spectra",
    title="Spectra",
    purpose="amplitude ratio, phase and coherence from long records, where the number of windows no longer matters",
    cases=tuple(
        Case(f"sigma_{s:g}".replace(".", "p"), {"kind": "case1", "duration_s": 600.0, "scale": s, "spectra": True})
        for s in (1.0, 0.3, 0.1)
    ),
    run=run_case,
    default_runs=4,
    pool=pooled,
)
CONSISTENCY = Study(
    name="hoffmann_consistency",
    title="Consistency",
    purpose="NEES and NIS of the discrete filter where its model and its noise are exact",
    cases=(
        Case("sigma_1", {"scale": 1.0, "duration_s": 30.0}),
        Case("sigma_0p3", {"scale": 0.3, "duration_s": 30.0}),
    ),
    run=run_consistency,
    default_runs=100,
)
STUDIES = (GAINS, OBSERVABILITY, CASES, SPECTRA, CONSISTENCY)
