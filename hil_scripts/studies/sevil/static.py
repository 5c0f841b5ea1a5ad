"""Sevil (2013), chapters 3 and 4: position from one set of air-data readings at places of the maps' grid (sevil.md 8.1, 8.2).

Contour Algorithms 1-16 beside maximum likelihood; readings from the plant's wake, with noise, turbulence (mean over the
averaging window) and steady wind that the estimators do not know.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.receiver.airdata.contour.algorithms import ALGORITHMS, Crossings, locate
from flightsw.missions.receiver.airdata.wake_fix import MlParams
from flightsw.missions.receiver.airdata.wake_model import WakeParams
from flightsw.missions.receiver.airdata.wake_search import WakeMl, frame_vector
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil.metrics import evaluate, weights
from hil_scripts.studies.sevil.probe_air import PlantWake, plant_readings
from sim_plant.rng import generator

Arr = m.Arr
DT = 0.05  # [s] 20 Hz
RANDOM_POINTS = {"small": 441, "extended": 1533}
CENTRE, HALF_WIDTH_M = (0.0, 8.5), 2.0  # [m] of the small grid
MARGIN_M = 2.0  # [m] of the search region around a map
WRONG_M = 3.0  # [m] an error beyond this is another basin, not noise
SLOW = 2.0  # [m/s] prior of the unknown steady wind in "joint"
FRAME = frame_vector(m.CONTACT_X, m.MAP_ATT, m.V_MPS, m.RHO)


def points_of(name: str, on_node: bool, seed: int, count: int = 0) -> Arr:
    """Positions [n,2] (y, z) [m]: the nodes of a map, or as many at random places inside its grid."""
    wake_map = m.contours(name).map
    if on_node:
        return wake_map.nodes()
    g = generator(seed, "sevil.points")
    n = count or RANDOM_POINTS[name]
    y, z = wake_map.y, wake_map.z
    return np.stack([g.uniform(y[0], y[-1], n), g.uniform(z[0], z[-1], n)], axis=1)


def disturbed(points: Arr, p: dict[str, Any], seed: int, wake: PlantWake | None = None) -> Arr:
    """Readings [n,9] at points [n,2], each the mean of one window with its own noise and turbulence."""
    samples = max(1, round(float(p.get("window_s", 1.0)) / DT))
    gust = m.mean_gust_sigma(float(p.get("turbulence_mps", 0.0)), samples, DT)
    air = generator(seed, "sevil.gusts").standard_normal((len(points), 3)) * gust + np.array(
        p.get("wind_mps", [0.0] * 3)
    )
    xi = np.column_stack([np.full(len(points), m.CONTACT_X), points])
    clean = plant_readings(xi, m.MAP_ATT, air=air, wake=wake or PlantWake())
    noise = generator(seed, "sevil.noise").standard_normal(clean.shape) * np.repeat(m.SIGMA, 3)
    return clean + noise * math.sqrt(float(p.get("noise", 0.0)) / samples)


def figures(truth: Arr, estimate: Arr, wide: bool = False) -> dict[str, float]:
    """Figures of merit of estimates [n,2] (NaN: none). wide: weights of the extended grid are those of distances there."""
    w = weights(truth, half_width_m=36.0) if wide else weights(truth)
    f = evaluate(truth, estimate, w)
    return {
        "rms_m": f.rms_m, "median_m": f.median_m, "worst_m": f.worst_m, "available_pct": 100.0 * f.er, "none_pct": 100.0 * f.none,
        "ce_m": f.ce_m, "er": f.er, "wce_m": f.wce_m, "wer": f.wer, "wer_normalised": f.wer_normalised,
    }  # fmt: skip


def by_algorithm(name: str, readings: Arr, numbers: tuple[int, ...]) -> dict[int, Arr]:
    """Positions [n,2] of each contour algorithm on the same readings, NaN where it gives none."""
    cut = m.contours(name)
    out = {a: np.full((len(readings), 2), np.nan) for a in numbers}
    for i, y in enumerate(readings):
        crossed = Crossings(cut, y)
        for a in numbers:
            found = locate(a, crossed)
            if found is not None:
                out[a][i] = found
    return out


def estimators(p: dict[str, Any], name: str = "small") -> dict[str, WakeMl]:
    """Maximum likelihood in its three weightings, searching the same map as the contour algorithms and MARGIN_M around it.

    "joint" has a prior of the common wind (turbulence and slow wind), "joint_gust" of turbulence only: it is misled by a
    steady wind. "diff_wide" searches the whole extended region for a point of the small one; "diff_prior" is told that the
    point is near the small grid (1 sigma: its half width), which the contour algorithms know as well.
    """
    noise = math.sqrt(max(float(p.get("noise", 0.0)), 1e-6))
    wide: dict[str, Any] = {"sigma_V": noise * m.SIGMA[0], "sigma_angle": noise * m.SIGMA[1]}
    base = dict(wide)
    if name == "small":
        y, z = m.contours(name).map.y, m.contours(name).map.z
        base |= {"y_m": (y[0] - MARGIN_M, y[-1] + MARGIN_M), "z_m": (z[0] - MARGIN_M, z[-1] + MARGIN_M), "step_m": 0.5}
    gust = max(float(p.get("turbulence_mps", 0.0)), 1e-3)
    both = math.hypot(gust, SLOW)
    chosen = {
        "abs": MlParams(weighting="abs", **base),
        "diff": MlParams(weighting="diff", **base),
        "joint": MlParams(weighting="joint", common_V=both, common_angle=both / m.V_MPS, **base),
        "joint_gust": MlParams(weighting="joint", common_V=gust, common_angle=gust / m.V_MPS, **base),
        "diff_prior": MlParams(weighting="diff", **base),
        "diff_wide": MlParams(weighting="diff", **wide),
    }
    return {k: WakeMl(m.PROBES, v, WakeParams()) for k, v in chosen.items()}


def bound(ml: WakeMl, points: Arr, samples: int, mask: int = 0b111111111) -> tuple[float, float]:
    """Cramer-Rao bound: RMS over the points of the radial sigma [m], and at contact."""
    total = [ml.crlb(y, z, FRAME, samples, mask) for y, z in points]
    radial = [c[0, 0] + c[1, 1] for c in total if c is not None]
    at = ml.crlb(0.0, 8.5, FRAME, samples, mask)
    contact = math.nan if at is None else math.sqrt(at[0, 0] + at[1, 1])
    return (math.sqrt(float(np.mean(radial))) if radial else math.nan), contact


def run_static(case: Case, seed: int) -> RunResult:
    """Off-node points of the small grid: Algorithms 11 and 15 against maximum likelihood (sevil.md 8.2)."""
    p = case.params
    points = points_of("small", False, seed, int(p.get("points", 0)))
    readings = disturbed(points, p, seed)
    samples = max(1, round(float(p.get("window_s", 1.0)) / DT))
    values: dict[str, float] = {}
    traces: dict[str, Arr] = {"points": points}
    found = {f"A{a}": est for a, est in by_algorithm("small", readings, (11, 15)).items()}
    ml = estimators(p)
    for name, e in ml.items():
        prior = (*CENTRE, HALF_WIDTH_M) if name == "diff_prior" else None
        fixes = [e.locate(y, FRAME, samples, prior=prior) for y in readings]
        found[name] = np.array([(math.nan, math.nan) if f is None else f.pos for f in fixes])
        values[f"{name}.rivals_pct"] = 100.0 * float(np.mean([f is not None and len(f.rivals) > 0 for f in fixes]))
        values[f"{name}.wrong_pct"] = 100.0 * float(np.mean(np.hypot(*(found[name] - points).T) > WRONG_M))
    for name, est in found.items():
        values |= {f"{name}.{k}": v for k, v in figures(points, est).items()}
        traces[f"{name}.position"] = est
    if float(p.get("noise", 0.0)) > 0.0:
        for name in ("abs", "diff"):
            grid, contact = bound(ml[name], points, samples)
            values |= {f"{name}.crlb_m": grid, f"{name}.crlb_contact_m": contact}
            values[f"{name}.crlb_ratio"] = values[f"{name}.rms_m"] / grid
    return RunResult(values, traces)


def run_algorithms(case: Case, seed: int) -> RunResult:
    """All sixteen algorithms and differential maximum likelihood on one map, on or off its nodes (sevil.md 8.1)."""
    p = case.params
    name = str(p["map"])
    points = points_of(name, bool(p.get("on_node", False)), seed, int(p.get("points", 0)))
    readings = disturbed(points, p, seed)
    values: dict[str, float] = {}
    for a, est in by_algorithm(name, readings, tuple(ALGORITHMS)).items():
        values |= {f"A{a}.{k}": v for k, v in figures(points, est, name == "extended").items()}
    ml = estimators(p, name)["diff"]
    samples = max(1, round(float(p.get("window_s", 1.0)) / DT))
    fixes = [ml.locate(y, FRAME, samples) for y in readings]
    est = np.array([(math.nan, math.nan) if f is None else f.pos for f in fixes])
    values |= {f"diff.{k}": v for k, v in figures(points, est, name == "extended").items()}
    values["points.n"] = float(len(points))
    # Algorithm 11 with the epsilon gate on both sets: fewer positions, none of them wrong (sevil.md 8.1)
    cut = m.contours(name)
    gated = np.full_like(points, np.nan)
    for i, y in enumerate(readings):
        at = locate(11, Crossings(cut, y), gate=0.1)
        gated[i] = (math.nan, math.nan) if at is None else at
    values |= {f"A11_gated.{k}": v for k, v in figures(points, gated, name == "extended").items()}
    return RunResult(values, {"points": points})


def run_probes(case: Case, seed: int) -> RunResult:
    """Cramer-Rao bound and maximum likelihood with fewer channels, all noise (sevil.md 8.2, below the table)."""
    p = case.params
    mask = int(p["mask"])
    points = points_of("small", False, seed, int(p.get("points", 0)))
    readings = disturbed(points, p, seed)
    ml = estimators(p)["diff"]
    fixes = [ml.locate(y, FRAME, 20, mask) for y in readings]
    est = np.array([(math.nan, math.nan) if f is None else f.pos for f in fixes])
    grid, contact = bound(ml, points, 20, mask)
    values = {f"diff.{k}": v for k, v in figures(points, est).items()}
    return RunResult(values | {"diff.crlb_m": grid, "diff.crlb_contact_m": contact})


def static(**more: Any) -> dict[str, Any]:
    """Parameters of a static case. noise: multiple of the source's noise variance."""
    return {"kind": "static", **more}


