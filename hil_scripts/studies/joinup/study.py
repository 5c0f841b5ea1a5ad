"""`joinup_turning`: the join-up behind a tanker that begins a turn at any moment, on point masses, the guidance that flies.

A run draws start, wind, side, rate and length of the turn and gyro bias; the cases are the times it begins. Control law,
navigation and wake are not in it: the scenario `joinup` flies those.
"""

from __future__ import annotations

import math

import numpy as np

from flightsw.missions.receiver.joinup import JoinUpParams, closure
from hil_scripts.campaign.study import Case, RunResult, Study
from hil_scripts.studies.joinup.point import DT, PointJoin
from sim_plant.rng import generator

TIMES_S = (20.0, 70.0, 120.0, 170.0, 220.0, 270.0, 320.0, 370.0)
LIMIT_S = 900.0
SEPARATED = 0.8  # share of the vertical separation that counts as separated
SETTLE_S = 5.0  # the start's own closing
PLAIN = JoinUpParams(turning_degps=90.0, keep_out_m=1e-6)  # no rule of a turn, no guard


def flight(at_s: float, seed: int, rules: bool) -> PointJoin:
    """The drawn flight with a turn of the tanker from at_s [s] on."""
    g = generator(seed, "joinup.turning")
    rate = math.radians(float(g.choice([1.0, 1.7]))) * float(g.choice([-1.0, 1.0]))
    return PointJoin(
        x=g.uniform(-5000.0, -3000.0), y=g.uniform(-900.0, 900.0), V=g.uniform(190.0, 210.0),
        wind=(g.uniform(-30.0, 30.0), g.uniform(-30.0, 30.0)), rate_bias=8e-4 * float(g.standard_normal()),
        p=JoinUpParams() if rules else PLAIN, turn_at_s=at_s, turn_radps=rate,
        turn_s=math.radians(float(g.choice([90.0, 180.0]))) / abs(rate), rate_noise=math.radians(0.1), rng=g,
    )  # fmt: skip


def run_one(case: Case, seed: int) -> RunResult:
    """One join-up: least distance, how far ahead near and not well below, closing beyond the profile, when it was ready."""
    f = flight(float(case.params["at_s"]), seed, bool(case.params["rules"]))
    texts = []
    for _ in range(round(LIMIT_S / DT)):
        f.step()
        texts += [t.text for t in f.g.texts]
        f.g.texts.clear()
        if f.g.ready:
            break
    r = np.array(f.track)
    d = np.sqrt((r[:, :3] ** 2).sum(axis=1))
    place = float(np.linalg.norm(f.p.aim_m))
    excess = -np.gradient(d, DT) - np.array([closure(max(v - place, 0.0), f.p) for v in d])
    near = (d < f.p.follow_m) & (r[:, 2] < SEPARATED * f.p.separation_m)
    values = {
        "least_m": float(d.min()),
        "ahead_m": float(r[near, 0].max()) if near.any() else math.nan,
        "closing_excess_mps": float(excess[round(SETTLE_S / DT) :].max()),
        "ready": float(f.g.ready),
        "ready_s": f.t_us * 1e-6 if f.g.ready else math.nan,
        "gave_way": float(any(t.startswith("too near") for t in texts)),
        "inside_60": float(d.min() < 60.0),
    }
    return RunResult(values, {"track": r})


STUDY = Study(
    name="joinup_turning",
    title="Join-up behind a tanker that turns",
    purpose="distance and closing kept when the tanker begins a turn at any moment of the join-up",
    cases=tuple(
        Case(f"{'rules' if rules else 'plain'}_{at:g}", {"at_s": at, "rules": rules})
        for rules in (True, False)
        for at in TIMES_S
    ),
    run=run_one,
    binary=("ready", "gave_way", "inside_60"),
    small_cases=("rules_20", "rules_170", "rules_320", "plain_170"),
)
