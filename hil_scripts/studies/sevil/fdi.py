"""Sevil (2013), chapters 5 and 6: fault detection on 3000 s flights at 20 Hz (sevil.md 9.1 to 9.4).

The same readings go through the detectors as printed (equal readings; multiplicative form with the maps' fixed attitude;
isolation by the largest cosine) and ours (additive with the measured attitude, |cos|, windows, CUSUM, virtual sensor).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.receiver.airdata.fdi import detectors as dt
from flightsw.missions.receiver.airdata.fdi import metrics, parity
from flightsw.missions.receiver.airdata.fdi.parity import Residuals
from hil_scripts.campaign.study import Case, RunResult
from hil_scripts.studies.sevil import isolation, two_faults
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil.correction import correct_rotation
from hil_scripts.studies.sevil.flight import (
    CONTACT,
    LEG_NAMES,
    LONG_LEGS,
    AirFlight,
    Conditions,
    Fault,
    fly_air,
    inject,
    table_faults,
)
from sim_plant.rng import generator

Arr = m.Arr
P_SINGLE, P_WINDOW, WINDOW = 0.01, 1e-5, 5
P_DECIDE, P_STRICT = 3e-4, 1e-4  # at which a set of suspects is refused: ours, and that of sevil.md 9.4
DEG = math.radians(1.0)
UNIT = {"V": 1.0, "beta": DEG, "alpha": DEG}  # sizes of faults are given in m/s and deg
SIGMA_C = (0.39, 0.15 * DEG, 0.15 * DEG)  # virtual sensor: V, beta, alpha
PHASES = ("before", "during", "after")


def conditions(p: dict[str, Any]) -> Conditions:
    """The 3000 s flight of a case: where = solo (no wake), contact or refuelling; air = calm or turbulent."""
    more: dict[str, Any] = {"legs_s": tuple(p.get("legs_s", LONG_LEGS))}
    if p["where"] == "solo":
        more |= {"wake": None}
    if p["where"] in ("solo", "contact"):
        more |= {"observation_m": CONTACT}
    if p["air"] == "calm":
        more |= {"turbulence_mps": 0.0, "wind_mps": (0.0, 0.0, 0.0)}
    return Conditions(**more)


def phases(f: AirFlight) -> dict[str, np.ndarray]:
    """Samples before, during and after the manoeuvre."""
    moving = (f.leg > 0) & (f.leg < len(LEG_NAMES) - 1)
    return {"before": f.leg == 0, "during": moving, "after": f.leg == len(LEG_NAMES) - 1}


class Detectors:
    """The expected readings of a flight, computed once, and every detector on given readings of it."""

    def __init__(self, f: AirFlight, names: tuple[str, ...], model: bool = True, map_att: Arr = m.MAP_ATT) -> None:
        """model False: no wake, hence no expected readings. map_att [3]: attitude the maps are made with."""
        self.names = names
        self.omega = f.omega_m
        self._corrected: tuple[Arr, Arr] | None = None
        self.own = m.expected(f.xi, f.att_m, f.xi_dot, f.omega_m) if model else None
        self.table = m.expected(f.xi, map_att) if model else None

    def corrected(self, Y: Arr) -> Arr:
        """Readings [N,9] without what the measured body rates put on them."""
        if self._corrected is None or self._corrected[0] is not Y:
            self._corrected = Y, correct_rotation(Y, self.omega, m.PROBES)
        return self._corrected[1]

    def run(self, name: str, Y: Arr, v: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(alarm [N] bool, probe [N] by |cos|, probe [N] as printed) of variable v on readings [N,9]."""
        k = slice(3 * v, 3 * v + 3)
        y, s = np.ascontiguousarray(Y[:, k]), m.SIGMA[v]
        own = None if self.own is None else self.own[:, k]
        table = None if self.table is None else self.table[:, k]
        h = metrics.threshold(P_SINGLE)
        if name == "plain":
            res = parity.plain(y, s)
        elif name == "plain_corrected":  # without the body's rotation (5.34 to 5.37)
            res = parity.plain(self.corrected(Y)[:, k], s)
        elif name == "printed":  # equation 5.24 with the expected readings of the maps
            res = parity.plain(y, s) if table is None else parity.multiplicative(y, table, s)
        elif name == "multiplicative":
            res = parity.plain(y, s) if own is None else parity.multiplicative(y, own, s)
        elif name == "additive_table":
            res = parity.plain(y, s) if table is None else parity.additive(y, table, s)
        elif name == "additive":
            res = parity.plain(y, s) if own is None else parity.additive(y, own, s)
        elif name == "windowed":
            res, h = dt.windowed_cleared(y, s, WINDOW, P_WINDOW, own), metrics.threshold(P_WINDOW)
        elif name == "windowed_kept":  # the window keeps its old samples after a fault
            res, h = dt.windowed(y, s, WINDOW, own), metrics.threshold(P_WINDOW)
        elif name == "cusum":
            res = parity.plain(y, s) if own is None else parity.additive(y, own, s)
            c = dt.cusum(res)
            # sums that stop at their cap no longer tell the probes apart: blamed is who crossed the threshold first
            events = dt.cusum(res, reset=True)
            last = np.maximum.accumulate(np.where(events.alarm, np.arange(len(y)), 0))
            return c.alarm, events.probe[last], events.probe[last]
        else:
            raise ValueError(f"detector {name!r}; allowed: {', '.join(NAMES)}")
        return res.gamma > h, isolation.isolate(res.t, res.mu)[0], isolation.isolate_printed(res.t, res.mu)


