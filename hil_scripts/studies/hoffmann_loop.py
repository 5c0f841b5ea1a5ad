"""Gust load alleviation with the estimator in the loop, and calm air with a filter that adapts to the turbulence."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from flightsw.ctrl.gust import AlleviationParams, GustAlleviation, GustHold
from flightsw.kernels import gust as k
from flightsw.models.gust import GustAircraft
from flightsw.models.gust_servo import GustServos
from flightsw.nav.gust import GustNav, GustParams
from flightsw.nav.gust_constant import ConstantGainGust
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies import hoffmann_flight as hf
from sim_plant.alexis import Alexis, AlexisParams, AlexisServo

Arr = NDArray[np.float64]
BAND_HZ = 2.0
TICK_S = 0.005
BANK = (0.01, 0.1, 0.3, 1.0)


def fly_loop(
    p: dict[str, Any], seed: int, law: GustAlleviation | None, nav: GustNav | ConstantGainGust | None, channels: int
) -> tuple[Arr, Arr, Arr]:
    """a_z [N] m/s^2 at 200 Hz, truth [M,9] and surfaces [M,2] rad at the samples; law None: the hold, nav None: true state."""
    dt, wn = float(p.get("dt_s", 0.02)), float(p.get("servo_wn_radps", 40.0))
    plant = AlexisParams(
        linear=bool(p["linear"]), servo=AlexisServo(wn_radps=wn), lift_factor=float(p.get("lift_factor", 1.0))
    )
    a = Alexis(plant, hf.wind(float(p["scale"])), seed % 2**31, float(p["duration_s"]), dt, round(dt / TICK_S))
    ac = GustAircraft(servo_wn_radps=wn)
    servos, hold = GustServos(ac), GustHold(ac=ac)
    late = np.zeros(3)  # the command computed one sample ago is the one the plant gets now
    n = a.samples - 1
    az, truth, surfaces = np.zeros((n, a.ticks)), np.zeros((n, 9)), np.zeros((n, 2))
    for i in range(n):
        y = a.reading
        if nav is not None:
            nav.step(y, channels & a.fresh, servos.mean, dt, servos.now)
        if law is not None:
            command = law.step(a.truth if nav is None else nav.x, servos).copy()
        else:
            command = hold.step(y[0], y[3], y[4] - ac.H0_m, y[2] - ac.V0_mps).copy()
        servos.send(command)
        a.step(late)
        late = command
        servos.step(dt)
        az[i], truth[i], surfaces[i] = a.vertical, a.truth, a.surfaces
    return az.ravel(), truth, surfaces


def levels(az: Arr) -> tuple[float, float]:
    """RMS of a_z [m/s^2] in total and below 2 Hz (Butterworth of fourth order, both ways), the first 2 s left out."""
    sos = signal.butter(4, BAND_HZ, fs=1.0 / TICK_S, output="sos")
    low = signal.sosfiltfilt(sos, az)
    i = round(hf.DROP_S / TICK_S)
    return float(np.sqrt(np.mean(az[i:] ** 2))), float(np.sqrt(np.mean(low[i:] ** 2)))


def _loops(p: dict[str, Any]) -> dict[str, tuple[dict[str, Any], Any, int]]:
    """Name -> (changes of the law, estimator or None, channels)."""
    scale, dt = float(p["scale"]), float(p.get("dt_s", 0.02))
    ac = GustAircraft(servo_wn_radps=float(p.get("servo_wn_radps", 40.0)))
    basic, both = hf.SENSORS["basic"], hf.SENSORS["vertical"]
    own: dict[str, Any] = {"aircraft": ac, "scales": (scale,)}
    if p["linear"]:
        own |= {"filter": "kalman", "model": "linear"}
    out: dict[str, tuple[dict[str, Any], Any, int]] = {
        "true": ({}, None, basic),
        "default": ({}, GustNav(GustParams(**own)), basic),
        "vertical": ({}, GustNav(GustParams(**own)), both),
    }
    if not p["linear"]:
        out["bank"] = ({}, GustNav(GustParams(**(own | {"scales": BANK}))), basic)
        out["bank_all"] = ({}, GustNav(GustParams(**(own | {"scales": BANK}))), hf.SENSORS["all"])
    if p["linear"] and dt == 0.02:
        out["printed"] = ({}, ConstantGainGust(), basic)
        out["no_wind_columns"] = ({"feed_wind": False}, None, basic)
        out["elevator_only"] = ({"use_flap": False, "H": 50.0, "V_K": 50.0}, GustNav(GustParams(**own)), basic)
    return out


def run_alleviation(case: Case, seed: int) -> RunResult:
    """The same gusts with the hold and with each alleviating loop; reductions of the RMS of a_z in percent."""
    p = case.params
    dt = float(p.get("dt_s", 0.02))
    ac = GustAircraft(servo_wn_radps=float(p.get("servo_wn_radps", 40.0)))
    az, truth, _ = fly_loop(p, seed, None, None, 0)
    total, low = levels(az)
    values = {"hold.a_z_rms_mps2": total, "hold.a_z_low_rms_mps2": low}
    values["hold.height_rms_m"] = float(np.sqrt(np.mean(truth[:, k.H] ** 2)))
    traces: dict[str, NDArray[Any]] = {"t": np.arange(len(az)) * TICK_S, "hold.a_z": az}
    for name, (change, nav, channels) in _loops(p).items():
        law = GustAlleviation(AlleviationParams(wind_triangle=not p["linear"], **change), ac, dt=dt)
        az, truth, surfaces = fly_loop(p, seed, law, nav, channels)
        a, b = levels(az)
        values[f"{name}.a_z_rms_mps2"], values[f"{name}.a_z_low_rms_mps2"] = a, b
        values[f"{name}.reduction_total_pct"] = 100.0 * (1.0 - a / total)
        values[f"{name}.reduction_low_pct"] = 100.0 * (1.0 - b / low)
        values[f"{name}.height_rms_m"] = float(np.sqrt(np.mean(truth[:, k.H] ** 2)))
        values[f"{name}.speed_rms_mps"] = float(np.sqrt(np.mean(truth[:, k.VK] ** 2)))
        values[f"{name}.flap_rms_deg"] = float(np.sqrt(np.mean(surfaces[:, 1] ** 2))) / hf.DEG
        traces[f"{name}.a_z"] = az
    return RunResult(values, traces)


def run_adaptation(case: Case, seed: int) -> RunResult:
    """Error of alpha_W and V_W of fixed and adapting filters, in air as calm or rough as the case says."""
    p = case.params
    T = float(p["duration_s"])
    steps = tuple((float(t), float(f)) for t, f in p.get("steps", ()))
    plan = hf.FlightPlan(
        T, hf.wind(float(p["scale"]), steps=steps), AlexisParams(direct=True), start_sigma=(0.01, 0.01, 0.2, 0.01, 1.0)
    )
    r = hf.fly(plan, seed)
    basic = hf.SENSORS["basic"]
    filters = {
        "medium": (hf.nonlinear(scales=(1.0,)), basic),
        "light": (hf.nonlinear(scales=(hf.LIGHT,)), basic),
        "bank": (hf.nonlinear(scales=BANK), basic),
        "bank_apart": (hf.nonlinear(scales=BANK, mix=False), basic),
        "bank_ground": (hf.nonlinear(scales=BANK), hf.SENSORS["ground"]),
    }
    edges = [0.0, *(t for t, _ in steps if t > 0.0), T + 1.0]
    values: dict[str, float] = {}
    traces: dict[str, Arr] = {"t": r.t, "truth": r.truth}
    for name, (nav, channels) in filters.items():
        track = hf.estimate(nav, r, channels)
        d = track.x - r.truth
        for i, (lo, hi) in enumerate(itertools.pairwise(edges)):
            m = (r.t >= lo + 5.0) & (r.t < hi)
            part = f"part_{i + 1}." if steps else ""
            values[f"{name}.{part}alpha_w.rms_deg"] = float(np.sqrt(np.mean(d[m, k.AW] ** 2))) / hf.DEG
            values[f"{name}.{part}v_w.rms_mps"] = float(np.sqrt(np.mean(d[m, k.VW] ** 2)))
            values[f"{name}.{part}scale"] = float(np.mean(track.scale[m]))
        traces[f"{name}.x"], traces[f"{name}.scale"] = track.x, track.scale
    return RunResult(values, traces)


LOOP: dict[str, Any] = {"linear": True, "scale": hf.LIGHT, "duration_s": 40.0}
ALLEVIATION = Study(
    name="hoffmann_alleviation",
    title="Gust load alleviation",
    purpose="a_z against a pitch and height hold, in total and below 2 Hz, with true and estimated state",
    cases=(
        Case("linear", LOOP),
        Case("linear_servo80", LOOP | {"servo_wn_radps": 80.0}),
        Case("linear_100hz_servo80", LOOP | {"servo_wn_radps": 80.0, "dt_s": 0.01}),
        Case("nonlinear", LOOP | {"linear": False}),
        Case("nonlinear_lift_90pct", LOOP | {"linear": False, "lift_factor": 0.9}),
        Case("nonlinear_lift_110pct", LOOP | {"linear": False, "lift_factor": 1.1}),
    ),
    run=run_alleviation,
    default_runs=16,
)
ADAPTATION = Study(
    name="hoffmann_adaptation",
    title="Turbulence that comes and goes",
    purpose="error in calm, light and changing air of filters of fixed tuning and of a bank over intensity",
    cases=(
        Case("calm", {"scale": 0.0, "duration_s": 40.0}),
        Case("very_light", {"scale": 0.03, "duration_s": 40.0}),
        Case("light", {"scale": 0.3, "duration_s": 40.0}),
        Case(
            "changing",
            {"scale": 0.3, "duration_s": 90.0, "steps": [[0.0, 0.0], [30.0, 1.0], [60.0, 0.0]]},
        ),
    ),
    run=run_adaptation,
    default_runs=20,
)
STUDIES = (ALLEVIATION, ADAPTATION)
