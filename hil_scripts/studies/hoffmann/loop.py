"""Gust load alleviation with the estimator in the loop, and calm air with a filter that adapts to the turbulence."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.estimate import GustParams
from flightsw.missions.gust.estimator import GustNav
from flightsw.missions.gust.estimator_printed import ConstantGainGust
from flightsw.missions.gust.law import AlleviationParams, GustAlleviation, GustHold
from flightsw.missions.gust.model import GustAircraft, published
from flightsw.missions.gust.servos import GustServos
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.hoffmann import flight as hf
from sim_plant.aircraft.alexis.flight import Alexis, AlexisParams, AlexisServo

Arr = NDArray[np.float64]
BAND_HZ = 2.0
TICK_S = 0.005
BANK = (0.01, 0.1, 0.3, 1.0)


Pilot = Callable[[Alexis, GustServos], Arr]  # command [3] for the readings (or the truth) of this sample


def held(ac: GustAircraft) -> Pilot:
    """The pitch and height hold every loop is compared with."""
    hold = GustHold(ac=ac)
    return lambda a, servos: hold.step(a.reading[0], a.reading[3], a.reading[4] - ac.H0_m, a.reading[2] - ac.V0_mps)


def alleviated(law: GustAlleviation, nav: GustNav | ConstantGainGust | None, channels: int) -> Pilot:
    """`law` on the estimate of `nav` from the readings of `channels`; nav None: on the true state."""

    def pilot(a: Alexis, servos: GustServos) -> Arr:
        """Surfaces [2] rad of the law at a sample."""
        if nav is None:
            return law.step(a.truth, servos)
        nav.step(a.reading, channels & a.fresh, servos.mean, a.dt, servos.now)
        return law.step(nav.x, servos)

    return pilot


def _servo(p: dict[str, Any]) -> float:
    """Natural frequency of the case's servos [rad/s], default the aircraft's own."""
    return float(p.get("servo_wn_radps", published().servo_wn_radps))


def fly_loop(p: dict[str, Any], seed: int, ac: GustAircraft, pilot: Pilot) -> tuple[Arr, Arr, Arr]:
    """a_z [N] m/s^2 at 200 Hz, truth [M,9] and surfaces [M,2] rad at the samples of a flight with `pilot`, who believes `ac`."""
    dt = float(p.get("dt_s", 0.02))
    plant = AlexisParams(
        linear=bool(p["linear"]),
        servo=AlexisServo(wn_radps=_servo(p)),
        lift_factor=float(p.get("lift_factor", 1.0)),
        moment_factor=float(p.get("moment_factor", 1.0)),
    )
    a = Alexis(plant, hf.wind(float(p["scale"])), seed % 2**31, float(p["duration_s"]), dt, round(dt / TICK_S))
    servos = GustServos(ac)
    # a command computed at one sample reaches the servos at the next, which the pilot knows, or later, which he does not
    way = [np.zeros(3)] * (1 + int(p.get("extra_late_samples", 0)))
    n = a.samples - 1
    az, truth, surfaces = np.zeros((n, a.ticks)), np.zeros((n, 9)), np.zeros((n, 2))
    for i in range(n):
        command = pilot(a, servos).copy()
        servos.send(command)
        way.append(command)
        a.step(way.pop(0))
        servos.step(dt)
        az[i], truth[i], surfaces[i] = a.vertical, a.truth, a.surfaces
    return az.ravel(), truth, surfaces


def levels(az: Arr) -> tuple[float, float]:
    """RMS of a_z [m/s^2] in total and below 2 Hz (Butterworth of fourth order, both ways), the first 2 s left out."""
    from scipy import signal  # slow to import: not for every list of studies

    sos = signal.butter(4, BAND_HZ, fs=1.0 / TICK_S, output="sos")
    low = signal.sosfiltfilt(sos, az)
    i = round(hf.DROP_S / TICK_S)
    return float(np.sqrt(np.mean(az[i:] ** 2))), float(np.sqrt(np.mean(low[i:] ** 2)))


def compared(p: dict[str, Any], seed: int, ac: GustAircraft, pilots: Mapping[str, Pilot]) -> RunResult:
    """The same gusts with the hold and with each pilot; reductions of the RMS of a_z against the hold in percent."""
    values: dict[str, float] = {}
    traces: dict[str, NDArray[Any]] = {}
    for name, pilot in {"hold": held(ac), **pilots}.items():
        az, truth, surfaces = fly_loop(p, seed, ac, pilot)
        total, low = levels(az)
        values[f"{name}.a_z_rms_mps2"], values[f"{name}.a_z_low_rms_mps2"] = total, low
        if name != "hold":
            values[f"{name}.reduction_total_pct"] = 100.0 * (1.0 - total / values["hold.a_z_rms_mps2"])
            values[f"{name}.reduction_low_pct"] = 100.0 * (1.0 - low / values["hold.a_z_low_rms_mps2"])
        values[f"{name}.height_rms_m"] = float(np.sqrt(np.mean(truth[:, k.H] ** 2)))
        values[f"{name}.speed_rms_mps"] = float(np.sqrt(np.mean(truth[:, k.VK] ** 2)))
        values[f"{name}.flap_rms_deg"] = float(np.sqrt(np.mean(surfaces[:, 1] ** 2))) / hf.DEG
        traces[f"{name}.a_z"] = az
    return RunResult(values, {"t": np.arange(len(az)) * TICK_S} | traces)


BAND_ALONE = {"a_z": 1e3}  # a_z counts below the low-pass only
ELEVATOR: dict[str, Any] = {"use_flap": False, "H": 50.0, "V_K": 50.0}
ELEVATOR_TOTAL = ELEVATOR | {"a_z_low": 1e3}  # weights that do best in total with the elevator alone


def _loops(p: dict[str, Any], ac: GustAircraft) -> dict[str, tuple[dict[str, Any], Any, int]]:
    """Name -> (changes of the law, estimator or None, channels). What tells the discrete filter from the printed gain is taken
    one by one: readings joined (printed_joined), consistency (tuned_1: told the intensity the print is made for), the
    intensity known (default) or found (bank)."""
    basic, both = hf.SENSORS["basic"], hf.SENSORS["vertical"]
    own: dict[str, Any] = {"aircraft": ac}
    if p["linear"]:
        own |= {"filter": "kalman", "model": "linear"}

    def nav(*scales: float) -> GustNav:
        return GustNav(GustParams(scales=scales or (float(p["scale"]),), **own))

    out: dict[str, tuple[dict[str, Any], Any, int]] = {
        "true": ({}, None, basic),
        "default": ({}, nav(), basic),
        "vertical": ({}, nav(), both),
        "bank": ({}, nav(*BANK), basic),
        "tuned_1": ({}, nav(1.0), basic),
        "printed": ({}, ConstantGainGust(), basic),
        "printed_joined": ({}, ConstantGainGust(join=True), basic),
    }
    if not p["linear"]:
        out["bank_all"] = ({}, nav(*BANK), hf.SENSORS["all"])
    if p.get("laws"):
        out |= {
            "no_wind_columns": ({"feed_wind": False}, None, basic),
            "band_alone": (BAND_ALONE, nav(), basic),
            "elevator_only": (ELEVATOR, nav(), basic),
            "elevator_total_true": (ELEVATOR_TOTAL, None, basic),
            "elevator_total": (ELEVATOR_TOTAL, nav(), basic),
            "elevator_total_printed": (ELEVATOR_TOTAL, ConstantGainGust(), basic),
        }
    return out


def run_alleviation(case: Case, seed: int) -> RunResult:
    """The same gusts with the hold and with each alleviating loop; reductions of the RMS of a_z in percent."""
    p = case.params
    ac = replace(published(), servo_wn_radps=_servo(p))
    pilots = {}
    for name, (change, nav, channels) in _loops(p, ac).items():
        law = GustAlleviation(
            AlleviationParams(wind_triangle=not p["linear"], **change), ac, dt=float(p.get("dt_s", 0.02))
        )
        pilots[name] = alleviated(law, nav, channels)
    return compared(p, seed, ac, pilots)


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
        "matched": (hf.nonlinear(scales=(BANK[0],)), basic),
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
        Case("linear", LOOP | {"laws": True}),
        Case("linear_servo80", LOOP | {"servo_wn_radps": 80.0}),
        Case("linear_100hz_servo80", LOOP | {"servo_wn_radps": 80.0, "dt_s": 0.01}),
        Case("nonlinear", LOOP | {"linear": False}),
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