NAMES = (
    "plain",
    "plain_corrected",
    "printed",
    "multiplicative",
    "additive_table",
    "additive",
    "windowed",
    "windowed_kept",
    "cusum",
)


def fault_figures(
    alarm: np.ndarray, probe: np.ndarray, printed: np.ndarray, fault: Fault, rate: float
) -> dict[str, float]:
    """True and false alarms, isolation and delay of one variable with one fault."""
    first, last = round(fault.start_s * rate), round(fault.stop_s * rate) - 1
    return {
        "tap_pct": metrics.true_alarm_pct(alarm, first, last),
        "fap_fault_pct": metrics.false_alarm_pct(alarm, first, last),
        "isolated_pct": metrics.isolation_pct(alarm, probe, fault.probe, first, last),
        "isolated_printed_pct": metrics.isolation_pct(alarm, printed, fault.probe, first, last),
        "delay_samples": float(metrics.delay(alarm, first)),
    }


def run_table(case: Case, seed: int) -> RunResult:
    """Tables 6.1 to 6.5: false alarms per phase without faults, then the three faults of the source (sign: both)."""
    p = case.params
    f = fly_air(conditions(p), seed)
    d = Detectors(f, tuple(p["detectors"]), p["where"] != "solo")
    parts, values = phases(f), {}
    faults = table_faults(float(p.get("sign", 1.0)))
    wrong = f.readings.copy()
    inject(f.t, wrong, faults)
    traces: dict[str, Any] = {}
    for name in d.names:
        for v, var in enumerate(m.VARIABLES):
            alarm, _, printed = d.run(name, f.readings, v)
            key = f"{name}.{var}"
            values[f"{key}.fap_pct"] = 100.0 * float(alarm.mean())
            if p["where"] == "refuelling":
                values |= {f"{key}.fap_{k}_pct": 100.0 * float(alarm[s].mean()) for k, s in parts.items()}
                hit = printed[parts["after"] & alarm]
                if len(hit):  # isolation as printed: the source's sensor 2 is the left one
                    values[f"{key}.blames_left_printed_pct"] = 100.0 * float(np.mean(hit == 1))
            if p.get("faults", True):
                a, b, c = d.run(name, wrong, v)
                fault = next(x for x in faults if x.variable == v)
                values |= {f"{key}.{k}": x for k, x in fault_figures(a, b, c, fault, 20.0).items()}
    if d.own is not None:  # residual portrait: some samples of each variable, normalised by the known noise
        pick = slice(0, len(f.t), 40)
        own, table = d.own, d.table
        assert table is not None
        for v, var in enumerate(m.VARIABLES):
            k = slice(3 * v, 3 * v + 3)
            y = wrong[pick, k]
            traces[f"additive.{var}"] = parity.additive(y, own[pick, k], m.SIGMA[v]).t
            traces[f"printed.{var}"] = parity.multiplicative(y, table[pick, k], m.SIGMA[v]).t
            fault = next(x for x in faults if x.variable == v)
            traces[f"faulty.{var}"] = (f.t[pick] >= fault.start_s) & (f.t[pick] < fault.stop_s)
        traces |= {"t": f.t[pick], "leg": f.leg[pick]}
    else:
        traces = solo_indices(f.t, wrong, faults)
    return RunResult(values, traces)


