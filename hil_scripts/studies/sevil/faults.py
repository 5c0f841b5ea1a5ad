"""Studies of air-data fault detection: sweeps of sevil_fdi, and detection and estimation together (sevil.md 9.5)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.receiver.airdata.fdi import metrics, parity
from flightsw.missions.receiver.airdata.fdi.monitor import FdiParams
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil import fdi as sf
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil import track as tk
from hil_scripts.studies.sevil.flight import LEG_NAMES, SHORT_LEGS, Conditions, Fault, fly_air

DEG = sf.DEG
CONTACT_S, LATERAL_S = (250.0, 310.0), (110.0, 150.0)  # [s] when the faults of the integrated run are there
BEFORE_S = 40.0  # [s] of contact before a fault, for comparison
PROBE = {"nose": 0, "left": 1, "right": 2}


def faults_of(p: dict[str, Any]) -> tuple[Fault, ...]:
    """Faults of a case: [variable, probe, size in m/s or deg, rate per s] each, at contact or on the lateral leg."""
    start, stop = LATERAL_S if p.get("leg") == "lateral" else CONTACT_S
    out = []
    for var, probe, size, *rate in p.get("faults", []):
        unit = sf.UNIT[var]
        r = float(rate[0]) * unit if rate else 0.0
        out.append(Fault(m.VARIABLES.index(var), PROBE[probe], float(size) * unit, start, stop, r))
    return tuple(out)


def monitor_figures(name: str, t: np.ndarray, tr: tk.Track, faulty: np.ndarray, onset: float) -> dict[str, float]:
    """Exclusions against the truth: false ones, delay of the right ones, how long they outlast the fault."""
    wrong = tr.excluded & ~faulty
    late = np.zeros_like(wrong)  # a channel whose fault has just ended is not a false exclusion while it proves itself
    for c in range(9):
        bit = (faulty >> c) & 1
        end = np.flatnonzero(np.diff(bit) == -1)
        for i in end:
            late[i + 1 :] |= 1 << c
    out = {
        f"{name}.false_exclusion": float(np.any(wrong & ~late)),
        f"{name}.false_excluded_pct": 100.0 * float(np.mean((wrong & ~late) != 0)),
        f"{name}.alarm_pct": 100.0 * float(np.mean(tr.alarm != 0)),
    }
    masks = np.bitwise_or.reduce(faulty) if len(faulty) else 0
    if masks:
        first = int(np.searchsorted(t, onset))
        all_out = np.flatnonzero((tr.excluded[first:] & masks) == masks)
        out[f"{name}.isolated"] = float(len(all_out) > 0)
        out[f"{name}.delay_samples"] = float(all_out[0] + 1) if len(all_out) else math.nan
        during = faulty != 0
        out[f"{name}.kept_out_pct"] = 100.0 * float(np.mean((tr.excluded[during] & masks) == masks))
        out[f"{name}.readmitted"] = float((tr.excluded[-1] & masks) == 0)
    return out


def run_integrated(case: Case, seed: int) -> RunResult:
    """Filter and monitor together, no other position sensor; the same filter without monitor beside it."""
    p = case.params
    faults = faults_of(p)
    f = fly_air(Conditions(faults=faults), seed)
    start, stop = LATERAL_S if p.get("leg") == "lateral" else CONTACT_S
    windows = {
        "fault": (f.t >= start) & (f.t < stop),
        "before": (f.t >= start - BEFORE_S) & (f.t < start),
        "after": (f.t >= stop + 10.0) & (f.leg == len(LEG_NAMES) - 1),
    }
    values: dict[str, float] = {}
    traces: dict[str, Any] = {"t": f.t[::4], "true": f.xi[::4, 1:], "faulty": f.faulty[::4]}
    guess = (float(f.guess[0]), float(f.guess[1]), 5.0)
    for name in ("with_fdi", "without_fdi"):
        guarded = name == "with_fdi"
        tr = tk.track(f, tk.FLOWN, FdiParams() if guarded else None, guess, keep_prior=guarded)
        e = tr.pos - f.xi[:, 1:]
        for k, sel in windows.items():
            values |= {f"{name}.{k}.{x}": y for x, y in tk.errors(e[sel]).items()}
            values[f"{name}.{k}.valid_pct"] = 100.0 * float(tr.valid[sel].mean())
        values[f"{name}.restarts"] = float(tr.restarts)
        traces |= {f"{name}.position": tr.pos[::4], f"{name}.sigma": tr.sigma[::4]}
        if guarded:
            values |= monitor_figures(name, f.t, tr, f.faulty, start)
            values |= prior_figures(f.leg, tr) if not faults else {}
            traces["excluded"] = tr.excluded[::4]
    return RunResult(values, traces)


def prior_figures(leg: np.ndarray, tr: tk.Track) -> dict[str, float]:
    """False alarms [%] of the single-sample test at the filter's position with J P J^T, per leg and variable."""
    out: dict[str, float] = {}
    have = np.isfinite(tr.gap[:, 0])
    for v, var in enumerate(m.VARIABLES):
        k = slice(3 * v, 3 * v + 3)
        for i, name in enumerate(LEG_NAMES):
            sel = have & (leg == i)
            if sel.any():
                res = parity.additive(tr.gap[sel, k], np.zeros(3), m.SIGMA[v], tr.S[sel, v])
                out[f"single.{var}.fap_{name}_pct"] = sf.alarms(res, metrics.threshold(sf.P_SINGLE))
    return out


def _table(where: str, air: str, *names: str, **more: Any) -> dict[str, Any]:
    return {"kind": "fdi_table", "where": where, "air": air, "detectors": list(names), **more}


