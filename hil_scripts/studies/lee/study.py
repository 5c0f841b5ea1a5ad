"""Lee (2011): tanker state and wind estimation. Every filter of a run sees the same flight and the same noise.

Cases as in the source: I flight wind, small noise; II wind model, small; III wind model, large; IV flight wind, large. The
flight-test wind of cases I and IV is not published: a measured radiosonde ascent with slow variation stands in for it; the
cases ending in _sine use the smooth substitute about the source's wind speed, so that percentages can be compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flightsw.sixdof.estimator_core import NavParams
from flightsw.sixdof.layout import RATE
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee import flight as fl
from hil_scripts.studies.lee.filters import calculated_wind, consistency, run, wind_figures
from hil_scripts.studies.lee.limit import wind_bound

# the onboard model is exact in these cases: process noise is that of the wind alone
EXACT: dict[str, Any] = {
    "q_V": 1e-3, "q_beta": 1e-5, "q_alpha": 1e-5, "q_rate": 1e-4, "q_euler": 1e-5, "q_pos": 1e-3, "q_wind": 0.33,
    "bias_V": 0.0, "bias_flow": 0.0, "bias_att": 0.0, "bias_vel": 0.0, "settle_s": 0.0,
}  # fmt: skip
LIGHT = 0.39  # [m/s]
DRAWN = ("default", "printed")  # filters whose states are kept for the pictures
SLOW = {"sounding": 0.245, "sine": 0.3, "ecwm": 0.149}  # [m/s/sqrt(s)] of the prevailing wind


def sensor_params(s: np.ndarray) -> dict[str, float]:
    """NavParams entries of channel sigmas s [15]."""
    keys = {"r_V": 0, "r_beta": 1, "r_alpha": 2, "r_rate": 3, "r_euler": 6, "r_pos": 9, "r_vel": 12}
    return {k: float(s[i]) for k, i in keys.items()}


def filters(s: np.ndarray, wind: str, tau_s: float, gust: float = LIGHT) -> dict[str, NavParams]:
    """The estimators compared, by name, for channel sigmas s [15], wind model, noise colour [s] and turbulence [m/s]."""
    scale = max(gust, 0.05) / LIGHT
    base = {**EXACT, **sensor_params(s), "q_wind": EXACT["q_wind"] * scale}
    gusts: dict[str, Any] = {"wind_model": "dryden", "gust_sigma": max(gust, 0.05), "q_slow": SLOW[wind]}
    q = base["q_wind"]
    # a wind that walks moves V, beta and alpha, which the source's equations do not say: their Q goes with the wind's
    walks: dict[str, Any] = {
        "velocity": False,
        "correlated_wind": False,
        "q_V": q,
        "q_beta": q / 190.0,
        "q_alpha": q / 190.0,
    }
    printed = base | walks | {"cmw": True, "filter": "srukf_printed"}
    ours: dict[str, Any] = {**base, **gusts, "state_form": "velocity"}
    out: dict[str, dict[str, Any]] = {"default": ours, "printed": printed}
    if tau_s > 0.0:
        out["default"] = ours | {"colour_tau_s": tau_s, "colour": "augmented"}
        out["coloured_wind_form"] = out["default"] | {"state_form": "wind"}
        out["coloured_scaled"] = {**base, **gusts, "colour_tau_s": tau_s, "colour": "scaled"}
        out["coloured_removed"] = {**base, "colour_tau_s": tau_s, "colour": "removed"}
        out["ignored"] = {**base, **gusts}
        # the source removes the colour; its wind is the calculated one, so that is kept as well
        out["printed"] = out["coloured_removed"] | walks
    else:
        out["random_walk"] = base
        out["no_velocity"] = {**base, **gusts, "velocity": False}
    return {k: NavParams(**v) for k, v in out.items()}


def no_aero_filters(s: np.ndarray, wind: str) -> dict[str, NavParams]:
    """Estimators without an aerodynamic model (Lee, chapter 5), the hybrid, and the printed one."""
    differenced = float(s[3]) * np.sqrt(2.0 / fl.DT)  # the differenced gyro's noise as process noise
    base: dict[str, Any] = {**EXACT, **sensor_params(s), "q_V": 0.05, "q_beta": 3e-4, "q_alpha": 3e-4}
    gusts: dict[str, Any] = {"wind_model": "dryden", "gust_sigma": LIGHT, "q_slow": SLOW[wind]}
    inertial: dict[str, Any] = {**base, "model": "inertial", "q_rate": differenced}
    q = EXACT["q_wind"]
    printed: dict[str, Any] = inertial | {
        "q_V": q, "q_beta": q / 190.0, "q_alpha": q / 190.0, "velocity": False, "cmw": True, "correlated_wind": False,
        "filter": "srukf_printed",
    }  # fmt: skip
    # what drives V, beta, alpha is the accelerometer's own noise; the moments of the hybrid are exact here
    felt = fl.ACC_SIGMA * float(np.sqrt(fl.DT))
    ours: dict[str, Any] = base | gusts | {
        "state_form": "velocity", "q_V": felt, "q_beta": felt / 190.0, "q_alpha": felt / 190.0,
    }  # fmt: skip
    return {
        "default": NavParams(**(ours | {"model": "random_rates", "q_rate": 0.02})),
        "no_aero": NavParams(**(inertial | gusts)),
        "printed": NavParams(**printed),
        "hybrid": NavParams(**(ours | {"model": "hybrid", "q_rate": EXACT["q_rate"]})),
    }


def rate_noise(error: np.ndarray, m: np.ndarray) -> dict[str, float]:
    """Standard deviation [rad/s] of each rate's error where m [N] is set, of errors [N,15] of the states."""
    return {f"rate.sd_radps.{a}": float(np.std(error[m, RATE.start + i])) for i, a in enumerate("pqr")}


