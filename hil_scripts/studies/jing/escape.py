"""Does the aircraft survive: escape laws in the two named microbursts, over drawn ones, and what turbulence does to alerting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from flightsw.missions.windshear import dynamics as k
from flightsw.missions.windshear.estimator import WindshearParams
from flightsw.missions.windshear.guidance import WindshearGuidanceParams
from flightsw.missions.windshear.hazard import HazardParams
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.jing import flight as jf
from hil_scripts.studies.jing import sensors
from hil_scripts.studies.jing.draw import CLASSES, LIGHT, air, class_of, draw
from hil_scripts.studies.jing.study import AS_SPECIFIED, LAWS, estimator, law
from sim_plant.aircraft.twinjet.flight import TwinJetAir, TwinJetParams
from sim_plant.wind.microburst import MICROBURSTS

NEAR_GROUND_M = 15.0  # F is classed above this: the slope of the wind at touchdown is not the encounter
PAST_M = 3000.0
CLOSE_M = 10.0  # a centre of gravity below this has survived on paper only
# alerting of the flight: estimator, and guidance around the law (the two crossed ones tell what either of them does)
ALERTING: dict[str, tuple[str, WindshearGuidanceParams]] = {
    "as_specified": ("ekf13", AS_SPECIFIED),
    "pair": ("ekf15", WindshearGuidanceParams()),
    "default_quick": ("ekf15", WindshearGuidanceParams(hazard=HazardParams(abort_on="caution"))),
    "source_pair": ("ekf13", replace(AS_SPECIFIED, hazard=replace(AS_SPECIFIED.hazard, abort_on="abort"))),
}


def run_escape(case: Case, seed: int) -> RunResult:
    """Every law against one microburst from one height, with perfect state and with the filter in the loop."""
    p = case.params
    out: dict[str, float] = {}
    traces: dict[str, Any] = {}
    base = AS_SPECIFIED if p["alerting"] == "as_specified" else WindshearGuidanceParams()
    sky = air(MICROBURSTS[p["burst"]], LIGHT if p.get("turbulence") else (0.0, 0.0))
    for name in LAWS:
        if name == "continue":
            continue
        for state in ("perfect", "ekf15"):
            if state == "perfect" and p.get("turbulence"):
                continue
            plant = TwinJetParams(height_m=float(p["height_m"]))
            r = jf.fly(jf.FlightPlan(sky, plant, estimator(state), law(name, base)), seed)
            got = jf.flown(r)
            out |= {f"{name}.{state}.{key}": v for key, v in got.items()}
            traces |= jf.traces(r, f"{name}.{state}.", 10) if state == "ekf15" else {}
    return RunResult(out, traces)


def run_survival(case: Case, seed: int) -> RunResult:
    """One drawn microburst, one flight up to the alert, and from there on every law of the case on the same luck.

    Classes are by the peak F of the continued approach with perfect state in still air apart from the microburst.
    """
    p = case.params
    burst, plant = draw(seed)
    still = jf.FlightPlan(TwinJetAir(burst), plant, None, law("continue"), duration_s=95.0)
    went_on = jf.fly(still, seed)
    m = (went_on.truth[:, k.X] < PAST_M) & (went_on.truth[:, k.H] > NEAR_GROUND_M)
    peak = float(went_on.F[m].max())
    of = class_of(peak)
    base = AS_SPECIFIED if p["alerting"] == "as_specified" else WindshearGuidanceParams()
    nav = WindshearParams() if p["state"] == "ekf15" else None
    sky = air(burst, (float(p["sigma_u_mps"]), float(p["sigma_w_mps"])))
    plan = jf.FlightPlan(sky, plant, nav, law("managed", base), duration_s=110.0, clear_s=3.0)
    trunk = jf.Loop(plan, seed % 2**31)
    trunk.run(to_abort=True)
    values: dict[str, float] = {"peak_F": peak, **{f"class.{c}": float(c == of) for c, _, _ in CLASSES}}
    if nav is None:  # the reference row: a landing counts as contact
        values["continue.survived"] = values[f"continue.{of}.survived"] = 1.0 - went_on.lost
    survived: dict[str, float] = {}
    for name in p["laws"]:
        r = trunk.branch(law(name, base)).run()
        got = jf.flown(r)
        survived[name] = 1.0 - got["lost"]
        values[f"{name}.survived"] = values[f"{name}.{of}.survived"] = survived[name]
        values[f"{name}.close"] = float(not r.lost and got["height_min_m"] < CLOSE_M)
        values |= {f"{name}.{key}": got[key] for key in ("height_min_m", "speed_min_mps") if not r.lost}
        if name == p["laws"][0] and "abort_x_m" in got:
            values["abort_x_m"] = got["abort_x_m"]
    if {"managed", "pitch_15"} <= set(survived):
        values["managed_less_pitch_15"] = survived["managed"] - survived["pitch_15"]
    return RunResult(values)


def run_alerts(case: Case, seed: int) -> RunResult:
    """An approach in turbulence without a microburst: cautions and false aborts; or with one: where they come.

    The alerting of jing.md 6.4 reads the source's filter (13 states, no turbulence), the pair reads the default one; crossed,
    the quick abort reads the default one and the pair the source's.
    """
    p = case.params
    sigma = float(p["sigma_mps"])
    name, base = ALERTING[p["alerting"]]
    nav = estimator(name)
    sky = air(MICROBURSTS[p["burst"]], (sigma, sigma))
    plan = jf.FlightPlan(sky, guidance=law("managed", base), nav=nav, duration_s=float(p["duration_s"]))
    r = jf.fly(plan, seed)
    got = jf.flown(r)
    values = {key: v for key, v in got.items() if key.startswith(("abort", "caution"))}
    values["caution_share"] = float(np.mean(r.phase == 1))
    values["quick_max"], values["slow_max"] = float(r.quick.max()), float(r.slow.max())
    d = r.x - r.truth
    values["w_x.rms_mps"] = float(np.sqrt(np.mean(d[:, k.WX] ** 2)))
    values["w_h.rms_mps"] = float(np.sqrt(np.mean(d[:, k.WH] ** 2)))
    values["nis_over_m"] = float(np.nanmean(r.nis))
    return RunResult(values, jf.traces(r))


ESCAPE = Study(
    name="jing_escape",
    title="Escape laws in the named microbursts",
    purpose="least height and airspeed per law, microburst and start height, with perfect state and with the filter",
    cases=tuple(
        Case(f"{burst}_{h:.0f}{tag}", {"burst": burst, "height_m": h, "alerting": alerting, **more})
        for burst in ("seed", "severe")
        for h in (300.0, 350.0)
        for tag, alerting, more in (
            ("", "as_specified", {}),
            ("_pair_light", "pair", {"turbulence": True}),
        )
    ),
    run=run_escape,
    default_runs=4,
    binary=("lost", "aborted", "cautioned"),
)
FEW = ["managed", "managed_45", "pitch_15", "pitch_10", "climb_5"]
MANY = [*FEW, "pitch_12", "climb_0", "open_loop"]
SURVIVAL = Study(
    name="jing_survival",
    title="Survival over drawn microbursts",
    purpose="share of encounters without ground contact per law and class of peak F: filter in the loop, light turbulence, "
    "caution and abort pair; and perfect state in still air with the quick abort, as in the reference figures",
    cases=(
        Case(
            "light",
            {"state": "ekf15", "alerting": "pair", "sigma_u_mps": LIGHT[0], "sigma_w_mps": LIGHT[1], "laws": FEW},
        ),
        Case(
            "perfect",
            {"state": "perfect", "alerting": "as_specified", "sigma_u_mps": 0.0, "sigma_w_mps": 0.0, "laws": MANY},
        ),
    ),
    run=run_survival,
    default_runs=500,
    small_runs=20,
    binary=("survived", "close", *(c for c, _, _ in CLASSES)),
)
ALERTS = Study(
    name="jing_alerts",
    title="Cautions, aborts and turbulence",
    purpose="approaches without a microburst: false alarms per turbulence; with the source's: where the alarms come",
    cases=tuple(
        Case(
            f"{name}_{sigma:g}{tag}".replace(".", "p"),
            {"sigma_mps": sigma, "burst": burst, "alerting": alerting, "duration_s": T},
        )
        for name, burst, T in (("clear", "none", 62.0), ("seed", "seed", 75.0))
        for sigma in ((0.5, 1.0, 1.5) if name == "clear" else (0.0, 1.0))
        for tag, alerting in (
            ("", "pair"),
            ("_quick", "as_specified"),
            *((("_default_quick", "default_quick"), ("_source_pair", "source_pair")) if sigma == 1.5 else ()),
        )
    ),
    run=run_alerts,
    default_runs=50,
    binary=("aborted", "cautioned"),
)
STUDIES = (ESCAPE, SURVIVAL, ALERTS, sensors.STUDY)