def solo_indices(t: Arr, Y: Arr, faults: tuple[Fault, ...]) -> dict[str, Any]:
    """What Figures 6.15 and 6.16 draw, every second of t [N] s from readings Y [N,9] with one fault a variable: "plain.V" [n,2]
    normalised residuals, "angle.V" [n,3] index (5.21), "alarm.V" [n] and "suspect.V" [n] (5.22, probe from 1; 0: no alarm)."""
    pick = slice(0, len(t), 20)
    out: dict[str, Any] = {}
    for v, var in enumerate(m.VARIABLES):
        res = parity.plain(np.ascontiguousarray(Y[pick, 3 * v : 3 * v + 3]), m.SIGMA[v])
        alarm = res.gamma > metrics.threshold(P_SINGLE)
        fault = next(x for x in faults if x.variable == v)
        out |= {f"plain.{var}": res.t, f"angle.{var}": isolation.angle_difference(res.t, res.mu), f"alarm.{var}": alarm}
        out |= {f"suspect.{var}": np.where(alarm, isolation.isolate_printed(res.t, res.mu) + 1, 0)}
        out |= {f"faulty.{var}": (t[pick] >= fault.start_s) & (t[pick] < fault.stop_s)}
    return out | {"t": t[pick]}


def run_position(case: Case, seed: int) -> RunResult:
    """Additive detector told a position with white errors, with and without J P J^T in the test (sevil.md 9.2, last rows)."""
    p = case.params
    f = fly_air(conditions(p), seed)
    sigma = float(p["position_sigma_m"])
    xi = f.xi + sigma * generator(seed, "sevil.position").standard_normal(f.xi.shape)
    e = m.expected(xi, f.att_m, f.xi_dot, f.omega_m)
    S = m.position_covariance(xi, f.att_m, sigma)
    faults = table_faults()
    wrong = f.readings.copy()
    inject(f.t, wrong, faults)
    h = metrics.threshold(P_SINGLE)
    values: dict[str, float] = {}
    for v, var in enumerate(m.VARIABLES):
        k = slice(3 * v, 3 * v + 3)
        fault = next(x for x in faults if x.variable == v)
        for name, cov in (("without", None), ("with_jpj", np.ascontiguousarray(S[:, v]))):
            key = f"{name}.{var}"
            for leg, sel in phases(f).items():
                c = None if cov is None else cov[sel]
                alarm = parity.additive(f.readings[sel, k], e[sel, k], m.SIGMA[v], c).gamma > h
                values[f"{key}.fap_{leg}_pct"] = 100.0 * float(alarm.mean())
            a = parity.additive(wrong[:, k], e[:, k], m.SIGMA[v], cov).gamma > h
            i = round(fault.start_s * 20.0), round(fault.stop_s * 20.0) - 1
            values[f"{key}.tap_pct"] = metrics.true_alarm_pct(a, *i)
    return RunResult(values)