ALL: dict[str, Any] = {"turbulence_mps": m.LIGHT, "noise": 1.0, "wind_mps": [2.0, 1.0, 0.5]}
TABLE_CASES = (
    Case("static_clean", static()),
    Case("static_turbulence", static(turbulence_mps=m.LIGHT)),
    Case("static_noise", static(noise=1.0)),
    Case("static_wind", static(wind_mps=[2.0, 1.0, 0.5])),
    Case("static_all", static(**ALL)),
)


def _alg(name: str, on_node: bool = False, **more: Any) -> dict[str, Any]:
    return {"kind": "algorithms", "map": name, "on_node": on_node, **more}


ALGORITHM_STUDY = Study(
    name="sevil_algorithms",
    title="Algorithms 1-16",
    purpose="all contour algorithms and differential maximum likelihood on both maps, on and off nodes, clean and disturbed",
    cases=(
        Case("small_on_node", _alg("small", True)),
        Case("small_off_node", _alg("small")),
        Case("extended_on_node", _alg("extended", True)),
        Case("extended_off_node", _alg("extended")),
        Case("small_noise", _alg("small", noise=1.0)),
        Case("small_turbulence", _alg("small", turbulence_mps=m.LIGHT)),
        Case("small_all", _alg("small", **ALL)),
    ),
    run=run_algorithms,
    default_runs=5,
)
SWEEPS = Study(
    name="sevil_static",
    title="Static position, disturbance sweeps",
    purpose="position error of Algorithms 11 and 15 and of maximum likelihood against turbulence, noise, window and wind",
    cases=(
        *(Case(f"turbulence_{s:g}", static(turbulence_mps=s)) for s in (0.1, 0.2, 0.39, 0.8, 1.2)),
        *(Case(f"noise_{v:g}", static(noise=v / 0.002)) for v in (0.0002, 0.0005, 0.001, 0.002, 0.004)),
        *(
            Case(f"window_{w:g}", static(turbulence_mps=m.LIGHT, noise=1.0, window_s=w))
            for w in (0.05, 1, 2, 5, 10, 25)
        ),
        *(Case(f"noise_window_{w:g}", static(noise=1.0, window_s=w)) for w in (1, 10, 25)),
        *(Case(f"turbulence_window_{w:g}", static(turbulence_mps=m.LIGHT, window_s=w)) for w in (1, 10, 25)),
        *(Case(f"wind_{w:g}", static(wind_mps=[0.0, w, 0.0])) for w in (0.5, 1, 2)),
        Case("wind_three_axes", static(wind_mps=[2.0, 1.0, 0.5])),
        Case("turbulence_noise", static(turbulence_mps=m.LIGHT, noise=1.0)),
    ),
    run=run_static,
    default_runs=5,
)
PROBES = Study(
    name="sevil_probes",
    title="Fewer channels",
    purpose="position with noise, turbulence and wind from some of the nine channels: what each probe and variable is worth",
    cases=tuple(
        Case(name, {"kind": "probes", "mask": mask, **ALL})
        for name, mask in (
            ("all", 0b111111111), ("without_V", 0b111111000), ("nose_left", 0b011011011), ("nose_right", 0b101101101),
            ("tips", 0b110110110), ("beta_only", 0b000111000), ("alpha_only", 0b111000000),
        )
    ),
    run=run_probes,
    default_runs=5,
)  # fmt: skip
STUDIES = (ALGORITHM_STUDY, SWEEPS, PROBES)
