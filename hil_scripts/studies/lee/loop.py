"""Lee (2011), chapter 6 and beyond: the receiver's station keeping in closed loop, at the contact point.

Each run flies every controller of its case on the same seed: the same wind, the same noise, the same aerodynamic errors.
"estimated" is the flight configuration; "measured" feeds raw readings to the same law, "true" the true state; "soft" is the
published kind of gains (with the estimates), "tight" the re-tuned ones.
"""

from __future__ import annotations

from typing import Any

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee.closed_loop import LoopCase, fly

Pairs = tuple[tuple[str, Any], ...]
# the laws a study compares: Bryson weights of position, integral and input
SOFT: Pairs = (
    ("ctrl.w_pos_m", [1.0, 1.0, 1.0]), ("ctrl.w_int_ms", [3.0, 3.0, 3.0]), ("ctrl.w_input", [0.075, 0.05, 0.075, 1250.0]),
)  # fmt: skip
TIGHT: Pairs = (
    ("ctrl.w_pos_m", [0.3, 0.3, 0.3]), ("ctrl.w_int_ms", [0.5, 0.5, 0.5]), ("ctrl.w_input", [0.15, 0.1, 0.15, 2500.0]),
    ("ctrl.soft_sigma_m", [1e3, 2e3]),
)  # fmt: skip
NO_BIAS: Pairs = (("noise.bias_scale", 0.0),)
LIGHT = 0.39  # [m/s]
FAST_S = 0.05  # [s] the other colour of its study of G
TAU_S = 1.0  # [s] colour of the noise the source's limits of turbulence are for


def run_case(case: Case, seed: int) -> RunResult:
    """Every controller named in the case's `controllers` on one seed."""
    p = case.params
    G, tau = float(p.get("G", 1.0)), float(p.get("tau_s", 0.0))
    sigma, delay = float(p.get("sigma_mps", LIGHT)), int(p.get("delay_ticks", 1))
    plant: Pairs = (
        ("noise.scale", G), ("noise.tau_s", tau), ("wind.dryden.sigma_mps", sigma), ("link.actuator_delay_ticks", delay),
        ("link.actuator_jitter_ticks", int(p.get("jitter_ticks", 0))),
    )  # fmt: skip
    for craft in ("tanker", "receiver"):
        plant += ((f"aircraft.{craft}.aero_error_frac", float(p.get("mismatch_pct", 10.0)) / 100.0),)
    if not p.get("biases", True):
        plant += NO_BIAS
    known: Pairs = (("nav.noise_scale", G),)
    receiver_colour: Pairs = ()
    if tau > 0.0:
        # noise states on the receiver, a scaled R on the tanker: its states would hand slow errors over the link
        known += (("nav.colour_tau_s", tau), ("nav.colour", "scaled"))
        receiver_colour = (("nav.colour", str(p.get("colour", "augmented"))),)
    design: Pairs = (
        (("ctrl.schedule.delay_s", 0.01 * delay + 0.005),) if delay > 1 and p.get("delay_known", True) else ()
    )
    known_ticks = delay if p.get("delay_known", True) else 1
    more = tuple((k, v) for k, v in p.get("receiver", {}).items())
    controllers: dict[str, tuple[str, Pairs]] = {
        "estimated": ("estimated", ()),
        "measured": ("measured", ()),
        "true": ("true", ()),
        "soft": ("estimated", SOFT),
        "tight": ("estimated", TIGHT),
        "with_rotation": ("estimated", (("nav.rotational_wind", True),)),
    }
    values: dict[str, float] = {}
    traces: dict[str, Any] = {}
    for name in p["controllers"]:
        feedback, gains = controllers[name]
        c = LoopCase(
            duration_s=float(p.get("duration_s", 150.0)), feedback=feedback, plant=plant, tanker=known + design,
            receiver=known + receiver_colour + design + gains + more, turn_at_s=float(p.get("turn_at_s", 0.0)),
            known_delay_ticks=known_ticks,
        )  # fmt: skip
        figures, tr = fly(c, seed)
        values |= {f"{name}.{k}": v for k, v in figures.items()}
        traces |= {"t": tr["t"], "wind_true": tr["wind_true"]} if not traces else {}
        if name == "estimated":
            traces |= {"estimated.wind": tr["wind"], "estimated.sigma": tr["sigma"]}
        traces[f"{name}.error"] = tr["error"]
    return RunResult(values, traces)