def run_case(case: Case, seed: int) -> RunResult:
    """One flight, its readings, and every estimator of the case on them."""
    p = case.params
    tau, gust = float(p.get("tau_s", 0.0)), float(p.get("sigma_mps", LIGHT))
    wind = str(p["wind"])
    sigma = fl.LARGE if p["noise"] == "large" else fl.SMALL
    flight = fl.fly(wind, float(p["duration_s"]), seed, sigma=gust, leg_s=float(p.get("leg_s", fl.ONE_TURN_S)))
    y = np.hstack([flight.x[:, :12], flight.v]) + fl.noise(len(flight.t), sigma, seed, tau)
    acc = fl.accelerometer(flight, seed)
    after = float(p["after_s"])
    W = flight.x[:, 12:15]
    m = flight.t >= after
    values: dict[str, float] = {"wind.mean_mps": float(np.linalg.norm(W[m], axis=1).mean())}
    values |= {f"read.{k}": v for k, v in rate_noise(y - flight.x, m).items()}
    values["flight.half_turns"] = float(abs(flight.x[-1, 6] - flight.x[0, 6]) / np.pi)
    traces: dict[str, np.ndarray] = {"t": flight.t[::4], "wind_true": W[::4]}
    traces["state_true"], traces["state_read"] = (a[::4, :12].astype(np.float32) for a in (flight.x, y))
    chosen = no_aero_filters(sigma, wind) if p.get("no_aero") else filters(sigma, wind, tau, gust)
    bound = wind_bound(flight, sigma, max(gust, 0.05), SLOW[wind], tau) if p.get("bound") else None
    if bound is not None:
        for i, a in enumerate("ned"):
            values[f"bound.wind.rms_mps.{a}"] = float(np.sqrt(np.mean(bound[m, i] ** 2)))
    for name, params in chosen.items():
        est = run(params, flight, y, acc)
        figures = wind_figures(flight.t, W, est.x[:, 12:15], est.sigma[:, 12:15], after)
        figures |= consistency(flight.t, flight.x, est, after)
        if bound is not None:
            for a in "ned":
                figures[f"pcrb_ratio.{a}"] = figures[f"wind.rms_mps.{a}"] / values[f"bound.wind.rms_mps.{a}"]
        values |= {f"{name}.{k}": v for k, v in figures.items()}
        traces[f"{name}.wind"], traces[f"{name}.sigma"] = est.x[::4, 12:15], est.sigma[::4, 12:15]
        if name in DRAWN:
            traces[f"{name}.state"] = est.x[::4, :12].astype(np.float32)
            traces[f"{name}.state_sigma"] = est.sigma[::4, :12].astype(np.float32)
            values |= {f"{name}.{k}": v for k, v in rate_noise(est.x - flight.x, m).items()}
    cmw = calculated_wind(flight, y)
    values |= {f"cmw.{k}": v for k, v in wind_figures(flight.t, W, cmw, None, after).items()}
    traces["cmw.wind"] = cmw[::4]
    return RunResult(values, traces)