OURS = ("additive", "windowed", "windowed_kept", "cusum")
TABLE_FDI = (
    Case("fdi_solo", _table("solo", "turbulent", "plain", "plain_corrected", "windowed", "cusum")),
    Case("fdi_contact_calm", _table("contact", "calm", "printed", *OURS)),
    Case("fdi_refuelling_calm", _table("refuelling", "calm", "plain", "printed", "multiplicative", "additive_table", *OURS)),
    Case("fdi_refuelling", _table("refuelling", "turbulent", "plain", "printed", "multiplicative", "additive_table", *OURS)),
    Case("fdi_negative", _table("refuelling", "turbulent", "additive", "windowed", sign=-1.0)),
)  # fmt: skip


def _two(variable: str, *sizes: float, **more: Any) -> dict[str, Any]:
    return {"kind": "two_faults", "variable": variable, "faults": list(sizes), **more}


TABLE_TWO = (
    Case("two_none_V", _two("V", 0, 0, 0)),
    Case("two_one_V", _two("V", 3, 0, 0)),
    Case("two_same_V", _two("V", 3, 3, 0)),
    Case("two_opposite_V", _two("V", 3, -3, 0)),
    Case("two_unequal_V", _two("V", 3, 2, 0)),
    Case("two_same_beta", _two("beta", 1, 1, 0)),
    Case("two_opposite_beta", _two("beta", 1, -1, 0)),
)


def _int(*faults: list[Any], **more: Any) -> dict[str, Any]:
    return {"kind": "integrated", "faults": list(faults), **more}


TABLE_INTEGRATED = (
    Case("integrated_none", _int()),
    Case("integrated_beta_left_+1", _int(["beta", "left", 1.0])),
    Case("integrated_nose", _int(["V", "nose", 3.0], ["beta", "nose", 1.0], ["alpha", "nose", 1.0])),
)
INTEGRATED = Study(
    name="sevil_integrated",
    title="Detection and position together",
    purpose="faults for 60 s at contact or 40 s of the lateral leg with no other position sensor; with exclusion and without",
    cases=(
        Case("none", _int()),
        Case("beta_left_+1", _int(["beta", "left", 1.0])),
        Case("beta_nose_-1", _int(["beta", "nose", -1.0])),
        Case("alpha_right_-1", _int(["alpha", "right", -1.0])),
        Case("V_nose_+3", _int(["V", "nose", 3.0])),
        Case("beta_left_alpha_right", _int(["beta", "left", 1.0], ["alpha", "right", -1.0])),
        Case("whole_nose", _int(["V", "nose", 3.0], ["beta", "nose", 1.0], ["alpha", "nose", 1.0])),
        Case("two_beta", _int(["beta", "nose", 1.0], ["beta", "left", 1.0])),
        Case("beta_nose_+0.3", _int(["beta", "nose", 0.3])),
        Case("beta_nose_drift", _int(["beta", "nose", 0.0, 0.01])),
        Case("lateral_alpha_nose_+1", _int(["alpha", "nose", 1.0], leg="lateral")),
        Case("lateral_beta_left_-1", _int(["beta", "left", -1.0], leg="lateral")),
    ),
    run=run_integrated,
    default_runs=8,
    binary=("lost", "false_exclusion", "isolated", "readmitted"),
)


def _sweep(fault: float, deg: float, **more: Any) -> dict[str, Any]:
    return {"kind": "fdi_sweep", "fault": fault, "fault_deg": deg, **more}


def _position(sigma: float) -> dict[str, Any]:
    return {"kind": "fdi_position", "where": "refuelling", "air": "turbulent", "position_sigma_m": sigma}


SWEEPS = Study(
    name="sevil_fdi",
    title="Detection sweeps against theory",
    purpose="true alarms against fault size, noise and window beside the noncentral chi-square, in turbulence at contact",
    cases=(
        *(Case(f"fault_{f:g}", _sweep(f, f / 10.0)) for f in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)),
        *(Case(f"noise_{v:g}", _sweep(3.0, 0.3, noise=v)) for v in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)),
        *(
            Case(f"window_{n}", _sweep(1.5, 0.15, window=n, p_false=q))
            for n, q in ((1, 1e-2), (3, 1e-4), (5, 1e-5), (10, 1e-6))
        ),
    ),
    run=sf.run_sweep,
    default_runs=8,
)
POSITION = Study(
    name="sevil_position_noise",
    title="Detection with a noisy position",
    purpose="false alarms of the additive test when the position has white errors, with and without J P J^T; 3000 s runs",
    cases=tuple(Case(f"sigma_{s:g}", _position(s)) for s in (0.1, 0.3, 1.0, 2.0)),
    run=sf.run_position,
    default_runs=5,
)
TWO = Study(
    name="sevil_two_faults",
    title="Two faults in one variable",
    purpose="decisions with the virtual sensor from windows of 5 and of 1 samples; three probes alone beside it",
    cases=(
        *TABLE_TWO,
        Case("two_weak_V", _two("V", 2, 2, 0)),
        Case("two_same_alpha", _two("alpha", 1, 1, 0)),
        Case("three_V", _two("V", 3, 3, 3)),
        Case("single_sample_same_V", _two("V", 3, 3, 0, window=1)),
        Case("single_sample_same_beta", _two("beta", 1, 1, 0, window=1)),
    ),
    run=sf.run_two_faults,
    default_runs=8,
)
STUDIES = (INTEGRATED, SWEEPS, POSITION, TWO)
assert sum(SHORT_LEGS) > CONTACT_S[1]
