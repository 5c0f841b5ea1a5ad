"""Sevil (2013) in closed loop: the receiver flies at contact on its own estimates while air data, relative sensor or link fail.

Every run is a whole flight through the real link (scenario `airdata`), begun at pre-contact; `sevil_loop_approach` flies it all.
"""

from __future__ import annotations

import math
from typing import Any

from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.sevil.loop_figures import figures, leg_figures
from hil_scripts.studies.sevil.loop_flight import Setting, fly

DEG = math.radians(1.0)
START_S, FOR_S = 75.0, 30.0  # of a fault at contact, which is reached at 59 s
SLOW_S, SLOW_END_S = 60.0, 145.0  # of a slow drift
Event = dict[str, Any]


def air(kind: str, index: int = -1, channel: str = "", *value: float, for_s: float = FOR_S, **more: Any) -> Event:
    """Event: a fault of the receiver's air data. Probes: 0 nose, 1 left tip, 2 right tip."""
    return {"t_s": START_S, "kind": kind, "target": "receiver", "sensor": "air", "index": index, "channel": channel,
            "for_s": for_s, **({"value": list(value)} if value else {}), **more}  # fmt: skip


REL_LOST: Event = {"t_s": START_S, "kind": "off", "target": "receiver", "sensor": "rel", "for_s": 30.0}
LINK_LOST: Event = {"t_s": START_S, "kind": "link_loss", "target": "tanker", "for_s": 20.0}
TURN = ["tanker.guid.first_leg_s=62"]
AIR_ONLY = ["receiver.airdata.aid.velocity=false"]
WEIGHT = ["receiver.airdata.wake.mass_kg=132222"]  # the plant's tanker is 10 % lighter than the receiver believes
TAIL = ["plant.wind.wake.tail_lift_frac=-0.03"]
HEIGHT = ["receiver.airdata.wake.wing_m=[-0.27, 0.0, 0.02]"]  # the plant's vortices 0.5 m lower
OFFSETS = [  # each probe wrong by its own for good
    "plant.sensors.receiver.air.V_bias_std_mps=0.3",
    *(f"plant.sensors.receiver.air.{flow}_bias_std={0.1 * DEG}" for flow in ("alpha", "beta")),
]
OWN_AIR = ["plant.wind.dryden.sigma_mps=1.5", "plant.wind.dryden.over='field'"]  # each probe in its own turbulence
NO_STATE = ["receiver.airdata.position.height=false"]
FAULTS: dict[str, list[Event]] = {
    "V_bias": [air("bias", 0, "V", 3.0)],
    "beta_bias": [air("bias", 1, "beta", DEG)],
    "alpha_bias": [air("bias", 2, "alpha", -DEG)],
    "beta_small": [air("bias", 0, "beta", 0.3 * DEG)],
    "beta_drift": [air("drift", 1, "beta", 0.1 * DEG)],
    "V_stuck": [air("stuck", 1, "V")],
    "alpha_stuck": [air("stuck", 1, "alpha")],
    "beta_garbage": [air("garbage", 0, "beta", 2.0 * DEG)],
    "alpha_intermittent": [air("intermittent", 2, "alpha", 0.5)],
    "alpha_delayed": [air("delayed", 0, "alpha", samples=20)],
    "beta_off": [air("off", 2, "beta")],
    "probe_off": [air("off", 0)],
    "probe_bias": [air("bias", 0, "", 3.0, DEG, DEG)],
    "probe_stuck": [air("stuck", 1)],
    "two_channels": [air("bias", 1, "beta", DEG), air("bias", 2, "alpha", -DEG)],
}
# drifts that look like a shift of position: of one vane, and of both tips against each other (up or down; sideways)
SLOW: dict[str, list[Event]] = {
    "drift_beta_nose": [air("drift", 0, "beta", 0.005 * DEG, for_s=SLOW_S)],
    "drift_beta_tips": [
        air("drift", 1, "beta", 0.005 * DEG, for_s=SLOW_S), air("drift", 2, "beta", -0.005 * DEG, for_s=SLOW_S)],
    "drift_alpha_tips": [
        air("drift", 1, "alpha", 0.005 * DEG, for_s=SLOW_S), air("drift", 2, "alpha", -0.005 * DEG, for_s=SLOW_S)],
}  # fmt: skip