def alarms(res: Residuals, h: float) -> float:
    """Share of alarms [%]."""
    return 100.0 * float(np.mean(res.gamma > h))


def run_sweep(case: Case, seed: int) -> RunResult:
    """A lasting fault of a given size, noise and window at contact, against the noncentral chi-square; and the ROC curve."""
    p = case.params
    legs = (0.0, 0.0, 0.0, 0.0, float(p.get("duration_s", 500.0)))
    f = fly_air(conditions({"where": "contact", "air": "turbulent", "legs_s": legs}), seed)
    e = m.expected(f.xi, f.att_m, f.xi_dot, f.omega_m)
    scale = math.sqrt(float(p.get("noise", 1.0)))
    n = int(p.get("window", 1))
    p_false = float(p.get("p_false", P_SINGLE))
    h = metrics.threshold(p_false)
    values: dict[str, float] = {}
    traces: dict[str, Arr] = {"p_false": np.logspace(-5, 0, 51)}
    for v, var in enumerate(m.VARIABLES):
        k = slice(3 * v, 3 * v + 3)
        s = m.SIGMA[v] * scale
        size = float(p["fault"] if var == "V" else p["fault_deg"]) * UNIT[var]
        y = f.clean[:, k] + (f.readings - f.clean)[:, k] * scale
        quiet = dt.windowed(y, s, n, e[:, k])
        y[:, 1] += size
        res = dt.windowed(y, s, n, e[:, k])
        values[f"{var}.fap_pct"] = alarms(quiet, h)
        values[f"{var}.fap_theory_pct"] = 100.0 * p_false
        values[f"{var}.tap_pct"] = alarms(res, h)
        theory = 100.0 * metrics.detection_probability(size, s, p_false, n)
        values[f"{var}.tap_theory_pct"] = theory
        values[f"{var}.tap_minus_theory_pct"] = values[f"{var}.tap_pct"] - theory
        levels = [metrics.threshold(q) if q < 1.0 else 0.0 for q in traces["p_false"]]
        traces[f"{var}.tap"] = np.array([np.mean(res.gamma > x) for x in levels])
        traces[f"{var}.fap"] = np.array([np.mean(quiet.gamma > x) for x in levels])
        traces[f"{var}.lambda"] = np.array([metrics.noncentrality(size, s, n)])
    return RunResult(values, traces)


def run_two_faults(case: Case, seed: int) -> RunResult:
    """Faults in the same variable, decided with the virtual sensor from independent windows (sevil.md 9.4)."""
    p = case.params
    v, n, N = m.VARIABLES.index(p["variable"]), int(p.get("window", WINDOW)), int(p.get("windows", 20_000))
    size = np.array(p["faults"], dtype=float) * UNIT[p["variable"]]
    g = generator(seed, "sevil.two_faults")
    s = m.SIGMA[v]
    r = size + s / math.sqrt(n) * g.standard_normal((N, 3)) + SIGMA_C[v] * g.standard_normal((N, 1))
    C = np.eye(3) * s**2 / n
    truth = sum(1 << i for i in range(3) if size[i] != 0.0)
    values = {"windows.n": float(N)}
    for name, p_decide in (("virtual", P_DECIDE), ("virtual_strict", P_STRICT)):
        values[f"{name}.correct_pct"] = 100.0 * float(np.mean(two_faults.decide(r, C, SIGMA_C[v], p_decide) == truth))
    if truth:
        # without virtual sensor: at best the single fault that looks the same
        alone = two_faults.decide(r, C, None)
        res = dt.windowed(r, s / math.sqrt(n), 1)
        alarm = res.gamma > metrics.threshold(P_WINDOW)
        printed = 1 << isolation.isolate_printed(res.t, res.mu)
        values["three_probes.correct_pct"] = 100.0 * float(np.mean(alone == truth))
        values["printed.correct_pct"] = 100.0 * float(np.mean(alarm & (printed == truth)))
    return RunResult(values)
