"""Sevil (2013) on the 6-DOF: holds and the approach flown by the mission's own software behind the plant's tanker, the readings
of three probes along that motion, and the printed methods on them: Algorithms 11 and 15 with their maps of one attitude, the
detectors of Tables 6.1 to 6.5.

Only position and attitude come from the flight; the readings are those of the other studies at that motion, so that what
differs from a kinematic track is the trim and the wander of a flown aircraft.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from flightsw.missions.receiver.airdata.contour.algorithms import locate
from flightsw.missions.receiver.airdata.contour.contours import Contours
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.launch.runfolder import resolve
from hil_scripts.studies.sevil import fdi
from hil_scripts.studies.sevil import model as m
from hil_scripts.studies.sevil import track as tk
from hil_scripts.studies.sevil.dynamic import CALM
from hil_scripts.studies.sevil.flight import LEG_NAMES, RATE_HZ, AirFlight, Arr, Conditions, Fault, Motion, fly_air
from hil_scripts.studies.sevil.loop_flight import CONTACT, EVERY, SCENARIO, in_process
from hil_scripts.studies.sevil.wake_map import SPECS, make_map

ALPHA_T = math.radians(3.3)  # incidence of the tanker at 195 m/s, for commands given in F
# [deg] pitch relative to F with which the receiver is trimmed at contact (case hold_contact); maps have 3
TRIM_DEG = 2.087
SETTLE_S = 20.0  # [s] of a hold before it counts
NEAR_M = 0.5  # [m] of error with which a place of the grid counts as found well
PHASE_LEG = {"observation": 0, "moving": 2, "contact": len(LEG_NAMES) - 1}
# [s] command to leave the observation position; at contact before it counts as after the manoeuvre
MANOEUVRE_S = (60.0, 60.0)
LONG_S = (670.0, 2330.0)  # [s] at observation, and after it, of the print's 3000 s
STILL = (
    "plant.noise.scale=0.0", "plant.noise.bias_scale=0.0", "plant.wind.prevailing='constant'",
    "plant.wind.constant_mps=[0.0,0.0]",
    "plant.aircraft.tanker.aero_error_frac=0.0", "plant.aircraft.receiver.aero_error_frac=0.0",
    "receiver.integrity.on=false", "tanker.guid.first_leg_s=1e6",
    # without noise a roll of the wake that grows as it is crossed looks like an aileron that stands still
    "receiver.recovery.on=false",
)  # fmt: skip


def _dcm(e: Arr) -> Arr:
    """Navigation to body [N,3,3] of psi, theta, phi [N,3]."""
    (cs, ct, cf), (ss, st, sf) = np.cos(e).T, np.sin(e).T
    rows = [
        [ct * cs, ct * ss, -st],
        [sf * st * cs - cf * ss, sf * st * ss + cf * cs, sf * ct],
        [cf * st * cs + sf * ss, cf * st * ss - sf * cs, cf * ct],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def in_f(lead: Arr, own: Arr, xi_t: Arr) -> tuple[Arr, Arr]:
    """Position and attitude in F [N,3] from the tanker's rows `lead` [N,5] (psi, theta, phi, alpha, beta), own Euler angles [N,3]
    and position in the tanker's body axes [N,3]."""
    ca, sa, cb, sb = np.cos(lead[:, 3]), np.sin(lead[:, 3]), np.cos(lead[:, 4]), np.sin(lead[:, 4])
    zero = np.zeros_like(ca)
    bf = np.moveaxis(np.array([[ca * cb, sb, sa * cb], [-ca * sb, cb, -sa * sb], [-sa, zero, ca]]), -1, 0)  # body to F
    xi = np.einsum("nij,nj->ni", bf, xi_t)
    r = np.einsum("nij,nkj->nik", _dcm(own), np.einsum("nij,njk->nik", bf, _dcm(lead[:, :3])))  # F to own body
    att = np.stack(
        [np.arctan2(r[:, 0, 1], r[:, 0, 0]), -np.arcsin(r[:, 0, 2]), np.arctan2(r[:, 1, 2], r[:, 2, 2])], axis=1
    )
    return xi, att