# two vanes alike, which look like the third; every airspeed at once, as ice has it
ALIKE: dict[str, list[Event]] = {
    "alike": [air("bias", 1, "beta", DEG), air("bias", 2, "beta", DEG)],
    "alike_small": [air("bias", 1, "alpha", 0.3 * DEG), air("bias", 2, "alpha", 0.3 * DEG)],
    "alike_drift": [air("drift", 1, "beta", 0.05 * DEG), air("drift", 2, "beta", 0.05 * DEG)],
}
ICE: dict[str, list[Event]] = {
    "iced": [air("bias", -1, "V", -10.0)],
    "icing": [air("drift", -1, "V", -0.5)],
}
# a minute at contact without the relative sensor, bounds on: with the boom latched, without it, without GNSS as well
LOST_S = 60.0
BOUNDED = ["receiver.integrity.on=true"]


def lost(*sensors: str) -> list[Event]:
    """Events: these sensors of the receiver are silent for LOST_S."""
    return [{"t_s": START_S, "kind": "off", "target": "receiver", "sensor": s, "for_s": LOST_S} for s in sensors]


def run_case(case: Case, seed: int) -> RunResult:
    """One flight of a case: `events`, `sets`, `duration_s`; `approach`: from the observation position."""
    p = case.params
    events = tuple(p.get("events", ()))
    s = Setting(float(p.get("duration_s", 120.0)), events, tuple(p.get("sets", ())), not p.get("approach", False))
    tr = fly(s, seed)
    values = leg_figures(tr) if p.get("approach") else figures(tr, events)
    traces = {"t": tr.t, "xi": tr.xi, "wake": tr.wake, "sigma": tr.sigma, "excluded": tr.excluded}
    return RunResult(values, traces)


def _case(name: str, events: list[Event], *sets: str, duration_s: float = 120.0) -> Case:
    return Case(name, {"events": events, "sets": list(sets), "duration_s": duration_s})


STATION = Study(
    name="sevil_loop",
    title="Air data in closed loop",
    purpose="flights at contact with three air-data probes: faults of probes, loss of relative sensor and data link, a wake "
    "unlike the model; plant, link and onboard software as in flight",
    cases=(
        _case("nominal", []),
        _case("air_only", [], *AIR_ONLY),
        _case("offsets", [], *OFFSETS),
        _case("own_air", [], *OWN_AIR),
        _case("offsets_own_air", [], *OFFSETS, *OWN_AIR),
        _case("turn", [], *TURN),
        *(_case(k, v) for k, v in FAULTS.items()),
        *(_case(k, v, duration_s=SLOW_END_S) for k, v in SLOW.items()),
        *(_case(k, v) for k, v in {**ALIKE, **ICE}.items()),
        _case("rel_lost", [REL_LOST]),
        _case("rel_lost_minute", lost("rel"), duration_s=SLOW_END_S),
        _case("rel_lost_latched", lost("rel"), *BOUNDED, duration_s=SLOW_END_S),
        _case("rel_lost_no_boom", lost("rel", "boom"), *BOUNDED, duration_s=SLOW_END_S),
        _case("air_alone", lost("rel", "boom", "gnss"), *BOUNDED, duration_s=SLOW_END_S),
        _case("rel_lost_turn", [REL_LOST], *TURN),
        _case("rel_lost_air_only", [REL_LOST], *AIR_ONLY),
        _case("link_lost", [LINK_LOST]),
        _case("link_lost_turn", [LINK_LOST], *TURN, duration_s=95.0),
        _case("both_lost", [LINK_LOST, {**REL_LOST, "t_s": START_S + 5.0, "for_s": 15.0}]),
        _case("weight", [], *WEIGHT),
        _case("tail", [], *TAIL),
        _case("weight_tail", [], *WEIGHT, *TAIL),
        _case("weight_tail_rel_lost", [REL_LOST], *WEIGHT, *TAIL),
        _case("height", [], *HEIGHT),
        _case("height_no_state", [], *HEIGHT, *NO_STATE),
    ),
    run=run_case,
    default_runs=20,
    small_cases=("nominal", "air_only", "V_bias", "beta_bias", "probe_off", "rel_lost", "link_lost", "weight_tail"),
    binary=("left_box", "breakaway", "false_exclusion", "isolated", "readmitted"),
)
APPROACH = Study(
    name="sevil_loop_approach",
    title="Air data on the whole approach",
    purpose="wake position on every leg from the observation position to contact, as in flight",
    cases=tuple(
        Case(name, {"approach": True, "sets": list(sets), "duration_s": 285.0})
        for name, sets in (("nominal", []), ("air_only", AIR_ONLY), ("weight_tail", [*WEIGHT, *TAIL]))
    ),
    run=run_case,
    default_runs=20,
    binary=("left_box",),
)
STUDIES = (STATION, APPROACH)