def _white(wind: str, noise: str, **more: Any) -> dict[str, Any]:
    return {"wind": wind, "noise": noise, "duration_s": 250.0, "after_s": 60.0, **more}


def _coloured(wind: str, noise: str, tau_s: float) -> dict[str, Any]:
    return {"wind": wind, "noise": noise, "duration_s": 500.0, "after_s": 150.0, "tau_s": tau_s}


# the thousand seconds of the source's Figure 7.1: legs as long as the first between half turns of two minutes
RACETRACK: dict[str, Any] = _white("ecwm", "small") | {"duration_s": 1000.0, "leg_s": fl.TURN_AT_S}

TABLE = Study(
    name="lee",
    title="Tanker state and wind estimation",
    purpose="the table cases of Lee (2011): the printed method beside this project's, on the same flights and noise",
    cases=(
        Case("tanker_I", _white("sounding", "small", bound=True)),
        Case("tanker_I_sine", _white("sine", "small", bound=True)),
        Case("tanker_II", _white("ecwm", "small", bound=True)),
        Case("tanker_II_racetrack", RACETRACK),
        Case("tanker_III", _white("ecwm", "large", bound=True)),
        Case("tanker_IV", _white("sounding", "large")),
        Case("tanker_IV_sine", _white("sine", "large")),
        Case("tanker_III_no_aero", _white("ecwm", "large", no_aero=True)),
        Case("tanker_IV_no_aero", _white("sounding", "large", no_aero=True)),
        Case("tanker_IV_no_aero_sine", _white("sine", "large", no_aero=True)),
        Case("tanker_II_coloured", _coloured("ecwm", "small", 20.0) | {"bound": True}),
        Case("tanker_III_coloured", _coloured("ecwm", "large", 20.0) | {"bound": True}),
    ),
    run=run_case,
)

COLOUR = Study(
    name="lee_colour",
    title="Colour of the measurement noise",
    purpose="wind error against the correlation time of the noise, small and large set, wind model",
    cases=tuple(
        Case(f"tau_{t:g}{tail}", _coloured("ecwm", noise, t))
        for noise, tail, times in (
            ("small", "", (0.05, 0.2, 1.0, 5.0, 20.0, 50.0, 100.0)),
            ("large", "_large", (0.05, 1.0, 10.0, 20.0, 100.0)),
        )
        for t in times
    ),
    run=run_case,
    small_cases=("tau_0.05*", "tau_20*", "tau_50", "tau_100*"),
)

TURBULENCE = Study(
    name="lee_turbulence",
    title="Turbulence on the tanker",
    purpose="wind error against turbulence intensity, wind model: white small noise, and small and large noise of the source's "
    "tau = 20 s",
    cases=(
        *(Case(f"sigma_{s:g}", _white("ecwm", "small", sigma_mps=s)) for s in (0.0, 0.2, 0.39, 0.8, 1.2, 2.0, 3.0)),
        *(
            Case(f"sigma_{s:g}_coloured{tail}", _coloured("ecwm", noise, 20.0) | {"sigma_mps": s})
            for noise, tail in (("small", ""), ("large", "_large"))
            for s in (0.39, 1.2, 2.0, 3.0)
        ),
    ),
    run=run_case,
    small_cases=("sigma_0.39*", "sigma_3*"),
)

STUDIES = (TABLE, COLOUR, TURBULENCE)