def body(y: float, z: float, x: float = m.CONTACT_X) -> list[float]:
    """A place given in F, in the tanker's body axes [m]."""
    c, s = math.cos(ALPHA_T), math.sin(ALPHA_T)
    return [c * x - s * z, y, s * x + c * z]


def fly(sets: tuple[str, ...], duration_s: float, seed: int, gust: float = 0.0, orders: bool = True) -> Motion:
    """Fly the scenario with overrides; gust: turbulence [m/s]; orders: with the scenario's events, up to the disconnect. Raises
    ConfigError for a bad setting."""
    plan = resolve(SCENARIO, seed % 2**31, [*STILL, f"plant.wind.dryden.sigma_mps={gust}", *sets], duration_s)
    events = [e for e in plan.scenario["event"] if orders and e["action"] != "disconnect"]
    plan = replace(plan, scenario={**plan.scenario, "event": events})
    rows: list[list[float]] = []
    with in_process(plan) as flight:
        server = flight.server
        while not server.done:
            if server.tick % EVERY == 0:
                lead, own = server.world.truth(0), server.world.truth(1)
                app: Any = flight.nodes[1].app
                rows.append(
                    [
                        server.t_us * 1e-6,
                        app.guid.phase,
                        *lead.euler,
                        lead.alpha,
                        lead.beta,
                        *own.euler,
                        *own.xi,
                        *own.w_b,
                    ]
                )
            flight.tick()
    a = np.array(rows)
    t, phase = a[:, 0], a[:, 1]
    xi, att = in_f(a[:, 2:7], a[:, 7:10], a[:, 10:13])
    left = t >= MANOEUVRE_S[0]
    there = phase == CONTACT
    since = float(t[there][0]) + MANOEUVRE_S[1] if there.any() else math.inf
    leg = np.where(t >= since, PHASE_LEG["contact"], np.where(left, PHASE_LEG["moving"], PHASE_LEG["observation"]))
    xi_dot = np.gradient(xi, 1.0 / RATE_HZ, axis=0)
    return Motion(t, leg.astype(np.int8), xi, xi_dot, np.gradient(xi_dot, 1.0 / RATE_HZ, axis=0), att, a[:, 13:16])


def hold(y: float, z: float, duration_s: float, seed: int) -> Motion:
    """Hold at (y, z) [m] of F, x as in the maps."""
    at = body(y, z)
    sets = (f"plant.aircraft.receiver.start.xi_m={at}", f"receiver.guid.observation_m={at}")
    return fly(sets, duration_s, seed, orders=False)


@cache
def trimmed() -> Contours:
    """Contours of the small map made with the attitude trimmed at contact."""
    return Contours(make_map(replace(SPECS["small"], theta_deg=TRIM_DEG)))


def seconds_found(f: AirFlight, name: str) -> tuple[np.ndarray, Arr]:
    """(samples [k], places y, z [k,2] m) an algorithm, called as in contour_figures, finds on 1 s means; NaN: none."""
    at, y, _, _ = tk.seconds(f)
    number, _, maps = name[1:].partition("_")
    contours = trimmed() if maps else m.contours("small")
    return at, np.array([locate(int(number), contours, row) or (math.nan, math.nan) for row in y])


def contour_figures(f: AirFlight, name: str) -> tuple[dict[str, float], dict[str, Arr]]:
    """Errors of an algorithm ("A11", or "A11_trim" with maps of the trimmed attitude) on 1 s means once a hold has settled, and
    its positions."""
    at, pos = seconds_found(f, name)
    late = f.t[at] >= SETTLE_S
    e = (pos - f.xi[at, 1:])[late]
    values = {f"{name}.{k}": v for k, v in tk.errors(e).items()}
    for i, axis in enumerate("yz"):
        v = e[np.isfinite(e[:, i]), i]
        values[f"{name}.mean_m.{axis}"] = float(v.mean()) if len(v) else math.nan
    return values, {f"{name}.position": pos, "second": f.t[at]}


