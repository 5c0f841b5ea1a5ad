"""The campaign `hoffmann_sensors`: the gust mission on aircraft and sensors not as believed, against the hold."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flightsw.missions.gust import dynamics as k
from flightsw.missions.gust.mission import ALLEVIATION
from flightsw.missions.gust.model import published
from flightsw.missions.gust.reports import GustModel, GustState
from flightsw.missions.gust.servos import GustServos
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.hoffmann import flight as hf
from hil_scripts.studies.hoffmann.errors import Faulty
from hil_scripts.studies.hoffmann.loop import Pilot, held, levels
from hil_scripts.studies.hoffmann.robust import BEFORE, Onboard

HELD_FROM_S = 4.0  # [s] the servos are found out until then
SOUND_FROM_S = 10.0  # [s] what is estimated counts from here


class Seen:
    """What a flight showed: load, what flew, errors of the estimate, words."""

    def __init__(self, samples: int, ticks: int) -> None:
        self.az = np.zeros((samples, ticks))
        self.alleviates = np.zeros(samples, dtype=bool)
        self.off = np.zeros((samples, 2))  # alpha_W [rad], its sigma
        self.model = np.full((samples, 7), np.nan)
        self.warned: list[tuple[float, str]] = []
        self.height = np.zeros(samples)
        self.alpha = np.zeros(samples)


def fly(p: dict[str, Any], seed: int, pilot: Pilot) -> Seen:
    """A flight of the case `p` with a pilot; of the onboard software also what it said."""
    a = Faulty(p, seed)
    way = [np.zeros(3)] * (1 + int(p.get("extra_late_samples", 0)))
    out, servos = Seen(a.samples - 1, a.ticks), GustServos(published())
    for i in range(a.samples - 1):
        way.append(pilot(a, servos).copy())
        was = float(a.truth[k.AW])
        snap = pilot.snap if isinstance(pilot, Onboard) else None
        out.height[i], out.alpha[i] = a.truth[k.H], a.true_alpha
        a.step(way.pop(0))
        out.az[i] = a.vertical
        if snap is None:
            continue
        state, model = snap.report(GustState), snap.report(GustModel)
        out.alleviates[i] = snap.guid.phase == ALLEVIATION
        if state is not None:
            out.off[i] = state.x[k.AW] - was, state.sigma[k.AW]
        if model is not None:
            out.model[i] = (
                model.wn_radps, model.late, model.lift, model.lift_sigma, model.V_bias, model.V_bias_sigma, model.load_ratio,
            )  # fmt: skip
        out.warned += [(i * a.dt, t.text) for t in snap.texts if t.text.startswith("hold:")]
    return out


def run_sensors(case: Case, seed: int) -> RunResult:
    """The same gusts and faults with the hold, with the estimator before and with the bank of servo models."""
    p = case.params
    values: dict[str, float] = {}
    pilots: dict[str, Pilot] = {"hold": held(published())}
    if p.get("before"):
        pilots["bank"] = Onboard(BEFORE)
    pilots["servo_bank"] = Onboard({})
    for name, pilot in pilots.items():
        seen = fly(p, seed, pilot)
        total, low = levels(seen.az.ravel())
        values[f"{name}.a_z_rms_mps2"], values[f"{name}.a_z_low_rms_mps2"] = total, low
        values[f"{name}.height_max_m"] = float(np.abs(seen.height).max())
        values[f"{name}.alpha_max_deg"] = math.degrees(float(np.abs(seen.alpha).max()))
        if name == "hold":
            continue
        values[f"{name}.reduction_total_pct"] = 100.0 * (1.0 - total / values["hold.a_z_rms_mps2"])
        values[f"{name}.reduction_low_pct"] = 100.0 * (1.0 - low / values["hold.a_z_low_rms_mps2"])
        values |= {f"{name}.{key}": v for key, v in _estimate(seen, p).items()}
        if name == "servo_bank":
            values |= {f"{name}.{key}": v for key, v in _found(seen, p).items()}
    return RunResult(values)


def _estimate(s: Seen, p: dict[str, Any]) -> dict[str, float]:
    t = np.arange(len(s.off)) * hf.DT
    used = t >= HELD_FROM_S
    e = s.off[used]
    out = {
        "hold_pct": 100.0 * float(np.mean(~s.alleviates[used])),
        "alpha_w.rms_deg": math.degrees(float(np.sqrt(np.mean(e[:, 0] ** 2)))),
        "alpha_w.inside_2sigma_pct": 100.0 * float(np.mean(np.abs(e[:, 0]) <= 2.0 * e[:, 1])),
        "warnings": float(len(s.warned)),
    }
    if "fault" in p:
        at = float(p["fault"]["at_s"])
        left = np.flatnonzero(~s.alleviates & (t >= at))
        out["left_after_s"] = float(t[left[0]] - at) if len(left) else math.inf
    return out


def _found(s: Seen, p: dict[str, Any]) -> dict[str, float]:
    t = np.arange(len(s.model)) * hf.DT
    m = s.model[(t >= SOUND_FROM_S) & np.isfinite(s.model[:, 0])]
    if not len(m):
        return {}
    lift, fault = float(p.get("lift_factor", 1.0)) - 1.0, p.get("fault", {})
    out = {
        "servo_wn_radps": float(np.median(m[:, 0])),
        "late_samples": float(np.median(m[:, 1])),
        "changes": float(np.sum(np.any(np.diff(m[:, :2], axis=0) != 0.0, axis=1))),
        "lift.mean": float(np.mean(m[:, 2] - lift)),
        "lift.rms": float(np.sqrt(np.mean((m[:, 2] - lift) ** 2))),
        "lift.inside_2sigma_pct": 100.0 * float(np.mean(np.abs(m[:, 2] - lift) <= 2.0 * m[:, 3])),
        "load_ratio_max": float(np.nanmax(m[:, 6])),
    }
    if "grade" not in p:  # else the sensor has a bias of its own
        late = t[(t >= SOUND_FROM_S) & np.isfinite(s.model[:, 0])]
        off = m[:, 4] - np.where(late >= float(fault.get("at_s", 0.0)), float(fault.get("V_mps", 0.0)), 0.0)
        out["V_bias.rms_mps"] = float(np.sqrt(np.mean(off**2)))
        out["V_bias.inside_2sigma_pct"] = 100.0 * float(np.mean(np.abs(off) <= 2.0 * m[:, 5]))
    return out


BASE: dict[str, Any] = {"scale": hf.LIGHT, "duration_s": 40.0}
BEFORE_TOO = BASE | {"before": True}  # flown with the estimator before, besides


def _off(wn: float, late: int = 0, lift: int = 100) -> Case:
    name = f"servo_{wn:g}" + f"_late_{late}" * bool(late) + f"_lift_{lift}" * (lift != 100)
    more = {"servo_wn_radps": wn, "extra_late_samples": late, "lift_factor": 0.01 * lift}
    return Case(name, BASE | more)


def _fault(name: str, at_s: float = 15.0, **what: Any) -> Case:
    return Case(name, BEFORE_TOO | {"fault": {"at_s": at_s, **what}})


SINGLE = (
    Case("nominal", BEFORE_TOO),
    *(_off(wn) for wn in (20.0, 24.0, 28.0, 34.0, 48.0, 56.0, 68.0, 80.0)),
    *(Case(f"lift_{x}", BASE | {"lift_factor": 0.01 * x}) for x in (75, 85, 115)),
    *(Case(f"moment_{x}", BASE | {"moment_factor": 0.01 * x}) for x in (80, 120)),
    *(_fault(f"V_{n}", V_mps=v) for n, v in (("plus_2", 2.0), ("minus_2", -2.0))),
    *(_fault(f"V_{n}_from_start", 0.0, V_mps=v) for n, v in (("plus_2", 2.0), ("minus_2", -2.0))),
)
LATE = (
    *(Case(f"late_{n}", BASE | {"extra_late_samples": n}) for n in (1, 2)),
    *(_off(wn, late) for late in (1, 2) for wn in (20.0, 34.0, 68.0, 80.0)),
    _off(30.0, 1, 115), _off(30.0, 1, 75), _off(80.0, 1, 75), _off(24.0, 0, 115), _off(68.0, 0, 75), _off(24.0, 2, 115),
)  # fmt: skip
FAULTS = (
    _fault("vane_plus_6", vane_deg=6.0), _fault("vane_minus_6", vane_deg=-6.0), _fault("vane_drifts", vane_degps=0.3),
    _fault("vane_stuck", vane="stuck"), _fault("vane_off", vane="off"), _fault("jam_elevator", 20.0, jam="elevator"),
    _fault("jam_flap", 20.0, jam="flap"),
)  # fmt: skip
AIR = (
    Case("full", BEFORE_TOO | {"scale": 1.0, "stall_deg": 12.0}),
    Case("stall", BEFORE_TOO | {"stall_deg": 15.0, "gusts": [[15.0, -14.0]]}),
    Case("calm", BASE | {"scale": 0.01}),
)
TACTICAL = tuple(
    Case(f"tactical_{c.name}", c.params | {"grade": "tactical", "before": c.name == "nominal"})
    for c in (*SINGLE, *LATE)
    if c.name in ("nominal", "servo_20", "servo_80", "lift_75", "lift_115", "V_plus_2", "V_minus_2", "late_1", "late_2")
)
STUDY = Study(
    name="hoffmann_sensors",
    title="Gust load alleviation that finds out about its aircraft",
    purpose="a_z of the estimator before and of the bank of servo models against the hold, on other servos, lift and sensors",
    cases=(*SINGLE, *LATE, *FAULTS, *AIR, *TACTICAL),
    run=run_sensors,
    default_runs=20,
    small_cases=(
        "nominal",
        "servo_20",
        "servo_80",
        "lift_75",
        "V_plus_2",
        "late_2",
        "jam_elevator",
        "tactical_nominal",
    ),
)
