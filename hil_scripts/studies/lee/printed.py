"""Lee (2011), sections 2.4, 6 and 7.4: the receiver's law and estimator as printed, at the contact point behind the tanker.

Every controller of a case flies the same seed. The default law of this project flies in lee_receiver, lee_noise and lee_gust.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.lee.printed_filter import Tune
from hil_scripts.studies.lee.printed_law import Weights
from hil_scripts.studies.lee.printed_loop import Setting, fly

BOTH = ("estimated", "measured")
# chosen in the scan: below a softness of about two the servos and twenty samples a second make the loop unstable, above four z
# suffers; a Q well below the turbulence keeps gusts out of the airspeed that is fed back, at the price of the filter's honesty
SOFT, Q_WIND = 3.0, 0.03  # [-], [m/s/sqrt(s)]
FREE = ("feedback", "weights", "tune", "tanker_tune")  # of a Setting; the rest are keys of a case


def setting(p: dict[str, Any], feedback: str) -> Setting:
    """The flight of a case's params with one kind of feedback."""
    own = {k: v for k, v in p.items() if k in Setting.__dataclass_fields__ and k not in FREE}
    w = Weights(**{k: tuple(v) for k, v in p.get("weights", {}).items()}).softer(float(p.get("soft", SOFT)))
    return Setting(feedback=feedback, weights=w, tune=Tune(**({"q_wind": Q_WIND} | p.get("tune", {}))), **own)


def run_case(case: Case, seed: int) -> RunResult:
    """Every kind of feedback named in the case's `controllers` on one seed; traces of the first."""
    values: dict[str, float] = {}
    traces: dict[str, np.ndarray] = {}
    for name in case.params["controllers"]:
        figures, tr = fly(setting(case.params, name), seed)
        values |= {f"{name}.{k}": v for k, v in figures.items()}
        traces |= {k: tr[k] for k in ("t", "wind_true") if not traces}
        traces |= {f"{name}.{k}": tr[k] for k in ("error", "wind", "sigma")}
    return RunResult(values, traces)


def _case(name: str, controllers: tuple[str, ...] = BOTH, **p: Any) -> Case:
    return Case(name, {"controllers": list(controllers), **p})


NOISE: dict[str, dict[str, Any]] = {"": {}, "_coloured": {"wind": "ecwm", "tau_s": 1.0}}
RECEIVER = Study(
    name="lee_printed",
    title="Receiver as printed",
    purpose="the fixed-gain law and the receiver's estimator as printed at the contact point, readings of Table 2.2, exact "
    "aerodynamics: against noise, its colour and turbulence",
    cases=(
        _case("white"),
        _case("turn", duration_s=250.0, turn_at_s=80.0),
        _case("coloured_1", wind="ecwm", tau_s=1.0),
        *(_case(f"G_{g:g}", G=g) for g in (0.3, 0.6, 3.0, 7.0)),
        *(_case(f"G_{g:g}_coloured", wind="ecwm", tau_s=1.0, G=g) for g in (3.0, 7.0)),
        *(_case(f"G_{g:g}_fast", wind="ecwm", tau_s=0.05, G=g) for g in (1.0, 3.0)),
        *(_case(f"sigma_{s:g}_coloured", wind="ecwm", tau_s=1.0, sigma_mps=s) for s in (1.2, 2.0, 3.0)),
    ),
    run=run_case,
    small_cases=("white", "coloured_1"),
)
SCAN = Study(
    name="lee_printed_scan",
    title="Weights of the printed law",
    purpose="what Lee (2011) does not print of the receiver's half: weight of the inputs and root of the wind's Q, estimated "
    "feedback, white and coloured noise",
    cases=tuple(
        _case(f"soft_{f:g}_q_{q:g}{tail}", ("estimated",), soft=f, tune={"q_wind": q}, **noise)
        for tail, noise in NOISE.items()
        for f in (1.0, 2.0, 3.0, 4.0, 8.0)
        for q in (0.03, 0.1, 0.33)
    ),
    run=run_case,
    small_cases=("soft_1_q_0.03", "soft_2_q_0.03"),
)
STUDIES = (RECEIVER, SCAN)