def run_hold(case: Case, seed: int) -> RunResult:
    """Algorithms 11 and 15 at a place held in calm air without noise, and the attitude it is held with."""
    p = case.params
    motion = hold(float(p["y_m"]), float(p["z_m"]), float(p["duration_s"]), seed)
    f = fly_air(Conditions(**CALM, sigma=(0.0, 0.0, 0.0)), seed, motion)
    late = f.t >= SETTLE_S
    values = {
        f"attitude.{k}_deg": float(np.degrees(f.att[late, i].mean())) for i, k in enumerate(("psi", "theta", "phi"))
    }
    values |= {f"place.mean_m.{a}": float(f.xi[late, i].mean()) for i, a in enumerate("xyz")}
    traces: dict[str, Any] = {"t": f.t[::4], "true": f.xi[::4, 1:], "att": f.att[::4]}
    for name in ("A11", "A15", "A11_trim", "A15_trim"):
        v, tr = contour_figures(f, name)
        values, traces = values | v, traces | tr
    return RunResult(values, traces)


def run_row(case: Case, seed: int) -> RunResult:
    """Algorithm 11 at every place of a row of the dynamic grid, one short hold each: with the print's maps (A11) and with maps of
    the trim at contact (A11_trim). Traces: grid [n,6], place and error of both, y, z each [m], NaN where none is found."""
    p = case.params
    names = ("A11", "A11_trim")
    z, rows = float(p["z_m"]), []
    found: dict[str, list[float]] = {n: [] for n in names}
    for y in p["y_m"]:
        motion = hold(float(y), z, float(p["duration_s"]), seed)
        f = fly_air(Conditions(**CALM, sigma=(0.0, 0.0, 0.0)), seed, motion)
        row = [float(y), z]
        for name in names:
            v, _ = contour_figures(f, name)
            have = v[f"{name}.available_pct"] >= 50.0
            found[name] += [v[f"{name}.median_m"]] if have else []
            row += [v[f"{name}.mean_m.{a}"] if have else math.nan for a in "yz"]
        rows.append(row)
    n = len(rows)
    values = {"points": float(n)}
    for name, errors in found.items():
        values |= {f"{name}.none_pct": 100.0 * (1.0 - len(errors) / n), f"{name}.ce_m": float(sum(errors))}
        values |= {f"{name}.near_pct": 100.0 * sum(e < NEAR_M for e in errors) / n}
    return RunResult(values, {"grid": np.array(rows)})


def run_tables(case: Case, seed: int) -> RunResult:
    """False alarms before, during and after the manoeuvre of a flown approach and over the print's 3000 s, true alarms at
    contact; detectors as printed and ours."""
    p = case.params
    rough = bool(p["rough"])
    motion = _approach(rough, seed)
    c = Conditions() if rough else Conditions(turbulence_mps=0.0, wind_mps=(0.0, 0.0, 0.0))
    values: dict[str, float] = {}
    alarms: dict[str, list[np.ndarray]] = {}
    faulty: dict[str, list[np.ndarray]] = {}
    parts: dict[str, np.ndarray] = {}
    for draw in range(int(p["draws"])):
        f = fly_air(c, seed + draw, motion)
        kinds = dict.fromkeys(p["detectors"], fdi.Detectors(f, tuple(p["detectors"])))
        kinds["printed_trim"] = fdi.Detectors(f, ("printed",), map_att=np.array([0.0, math.radians(TRIM_DEG), 0.0]))
        parts = fdi.phases(f)
        wrong = f.readings.copy()
        end = float(f.t[-1]) + 1.0
        fdi.inject(f.t, wrong, tuple(Fault(v, i, s, 0.0, end) for v, i, s in FAULTS))
        for name, d in kinds.items():
            kind = name.removesuffix("_trim")
            for v, var in enumerate(m.VARIABLES):
                alarms.setdefault(f"{name}.{var}", []).append(d.run(kind, f.readings, v)[0])
                faulty.setdefault(f"{name}.{var}", []).append(d.run(kind, wrong, v)[0][parts["after"]])
    moving = float(parts["during"].sum()) / RATE_HZ
    weights = {"before": LONG_S[0], "during": moving, "after": LONG_S[1] - moving}
    for key, found in alarms.items():
        share = {k: 100.0 * float(np.mean([a[s].mean() for a in found])) for k, s in parts.items()}
        values |= {f"{key}.fap_{k}_pct": v for k, v in share.items()}
        values[f"{key}.fap_pct"] = sum(weights[k] * share[k] for k in weights) / sum(LONG_S)
        values[f"{key}.tap_pct"] = 100.0 * float(np.mean([a.mean() for a in faulty[key]]))
    # Figure 6.14 has neither noise nor turbulence
    placed, places = _positions(motion, c if rough else Conditions(**CALM, sigma=(0.0, 0.0, 0.0)), seed)
    values |= placed
    for k, s in parts.items():
        for i, a in enumerate(("psi", "theta", "phi")):
            values[f"attitude.{a}.{k}_deg"] = float(np.degrees(motion.att[s, i].mean()))
    traces: dict[str, Arr] = {"t": motion.t[::4], "true": motion.xi[::4, 1:], "att": motion.att[::4]}
    return RunResult(values, traces | places)