BOTH = ["estimated", "measured", "true"]


def _study(name: str, title: str, purpose: str, cases: tuple[Case, ...]) -> Study:
    return Study(name=name, title=title, purpose=purpose, cases=cases, run=run_case, default_runs=20)


RECEIVER = _study(
    "lee_receiver",
    "Receiver at contact",
    "station keeping with 10 % aerodynamic error and the link's delay: white and coloured noise, straight and in a turn",
    (
        Case("white", {"controllers": [*BOTH, "soft", "tight"]}),
        Case("turn", {"controllers": ["estimated", "soft"], "duration_s": 250.0, "turn_at_s": 80.0}),
        Case("coloured_1", {"tau_s": 1.0, "controllers": [*BOTH, "soft"]}),
        Case("coloured_1_scaled", {"tau_s": 1.0, "colour": "scaled", "controllers": ["estimated", "soft"]}),
        Case("coloured_0.05", {"tau_s": 0.05, "controllers": ["estimated", "measured"]}),
    ),
)
NOISE = _study(
    "lee_noise",
    "Noise factor",
    "station keeping against the factor G on all sensor noise, white and of the source's colours (tau = 1 s and, fast, 0.05 s); "
    "the filter knows the grade of its sensors",
    (
        *(Case(f"G_{g:g}", {"G": g, "controllers": BOTH[:2]}) for g in (0.3, 0.6, 1.0, 3.0, 5.0, 7.0)),
        *(Case(f"G_{g:g}_coloured", {"G": g, "tau_s": TAU_S, "controllers": BOTH[:2]}) for g in (1.0, 3.0, 7.0)),
        *(Case(f"G_{g:g}_fast", {"G": g, "tau_s": FAST_S, "controllers": BOTH[:2]}) for g in (0.6, 1.0, 3.0)),
    ),
)
GUST = _study(
    "lee_gust",
    "Turbulence, closed loop",
    "station keeping against turbulence intensity, in white noise and in noise of the source's colour (tau = 1 s); filter and "
    "gains as in flight, not retuned",
    (
        *(Case(f"sigma_{s:g}", {"sigma_mps": s, "controllers": BOTH}) for s in (0.0, 0.39, 1.2, 2.0, 2.5, 3.0)),
        *(
            Case(f"sigma_{s:g}_coloured", {"sigma_mps": s, "tau_s": TAU_S, "controllers": BOTH[:2]})
            for s in (0.39, 1.2, 2.0, 3.0)
        ),
    ),
)
MISMATCH = _study(
    "lee_mismatch",
    "Aerodynamic mismatch",
    "station keeping against the error of every aerodynamic coefficient of both aircraft",
    tuple(
        Case(f"mismatch_{m:g}", {"mismatch_pct": m, "controllers": ["estimated"]}) for m in (0.0, 5.0, 10.0, 15.0, 25.0)
    ),
)
LATENCY = _study(
    "lee_latency",
    "Input latency",
    "station keeping against the delay of commands in base ticks of 10 ms: known to the design, and one more or varying",
    (
        *(Case(f"delay_{d}", {"delay_ticks": d, "controllers": ["estimated"]}) for d in (1, 2, 5, 10, 15)),
        Case("unknown_2", {"delay_ticks": 2, "delay_known": False, "controllers": ["estimated"]}),
        Case("unknown_5", {"delay_ticks": 5, "delay_known": False, "controllers": ["estimated", "soft"]}),
        Case("jitter_1", {"jitter_ticks": 1, "controllers": ["estimated"]}),
    ),
)
STUDIES = (RECEIVER, NOISE, GUST, MISMATCH, LATENCY)