def _positions(motion: Motion, c: Conditions, seed: int) -> tuple[dict[str, float], dict[str, Arr]]:
    """Where Algorithm 11 finds the receiver on the approach (Figure 6.14): share found before, during, after the manoeuvre and
    median error, with the print's maps and those of the trim; and the positions."""
    f = fly_air(c, seed, motion)
    values: dict[str, float] = {}
    traces: dict[str, Arr] = {}
    for name in ("A11", "A11_trim"):
        at, found = seconds_found(f, name)
        e = np.hypot(*(found - f.xi[at, 1:]).T)
        for k, s in fdi.phases(f).items():
            of = e[s[at]]
            values[f"{name}.available_{k}_pct"] = 100.0 * float(np.isfinite(of).mean())
            values[f"{name}.median_{k}_m"] = float(np.nanmedian(of)) if np.isfinite(of).any() else math.nan
        traces |= {f"{name}.position": found, "second": f.t[at]}
    return values, traces


@cache
def _approach(rough: bool, seed: int) -> Motion:
    return fly((), 480.0, seed, m.LIGHT if rough else 0.0)


FAULTS = ((0, 1, 3.0), (1, 0, math.radians(1.0)), (2, 2, math.radians(1.0)))  # variable, probe, size: as in the print
_NAMES = ("plain", "printed", "additive", "windowed")
GRID = tuple(float(v) for v in np.linspace(-2.0, 2.0, 21))


def _run(case: Case, seed: int) -> RunResult:
    kind = case.name.partition("_")[0]
    return {"hold": run_hold, "tables": run_tables, "grid": run_row}[kind](case, seed)


STUDY = Study(
    name="sevil_six_dof",
    title="The printed methods on the 6-DOF",
    purpose="holds, dynamic grid and approach flown by the mission's software: Algorithms 11 and 15 with maps of one attitude, "
    "and the printed tables of fault detection",
    cases=(
        Case("hold_contact", {"y_m": 0.0, "z_m": 8.5, "duration_s": 80.0}),
        Case("hold_left", {"y_m": -0.5, "z_m": 9.5, "duration_s": 80.0}),
        Case("hold_right", {"y_m": 0.5, "z_m": 6.5, "duration_s": 80.0}),
        Case("tables_calm", {"rough": False, "draws": 5, "detectors": list(_NAMES)}),
        Case("tables", {"rough": True, "draws": 5, "detectors": list(_NAMES)}),
        *(Case(f"grid_{i:02d}", {"y_m": list(GRID), "z_m": 8.5 + z, "duration_s": 40.0}) for i, z in enumerate(GRID)),
    ),
    run=_run,
    default_runs=3,
    small_cases=("hold_*", "tables*"),
)
